use std::f64::consts::FRAC_PI_2;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;

use super::*;

/// A plate: its top, three bores and a side, as drawn and as measured.
fn plate(motion: &Isometry3<f64>) -> Vec<DatumPair> {
    let up = Vector3::z();
    let features = [
        (FeatureKind::Plane, Point3::new(0.030, 0.025, 0.012), up),
        (FeatureKind::Hole, Point3::new(0.016, 0.036, 0.012), up),
        (FeatureKind::Hole, Point3::new(0.052, 0.010, 0.012), up),
        (FeatureKind::Boss, Point3::new(0.047, 0.025, 0.012), up),
        (
            FeatureKind::Plane,
            Point3::new(0.060, 0.025, 0.006),
            Vector3::x(),
        ),
    ];
    let inverse = motion.inverse();
    let pair = |(kind, nominal, axis): (FeatureKind, Point3<f64>, Vector3<f64>)| DatumPair {
        kind,
        nominal,
        nominal_axis: Some(axis),
        measured: inverse * nominal,
        measured_axis: inverse * axis,
        place_std: 5e-6,
        axis_std: Some(1e-3),
    };
    features.map(pair).to_vec()
}

fn motion() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.12, -0.04, 0.3), Vector3::new(0.4, -1.1, 0.7))
}

fn start(motion: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::new(
        Vector3::new(0.002, -0.001, 0.001),
        Vector3::new(0.05, 0.03, -0.04),
    ) * motion
}

/// Distance between a part of 60 mm moved by `a` and by `b`, m and rad.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> [f64; 2] {
    let middle = a.inverse() * Point3::new(0.03, 0.025, 0.012);
    [
        (a * middle - b * middle).norm(),
        a.rotation.angle_to(&b.rotation),
    ]
}

#[test]
fn the_motion_of_a_part_as_drawn_is_found_by_best_fit_and_by_datums() {
    for stages in [
        vec![(0..5).collect()],
        vec![vec![0], vec![1], vec![2]],
        vec![vec![0], vec![4], vec![3]],
    ] {
        let pairs = plate(&motion());
        let fit = fit_datums(&pairs, &stages, &start(&motion())).unwrap();
        let [shift, turn] = apart(&fit.motion, &motion());
        assert!(
            shift < 1e-10 && turn < 1e-9,
            "{stages:?}: {shift} m, {turn} rad"
        );
        assert!(
            fit.residuals.iter().all(|residual| *residual < 1e-10),
            "{:?}",
            fit.residuals
        );
    }
}

/// Three planes, two of them out of square: the first is met whole, the second in the remaining
/// turn, the third in the shift.
#[test]
fn datums_count_in_their_order() {
    let lean: f64 = 0.01;
    let plane = |nominal: Point3<f64>, axis: Vector3<f64>, measured_axis: Vector3<f64>| DatumPair {
        kind: FeatureKind::Plane,
        nominal,
        nominal_axis: Some(axis),
        measured: nominal,
        measured_axis: measured_axis.normalize(),
        place_std: 1e-6,
        axis_std: Some(1e-5),
    };
    let pairs = [
        plane(Point3::new(0.0, 0.0, 0.0), Vector3::z(), Vector3::z()),
        // leans down, and is turned about z
        plane(
            Point3::new(0.05, 0.0, 0.0),
            Vector3::x(),
            Vector3::new(lean.cos(), lean.sin(), 0.02),
        ),
        plane(Point3::new(0.0, 0.05, 0.0), Vector3::y(), Vector3::y()),
    ];
    let fit = fit_datums(&pairs, &[vec![0], vec![1], vec![2]], &Isometry3::identity()).unwrap();
    // by hand: the turn about z that brings the second normal over x
    let expected = Vector3::new(0.0, 0.0, -lean);
    assert!(
        (fit.motion.rotation.scaled_axis() - expected).norm() < 1e-6,
        "{:?}",
        fit.motion.rotation.scaled_axis()
    );
    assert!(
        fit.residuals.iter().all(|residual| *residual < 1e-10),
        "{:?}",
        fit.residuals
    );
    let reversed =
        fit_datums(&pairs, &[vec![1], vec![0], vec![2]], &Isometry3::identity()).unwrap();
    let met = reversed.motion * pairs[1].measured_axis;
    assert!(
        (met - Vector3::x()).norm() < 1e-9,
        "now the second is met whole: {met}"
    );
}

