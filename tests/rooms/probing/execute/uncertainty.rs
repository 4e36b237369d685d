//! An arm that differs from its scene: the errors of the numbers are as large as their stated
//! uncertainties.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind};
use touchup::mesh::{FaceHit, TriMesh};
use touchup::probing::arm::{ArmState, Observer};
use touchup::probing::execute::{
    Ending, Flag, ProbeParams, Prober, Progress, StaticWorld, World as ProbedWorld,
};
use touchup::probing::plan::{ArmUncertainty, PatternParams};
use touchup::sim::{ArmErrorSigmas, ArmErrors, ArmFault, ArmParams, Plate, SimArm};

use super::{cell, params};
use crate::plate_stream::plate_scan;

/// Error model of an arm relative to its scene, and the wanted accuracy of its numbers.
struct World {
    name: &'static str,
    sigmas: ArmErrorSigmas,
    /// standard deviation, m
    wanted: f64,
    /// whether directions deviate by more than the assumed lean of walls, unlike those of the plate
    turns: bool,
}

/// 10 % of the stiffness, 0.05 mm of the radius, 0.2 mm and 0.2° of the place, 0.05 mm of
/// repeatability.
const ROUGH: ArmErrorSigmas = ArmErrorSigmas {
    stiffness: 0.1,
    radius: 50e-6,
    tip: 0.0,
    shift: 0.2e-3,
    turn: 0.2 * std::f64::consts::PI / 180.0,
    joints: 0.0,
    lengths: 0.0,
    repeatability: 50e-6,
    play: 0.0,
};
const ROUGH_ARM: World = World {
    name: "rough",
    sigmas: ROUGH,
    wanted: 0.25e-3,
    turns: true,
};
const CALIBRATED_ARM: World = World {
    name: "calibrated",
    sigmas: ArmErrorSigmas::CALIBRATED,
    wanted: 25e-6,
    turns: false,
};
/// The middle of the plate.
const ABOUT: Point3<f64> = Point3::new(30e-3, 25e-3, 12e-3);

/// A feature of the plate by its drawing: its place and axis, the directions across which its place
/// counts, and its sizes, m.
struct Drawn {
    name: &'static str,
    kind: FeatureKind,
    place: [f64; 3],
    axis: Vector3<f64>,
    /// directions that determine its place
    across: &'static [[f64; 3]],
    sizes: &'static [f64],
}

