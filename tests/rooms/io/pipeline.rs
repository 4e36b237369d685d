//! From files to a file through the program: real recordings, replays, damage.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde_json::Value;
use tempfile::TempDir;
use touchup::haptic::RefineParams;
use touchup::io::mesh_file::{MeshUnit, VertexColumn, read_mesh, write_mesh, write_mesh_with};
use touchup::io::recording::{RecordingReader, Topics, write_recording};
use touchup::live::{Engine, Renewal};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::PatcherParams;
use touchup::scan::read_scan;
use touchup::stylus::{
    Message, StampedPose, StampedWrench, SyncParams, Synchroniser, TipParams, Wrench,
};

use crate::common::{grid, within};
use crate::shared::shared;

/// `touchup refine` with `flags`.
fn refine(scan: &Path, bag: &Path, out: &Path, flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .arg("refine")
        .args([
            Path::new("--scan"),
            scan,
            Path::new("--bag"),
            bag,
            Path::new("--out"),
            out,
        ])
        .args(flags)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

/// The code; −1 when a signal ended it.
fn code(output: &Output) -> i32 {
    output.status.code().unwrap_or(-1)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The summary; its numbers add up.
fn summary(output: &Output) -> Value {
    let summary = any_summary(output);
    assert!(adds_up(&summary), "{summary}");
    summary
}

fn any_summary(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", stderr(output)))
}

/// samples = accepted + Σ refused; lost poses are no samples.
fn adds_up(summary: &Value) -> bool {
    let refused = summary["refused"].as_object().unwrap();
    let lost: u64 = refused
        .iter()
        .filter(|(why, _)| !why.starts_with("pose_"))
        .map(|(_, n)| n.as_u64().unwrap())
        .sum();
    number(summary, "samples") == number(summary, "accepted") + lost
}

fn number(summary: &Value, key: &str) -> u64 {
    summary[key].as_u64().unwrap()
}

// ---- a real recording

/// Radius of the ball of the real recording, m.
const PROBE_RADIUS: f64 = 3.15e-3;
/// Force above which the authors of the recording speak of contact, N.
const PROBE_CONTACT: f64 = 0.1;
const PROBE: [&str; 7] = [
    "--pose-topic",
    "/probe/pose",
    "--wrench-topic",
    "/probe/wrench",
    "--tip-radius-mm",
    "3.15",
    "--json",
];

/// Poses and wrenches of a recording, by stamp.
fn messages(bag: &Path) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let topics = Topics {
        pose: "/probe/pose".into(),
        wrench: "/probe/wrench".into(),
        markers: None,
    };
    let (mut poses, mut wrenches) = (vec![], vec![]);
    for message in RecordingReader::open(bag, &topics).unwrap() {
        match message.unwrap() {
            Message::Pose(pose) => poses.push(pose),
            Message::Wrench(wrench) => wrenches.push(wrench),
        }
    }
    (poses, wrenches)
}

/// Touched places of the ball: p − r F/|F|. In this recording each wrench has the stamp of a pose.
fn contact_points(bag: &Path) -> (Vec<Point3<f64>>, Vec<Vector3<f64>>) {
    let (poses, wrenches) = messages(bag);
    assert_eq!((poses.len(), wrenches.len()), (6_000, 6_000));
    let both = poses
        .iter()
        .zip(&wrenches)
        .inspect(|(pose, wrench)| assert_eq!(pose.stamp_ns, wrench.stamp_ns));
    both.filter(|(_, wrench)| wrench.wrench.force.norm() > PROBE_CONTACT)
        .map(|(pose, wrench)| {
            let force = wrench.wrench.force;
            (
                Point3::from(pose.pose_ot.translation.vector - force.normalize() * PROBE_RADIUS),
                force,
            )
        })
        .unzip()
}

/// A flat patch of triangles of 2 mm, fitted to points, its normals towards `up`, 4 mm larger than
/// they reach.
fn patch_under(points: &[Point3<f64>], up: &Vector3<f64>) -> TriMesh {
    let middle: Vector3<f64> =
        points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let spread = points
        .iter()
        .map(|p| p.coords - middle)
        .map(|arm| arm * arm.transpose())
        .sum::<nalgebra::Matrix3<f64>>();
    let axes = spread.symmetric_eigen();
    let normal: Vector3<f64> = axes.eigenvectors.column(axes.eigenvalues.imin()).into();
    let normal = if normal.dot(up) < 0.0 {
        -normal
    } else {
        normal
    };
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal).unwrap();
    let pose = Isometry3::from_parts(middle.into(), turn);
    let reach = points
        .iter()
        .map(|p| pose.inverse_transform_point(p).coords.xy().amax())
        .fold(0.0, f64::max);
    let flat = grid((2.0 * (reach + 4e-3) / 2e-3).ceil() as u32, 2e-3, |_, _| {
        0.0
    });
    let positions = flat.positions().iter().map(|p| pose * p).collect();
    TriMesh::new(
        positions,
        flat.faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect(),
    )
    .unwrap()
}

