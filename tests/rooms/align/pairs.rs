//! Rigid motion from picked pairs: against known motions, and with wrong picks.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3, Vector6, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use touchup::align::{PairSide, PairsError, PairsFit, PairsParams, PointPair, fit_pairs};

/// Corners and marks of a part of 120 × 80 × 30 mm.
const PICKS: [[f64; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [0.12, 0.0, 0.0],
    [0.12, 0.08, 0.0],
    [0.0, 0.08, 0.03],
    [0.06, 0.04, 0.03],
    [0.02, 0.07, 0.01],
    [0.1, 0.01, 0.02],
];

fn motion() -> Isometry3<f64> {
    Isometry3::new(vector![0.7, -0.3, 0.9], vector![1.1, -2.0, 0.4])
}

fn normal(rng: &mut Pcg64Mcg, sigma: f64) -> Vector3<f64> {
    let normal = Normal::new(0.0, sigma).unwrap();
    Vector3::from_fn(|_, _| normal.sample(rng))
}

fn pairs_of(motion: &Isometry3<f64>, sigma: f64, seed: u64) -> Vec<PointPair> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let pair = |p: &[f64; 3]| {
        let from = Point3::from(*p);
        PointPair {
            from,
            to: motion * from + normal(&mut rng, sigma),
            sigma: None,
        }
    };
    PICKS.iter().map(pair).collect()
}

fn fit(pairs: &[PointPair]) -> Result<PairsFit, PairsError> {
    fit_pairs(pairs, &PairsParams::default())
}

/// Shift of the centroid and turn about it by which the fit is off from the truth.
fn error(found: &PairsFit, truth: &Isometry3<f64>) -> Vector6<f64> {
    let off = found.motion * truth.inverse();
    let shift = off * found.centroid - found.centroid;
    let turn = off.rotation.scaled_axis();
    vector![shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

proptest! {
    #[test]
    fn exact_pairs_give_their_motion(
        shift in prop::array::uniform3(-5.0..5.0f64),
        turn in prop::array::uniform3(-3.0..3.0f64),
        count in 3..=7usize,
        flat in any::<bool>(),
    ) {
        let truth = Isometry3::new(shift.into(), turn.into());
        let mut pairs = pairs_of(&Isometry3::identity(), 0.0, 0);
        pairs.truncate(count);
        for pair in &mut pairs {
            // points in one plane leave a mirror image that fits as well
            pair.from.z *= f64::from(u8::from(!flat));
            pair.to = truth * pair.from;
        }
        let found = fit(&pairs).unwrap();
        prop_assert!(error(&found, &truth).amax() < 1e-13, "{:?}", error(&found, &truth));
        prop_assert!(found.rms < 1e-13 && found.motion.rotation.to_rotation_matrix().matrix().determinant() > 0.999);
    }

    /// The fit is a minimum: any change of the motion increases the sum of squares.
    #[test]
    fn no_other_motion_fits_better(seed in 0..1000u64, change in prop::array::uniform6(-1.0..1.0f64)) {
        let pairs = pairs_of(&motion(), 0.5e-3, seed);
        let found = fit(&pairs).unwrap();
        let squares = |motion: &Isometry3<f64>| pairs.iter().map(|p| (p.to - motion * p.from).norm_squared()).sum::<f64>();
        let [x, y, z, a, b, c] = change.map(|x| x * 1e-4);
        let about = Isometry3::from_parts(found.centroid.into(), UnitQuaternion::identity());
        let moved = about * Isometry3::new(vector![x, y, z], vector![a, b, c]) * about.inverse() * found.motion;
        prop_assert!(squares(&moved) >= squares(&found.motion));
    }
}

/// Each component of the error over its stated uncertainty has an rms of 1, over 200 seeds; the
/// uncertainty comes from the residuals.
#[test]
fn the_stated_uncertainty_holds() {
    let truth = motion();
    for given in [None, Some(0.4e-3)] {
        let mut squares = Vector6::zeros();
        for seed in 0..200 {
            let params = PairsParams {
                sigma: given,
                ..PairsParams::default()
            };
            let found = fit_pairs(&pairs_of(&truth, 0.4e-3, seed), &params).unwrap();
            let error = error(&found, &truth);
            squares +=
                Vector6::from_fn(|i, _| error[i] * error[i] / found.covariance[(i, i)] / 200.0);
        }
        let normalised = squares.map(f64::sqrt);
        println!(
            "normalised error, sigma given: {}: {normalised:.2?}",
            given.is_some()
        );
        // of 200: ±3 standard errors of an rms are 15 %; t distributed with 15 degrees of freedom
        // it is 7 % more
        assert!(
            normalised.iter().all(|x| (0.85..1.25).contains(x)),
            "{normalised}"
        );
    }
}

/// The residuals overrule a sigma far too small.
#[test]
fn a_sigma_that_the_residuals_contradict_is_not_believed() {
    let pairs = pairs_of(&motion(), 0.4e-3, 1);
    let given = |sigma| {
        fit_pairs(
            &pairs,
            &PairsParams {
                sigma: Some(sigma),
                least_misfit: 1.0,
                ..PairsParams::default()
            },
        )
    };
    assert_eq!(given(0.4e-3).unwrap().sigma, 0.4e-3);
    let (small, found) = (given(0.1e-3).unwrap(), fit(&pairs).unwrap());
    assert!(
        (small.sigma - found.sigma).abs() < 1e-12
            && (small.covariance - found.covariance).amax() < 1e-18
    );
}

/// By hand: two pairs with four times the weight of the other two draw the shift to their mean.
#[test]
fn sigmas_are_weights() {
    let square = [
        [0.0, 0.0, 0.0],
        [0.1, 0.1, 0.0],
        [0.1, 0.0, 0.0],
        [0.0, 0.1, 0.0],
    ];
    let pairs: Vec<_> = square
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let (dz, sigma) = if i < 2 {
                (0.0, 0.1e-3)
            } else {
                (0.5e-3, 0.2e-3)
            };
            let from = Point3::from(*p);
            PointPair {
                from,
                to: from + vector![0.0, 0.0, dz],
                sigma: Some(sigma),
            }
        })
        .collect();
    let found = fit(&pairs).unwrap();
    let shift = (found.motion * found.motion.inverse_transform_point(&found.centroid)).z;
    // Σ w z / Σ w = (2 · 1 · 0 + 2 · ¼ · 0.5 mm) / 2.5
    assert!((shift - 0.1e-3).abs() < 1e-12, "{shift}");
    // and σ of it: 0.1 mm / √2.5
    assert!((found.covariance[(2, 2)].sqrt() - 0.1e-3 / 2.5f64.sqrt()).abs() < 1e-12);
}

