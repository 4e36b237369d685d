//! `touchup calibrate` at the boundary of the process: with the calibrated scene, a recording in
//! another frame, with another tip and a heavy sensor, gives the mesh of the plain recording.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, vector};
use serde_json::Value;
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::io::recording::{Record, RecordingReader, Topics, write_recording};
use touchup::mesh::TriMesh;
use touchup::stylus::{
    MarkerFrame, MarkerObservation, Message, StampedPose, StampedWrench, SyncParams, Synchroniser,
    Wrench,
};

const DEFAULT_YAML: &str = include_str!("../../../config/default.yaml");

fn touchup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn done(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// Pose of the scan in space.
fn pose_wo() -> Isometry3<f64> {
    Isometry3::new(vector![0.41, -0.22, 0.13], vector![0.5, -1.2, 2.0])
}

const OFFSET: Vector3<f64> = Vector3::new(2.1e-3, -1.3e-3, -0.1418);
const WEIGHT_W: Vector3<f64> = Vector3::new(0.3, -0.2, -2.7);
const CENTRE: Vector3<f64> = Vector3::new(4e-3, -11e-3, 52e-3);
const BIAS: Wrench = Wrench {
    force: Vector3::new(-2.0, 3.5, 1.0),
    torque: Vector3::new(0.12, -0.3, 0.05),
};

struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    /// A cube of 30 mm, scanned badly and touched.
    fn new() -> Self {
        let case = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let corner = |i: u32| {
            Point3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 0.03 } else { 0.0 }))
        };
        let faces = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let faces = faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        let cube = TriMesh::new((0..8).map(corner).collect(), faces).unwrap();
        write_mesh(&case.path("part.ply"), &cube, MeshUnit::Millimetre).unwrap();
        done(&touchup(&[
            "simulate",
            "--truth",
            &case.name("part.ply"),
            "--out",
            &case.name("made"),
        ]));
        case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn name(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn touches(&self) -> Vec<Message> {
        RecordingReader::open(&self.path("made/touch.mcap"), &Topics::default())
            .unwrap()
            .map(Result::unwrap)
            .collect()
    }

    fn record(&self, name: &str, wrench_frame: &str, messages: &[Message]) {
        write_recording(
            &self.path(name),
            &Topics::default(),
            "space",
            wrench_frame,
            messages.iter().copied(),
        )
        .unwrap();
    }

    fn refined(&self, bag: &str, scene: &str, out: &str) -> TriMesh {
        let (scan, bag, scene, path) = (
            self.name("made/scan.ply"),
            self.name(bag),
            self.name(scene),
            self.name(out),
        );
        done(&touchup(&[
            "refine", "--scan", &scan, "--bag", &bag, "--scene", &scene, "--out", &path, "--json",
        ]));
        read_mesh(&self.path(out), MeshUnit::Millimetre)
            .unwrap()
            .mesh
    }

    /// `touchup calibrate …` from one scene into another.
    fn calibrate(&self, arguments: &[&str], scene: &str, out: &str) -> Output {
        let (scene, out) = (self.name(scene), self.name(out));
        touchup(
            &[
                &["calibrate"],
                arguments,
                &["--scene", &scene, "--out", &out, "--json"],
            ]
            .concat(),
        )
    }
}

/// The recording as a tracker in space sees it: the pose of H, the wrench in the axes of the
/// stylus.
fn in_space(messages: &[Message], offset: Vector3<f64>) -> Vec<Message> {
    let moved = |message: &Message| match *message {
        Message::Pose(StampedPose { stamp_ns, pose_ot }) => Message::Pose(StampedPose {
            stamp_ns,
            pose_ot: pose_wo() * pose_ot * Translation3::from(-offset),
        }),
        wrench => wrench,
    };
    messages.iter().map(moved).collect()
}

