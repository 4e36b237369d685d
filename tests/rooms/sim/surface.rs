//! Known surfaces: drawings by hand, distances against brute force.

use std::collections::HashMap;

use super::*;
use touchup::sim::add_vertex_noise;

/// Volume by the divergence theorem.
fn volume(mesh: &TriMesh) -> f64 {
    triangles(mesh)
        .iter()
        .map(|[a, b, c]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0)
        .sum()
}

#[test]
fn plate_mesh_is_closed_outward_and_has_one_tunnel() {
    let plate = Plate::default();
    let mesh = plate.mesh(10e-6).unwrap();
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for (_, c) in mesh.faces() {
        (0..3).for_each(|i| *edges.entry((c[i].0, c[(i + 1) % 3].0)).or_default() += 1);
    }
    assert!(
        edges
            .iter()
            .all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1))
    );
    let euler = mesh.vertex_count() as i64 - edges.len() as i64 / 2 + mesh.face_count() as i64;
    // V − E + F = 2 − 2 · tunnels
    assert_eq!(euler, 0);
    assert!(
        mesh.positions()
            .iter()
            .all(|p| plate.signed_distance(p).abs() < 1e-15)
    );
    assert!(
        mesh.faces()
            .all(|(f, _)| mesh.double_area_normal(f).norm() > 1e-12),
        "no face without area"
    );
}

#[test]
fn plate_volume_converges_to_the_closed_form() {
    let plate = Plate::default();
    // by hand, mm³: 60·50·12 + 20·50·9, + π 5² 4 − π 4² 12 − π 3² 8 − (π 3² + 14·6) 5
    let by_hand = (60. * 50. * 12. + 20. * 50. * 9. + PI * (100. - 192. - 72. - 45.) - 420.) * 1e-9;
    let error = |chord: f64| (volume(&plate.mesh(chord).unwrap()) - by_hand).abs();
    // curved walls of 2π (3·8 + 4·12 + 5·4 + 3·5) mm²; the area between chord and arc is less than
    // chord error · arc
    let walls = 2.0 * PI * 107e-6;
    assert!(
        error(40e-6) < walls * 40e-6 && error(10e-6) < error(40e-6) / 3.0,
        "{} {}",
        error(40e-6),
        error(10e-6)
    );
}

#[test]
fn plate_distances_worked_by_hand() {
    let plate = Plate::default();
    let mm = |x: f64, y: f64, z: f64| plate.signed_distance(&(Point3::new(x, y, z) * 1e-3)) * 1e3;
    let cases = [
        (mm(5., 5., 14.), 2.0),                    // above the top
        (mm(5., 5., 11.), -1.0),                   // below the top
        (mm(70., 20., 10.), 1.0),                  // above the lower step
        (mm(61., 20., 11.), 1.0),                  // beside the riser
        (mm(63., 20., 16.), 5.0),                  // off the step's edge: 3, 4, 5
        (mm(16., 36., 6.), 4.0),                   // on the axis of the through-hole
        (mm(16., 36., 15.), 5.0),                  // above it: the rim is 4 aside and 3 below
        (mm(32., 34., 4.5), 0.5),                  // above the floor of the blind hole
        (mm(32., 34., 3.0), -1.0),                 // below it
        (mm(25., 14., 9.5), 2.5),                  // in the slot, nearest the floor
        (mm(34., 14., 9.5), 1.0),                  // in its rounded end
        (mm(47., 25., 17.0), 1.0),                 // above the boss
        (mm(53., 25., 13.5), 1.0),                 // beside it
        (mm(47., 25., 12.0), -4.0),                // inside, within the boss
        (mm(56., 25., 19.0), 5.0),                 // off its rim: 4 aside, 3 above
        (mm(-3., -4., -12.), 13.0),                // off a corner
        (mm(59., 25., 8.), -(1f64 + 1f64).sqrt()), // below the inner corner of the step
    ];
    for (i, (found, expected)) in cases.iter().enumerate() {
        assert!(
            (found - expected).abs() < 1e-9,
            "case {i}: {found} instead of {expected}"
        );
    }
}

