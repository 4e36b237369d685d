//! Probing until the decision of a characteristic, against a fixed uncertainty and a fixed pattern.
//! Simulated contacts scatter as stated: the test shows that decisions and stated risk agree, and
//! not the performance of a real arm.

use std::fmt::Write as _;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use touchup::conformity::{
    Decision, DecisionParams, MeasuredNumber, ToleranceLimits, assess, measured_number,
};
use touchup::features::fit::{
    Cylinder, Ends, FitParams, Freedom, Observation, Plane, Stadium, SurfaceModel, fit,
};
use touchup::features::{FeatureKind, InspectedQuantity};
use touchup::probing::plan::{
    ArmUncertainty, DecisionGoal, ExplorationResult, Explorer, FeatureQuantity, PatternParams,
    SoughtCharacteristic,
};
use touchup::sim::{Plate, Surface as _};

use super::plan::{SIGMA, TOP, flat, normal_of, on, probe};

/// Repeatability of a touch beside that of its curve, m; standard uncertainty of the radius of the
/// ball, m.
const TOUCH: f64 = 30e-6;
const RADIUS: f64 = 1e-6;

/// A number of a feature of the plate, and half the width of its tolerance, m.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    kind: FeatureKind,
    flag: Point3<f64>,
    quantity: InspectedQuantity,
    asked: FeatureQuantity,
    value: f64,
    half: f64,
}

const HOLE: Case = Case {
    name: "diameter of a hole",
    kind: FeatureKind::Hole,
    flag: Point3::new(16e-3, 36e-3, TOP),
    quantity: InspectedQuantity::Diameter,
    asked: FeatureQuantity::Diameter,
    value: 8e-3,
    half: 0.3e-3,
};
const BOSS: Case = Case {
    name: "diameter of a boss",
    kind: FeatureKind::Boss,
    flag: Point3::new(47e-3, 25e-3, 16e-3),
    value: 10e-3,
    ..HOLE
};
const SLOT: Case = Case {
    name: "width of a slot",
    kind: FeatureKind::Slot,
    flag: Point3::new(25e-3, 14e-3, TOP),
    quantity: InspectedQuantity::Width,
    asked: FeatureQuantity::Width,
    value: 6e-3,
    ..HOLE
};
const PLANE: Case = Case {
    name: "height of a plane",
    kind: FeatureKind::Plane,
    flag: Point3::new(45e-3, 9e-3, TOP),
    quantity: InspectedQuantity::Z,
    asked: FeatureQuantity::Position,
    value: TOP,
    half: 0.15e-3,
};

/// The true value is off the middle of the tolerance by this share of its half.
fn limits(case: &Case, share: f64) -> ToleranceLimits {
    let nominal = case.value - share * case.half;
    ToleranceLimits {
        lower: Some(nominal - case.half),
        upper: Some(nominal + case.half),
    }
}

fn params(budget: usize) -> PatternParams {
    let shared = ArmUncertainty {
        radius: RADIUS,
        ..ArmUncertainty::default()
    };
    PatternParams {
        touch_sigma: TOUCH,
        budget,
        shared,
        ..PatternParams::default()
    }
}

/// Explores with noise of each touch, and a ball that differs from the told one; `look` sees the
/// explorer after each touch.
fn explored(
    case: &Case,
    params: PatternParams,
    goal: Option<DecisionGoal>,
    rng: &mut Pcg64,
    look: &mut dyn FnMut(&Explorer),
) -> ExplorationResult {
    let plate = Plate::default();
    let mut some = |most: f64| rng.random_range(-most..most);
    let flag = case.flag + Vector3::new(some(1e-3), some(1e-3), 0.0);
    let scan = flat([-10.0, 70.0], [-10.0, 60.0]);
    let explorer =
        Explorer::new(Some(case.kind), &flag, &Vector3::z_axis(), params, &scan).unwrap();
    let mut explorer = match goal {
        Some(goal) => explorer.until_decided(goal),
        None => explorer,
    };
    let ball = params.ball_radius + params.shared.radius * rng.sample::<f64, _>(StandardNormal);
    while let Some(planned) = explorer.next_touch() {
        let noise = SIGMA.hypot(TOUCH) * rng.sample::<f64, _>(StandardNormal);
        explorer.take(&probe(&|p| plate.signed_distance(p), &planned, ball, noise));
        look(&explorer);
    }
    explorer.found().unwrap()
}