/// Orientation of the stylus at the stamp of each wrench that becomes a sample.
fn turns(messages: &[Message]) -> BTreeMap<i64, UnitQuaternion<f64>> {
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    let mut turns = BTreeMap::new();
    let mut draw = |sync: &mut Synchroniser| {
        while let Some(sample) = sync.next_sample() {
            turns.insert(sample.stamp_ns, sample.pose_ot.rotation);
        }
    };
    for message in messages {
        sync.push(*message);
        draw(&mut sync);
    }
    sync.finish();
    draw(&mut sync);
    turns
}

/// The messages with each wrench of a sample replaced by `change` of it and the orientation at its
/// stamp.
fn changed(
    messages: &[Message],
    change: impl Fn(&UnitQuaternion<f64>, Wrench) -> Wrench,
) -> Vec<Message> {
    let turns = turns(messages);
    let change = |message: &Message| match *message {
        Message::Wrench(StampedWrench { stamp_ns, wrench }) if turns.contains_key(&stamp_ns) => {
            Message::Wrench(StampedWrench {
                stamp_ns,
                wrench: change(&turns[&stamp_ns], wrench),
            })
        }
        other => other,
    };
    messages.iter().map(change).collect()
}

/// Adds weight and bias to a contact wrench.
fn loaded(r_wt: &UnitQuaternion<f64>, wrench: Wrench) -> Wrench {
    let weight = load(r_wt);
    Wrench {
        force: wrench.force + weight.force,
        torque: wrench.torque + weight.torque,
    }
}

fn load(r_wt: &UnitQuaternion<f64>) -> Wrench {
    let weight = r_wt.inverse() * WEIGHT_W;
    Wrench {
        force: weight + BIAS.force,
        torque: CENTRE.cross(&weight) + BIAS.torque,
    }
}

/// A pose and a wrench each 10 ms.
fn recording(count: i64, pose: impl Fn(i64) -> Isometry3<f64>) -> Vec<Message> {
    let pair = |i: i64| {
        let (stamp_ns, pose_ot) = (1_000_000_000 + i * 10_000_000, pose(i));
        let wrench = load(&pose_ot.rotation);
        [
            Message::Pose(StampedPose { stamp_ns, pose_ot }),
            Message::Wrench(StampedWrench { stamp_ns, wrench }),
        ]
    };
    (0..count).flat_map(pair).collect()
}

/// Held static for 1.5 s in each of twelve orientations.
fn static_segments() -> Vec<Message> {
    recording(12 * 150, |i| {
        let k = (i / 150) as f64;
        let turn = vector![(1.3 * k).sin(), (2.1 * k).cos(), (0.7 * k).sin()] * 1.5;
        Isometry3::from_parts(
            Translation3::new(0.4, 0.1, 0.3),
            UnitQuaternion::from_scaled_axis(turn),
        )
    })
}

/// The ball stays while the stylus swings.
fn swing() -> Vec<Message> {
    recording(3000, |i| {
        let t = i as f64 / 100.0;
        let turn =
            UnitQuaternion::from_scaled_axis(vector![0.5 * t.sin(), 0.4 * (1.7 * t).cos(), 0.2]);
        Isometry3::from_parts((vector![0.3, 0.2, 0.05] - turn * OFFSET).into(), turn)
    })
}

fn pairs_csv() -> String {
    let mut csv =
        "name,scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm\n".to_owned();
    for (name, p) in [
        ("A", [0, 0, 0]),
        ("B", [30, 0, 0]),
        ("C", [30, 30, 0]),
        ("D", [0, 30, 30]),
        ("E", [15, 0, 30]),
    ] {
        let p = p.map(f64::from);
        let q = (pose_wo() * Point3::from(p.map(|x| x / 1e3))).coords * 1e3;
        csv += &format!(
            "{name},{},{},{},{:.12},{:.12},{:.12}\n",
            p[0], p[1], p[2], q.x, q.y, q.z
        );
    }
    csv
}

/// Largest distance between vertices; the faces are the same.
fn largest_difference(a: &TriMesh, b: &TriMesh) -> f64 {
    assert_eq!(a.positions().len(), b.positions().len());
    assert!(a.faces().eq(b.faces()), "the faces differ");
    a.positions()
        .iter()
        .zip(b.positions())
        .map(|(p, q)| (p - q).norm())
        .fold(0.0, f64::max)
}

