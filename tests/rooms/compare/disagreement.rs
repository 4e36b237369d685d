//! Disagreement of touch and scan on known parts: `touchup disagree` blames the scanner, the part
//! or the touch.

use std::path::PathBuf;
use std::process::Command;

use nalgebra::{Point3, Vector3};
use serde_json::Value;
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::io::recording::{Topics, write_recording};
use touchup::mesh::{TriMesh, VertexId, repair};
use touchup::sim::{
    MeshSurface, PathParams, Plate, ScannerParams, StylusParams, plan_mesh, scan, touch,
};
use touchup::stylus::Message;

/// A good scanner; it still closes holes, rounds edges, is too large and displaced.
fn scanner(seed: u64) -> ScannerParams {
    let closes = 6e-3;
    ScannerParams {
        edge: 1.4e-3,
        noise: 0.12e-3,
        bias: 0.15e-3,
        rounding: 0.5e-3,
        closes_holes_below: closes,
        seed,
        ..Default::default()
    }
}

/// The part of the scan, and the part of the touch.
struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn new(
        scanned: &TriMesh,
        touched: &TriMesh,
        scanner: &ScannerParams,
        shake: impl Fn(&mut [Message]),
    ) -> Self {
        let case = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let (before, now) = (
            MeshSurface::new(scanned).unwrap(),
            MeshSurface::new(touched).unwrap(),
        );
        write_mesh(
            &case.path("scan.ply"),
            &scan(&before, scanner).unwrap(),
            MeshUnit::Millimetre,
        )
        .unwrap();
        let path = plan_mesh(
            &now,
            &touchup::sim::Surface::bounds(&now),
            &scanner.view,
            &PathParams::default(),
        )
        .unwrap();
        let mut messages = touch(&now, &path, &StylusParams::default(), scanner.seed)
            .unwrap()
            .messages;
        shake(&mut messages);
        write_recording(
            &case.path("touch.mcap"),
            &Topics::default(),
            "object",
            "stylus",
            messages,
        )
        .unwrap();
        let [scan, bag, out, csv] =
            ["scan.ply", "touch.mcap", "refined.ply", "touches.csv"].map(|name| case.text(name));
        let tip = ["--tip-radius-mm", "1.5", "--stiffness-n-per-mm", "20"];
        touchup(
            &[
                &[
                    "refine",
                    "--scan",
                    &scan,
                    "--bag",
                    &bag,
                    "--out",
                    &out,
                    "--touches-out",
                    &csv,
                ],
                &tip[..],
            ]
            .concat(),
        );
        case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn disagree(&self) -> Value {
        let [scan, refined, csv, map] =
            ["scan.ply", "refined.ply", "touches.csv", "map.ply"].map(|name| self.text(name));
        let report = touchup(&[
            "disagree",
            &scan,
            &refined,
            "--touches",
            &csv,
            "--json",
            "--coloured",
            &map,
        ]);
        serde_json::from_str(&report).unwrap()
    }
}

fn touchup(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

fn area(report: &Value, class: &str) -> f64 {
    let classes = report["classes"].as_array().unwrap();
    classes.iter().find(|own| own["class"] == class).unwrap()["refined_mm2"]
        .as_f64()
        .unwrap()
}

fn regions<'a>(report: &'a Value, class: &'a str) -> Vec<&'a Value> {
    report["regions"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|own| own["class"] == class)
        .collect()
}

fn centre(region: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| region["center_mm"][i].as_f64().unwrap())
}

fn plate() -> TriMesh {
    Plate::default().mesh(20e-6).unwrap()
}

/// The mesh with its vertices elsewhere.
fn moved(mesh: &TriMesh, place: impl Fn(Point3<f64>) -> Point3<f64>) -> TriMesh {
    let mut moved = mesh.clone();
    for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
        moved.set_position(vertex, place(mesh.position(vertex)));
    }
    moved
}

