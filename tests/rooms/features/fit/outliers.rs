//! Keyways, gross errors and lopsided points.

use std::f64::consts::{PI, TAU};

use touchup::features::fit::{FitParams, Freedom, SurfaceModel, fit};

use super::*;

#[test]
fn a_keyway_spoils_neither_centre_nor_radius() {
    // 15 % of a hole of 5 mm lies 1 mm outside
    let (r, sigma) = (5.0 * MM, 0.03 * MM);
    let mut errors = Vec::new();
    for seed in 0..200 {
        let mut rng = generator(seed);
        let mut touched = on_cylinder(&mut rng, r, TAU, 8.0 * MM, 120);
        touched[..18].iter_mut().for_each(|o| {
            o.point.x *= 6.0 / 5.0;
            o.point.y *= 6.0 / 5.0;
        });
        touched.iter_mut().for_each(|o| {
            o.point += shaken(&mut rng, sigma);
            o.sigma = sigma;
        });
        let fit = fit(
            &hole_near(&Isometry3::identity(), r),
            &touched,
            &FitParams::default(),
        )
        .unwrap();
        assert!(
            fit.used[..18].iter().all(|used| !used),
            "the keyway is left out"
        );
        assert!(
            fit.used[18..].iter().filter(|used| !**used).count() <= 2,
            "the hole is not"
        );
        errors.push((fit.surface.radius - r) / fit.std(Freedom::Size).unwrap());
        let axis_at_0 = fit
            .surface
            .pose_of
            .inverse_transform_point(&Point3::origin());
        assert!(axis_at_0.x.hypot(axis_at_0.y) < 0.05 * MM, "seed {seed}");
    }
    assert!((0.8..1.25).contains(&rms(&errors)), "{}", rms(&errors));
}

#[test]
fn a_fifth_of_gross_errors_is_left_out() {
    let (r, sigma) = (5.0 * MM, 0.05 * MM);
    let mut errors = Vec::new();
    for seed in 0..200 {
        let mut rng = generator(1000 + seed);
        let mut touched = on_cylinder(&mut rng, r, TAU, 8.0 * MM, 100);
        for (i, o) in touched.iter_mut().enumerate() {
            // anywhere in the box around the hole
            if i % 5 == 0 {
                o.point = Point3::from(Vector3::from_fn(|_, _| between(&mut rng, -8.0, 8.0)) * MM);
            }
            o.point += shaken(&mut rng, sigma);
            o.sigma = sigma;
        }
        let fit = fit(
            &hole_near(&Isometry3::identity(), r),
            &touched,
            &FitParams::default(),
        )
        .unwrap();
        errors.push((fit.surface.radius - r) / fit.std(Freedom::Size).unwrap());
    }
    println!("{}", rms(&errors));
    assert!((0.8..1.3).contains(&rms(&errors)), "{}", rms(&errors));
}

#[test]
fn points_crowded_on_one_side_do_not_pull_the_centre() {
    let (mut x, mut radii) = (Vec::new(), Vec::new());
    for seed in 0..300 {
        let mut rng = generator(seed);
        // nine of ten on 60°, the rest around
        let mut touched = on_cylinder(&mut rng, 1.0, PI / 3.0, 2.0, 180);
        touched.extend(
            on_cylinder(&mut rng, 1.0, TAU, 2.0, 20)
                .into_iter()
                .map(|o| Observation {
                    group: 180 + o.group,
                    ..o
                }),
        );
        touched.iter_mut().for_each(|o| {
            o.point += shaken(&mut rng, 0.05);
            o.sigma = 0.05;
        });
        let fit = fit(
            &hole_near(&Isometry3::identity(), 1.0),
            &touched,
            &FitParams::default(),
        )
        .unwrap();
        let axis = fit.surface.pose_of.rotation * Vector3::z();
        let center = fit.surface.center();
        x.push(center.x - axis.x / axis.z * center.z);
        radii.push(fit.surface.radius - 1.0);
    }
    for errors in [x, radii] {
        let (mean, error) = mean_and_error(&errors);
        println!("{mean:.5} ± {error:.5}");
        assert!(mean.abs() < 3.0 * error, "{mean} ± {error}");
    }
}