#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn a_calibrated_scene_gives_the_mesh_of_the_plain_recording() {
    let case = Case::new();
    fs::write(case.path("plain.yaml"), DEFAULT_YAML).unwrap();
    let plain = case.refined("made/touch.mcap", "plain.yaml", "plain.ply");
    let scan = read_mesh(&case.path("made/scan.ply"), MeshUnit::Millimetre)
        .unwrap()
        .mesh;
    assert!(
        plain.positions().len() != scan.positions().len(),
        "something was touched"
    );
    fs::write(case.path("pairs.csv"), pairs_csv()).unwrap();
    case.record("static.mcap", "stylus", &static_segments());
    case.record("swing.mcap", "stylus", &swing());
    let (pairs, held, swing) = (
        case.name("pairs.csv"),
        case.name("static.mcap"),
        case.name("swing.mcap"),
    );

    let report: Value = serde_json::from_str(done(&case.calibrate(
        &["scan", "--pairs", &pairs],
        "plain.yaml",
        "scan.yaml",
    )))
    .unwrap();
    assert!(
        report["rms_mm"].as_f64().unwrap() < 1e-9 && report["pairs"][4]["name"] == "E",
        "{report}"
    );
    let report: Value = serde_json::from_str(done(&case.calibrate(
        &["tip", "--bag", &swing],
        "plain.yaml",
        "tip.yaml",
    )))
    .unwrap();
    assert!(
        (report["offset_mm"]["value"][2].as_f64().unwrap() + 141.8).abs() < 1e-7,
        "{report}"
    );
    let report: Value = serde_json::from_str(done(&case.calibrate(
        &["payload", "--bag", &held],
        "plain.yaml",
        "payload.yaml",
    )))
    .unwrap();
    assert!(
        (report["weight_n"].as_f64().unwrap() - WEIGHT_W.norm()).abs() < 1e-9,
        "{report}"
    );
    assert_eq!(report["static_segments"], 12);
    // all three, the payload first: its gravity is in the axes of space and turns with the scan
    // that comes after it
    done(&case.calibrate(&["scan", "--pairs", &pairs], "payload.yaml", "all.yaml"));
    done(&case.calibrate(&["tip", "--bag", &swing], "all.yaml", "all.yaml"));
    let all = fs::read_to_string(case.path("all.yaml")).unwrap();
    assert!(DEFAULT_YAML.lines().all(|line| all.contains(line)), "{all}");

    let touches = case.touches();
    let (zero, moved) = (Vector3::zeros(), in_space(&touches, OFFSET));
    case.record("moved.mcap", "stylus", &in_space(&touches, zero));
    // the plain recording with its own tip: only H is elsewhere
    let other_tip: Vec<_> = moved
        .iter()
        .map(|message| match *message {
            Message::Pose(pose) => Message::Pose(StampedPose {
                pose_ot: pose_wo().inverse() * pose.pose_ot,
                ..pose
            }),
            wrench => wrench,
        })
        .collect();
    case.record("tip.mcap", "stylus", &other_tip);
    case.record("all.mcap", "stylus", &changed(&moved, loaded));
    for (bag, scene) in [
        ("moved.mcap", "scan.yaml"),
        ("tip.mcap", "tip.yaml"),
        ("all.mcap", "all.yaml"),
    ] {
        let mesh = case.refined(bag, scene, "out.ply");
        let difference = largest_difference(&plain, &mesh);
        println!("{bag} with {scene}: {difference:e} m");
        assert!(difference < 1e-9, "{bag}: {difference:e}");
    }
    // turns a wrench in the axes of the poses with them
    let turned = |r_wt: &UnitQuaternion<f64>, wrench: Wrench| Wrench {
        force: r_wt * wrench.force,
        torque: r_wt * wrench.torque,
    };
    let in_pose_axes = changed(&in_space(&touches, zero), turned);
    case.record("axes.mcap", "space", &in_pose_axes);
    let difference = largest_difference(&plain, &case.refined("axes.mcap", "scan.yaml", "out.ply"));
    println!("wrench in space: {difference:e} m");
    assert!(difference < 1e-9, "{difference:e}");
}