fn goal(case: &Case, limits: ToleranceLimits, confidence: f64) -> DecisionGoal {
    let sought = SoughtCharacteristic {
        name: case.name.to_owned(),
        quantity: case.quantity,
        limits,
        nominal: None,
    };
    let params = DecisionParams {
        confidence,
        ..DecisionParams::default()
    };
    DecisionGoal {
        characteristics: vec![sought],
        params,
    }
}

fn until_decided(case: &Case, share: f64, budget: usize, seed: u64) -> ExplorationResult {
    let mut rng = Pcg64::seed_from_u64(seed);
    explored(
        case,
        params(budget),
        Some(goal(case, limits(case, share), 0.95)),
        &mut rng,
        &mut |_| {},
    )
}

/// By one look alone.
fn decision(number: &MeasuredNumber, limits: ToleranceLimits) -> Decision {
    assess(
        number,
        limits,
        touchup::conformity::Distribution::Normal,
        &DecisionParams::default(),
    )
    .decision
}

/// Until the number has an uncertainty that decides a value as near to a limit as `distance` in 95
/// of 100 cases: two guard bands.
fn with_fixed_uncertainty(
    case: &Case,
    distance: f64,
    budget: usize,
    seed: u64,
) -> (usize, MeasuredNumber) {
    let sigma = distance / (2.0 * 1.645);
    let params = PatternParams {
        sigma,
        quantity: case.asked,
        ..params(budget)
    };
    let found = explored(
        case,
        params,
        None,
        &mut Pcg64::seed_from_u64(seed),
        &mut |_| {},
    );
    (
        found.touches,
        measured_number(&found.feature.unwrap(), case.quantity, None).unwrap(),
    )
}

/// Touches of a fixed pattern, evenly over the surface itself, with no search for it.
const GRID: usize = 39;

#[expect(clippy::too_many_lines)]
fn touched_evenly(case: &Case, seed: u64) -> MeasuredNumber {
    let mut rng = Pcg64::seed_from_u64(seed);
    let off = RADIUS * rng.sample::<f64, _>(StandardNormal);
    let places = |at: usize| {
        let (turn, depth) = (
            at as f64 / GRID as f64 * std::f64::consts::TAU,
            if at.is_multiple_of(2) { 1.2e-3 } else { 2.8e-3 },
        );
        (turn, depth)
    };
    let mut noise = || SIGMA.hypot(TOUCH) * rng.sample::<f64, _>(StandardNormal);
    let mut observe = |point: Point3<f64>, normal: Vector3<f64>, group: usize| Observation {
        point: point + normal * (off + noise()),
        offset: 0.0,
        sigma: SIGMA.hypot(TOUCH),
        group: group as u32,
    };
    let square = FitParams {
        axis_sigma: Some(PatternParams::default().square),
        ..FitParams::default()
    };
    let of_size = |value: f64, std: Option<f64>| MeasuredNumber {
        value,
        std: std.map(|std| std.hypot(2.0 * RADIUS)),
        is_at_least: false,
    };
    match case.kind {
        FeatureKind::Plane => {
            let plane = Plane::new(case.flag, &Vector3::z());
            let observations: Vec<_> = (0..GRID)
                .map(|at| {
                    let (turn, away) = (
                        2.4 * at as f64,
                        3e-3 * ((at as f64 + 0.5) / GRID as f64).sqrt(),
                    );
                    let place = case.flag + Vector3::new(turn.cos(), turn.sin(), 0.0) * away;
                    observe(place, Vector3::z(), at)
                })
                .collect();
            let fitted = fit(&plane, &observations, &FitParams::default()).unwrap();
            let std = fitted.std_at(&case.flag).map(|std| std.hypot(RADIUS));
            let height = case.flag.z - fitted.surface.distance(&case.flag);
            MeasuredNumber {
                value: height,
                std,
                is_at_least: false,
            }
        }
        FeatureKind::Slot => {
            let sizes = [6e-3, 20e-3];
            let truth = Stadium::new(
                case.flag,
                &Vector3::z(),
                &Vector3::x(),
                sizes,
                Ends::Round,
                true,
            );
            let observations = evenly_on(&truth, &mut observe, |at| {
                let (turn, depth) = places(at);
                case.flag + Vector3::new(10e-3 * turn.cos(), 3.5e-3 * turn.sin(), -depth)
            });
            let fitted = fit(&truth, &observations, &square).unwrap();
            of_size(fitted.surface.width, fitted.std_by(&[(Freedom::Size, 1.0)]))
        }
        _ => {
            let is_hole = case.kind == FeatureKind::Hole;
            let middle = Point3::new(
                case.flag.x,
                case.flag.y,
                if is_hole { TOP } else { TOP + 4e-3 },
            );
            let truth = Cylinder::new(middle, &Vector3::z(), case.value / 2.0, is_hole);
            let observations = evenly_on(&truth, &mut observe, |at| {
                let (turn, depth) = places(at);
                middle + Vector3::new(turn.cos(), turn.sin(), 0.0) * (case.value / 2.0)
                    - Vector3::z() * depth
            });
            let fitted = fit(&truth, &observations, &square).unwrap();
            of_size(
                2.0 * fitted.surface.radius,
                fitted.std_by(&[(Freedom::Size, 2.0)]),
            )
        }
    }
}