/// Scatter of repeated measurements against the uncertainty of a single one.
#[test]
#[expect(clippy::too_many_lines)]
fn uncertainties_are_those_of_repeated_measurements() {
    let exact = plate(&motion());
    let own = [4e-6, 9e-6, 6e-6, 1.2e-5, 5e-6];
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut gauss = move |std: f64| Normal::new(0.0, std).unwrap().sample(&mut rng);
    for stages in [vec![(0..4).collect()], vec![vec![0], vec![1], vec![2]]] {
        let (mut shifts, mut turns, mut off) = (Vec::new(), Vec::new(), vec![0.0; 5]);
        let runs = 1000;
        let mut stated = None;
        for _ in 0..runs {
            let mut pairs = exact.clone();
            for (pair, std) in pairs.iter_mut().zip(own) {
                pair.place_std = std;
                let count: f64 = if pair.kind == FeatureKind::Plane {
                    1.0
                } else {
                    2.0
                };
                let share = std / count.sqrt();
                let across = Vector3::new(gauss(share), gauss(share), gauss(share));
                let axis = pair.measured_axis;
                let along = axis * axis.dot(&across);
                pair.measured += if pair.kind == FeatureKind::Plane {
                    along
                } else {
                    across - along
                };
                let tilt = Vector3::new(gauss(7e-4), gauss(7e-4), gauss(7e-4));
                pair.measured_axis = (axis + tilt - axis * axis.dot(&tilt)).normalize();
                pair.axis_std = Some(7e-4 * 2f64.sqrt());
            }
            let fit = fit_datums(&pairs, &stages, &motion()).unwrap();
            let between = fit.motion * motion().inverse();
            shifts.push((between * fit.centre - fit.centre).norm_squared());
            turns.push(between.rotation.angle().powi(2));
            off.iter_mut()
                .zip(&fit.residuals)
                .for_each(|(sum, residual)| *sum += residual * residual);
            // the side is in no stage; its residual is about its nominal normal
            stated = Some(fit);
        }
        let stated = stated.unwrap();
        let mean = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        let diagonal = stated.covariance.diagonal();
        let [shift, turn] = [
            diagonal.rows(0, 3).sum().sqrt(),
            diagonal.rows(3, 3).sum().sqrt(),
        ];
        assert!(
            (mean(&shifts) / shift - 1.0).abs() < 0.07,
            "{stages:?}: {} and {shift} m",
            mean(&shifts)
        );
        assert!(
            (mean(&turns) / turn - 1.0).abs() < 0.07,
            "{stages:?}: {} and {turn} rad",
            mean(&turns)
        );
        for (at, (sum, std)) in off.iter().zip(&stated.place_stds).enumerate() {
            let found = (sum / f64::from(runs)).sqrt();
            assert!(
                (found - std).abs() < 0.07 * std.max(1e-6),
                "{stages:?}, {at}: {found} and {std} m"
            );
        }
        let side = stated.place_std(FeatureKind::Plane, &exact[4].nominal, &Vector3::x(), own[4]);
        assert!(
            (side / stated.place_stds[4] - 1.0).abs() < 1e-3,
            "the same by both ways: {side} m"
        );
    }
}

#[test]
fn what_is_left_open_is_named() {
    let pairs = plate(&Isometry3::identity());
    let open =
        |stages: &[Vec<usize>]| fit_datums(&pairs, stages, &Isometry3::identity()).unwrap_err();
    let DatumFitError::Free { turns, shifts } = open(&[vec![0]]) else {
        panic!("no other")
    };
    assert_eq!((turns.len(), shifts.len()), (1, 2));
    assert!(
        (turns[0] - Vector3::z()).norm() < 1e-9 && shifts.iter().all(|shift| shift.z.abs() < 1e-9)
    );
    let error = open(&[vec![1]]);
    let DatumFitError::Free { turns, shifts } = &error else {
        panic!("no other")
    };
    assert!((turns[0] - Vector3::z()).norm() < 1e-9 && (shifts[0] - Vector3::z()).norm() < 1e-9);
    assert_eq!(
        error.to_string(),
        "a turn about (0.00 0.00 1.00) and a shift along (0.00 0.00 1.00) are left open"
    );
    assert!(matches!(open(&[]), DatumFitError::Free { .. }));
    assert!(fit_datums(&[], &[], &Isometry3::identity()).is_err());
}

/// Half a turn about x shows a through-hole from its other end.
#[test]
fn an_axis_that_is_named_from_its_other_end_is_the_same() {
    let mut pairs = plate(&motion());
    pairs[1].nominal_axis = pairs[1].nominal_axis.map(|axis| -axis);
    let fit = fit_datums(&pairs, &[(0..5).collect()], &start(&motion())).unwrap();
    assert!(apart(&fit.motion, &motion())[0] < 1e-10);
    let quarter = Isometry3::rotation(Vector3::x() * FRAC_PI_2);
    assert!(apart(&fit.motion, &(quarter * motion()))[1] > 1.5);
}