#[test]
#[expect(clippy::too_many_lines)]
fn results_are_printed_and_written_and_bad_data_is_3() {
    let folder = tempfile::tempdir().unwrap();
    let name = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (pairs, out) = (name("pairs.csv"), name("new.yaml"));
    fs::write(&pairs, pairs_csv()).unwrap();
    let scan = |more: &[&str]| {
        touchup(
            &[
                &["calibrate", "scan", "--pairs", &pairs, "--out", &out],
                more,
            ]
            .concat(),
        )
    };
    let output = scan(&[]);
    let report = done(&output);
    assert!(
        report.contains("residual, mm") && report.contains("rms 0.000 mm") && report.contains(&out),
        "{report}"
    );
    let new = fs::read_to_string(&out).unwrap();
    assert!(
        new.contains("# touchup calibrate scan: 5 pairs, residuals 0.000 mm rms"),
        "{new}"
    );
    // a whole scene, but for the radius of the ball, which has no source
    let scene = touchup::scene::Scene::read(Path::new(&out)).unwrap();
    assert!(scene.scan_to_space.is_some());
    assert_eq!(
        touchup::scene::Scene {
            scan_to_space: None,
            ..scene
        },
        touchup::scene::Scene::default()
    );
    assert!(
        !touchup::scene::Scene::names(&new, "tip", "radius_mm") && new.contains("#radius_mm"),
        "{new}"
    );
    // the same with the name of a scene that does not exist yet
    let named = name("named.yaml");
    let scan_named = [
        "calibrate",
        "scan",
        "--pairs",
        &pairs,
        "--scene",
        &named,
        "--out",
        &named,
    ];
    done(&touchup(&scan_named));
    assert_eq!(fs::read_to_string(&named).unwrap(), new);

    let refused = |output: Output, exit: i32, named: &str| {
        let report = text(&output.stderr);
        assert_eq!(
            (output.status.code(), text(&output.stdout)),
            (Some(exit), ""),
            "{report}"
        );
        assert!(
            report.contains(named) && report.lines().count() == 1,
            "{named}: {report}"
        );
        assert_eq!(
            fs::read_to_string(&out).unwrap(),
            new,
            "{named}: what was there stays"
        );
    };
    let lines: Vec<String> = pairs_csv().lines().map(str::to_owned).collect();
    let with = |lines: &[String]| fs::write(&pairs, lines.join("\n")).unwrap();
    with(&lines[..3]);
    refused(scan(&[]), 3, "pairs.csv: 2 pairs do not determine");
    with(&[&lines[..], &["F,30,30,30,1,2,x".to_owned()]].concat());
    refused(scan(&[]), 3, "line 7: space_z_mm is \"x\"");
    with(&[&lines[..], &["F,30,30,30,1,2,3".to_owned()]].concat());
    refused(scan(&[]), 3, "pair 6 does not fit");
    with(&lines);
    refused(scan(&["--sigma-mm", "0"]), 2, "--sigma-mm");
    refused(scan(&["--scene", &name("no.yaml")]), 3, "no.yaml");
    refused(
        touchup(&["calibrate", "scan", "--pairs", &pairs, "--out", &pairs]),
        2,
        "which --pairs reads",
    );
    refused(
        touchup(&[
            "calibrate",
            "scan",
            "--pairs",
            &pairs,
            "--out",
            &name("no/new.yaml"),
        ]),
        1,
        "no folder",
    );
    let bag = name("none.mcap");
    refused(
        touchup(&["calibrate", "tip", "--bag", &bag, "--out", &out]),
        3,
        "none.mcap",
    );
    assert_eq!(
        touchup(&["calibrate", "payload", "--out", &out])
            .status
            .code(),
        Some(2)
    );

    // one orientation alone
    let resting = recording(500, |_| Isometry3::identity());
    write_recording(
        &folder.path().join("rest.mcap"),
        &Topics::default(),
        "space",
        "stylus",
        resting,
    )
    .unwrap();
    let rest = name("rest.mcap");
    refused(
        touchup(&["calibrate", "tip", "--bag", &rest, "--out", &out]),
        3,
        "swung by 0.0°",
    );
    refused(
        touchup(&["calibrate", "payload", "--bag", &rest, "--out", &out]),
        3,
        "1 still phases",
    );
}

