//! Answers every wrench with a mismatch that has its stamp and force, over DDS: what the way costs without any work on it,
//! and a second node for those who test theirs.
//!
//! cargo run --release --example ros_echo -- [TILES] [--ros-args ...]; ends when its standard input does

use std::io::{Write, stdin, stdout};
use std::sync::mpsc::sync_channel;
use std::thread;

use touchup::ros::arguments::{NodeConfig, split};
use touchup::ros::dds;
use touchup::ros::messages::{
    ColorRGBA, HapticMismatch, Marker, Point, ProbeFeedback, ProbeResponse, SetBoolResponse, UndoResponse, Vector3,
};
use touchup::ros::port::{Arrival, Call, GoalEnd, Publication};

/// A tile of 500 triangles, each point different.
fn tile(id: i32) -> Marker {
    let point = |i: i32| Point { x: f64::from(i), y: f64::from(id), z: 0.001 * f64::from(i) };
    let color = |i: i32| ColorRGBA { r: i as f32 / 1500.0, g: 0.5, b: 0.5, a: 1.0 };
    let (points, colors) = ((0..1500).map(point).collect(), (0..1500).map(color).collect());
    let scale = Vector3 { x: 1.0, y: 1.0, z: 1.0 };
    Marker { ns: "mesh".into(), id, r#type: Marker::TRIANGLE_LIST, scale, points, colors, ..Marker::default() }
}

fn main() -> anyhow::Result<()> {
    tracing_subscriber::fmt().with_writer(std::io::stderr).with_max_level(tracing::Level::WARN).init();
    let (own, ros) = split(std::env::args().skip(1));
    let tiles: i32 = own.first().map_or(Ok(0), |count| count.parse())?;
    let config = NodeConfig::new(&ros, |name| std::env::var(name).ok())?;
    let (inbox, arrivals) = sync_channel(4096);
    let port = dds::start(&config, inbox.clone())?;
    (0..tiles).for_each(|id| port.publish(Publication::Tile(tile(id))));
    thread::spawn(move || {
        // ends as well when nobody holds the other end any more
        let _ = std::io::copy(&mut stdin(), &mut std::io::sink());
        let _ = inbox.send(Arrival::Shutdown);
    });
    println!("ready");
    for arrival in arrivals {
        match arrival {
            Arrival::Wrench(wrench, _) => port.publish(Publication::Mismatch(HapticMismatch {
                actual_force: wrench.wrench.force,
                header: wrench.header,
                ..HapticMismatch::default()
            })),
            Arrival::Call(Call::Undo(request, reply)) => {
                // as long as it is asked for: above 1.4 kB it goes out in fragments
                let message = "echo".repeat(request.strokes as usize);
                let answer = UndoResponse { success: true, message, mesh_version: 1 << 40, ..Default::default() };
                reply.send(UndoResponse { strokes: request.strokes, ..answer });
            }
            Arrival::Call(Call::Pause(request, reply)) => {
                reply.send(SetBoolResponse { success: request.data, message: "echo".into() });
            }
            Arrival::Call(Call::Probe(request, goal)) => {
                goal.accept.send(!request.ids.is_empty());
                (0..3).for_each(|touch| (goal.feedback.0)(ProbeFeedback { touch, ..ProbeFeedback::default() }));
                goal.result.send((GoalEnd::Succeeded, ProbeResponse { code: 4, ..ProbeResponse::default() }));
            }
            Arrival::SetParameter(_, _, reply) => reply.send(Ok(())),
            Arrival::Shutdown => break,
            other => println!("{other:?}"),
        }
        stdout().flush()?;
    }
    println!("dropped {:?} lost {:?} unsent {:?}", port.dropped(), port.lost(), port.unsent());
    Ok(())
}
