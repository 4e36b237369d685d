//! Scans of a known surface: as bad as real ones, but sound meshes.

use std::collections::HashMap;

use super::*;
use touchup::sim::{ScannerParams, measure_quality, scan};

/// Directed edges with the numbers of their faces.
fn directed_edges(mesh: &TriMesh) -> HashMap<(u32, u32), u32> {
    let mut edges = HashMap::new();
    for (_, c) in mesh.faces() {
        (0..3).for_each(|i| *edges.entry((c[i].0, c[(i + 1) % 3].0)).or_default() += 1);
    }
    edges
}

#[test]
fn scan_is_as_bad_as_those_of_an_independent_simulator() {
    let plate = Plate::default();
    let runs: Vec<_> = (1..=4)
        .map(|seed| {
            let mesh = scan(
                &plate,
                &ScannerParams {
                    seed,
                    ..ScannerParams::default()
                },
            )
            .unwrap();
            measure_quality(&mesh, &plate, |_| true).unwrap()
        })
        .collect();
    let mean = |f: &dyn Fn(usize) -> f64| (0..runs.len()).map(f).sum::<f64>() / runs.len() as f64;
    // the cases' scans: edges 2.43 to 2.45 mm, mean distance 0.53 to 0.66, rms 0.65 to 0.92, p95
    // 1.2 to 1.9, bias 0.33 to 0.45
    for (found, low, high) in [
        (mean(&|i| runs[i].edge_median), 2.2e-3, 2.6e-3),
        (mean(&|i| runs[i].mean), 0.5e-3, 0.62e-3),
        (mean(&|i| runs[i].rms), 0.6e-3, 0.85e-3),
        (mean(&|i| runs[i].p95), 1.1e-3, 1.7e-3),
        (mean(&|i| runs[i].bias), 0.25e-3, 0.4e-3),
        (mean(&|i| runs[i].faces as f64), 2000.0, 3200.0),
    ] {
        println!("{found}");
        assert!(
            (low..high).contains(&found),
            "{found} is not between {low} and {high}"
        );
    }
}

#[test]
fn scan_closes_the_small_holes_and_is_open_at_the_back() {
    let plate = Plate::default();
    let mesh = scan(&plate, &ScannerParams::default()).unwrap();
    for feature in plate
        .features()
        .iter()
        .filter(|f| matches!(f.shape, TruthShape::Hole { .. } | TruthShape::Slot { .. }))
    {
        // the axis meets a face near the opening: one whose three corners, seen along the axis,
        // surround it
        let covers = |t: &[Point3<f64>; 3]| {
            let side = |a: &Point3<f64>, b: &Point3<f64>| {
                (b - a).xy().perp(&(feature.centre - a).xy()) > 0.0
            };
            side(&t[0], &t[1]) && side(&t[1], &t[2]) && side(&t[2], &t[0])
        };
        let lid = triangles(&mesh)
            .into_iter()
            .find(covers)
            .map(|t| (t[0].z + t[1].z + t[2].z) / 3.0);
        assert!(
            lid.is_some_and(|z| (z - feature.centre.z).abs() < 2e-3),
            "{}: {lid:?}",
            feature.name
        );
    }
    let edges = directed_edges(&mesh);
    let rim = edges
        .keys()
        .filter(|(a, b)| !edges.contains_key(&(*b, *a)))
        .count();
    assert!(rim > 60, "open at the back");
    assert!(
        !triangles(&mesh)
            .iter()
            .any(|t| (t[0].z + t[1].z + t[2].z) / 3.0 < -2e-3 || {
                let middle = (t[0].coords + t[1].coords + t[2].coords) / 3.0;
                middle.z < 0.5e-3
                    && (0.01..0.07).contains(&middle.x)
                    && (0.01..0.04).contains(&middle.y)
            })
    );
    let closed = scan(
        &plate,
        &ScannerParams {
            open_back: false,
            ..ScannerParams::default()
        },
    )
    .unwrap();
    let edges = directed_edges(&closed);
    let rim = edges
        .keys()
        .filter(|(a, b)| !edges.contains_key(&(*b, *a)))
        .count();
    assert_eq!(rim, 0, "closed");
}