/// A block of 60 mm × 40 mm × 12 mm, whose upper side follows `top` in x and z, mm.
fn block(top: &[[f64; 2]]) -> TriMesh {
    let outline: Vec<[f64; 2]> = [[0.0, 0.0], [60.0, 0.0]]
        .into_iter()
        .chain(top.iter().rev().copied())
        .collect();
    let count = outline.len() as u32;
    let at = |y: f64| {
        outline
            .iter()
            .map(move |[x, z]| Point3::new(x * 1e-3, y, z * 1e-3))
    };
    let positions: Vec<_> = at(0.0).chain(at(40e-3)).collect();
    let sides = (0..count).flat_map(|i| {
        let j = (i + 1) % count;
        [[i, j, j + count], [i, j + count, i + count]]
    });
    // both ends are fans of vertical strips: between the bottom and each piece of the top
    let mut faces: Vec<[u32; 3]> = sides.map(|[a, b, c]| [a, c, b]).collect();
    let ears = ears(&outline);
    faces.extend(ears.iter().map(|&[a, b, c]| [a, b, c]));
    faces.extend(
        ears.iter()
            .map(|&[a, b, c]| [a + count, c + count, b + count]),
    );
    let (mesh, report) = repair(positions, faces).unwrap();
    assert_eq!(report.boundary_edges, 0);
    mesh
}

/// Triangles of a simple polygon, by cutting ears.
fn ears(outline: &[[f64; 2]]) -> Vec<[u32; 3]> {
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut left: Vec<usize> = (0..outline.len()).collect();
    let mut triangles = Vec::new();
    while left.len() >= 3 {
        let n = left.len();
        let is_ear = |&i: &usize| {
            let [a, b, c] = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let [p, q, r] = [outline[a], outline[b], outline[c]];
            let inside = |at: &usize| {
                let x = outline[*at];
                ![a, b, c].contains(at)
                    && cross(p, q, x) >= 0.0
                    && cross(q, r, x) >= 0.0
                    && cross(r, p, x) >= 0.0
            };
            cross(p, q, r) > 0.0 && !left.iter().any(inside)
        };
        let i = (0..n).find(is_ear).unwrap();
        triangles.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]].map(|at| at as u32));
        left.remove(i);
    }
    triangles
}

#[test]
#[ignore = "a slow proof"]
fn a_part_that_was_not_changed_is_not_called_changed() {
    for seed in 1..=3 {
        let poor = ScannerParams {
            seed,
            ..Default::default()
        };
        for scanner in [poor, scanner(seed)] {
            let case = Case::new(&plate(), &plate(), &scanner, |_| ());
            let report = case.disagree();
            assert_eq!(
                regions(&report, "changed part").len(),
                0,
                "{seed}: {report}"
            );
            assert_eq!(area(&report, "changed part"), 0.0);
            let touched = area(&report, "agrees") + area(&report, "scanner error");
            // noise at an edge looks like a small change, above all the noise of a poor scanner
            let is_poor = scanner.noise > 0.3e-3;
            let share = if is_poor { 0.06 } else { 0.04 };
            let small = |class| area(&report, class) < share * touched;
            assert!(
                small("unsure") && small("bad touch"),
                "{seed}: {} {}",
                report["classes"],
                report["regions"]
            );
            // the simulated value, to the accuracy of a few dozen independent places
            let noise = report["scanner"]["noise_mm"].as_f64().unwrap();
            assert!(
                (0.5..1.6).contains(&(noise / (scanner.noise * 1e3))),
                "{seed}: {noise}"
            );
            if is_poor {
                turned_no_farther_than_known(&report, seed);
            } else {
                assert_eq!(spikes(&report), 0, "{seed}: {report}");
                written_columns_match(&report, &case);
                refuses_a_mesh_without_marks(&case);
            }
        }
    }
}

/// The scan lies 0.15° and 0.2 mm off, and noise of 0.6 mm hides most of it: the reported offset is
/// no more than that, within the stated deviation.
fn turned_no_farther_than_known(report: &Value, seed: u64) {
    let vector =
        |name: &str| Vector3::from_fn(|i, _| report["rigid_offset"][name][i].as_f64().unwrap());
    if !report["rigid_offset"].is_null() {
        let far = vector("turn_deg").norm() - 0.15;
        assert!(
            far < 3.0 * vector("turn_std_deg").norm(),
            "{seed}: {}",
            report["rigid_offset"]
        );
    }
}

