//! Stated uncertainty of strokes whose errors wander, over many seeds, against the truth.

use std::f64::consts::TAU;

use touchup::features::fit::{
    Ends, Fit, FitParams, Freedom, Plane, Stadium, SurfaceModel, TouchNoise, fit,
};

use touchup::features::detect;
use touchup::mesh::TriMesh;
use touchup::stylus::ProbedPoint;

use super::*;

/// Groups of one pass, and of the pause after it: 2 s and 5 s.
const PASS: u32 = 20;
const PAUSE: u32 = 50;
const WHITE: f64 = 0.02 * MM;
const WANDER: f64 = 0.08 * MM;
const BALL: f64 = 1.5 * MM;
const RADIUS: f64 = 5.0 * MM;
const SLOT: [f64; 2] = [8.0 * MM, 12.0 * MM];
const SEEDS: u64 = 120;

/// Place of a ball in a hole about z, from the share of its helix.
fn in_hole(share: f64) -> Point3<f64> {
    let (sin, cos) = (1.5 * TAU * share).sin_cos();
    let rho = RADIUS - BALL;
    Point3::new(rho * cos, rho * sin, (share - 0.5) * 8.0 * MM)
}

/// Place of a ball on the plane z = 0, from the share of its serpentine.
fn on_plane(share: f64) -> Point3<f64> {
    let across = (2.0 * TAU * share).sin() * 6.0 * MM;
    Point3::new((share - 0.5) * 20.0 * MM, across, BALL)
}

/// Place of a ball along the wall of a slot about z, from the share of its way around.
fn in_slot(share: f64) -> Point3<f64> {
    let (radius, straight) = (SLOT[0] / 2.0 - BALL, SLOT[1] - SLOT[0]);
    let bend = TAU / 2.0 * radius;
    let along = (2.0 * share).fract() * (straight + bend);
    let side = if share < 0.5 { 1.0 } else { -1.0 };
    let (x, y) = if along < straight {
        (along - straight / 2.0, -radius)
    } else {
        let (sin, cos) = ((along - straight) / radius).sin_cos();
        (straight / 2.0 + radius * sin, -radius * cos)
    };
    let z = 3.0 * MM * (3.0 * TAU * share).sin();
    Point3::new(side * x, side * y, z)
}

/// Passes over a surface, one after the other, by a stylus with white noise and an
/// Ornstein-Uhlenbeck wander of a correlation time in groups. Its exact discrete form: the wander
/// keeps k = exp(−t/T) of itself over a time t, and gains a variance of 1 − k².
fn strokes(
    rng: &mut Pcg64,
    place: fn(f64) -> Point3<f64>,
    passes: u32,
    memory: f64,
) -> Vec<Observation> {
    let mut wander = shaken(rng, WANDER);
    let mut touched = Vec::new();
    for pass in 0..passes {
        for step in 0..PASS {
            let time = if step == 0 { PAUSE + 1 } else { 1 };
            let keep = (-f64::from(time) / memory).exp();
            wander = wander * keep + shaken(rng, WANDER * (1.0 - keep * keep).sqrt());
            let start = f64::from(pass) * 0.37;
            let share = ((f64::from(step) + 0.5) / f64::from(PASS) + start).fract();
            touched.push(Observation {
                point: place(share) + wander + shaken(rng, WHITE),
                offset: BALL,
                sigma: WHITE,
                group: pass * (PASS + PAUSE) + step,
            });
        }
    }
    touched
}

/// Root mean square error over the standard deviation, of fits that know the wander and of fits
/// that take the groups for independent.
///
/// - `errors`: of some freedoms of a fit.
fn normalised<S: SurfaceModel>(
    guess: &S,
    place: fn(f64) -> Point3<f64>,
    [passes, memory]: [u32; 2],
    errors: impl Fn(&S) -> Vec<(Freedom, f64)>,
) -> [f64; 2] {
    let memory = f64::from(memory);
    let noise = TouchNoise {
        white: WHITE,
        wander: WANDER,
        memory,
    };
    [noise, TouchNoise::default()].map(|noise| {
        let params = FitParams {
            noise,
            ..FitParams::default()
        };
        let of_seed = |seed| {
            let touched = strokes(&mut generator(seed), place, passes, memory);
            let found: Fit<S> = fit(guess, &touched, &params).unwrap();
            let over_std = |(freedom, error): (Freedom, f64)| error / found.std(freedom).unwrap();
            errors(&found.surface)
                .into_iter()
                .map(over_std)
                .collect::<Vec<_>>()
        };
        rms(&(0..SEEDS).flat_map(of_seed).collect::<Vec<_>>())
    })
}

/// Asserts the stated uncertainty for one to twenty passes and a wander of 0.5 s to 8 s.
fn stated_holds<S: SurfaceModel>(
    name: &str,
    guess: &S,
    place: fn(f64) -> Point3<f64>,
    errors: impl Fn(&S) -> Vec<(Freedom, f64)>,
) {
    for passes in [1, 2, 6, 20] {
        for memory in [5, 20, 80] {
            let [known, alone] = normalised(guess, place, [passes, memory], &errors);
            println!("{name}, {passes} passes, memory {memory}: {known:.2}, without {alone:.2}");
            assert!(
                (0.8..1.25).contains(&known),
                "{name}, {passes} passes, memory {memory}: {known}"
            );
            assert!(alone > 1.3 * known, "{name}: {alone} without the wander");
        }
    }
}