/// The stylus goes from point to point and dwells on each for 0.8 s, pressing with 2 N along the
/// normal; the poses are of H.
fn resting_on(points: &[(Point3<f64>, Vector3<f64>)]) -> Vec<Message> {
    let (radius, stiffness) = (1.5e-3, 20e3);
    let mut messages = Vec::new();
    for (k, (point, normal)) in points.iter().enumerate() {
        for tick in 0..1300_i64 {
            let stamp_ns = 1_000_000_000 + (k as i64 * 1300 + tick) * 1_000_000;
            let presses = (250..1050).contains(&tick);
            let away = 80e-6 * (250 - tick).max(tick - 1050).max(0) as f64;
            let force_o = if presses {
                normal * 2.0
            } else {
                Vector3::zeros()
            };
            let turn = UnitQuaternion::from_scaled_axis(vector![0.1 * k as f64, 0.2, -0.3]);
            let centre = point + normal * (radius + away) - force_o / stiffness;
            let pose_oh =
                Isometry3::from_parts(centre.coords.into(), turn) * Translation3::from(-OFFSET);
            messages.push(Message::Pose(StampedPose {
                stamp_ns,
                pose_ot: pose_wo() * pose_oh,
            }));
            let wrench = Wrench {
                force: turn.inverse() * force_o,
                torque: Vector3::zeros(),
            };
            messages.push(Message::Wrench(StampedWrench { stamp_ns, wrench }));
        }
    }
    messages
}

