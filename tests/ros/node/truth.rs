//! Reports of the node agree with the facts: on samples that it does not use, on single stamps, on
//! the mesh that it shows.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::mesh::TriMesh;
use touchup::ros::messages::{DiagnosticStatus, Marker, ResyncMeshRequest, SaveMeshRequest};
use touchup::ros::port::{Arrival, Call, Endpoint, Publication};
use touchup::stylus::Message;

use super::samples::bench::{Bench, Plate, patches, read, refine};
use super::samples::follower::Follower;

/// A second of ROS, ns.
const SECOND: i64 = 1_000_000_000;

fn is_pose(message: &Message) -> bool {
    matches!(message, Message::Pose(_))
}

/// The same arrival with another stamp.
fn stamped(mut arrival: Arrival, stamp_ns: i64) -> Arrival {
    match message_in(&mut arrival) {
        Message::Pose(pose) => pose.stamp_ns = stamp_ns,
        Message::Wrench(wrench) => wrench.stamp_ns = stamp_ns,
    }
    arrival
}

fn message_in(arrival: &mut Arrival) -> &mut Message {
    match arrival {
        Arrival::Message(of, _) => &mut of.message,
        _ => panic!("neither pose nor wrench"),
    }
}

/// Change of a message on its way to the node.
type Fault = fn(&Bench, &Message) -> Arrival;

fn empty_frame(mut arrival: Arrival) -> Arrival {
    if let Arrival::Message(of, _) = &mut arrival {
        of.frame.clear();
    }
    arrival
}

/// Faults of a stream, and words of the warning that each gets.
const FAULTS: [(&str, Fault, &[&str]); 10] = [
    (
        "poses 5 s behind",
        |bench, m| {
            stamped(
                bench.arrival(m),
                m.stamp_ns() - if is_pose(m) { 5 * SECOND } else { 0 },
            )
        },
        &["poses are stamped", "behind the wrenches"],
    ),
    (
        "poses an hour ahead",
        |bench, m| {
            stamped(
                bench.arrival(m),
                m.stamp_ns() + if is_pose(m) { 3600 * SECOND } else { 0 },
            )
        },
        &["poses are stamped 3600.", "ahead of the wrenches"],
    ),
    (
        "wrenches an hour ahead",
        |bench, m| {
            stamped(
                bench.arrival(m),
                m.stamp_ns() + if is_pose(m) { 0 } else { 3600 * SECOND },
            )
        },
        &["poses are stamped 3600.", "behind the wrenches"],
    ),
    (
        "no frames",
        |bench, m| empty_frame(bench.arrival(m)),
        &["no_frame", "fill frame_id"],
    ),
    (
        "poses without frame",
        |bench, m| {
            if is_pose(m) {
                empty_frame(bench.arrival(m))
            } else {
                bench.arrival(m)
            }
        },
        &["no_frame", "fill frame_id"],
    ),
    (
        "NaN poses",
        |bench, m| {
            let mut arrival = bench.arrival(m);
            if let Message::Pose(pose) = message_in(&mut arrival) {
                pose.pose_ot.translation.y = f64::NAN;
            }
            arrival
        },
        &["pose_not_finite", "NaN"],
    ),
    (
        "NaN forces",
        |bench, m| {
            let mut arrival = bench.arrival(m);
            if let Message::Wrench(wrench) = message_in(&mut arrival) {
                wrench.wrench.force.x = f64::NAN;
            }
            arrival
        },
        &["not_finite", "NaN"],
    ),
    (
        "no stamps",
        |bench, m| stamped(bench.arrival(m), 0),
        &["not stamped", "header.stamp"],
    ),
    (
        "poses without stamps",
        |bench, m| {
            if is_pose(m) {
                stamped(bench.arrival(m), 0)
            } else {
                bench.arrival(m)
            }
        },
        &["poses are not stamped"],
    ),
    (
        "stamps of 1969",
        |bench, m| stamped(bench.arrival(m), m.stamp_ns() - 3_000_000_000 * SECOND),
        &["stamp", "1970"],
    ),
];

