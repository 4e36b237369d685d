//! Slots in any direction: the pattern that looks for one prefers none.

use nalgebra::{Isometry3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::features::{FeatureKind, MeasuredValue};
use touchup::probing::arm::{OnsetVerdict, TouchOutcome, TouchParams, TouchTarget};
use touchup::probing::plan::{Explorer, PatternParams};
use touchup::sim::{ArmParams, Bounds, Plate, SimArm, Surface, SurfacePoint};

use crate::plate_stream::plate_scan;

use super::touching::{at, explored, touched};

/// The plate turned about the middle of its slot.
struct TurnedPlate {
    plate: Plate,
    /// from the frame of the plate
    turn: Isometry3<f64>,
}

/// Middle of the slot, on the plate.
const MIDDLE: [f64; 3] = [25e-3, 14e-3, 12e-3];

impl TurnedPlate {
    fn new(angle: f64) -> Self {
        let middle = Vector3::from(MIDDLE);
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let turn = Isometry3::from_parts((middle - about * middle).into(), about);
        Self {
            plate: Plate::default(),
            turn,
        }
    }

    fn turned(&self, found: SurfacePoint) -> SurfacePoint {
        SurfacePoint {
            point: self.turn * found.point,
            normal: self.turn.rotation * found.normal,
        }
    }
}

impl Surface for TurnedPlate {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        self.plate
            .signed_distance(&self.turn.inverse_transform_point(p))
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        self.turned(self.plate.closest(&self.turn.inverse_transform_point(p)))
    }

    fn bounds(&self) -> Bounds {
        self.plate.bounds().seen_from(&self.turn.inverse())
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        let begun = found.len();
        self.plate
            .near(&self.turn.inverse_transform_point(p), reach, found);
        found[begun..]
            .iter_mut()
            .for_each(|one| *one = self.turned(*one));
    }
}

/// From the middle line of the slot, whose straight wall is 3 mm beside it: the ball of 1.5 mm
/// stops 1.5 mm beside that line, at any angle of approach.
#[test]
fn a_wall_met_at_a_flat_angle_is_a_contact_at_its_place() {
    let plate = Plate::default();
    for degrees in [
        10.0f64, 15.0, 20.0, 30.0, 40.0, 44.0, 45.0, 46.0, 50.0, 55.0, 60.0, 75.0, 90.0,
    ] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let params = ArmParams::default();
        let touching = TouchParams {
            stiffness: params.stiffness,
            ..TouchParams::default()
        };
        let from = [19e-3, 14e-3, 9.8e-3];
        let mut arm = SimArm::new(
            &plate,
            params.clone(),
            &at(&params, [from[0], from[1], 20e-3]),
        )
        .unwrap();
        let direction = Unit::new_normalize(Vector3::new(cos, sin, 0.0));
        let target = TouchTarget {
            standoff_bt: at(&params, from),
            direction,
            search: 12e-3,
            expected: None,
        };
        let record = touched(&mut arm, &touching, &target).unwrap();
        let TouchOutcome::Contact { onset, centre, .. } = record.outcome else {
            panic!("at {degrees}°: {:?}", record.outcome)
        };
        let beside = params.pose_bo.inverse_transform_point(&centre).y - 14e-3;
        println!(
            "{degrees}°: {:.1} µm off, {}",
            (beside - 1.5e-3) * 1e6,
            onset.verdict.name()
        );
        assert!(
            (beside - 1.5e-3).abs() < 10e-6,
            "{degrees}°: {:.1} µm",
            (beside - 1.5e-3) * 1e6
        );
        assert!(onset.verdict != OnsetVerdict::Edge, "{degrees}°");
        assert!(
            record.peak_force < 1.5 * touching.force,
            "{degrees}°: {} N",
            record.peak_force
        );
    }
}

/// Every 5°, with three flags up to 3 mm beside the middle each.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn a_slot_is_found_at_every_angle() {
    let (step, seeds) = (5, 3);
    let mut missed = Vec::new();
    for degrees in (0..180u32).step_by(step) {
        for seed in 0..seeds {
            let angle = f64::from(degrees).to_radians();
            let plate = TurnedPlate::new(angle);
            let params = ArmParams {
                seed: seed + 1,
                ..ArmParams::default()
            };
            let touching = TouchParams {
                stiffness: params.stiffness,
                ..TouchParams::default()
            };
            let mut rng = Pcg64::seed_from_u64(seed * 1000 + u64::from(degrees));
            let (turn, off) = (
                rng.random_range(0.0..std::f64::consts::TAU),
                rng.random_range(0.0..3e-3),
            );
            let flag = Point3::from(MIDDLE)
                + Vector3::new(off * f64::cos(turn), off * f64::sin(turn), 0.2e-3);
            let start = at(&params, [MIDDLE[0], MIDDLE[1], 30e-3]);
            let mut arm = SimArm::new(&plate, params.clone(), &start).unwrap();
            let mut search = Explorer::new(
                Some(FeatureKind::Slot),
                &flag,
                &Vector3::z_axis(),
                PatternParams {
                    touch_sigma: 5e-6,
                    ..PatternParams::default()
                },
                &plate_scan(1),
            )
            .unwrap();
            explored(&mut arm, &params, &touching, &mut search);
            let said = match search.found().map(|found| (found.touches, found.feature)) {
                Err(error) => error.to_string(),
                Ok((touches, Some(slot))) if slot.kind == FeatureKind::Slot => {
                    let off = slot.centre.value - Point3::from(MIDDLE);
                    let along =
                        Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * Vector3::x();
                    let number =
                        |measured: &Option<MeasuredValue<f64>>| measured.as_ref().unwrap().value;
                    let [width, length] =
                        [number(&slot.width) - 6e-3, number(&slot.length) - 20e-3];
                    // across the axis: its tilt is that of the top
                    let lean = slot.direction.unwrap().xy().perp(&along.xy()).abs();
                    let wrong = [off.xy().norm(), width.abs(), length.abs(), lean * 10e-3];
                    println!(
                        "{degrees}° seed {seed}: {touches} touches, off {:.1?} µm",
                        wrong.map(|w| w * 1e6)
                    );
                    if wrong.iter().all(|w| *w < 20e-6) {
                        continue;
                    }
                    format!("{:.0?} µm off", wrong.map(|w| w * 1e6))
                }
                Ok((_, other)) => format!("{other:?}"),
            };
            missed.push(format!("{degrees}° seed {seed}: {said}"));
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
