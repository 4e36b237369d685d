//! Cost of a sample in the node: from the arrival of the message that completes it to the mesh,
//! with view, features and recording beside it. A ball slides over a wavy plate in real time,
//! wrench and pose each at 1 kHz.
//!
//! - `cargo bench --bench node [-- FACES…]`: alone; the bench puts arrivals into the inbox.
//! - `cargo bench --bench node --features web -- pages [FACES [TURNS]]`: the same beside pages:
//!   none, one that reads, and one that never reads, by turns; at the end the middle p99 of each
//!   against that without a page.
//! - `cargo bench --bench node -- dds [FACES [SECONDS [FOLDER]]]`: sensors and viewer are a process
//!   each, over DDS on the loopback interface; before and after it a bare echo over the same. 600 s
//!   is the soak, which prints memory each minute. Into `FOLDER` go plots and a table of each
//!   second.

#[path = "node/course.rs"]
mod course;
mod memory;
#[cfg(feature = "web")]
#[path = "node/pages.rs"]
mod pages;
#[path = "node/peer.rs"]
mod peer;

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use memory::resident;
use peer::wall_ns;
use serde::Serialize;
use serde::de::DeserializeOwned;
use touchup::clock::Clock;
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::io::recording::LiveMessage;
use touchup::live::Quantiles;
use touchup::node::{INBOX, Node, PreparedNode, SessionReport};
use touchup::ros::arguments::NodeConfig;
use touchup::ros::in_process::OtherParticipants;
use touchup::ros::inbox::inbox;
use touchup::ros::messages::{
    HapticMismatch, Header, Point, Pose, PoseStamped, Quaternion, Time, Vector3, Wrench,
    WrenchStamped,
};
use touchup::ros::parameters::{ParameterValue, Parameters};
use touchup::ros::port::{Arrival, Publication};
use touchup::ros::{dds, in_process};
use touchup::sim::wavy::{RADIUS, slide, wavy_plate};
use touchup::stylus::{Message, Sample, StampedPose, StampedWrench};

/// Width of the raster, m: 2.3 minutes each time, so that a soak comes to the same places again and
/// again.
const WIDTH: f64 = 20e-3;
/// Duration of the sliding in process.
const SECONDS: usize = 20;
/// Duration of the echo measurement.
const ECHO_SECONDS: usize = 10;

fn header(stamp_ns: i64, frame: &str) -> Header {
    let (sec, nanosec) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
    Header {
        stamp: Time {
            sec: sec as i32,
            nanosec: nanosec as u32,
        },
        frame_id: frame.to_owned(),
    }
}

fn messages(sample: &Sample) -> (WrenchStamped, PoseStamped) {
    let (p, q) = (sample.pose_ot.translation.vector, sample.pose_ot.rotation);
    let pose = Pose {
        position: Point {
            x: p.x,
            y: p.y,
            z: p.z,
        },
        orientation: Quaternion {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        },
    };
    let force = sample.wrench.force;
    let wrench = Wrench {
        force: Vector3 {
            x: force.x,
            y: force.y,
            z: force.z,
        },
        torque: Vector3::default(),
    };
    (
        WrenchStamped {
            header: header(sample.stamp_ns, "stylus"),
            wrench,
        },
        PoseStamped {
            header: header(sample.stamp_ns, "object"),
            pose,
        },
    )
}

fn shown(
    Quantiles {
        median,
        p99,
        p999,
        max,
    }: Quantiles,
) -> String {
    let us = |ns: u64| ns as f64 * 1e-3;
    format!(
        "p50 {:.1} us p99 {:.0} p99.9 {:.0} max {:.0}",
        us(median),
        us(p99),
        us(p999),
        us(max)
    )
}

