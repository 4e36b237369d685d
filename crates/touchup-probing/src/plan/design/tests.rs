use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand::seq::IteratorRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use touchup_features::features::fit::{
    Cylinder, Ends, FitParams, Observation, Plane, Stadium, fit,
};

const SIGMA: f64 = 5e-6;

fn hole() -> Cylinder {
    Cylinder::new(Point3::new(16e-3, 36e-3, 6e-3), &Vector3::z(), 4e-3, true)
}

/// Places on the wall of the hole, 24 around at 5 depths.
fn wall() -> Vec<Candidate> {
    let at = |angle: f64, depth: f64| {
        Point3::new(
            16e-3 + 4e-3 * angle.cos(),
            36e-3 + 4e-3 * angle.sin(),
            depth,
        )
    };
    let places = (0..5).flat_map(|row| {
        (0..24).map(move |column| (f64::from(column) / 24.0 * TAU, 2e-3 + 2e-3 * f64::from(row)))
    });
    places
        .map(|(angle, depth)| Candidate {
            point: at(angle, depth),
            sigma: SIGMA,
        })
        .collect()
}

/// Up to `count` touches, each as if those before had been made, until all is known as it is asked
/// for.
fn plan<M: SurfaceModel>(
    mut known: Knowledge,
    surface: &M,
    candidates: &[Candidate],
    asked: &TargetUncertainties,
    count: usize,
) -> (Vec<usize>, Knowledge) {
    let mut chosen = Vec::new();
    while chosen.len() < count
        && known.worst(asked) > 1.0
        && let Some((best, _)) =
            known.best(surface, 0..candidates.len(), |&at| candidates[at], asked)
    {
        known = known.with(surface, &candidates[best]);
        chosen.push(best);
    }
    (chosen, known)
}

/// Standard deviation of a number that changes with a freedom.
fn sigma_of(known: &Knowledge, by: (Freedom, f64)) -> f64 {
    known.worst(&TargetUncertainties::default().and(&[by], 1.0))
}

fn observation(candidate: &Candidate, group: u32) -> Observation {
    Observation {
        point: candidate.point,
        offset: 0.0,
        sigma: candidate.sigma,
        group,
    }
}

/// The fit has its covariance by another method: from all touches at once.
#[test]
fn predicted_and_fitted_covariance_agree() {
    let (surface, wall) = (hole(), wall());
    let chosen: Vec<_> = wall.iter().step_by(7).copied().collect();
    let known = chosen
        .iter()
        .fold(Knowledge::before::<Cylinder>(1.0, 10.0), |known, touch| {
            known.with(&surface, touch)
        });
    let observations: Vec<_> = chosen
        .iter()
        .zip(0..)
        .map(|(touch, group)| observation(touch, group))
        .collect();
    let fitted = fit(&surface, &observations, &FitParams::default()).unwrap();
    for freedom in [Freedom::Size, Freedom::TiltX, Freedom::TiltY] {
        let (ours, theirs) = (
            sigma_of(&known, (freedom, 1.0)),
            fitted.std(freedom).unwrap(),
        );
        assert!(
            (ours / theirs - 1.0).abs() < 1e-3,
            "{freedom:?}: {ours} {theirs}"
        );
    }
}

/// The tilt of a plane is determined by its corners, its height by any place.
#[test]
fn the_tilt_of_a_plane_is_asked_at_its_corners() {
    let surface = Plane::new(Point3::origin(), &Vector3::z());
    let grid: Vec<_> = (0..81)
        .map(|at| Candidate {
            point: Point3::new(
                f64::from(at % 9 - 4) * 1e-3,
                f64::from(at / 9 - 4) * 1e-3,
                0.0,
            ),
            sigma: SIGMA,
        })
        .collect();
    let asked = TargetUncertainties::default()
        .and(&[(Freedom::TiltX, 1.0)], 1e-9)
        .and(&[(Freedom::TiltY, 1.0)], 1e-9);
    let (chosen, _) = plan(
        Knowledge::before::<Plane>(5e-3, 0.1),
        &surface,
        &grid,
        &asked,
        2,
    );
    assert_eq!(chosen.len(), 2);
    for index in chosen {
        let p = grid[index].point;
        assert!(p.x.abs() > 3.9e-3 && p.y.abs() > 3.9e-3, "{p}");
    }
}