#[test]
fn bad_pairs_are_refused() {
    let good = pairs_of(&motion(), 0.1e-3, 1);
    assert_eq!(
        fit(&good[..2]).unwrap_err(),
        PairsError::TooFew { count: 2 }
    );
    let mut bad = good.clone();
    bad[3].to.y = f64::NAN;
    assert_eq!(
        fit(&bad).unwrap_err(),
        PairsError::BadPoint {
            pair: 4,
            side: PairSide::To
        }
    );
    bad[3].to.y = 1e300;
    assert_eq!(
        fit(&bad).unwrap_err(),
        PairsError::BadPoint {
            pair: 4,
            side: PairSide::To
        }
    );
    let mut bad = good.clone();
    bad[1].sigma = Some(-1e-3);
    assert_eq!(
        fit(&bad).unwrap_err(),
        PairsError::BadSigma {
            pair: 2,
            sigma_mm: -1.0
        }
    );
    let nothing = PairsParams {
        sigma: Some(0.0),
        ..PairsParams::default()
    };
    assert_eq!(
        fit_pairs(&good, &nothing).unwrap_err(),
        PairsError::BadGivenSigma { sigma_mm: 0.0 }
    );
    let twice = [good[0], good[1], good[1]];
    assert!(matches!(
        fit(&twice),
        Err(PairsError::Coincident {
            first: 2,
            second: 3,
            side: PairSide::From,
            ..
        })
    ));
}