/// Mean distance of points from a mesh, m.
fn mean_distance(points: &[Point3<f64>], mesh: &TriMesh) -> f64 {
    let tree = FaceTree::new(mesh);
    let sum: f64 = points
        .iter()
        .map(|p| {
            tree.closest(mesh, p, f64::INFINITY)
                .unwrap()
                .distance_squared
                .sqrt()
        })
        .sum();
    sum / points.len() as f64
}

/// The real probing of a phantom with a ball, into a flat patch under it; from both containers,
/// twice.
#[test]
#[expect(clippy::too_many_lines)]
fn a_real_recording_shapes_a_flat_patch_the_same_from_both_containers() {
    let (Some(mcap), Some(db3)) = (
        shared("force/bags/kidneyZ1_mcap"),
        shared("force/bags/kidneyZ1_db3"),
    ) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (points, forces) = contact_points(&mcap);
    assert!(points.len() > 3_000);
    write_mesh(
        &at("patch.ply"),
        &patch_under(&points, &forces.iter().sum()),
        MeshUnit::Millimetre,
    )
    .unwrap();
    // the authors' own threshold of contact; forces here are tenths of a newton
    fs::write(
        at("probe.yaml"),
        "contact: { on_n: 0.1, off_n: 0.06 }\nscan: off\nguard: off\npatch: off\n",
    )
    .unwrap();
    let scene = at("probe.yaml");
    let flags = [&PROBE[..], &["--scene", scene.to_str().unwrap()]].concat();

    let mut results = vec![];
    for (bag, out) in [
        (&mcap, "a.ply"),
        (&db3, "b.ply"),
        (&mcap, "c.ply"),
        (&db3, "d.ply"),
    ] {
        let output = refine(&at("patch.ply"), bag, &at(out), &flags);
        let said = stderr(&output);
        // a phantom is no plane
        let is_doubted =
            said.lines().count() == 1 && said.contains("perhaps: the ball's centre is");
        assert!(code(&output) == 0 && is_doubted, "nothing is lost: {said}");
        let mut summary = summary(&output);
        for time in ["push_ns", "load_s", "replay_s"] {
            summary.as_object_mut().unwrap().remove(time);
        }
        summary["patch"]
            .as_object_mut()
            .map(|patch| patch.remove("build_s"));
        results.push((summary, fs::read(at(out)).unwrap()));
    }
    assert!(
        results.iter().all(|result| *result == results[0]),
        "the same from both containers, twice"
    );
    let summary = &results[0].0;
    println!("{summary}");
    assert_eq!(number(summary, "samples"), 6_000, "all wrenches are read");
    assert_eq!(
        number(summary, "accepted"),
        6_000,
        "at 66 Hz no gap is longer than is allowed"
    );

    let read = |name| read_mesh(&at(name), MeshUnit::Millimetre).unwrap().mesh;
    let (flat, refined) = (
        mean_distance(&points, &read("patch.ply")),
        mean_distance(&points, &read("a.ply")),
    );
    println!(
        "{} contact points: {:.4} mm from the flat patch, {:.4} mm from the refined one",
        points.len(),
        flat * 1e3,
        refined * 1e3
    );
    assert!(refined < 0.5 * flat, "{refined:e} m, {flat:e} m");
}