/// It ends at the requested accuracy, and predicts the uncertainty that the fit of real touches
/// then has.
#[test]
fn touches_are_as_many_as_the_goal_asks_for() {
    let (surface, wall) = (hole(), wall());
    let mut counts = Vec::new();
    for wanted in [20e-6, 5e-6, 2.5e-6] {
        let asked = TargetUncertainties::default().and(&[(Freedom::Size, 2.0)], wanted);
        // those that found it
        let first: Vec<usize> = (0..120).step_by(17).collect();
        let known = first
            .iter()
            .fold(Knowledge::before::<Cylinder>(3e-3, 0.05), |known, &at| {
                known.with(&surface, &wall[at])
            });
        let (mut chosen, known) = plan(known, &surface, &wall, &asked, 400);
        chosen.extend(first);
        let promised = sigma_of(&known, (Freedom::Size, 2.0));
        assert!(
            promised <= wanted && chosen.len() < 400,
            "{} touches for {wanted}",
            chosen.len()
        );
        let mut rng = Pcg64::seed_from_u64(7);
        let errors: Vec<f64> = (0..200)
            .map(|_| {
                let result = chosen.iter().zip(0..).map(|(&index, group)| {
                    let (_, by) = surface.derivatives(&wall[index].point);
                    let direction = -Vector3::new(by[0], by[1], 0.0);
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    let point = wall[index].point + surface.pose_of * direction * (noise * SIGMA);
                    observation(
                        &Candidate {
                            point,
                            sigma: SIGMA,
                        },
                        group,
                    )
                });
                let result: Vec<_> = result.collect();
                2.0 * (fit(&surface, &result, &FitParams::default())
                    .unwrap()
                    .surface
                    .radius
                    - surface.radius)
            })
            .collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        assert!(
            (rms / promised - 1.0).abs() < 0.2,
            "{} touches: promised {promised}, came {rms}",
            chosen.len()
        );
        counts.push(chosen.len());
    }
    assert!(counts.is_sorted() && counts[0] < counts[2], "{counts:?}");
}

/// A feature with a requested dimension: where it could be touched, and a grid over all of it.
struct Case<M> {
    name: &'static str,
    truth: M,
    /// derivatives of the requested dimensions by the parameters, and the target deviation
    asked: Vec<(Freedom, f64, f64)>,
    /// error of the dimension of a fit
    error: fn(&M, &M) -> f64,
    /// of the first touches, for any request
    first: Vec<Candidate>,
    places: Vec<Candidate>,
    grid: Vec<Candidate>,
}

/// Deviation of a lean before any touch, rad.
const LEAN: f64 = 0.02;

/// Outward normal at a point, by differences of the distance.
fn normal_of<M: SurfaceModel>(surface: &M, p: &Point3<f64>) -> Vector3<f64> {
    let step = 1e-6;
    let by = |direction: Vector3<f64>| {
        surface.distance(&(p + direction * step)) - surface.distance(&(p - direction * step))
    };
    Vector3::new(by(Vector3::x()), by(Vector3::y()), by(Vector3::z())).normalize()
}

/// The place of a surface that is nearest to a point near it.
fn on<M: SurfaceModel>(surface: &M, p: &Point3<f64>) -> Point3<f64> {
    (0..4).fold(*p, |p, _| p - normal_of(surface, &p) * surface.distance(&p))
}