#[test]
fn plate_features_are_those_of_the_drawing() {
    let plate = Plate::default();
    for feature in plate.features() {
        match feature.shape {
            TruthShape::Hole {
                diameter,
                depth,
                through,
            } => {
                let floor = feature.centre - feature.axis * depth;
                assert_eq!(
                    plate.signed_distance(&floor) > 1e-4,
                    through,
                    "{}",
                    feature.name
                );
                let side =
                    feature.centre + Vector3::x() * (diameter / 2.0) - feature.axis * (depth / 2.0);
                assert!(plate.signed_distance(&side).abs() < 1e-15);
            }
            TruthShape::Slot {
                width,
                length,
                depth,
                direction,
            } => {
                let middle = feature.centre - feature.axis * (depth / 2.0);
                let end = middle + direction * (length / 2.0);
                let side = middle + direction.cross(&feature.axis) * (width / 2.0);
                assert!(
                    [end, side]
                        .iter()
                        .all(|p| plate.signed_distance(p).abs() < 1e-15)
                );
            }
            TruthShape::Boss { diameter, height } => {
                let rim = feature.centre + feature.axis * height + Vector3::y() * (diameter / 2.0);
                assert!(plate.signed_distance(&rim).abs() < 1e-15);
            }
            TruthShape::Step {
                height,
                length,
                direction,
            } => {
                let end = feature.centre + direction * (length / 2.0) - feature.axis * height;
                assert!(plate.signed_distance(&end).abs() < 1e-15);
            }
        }
    }
}

/// Largest distance of the fine plate mesh below from the plate, m.
const CHORD: f64 = 1e-6;

fn check_against_mesh(
    plate: &Plate,
    mesh: &[[Point3<f64>; 3]],
    p: Point3<f64>,
) -> Result<(), TestCaseError> {
    let signed = plate.signed_distance(&p);
    let brute = mesh
        .iter()
        .map(|t| distance_to_triangle(&p, t))
        .fold(f64::MAX, f64::min);
    prop_assert!(
        (signed.abs() - brute).abs() <= CHORD,
        "{signed} against {brute}"
    );
    if brute > 2.0 * CHORD {
        prop_assert_eq!(signed < 0.0, winding_number(&p, mesh) > 0.5);
    }
    let closest = plate.closest(&p);
    prop_assert!(plate.signed_distance(&closest.point).abs() < 1e-15);
    prop_assert!((closest.normal.norm() - 1.0).abs() < 1e-12);
    // out of the material on one side, into it on the other
    let off = closest.normal * 1e-7;
    prop_assert!(plate.signed_distance(&(closest.point + off)) >= -1e-12);
    // the distance grows as fast as one moves along `outward`
    let outward = plate.outward(&p);
    prop_assert!((outward.norm() - 1.0).abs() < 1e-12);
    let back = p - outward * (signed * 0.5);
    prop_assert!((plate.signed_distance(&back) - signed * 0.5).abs() < 1e-12);
    Ok(())
}

#[test]
fn plate_distance_is_that_of_its_fine_mesh() {
    let plate = Plate::default();
    let mesh = triangles(&plate.mesh(CHORD).unwrap());
    proptest!(ProptestConfig::with_cases(3000), |(p in around(&plate, 5e-3))| check_against_mesh(&plate, &mesh, p)?);
}

/// Closest distance to the graph of `peaks` over ever finer grids around the best node.
fn brute_peaks(peaks: &Peaks, p: &Point3<f64>) -> f64 {
    let far = |x: f64, y: f64| (Point3::new(x, y, peaks.height(x, y)) - p).norm();
    let best = |cx: f64, cy: f64, half: f64, n: i32| {
        let at = |c: f64, i: i32| c + half * f64::from(i) / f64::from(n);
        let nodes = (-n..=n).flat_map(|i| (-n..=n).map(move |j| (i, j)));
        nodes
            .map(|(i, j)| (at(cx, i), at(cy, j)))
            .min_by(|a, b| far(a.0, a.1).total_cmp(&far(b.0, b.1)))
            .unwrap()
    };
    let (mut x, mut y) = best(0.0, 0.0, 0.030, 150);
    let mut half = 0.4e-3;
    while half > 1e-9 {
        (x, y) = best(x, y, half, 4);
        half /= 2.0;
    }
    far(x, y)
}

#[test]
fn peaks_distance_is_the_smallest_on_a_dense_grid() {
    let peaks = Peaks::default();
    proptest!(ProptestConfig::with_cases(300), |(p in around(&peaks, 4e-3))| {
        let signed = peaks.signed_distance(&p);
        let brute = brute_peaks(&peaks, &p);
        // the grid may miss the best of several dips, never beat it
        prop_assert!(signed.abs() <= brute + 1e-12, "{} > {}", signed.abs(), brute);
        let closest = peaks.closest(&p);
        prop_assert!((peaks.height(closest.point.x, closest.point.y) - closest.point.z).abs() < 1e-15);
        prop_assert!(((p - closest.point).norm() - signed.abs()).abs() < 1e-15);
        if signed.abs() > 1e-5 {
            prop_assert!((p - closest.point).normalize().dot(&closest.normal) * signed.signum() > 1.0 - 1e-9);
        }
        prop_assert_eq!(signed > 0.0, p.z > peaks.height(p.x, p.y));
    });
}