/// Each way in which two streams come at full rate without a usable sample, with the words of the
/// node's report.
#[test]
#[ignore = "a slow proof"]
fn a_stream_that_is_not_used_is_a_warning_with_its_cause() {
    let plate = Plate::touched(0.1);
    let messages = &plate.messages;
    let first_ns = messages[0].stamp_ns();
    let some = messages
        .iter()
        .take_while(|message| message.stamp_ns() - first_ns < 4 * SECOND);
    let some: Vec<Message> = some.copied().collect();
    assert!(
        some.last().unwrap().stamp_ns() - first_ns > 3 * SECOND,
        "it lasts for some seconds"
    );
    let state_of = |fault: Fault| {
        let mut bench = Bench::start(&plate);
        let mut states = Vec::new();
        bench.play_as(&some, |message| vec![fault(&bench, message)]);
        for published in bench.published() {
            if let Publication::Diagnostics(message) = published {
                states.push((message.status[0].level, message.status[0].message.clone()));
            }
        }
        bench.end();
        states.pop().expect("diagnostics come once a second")
    };
    for (name, fault, words) in FAULTS {
        let (level, said) = state_of(fault);
        assert_eq!(level, DiagnosticStatus::WARN, "{name}: {said}");
        assert!(
            words.iter().all(|word| said.contains(word)),
            "{name}: {said}"
        );
    }
    let (level, said) = state_of(|bench, message| bench.arrival(message));
    assert_eq!(
        (level, said.as_str()),
        (DiagnosticStatus::OK, "runs: samples are taken")
    );
}

/// The node takes samples that contradict the part.
#[test]
#[ignore = "a slow proof"]
fn an_input_that_is_surely_wrong_is_an_error_with_its_cause() {
    let plate = Plate::touched(0.2);
    let states_of = |sign: f64| {
        let mut bench = Bench::start(&plate);
        bench.play_as(&plate.messages, |message| {
            let mut arrival = bench.arrival(message);
            if let Message::Wrench(wrench) = message_in(&mut arrival) {
                wrench.wrench.force *= sign;
            }
            vec![arrival]
        });
        let of_diagnostics = |published: &Publication| match published {
            Publication::Diagnostics(message) => {
                Some((message.status[0].level, message.status[0].message.clone()))
            }
            _ => None,
        };
        let states: Vec<_> = bench
            .published()
            .iter()
            .filter_map(of_diagnostics)
            .collect();
        bench.end();
        states
    };
    let sound = states_of(1.0);
    assert!(
        sound.len() > 10
            && sound
                .iter()
                .all(|(level, _)| *level != DiagnosticStatus::ERROR),
        "{sound:?}"
    );
    let reversed = states_of(-1.0);
    let (level, said) = reversed.last().unwrap();
    let is_named =
        said.starts_with("doubts its input (wrench_sign)") && said.contains("reverse the wrench");
    assert!(*level == DiagnosticStatus::ERROR && is_named, "{said}");
}

/// The result is that of the messages without the wrong ones, byte for byte.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn a_wrong_stamp_costs_itself_alone() {
    let plate = Plate::touched(0.1);
    let messages = &plate.messages;
    let expected = plate.refined("touch.mcap");
    let at = messages.len() / 2;
    let wrong: [(&str, bool, &[i64]); 5] = [
        ("a pose 5 s ahead", true, &[5]),
        ("a wrench 5 s ahead", false, &[5]),
        ("a pose a year ahead", true, &[31_536_000]),
        (
            "four poses of 2038",
            true,
            &[447_483_644, 447_483_645, 447_483_646, 447_483_647],
        ),
        ("three wrenches half a minute ahead", false, &[30, 31, 32]),
    ];
    for &(name, of_poses, ahead) in &wrong {
        let bench = Bench::start(&plate);
        let mut inserted = 0;
        let mut number = 0;
        bench.play_as(messages, |message| {
            let mut arrivals = vec![bench.arrival(message)];
            number += 1;
            if number >= at && inserted == 0 && is_pose(message) == of_poses {
                inserted = ahead.len();
                let base = message.stamp_ns().div_euclid(SECOND) * SECOND;
                let base = if ahead[0] > 1_000_000 {
                    1_700_000_000 * SECOND
                } else {
                    base
                };
                arrivals.extend(
                    ahead
                        .iter()
                        .map(|ahead| stamped(bench.arrival(message), base + ahead * SECOND)),
                );
            }
            arrivals
        });
        let (end, _) = bench.end();
        assert_eq!(inserted, ahead.len(), "{name}");
        let reason = if of_poses { "pose_jump" } else { "jump" };
        assert_eq!(
            end.report.refused.get(reason),
            Some(&(inserted as u64)),
            "{name}: {:?}",
            end.report.refused
        );
        assert_eq!(
            (end.report.unrecorded, end.report.refused.get("pose_late")),
            (0, None),
            "{name}"
        );
        assert!(read(&end.folder, "refined.ply") == expected, "{name}");
        let again = plate.path("again.ply");
        refine(&[
            "--resume".as_ref(),
            end.folder.as_os_str(),
            "--out".as_ref(),
            again.as_os_str(),
        ]);
        assert!(
            std::fs::read(again).unwrap() == expected,
            "{name}, from the recording"
        );
    }
}

