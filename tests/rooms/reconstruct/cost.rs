//! Settings give their cost before any reconstruction.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Vector3};
use touchup::reconstruct::{Patcher, PatcherParams};
use touchup::stylus::{ContactEstimator, ContactEstimatorParams, Sample, TipParams, Wrench};

const RADIUS: f64 = 1.5e-3;

/// Settings by which the lattice has this pitch (m): p = √(16 · radius · tolerance).
fn with_pitch(radius: f64, pitch: f64) -> PatcherParams {
    PatcherParams {
        tolerance: pitch * pitch / (16.0 * radius),
        ..PatcherParams::new(radius, None, 0.05e-3)
    }
}

fn refused(radius: f64, pitch: f64) -> Option<String> {
    let params = with_pitch(radius, pitch);
    Patcher::new(params).err().map(|error| error.to_string())
}

/// A ball of 2.8 radii of 1.5 mm holds 310 mm³: 39 million nodes 0.02 mm apart, 4 million 0.043 mm
/// apart.
#[test]
fn a_lattice_that_one_contact_would_fill_the_memory_with_is_refused_with_the_figure() {
    for (pitch, nodes) in [(0.02e-3, "3.9e7 nodes"), (0.005e-3, "2.5e9 nodes")] {
        let why = refused(RADIUS, pitch).expect("it is refused");
        for part in ["patch.tolerance_mm", nodes, "7.58e-5 or more", "GB"] {
            assert!(why.contains(part), "{part} is not in: {why}");
        }
    }
    for allowed in [0.043e-3, RADIUS / 2.0, RADIUS] {
        assert_eq!(refused(RADIUS, allowed), None, "{allowed}");
    }
}

/// Contacts of a ball of 1.5 mm all over a square of 30 mm: within 2.8 radii of them, 4.2 mm, are
/// the square times 8.4 mm, half a cylinder along each side and a quarter of a ball at each corner,
/// 11,196 mm³ in all: 11 million nodes 0.1 mm apart.
#[test]
#[expect(clippy::too_many_lines)]
fn a_lattice_around_all_that_was_touched_is_refused_with_the_figure_before_it_is_made() {
    const SIDE: f64 = 30e-3;
    let reach: f64 = 2.8 * RADIUS;
    let volume = SIDE * SIDE * 2.0 * reach
        + 2.0 * SIDE * PI * reach.powi(2)
        + 4.0 / 3.0 * PI * reach.powi(3);
    assert!((volume * 1e9 - 11_196.0).abs() < 1.0, "{}", volume * 1e9);
    let touched = |params: PatcherParams| {
        let mut patcher = Patcher::new(params).unwrap();
        let tip = TipParams {
            radius: RADIUS,
            stiffness: None,
        };
        let mut estimator = ContactEstimator::new(ContactEstimatorParams::new(tip)).unwrap();
        for i in 0..600 * 31 {
            let (line, step) = (i / 600, i % 600);
            let along = f64::from(if line % 2 == 0 { step } else { 599 - step }) * 0.05e-3;
            let pose_ot = Isometry3::translation(along, f64::from(line) * 1e-3, RADIUS);
            let wrench = Wrench {
                force: Vector3::z() * 2.0,
                torque: Vector3::zeros(),
            };
            patcher.push(
                estimator
                    .observe(&Sample {
                        stamp_ns: i64::from(i) * 1_000_000,
                        pose_ot,
                        wrench,
                    })
                    .unwrap(),
            );
        }
        patcher.flush();
        patcher
    };
    let checked = |pitch: f64| {
        let patcher = touched(with_pitch(RADIUS, pitch));
        patcher.check_extent().map_err(|error| error.to_string())
    };
    let why = checked(0.1e-3).unwrap_err();
    let figure = why
        .split("would have ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next())
        .unwrap();
    let ratio = figure.parse::<f64>().unwrap() * 1e-12 / volume;
    assert!((0.75..1.33).contains(&ratio), "{ratio}: {why}");
    for part in ["patch.tolerance_mm is 0.0004", "all that was touched", "GB"] {
        assert!(why.contains(part), "{part} is not in: {why}");
    }
    assert_eq!(checked(0.15e-3), Ok(()));
    // the usual one becomes as coarse as 8 million nodes require, and no coarser if these suffice
    let coarsest = (volume / 8e6).cbrt();
    for pitch in [0.05e-3, 0.1e-3, 0.15e-3] {
        let usual = PatcherParams {
            is_usual_tolerance: true,
            ..with_pitch(RADIUS, pitch)
        };
        let patcher = touched(usual);
        assert!(patcher.check_extent().is_ok());
        let ratio = (16.0 * RADIUS * patcher.tolerance()).sqrt() / pitch.max(coarsest);
        assert!((0.9..1.1).contains(&ratio), "{pitch}: {ratio}");
    }
}

#[test]
fn a_tip_smaller_than_any_is_refused() {
    for radius in [1e-9, 9e-6, 0.0, f64::NAN] {
        let why = refused(radius, 0.75e-3).expect("it is refused");
        assert!(
            why.contains("tip.radius_mm") && why.contains("0.01 or more"),
            "{why}"
        );
    }
    assert_eq!(refused(1e-5, 0.5e-5), None);
}