fn evenly_on<M: SurfaceModel>(
    truth: &M,
    observe: &mut dyn FnMut(Point3<f64>, Vector3<f64>, usize) -> Observation,
    place: impl Fn(usize) -> Point3<f64>,
) -> Vec<Observation> {
    let touch = |at: usize| {
        let point = on(truth, &place(at));
        observe(point, normal_of(truth, &point), at)
    };
    (0..GRID).map(touch).collect()
}

/// Right, wrong and open decisions, and all touches.
#[derive(Default)]
struct Tally {
    right: usize,
    wrong: usize,
    open: usize,
    touches: usize,
}

impl Tally {
    fn add(&mut self, decision: Decision, conforms: bool, touches: usize) {
        let is_right = (decision == Decision::Pass) == conforms;
        match decision {
            Decision::Undecided => self.open += 1,
            _ if is_right => self.right += 1,
            _ => self.wrong += 1,
        }
        self.touches += touches;
    }

    fn row(&self) -> String {
        let count = (self.right + self.wrong + self.open) as f64;
        format!(
            "{:.0}: {}, {}, {}",
            self.touches as f64 / count,
            self.right,
            self.wrong,
            self.open
        )
    }
}

/// Far from its limits the touches that fix the shape decide a number; near them no more than the
/// fixed uncertainty needs to decide these; and hardly any of all decisions is wrong.
#[test]
#[ignore = "a slow proof"]
fn deciding_takes_the_touches_that_the_distance_from_the_limit_asks_for() {
    let (seeds, budget) = (20, 100);
    let mut table = String::from(
        "| characteristic, ± tolerance | true value off nominal | until decided | fixed uncertainty | grid |\n|---|---|---|---|---|\n",
    );
    let (mut wrong, mut decided) = (0, 0);
    for case in [HOLE, BOSS, SLOT, PLANE] {
        let mut touches = Vec::new();
        let fixed: Vec<_> = (0..seeds)
            .map(|seed| with_fixed_uncertainty(&case, 0.1 * case.half, budget, seed))
            .collect();
        let even: Vec<_> = (0..seeds).map(|seed| touched_evenly(&case, seed)).collect();
        for share in [0.1, 0.5, 0.9, 1.1, 1.5] {
            let mut tallies: [Tally; 3] = Default::default();
            for seed in 0..seeds {
                let (limits, conforms) = (limits(&case, share), share <= 1.0);
                let found = until_decided(&case, share, budget, seed);
                tallies[0].add(
                    found.characteristics[0].assessment.decision,
                    conforms,
                    found.touches,
                );
                let (count, number) = &fixed[seed as usize];
                tallies[1].add(decision(number, limits), conforms, *count);
                tallies[2].add(decision(&even[seed as usize], limits), conforms, GRID);
            }
            let [a, b, c] = &tallies;
            let (name, half, percent) = (case.name, case.half * 1e3, share * 100.0);
            writeln!(
                table,
                "| {name}, {half} mm | {percent:.0} % | {} | {} | {} |",
                a.row(),
                b.row(),
                c.row()
            )
            .unwrap();
            (wrong, decided) = (wrong + a.wrong, decided + a.wrong + a.right);
            touches.push((a.touches, b.touches));
        }
        let far = [0, 4].map(|at| touches[at]);
        let name = case.name;
        assert!(
            far.iter().all(|(goal, fixed)| 2 * goal < *fixed),
            "{name}: {touches:?}"
        );
        assert!(
            touches[2].0 > touches[0].0 && touches[3].0 > touches[4].0,
            "{name}: {touches:?}"
        );
    }
    println!("touches on average: right, wrong, open of {seeds} seeds\n\n{table}");
    assert!(wrong * 20 <= decided, "{wrong} of {decided}");
}

