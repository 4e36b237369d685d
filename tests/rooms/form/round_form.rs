//! Roundness, cylindricity and straightness of walls of known form, touched with noise.

use std::f64::consts::TAU;

use nalgebra::{Point2, Point3, Rotation3, Vector3};
use rand::SeedableRng;
use rand::distr::Distribution;
use rand_distr::StandardNormal;
use touchup::form::{
    Deviation, Estimate, FormPoint, RoundForm, cylindricity, round_form, roundness,
};

const RADIUS: f64 = 4e-3;
const HEIGHT: f64 = 8e-3;
/// Error that points of one group share, and that of each alone, m.
const SHARED: f64 = 8e-6;
const OWN: f64 = 6e-6;

/// Turns around a wall at `rings` heights, 30 groups of ten points each, with noise; the fitted
/// cylinder is off and leans.
fn touched(
    seed: u64,
    rings: u32,
    turn: f64,
    radius: impl Fn(f64, f64) -> f64,
) -> Option<RoundForm> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut normal =
        |sigma: f64| -> f64 { sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    let turned = Rotation3::from_euler_angles(0.3, -0.8, 1.7);
    let mut points = Vec::new();
    for ring in 0..rings {
        let z = HEIGHT * (f64::from(ring) / f64::from(rings - 1) - 0.5);
        for group in 0..30 {
            let shared = normal(SHARED);
            for i in 0..10 {
                let angle = turn * f64::from(group * 10 + i) / 300.0;
                let rho = radius(angle, z) + shared + normal(OWN);
                let point = turned * Point3::new(rho * angle.cos(), rho * angle.sin(), z);
                points.push(FormPoint {
                    point,
                    sigma: SHARED.hypot(OWN),
                    group: ring * 30 + group,
                });
            }
        }
    }
    let axis = turned * Vector3::new(3e-4, -2e-4, 1.0).normalize();
    round_form(
        &points,
        &(turned * Point3::new(2e-6, -3e-6, 0.0)),
        &axis,
        RADIUS + 1e-6,
    )
}

/// Root mean square of error over uncertainty of both zones, over seeds.
fn errors_over_stds(
    name: &str,
    truth: [f64; 2],
    seeds: u64,
    found: impl Fn(u64) -> Deviation,
) -> [f64; 2] {
    let (mut squares, mut means, mut stds) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for seed in 0..seeds {
        let Deviation {
            minimum_zone,
            least_squares,
        } = found(seed);
        for (i, estimate) in [minimum_zone, least_squares].into_iter().enumerate() {
            squares[i] += ((estimate.value - truth[i]) / estimate.std).powi(2) / seeds as f64;
            means[i] += (estimate.value - truth[i]) / seeds as f64;
            stds[i] += estimate.std / seeds as f64;
        }
    }
    let rms = squares.map(f64::sqrt);
    let um = |x: [f64; 2]| x.map(|x| (x * 1e8).round() / 100.0);
    println!(
        "{name}: truth {:?}, mean error {:?}, std {:?} µm; error/std {rms:.2?}",
        um(truth),
        um(means),
        um(stds)
    );
    rms
}

fn section(radius: impl Fn(f64) -> f64, turn: f64) -> [f64; 2] {
    let points: Vec<_> = (0..=2000)
        .map(|i| turn * f64::from(i) / 2000.0)
        .map(|t| Point2::new(radius(t) * t.cos(), radius(t) * t.sin()))
        .collect();
    let zone = roundness(&points).unwrap();
    [zone.minimum_zone, zone.least_squares]
}

const HONEST: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// 150 seeds determine a root mean square to 6 %. A groove has many undulations, and noise hides
/// the smallest.
#[test]
#[ignore = "a slow proof"]
fn roundness_is_off_by_its_uncertainty() {
    let three = |t: f64| RADIUS + 25e-6 * (3.0 * t + 0.4).cos();
    let mixed = |t: f64| RADIUS + 20e-6 * (2.0 * t).cos() + 8e-6 * (5.0 * t + 1.0).sin();
    let dent = |t: f64| RADIUS + 60e-6 * (-((t - 2.0) / 0.5).powi(2)).exp();
    for (name, radius, turn) in [
        ("three lobes", &three as &dyn Fn(f64) -> f64, TAU),
        ("two and five", &mixed, TAU),
        ("three lobes, 220°", &three, 220f64.to_radians()),
        ("a groove", &dent, TAU),
    ] {
        let found = |seed| touched(seed, 3, turn, |t, _| radius(t)).unwrap().roundness;
        let rms = errors_over_stds(name, section(radius, turn), 150, found);
        let most = if name == "a groove" {
            1.5
        } else {
            *HONEST.end()
        };
        assert!(
            rms.iter().all(|rms| (*HONEST.start()..=most).contains(rms)),
            "{name}: {rms:?}"
        );
    }
}

