//! Bias and stated uncertainty over many seeds, against the truth.

use std::f64::consts::{PI, TAU};

use touchup::features::fit::{Cone, Fit, FitParams, Freedom, Plane, SurfaceModel, fit};

use super::*;

/// Noisy copies of exact points, whose shared errors are of size `shared` and whose own of size
/// `own`.
fn noisy(exact: &[Observation], rng: &mut Pcg64, shared: f64, own: f64) -> Vec<Observation> {
    let groups = exact.iter().map(|o| o.group).max().unwrap() as usize + 1;
    let errors: Vec<_> = (0..groups).map(|_| shaken(rng, shared)).collect();
    let sigma = shared.hypot(own);
    let shaken: Vec<_> = exact
        .iter()
        .map(|o| o.point + errors[o.group as usize] + shaken(rng, own))
        .collect();
    shaken
        .into_iter()
        .zip(exact)
        .map(|(point, o)| Observation { point, sigma, ..*o })
        .collect()
}

/// Errors over standard deviations of a cylinder about z through the origin: centre, tilt, radius.
fn normalised(fit: &Fit<Cylinder>, r: f64) -> Vec<f64> {
    let f = &fit.surface;
    let axis = f.pose_of.inverse_transform_vector(&Vector3::z());
    let axis = axis * axis.z.signum();
    // point of the true axis in the plane z = 0 of the fitted frame
    let o = f.pose_of.inverse_transform_point(&Point3::origin()).coords;
    let o = o - axis * (o.z / axis.z);
    let errors = [
        (Freedom::X, -o.x),
        (Freedom::Y, -o.y),
        (Freedom::TiltX, -axis.x),
        (Freedom::TiltY, -axis.y),
        (Freedom::Size, f.radius - r),
    ];
    errors
        .iter()
        .map(|(freedom, error)| error / fit.std(*freedom).unwrap())
        .collect()
}

#[test]
fn radius_of_few_noisy_points_is_right_in_the_mean() {
    // σ = r/10. Without correction the mean is off by σ²/2r = 0.5 % at least, and by more on arcs
    let params = FitParams {
        axis_sigma: Some(1e-6),
        ..FitParams::default()
    };
    for (arc, count) in [(TAU, 8), (1.5 * PI, 12), (PI, 20), (0.5 * PI, 200)] {
        let errors: Vec<f64> = (0..1500)
            .map(|seed| {
                let mut rng = generator(seed);
                let exact = on_cylinder(&mut rng, 1.0, arc, 1.0, count);
                let touched = noisy(&exact, &mut rng, 0.0, 0.1);
                let guess = Cylinder::new(Point3::new(0.1, 0.0, 0.0), &Vector3::z(), 1.1, true);
                fit(&guess, &touched, &params).unwrap().surface.radius - 1.0
            })
            .collect();
        let (mean, error) = mean_and_error(&errors);
        println!(
            "arc {:3.0}°, {count} points: bias of r {mean:.5} ± {error:.5}",
            arc.to_degrees()
        );
        assert!(mean.abs() < 3.0 * error, "arc {arc}: {mean} ± {error}");
        assert!(error < 2.5e-3, "too blunt to see the bias");
    }
}

#[test]
fn radius_and_axis_of_a_noisy_cylinder_are_right_in_the_mean() {
    let (mut radii, mut leans) = (Vec::new(), Vec::new());
    for seed in 0..600 {
        let mut rng = generator(seed);
        let exact = on_cylinder(&mut rng, 1.0, TAU, 3.0, 30);
        let touched = noisy(&exact, &mut rng, 0.0, 0.1);
        let fit = fit(
            &hole_near(&Isometry3::identity(), 1.0),
            &touched,
            &FitParams::default(),
        )
        .unwrap();
        radii.push(fit.surface.radius - 1.0);
        leans.push(fit.surface.axis().x);
    }
    for errors in [radii, leans] {
        let (mean, error) = mean_and_error(&errors);
        println!("{mean:.5} ± {error:.5}");
        assert!(mean.abs() < 3.0 * error, "{mean} ± {error}");
    }
}

#[test]
fn stated_uncertainty_holds_for_independent_errors() {
    for (name, arc, count) in [
        ("round", TAU, 60),
        ("half", PI, 80),
        ("quarter", 0.5 * PI, 150),
    ] {
        let z: Vec<f64> = (0..300)
            .flat_map(|seed| {
                let mut rng = generator(seed);
                let exact = on_cylinder(&mut rng, 1.0, arc, 2.0, count);
                let touched = noisy(&exact, &mut rng, 0.0, 0.02);
                let fit = fit(
                    &hole_near(&Isometry3::identity(), 1.0),
                    &touched,
                    &FitParams::default(),
                )
                .unwrap();
                normalised(&fit, 1.0)
            })
            .collect();
        println!("{name}: {:.3}", rms(&z));
        assert!((0.8..1.25).contains(&rms(&z)), "{name}: {}", rms(&z));
    }
}