fn print_summary(report: &SessionReport) {
    println!(
        "accepted {} dropped {:?} refused {:?} unrecorded {}; work {}; from arrival to answer {}; touches shown after {}; {} view \
         frames dropped, {} of {} renewals late",
        report.accepted,
        report.dropped,
        report.refused,
        report.unrecorded,
        shown(report.push_ns),
        shown(report.latency_ns),
        shown(report.patch_behind_ns),
        report.dropped_view_frames,
        report.late_renewals,
        report.renewals
    );
}

fn parameters(folder: &Path, faces: usize) -> Parameters {
    let mesh = wavy_plate(faces).expect("it can be counted");
    let scan = folder.join("scan.ply");
    write_mesh(&scan, &mesh, MeshUnit::Millimetre).expect("the folder is there");
    println!("{} faces", mesh.face_count());
    let text = |path: &Path| ParameterValue::String(path.display().to_string());
    let mut parameters = Parameters::default();
    parameters
        .set("scan", &text(&scan))
        .expect("a path is text");
    parameters
        .set("session_folder", &text(folder))
        .expect("a path is text");
    parameters
        .set("tip_radius_mm", &ParameterValue::Double(RADIUS * 1e3))
        .expect("a radius is a number");
    parameters
}

fn alone(faces: usize) {
    let folder = tempfile::tempdir().expect("there is room in the folder for temporary files");
    let (inbox, received) = inbox(INBOX, &Clock::system());
    let (port, world) = in_process::start(inbox, &Clock::system());
    let ready = PreparedNode::new(parameters(folder.path(), faces)).expect("the scan is sound");
    let node = ready
        .start(port, received, None)
        .expect("there are threads");
    print_summary(&slid_over(node, &world));
}

/// Touches a node for [`SECONDS`] in real time; returns its report.
fn slid_over(node: Node, world: &OtherParticipants) -> SessionReport {
    let mut published = 0;
    let begun = Instant::now();
    for i in 0..1000 * SECONDS {
        sleep(Duration::from_millis(i as u64).saturating_sub(begun.elapsed()));
        let Sample {
            stamp_ns,
            pose_ot,
            wrench,
        } = slide(i, WIDTH);
        for (frame, message) in [
            (
                "stylus",
                Message::Wrench(StampedWrench { stamp_ns, wrench }),
            ),
            ("object", Message::Pose(StampedPose { stamp_ns, pose_ot })),
        ] {
            let frame = frame.to_owned();
            let arrival = Arrival::Message(LiveMessage { frame, message }, Instant::now());
            // the report counts samples that find no room
            let _ = world.arrive(arrival);
        }
        if i % 20 == 0 {
            published += world.published().len();
        }
    }
    println!(
        "{:.1} s, {published} messages out",
        begun.elapsed().as_secs_f64()
    );
    world.arrive_patiently(Arrival::Shutdown);
    node.join().expect("the result can be written").report
}