/// Deviation of the numbers together, by the inverse of the information of all touches at once,
/// with derivatives from differences of the distance of surfaces that are moved.
fn sigma_by_differences<M: SurfaceModel>(
    truth: &M,
    touches: &[Point3<f64>],
    asked: &[(Freedom, f64, f64)],
) -> f64 {
    let mut information = SMatrix::<f64, FREEDOMS, FREEDOMS>::zeros();
    for freedom in Freedom::ALL {
        let at = freedom as usize;
        information[(at, at)] = match freedom {
            _ if !M::FREE[at] => 1.0,
            Freedom::TiltX | Freedom::TiltY => LEAN.powi(-2),
            _ => 1e-6,
        };
    }
    for p in touches {
        let by = |at: usize| {
            let [more, less] =
                [1e-7, -1e-7].map(|step| truth.moved(&Steps::ith(at, step)).distance(p));
            if M::FREE[at] {
                (more - less) / 2e-7
            } else {
                0.0
            }
        };
        let g = Steps::from_fn(|at, _| by(at));
        information += g * g.transpose() / SIGMA.powi(2);
    }
    let covariance = information.try_inverse().unwrap();
    let variance = |(freedom, by, _): &(Freedom, f64, f64)| {
        covariance[(*freedom as usize, *freedom as usize)] * by * by
    };
    asked.iter().map(variance).sum::<f64>().sqrt()
}

/// Touches of a planned pattern and of a grid of as many, where the surface is known as badly as
/// after the first touches: it is planned for one that lies and leans elsewhere and has other
/// sizes, and the true one is touched. Root mean square error of the number over 20 such surfaces
/// with 10 draws of noise each, and the ratio of both.
///
/// Both are those of the information matrix of the touches, and the best of 300 patterns of random
/// places is no better than the plan.
#[expect(clippy::too_many_lines)]
fn planned_over_grid<M: SurfaceModel>(case: &Case<M>) -> f64 {
    let count = case.grid.len();
    let (mut squares, mut variances, mut random) = ([0.0; 2], [0.0; 2], 0.0);
    let (surfaces, draws) = (20, 10);
    for seed in 0..surfaces {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut draw = |sigma: f64| -> f64 { rng.sample::<f64, _>(StandardNormal) * sigma };
        let steps = Freedom::ALL.map(|freedom| match freedom {
            _ if !M::FREE[freedom as usize] => 0.0,
            Freedom::TiltX | Freedom::TiltY | Freedom::Turn => draw(0.5 * LEAN),
            _ => draw(0.2e-3),
        });
        let guess = case.truth.moved(&Steps::from(steps));
        let on_guess = |touches: &[Candidate]| -> Vec<Candidate> {
            touches
                .iter()
                .map(|touch| Candidate {
                    point: on(&guess, &touch.point),
                    ..*touch
                })
                .collect()
        };
        let (first, places) = (on_guess(&case.first), on_guess(&case.places));
        let before = Knowledge::before::<M>(3e-3, LEAN);
        let known = first
            .iter()
            .fold(before, |known, touch| known.with(&guess, touch));
        let asked = case.asked.iter().fold(
            TargetUncertainties::default(),
            |asked, (freedom, by, sigma)| asked.and(&[(*freedom, *by)], *sigma),
        );
        let asked = asked.and_the_rest::<M>(1e-6, 3e-3);
        let (chosen, _) = plan(known, &guess, &places, &asked, count - first.len());
        let planned: Vec<_> = first
            .iter()
            .copied()
            .chain(chosen.iter().map(|at| places[*at]))
            .collect();
        assert_eq!(planned.len(), count);
        let landed = |touches: &[Candidate]| {
            touches
                .iter()
                .map(|touch| on(&case.truth, &touch.point))
                .collect::<Vec<_>>()
        };
        let patterns = [landed(&planned), landed(&on_guess(&case.grid))];
        for (which, pattern) in patterns.iter().enumerate() {
            variances[which] += sigma_by_differences(&case.truth, pattern, &case.asked).powi(2);
            for _ in 0..draws {
                let touch = |(p, group): (&Point3<f64>, u32)| {
                    let noise = rng.sample::<f64, _>(StandardNormal) * SIGMA;
                    let point = p + normal_of(&case.truth, p) * noise;
                    Observation {
                        point,
                        offset: 0.0,
                        sigma: SIGMA,
                        group,
                    }
                };
                let observations: Vec<_> = pattern.iter().zip(0..).map(touch).collect();
                let params = FitParams {
                    axis_sigma: Some(LEAN),
                    ..FitParams::default()
                };
                let fitted = fit(&guess, &observations, &params).unwrap();
                squares[which] += (case.error)(&fitted.surface, &case.truth).powi(2);
            }
        }
        if seed == 0 {
            let beginning = &patterns[0][..first.len()];
            let tried = (0..300).map(|_| {
                let picked = case.places.iter().sample(&mut rng, count - first.len());
                let pattern: Vec<_> = beginning
                    .iter()
                    .copied()
                    .chain(picked.iter().map(|touch| touch.point))
                    .collect();
                sigma_by_differences(&case.truth, &pattern, &case.asked)
            });
            random = tried.fold(f64::INFINITY, f64::min) / variances[0].sqrt();
        }
    }
    let rms = squares.map(|sum| (sum / (surfaces * draws) as f64).sqrt());
    let stated = variances.map(|sum| (sum / surfaces as f64).sqrt());
    println!(
        "{:<34} {count:>3} touches: {:>6.2} planned ({:.2} by information), {:>6.2} grid ({:.2}), ratio {:.2}; best of 300 \
         random {random:.2}",
        case.name,
        rms[0] * 1e6,
        stated[0] * 1e6,
        rms[1] * 1e6,
        stated[1] * 1e6,
        rms[0] / rms[1]
    );
    // 200 errors determine a deviation within a twentieth; χ² of 200 (or 400) leaves a fifth to
    // chance once in 10,000
    for (rms, stated) in rms.iter().zip(stated) {
        assert!(
            (rms / stated - 1.0).abs() < 0.2,
            "{}: {rms} is not {stated}",
            case.name
        );
    }
    assert!(
        random > 0.95,
        "{}: random touches are better, {random}",
        case.name
    );
    rms[0] / rms[1]
}