#[test]
fn stated_uncertainty_holds_for_errors_shared_in_passes() {
    // 30 passes of 20 contacts; stated: all of σ
    for (name, shared, own) in [
        ("all shared", 0.02, 0.0),
        ("half", 0.014, 0.014),
        ("none", 0.0, 0.02),
    ] {
        let z: Vec<f64> = (0..200)
            .flat_map(|seed| {
                let mut rng = generator(seed);
                let mut exact = on_cylinder(&mut rng, 1.0, TAU, 2.0, 600);
                exact
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, o)| o.group = i as u32 / 20);
                let touched = noisy(&exact, &mut rng, shared, own);
                let fit = fit(
                    &hole_near(&Isometry3::identity(), 1.0),
                    &touched,
                    &FitParams::default(),
                )
                .unwrap();
                normalised(&fit, 1.0)
            })
            .collect();
        println!("{name}: {:.3}", rms(&z));
        // independent errors of contacts, stated as shared, leave the fit better than it says: by
        // √20
        let range = if shared > 0.0 { 0.5..2.0 } else { 0.15..1.0 };
        assert!(range.contains(&rms(&z)), "{name}: {}", rms(&z));
    }
}

#[test]
fn sigmas_stated_too_small_are_found_out() {
    let mut z = Vec::new();
    for seed in 0..200 {
        let mut rng = generator(seed);
        let exact = on_cylinder(&mut rng, 1.0, TAU, 2.0, 80);
        let mut touched = noisy(&exact, &mut rng, 0.0, 0.03);
        touched.iter_mut().for_each(|o| o.sigma = 0.01);
        let fit = fit(
            &hole_near(&Isometry3::identity(), 1.0),
            &touched,
            &FitParams::default(),
        )
        .unwrap();
        z.extend(normalised(&fit, 1.0));
    }
    assert!((0.8..1.25).contains(&rms(&z)), "{}", rms(&z));
}

#[test]
fn planes_and_cones_are_right_in_the_mean_and_say_how_well() {
    let (mut of_plane, mut of_cone, mut angles) = (Vec::new(), Vec::new(), Vec::new());
    // flat, usual and steep countersinks
    for seed in 0..300 {
        let half_angle = [80f64, 45.0, 1.0][seed as usize % 3].to_radians();
        let mut rng = generator(seed);
        let exact: Vec<_> = (0..60)
            .map(|group| {
                let (angle, along) = (between(&mut rng, 0.0, TAU), between(&mut rng, -0.5, 0.5));
                let rho = 1.0 + along * half_angle.sin();
                let point = Point3::new(
                    rho * angle.cos(),
                    rho * angle.sin(),
                    along * half_angle.cos(),
                );
                Observation {
                    point,
                    offset: 0.0,
                    sigma: 1.0,
                    group,
                }
            })
            .collect();
        let touched = noisy(&exact, &mut rng, 0.0, 0.01);
        let guess = Cone::new(
            Point3::new(0.05, 0.0, 0.0),
            &Vector3::new(0.02, 0.0, 1.0),
            1.05,
            half_angle + 0.05,
            true,
        );
        let cone = fit(&guess, &touched, &FitParams::default()).unwrap();
        angles.push(cone.surface.half_angle - half_angle);
        of_cone.push((cone.surface.half_angle - half_angle) / cone.std(Freedom::Second).unwrap());
        // its diameter at the crossing of its axis with z = 0 of the true one
        let height = -cone.surface.center().z / cone.surface.axis().z;
        let cos = cone.surface.half_angle.cos();
        let by = [
            (Freedom::Size, 2.0 / cos),
            (Freedom::Second, 2.0 * height / (cos * cos)),
        ];
        let radius = cone.surface.radius + height * cone.surface.half_angle.tan();
        of_cone.push((2.0 * radius - 2.0) / cone.std_by(&by).unwrap());

        let flat: Vec<_> = exact
            .iter()
            .map(|o| Observation {
                point: Point3::new(o.point.x, o.point.y, 0.0),
                ..*o
            })
            .collect();
        let touched = noisy(&flat, &mut rng, 0.0, 0.01);
        let guess = Plane::new(Point3::new(0.0, 0.0, 0.1), &Vector3::new(0.1, -0.1, 1.0));
        let plane = fit(&guess, &touched, &FitParams::default()).unwrap();
        let at = Point3::new(2.0, 1.0, 0.0);
        of_plane.push(plane.surface.distance(&at) / plane.std_at(&at).unwrap());
    }
    println!("plane {:.3}, cone {:.3}", rms(&of_plane), rms(&of_cone));
    assert!((0.8..1.25).contains(&rms(&of_plane)) && (0.8..1.25).contains(&rms(&of_cone)));
    let (mean, error) = mean_and_error(&angles);
    assert!(mean.abs() < 3.0 * error, "{mean} ± {error}");
}