#[test]
#[expect(clippy::too_many_lines)]
fn points_can_be_picked_with_the_stylus() {
    let folder = tempfile::tempdir().unwrap();
    let name = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let points = [
        (Point3::new(0.0, 0.01, 0.0), -Vector3::x()),
        (Point3::new(0.02, 0.0, 0.01), -Vector3::y()),
        (Point3::new(0.03, 0.02, 0.02), Vector3::x()),
        (Point3::new(0.01, 0.01, 0.03), Vector3::z()),
        (Point3::new(0.015, 0.03, 0.005), Vector3::y()),
    ];
    let mut csv = "scan_x_mm,scan_y_mm,scan_z_mm\n".to_owned();
    for (point, _) in &points {
        let mm = point.coords * 1e3;
        csv += &format!("{},{},{}\n", mm.x, mm.y, mm.z);
    }
    fs::write(name("points.csv"), csv).unwrap();
    let offset = format!(
        "  offset_mm: [{}, {}, {}]\n",
        OFFSET.x * 1e3,
        OFFSET.y * 1e3,
        OFFSET.z * 1e3
    );
    fs::write(
        name("tip.yaml"),
        DEFAULT_YAML.replace("tip:\n", &format!("tip:\n{offset}")),
    )
    .unwrap();
    let scan = |bag: &str, points: &[(Point3<f64>, Vector3<f64>)]| {
        write_recording(
            Path::new(&name(bag)),
            &Topics::default(),
            "space",
            "stylus",
            resting_on(points),
        )
        .unwrap();
        let [pairs, bag, scene, out] = ["points.csv", bag, "tip.yaml", "out.yaml"].map(name);
        touchup(&[
            "calibrate",
            "scan",
            "--pairs",
            &pairs,
            "--bag",
            &bag,
            "--scene",
            &scene,
            "--out",
            &out,
            "--json",
        ])
    };
    let report: Value = serde_json::from_str(done(&scan("dwells.mcap", &points))).unwrap();
    assert!(report["rms_mm"].as_f64().unwrap() < 1e-6, "{report}");
    let found: Vec<f64> = report["scan_to_space"]["position_mm"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    let off = Vector3::from_column_slice(&found) - pose_wo().translation.vector * 1e3;
    assert!(off.norm() < 1e-5, "{off}");
    let output = scan("four.mcap", &points[..4]);
    assert_eq!(output.status.code(), Some(3));
    assert!(text(&output.stderr).contains("4 dwells") && text(&output.stderr).contains("5 points"));
}

/// The markers of a tracker in space, read in place of the pose.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn markers_in_space_refine_as_those_in_the_frame_of_the_scan() {
    let case = Case::new();
    let part = case.name("part.ply");
    done(&touchup(&[
        "simulate",
        "--truth",
        &part,
        "--out",
        &case.name("made"),
        "--markers",
    ]));
    let topics = Topics {
        markers: Some("/stylus/markers".to_owned()),
        ..Topics::default()
    };
    let mut reader = RecordingReader::open(&case.path("made/touch.mcap"), &topics).unwrap();
    let moved = std::iter::from_fn(|| reader.next_record()).map(|record| match record.unwrap() {
        Record::Markers(frame) => {
            let mut in_space = MarkerFrame::new(frame.stamp_ns);
            for marker in frame.seen() {
                in_space.see(MarkerObservation {
                    position: pose_wo() * marker.position,
                    ..*marker
                });
            }
            Record::Markers(Box::new(in_space))
        }
        message => message,
    });
    let records: Vec<_> = moved.collect();
    write_recording(
        &case.path("space.mcap"),
        &topics,
        "space",
        "stylus",
        records,
    )
    .unwrap();
    let markers = format!("{DEFAULT_YAML}\nmarkers:\n");
    fs::write(case.path("markers.yaml"), &markers).unwrap();
    fs::write(case.path("pairs.csv"), pairs_csv()).unwrap();
    done(&case.calibrate(
        &["scan", "--pairs", &case.name("pairs.csv")],
        "markers.yaml",
        "space.yaml",
    ));
    let refined = |bag: &str, scene: &str| -> Value {
        let [scan, bag, scene, out] =
            ["made/scan.ply", bag, scene, "out.ply"].map(|name| case.name(name));
        let refine = [
            "refine", "--scan", &scan, "--bag", &bag, "--scene", &scene, "--out", &out, "--json",
        ];
        let output = touchup(&[&refine[..], &["--markers-topic", "/stylus/markers"]].concat());
        serde_json::from_str(text(&output.stdout)).unwrap()
    };
    let (plain, space) = (
        refined("made/touch.mcap", "markers.yaml"),
        refined("space.mcap", "space.yaml"),
    );
    // the recording holds markers in single precision, so that 1e-8 m is the achievable accuracy
    let ratio = |key: &str| space[key].as_f64().unwrap() / plain[key].as_f64().unwrap();
    assert!(plain["moved_faces"].as_u64().unwrap() > 1000, "{plain}");
    for key in ["accepted", "moved_faces", "contacts"] {
        assert!((ratio(key) - 1.0).abs() < 0.01, "{key}: {plain} {space}");
    }
}

/// The real static poses of the room's tests, through the command line.
#[test]
fn real_static_poses_from_a_table() {
    let Some(data) = crate::shared::shared("force/gravity_ati") else {
        return;
    };
    let [poses, wrenches] =
        ["pose_7.txt", "wrench_7.txt"].map(|name| fs::read_to_string(data.join(name)).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let mut csv = "qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm\n".to_owned();
    for (pose, wrench) in poses.lines().zip(wrenches.lines()) {
        let turn: Vec<_> = pose.split(',').skip(3).collect();
        csv += &format!("{},{wrench}\n", turn.join(","));
    }
    let [table, out] = ["poses.csv", "scene.yaml"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    fs::write(&table, csv).unwrap();
    let payload = ["calibrate", "payload", "--samples", &table, "--out", &out];
    let output = touchup(&payload);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        text(&output.stderr).contains("--wrench-axes pose"),
        "{}",
        text(&output.stderr)
    );
    let output = touchup(&[&payload[..], &["--wrench-axes", "pose"]].concat());
    let report = done(&output);
    println!("{report}");
    assert!(
        report.contains("weight      10.80") || report.contains("weight      10.81"),
        "{report}"
    );
}