/// Places all over a wall: an outline of the plane, and depths below the opening at z = 0.
fn over(outline: &[Point3<f64>], depths: &[f64]) -> Vec<Candidate> {
    let at = |p: &Point3<f64>, depth: f64| Candidate {
        point: Point3::new(p.x, p.y, -depth),
        sigma: SIGMA,
    };
    outline
        .iter()
        .flat_map(|p| depths.iter().map(move |depth| at(p, *depth)))
        .collect()
}

fn evenly(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|at| low + (high - low) * (at as f64 + 0.5) / count as f64)
        .collect()
}

/// Outline of a slot of 20 × 6 mm about the origin, evenly along it.
fn outline(count: usize) -> Vec<Point3<f64>> {
    let (half, r) = (7e-3, 3e-3);
    let length = 4.0 * half + TAU * r;
    let place = |at: usize| {
        let s = (at as f64 + 0.5) / count as f64 * length;
        let (straight, round) = (2.0 * half, TAU / 2.0 * r);
        match s {
            s if s < straight => Point3::new(s - half, r, 0.0),
            s if s < straight + round => {
                let angle = TAU / 4.0 - (s - straight) / r;
                Point3::new(half + r * angle.cos(), r * angle.sin(), 0.0)
            }
            s if s < 2.0 * straight + round => Point3::new(half - (s - straight - round), -r, 0.0),
            s => {
                let angle = -TAU / 4.0 - (s - 2.0 * straight - round) / r;
                Point3::new(-half + r * angle.cos(), r * angle.sin(), 0.0)
            }
        }
    };
    (0..count).map(place).collect()
}