#[test]
fn place_and_radius_of_a_hole_hold_for_few_passes_with_a_wander() {
    let guess = hole_near(&Isometry3::identity(), RADIUS);
    stated_holds("hole", &guess, in_hole, |hole| {
        // at the height of the origin of F
        let center = Vector3::new(hole.center().x, hole.center().y, 0.0);
        let off = hole.pose_of.inverse_transform_vector(&center);
        vec![
            (Freedom::X, off.x),
            (Freedom::Y, off.y),
            (Freedom::Size, hole.radius - RADIUS),
        ]
    });
}

#[test]
fn place_of_a_plane_holds_for_few_passes_with_a_wander() {
    let guess = Plane::new(
        Point3::new(0.0, 0.0, 0.1 * MM),
        &Vector3::new(0.01, -0.02, 1.0),
    );
    stated_holds("plane", &guess, on_plane, |plane| {
        vec![(Freedom::Z, plane.center().z)]
    });
}

#[test]
fn place_and_sizes_of_a_slot_hold_for_few_passes_with_a_wander() {
    let guess = Stadium::new(
        Point3::new(0.2, -0.1, 0.0) * MM,
        &Vector3::new(0.01, -0.01, 1.0),
        &Vector3::new(1.0, 0.02, 0.0),
        [SLOT[0] + 0.2 * MM, SLOT[1] - 0.3 * MM],
        Ends::Round,
        true,
    );
    stated_holds("slot", &guess, in_slot, |slot| {
        vec![
            (Freedom::X, slot.center().x),
            (Freedom::Y, slot.center().y),
            (Freedom::Size, slot.width - SLOT[0]),
            (Freedom::Second, slot.length - SLOT[1]),
        ]
    });
}

/// Lines over a plate along x and then along y, 0.7 mm apart and 0.1 s for 0.7 mm, by a stylus that
/// wanders: a place as wide as the ball's radius has steps of one line, neighbouring lines, and both
/// directions.
fn lines_over_a_plate(rng: &mut Pcg64, noise: &TouchNoise) -> Vec<ProbedPoint> {
    const LINE: i64 = 20;
    let mut wander = shaken(rng, noise.wander);
    let mut touches = Vec::new();
    let at = |step: i64| (step as f64 - 9.5) * 0.7 * MM;
    for line in 0..2 * LINE {
        for step in 0..LINE {
            let keep = if step == 0 { 6.0 } else { 1.0 };
            let keep = f64::exp(-keep / noise.memory);
            wander = wander * keep + shaken(rng, noise.wander * (1.0 - keep * keep).sqrt());
            let [x, y] = [at(step), at(line % LINE)];
            let [x, y] = if line < LINE { [x, y] } else { [y, x] };
            let point = Point3::new(x, y, 0.0) + wander + shaken(rng, noise.white);
            touches.push(ProbedPoint {
                stamp_ns: (line * (LINE + 5) + step) * 100_000_000,
                stroke: line as u32,
                centre: point + Vector3::z() * BALL,
                radius: BALL,
                point,
                normal: Vector3::z(),
                sigma: 1e-6,
                calibration: 0.0,
                place: 0.0,
                weight: 1.0,
                is_rejected: false,
            });
        }
    }
    touches
}

/// Twelve plates of 100 s, some thirty correlation times each. Of such dozens the root mean square of
/// the white noise scatters by a tenth, of the wander by less, and the mean correlation time by a
/// fifth.
#[test]
fn repeated_visits_show_the_noise_of_a_session() {
    let noise = TouchNoise {
        white: 8e-6,
        wander: 30e-6,
        memory: 15.0,
    };
    let corner = |i: u32| Point3::new(f64::from(i % 21) - 10.0, f64::from(i / 21) - 10.0, 0.0);
    let positions = (0..21 * 21).map(|i| Point3::from(corner(i).coords * 2.0 * MM));
    let faces = (0..20 * 20).flat_map(|i| {
        let at = i / 20 * 21 + i % 20;
        [[at, at + 1, at + 22], [at, at + 22, at + 21]]
    });
    let plate = TriMesh::new(positions.collect(), faces.collect()).unwrap();
    let found: Vec<_> = (0..12)
        .map(|seed| detect(&plate, &lines_over_a_plate(&mut generator(seed), &noise)).noise)
        .collect();
    println!("{found:?}");
    let of = |number: fn(&TouchNoise) -> f64| rms(&found.iter().map(number).collect::<Vec<_>>());
    for (name, ratio, off) in [
        ("white", of(|noise| noise.white) / noise.white, 0.3),
        ("wander", of(|noise| noise.wander) / noise.wander, 0.2),
    ] {
        assert!((ratio - 1.0).abs() < off, "{name}: {ratio}");
    }
    let memory = found.iter().map(|noise| noise.memory.ln()).sum::<f64>() / 12.0;
    assert!((memory.exp() / noise.memory).ln().abs() < 0.5, "{memory}");
}
