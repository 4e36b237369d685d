//! The offset between scan and part: recovered from contacts, refused if they do not determine it,
//! and honest about noise.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, vector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;
use touchup::haptic::{Registrar, Registration, RegistrationError, RegistrationParams};
use touchup::mesh::{FaceTree, TriMesh};

/// A face of a box: a grid with a normal, seen counter-clockwise from outside.
type Side = (Vector3<f64>, Vector3<f64>);

/// Half an edge of the box, m.
const HALF: f64 = 30e-3;
const STEPS: u32 = 24;

/// The six sides: normal and one edge.
fn sides() -> [Side; 6] {
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    [(x, y), (-x, z), (y, z), (-y, x), (z, x), (-z, y)]
}

/// Grids over sides, each vertex moved outwards by `noise`.
fn scan(
    sides: &[Side],
    pose: &Isometry3<f64>,
    mut noise: impl FnMut(&Point3<f64>) -> f64,
) -> TriMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (normal, u) in sides {
        let v = normal.cross(u);
        let first = positions.len() as u32;
        let at = |i: u32| (f64::from(i) / f64::from(STEPS) * 2.0 - 1.0) * HALF;
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j))) {
            let p = Point3::from(normal * HALF + u * at(i) + v * at(j));
            positions.push(pose * (p + normal * noise(&p)));
        }
        for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
            let a = first + i * (STEPS + 1) + j;
            let (b, c, d) = (a + STEPS + 1, a + STEPS + 2, a + 1);
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriMesh::new(positions, faces).unwrap()
}

/// Contacts all over the sides of the true box.
fn touched(sides: &[Side], params: RegistrationParams) -> Registrar {
    let mut registrar = Registrar::new(params).unwrap();
    let mut rng = Pcg64::seed_from_u64(11);
    for (normal, u) in sides {
        for _ in 0..1500 {
            let [a, b] = [(); 2].map(|()| {
                let share: f64 = StandardUniform.sample(&mut rng);
                (share * 2.0 - 1.0) * 0.9 * HALF
            });
            registrar.push(
                &Point3::from(normal * HALF + u * a + normal.cross(u) * b),
                normal,
            );
        }
    }
    registrar
}

fn estimate(registrar: &Registrar, scan: &TriMesh) -> Result<Registration, RegistrationError> {
    registrar.estimate(scan, &FaceTree::new(scan))
}

fn rigid_offset(seed: u64) -> Isometry3<f64> {
    let mut rng = Pcg64::seed_from_u64(seed ^ 77);
    let mut gauss = |rms: f64| {
        Vector3::from_fn(|_, _| rms * Distribution::<f64>::sample(&StandardNormal, &mut rng))
    };
    Isometry3::from_parts(
        gauss(0.2e-3).into(),
        UnitQuaternion::from_scaled_axis(gauss(0.15_f64.to_radians())),
    )
}

#[test]
fn a_clean_scan_is_moved_back_exactly() {
    for seed in 0..5 {
        let moved = rigid_offset(seed);
        let found = estimate(
            &touched(&sides(), RegistrationParams::default()),
            &scan(&sides(), &moved, |_| 0.0),
        )
        .unwrap();
        let left = found.scan_to_part * moved;
        assert!(
            left.translation.vector.norm() < 1e-7 && left.rotation.angle() < 1e-5,
            "{left}"
        );
        assert!(
            found.surface_offset[0].abs() < 1e-7,
            "{:?}",
            found.surface_offset
        );
    }
}

#[test]
fn a_fat_scan_is_distinguished_from_a_shift_when_it_was_touched_from_all_sides() {
    let found = estimate(
        &touched(&sides(), RegistrationParams::default()),
        &scan(&sides(), &Isometry3::identity(), |_| 0.2e-3),
    );
    let found = found.unwrap();
    assert!(
        (found.surface_offset[0] - 0.2e-3).abs() < 0.02e-3,
        "{:?}",
        found.surface_offset
    );
    // the rounds end at steps of 60 nm at 40 mm
    assert!(found.twist.norm() < 1e-5, "{}", found.twist);
}

/// From one side touches cannot distinguish the surface offset from a shift: its uncertainty must
/// show.
#[test]
fn touched_from_one_side_of_each_axis_the_shift_is_as_uncertain_as_the_surface_offset() {
    let three = [sides()[0], sides()[2], sides()[4]];
    let params = RegistrationParams {
        scan_noise: 0.1e-3,
        ..RegistrationParams::default()
    };
    let found = estimate(
        &touched(&three, params),
        &scan(&three, &Isometry3::identity(), |_| 0.0),
    )
    .unwrap();
    for axis in 0..3 {
        let sigma = found.covariance[(axis, axis)].sqrt();
        assert!((sigma - 0.3e-3).abs() < 0.03e-3, "{sigma}");
    }
}