fn circle(count: usize) -> Vec<Point3<f64>> {
    let at = |k: usize| k as f64 / count as f64 * TAU;
    (0..count)
        .map(|k| Point3::new(4e-3 * at(k).cos(), 4e-3 * at(k).sin(), 0.0))
        .collect()
}

/// Where the axis goes through z = 0.
fn opening(hole: &Cylinder) -> Point3<f64> {
    let (c, axis) = (hole.center(), hole.axis());
    c - axis * (c.z / axis.z)
}

/// Planned touches beat a grid of as many over the feature itself by about half where some of the
/// feature is little informative about the number: the walls of a slot of its length, touches near
/// the axis' own plane of a lean. Where all touches are equally informative, as of a diameter, no
/// plan can be better, and it must not be worse.
#[test]
#[expect(clippy::too_many_lines)]
fn planned_touches_beat_a_uniform_grid() {
    let depths = evenly(1e-3, 5e-3, 4);
    let fine: Vec<f64> = (0..9).map(|at| 1e-3 + 0.5e-3 * f64::from(at)).collect();
    let slot = || {
        Stadium::new(
            Point3::origin(),
            &Vector3::z(),
            &Vector3::x(),
            [6e-3, 20e-3],
            Ends::Round,
            true,
        )
    };
    let of_slot = |name, asked, error| Case {
        name,
        truth: slot(),
        asked,
        error,
        first: over(&outline(8), &[2.4e-3]),
        places: over(&outline(120), &fine),
        grid: over(&outline(12), &depths),
    };
    let length = planned_over_grid(&of_slot(
        "length of a slot",
        vec![(Freedom::Second, 1.0, 1e-6)],
        |fit, truth| fit.length - truth.length,
    ));
    let width = planned_over_grid(&of_slot(
        "width of a slot",
        vec![(Freedom::Size, 1.0, 1e-6)],
        |fit, truth| fit.width - truth.width,
    ));
    let direction = planned_over_grid(&of_slot(
        "direction of a slot, 1/1000",
        vec![(Freedom::Turn, 1e-3, 1e-7)],
        |fit, _| 1e-3 * fit.direction().y,
    ));
    // with the axes of its frame those of O
    let hole = || Cylinder {
        pose_of: nalgebra::Isometry3::identity(),
        radius: 4e-3,
        concave: true,
    };
    let of_hole = |name, asked, error| Case {
        name,
        truth: hole(),
        asked,
        error,
        first: over(&circle(3), &[2.4e-3]),
        places: over(&circle(48), &fine),
        grid: over(&circle(12), &depths),
    };
    let lean = planned_over_grid(&of_hole(
        "lean of a hole towards x, 1/1000",
        vec![(Freedom::TiltX, 1e-3, 1e-7)],
        |fit, _| 1e-3 * fit.axis().x / fit.axis().z,
    ));
    let x = planned_over_grid(&of_hole(
        "place of a hole along x",
        vec![(Freedom::X, 1.0, 1e-6)],
        |fit, _| opening(fit).x,
    ));
    let place = planned_over_grid(&of_hole(
        "place of a hole",
        vec![(Freedom::X, 1.0, 1e-6), (Freedom::Y, 1.0, 1e-6)],
        |fit, _| opening(fit).coords.norm(),
    ));
    let diameter = planned_over_grid(&of_hole(
        "diameter of a hole",
        vec![(Freedom::Size, 2.0, 1e-6)],
        |fit, truth| 2.0 * (fit.radius - truth.radius),
    ));
    // by the information 0.52, 0.43, 0.42, 0.54, 0.75, 0.92 and 1.0, and a fifth of it for chance
    for (what, ratio, most) in [
        ("length", length, 0.62),
        ("lean", lean, 0.52),
        ("x", x, 0.5),
        ("place", place, 0.65),
        ("direction", direction, 0.9),
        ("width", width, 1.1),
        ("diameter", diameter, 1.2),
    ] {
        assert!(ratio < most, "{what}: {ratio}");
    }
}
