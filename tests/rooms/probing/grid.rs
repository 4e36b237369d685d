//! Planned touches against touches spread evenly over a feature, both from a flag and a scan alone.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use touchup::features::fit::{
    Cylinder, Ends, FitParams, Freedom, Observation, Plane, Stadium, SurfaceModel, fit,
};
use touchup::features::{Feature, FeatureKind};
use touchup::probing::plan::{Explorer, FeatureQuantity, PatternParams};
use touchup::sim::{Plate, Surface as _};

use super::plan::{SIGMA, TOP, normal_of, on, probe};
use crate::plate_stream::plate_scan;

/// Least depth of touches on a wall, and the largest in the hole and in the slot (whose floor is 5
/// mm below its opening), m.
const HIGHEST: f64 = 1.05e-3;
const IN_HOLE: f64 = 5e-3;
const IN_SLOT: f64 = 3.2e-3;
/// Width of the surface around an opening that belongs to its region: two balls, m.
const AROUND: f64 = 3e-3;
/// Assumed deviation of walls from the perpendicular to their surface, by both methods, rad.
const SQUARE: f64 = 2.27e-3;

/// Shares of two lengths, evenly in the rectangle of both for any number of places: R2 of Roberts,
/// the plastic number's powers.
fn even(at: usize) -> [f64; 2] {
    [0.754_877_666_246_692_8, 0.569_840_290_998_053_2].map(|step| (0.5 + step * at as f64).fract())
}

/// Outline of a stadium, or of a circle of no length, after a share of it; with the unit vector out
/// of it.
fn outline(half: f64, radius: f64, share: f64) -> (Point3<f64>, Vector3<f64>) {
    let (straight, round) = (2.0 * half, PI * radius);
    let gone = share * 2.0 * (straight + round);
    let (gone, sign) = if gone < straight + round {
        (gone, 1.0)
    } else {
        (gone - straight - round, -1.0)
    };
    let (x, angle) = if gone < straight {
        (half - gone, FRAC_PI_2)
    } else {
        (-half, FRAC_PI_2 + (gone - straight) / radius)
    };
    let out = Vector3::new(angle.cos(), angle.sin(), 0.0) * sign;
    (Point3::new(x * sign, 0.0, 0.0) + out * radius, out)
}

/// A hole or slot of the plate.
#[derive(Clone, Copy)]
struct Opening {
    kind: FeatureKind,
    middle: Point3<f64>,
    half: f64,
    radius: f64,
    deep: f64,
}

const HOLE: Opening = Opening {
    kind: FeatureKind::Hole,
    middle: Point3::new(16e-3, 36e-3, TOP),
    half: 0.0,
    radius: 4e-3,
    deep: IN_HOLE,
};
const SLOT: Opening = Opening {
    kind: FeatureKind::Slot,
    middle: Point3::new(25e-3, 14e-3, TOP),
    half: 7e-3,
    radius: 3e-3,
    deep: IN_SLOT,
};

/// Errors of place, size, second size, lean; m, and rad times 4 mm.
type Errors = [f64; 4];

/// Axis of walls, of height 1, with the assumed deviation of their lean. With square walls a fit
/// would err the less the fewer its data: without touches it assumes square ones.
fn drawn_axis(rng: &mut Pcg64) -> Vector3<f64> {
    let mut lean = || SQUARE * rng.sample::<f64, _>(StandardNormal);
    Vector3::new(lean(), lean(), 1.0)
}

/// By which an axis is off, over 4 mm.
fn lean_error(found: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
    (found / found.z - axis).norm() * 4e-3
}

/// The place of a surface for a place near it, and its normal there.
type OnSurface<'a> = &'a dyn Fn(&Point3<f64>) -> (Point3<f64>, Vector3<f64>);

impl Opening {
    /// Places evenly over the scanned region, wall and surface around it, by their areas.
    fn grid(&self, count: usize, rng: &mut Pcg64) -> [Vec<Point3<f64>>; 2] {
        let around = 4.0 * self.half + TAU * self.radius;
        let wall = around * (self.deep - HIGHEST);
        let ring = around * AROUND + PI * AROUND.powi(2);
        let of_wall = (count as f64 * wall / (wall + ring)).round() as usize;
        let first = rng.random_range(0..10_000);
        let place = |at: usize| even(first + at);
        let walls = (0..of_wall).map(|at| {
            let [along, down] = place(at);
            outline(self.half, self.radius, along).0
                - Vector3::z() * (HIGHEST + down * (self.deep - HIGHEST))
        });
        let top = (of_wall..count).map(|at| {
            let [along, away] = place(at);
            let (p, out) = outline(self.half, self.radius, along);
            p + out * (away * AROUND)
        });
        [walls.collect(), top.collect()]
    }