// ---- a made plate

/// A noisy plate in mm, and a ball of 1.5 mm that slides over the true plane.
struct Plate {
    folder: TempDir,
}

const TIP: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(20e3),
};

impl Plate {
    fn new() -> Self {
        let plate = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let mut rng = Pcg64::seed_from_u64(5);
        let scan = grid(16, 2.4e-3, |_, _| within(&mut rng, -0.5e-3, 0.5e-3));
        write_mesh(&plate.at("scan.ply"), &scan, MeshUnit::Millimetre).unwrap();
        write_recording(
            &plate.at("touch.mcap"),
            &Topics::default(),
            "object",
            "stylus",
            plate_touches(),
        )
        .unwrap();
        plate
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn refine(&self, out: &str, flags: &[&str]) -> Output {
        let is_told = flags
            .iter()
            .any(|flag| ["--tip-radius-mm", "--scene"].contains(flag));
        let tip: &[&str] = if is_told {
            &[]
        } else {
            &["--tip-radius-mm", "1.5"]
        };
        refine(
            &self.at("scan.ply"),
            &self.at("touch.mcap"),
            &self.at(out),
            &[flags, tip, &["--json"]].concat(),
        )
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap()
    }
}

/// Four seconds: 21 lines of 20 mm, poses at 500 Hz and wrenches at 1 kHz, 2 N, friction 0.2,
/// lifted between lines.
fn plate_touches() -> Vec<Message> {
    let mut messages = vec![];
    for tick in 0..4_200_i64 {
        let stamp_ns = 1_700_000_000_000_000_000 + tick * 1_000_000;
        let (line, along) = (tick / 200, (tick % 200) as f64 / 200.0);
        let presses = (0.05..0.95).contains(&along);
        let force = if presses {
            Vector3::new(-0.4, 0.0, 2.0)
        } else {
            Vector3::zeros()
        };
        let up = if presses { 0.0 } else { 1e-3 };
        let centre = Vector3::new(
            -10e-3 + 20e-3 * along,
            -10e-3 + 1e-3 * line as f64,
            1.5e-3 + up,
        ) - force / 20e3;
        if tick % 2 == 0 {
            let pose_ot = Isometry3::from_parts(centre.into(), UnitQuaternion::identity());
            messages.push(Message::Pose(StampedPose { stamp_ns, pose_ot }));
        }
        let wrench = Wrench {
            force,
            torque: Vector3::zeros(),
        };
        messages.push(Message::Wrench(StampedWrench { stamp_ns, wrench }));
    }
    messages
}

/// The first run is the library's own, sample by sample as if live; each replay gives its bytes.
#[test]
#[expect(clippy::too_many_lines)]
fn a_replay_equals_the_first_run_byte_for_byte() {
    let plate = Plate::new();
    let scan = read_mesh(&plate.at("scan.ply"), MeshUnit::Millimetre)
        .unwrap()
        .mesh;
    let patch = PatcherParams::new(TIP.radius, TIP.stiffness, 0.6e-3);
    let mut engine = Engine::new(
        scan.clone(),
        RefineParams::robust(TIP),
        Some(patch),
        Renewal::AtEnd,
    )
    .unwrap();
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    let mut samples = 0;
    let mut take = |sync: &mut Synchroniser| {
        while let Some(sample) = sync.next_sample() {
            engine.push(&sample).unwrap();
            samples += 1;
        }
    };
    for message in plate_touches() {
        sync.push(message);
        take(&mut sync);
    }
    sync.finish();
    take(&mut sync);
    let ended = engine.finish().unwrap();
    let (refiner, mut patcher) = (ended.refiner, ended.patcher.unwrap());
    patcher.flush();
    let patched = patcher.patched(&scan, &FaceTree::new(&scan)).unwrap();
    let columns = patched.columns().into_iter();
    let columns: Vec<_> = columns
        .map(|(name, values)| VertexColumn {
            name,
            values: values.into(),
        })
        .collect();
    write_mesh_with(
        &plate.at("live.ply"),
        &patched.mesh,
        &columns,
        None,
        MeshUnit::Millimetre,
    )
    .unwrap();

    for out in ["one.ply", "two.ply"] {
        let output = plate.refine(out, &[]);
        assert_eq!((code(&output), stderr(&output)), (0, String::new()));
        let summary = summary(&output);
        assert_eq!(number(&summary, "accepted"), samples);
        assert_eq!(number(&summary, "cut_back"), refiner.counts().cut_back);
        assert_eq!(number(&summary, "contacts"), 21);
        assert!(plate.bytes(out) == plate.bytes("live.ply"), "{out}");
    }
    assert!(plate.bytes("live.ply") != plate.bytes("scan.ply"));

    // in real time, with the patch on a thread of its own
    let output = plate.refine("beside.ply", &["--live"]);
    assert_eq!((code(&output), stderr(&output)), (0, String::new()));
    let live = &summary(&output)["live"];
    // 4.2 s in steps of 8 ms, and the rest at the end; renewals after a late one take more in and
    // are fewer
    let least = if number(live, "late") == 0 { 520 } else { 1 };
    assert!((least..=530).contains(&number(live, "renewals")), "{live}");
    let behind = &live["behind_ns"];
    assert!(
        (1..4_200_000_000).contains(&number(behind, "max")),
        "{live}"
    );
    assert!(number(behind, "median") <= number(behind, "max"), "{live}");
    assert!(plate.bytes("beside.ply") == plate.bytes("live.ply"));
    fs::write(
        plate.at("scene.yaml"),
        "tip:\n  radius_mm: 1.5\npatch: off\n",
    )
    .unwrap();
    let output = plate.refine(
        "none.ply",
        &[
            "--live",
            "--scene",
            plate.at("scene.yaml").to_str().unwrap(),
        ],
    );
    assert_eq!(code(&output), 2);
    assert!(
        stderr(&output).contains("take `patch: off`"),
        "{}",
        stderr(&output)
    );
}

/// A pose without a rotation is a lost pose: no sample drops out for it, and the sum shows it.
#[test]
fn the_numbers_add_up_when_a_pose_is_bad() {
    let plate = Plate::new();
    let mut messages = plate_touches();
    let Message::Pose(pose) = &mut messages[300] else {
        panic!("every third message is a pose")
    };
    pose.pose_ot.rotation.as_mut_unchecked().coords *= 2.0;
    write_recording(
        &plate.at("touch.mcap"),
        &Topics::default(),
        "object",
        "stylus",
        messages,
    )
    .unwrap();
    let output = plate.refine("out.ply", &[]);
    assert_eq!(code(&output), 4, "{}", stderr(&output));
    let summary = summary(&output);
    assert_eq!(
        (number(&summary, "samples"), number(&summary, "accepted")),
        (4_200, 4_199),
        "the last wrench has no pose after it"
    );
}

/// Each of these once ran for minutes without a word, and took gigabytes.
#[test]
#[expect(clippy::too_many_lines)]
fn a_wrong_unit_and_settings_that_cost_too_much_are_refused_with_the_reason() {
    let plate = Plate::new();
    let in_mm = plate_touches().into_iter().map(|message| match message {
        Message::Pose(mut pose) => {
            pose.pose_ot.translation.vector *= 1e3;
            Message::Pose(pose)
        }
        wrench => wrench,
    });
    write_recording(
        &plate.at("mm.mcap"),
        &Topics::default(),
        "object",
        "stylus",
        in_mm,
    )
    .unwrap();
    let tip = ["--tip-radius-mm", "1.5"];
    let poses = refine(
        &plate.at("scan.ply"),
        &plate.at("mm.mcap"),
        &plate.at("out.ply"),
        &tip,
    );
    // a lattice of √(16 · 1.5 mm · tolerance)
    let within = |tolerance_mm: f64| {
        let scene = plate.at("fine.yaml");
        fs::write(
            &scene,
            format!("tip: {{ radius_mm: 1.5 }}\npatch: {{ tolerance_mm: {tolerance_mm} }}\n"),
        )
        .unwrap();
        plate.refine("out.ply", &["--scene", scene.to_str().unwrap()])
    };
    let refused = [
        (poses, "the poses look like mm"),
        (
            plate.refine("out.ply", &["--tip-radius-mm", "0.0015"]),
            "tip.radius_mm is 0.0015",
        ),
        (
            plate.refine("out.ply", &["--tip-radius-mm", "1e-6"]),
            "tip.radius_mm is 1e-6",
        ),
        (
            within(0.02 * 0.02 / 24.0),
            "around one contact of a tip of 1.5 mm would have 3.9e7 nodes and take 15.5 GB",
        ),
        (
            within(0.08 * 0.08 / 24.0),
            "around all that was touched would have",
        ),
    ];
    for (output, why) in refused {
        assert!(
            code(&output) == 3 && stderr(&output).contains(why),
            "{why}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).lines().count() == 1 && !plate.at("out.ply").exists(),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn other_parameters_give_another_mesh() {
    let plate = Plate::new();
    let what_ifs: [&[&str]; 5] = [
        &[],
        &["--tip-radius-mm", "1.4"],
        &["--stiffness-n-per-mm", "10"],
        &["--mode", "paper"],
        &["--mode", "robust", "--tip-radius-mm", "1.7"],
    ];
    let mut meshes = BTreeSet::new();
    for flags in what_ifs {
        let output = plate.refine("out.ply", flags);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert!(number(&summary(&output), "moved_faces") > 0);
        meshes.insert(plate.bytes("out.ply"));
    }
    assert_eq!(meshes.len(), what_ifs.len());
}

// ---- damage

/// Permitted outcomes of any run: finish, with a whole mesh; or refuse with one line, and leave no
/// file.
fn check_outcome(
    output: &Output,
    out: &Path,
    unit: MeshUnit,
    faces: impl FnOnce() -> usize,
    what: &str,
) {
    let code = code(output);
    assert!(
        [0, 3, 4].contains(&code),
        "{what}: code {code}, {}",
        stderr(output)
    );
    let lines = stderr(output).lines().count();
    if code == 3 {
        assert_eq!(
            (lines, output.stdout.len()),
            (1, 0),
            "{what}: {}",
            stderr(output)
        );
        assert!(!out.exists(), "{what}: no result");
        return;
    }
    let loss = stderr(output)
        .lines()
        .last()
        .is_some_and(|line| line.starts_with("{\"kind\":\"losses\""));
    assert_eq!(loss, code == 4, "{what}: {}", stderr(output));
    let patch = &any_summary(output)["patch"];
    let [added, removed] =
        ["added_faces", "removed_faces"].map(|key| patch[key].as_u64().unwrap_or(0) as usize);
    let refined = read_mesh(out, unit).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(
        refined.mesh.face_count(),
        faces() + added - removed,
        "{what}: the mesh is whole"
    );
    fs::remove_file(out).unwrap();
}

/// Cuts a file short, or flips a few of its bits.
fn damage(bytes: &mut Vec<u8>, rng: &mut Pcg64) -> String {
    let at = |rng: &mut Pcg64, len: usize| within(rng, 0.0, len as f64) as usize;
    if within(rng, 0.0, 1.0) < 0.4 {
        let len = at(rng, bytes.len());
        bytes.truncate(len);
        return format!("cut to {len} bytes");
    }
    // half of them early, among the headers
    let span = if within(rng, 0.0, 1.0) < 0.5 {
        bytes.len().min(4096)
    } else {
        bytes.len()
    };
    let flips: Vec<_> = (0..1 + at(rng, 8))
        .map(|_| (at(rng, span), at(rng, 8)))
        .collect();
    flips
        .iter()
        .for_each(|&(byte, bit)| bytes[byte] ^= 1 << bit);
    format!("bits flipped at {flips:?}")
}

#[test]
#[expect(clippy::too_many_lines)]
fn damaged_recordings_are_refused_or_read_as_far_as_they_go() {
    let folder = tempfile::tempdir().unwrap();
    let (scan, out) = (
        folder.path().join("patch.ply"),
        folder.path().join("out.ply"),
    );
    let mut codes = [0; 5];
    let mut unbalanced = vec![];
    for (name, file) in [
        ("kidneyZ1_mcap", "kidneyZ1_mcap.mcap"),
        ("kidneyZ1_db3", "kidneyZ1_db3.db3"),
    ] {
        let Some(bag) = shared(&format!("force/bags/{name}")) else {
            return;
        };
        if !scan.exists() {
            let (points, forces) = contact_points(&bag);
            write_mesh(
                &scan,
                &patch_under(&points, &forces.iter().sum()),
                MeshUnit::Millimetre,
            )
            .unwrap();
        }
        let faces = read_mesh(&scan, MeshUnit::Millimetre)
            .unwrap()
            .mesh
            .face_count();
        let whole = fs::read(bag.join(file)).unwrap();
        for seed in 0..30 {
            let mut bytes = whole.clone();
            let how = damage(&mut bytes, &mut Pcg64::seed_from_u64(seed));
            let damaged = folder.path().join(file);
            fs::write(&damaged, &bytes).unwrap();
            // its touches are too light for the default threshold
            let output = refine(&scan, &damaged, &out, &[&PROBE[..], &["--force"]].concat());
            let what = format!("{file}, seed {seed}, {how}");
            check_outcome(&output, &out, MeshUnit::Millimetre, || faces, &what);
            if code(&output) == 3 {
                assert!(
                    stderr(&output).contains(file),
                    "{what}: the file is named: {}",
                    stderr(&output)
                );
            }
            if code(&output) != 3 && !adds_up(&any_summary(&output)) {
                unbalanced.push(format!("{what}: {}", any_summary(&output)));
            }
            codes[code(&output) as usize] += 1;
        }
    }
    println!(
        "60 damaged recordings: {} whole, {} refused, {} read in part",
        codes[0], codes[3], codes[4]
    );
    assert!(
        codes[3] > 0 && codes[4] > 0,
        "{codes:?}: the damage is of both kinds"
    );
    assert!(
        unbalanced.is_empty(),
        "samples lost without a word, or counted twice:\n{}",
        unbalanced.join("\n")
    );
}

/// Scans of the worst kind, each in a unit that makes it plausible.
#[test]
#[ignore = "a slow proof"]
fn nasty_scans_are_refused_in_one_line_or_refined() {
    let Some(nasty) = shared("nasty") else { return };
    let plate = Plate::new();
    let out = plate.at("out.ply");
    let mut files: Vec<_> = fs::read_dir(nasty)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    assert!(files.len() > 50, "{}", files.len());
    let mut codes = [0; 5];
    for scan in &files {
        for unit in [MeshUnit::Millimetre, MeshUnit::Metre, MeshUnit::Inch] {
            let what = format!("{} in {unit}", scan.display());
            // `--force` overrides findings about touches of another part
            let flags = [
                "--json",
                "--force",
                "--tip-radius-mm",
                "1.5",
                "--mesh-unit",
                &unit.to_string(),
            ];
            let output = refine(scan, &plate.at("touch.mcap"), &out, &flags);
            let name = scan.file_name().unwrap().to_str().unwrap();
            assert!(
                code(&output) != 3 || stderr(&output).contains(name),
                "{what}: {}",
                stderr(&output)
            );
            check_outcome(
                &output,
                &out,
                unit,
                || read_scan(scan, unit).unwrap().mesh.face_count(),
                &what,
            );
            codes[code(&output) as usize] += 1;
        }
    }
    println!(
        "{} scans: {} refined, {} refused",
        files.len(),
        codes[0] + codes[4],
        codes[3]
    );
    assert!(codes[0] > 0 && codes[3] > 0, "{codes:?}");
}