#[test]
fn pairs_on_a_line_are_refused() {
    let line: Vec<_> = (0..6)
        .map(|i| {
            let from = Point3::new(0.02 * f64::from(i), 0.0, 0.3e-3 * f64::from(i % 2));
            PointPair {
                from,
                to: motion() * from,
                sigma: None,
            }
        })
        .collect();
    assert!(matches!(fit(&line), Err(PairsError::Collinear { .. })));
    // 3 mm beside the line: enough for exact picks, within the noise of bad ones
    let mut bent = line.clone();
    bent[2].from.y += 6e-3;
    bent[2].to = motion() * bent[2].from;
    assert!(fit(&bent).is_ok());
    let coarse = PairsParams {
        sigma: Some(1e-3),
        ..PairsParams::default()
    };
    let error = fit_pairs(&bent, &coarse).unwrap_err();
    assert!(
        matches!(error, PairsError::Collinear { .. })
            && error.to_string().contains("far off the line"),
        "{error}"
    );
}

/// With five pairs or more the finding names any wrong one; fewer disagree.
#[test]
fn a_pair_that_does_not_fit_is_named() {
    for seed in 0..50 {
        for wrong in 0..PICKS.len() {
            let mut pairs = pairs_of(&motion(), 0.2e-3, seed);
            pairs[wrong].to += vector![0.0, 4e-3, -3e-3];
            let error = fit(&pairs).unwrap_err();
            let PairsError::Outlier {
                pair,
                distance_mm,
                others,
                rest_mm,
            } = error
            else {
                panic!("{error}")
            };
            assert_eq!((pair, others), (wrong + 1, 6), "{error}");
            assert!(
                (3.5..7.0).contains(&distance_mm) && rest_mm < 0.6,
                "{error}"
            );
        }
        assert!(
            fit(&pairs_of(&motion(), 0.2e-3, seed)).is_ok(),
            "good picks, seed {seed}"
        );
    }
    let mut four = pairs_of(&motion(), 0.2e-3, 3)[..4].to_vec();
    four[1].to.x += 15e-3;
    let error = fit(&four).unwrap_err();
    assert!(
        matches!(error, PairsError::Disagree { .. })
            && error.to_string().contains("5 pairs or more"),
        "{error}"
    );
    // picks that are all good to 1 mm only are good picks of a bad scan
    assert!((0..50).all(|seed| fit(&pairs_of(&motion(), 1e-3, seed)).is_ok()));
}

/// The largest number in a file: the time does not grow with its square.
#[test]
fn a_hundred_thousand_pairs_are_fitted_at_once() {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    let pair = |_| {
        let from = Point3::from(normal(&mut rng, 0.1));
        PointPair {
            from,
            to: motion() * from + normal(&mut rng, 0.2e-3),
            sigma: None,
        }
    };
    let mut pairs: Vec<_> = (0..100_000).map(pair).collect();
    let found = fit(&pairs).unwrap();
    assert!(error(&found, &motion()).amax() < 1e-5 && (found.sigma / 0.2e-3 - 1.0).abs() < 0.01);
    pairs[4711].to.x += 5e-3;
    assert!(matches!(
        fit(&pairs),
        Err(PairsError::Outlier { pair: 4712, .. })
    ));
}

#[test]
fn units_and_mirrors_are_named() {
    let scaled = |factor: f64| {
        let pairs = pairs_of(&motion(), 0.1e-3, 5);
        let to_unit = |pair: PointPair| PointPair {
            to: pair.to * factor,
            ..pair
        };
        fit(&pairs.into_iter().map(to_unit).collect::<Vec<_>>()).unwrap_err()
    };
    for (factor, named) in [
        (1000.0, "1000:"),
        (1e-3, "1/1000"),
        (25.4, "25.4:"),
        (1.0 / 25.4, "1/25.4"),
        (10.0, "cm"),
    ] {
        let error = scaled(factor);
        assert!(
            matches!(error, PairsError::Scale { .. }) && error.to_string().contains(named),
            "{error}"
        );
    }
    assert!(matches!(
        scaled(1.5),
        PairsError::Disagree { .. } | PairsError::Outlier { .. }
    ));
    let mut pairs = pairs_of(&motion(), 0.1e-3, 5);
    pairs.iter_mut().for_each(|pair| pair.to.y = -pair.to.y);
    let error = fit(&pairs).unwrap_err();
    assert!(matches!(error, PairsError::Mirrored { .. }), "{error}");
    // a half turn is no mirror
    let turned = Isometry3::from_parts(
        motion().translation,
        UnitQuaternion::from(Rotation3::new(vector![0.0, std::f64::consts::PI, 0.0])),
    );
    assert!(fit(&pairs_of(&turned, 0.1e-3, 5)).is_ok());
}