#[test]
fn a_plane_is_refused_with_the_three_directions_in_which_it_slides() {
    let top = [sides()[4]];
    let error = estimate(
        &touched(&top, RegistrationParams::default()),
        &scan(&top, &rigid_offset(1), |_| 0.0),
    )
    .unwrap_err();
    let RegistrationError::Undetermined { directions } = &error else {
        panic!("{error}")
    };
    assert_eq!(directions.len(), 3);
    // nothing along z, no turn about x or y: those the plane does determine
    assert!(
        directions
            .iter()
            .all(|d| d[2].abs() < 0.1 && d[3].abs() < 0.1 && d[4].abs() < 0.1),
        "{error}"
    );
    // two planes leave the translation along their edge
    let edge = [sides()[0], sides()[4]];
    let error = estimate(
        &touched(&edge, RegistrationParams::default()),
        &scan(&edge, &rigid_offset(1), |_| 0.0),
    )
    .unwrap_err();
    let RegistrationError::Undetermined { directions } = &error else {
        panic!("{error}")
    };
    assert_eq!(directions.len(), 1);
    assert!(directions[0][1].abs() > 0.9, "{error}");
}

#[test]
fn too_little_and_nonsense_are_refused() {
    let mut registrar = Registrar::new(RegistrationParams::default()).unwrap();
    let clean = scan(&sides(), &Isometry3::identity(), |_| 0.0);
    assert!(matches!(
        estimate(&registrar, &clean),
        Err(RegistrationError::TooFew { cells: 0, .. })
    ));
    registrar.push(&Point3::new(0.0, 0.0, HALF), &Vector3::z());
    assert!(matches!(
        estimate(&registrar, &clean),
        Err(RegistrationError::TooFew { cells: 1, .. })
    ));
    // far from the scan
    let away = scan(&sides(), &Isometry3::translation(0.5, 0.0, 0.0), |_| 0.0);
    let all = touched(&sides(), RegistrationParams::default());
    assert!(matches!(
        estimate(&all, &away),
        Err(RegistrationError::TooFew { cells: 0, .. })
    ));
    assert!(
        Registrar::new(RegistrationParams {
            spacing: 0.0,
            ..RegistrationParams::default()
        })
        .is_err()
    );
}

/// Independent numbers at the corners of a lattice of 8 mm, linear between them. Along an axis the
/// mean variance is 2/3 of a corner's, and the area under the correlation is that of a corner over
/// 8 mm: it counts as one value over 8 · 3/2 = 12 mm.
fn random_field(seed: u64, rms: f64) -> impl FnMut(&Point3<f64>) -> f64 {
    let mut rng = Pcg64::seed_from_u64(seed);
    let corners: Vec<f64> = (0..1000)
        .map(|_| rms * Distribution::<f64>::sample(&StandardNormal, &mut rng))
        .collect();
    move |p| {
        let at = p.coords.map(|x| (x + 36e-3) / 8e-3);
        let low = at.map(f64::floor);
        let share = at - low;
        let corner = |bits: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| low[axis] as usize + (bits >> axis & 1));
            let weight = |axis: usize| {
                if bits >> axis & 1 == 1 {
                    share[axis]
                } else {
                    1.0 - share[axis]
                }
            };
            corners[100 * x + 10 * y + z] * weight(0) * weight(1) * weight(2)
        };
        (0..8).map(corner).sum()
    }
}

/// (x − x̂)ᵀ C⁻¹ (x − x̂) has mean 6 when the covariance is true.
#[test]
fn the_uncertainty_is_honest_over_forty_correlated_scans() {
    let registrar = touched(
        &sides(),
        RegistrationParams {
            scan_noise: 0.4e-3,
            correlation: 12e-3,
            ..RegistrationParams::default()
        },
    );
    let mut sum = 0.0;
    for seed in 0..40 {
        let moved = rigid_offset(seed);
        let found = estimate(
            &registrar,
            &scan(&sides(), &moved, random_field(seed, 0.6e-3)),
        )
        .unwrap();
        // the inverse translation of the centre, and the inverse rotation
        let back = moved.inverse();
        let (shift, turn) = (
            back * found.centre - found.centre,
            back.rotation.scaled_axis(),
        );
        let off = found.twist - vector![shift.x, shift.y, shift.z, turn.x, turn.y, turn.z];
        sum += off.dot(&found.covariance.cholesky().unwrap().solve(&off));
    }
    let mean = sum / 40.0;
    println!("mean normalised square error {mean}");
    assert!((3.0..12.0).contains(&mean), "{mean}");
}