/// A mesh independent of numbering: vertices sorted by their places and faces by theirs.
fn in_order(vertices: &BTreeMap<u32, [f32; 3]>, faces: impl Iterator<Item = [u32; 3]>) -> TriMesh {
    let mut places: Vec<[u32; 3]> = vertices
        .values()
        .map(|place| place.map(f32::to_bits))
        .collect();
    places.sort_unstable();
    places.dedup();
    let number = |vertex: u32| {
        places
            .binary_search(&vertices[&vertex].map(f32::to_bits))
            .unwrap() as u32
    };
    let mut faces: Vec<[u32; 3]> = faces
        .map(|corners| {
            let [a, b, c] = corners.map(number);
            [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
        })
        .collect();
    faces.sort_unstable();
    let point = |place: &[u32; 3]| place.map(|bits| f64::from(f32::from_bits(bits))).into();
    TriMesh::new(places.iter().map(point).collect(), faces).unwrap()
}

/// Bytes of a mesh as this program writes them.
fn written(mesh: &TriMesh, path: &Path) -> Vec<u8> {
    write_mesh(path, mesh, MeshUnit::Metre).unwrap();
    std::fs::read(path).unwrap()
}

/// The follower loses one of ten patches of the stream; after some seconds of rest its mesh and the
/// mesh in the file have the same bytes, and the answer of the service names the version of the
/// follower.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn what_is_shown_becomes_what_is_saved_at_a_follower_that_loses_patches() {
    let plate = Plate::touched(0.15);
    let mut bench = Bench::start(&plate);
    let mut follower = Follower::default();
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let (mut seen, mut lost) = (0, 0);
    let mut take = |bench: &mut Bench, is_lossy: bool, follower: &mut Follower| {
        let sent = patches(bench.published());
        for patch in &sent[seen..] {
            if is_lossy && rng.random_range(0..10) == 0 {
                lost += 1;
            } else {
                follower.take(patch);
            }
        }
        seen = sent.len();
        if std::mem::take(&mut follower.asks) {
            follower.asks = !bench
                .call(|reply| Call::Resync(ResyncMeshRequest::default(), reply))
                .success;
        }
    };
    for chunk in plate.messages.chunks(400) {
        bench.play(chunk);
        take(&mut bench, true, &mut follower);
    }
    for _ in 0..80 {
        bench.pass(Duration::from_millis(50));
        take(&mut bench, false, &mut follower);
        follower.tick();
    }
    let request = SaveMeshRequest {
        name: "rested.ply".to_owned(),
        ..SaveMeshRequest::default()
    };
    let saved = bench.call(|reply| Call::Save(request, reply));
    assert!(saved.success && !follower.is_waiting(), "{}", saved.message);
    assert_eq!(saved.mesh_version, follower.version);
    let counts = [follower.vertices.len() as u32, follower.faces.len() as u32];
    assert_eq!(
        [saved.vertex_count, saved.face_count],
        counts,
        "version {}",
        saved.mesh_version
    );
    let file = read_mesh(Path::new(&saved.path), MeshUnit::Millimetre)
        .unwrap()
        .mesh;
    let places = |(vertex, place): (u32, &nalgebra::Point3<f64>)| {
        (vertex, [place.x, place.y, place.z].map(|x| x as f32))
    };
    let of_file = (0..).zip(file.positions()).map(places).collect();
    let corners = file
        .faces()
        .map(|(_, corners)| corners.map(|corner| corner.0));
    let of_file = in_order(&of_file, corners);
    let of_follower = in_order(&follower.vertices, follower.faces.values().copied());
    let bytes = written(&of_file, &plate.path("file.ply"));
    assert!(bytes == written(&of_follower, &plate.path("follower.ply")));
    println!(
        "{lost} patches lost, {seen} sent; {} bytes at version {}",
        bytes.len(),
        follower.version
    );
    assert!(lost > 10);
    // and later samples count as if the mesh had never settled
    let (end, published) = bench.end();
    assert!(read(&end.folder, "refined.ply") == plate.refined("touch.mcap"));
    let tip = published
        .iter()
        .rev()
        .find_map(|published| match published {
            Publication::Tip(markers) => Some(
                markers
                    .markers
                    .iter()
                    .map(|marker| marker.action)
                    .collect::<Vec<_>>(),
            ),
            _ => None,
        });
    assert_eq!(tip, Some(vec![Marker::DELETE; 4]), "no tip is left behind");
}