/// The same beside pages, by turns, so that other load of the machine falls on all of them.
#[cfg(feature = "web")]
#[expect(clippy::too_many_lines)]
fn beside_pages(faces: usize, turns: usize) {
    use touchup::page::{NodeFacts, WebParams, WebServer};
    let kinds = ["no page", "a page that reads", "a page that never reads"];
    let mut p99 = kinds.map(|_| Vec::new());
    for turn in 0..turns {
        for (kind, p99) in kinds.into_iter().zip(&mut p99) {
            let folder =
                tempfile::tempdir().expect("there is room in the folder for temporary files");
            let (inbox, received) = inbox(INBOX, &Clock::system());
            let (port, world) = in_process::start(inbox.clone(), &Clock::system());
            let ready =
                PreparedNode::new(parameters(folder.path(), faces)).expect("the scan is sound");
            let address = ([127, 0, 0, 1], 0).into();
            let params = WebParams {
                address,
                names: Vec::new(),
                by_link: false,
                certificate: None,
            };
            let (scan, session_folder) = ("scan.ply".into(), folder.path().to_owned());
            let (scan_faces, mesh_unit) = (ready.scan().1, ready.mesh_unit());
            let facts = NodeFacts {
                scan,
                scan_faces,
                session_folder,
                nominal: None,
                nominal_file: None,
                mesh_unit,
                is_size_confirmed: true,
            };
            let page = WebServer::open(&params, |_| ()).expect("a port is free");
            let port = page
                .serve_node(facts, inbox, ready.mesh_feed(), port)
                .expect("the services have names");
            let address = page.urls()[0]
                .trim_start_matches("http://")
                .parse()
                .expect("it is an address");
            let _stuck = match kind {
                "no page" => None,
                "a page that reads" => {
                    pages::reading(address);
                    None
                }
                _ => Some(pages::stuck(address)),
            };
            let node = ready
                .start(port, received, None)
                .expect("there are threads");
            let report = slid_over(node, &world);
            println!(
                "{turn} {kind}: work {}; answer {}; dropped {:?}",
                shown(report.push_ns),
                shown(report.latency_ns),
                report.dropped
            );
            p99.push(report.push_ns.p99);
        }
    }
    let middle = p99.map(|mut p99| {
        p99.sort_unstable();
        p99.get(p99.len() / 2).map_or(f64::NAN, |ns| *ns as f64)
    });
    for (kind, middle_ns) in kinds.into_iter().zip(middle) {
        println!(
            "{kind}: middle p99 of {turns} {:.0} us, {:.2} of that without a page",
            middle_ns / 1e3,
            middle_ns / middle[0]
        );
    }
}

/// This program again, as another end.
///
/// - `out`: file of its observations.
fn other(role: &str, domain: u16, seconds: usize, out: &Path) -> Command {
    let mut program = Command::new(std::env::current_exe().expect("a program knows where it is"));
    program
        .args([role, &domain.to_string(), &seconds.to_string()])
        .arg(out);
    program
}

fn started(command: &mut Command) -> Child {
    command.spawn().expect("what runs can be started again")
}

fn check(mut child: Child) {
    assert!(
        child.wait().is_ok_and(|status| status.success()),
        "another process failed"
    );
}

/// Observations that another end wrote.
fn written<T: DeserializeOwned>(path: &Path) -> T {
    let text = std::fs::read(path).expect("the other process wrote it");
    serde_json::from_slice(&text).expect("it is as it is read")
}

/// A viewer process; dropping it here ends it.
struct Viewer {
    child: Child,
    said: BufReader<ChildStdout>,
}

impl Viewer {
    /// Returns when it has the mesh.
    fn start(domain: u16, out: &Path) -> Self {
        let mut child = started(
            other("viewer", domain, 0, out)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped()),
        );
        let mut said = BufReader::new(child.stdout.take().expect("it was asked for"));
        let mut line = String::new();
        said.read_line(&mut line).expect("it speaks in UTF-8");
        print!("{line}");
        Self { child, said }
    }

    fn end(mut self) {
        drop(self.child.stdin.take());
        std::io::copy(&mut self.said, &mut std::io::stdout()).expect("stdout is there");
        check(self.child);
    }
}

fn config(domain: u16, parameters: Parameters) -> NodeConfig {
    let variable = |name: &str| match name {
        "ROS_DOMAIN_ID" => Some(domain.to_string()),
        "ROS_LOCALHOST_ONLY" => Some("1".to_owned()),
        _ => None,
    };
    NodeConfig {
        parameters,
        ..NodeConfig::new(&[], variable).expect("the domain is in its range")
    }
}