#[test]
fn scan_has_no_folds_crossings_slivers_or_crowded_edges() {
    let plate = Plate::default();
    for seed in 1..=5 {
        let mesh = scan(
            &plate,
            &ScannerParams {
                seed,
                ..ScannerParams::default()
            },
        )
        .unwrap();
        assert!(directed_edges(&mesh).values().all(|n| *n == 1));
        let (mut against, mut near) = (0, Vec::new());
        for (face, _) in mesh.faces() {
            let t @ [a, b, c] = mesh.triangle(face);
            let angles = [(a, b, c), (b, c, a), (c, a, b)]
                .map(|(p, q, r)| (q - p).angle(&(r - p)).to_degrees());
            assert!(angles.iter().all(|angle| *angle > 8.0), "{angles:?}");
            let middle = Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0);
            // beside an edge either side will do
            near.clear();
            plate.near(
                &middle,
                plate.signed_distance(&middle).abs() + 1e-3,
                &mut near,
            );
            against += u32::from(near.iter().all(|s| mesh.normal(face).dot(&s.normal) < 0.0));
        }
        assert_eq!(against, 0, "faces that look against the surface");
        // every edge against every face that it shares no vertex with
        let faces: Vec<_> = mesh.faces().collect();
        for &(f, corners) in &faces {
            let t = mesh.triangle(f);
            let (low, high) = (t[0].inf(&t[1]).inf(&t[2]), t[0].sup(&t[1]).sup(&t[2]));
            for &(_, other) in faces
                .iter()
                .filter(|(_, o)| o.iter().all(|v| !corners.contains(v)))
            {
                for i in 0..3 {
                    let (p, q) = (mesh.position(other[i]), mesh.position(other[(i + 1) % 3]));
                    let apart = (0..3).any(|k| p[k].max(q[k]) < low[k] || p[k].min(q[k]) > high[k]);
                    assert!(
                        apart || !pierces(&p, &q, &t),
                        "seed {seed}: face {f:?} is crossed"
                    );
                }
            }
        }
    }
}

/// Whether a segment pierces a triangle, by the signs of the volumes it spans with the sides.
fn pierces(p: &Point3<f64>, q: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> bool {
    let volume = |x: &Point3<f64>, y: &Point3<f64>, z: &Point3<f64>, w: &Point3<f64>| {
        (y - x).cross(&(z - x)).dot(&(w - x))
    };
    let through = [(a, b), (b, c), (c, a)].map(|(x, y)| volume(p, q, x, y) > 0.0);
    volume(a, b, c, p) * volume(a, b, c, q) < 0.0
        && through[0] == through[1]
        && through[1] == through[2]
}

#[test]
fn scan_of_a_mesh_is_that_of_its_surface_and_the_seed_decides() {
    let plate = Plate::default();
    let mesh = plate.mesh(10e-6).unwrap();
    let params = ScannerParams {
        edge: 4e-3,
        ..ScannerParams::default()
    };
    let (a, b) = (
        scan(&plate, &params).unwrap(),
        scan(&MeshSurface::new(&mesh).unwrap(), &params).unwrap(),
    );
    let [qa, qb] = [&a, &b].map(|m| measure_quality(m, &plate, |_| true).unwrap());
    assert!(
        (qa.mean - qb.mean).abs() < 20e-6 && (qa.bias - qb.bias).abs() < 20e-6,
        "{qa:?} {qb:?}"
    );
    let again = scan(&plate, &params).unwrap();
    assert!(a.positions() == again.positions() && a.faces().eq(again.faces()));
    assert!(
        scan(&plate, &ScannerParams { seed: 2, ..params })
            .unwrap()
            .positions()
            != a.positions()
    );
}

#[test]
fn perfect_scanner_sees_the_surface() {
    let peaks = Peaks::default();
    let params = ScannerParams {
        edge: 1e-3,
        noise: 0.0,
        bias: 0.0,
        rounding: 0.0,
        closes_holes_below: 0.0,
        rigid_shift: 0.0,
        rigid_turn: 0.0,
        ..ScannerParams::default()
    };
    let quality = measure_quality(&scan(&peaks, &params).unwrap(), &peaks, |_| true).unwrap();
    // chords of 1 mm on a radius of at least 1.57 mm are off by less than 1²/(8 · 1.57) mm
    assert!(
        quality.p95 < 0.08e-3 && quality.mean < 0.02e-3,
        "{quality:?}"
    );
}

#[test]
fn senseless_scanner_settings_are_refused() {
    let plate = Plate::default();
    let run = |params: ScannerParams| scan(&plate, &params).unwrap_err();
    let base = ScannerParams::default();
    assert!(matches!(
        run(ScannerParams { edge: 0.0, ..base }),
        SimError::BadParameter { .. }
    ));
    assert!(matches!(
        run(ScannerParams {
            noise: f64::NAN,
            ..base
        }),
        SimError::BadParameter { .. }
    ));
    assert!(matches!(
        run(ScannerParams { edge: 1e-6, ..base }),
        SimError::TooFine { .. }
    ));
    let message = |params: ScannerParams| run(params).to_string();
    let (fine, noisy) = (
        message(ScannerParams { edge: 1e-6, ..base }),
        message(ScannerParams {
            noise: 1e300,
            ..base
        }),
    );
    assert!(
        fine.contains("use longer edges") && !fine.contains("less of"),
        "{fine}"
    );
    assert!(
        noisy.contains("use less of these three") && noisy.len() < 250,
        "{noisy}"
    );
    let coarse = run(ScannerParams { edge: 0.03, ..base });
    assert!(
        matches!(coarse, SimError::TooCoarse { .. }) && coarse.to_string().contains("shorter"),
        "{coarse}"
    );
}
