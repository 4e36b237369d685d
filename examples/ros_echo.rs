//! Answers every wrench with a mismatch that has its stamp and force, over DDS: the cost of the
//! transport alone, and a second node to test another node with.
//!
//! cargo run --release --example ros_echo -- [TILES] [--ros-args ...]; ends when its standard input
//! does

use std::io::{Write, stdin, stdout};
use std::thread;

use touchup::clock::Clock;
use touchup::io::recording::LiveMessage;
use touchup::ros::arguments::{NodeConfig, split};
use touchup::ros::clock::time;
use touchup::ros::dds;
use touchup::ros::inbox::inbox;
use touchup::ros::messages::{
    ColorRGBA, DetectFeaturesResponse, Feature, FeatureArray, HapticMismatch, Header, Marker,
    Point, ProbeFeatureResponse, ProbeFeedback, ProbeResponse, ProbeResult, ProbeTouch,
    UndoResponse, Vector3,
};
use touchup::ros::port::{ArmOrder, Arrival, Call, GoalEnd, Publication};
use touchup::stylus::Message;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// A tile of 500 triangles, each point different.
fn tile(id: i32) -> Marker {
    let point = |i: i32| Point {
        x: f64::from(i),
        y: f64::from(id),
        z: 0.001 * f64::from(i),
    };
    let color = |i: i32| ColorRGBA {
        r: i as f32 / 1500.0,
        g: 0.5,
        b: 0.5,
        a: 1.0,
    };
    let (points, colors) = (
        (0..1500).map(point).collect(),
        (0..1500).map(color).collect(),
    );
    let scale = Vector3 {
        x: 1.0,
        y: 1.0,
        z: 1.0,
    };
    Marker {
        ns: "mesh".into(),
        id,
        r#type: Marker::TRIANGLE_LIST,
        scale,
        points,
        colors,
        ..Marker::default()
    }
}

/// Number of features, more than an answer can name.
const FEATURES: u32 = 300;
/// Largest number that an answer of the node names.
const MOST_NAMED: u32 = 128;
/// Of one probing.
const TOUCHES: u32 = 20;

fn outline() -> Feature {
    Feature {
        kind: Feature::KIND_SLOT,
        points: vec![Point::default(); 2],
        ..Feature::default()
    }
}

/// One with as long a curve as the node publishes.
fn touch(id: u32, index: u32) -> ProbeTouch {
    let row = || (0..2000).map(|i| i as f32).collect();
    let (curve_time, curve_travel, curve_force, curve_lateral_force) = (row(), row(), row(), row());
    ProbeTouch {
        id,
        index,
        curve_time,
        curve_travel,
        curve_force,
        curve_lateral_force,
        ..ProbeTouch::default()
    }
}

#[expect(clippy::too_many_lines)]
fn main() -> anyhow::Result<()> {
    let filter = Targets::new()
        .with_default(LevelFilter::WARN)
        .with_target("touchup", LevelFilter::INFO);
    tracing_subscriber::registry()
        .with(tracing_subscriber::fmt::layer().with_writer(std::io::stderr))
        .with(filter)
        .init();
    let (own, ros) = split(std::env::args().skip(1));
    let tiles: i32 = own.first().map_or(Ok(0), |count| count.parse())?;
    let config = NodeConfig::new(&ros, |name| std::env::var(name).ok())?;
    let (inbox, arrivals) = inbox(4096, &Clock::system());
    let port = dds::start(&config, inbox.clone())?;
    thread::spawn(move || {
        // ends as well when the other end drops the pipe
        let _ = std::io::copy(&mut stdin(), &mut std::io::sink());
        inbox.put(Arrival::Shutdown);
    });
    println!("ready");
    while let Some(arrival) = arrivals.recv() {
        match arrival {
            Arrival::Message(
                LiveMessage {
                    frame,
                    message: Message::Wrench(measured),
                },
                _,
            ) => {
                let force = measured.wrench.force;
                port.publish(Publication::Mismatch(HapticMismatch {
                    header: Header {
                        stamp: time(measured.stamp_ns),
                        frame_id: frame,
                    },
                    actual_force: Vector3 {
                        x: force.x,
                        y: force.y,
                        z: force.z,
                    },
                    ..HapticMismatch::default()
                }));
            }
            Arrival::Call(Call::Undo(request, reply)) => {
                // as long as the request says: the enhanced mapping cuts it into packets
                let message = "echo".repeat(request.strokes as usize);
                let answer = UndoResponse {
                    success: true,
                    message,
                    mesh_version: 1 << 40,
                    ..Default::default()
                };
                reply.send(UndoResponse {
                    strokes: request.strokes,
                    ..answer
                });
            }
            Arrival::Call(Call::Detect(_, reply)) => {
                let features = (0..FEATURES)
                    .map(|id| Feature { id, ..outline() })
                    .collect();
                let array = FeatureArray {
                    mesh_version: 7,
                    features,
                    ..FeatureArray::default()
                };
                port.publish(Publication::Features(array));
                reply.send(DetectFeaturesResponse {
                    success: true,
                    message: "300 slots".to_owned(),
                    mesh_version: 7,
                    count: FEATURES,
                    ids: (0..MOST_NAMED).collect(),
                });
            }
            Arrival::Call(Call::Arm(ArmOrder::Feature(request, reply))) => {
                for index in 0..TOUCHES {
                    port.publish(Publication::ProbeTouch(touch(request.id, index)));
                }
                let result = ProbeResult {
                    id: request.id,
                    code: 1,
                    feature: outline(),
                    ..ProbeResult::default()
                };
                let result = ProbeResult {
                    message: "reached".to_owned(),
                    touch_count: TOUCHES,
                    ..result
                };
                port.publish(Publication::ProbeResult(result.clone()));
                reply.send(ProbeFeatureResponse { result });
            }
            Arrival::Call(Call::Arm(ArmOrder::Goal(request, goal))) => {
                goal.accept.send(!request.ids.is_empty());
                (0..3).for_each(|touch| {
                    (goal.feedback.0)(ProbeFeedback {
                        touch,
                        ..ProbeFeedback::default()
                    })
                });
                let (ids, codes) = ((0..MOST_NAMED).collect(), vec![4; MOST_NAMED as usize]);
                let result = ProbeResponse {
                    code: 4,
                    ids,
                    codes,
                    ..ProbeResponse::default()
                };
                goal.result.send((GoalEnd::Succeeded, result));
            }
            Arrival::SetParameter(_, _, reply) => reply.send(Ok(())),
            // as the node does: DDS keeps no more than the last of them for who is not there yet
            Arrival::Viewers(count) if count > 0 => {
                (0..tiles).for_each(|id| port.publish(Publication::Tile(tile(id))));
            }
            Arrival::Shutdown => break,
            other => println!("{other:?}"),
        }
        stdout().flush()?;
    }
    println!(
        "dropped {:?} lost {:?} unsent {:?}",
        port.dropped(),
        port.lost(),
        port.unsent()
    );
    Ok(())
}