const DRAWN: [Drawn; 5] = [
    Drawn {
        name: "hole",
        kind: FeatureKind::Hole,
        place: [16e-3, 36e-3, 12e-3],
        axis: Vector3::new(0.0, 0.0, 1.0),
        across: &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        sizes: &[8e-3],
    },
    Drawn {
        name: "slot",
        kind: FeatureKind::Slot,
        place: [25e-3, 14e-3, 12e-3],
        axis: Vector3::new(0.0, 0.0, 1.0),
        across: &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        sizes: &[6e-3, 20e-3],
    },
    Drawn {
        name: "boss",
        kind: FeatureKind::Boss,
        place: [47e-3, 25e-3, 12e-3],
        axis: Vector3::new(0.0, 0.0, 1.0),
        across: &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        sizes: &[10e-3],
    },
    Drawn {
        name: "plane",
        kind: FeatureKind::Plane,
        place: [45e-3, 9e-3, 12e-3],
        axis: Vector3::new(0.0, 0.0, 1.0),
        across: &[[0.0, 0.0, 1.0]],
        sizes: &[],
    },
    Drawn {
        name: "edge",
        kind: FeatureKind::Edge,
        place: [60e-3, 25e-3, 12e-3],
        axis: Vector3::new(0.0, 1.0, 0.0),
        across: &[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        sizes: &[],
    },
];

/// Error over stated uncertainty of place, direction, and each size.
type Normalised = (f64, f64, Vec<f64>);

impl Drawn {
    /// The numbers are in the frame of the scan, which is that of the drawing: a part off its told
    /// place in the base gives an error of each place and direction.
    fn normalised(&self, found: &Feature) -> Normalised {
        let (place, axis) = (Point3::from(self.place), self.axis);
        let off = found.centre.value - place;
        let across = self
            .across
            .iter()
            .map(|direction| off.dot(&Vector3::from(*direction)).powi(2))
            .sum::<f64>()
            .sqrt();
        let measured = found.axis.as_ref().unwrap();
        // no component along it counts
        let lean = measured.value.cross(&axis).norm();
        let sizes = [&found.diameter, &found.width, &found.length]
            .into_iter()
            .flatten();
        let sizes = sizes
            .filter(|_| self.kind != FeatureKind::Edge)
            .zip(self.sizes);
        let sizes = sizes
            .map(|(size, drawn)| (size.value - drawn).abs() / size.std.unwrap())
            .collect();
        (
            across / found.centre.std.unwrap(),
            lean / measured.std.unwrap(),
            sizes,
        )
    }
}

/// Told uncertainties are those of the drawn errors.
fn told(world: &World) -> ProbeParams {
    let ArmErrorSigmas {
        radius,
        shift,
        turn,
        repeatability,
        ..
    } = world.sigmas;
    let shared = ArmUncertainty {
        radius,
        place: shift,
        turn,
        registered_at: ABOUT.coords,
        ..ArmUncertainty::default()
    };
    let pattern = PatternParams {
        sigma: world.wanted,
        touch_sigma: repeatability,
        shared,
        ..params().pattern
    };
    ProbeParams {
        pattern,
        ..params()
    }
}

/// Probes a feature of the plate with an arm that differs from its scene.
///
/// - `fault`: and the number of contacts before it.
fn probed(
    drawn: &Drawn,
    seed: u64,
    scan: &TriMesh,
    world: &World,
    fault: Option<(usize, ArmFault)>,
) -> Result<Normalised, String> {
    let (plate, cell, params) = (Plate::default(), cell(), told(world));
    let errors = ArmErrors::draw(&world.sigmas, ABOUT, seed);
    let mut rng = Pcg64::seed_from_u64(seed);
    let (angle, off) = (
        rng.random_range(0.0..std::f64::consts::TAU),
        rng.random_range(0.0..2e-3),
    );
    let height = if drawn.kind == FeatureKind::Boss {
        4e-3
    } else {
        0.0
    };
    let place = Point3::from(drawn.place)
        + Vector3::new(off * f64::cos(angle), off * f64::sin(angle), height);
    let flag = Flag {
        id: 1,
        kind: Some(drawn.kind),
        place,
        radius: 3e-3,
    };
    let start: Isometry3<f64> = cell.pose(
        &UnitQuaternion::identity(),
        &Point3::new(30e-3, 25e-3, 50e-3),
    );
    let mut arm = SimArm::new(
        &plate,
        ArmParams {
            seed,
            errors,
            ..ArmParams::default()
        },
        &start,
    )
    .unwrap();
    if let Some((contacts, fault)) = fault {
        arm.fail_after_contacts(contacts, fault);
    }
    let mut world = StaticWorld::new(scan.clone());
    let probed = Prober::new(&mut arm, &cell, &params, &mut world).probe(&flag);
    match probed.found.and_then(|found| found.feature) {
        Some(feature)
            if matches!(
                probed.ending,
                Ending::ToleranceReached | Ending::CalibrationLimits { .. } | Ending::TouchesSpent
            ) =>
        {
            Ok(drawn.normalised(&feature))
        }
        _ => Err(format!(
            "{} with seed {seed}: {}",
            drawn.name, probed.ending
        )),
    }
}

/// Arms with a first contact, or a wall behind its search, within their error of the stand-off; at
/// seed 1087 two touches from 0.7 mm had one error. Each ended as a bent probe; one that bends by
/// 1 mm still gets no numbers.
#[test]
fn a_sound_arm_is_not_accused_of_a_bent_probe() {
    let scan = plate_scan(1);
    let bent = ArmFault::TipBent(Vector3::new(0.7e-3, 0.7e-3, 0.0));
    for (name, seed, world) in [
        ("slot", 1087, ROUGH_ARM),
        ("boss", 2014, ROUGH_ARM),
        ("boss", 2084, ROUGH_ARM),
        ("boss", 7193, CALIBRATED_ARM),
        ("slot", 6089, CALIBRATED_ARM),
        ("slot", 6149, CALIBRATED_ARM),
    ] {
        let drawn = DRAWN.iter().find(|drawn| drawn.name == name).unwrap();
        if let Err(why) = probed(drawn, seed, &scan, &world, None) {
            panic!("{why}");
        }
        let found = probed(drawn, seed, &scan, &world, Some((16, bent)));
        println!("{name} with seed {seed}, bent: {found:?}");
        let is_noticed = found
            .as_ref()
            .is_err_and(|why| why.contains("the probe is bent or loose"));
        assert!(is_noticed, "{name} with seed {seed}: {found:?}");
    }
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Sizes are off by the radius, which all touches share.
#[test]
#[ignore = "a slow proof"]
fn errors_are_as_large_as_stated_of_a_rough_arm() {
    errors_are_as_large_as_stated(&ROUGH_ARM, 0);
}

/// Sizes deviate by the scatter of touches.
#[test]
#[ignore = "a slow proof"]
fn errors_are_as_large_as_stated_of_a_calibrated_arm() {
    errors_are_as_large_as_stated(&CALIBRATED_ARM, 5000);
}

/// Of 200 errors the rms over their deviation is within the bounds for 50, 0.8 to 1.25: of 50 that
/// of a size scatters by 0.1. The arm finds all. Each feature has errors of its own, from a seed
/// on.
fn errors_are_as_large_as_stated(world: &World, first: u64) {
    let (seeds, [least, most]) = (200, [0.8, 1.25]);
    let scan = plate_scan(1);
    let mut table = String::from(
        "| arm | feature | number | error over ±, rms | found |\n|---|---|---|---|---|\n",
    );
    let mut wrong = Vec::new();
    for (drawn, apart) in DRAWN.iter().zip((first..).step_by(1000)) {
        let results: Vec<_> = (1..=seeds)
            .map(|seed| probed(drawn, apart + seed, &scan, world, None))
            .collect();
        let found: Vec<&Normalised> = results
            .iter()
            .filter_map(|result| result.as_ref().ok())
            .collect();
        let missed: Vec<String> = results
            .iter()
            .filter_map(|result| result.as_ref().err().cloned())
            .collect();
        wrong.extend(missed);
        let of = |number: fn(&Normalised, usize) -> f64, at| {
            rms(&found.iter().map(|one| number(one, at)).collect::<Vec<_>>())
        };
        let mut numbers = vec![
            ("place", of(|one, _| one.0, 0)),
            ("direction", of(|one, _| one.1, 0)),
        ];
        let names = if drawn.kind == FeatureKind::Slot {
            ["width", "length"]
        } else {
            ["diameter", ""]
        };
        numbers.extend((0..drawn.sizes.len()).map(|at| (names[at], of(|one, at| one.2[at], at))));
        for (number, rms) in numbers {
            let (arm, feature, found) = (world.name, drawn.name, found.len());
            writeln!(
                table,
                "| {arm} | {feature} | {number} | {rms:.2} | {found} of {seeds} |"
            )
            .unwrap();
            let least = if number == "direction" && !world.turns {
                0.0
            } else {
                least
            };
            if !(least..=most).contains(&rms) {
                wrong.push(format!("{arm} {feature} {number}: {rms:.2}"));
            }
        }
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A scan, and the place of the ball at each time of the arm, in O.
struct SeenPlaces {
    scan: StaticWorld,
    places: Vec<(i64, Point3<f64>)>,
}

impl Observer for SeenPlaces {
    fn on_state(&mut self, state: &ArmState) {
        self.places
            .push((state.stamp_ns, cell().place(&state.pose_bt)));
    }
}

impl ProbedWorld for SeenPlaces {
    fn mesh(&self) -> &TriMesh {
        self.scan.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.scan.closest_face(place, reach)
    }

    fn publish(&mut self, _: &Progress) {}
}

/// An arm that comes back from less than 1 mm has the error that it had, and the fit takes errors
/// of touches for independent. The ball of 3 mm falls in 0.2 mm from a wall of the slot, and that
/// of 5 mm has 0.5 mm of room in the hole.
#[test]
fn the_arm_comes_anew_to_each_touch_of_a_wall_nearby() {
    for (kind, place, ball) in [
        (FeatureKind::Slot, [25e-3, 12.7e-3, 12e-3], 1.5e-3),
        (FeatureKind::Hole, [32e-3, 34e-3, 12e-3], 2.5e-3),
    ] {
        let (plate, mut cell, mut params) = (Plate::default(), cell(), params());
        cell.tool.ball_radius = ball;
        params.pattern.ball_radius = ball;
        let start = cell.pose(
            &UnitQuaternion::identity(),
            &Point3::new(30e-3, 25e-3, 50e-3),
        );
        let arm = ArmParams {
            radius: ball,
            ..ArmParams::default()
        };
        let mut arm = SimArm::new(&plate, arm, &start).unwrap();
        let mut world = SeenPlaces {
            scan: StaticWorld::new(plate_scan(1)),
            places: Vec::new(),
        };
        let flag = Flag {
            id: 1,
            kind: Some(kind),
            place: place.into(),
            radius: 3e-3,
        };
        let probed = Prober::new(&mut arm, &cell, &params, &mut world).probe(&flag);
        let contacts: Vec<_> = probed
            .touches
            .iter()
            .filter_map(|touch| Some((touch.record.as_ref()?.curve_ns, touch.centre?)))
            .collect();
        let between: Vec<f64> = contacts
            .windows(2)
            .map(|pair| {
                let [(begun, contact), (next, _)] = [pair[0], pair[1]];
                let seen = world
                    .places
                    .iter()
                    .filter(|(stamp, _)| (begun..next).contains(stamp));
                seen.map(|(_, place)| (place - contact).norm())
                    .fold(0.0, f64::max)
            })
            .collect();
        println!("{kind:?}, {}: {between:.5?}", probed.ending);
        assert!(contacts.len() > 12, "{}", probed.ending);
        assert!(between.iter().all(|far| *far > 1e-3), "{between:?}");
    }
}