/// Answers wrenches over DDS, and does nothing else.
fn echo(domain: u16, folder: &Path) {
    let (inbox, arrivals) = inbox(INBOX, &Clock::system());
    let port = dds::start(&config(domain, Parameters::default()), inbox.clone())
        .expect("the loopback interface is up");
    let asking = started(&mut other(
        "echo",
        domain,
        ECHO_SECONDS,
        &folder.join("echo.json"),
    ));
    let waiting = std::thread::spawn(move || {
        check(asking);
        inbox.put(Arrival::Shutdown);
    });
    while let Some(arrival) = arrivals.recv() {
        match arrival {
            Arrival::Message(of, _) if matches!(of.message, Message::Wrench(_)) => {
                port.publish(Publication::Mismatch(HapticMismatch {
                    header: header(of.message.stamp_ns(), &of.frame),
                    ..HapticMismatch::default()
                }));
            }
            Arrival::Shutdown => break,
            _ => {}
        }
    }
    waiting.join().expect("the other process ends well");
}

fn over_dds(faces: usize, seconds: usize, plots: Option<&Path>) {
    // a domain unlikely to be in use: those above 101 take ports that Linux gives away
    let domain = 1 + (std::process::id() % 100) as u16;
    let folder = tempfile::tempdir().expect("there is room in the folder for temporary files");
    echo(domain, folder.path());
    let parameters = parameters(folder.path(), faces);
    let (inbox, received) = inbox(INBOX, &Clock::system());
    let ready = PreparedNode::new(parameters.clone()).expect("the scan is sound");
    let port = dds::start(&config(domain, parameters), inbox.clone())
        .expect("the loopback interface is up");
    let node = ready
        .start(port.clone(), received, None)
        .expect("there are threads");
    let [answers, drawn] = ["answers.json", "drawn.json"].map(|name| folder.path().join(name));
    let viewer = Viewer::start(domain, &drawn);
    let mut sensors = started(&mut other("sensors", domain, seconds, &answers));
    let (begun, mut minute, mut memory) = (Instant::now(), 0, Vec::new());
    let is_well = loop {
        memory.push((wall_ns(), resident()));
        if begun.elapsed().as_secs() >= 60 * minute {
            println!("{minute:3} min: {:.0} MB", resident());
            minute += 1;
        }
        if let Some(status) = sensors.try_wait().expect("it is ours") {
            break status.success();
        }
        sleep(Duration::from_millis(100));
    };
    assert!(is_well, "the sensors failed");
    viewer.end();
    println!("at the end {:.0} MB", resident());
    check(started(&mut other("late", domain, 0, &drawn)));
    println!(
        "lost in transport {:?}, unsent {:?}",
        port.lost(),
        port.unsent()
    );
    inbox.put(Arrival::Shutdown);
    print_summary(&node.join().expect("the result can be written").report);
    drop(port);
    if let Some(plots) = plots {
        course::write(plots, faces, &written(&answers), &written(&drawn), &memory);
    }
    echo(domain, folder.path());
}

fn write(seen: &impl Serialize, path: Option<&Path>) {
    let text = serde_json::to_vec(seen).expect("numbers have a JSON form");
    std::fs::write(path.expect("the command line names the file"), text)
        .expect("there is room in the folder");
}

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    let numbers: Vec<usize> = arguments
        .iter()
        .filter_map(|argument| argument.parse().ok())
        .collect();
    let number = |at: usize, default: usize| numbers.get(at).copied().unwrap_or(default);
    let path = arguments.get(3).map(Path::new);
    match arguments.first().map(String::as_str) {
        Some("dds") => over_dds(number(0, 1_000_000), number(1, 30), path),
        Some(role @ ("echo" | "sensors")) => {
            write(
                &peer::touch(number(0, 0) as u16, number(1, 0), role == "sensors"),
                path,
            );
        }
        Some("viewer") => write(&peer::view(number(0, 0) as u16), path),
        Some("late") => peer::join_late(number(0, 0) as u16),
        #[cfg(feature = "web")]
        Some("pages") => beside_pages(number(0, 1_000_000), number(1, 3)),
        _ if numbers.is_empty() => [100_000, 1_000_000].into_iter().for_each(alone),
        _ => numbers.into_iter().for_each(alone),
    }
}
