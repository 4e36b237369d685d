//! Refusals and their reasons.

use std::f64::consts::TAU;

use touchup::features::fit::{FitError, FitParams, Freedom, Plane, fit};

use super::*;

fn hole() -> Vec<Observation> {
    on_cylinder(&mut generator(1), 5.0 * MM, TAU, 8.0 * MM, 40)
}

fn refusal(guess: &Cylinder, observations: &[Observation]) -> FitError {
    fit(guess, observations, &FitParams::default()).unwrap_err()
}

#[test]
fn observations_that_cannot_be_fitted_are_refused() {
    let near = hole_near(&Isometry3::identity(), 5.0 * MM);
    assert_eq!(
        refusal(&near, &[]),
        FitError::TooFewObservations {
            have: 0,
            given: 0,
            need: 5
        }
    );
    assert_eq!(
        refusal(&near, &hole()[..4]),
        FitError::TooFewObservations {
            have: 4,
            given: 4,
            need: 5
        }
    );
    let one_pass: Vec<_> = hole()
        .iter()
        .map(|o| Observation { group: 9, ..*o })
        .collect();
    assert_eq!(refusal(&near, &one_pass), FitError::OneGroup);
    let mut bad = hole();
    bad[7].point.y = f64::NAN;
    assert_eq!(refusal(&near, &bad), FitError::NotFinite { index: 7 });
    bad[7] = Observation {
        sigma: 0.0,
        ..hole()[7]
    };
    assert_eq!(
        refusal(&near, &bad),
        FitError::BadSigma {
            what: "sigma of an observation",
            sigma: 0.0
        }
    );
}

#[test]
fn guesses_and_settings_without_a_meaning_are_refused() {
    let near = hole_near(&Isometry3::identity(), 5.0 * MM);
    let negative = Cylinder {
        radius: -1.0,
        ..near
    };
    assert_eq!(
        refusal(&negative, &hole()),
        FitError::BadSize {
            what: "radius",
            value: -1.0
        }
    );
    let params = FitParams {
        common_sigma: -1.0,
        ..FitParams::default()
    };
    assert_eq!(
        fit(&near, &hole(), &params).unwrap_err(),
        FitError::BadSigma {
            what: "common_sigma",
            sigma: -1.0
        }
    );
    let params = FitParams {
        axis_sigma: Some(f64::NAN),
        ..FitParams::default()
    };
    assert!(matches!(
        fit(&near, &hole(), &params),
        Err(FitError::BadSigma {
            what: "axis_sigma",
            ..
        })
    ));
}

#[test]
fn what_the_touches_do_not_fix_is_named() {
    let near = hole_near(&Isometry3::identity(), 5.0 * MM);
    // a strip of the wall that is nearly flat
    let strip = on_cylinder(&mut generator(2), 5.0 * MM, 0.02, 8.0 * MM, 40);
    let strip: Vec<_> = strip
        .iter()
        .map(|o| Observation {
            sigma: 0.05 * MM,
            ..*o
        })
        .collect();
    assert!(matches!(
        refusal(&near, &strip),
        FitError::Undetermined { .. }
    ));
    // one circle: round, but with an undetermined lean
    let circle: Vec<_> = hole()
        .iter()
        .map(|o| Observation {
            point: Point3::new(o.point.x, o.point.y, 0.0),
            ..*o
        })
        .collect();
    let upright = Cylinder::new(
        Point3::new(0.3 * MM, 0.0, 0.0),
        &Vector3::z(),
        5.3 * MM,
        true,
    );
    assert_eq!(
        refusal(&upright, &circle),
        FitError::Undetermined {
            what: "direction of the axis"
        }
    );
    // with an axis from elsewhere it is a hole
    let known = FitParams {
        axis_sigma: Some(0.01),
        ..FitParams::default()
    };
    let found = fit(&upright, &circle, &known).unwrap();
    assert!((found.surface.radius - 5.0 * MM).abs() < 1e-9);
    let lean = found.std(Freedom::TiltX).unwrap();
    assert!((lean - 0.01).abs() < 1e-4, "{lean}");
    // a line does not make a plane
    let line: Vec<_> = (0..9)
        .map(|i| Observation {
            point: Point3::new(f64::from(i) * MM, 0.0, 0.0),
            offset: 0.0,
            sigma: 1e-5,
            group: i,
        })
        .collect();
    let refused = fit(
        &Plane::new(Point3::origin(), &Vector3::z()),
        &line,
        &FitParams::default(),
    )
    .unwrap_err();
    assert_eq!(
        refused,
        FitError::Undetermined {
            what: "direction of the normal"
        }
    );
}