#[test]
fn a_round_wall_is_found_round_to_its_uncertainty() {
    let forms: Vec<RoundForm> = (0..60)
        .map(|seed| touched(seed, 3, TAU, |_, _| RADIUS).unwrap())
        .collect();
    let all = forms.iter().flat_map(|form| {
        [Some(form.roundness), form.cylindricity, form.straightness]
            .into_iter()
            .flatten()
            .flat_map(|d| [d.minimum_zone, d.least_squares])
    });
    let all: Vec<Estimate> = all.collect();
    let inside = all.iter().filter(|e| e.value <= e.std).count() as f64 / all.len() as f64;
    let largest = all.iter().map(|e| e.std).fold(0.0, f64::max);
    println!(
        "{:.1} % of the perfect forms contain 0; std up to {:.1} µm",
        inside * 100.0,
        largest * 1e6
    );
    assert!(inside > 0.95 && largest < 10e-6, "{inside} {largest}");
}

#[test]
#[ignore = "a slow proof"]
fn a_cone_and_a_bent_axis_are_off_by_their_uncertainty() {
    let seeds = 150;
    let wall = |radius: &dyn Fn(f64, f64) -> f64| {
        let points: Vec<Point3<f64>> = (0..=20)
            .flat_map(|ring| {
                (0..180).map(move |i| {
                    (
                        TAU * f64::from(i) / 180.0,
                        HEIGHT * (f64::from(ring) / 20.0 - 0.5),
                    )
                })
            })
            .map(|(t, z)| Point3::new(radius(t, z) * t.cos(), radius(t, z) * t.sin(), z))
            .collect();
        let zone = cylindricity(&points, &Point3::origin(), &Vector3::z()).unwrap();
        [zone.minimum_zone, zone.least_squares]
    };
    let cone = |_: f64, z: f64| RADIUS + 60e-6 * z / HEIGHT;
    let found = |seed| touched(seed, 5, TAU, cone).unwrap().cylindricity.unwrap();
    let rms = errors_over_stds("cone", wall(&cone), seeds, found);
    assert!(rms.iter().all(|rms| HONEST.contains(rms)), "{rms:?}");
    // middles on a parabola from 0 to 40 µm: a cylinder of that diameter holds them; that of least
    // squares about five heights, 0, ±½, ±1, has its axis at half of 40 µm, from which the ends are
    // off by the same
    let bent = |t: f64, z: f64| RADIUS + 40e-6 * (2.0 * z / HEIGHT).powi(2) * t.cos();
    let found = |seed| touched(seed, 5, TAU, bent).unwrap().straightness.unwrap();
    let rms = errors_over_stds("bent axis", [40e-6, 40e-6], seeds, found);
    assert!(rms.iter().all(|rms| HONEST.contains(rms)), "{rms:?}");
    let round: Vec<Estimate> = (0..30)
        .map(|seed| touched(seed, 5, TAU, bent).unwrap().roundness.minimum_zone)
        .collect();
    assert!(
        round.iter().filter(|e| e.value <= e.std).count() > 26,
        "its sections are round"
    );
}

#[test]
fn what_was_not_touched_has_no_form() {
    let three = |t: f64, _: f64| RADIUS + 25e-6 * (3.0 * t).cos();
    let form = touched(1, 5, TAU / 2.0, three).unwrap();
    assert!((form.coverage - 0.5).abs() < 0.06, "{}", form.coverage);
    let whole = touched(1, 5, TAU, three).unwrap();
    assert!(
        whole.coverage == 1.0 && whole.lobes == [3] && whole.undulations == 15,
        "{whole:?}"
    );
    assert_eq!(round_form(&[], &Point3::origin(), &Vector3::z(), 1.0), None);
    let bad = FormPoint {
        point: Point3::new(f64::NAN, 0.0, 0.0),
        sigma: 1e-6,
        group: 0,
    };
    assert_eq!(
        round_form(&[bad; 40], &Point3::origin(), &Vector3::z(), 1.0),
        None
    );
}