#[test]
fn peaks_has_the_size_of_the_paper() {
    let peaks = Peaks::default();
    let mesh = peaks.mesh(0.25e-3).unwrap();
    let heights = mesh.positions().iter().map(|p| p.z);
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), z| (z.min(l), z.max(h)));
    assert!((high - low - 0.020).abs() < 1e-5, "{low} {high}");
    // MATLAB: peaks at the origin of the formula is 3/e − 1/(3e) = 0.981 of a range of 14.657
    let middle = (8.106_213_589 - 6.551_133_333) / 2.0;
    let origin = (3.0 / std::f64::consts::E - 1.0 / (3.0 * std::f64::consts::E) - middle) * 0.020
        / 14.657_346_922;
    assert!((peaks.height(0.0, 0.0) - origin).abs() < 1e-11);
}

#[test]
fn noisy_peaks_keep_their_faces_and_have_the_stated_noise() {
    let truth = Peaks::default().mesh(1e-3).unwrap();
    assert_eq!(
        (truth.vertex_count(), truth.face_count()),
        (51 * 51, 2 * 50 * 50)
    );
    assert!(truth.faces().all(|(f, _)| truth.normal(f).z > 0.0));
    let mut noisy = truth.clone();
    add_vertex_noise(&mut noisy, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), 1);
    assert!(truth.faces().eq(noisy.faces()));
    let moved: Vec<_> = truth
        .positions()
        .iter()
        .zip(noisy.positions())
        .map(|(a, b)| b - a)
        .collect();
    let n = moved.len() as f64;
    let mean = moved.iter().sum::<Vector3<f64>>() / n;
    // five standard errors
    let bound = 5.0 * 3e-3 / n.sqrt();
    assert!((mean - Vector3::new(0.0, 0.0, 2e-3)).amax() < bound);
    let variance = moved
        .iter()
        .map(|v| (v - mean).component_mul(&(v - mean)))
        .sum::<Vector3<f64>>()
        / n;
    assert!((variance.map(f64::sqrt) - Vector3::repeat(3e-3)).amax() < bound);
    let mut other = truth.clone();
    add_vertex_noise(&mut other, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), 2);
    assert_ne!(noisy.positions(), other.positions());
}

#[test]
fn points_and_edges_that_are_no_numbers_end_in_no_panic() {
    let mesh = Plate::default().mesh(0.2e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let p = Point3::new(0.01, x, 0.01);
        assert!(surface.signed_distance(&p).is_nan() && surface.closest(&p).point.x.is_nan());
        assert!(surface.outward(&p).x.is_nan());
        let mut near = Vec::new();
        surface.near(&p, 1e-3, &mut near);
        assert!(near.is_empty());
    }
    for edge in [f64::NAN, f64::INFINITY, 0.0, -1e-3, 1e-300, 0.8e-6, 24.9e-6] {
        assert!(
            matches!(
                Peaks::default().mesh(edge),
                Err(SimError::BadParameter { .. })
            ),
            "{edge}"
        );
    }
}

#[test]
fn mesh_distance_is_the_smallest_over_its_faces_with_the_sign_of_the_winding_number() {
    let mesh = Plate::default().mesh(0.2e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    let faces = triangles(&mesh);
    proptest!(ProptestConfig::with_cases(2000), |(p in around(&surface, 5e-3))| {
        let signed = surface.signed_distance(&p);
        let brute = faces.iter().map(|t| distance_to_triangle(&p, t)).fold(f64::MAX, f64::min);
        prop_assert!((signed.abs() - brute).abs() < 1e-12, "{} against {}", signed, brute);
        prop_assert_eq!(signed < 0.0, winding_number(&p, &faces) > 0.5);
        let mut near = Vec::new();
        surface.near(&p, brute + 1e-3, &mut near);
        let nearest = near.iter().map(|s| (s.point - p).norm()).fold(f64::MAX, f64::min);
        prop_assert!((nearest - brute).abs() < 1e-12);
    });
}
