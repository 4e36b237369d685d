//! What a sample costs in the node: from the arrival of what completes it to the mesh, with view, features and recording
//! beside it. A ball slides over a wavy plate in real time, wrench and pose each at 1 kHz.
//!
//! `cargo bench --bench node [-- FACES…]`

#[path = "common/slide.rs"]
mod slide;
#[path = "../tests/common/wavy.rs"]
mod wavy;

use std::sync::mpsc::sync_channel;
use std::thread::sleep;
use std::time::{Duration, Instant};

use slide::sample;
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::ros::clock::steady_ns;
use touchup::ros::in_process::start;
use touchup::ros::messages::{Header, Point, Pose, PoseStamped, Quaternion, Time, Vector3, Wrench, WrenchStamped};
use touchup::ros::node::{INBOX, Node};
use touchup::ros::parameters::{ParameterValue, Parameters};
use touchup::ros::port::Arrival;
use touchup::touch::Sample;
use wavy::wavy_plate;

/// Width of the raster, m.
const WIDTH: f64 = 0.8 * wavy::SIDE;
/// So long it slides.
const SECONDS: usize = 20;

fn header(stamp_ns: i64, frame: &str) -> Header {
    let (sec, nanosec) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
    Header { stamp: Time { sec: sec as i32, nanosec: nanosec as u32 }, frame_id: frame.to_owned() }
}

fn arrivals(sample: &Sample) -> [Arrival; 2] {
    let (p, q) = (sample.pose_ot.translation.vector, sample.pose_ot.rotation);
    let pose =
        Pose { position: Point { x: p.x, y: p.y, z: p.z }, orientation: Quaternion { x: q.i, y: q.j, z: q.k, w: q.w } };
    let force = sample.wrench.force;
    let wrench = Wrench { force: Vector3 { x: force.x, y: force.y, z: force.z }, torque: Vector3::default() };
    [
        Arrival::Wrench(WrenchStamped { header: header(sample.stamp_ns, "stylus"), wrench }, steady_ns()),
        Arrival::Pose(PoseStamped { header: header(sample.stamp_ns, "object"), pose }, steady_ns()),
    ]
}

fn run(faces: usize) {
    let folder = tempfile::tempdir().expect("there is room in the folder for temporary files");
    let mesh = wavy_plate(faces);
    let scan = folder.path().join("scan.ply");
    write_mesh(&scan, &mesh, MeshUnit::Millimetre).expect("the folder is there");
    let text = |path: &std::path::Path| ParameterValue::String(path.display().to_string());
    let mut parameters = Parameters::default();
    parameters.set("scan", &text(&scan)).expect("a path is text");
    parameters.set("session_folder", &text(folder.path())).expect("a path is text");
    let (inbox, received) = sync_channel(INBOX);
    let (port, world) = start(inbox);
    let node = Node::start(parameters, port, received).expect("the scan is sound");
    let mut published = 0;
    let begun = Instant::now();
    for i in 0..1000 * SECONDS {
        sleep(Duration::from_millis(i as u64).saturating_sub(begun.elapsed()));
        for arrival in arrivals(&sample(i, WIDTH)) {
            // what finds no room is in the report
            let _ = world.arrive(arrival);
        }
        if i % 20 == 0 {
            published += world.published().len();
        }
    }
    let fed_s = begun.elapsed().as_secs_f64();
    world.arrive_patiently(Arrival::Shutdown);
    let report = node.join().expect("the result can be written").report;
    println!(
        "{:>8} faces, {fed_s:.1} s: accepted {} dropped {:?}; push {:?}; from arrival to mesh {:?} ns; {published} messages out, \
         {} view frames dropped, {} renewals waited for",
        mesh.face_count(),
        report.accepted,
        report.dropped,
        report.push_ns,
        report.latency_ns,
        report.dropped_view_frames,
        report.waits
    );
}

fn main() {
    let wanted: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let wanted = if wanted.is_empty() { vec![100_000, 1_000_000] } else { wanted };
    wanted.into_iter().for_each(run);
}