/// The mesh as `--coloured` writes it has the area of all classes.
fn written_columns_match(report: &Value, case: &Case) {
    let map = read_mesh(&case.path("map.ply"), MeshUnit::Millimetre)
        .unwrap()
        .mesh;
    let all: f64 = report["classes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["refined_mm2"].as_f64().unwrap())
        .sum();
    let area: f64 = map
        .faces()
        .map(|(face, _)| map.double_area_normal(face).norm() / 2.0)
        .sum();
    assert!((all / (area * 1e6) - 1.0).abs() < 1e-4);
}

/// The touched places of a scan are unknown.
fn refuses_a_mesh_without_marks(case: &Case) {
    let [scan, csv] = ["scan.ply", "touches.csv"].map(|name| case.text(name));
    let unmarked = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(["disagree", &scan, &scan, "--touches", &csv])
        .output()
        .unwrap();
    assert_eq!(unmarked.status.code(), Some(2));
    let message = String::from_utf8(unmarked.stderr).unwrap();
    assert!(
        message.contains("give the PLY that refine wrote"),
        "{message}"
    );
}

/// Number of bad touches that are far off.
fn spikes(report: &Value) -> usize {
    let far = |bad: &&Value| bad["off_mm"].as_f64().unwrap() > 0.4;
    report["bad_touches"]
        .as_array()
        .unwrap()
        .iter()
        .filter(far)
        .count()
}

#[test]
#[ignore = "a slow proof"]
fn a_boss_that_was_milled_off_by_a_millimetre_is_found() {
    for seed in 1..=3 {
        let now = moved(&plate(), |p| {
            if p.z > 15e-3 {
                p - Vector3::z() * 1e-3
            } else {
                p
            }
        });
        let report = Case::new(&plate(), &now, &scanner(seed), |_| ()).disagree();
        let found = regions(&report, "changed part");
        assert_eq!(found.len(), 1, "{seed}: {report}");
        // the boss is at (47, 25) mm, 10 mm wide
        assert!(
            (centre(found[0]) - Vector3::new(47.0, 25.0, 15.0)).norm() < 1.0,
            "{seed}: {}",
            found[0]
        );
        let (mean, area) = (
            found[0]["mean_mm"].as_f64().unwrap(),
            found[0]["area_mm2"].as_f64().unwrap(),
        );
        assert!(
            (-1.35..-0.8).contains(&mean),
            "{seed}: 1 mm, and the surface offset of the scan: {mean}"
        );
        assert!(
            (20.0..100.0).contains(&area),
            "at most the top of 78.5 mm2 and its rim: {area}"
        );
    }
}

#[test]
#[ignore = "a slow proof"]
fn a_groove_that_was_cut_is_found() {
    let before = block(&[[0.0, 12.0], [60.0, 12.0]]);
    let now = block(&[
        [0.0, 12.0],
        [22.0, 12.0],
        [22.0, 10.5],
        [38.0, 10.5],
        [38.0, 12.0],
        [60.0, 12.0],
    ]);
    for seed in 1..=3 {
        let report = Case::new(&before, &now, &scanner(seed), |_| ()).disagree();
        let found = regions(&report, "changed part");
        assert!(!found.is_empty(), "{seed}: {report}");
        for region in found {
            let centre = centre(region);
            assert!(
                (22.0..38.0).contains(&centre.x) && (centre.z - 10.5).abs() < 0.6,
                "{seed}: {region}"
            );
        }
        // and nowhere else: the map agrees place by place
        let changed = area(&report, "changed part");
        assert!(
            (250.0..720.0).contains(&changed),
            "16 mm by 40 mm and its walls: {changed}"
        );
    }
}

#[test]
#[ignore = "a slow proof"]
fn spikes_of_the_pose_are_bad_touches() {
    for seed in 1..=2 {
        // 12 times for 30 ms the tracker reads 1.2 mm too high
        let shake = |messages: &mut [Message]| {
            let last = messages.len();
            for burst in 1..=12 {
                let from = last * burst / 14;
                let begin = messages[from].stamp_ns();
                for message in &mut messages[from..] {
                    if message.stamp_ns() - begin > 30_000_000 {
                        break;
                    }
                    if let Message::Pose(pose) = message {
                        pose.pose_ot.translation.z += 1.2e-3;
                    }
                }
            }
        };
        let spiked = Case::new(&plate(), &plate(), &scanner(seed), shake).disagree();
        assert!(spikes(&spiked) >= 3, "{seed}: {}", spiked["bad_touches"]);
        assert_eq!(area(&spiked, "changed part"), 0.0, "{seed}: {spiked}");
    }
}

#[test]
#[ignore = "a slow proof"]
fn a_scan_that_is_turned_by_three_degrees_is_reported_in_most() {
    let found = |seed: &u64| {
        let turned = ScannerParams {
            seed: *seed,
            rigid_turn: 3f64.to_radians(),
            ..Default::default()
        };
        let report = Case::new(&plate(), &plate(), &turned, |_| ()).disagree();
        !report["rigid_offset"].is_null()
    };
    let count = (1..=3).filter(found).count();
    assert!(count >= 2, "{count} of 3");
}