/// On a limit a decision in either direction is a matter of chance alone, so its share is the
/// permitted share of wrong ones: no more than 5 %. The guard band of a single look, applied after
/// each touch, decides more often than that. Of n cases with 5 % each fewer than 5 % + 2.33 √(0.05
/// · 0.95 / n) come out in 99 of 100 runs.
#[test]
#[ignore = "a slow proof"]
fn looking_after_each_touch_keeps_the_stated_risk() {
    let seeds = 500;
    let confidence = touchup::conformity::repeated_confidence(0.95, 6, 39);
    for case in [HOLE, PLANE] {
        let limits = limits(&case, 1.0);
        let [mut naive, mut kept] = [[0usize; 2]; 2];
        for seed in 0..seeds {
            let mut rng = Pcg64::seed_from_u64(7000 + seed);
            let mut first = [None, None];
            // never ends the probing, so that both rules see the same touches
            let mut look = |explorer: &Explorer| {
                let standing = explorer.characteristics();
                let Some(number) = standing[0].measured else {
                    return;
                };
                let rules = [0.95, confidence].map(|confidence| DecisionParams {
                    confidence,
                    ..Default::default()
                });
                for (rule, first) in rules.iter().zip(&mut first) {
                    let said = assess(
                        &number,
                        limits,
                        touchup::conformity::Distribution::Normal,
                        rule,
                    )
                    .decision;
                    *first = first.or(Some(said).filter(|said| *said != Decision::Undecided));
                }
            };
            let never = goal(&case, limits, 1.0 - 1e-12);
            explored(&case, params(39), Some(never), &mut rng, &mut look);
            for (count, first) in [&mut naive, &mut kept].into_iter().zip(first) {
                count[0] += usize::from(first == Some(Decision::Pass));
                count[1] += usize::from(first == Some(Decision::Fail));
            }
        }
        let share = |count: usize| count as f64 / seeds as f64;
        println!(
            "{}, value on its limit, {seeds} seeds: pass {:.3}, fail {:.3} with the guard band of one look; {:.3}, {:.3} with that of all",
            case.name,
            share(naive[0]),
            share(naive[1]),
            share(kept[0]),
            share(kept[1])
        );
        let most = 0.05 + 2.33 * (0.05 * 0.95 / seeds as f64).sqrt();
        assert!(
            kept.iter().all(|&count| share(count) < most),
            "{}: {kept:?} of {seeds}",
            case.name
        );
        assert!(
            naive.iter().sum::<usize>() > kept.iter().sum(),
            "{naive:?} {kept:?}"
        );
    }
}

/// For a hole on its limit the explorer goes on while touches alone are uncertain; with an
/// uncertain radius of the ball it says so at once.
#[test]
fn a_value_on_its_limit_stays_undecided_and_says_why() {
    let limits = limits(&HOLE, 1.0);
    let of = |radius: f64, seed: u64| {
        let shared = ArmUncertainty {
            radius,
            ..ArmUncertainty::default()
        };
        let params = PatternParams {
            shared,
            ..params(30)
        };
        explored(
            &HOLE,
            params,
            Some(goal(&HOLE, limits, 0.95)),
            &mut Pcg64::seed_from_u64(seed),
            &mut |_| {},
        )
    };
    let open = (0..20)
        .map(|seed| of(0.0, seed))
        .filter(|found| found.characteristics[0].is_open())
        .collect::<Vec<_>>();
    assert!(open.len() >= 16, "{}", open.len());
    assert!(
        open.iter()
            .all(|found| found.touches == 30 && !found.is_as_asked)
    );
    // 0.2 mm of the radius: a guard band wider than all of the tolerance
    let limited = of(0.2e-3, 3);
    assert!(
        limited.characteristics[0].is_limited && limited.touches < 25,
        "{limited:?}"
    );
}

/// One touch fewer than the shape needs, and a value far beyond its limits: no decision.
#[test]
fn too_few_touches_for_the_shape_decide_nothing() {
    for budget in [12, 14] {
        for seed in 0..10 {
            let found = until_decided(&HOLE, 20.0, budget, seed);
            let wall = found
                .feature
                .map_or(0, |feature| feature.diameter.unwrap().touches.len());
            let one = &found.characteristics[0];
            // four touches of the surface around it are among them
            assert_eq!(one.measured.is_some(), wall >= 12, "{wall}: {one:?}");
            assert!(
                wall >= 12 || one.assessment.decision == Decision::Undecided,
                "{one:?}"
            );
        }
    }
}