    /// Errors of as many touches spread evenly, with the opening 0.2 mm and 0.01 rad off in the
    /// scan (standard deviations); `None` if they leave an end of a slot open.
    #[expect(clippy::too_many_lines)]
    fn grid_errors(&self, count: usize, axis: &Vector3<f64>, rng: &mut Pcg64) -> Option<Errors> {
        let mut draw = |sigma: f64| sigma * rng.sample::<f64, _>(StandardNormal);
        let shift = Vector3::new(draw(0.2e-3), draw(0.2e-3), 0.0);
        let turn = Vector3::new(draw(0.01), draw(0.01), draw(0.01));
        let as_scanned = Isometry3::new(self.middle.coords + shift, turn);
        let [walls, tops] = self.grid(count, rng);
        let touch = |surface: OnSurface<'_>, p: &Point3<f64>, rng: &mut Pcg64| {
            let (point, normal) = surface(&(as_scanned * p));
            let point = point + normal * (SIGMA * rng.sample::<f64, _>(StandardNormal));
            Observation {
                point,
                offset: 0.0,
                sigma: SIGMA,
                group: rng.random(),
            }
        };
        let plane = Plane::new(self.middle, &Vector3::z());
        let top: Vec<_> = tops
            .iter()
            .map(|p| touch(&|p| (on(&plane, p), Vector3::z()), p, rng))
            .collect();
        let top = fit(&plane, &top, &FitParams::default()).unwrap().surface;
        let params = FitParams {
            axis_sigma: Some(SQUARE),
            ..FitParams::default()
        };
        let met = |center: Point3<f64>, axis: Vector3<f64>| {
            center - axis * (top.distance(&center) / top.normal().dot(&axis))
        };
        if self.kind == FeatureKind::Hole {
            let truth = Cylinder::new(self.middle, axis, self.radius, true);
            let on_wall = |p: &Point3<f64>| (on(&truth, p), normal_of(&truth, &on(&truth, p)));
            let walls: Vec<_> = walls.iter().map(|p| touch(&on_wall, p, rng)).collect();
            let guess = Cylinder::new(
                as_scanned.translation.vector.into(),
                &top.normal(),
                self.radius,
                true,
            );
            let found = fit(&guess, &walls, &params).unwrap().surface;
            let place = (met(found.center(), found.axis()) - self.middle)
                .xy()
                .norm();
            return Some([
                place,
                2.0 * (found.radius - self.radius),
                0.0,
                lean_error(&found.axis(), axis),
            ]);
        }
        let sizes = [2.0 * self.radius, 2.0 * (self.radius + self.half)];
        let stadium = |center: Point3<f64>, axis: Vector3<f64>, along: Vector3<f64>| {
            Stadium::new(center, &axis, &along, sizes, Ends::Round, true)
        };
        let truth = stadium(self.middle, *axis, Vector3::x());
        let on_wall = |p: &Point3<f64>| (on(&truth, p), normal_of(&truth, &on(&truth, p)));
        let walls: Vec<_> = walls.iter().map(|p| touch(&on_wall, p, rng)).collect();
        let guess = stadium(
            as_scanned.translation.vector.into(),
            top.normal(),
            as_scanned.rotation * Vector3::x(),
        );
        let fitted = fit(&guess, &walls, &params).unwrap();
        fitted.std(Freedom::Second)?;
        let found = fitted.surface;
        let place = (met(found.center(), found.axis()) - self.middle)
            .xy()
            .norm();
        Some([
            place,
            found.width - sizes[0],
            found.length - sizes[1],
            lean_error(&found.axis(), axis),
        ])
    }

    /// Errors of planned touches from a flag up to 2 mm beside it, and their number.
    fn planned_errors(
        &self,
        quantity: FeatureQuantity,
        axis: &Vector3<f64>,
        rng: &mut Pcg64,
    ) -> (Errors, usize) {
        let plate = Plate::default();
        // sheared by so small an angle distances change in the second order, by some nm
        let lean = axis - Vector3::z();
        let distance = |p: &Point3<f64>| plate.signed_distance(&(p - lean * (p.z - TOP)));
        let mut some = |most: f64| rng.random_range(-most..most);
        let flag = self.middle + Vector3::new(some(1.4e-3), some(1.4e-3), some(0.2e-3));
        let normal = Unit::new_normalize(Vector3::new(some(0.03), some(0.03), 1.0));
        // the explorer uses all touches
        let params = PatternParams {
            sigma: 1e-9,
            quantity,
            touch_sigma: 1e-9,
            ..PatternParams::default()
        };
        let mut search =
            Explorer::new(Some(self.kind), &flag, &normal, params, &plate_scan(1)).unwrap();
        while let Some(planned) = search.next_touch() {
            let noise: f64 = SIGMA * rng.sample::<f64, _>(StandardNormal);
            search.take(&probe(&distance, &planned, params.ball_radius, noise));
        }
        let found = search.found().unwrap();
        let Feature {
            centre,
            axis: found_axis,
            diameter,
            width,
            length,
            ..
        } = found.feature.unwrap();
        let size = diameter.or(width).unwrap().value - 2.0 * self.radius;
        let second = length.map_or(0.0, |length| length.value - 2.0 * (self.radius + self.half));
        let place = (centre.value - self.middle).xy().norm();
        (
            [
                place,
                size,
                second,
                lean_error(&found_axis.unwrap().value, axis),
            ],
            found.touches,
        )
    }
}