/// A pause in the middle, in which the mesh settles, changes nothing of the result.
#[test]
#[ignore = "a slow proof"]
fn a_mesh_that_settles_in_a_pause_goes_on_as_if_it_had_not() {
    let plate = Plate::touched(0.1);
    let bench = Bench::start(&plate);
    for part in plate.messages.chunks(plate.messages.len() / 3 + 1) {
        bench.play(part);
        bench.pass(Duration::from_secs(2));
    }
    let request = SaveMeshRequest {
        name: "rested.ply".to_owned(),
        ..SaveMeshRequest::default()
    };
    let saved = bench.call(|reply| Call::Save(request, reply));
    assert!(saved.success && saved.mesh_version > 1, "{}", saved.message);
    let (end, _) = bench.end();
    let expected = plate.refined("touch.mcap");
    assert!(
        read(&end.folder, "rested.ply") == expected && read(&end.folder, "refined.ply") == expected
    );
}

/// The arm of the cell and the player of a recording, on one topic.
#[test]
fn samples_of_two_publishers_are_a_warning_with_the_topic() {
    let plate = Plate::touched(0.05);
    let mut bench = Bench::start(&plate);
    let publishers = |count| {
        Arrival::Matched(Endpoint {
            topic: "/stylus/pose".to_owned(),
            count,
            mismatch: None,
        })
    };
    bench.world.arrive_patiently(publishers(2));
    let (first, rest) = plate.messages.split_at(plate.messages.len() / 2);
    let state = |bench: &mut Bench| {
        let of = |published: &Publication| match published {
            Publication::Diagnostics(message) => {
                Some((message.status[0].level, message.status[0].message.clone()))
            }
            _ => None,
        };
        bench
            .published()
            .iter()
            .rev()
            .find_map(of)
            .expect("diagnostics come once a second")
    };
    bench.play(first);
    let (level, words) = state(&mut bench);
    assert!(
        level == DiagnosticStatus::WARN && words.contains("2 publishers on /stylus/pose"),
        "{words}"
    );
    bench.world.arrive_patiently(publishers(1));
    bench.play(rest);
    assert_eq!(
        state(&mut bench),
        (DiagnosticStatus::OK, "runs: samples are taken".to_owned())
    );
    bench.end();
}

/// Ten seconds of nonsense on a topic are one line, and a count.
#[test]
fn what_cannot_be_read_and_two_cells_can_be_told_apart() {
    let plate = Plate::touched(0.01);
    let mut bench = Bench::start(&plate);
    for _ in 0..500 {
        bench
            .world
            .arrive_patiently(Arrival::Unreadable("stylus/wrench", "too short".to_owned()));
    }
    assert_eq!(
        bench.diagnostic("refused_unreadable").as_deref(),
        Some("500")
    );
    let of = |published: &Publication| match published {
        Publication::Diagnostics(message) => {
            Some((message.status[0].level, message.status[0].message.clone()))
        }
        _ => None,
    };
    let (level, said) = bench.wait_for("diagnostics", of);
    assert!(
        level == DiagnosticStatus::WARN && said.contains("is the type of the topic right?"),
        "{said}"
    );
    let named = bench.wait_for("diagnostics", |published| match published {
        Publication::Diagnostics(message) => Some((
            message.status[0].name.clone(),
            message.status[0].hardware_id.clone(),
        )),
        _ => None,
    });
    assert_eq!(
        named,
        (
            "touchup: session".to_owned(),
            "stylus of /touchup".to_owned()
        )
    );
    bench.end();
}