/// Arcs of a turn, a half and a sixth, each displaced as a whole by a drawn vector, with hardly any
/// noise of their own.
#[test]
fn a_common_displacement_goes_into_the_place_whatever_arc_was_felt() {
    let (mut rng, shift_sigma) = (generator(11), 0.02);
    let guess = hole_near(&Isometry3::identity(), 1.0);
    for arc in [2.0, 1.0, 1.0 / 3.0] {
        let (mut of_place, mut of_size) = (Vec::new(), Vec::new());
        for _ in 0..150 {
            let shift = Vector3::from_fn(|_, _| shift_sigma * normal(&mut rng));
            let touched: Vec<_> = on_cylinder(&mut rng, 1.0, arc * PI, 2.0, 40)
                .iter()
                .map(|o| Observation {
                    point: o.point + shift,
                    sigma: 1e-4,
                    ..*o
                })
                .collect();
            let found = fit(
                &guess,
                &touched,
                &FitParams {
                    shift_sigma,
                    ..FitParams::default()
                },
            )
            .unwrap();
            let off = found.surface.center();
            of_place.extend([
                off.x / found.std(Freedom::X).unwrap(),
                off.y / found.std(Freedom::Y).unwrap(),
            ]);
            of_size.push(found.std(Freedom::Size).unwrap());
        }
        // root mean square of 300: 1 ± 3 / √600
        assert!(
            (rms(&of_place) - 1.0).abs() < 0.13,
            "arc {arc}: {}",
            rms(&of_place)
        );
        assert!(
            of_size.iter().all(|std| *std < 0.1 * shift_sigma),
            "arc {arc}: it is in no size"
        );
    }
}

/// A displacement common to two planes is in the place of each and not in their difference.
#[test]
fn a_common_displacement_of_a_plane_is_beside_its_own_uncertainty() {
    let mut rng = generator(13);
    let at = |i: usize| Point3::new((i % 20) as f64 * 0.1, (i / 20) as f64 * 0.1, 0.0);
    let exact: Vec<_> = (0..400)
        .map(|i| Observation {
            point: at(i),
            offset: 0.0,
            sigma: 0.01,
            group: i as u32,
        })
        .collect();
    let touched = noisy(&exact, &mut rng, 0.0, 0.01);
    let guess = Plane::new(Point3::new(0.0, 0.0, 0.1), &Vector3::z());
    let of = |shift_sigma| {
        fit(
            &guess,
            &touched,
            &FitParams {
                shift_sigma,
                ..FitParams::default()
            },
        )
        .unwrap()
    };
    let (without, with) = (of(0.0), of(0.02));
    let [own, all] = [&without, &with].map(|fit| fit.std(Freedom::Z).unwrap());
    // 400 places of 10 µm each
    assert!((own / 0.5e-3 - 1.0).abs() < 0.2, "{own}");
    assert!((all - own.hypot(0.02)).abs() < 1e-9, "{all} {own}");
    assert_eq!(with.std(Freedom::TiltX), without.std(Freedom::TiltX));
    assert!((with.own_covariance - without.covariance).amax() < 1e-18);
}

#[test]
fn a_common_error_goes_into_the_radius_and_not_into_the_axis() {
    let mut rng = generator(7);
    let exact = on_cylinder(&mut rng, 1.0, 0.6 * PI, 2.0, 40);
    let touched: Vec<_> = exact
        .iter()
        .map(|o| Observation { sigma: 1e-4, ..*o })
        .collect();
    let guess = hole_near(&Isometry3::identity(), 1.0);
    let of = |common_sigma| {
        fit(
            &guess,
            &touched,
            &FitParams {
                common_sigma,
                ..FitParams::default()
            },
        )
        .unwrap()
    };
    let (without, with) = (of(0.0), of(0.01));
    let added = |f| with.std(f).unwrap().powi(2) - without.std(f).unwrap().powi(2);
    assert!((added(Freedom::Size) / 1e-4 - 1.0).abs() < 1e-6);
    assert!(
        Freedom::ALL[..6]
            .iter()
            .filter(|f| without.std(**f).is_some())
            .all(|f| added(*f).abs() < 1e-10)
    );
    let [without, with] = [without, with].map(|f| f.std_by(&[(Freedom::Size, 2.0)]).unwrap());
    assert!(
        ((with.powi(2) - without.powi(2)).sqrt() - 0.02).abs() < 1e-7,
        "twice in the diameter"
    );
}