fn rms(errors: &[Errors]) -> Errors {
    std::array::from_fn(|at| {
        (errors.iter().map(|e| e[at].powi(2)).sum::<f64>() / errors.len() as f64).sqrt()
    })
}

/// Extrapolation of the wall between depths a and b gives the place of an axis at the surface. With
/// touches of variance σ² in n places evenly around and evenly over the depths its variance along
/// each direction is 2σ²/n (1 + m²/v), with m = (a + b)/2 and v = (b − a)²/12; the best n touches,
/// at a and b alone, leave 2σ²/n ((b + a)/(b − a))² \[Elfving 1952\]. With r = (b + a)/(b − a) the
/// ratio of errors is r/√(1 + 3r²): one half for a wall with touches up to its opening, 0.577 for a
/// thin strip; no plan can do better against a grid on the same wall. The sums below are those of
/// two and of many depths.
#[test]
fn no_plan_halves_the_error_of_a_grid_on_the_same_wall() {
    for (low, high) in [(0.0f64, 5.0), (1.05, 5.0), (1.05, 3.2), (3.0, 3.5)] {
        let r = (high + low) / (high - low);
        let bound = r / (1.0 + 3.0 * r * r).sqrt();
        // variance of the value at 0 of a line through values at depths, by its normal equations
        let at_zero = |depths: &[(f64, f64)]| {
            let sum = |power: i32| {
                depths
                    .iter()
                    .map(|(z, weight)| weight * z.powi(power))
                    .sum::<f64>()
            };
            sum(2) / (sum(0) * sum(2) - sum(1) * sum(1))
        };
        let count = 20_000;
        let even: Vec<_> = (0..count)
            .map(|at| {
                (
                    low + (high - low) * (f64::from(at) + 0.5) / f64::from(count),
                    1.0 / f64::from(count),
                )
            })
            .collect();
        let best = (1..1000)
            .map(|share| f64::from(share) / 1000.0)
            .map(|share| at_zero(&[(low.max(1e-12), share), (high, 1.0 - share)]))
            .fold(f64::INFINITY, f64::min);
        let ratio = (best / at_zero(&even)).sqrt();
        assert!(
            (ratio / bound - 1.0).abs() < 2e-3,
            "{low} to {high}: {ratio} is not {bound}"
        );
        assert!((0.5..0.578).contains(&bound), "{bound}");
    }
}

/// With as many touches as the plan made, including misses and the search for the opening, against
/// touches spread evenly over wall and surface around it as in a scan, without that search, and
/// with the same assumption of square walls: the place is better by at least a third, and no
/// requested number is worse. The goal is half the error of the place; 200 seeds reach 0.49 to
/// 0.58.
#[test]
#[ignore = "a slow proof"]
fn planned_touches_are_better_than_a_grid_over_the_region() {
    let seeds = 200;
    let mut failures = Vec::new();
    for (name, opening) in [("hole", HOLE), ("slot", SLOT)] {
        let names = if opening.kind == FeatureKind::Hole {
            ["place", "diameter", "", "lean over 4 mm"]
        } else {
            ["place", "width", "length", "lean over 4 mm"]
        };
        for quantity in [FeatureQuantity::Position, FeatureQuantity::All] {
            let (mut planned, mut grid) = (Vec::new(), Vec::new());
            for seed in 0..seeds {
                let mut rng = Pcg64::seed_from_u64(seed);
                let axis = drawn_axis(&mut rng);
                let (errors, touches) = opening.planned_errors(quantity, &axis, &mut rng);
                planned.push(errors);
                grid.extend(opening.grid_errors(touches, &axis, &mut rng));
            }
            println!(
                "{name}: {} of {seeds} grids leave an end open",
                seeds as usize - grid.len()
            );
            let [planned, grid] = [rms(&planned), rms(&grid)];
            for (at, number) in names
                .into_iter()
                .enumerate()
                .filter(|(_, number)| !number.is_empty())
            {
                let ratio = planned[at] / grid[at];
                let line = format!(
                    "{name}, for {}: {number} {:.2} µm planned, {:.2} µm grid, ratio {ratio:.2}",
                    quantity.name(),
                    planned[at] * 1e6,
                    grid[at] * 1e6
                );
                println!("{line}");
                let most = if at == 0 { 2.0 / 3.0 } else { 1.0 };
                // the others are not asked for with the place
                if ratio > most && (at == 0 || quantity == FeatureQuantity::All) {
                    failures.push(line);
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
