//! A bent probe, a slipping part, a drifting arm and a drifting sensor during the probing of a
//! feature.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use touchup::features::FeatureKind;
use touchup::probing::arm::ProbeError;
use touchup::probing::execute::{Ending, Flag, FlagResult, Prober, References};
use touchup::sim::{ArmFault, ArmParams, Plate, SensorFault, SimArm};

use super::{cell, params};
use crate::plate_stream::plate_scan;
use crate::static_scan::StaticScan;

const HOLE: (FeatureKind, [f64; 3]) = (FeatureKind::Hole, [17e-3, 35e-3, 12e-3]);
const PLANE: (FeatureKind, [f64; 3]) = (FeatureKind::Plane, [45e-3, 8e-3, 12e-3]);
const SLOT: (FeatureKind, [f64; 3]) = (FeatureKind::Slot, [26e-3, 13e-3, 12e-3]);
const BOSS: (FeatureKind, [f64; 3]) = (FeatureKind::Boss, [47.5e-3, 26e-3, 16e-3]);

/// Probes features one after the other, until one stops.
fn probed(
    wanted: &[(FeatureKind, [f64; 3])],
    seed: u64,
    change: impl FnOnce(&mut SimArm),
) -> Vec<FlagResult> {
    let (plate, cell, params) = (Plate::default(), cell(), params());
    let start: Isometry3<f64> = cell.pose(
        &UnitQuaternion::identity(),
        &Point3::new(40e-3, 25e-3, 50e-3),
    );
    let arm = ArmParams {
        seed,
        ..ArmParams::default()
    };
    let mut arm = SimArm::new(&plate, arm, &start).unwrap();
    change(&mut arm);
    let mut world = StaticScan::new(plate_scan(1));
    let (mut all, mut references) = (Vec::new(), References::default());
    for (id, (kind, place)) in (1..).zip(wanted) {
        let flag = Flag {
            id,
            kind: Some(*kind),
            place: (*place).into(),
            radius: 3e-3,
        };
        let mut prober = Prober::new(&mut arm, &cell, &params, &mut world);
        prober.references = references;
        all.push(prober.probe(&flag));
        references = prober.references;
        if matches!(all[all.len() - 1].ending, Ending::Stopped(_)) {
            break;
        }
    }
    arm.advance(0.5);
    assert!(arm.ball().z > 13e-3, "it has retracted: {}", arm.ball());
    all
}

/// Without a repeated contact each passes by its own touches, or ends as something else.
#[test]
#[expect(clippy::too_many_lines)]
fn what_moved_while_a_feature_was_probed_is_found_by_a_contact_that_is_touched_again() {
    let mm = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) * 1e-3;
    let moved = |turn_mrad: f64, by| ArmFault::PartMoved(Vector3::z() * turn_mrad * 1e-3, by);
    type Case = (
        &'static str,
        &'static [(FeatureKind, [f64; 3])],
        usize,
        ArmFault,
    );
    let cases: [Case; 9] = [
        (
            "tip bent by 1 mm",
            &[HOLE],
            12,
            ArmFault::TipBent(mm(1.0, 0.0, 0.1)),
        ),
        (
            "tip bent by 0.2 mm",
            &[HOLE],
            9,
            ArmFault::TipBent(mm(0.0, 0.2, 0.0)),
        ),
        (
            "tip pushed in",
            &[PLANE],
            4,
            ArmFault::TipBent(mm(0.0, 0.0, 0.2)),
        ),
        (
            "tip bent at the slot",
            &[SLOT],
            12,
            ArmFault::TipBent(mm(0.0, 0.5, 0.0)),
        ),
        (
            "part slips by 1 mm",
            &[HOLE],
            12,
            moved(0.0, mm(0.7, 0.7, 0.0)),
        ),
        (
            "part slips at the boss",
            &[BOSS],
            14,
            moved(0.0, mm(0.5, 0.0, 0.0)),
        ),
        ("part turns", &[SLOT], 13, moved(10.0, mm(0.0, 0.0, 0.0))),
        (
            "part slips from one feature to the next",
            &[HOLE, BOSS],
            17,
            moved(0.0, mm(0.4, 0.0, 0.0)),
        ),
        (
            "tip bent at the first touch of the second",
            &[HOLE, SLOT],
            18,
            ArmFault::TipBent(mm(-0.4, 0.0, 0.0)),
        ),
    ];
    for (name, wanted, contacts, fault) in cases {
        let all = probed(wanted, 3, |arm| arm.fail_after_contacts(contacts, fault));
        let last = &all[all.len() - 1];
        println!(
            "{name}: after {} touches: {}",
            last.touches.len(),
            last.ending
        );
        assert!(last.ending.is_displaced(), "{name}: {}", last.ending);
        assert!(
            last.found.is_none() && last.verified < last.touches.len(),
            "{name}"
        );
        assert!(
            all[..all.len() - 1]
                .iter()
                .all(|one| one.verified == one.touches.len()),
            "{name}"
        );
    }
}

/// 10 µm in each second, to the side.
#[test]
fn an_arm_that_drifts_slowly_is_found_as_well() {
    let drift = |arm: &mut SimArm| {
        for step in 1..3000 {
            let by = ArmFault::TipBent(Vector3::new(0.6e-6, 0.8e-6, 0.0));
            arm.fail_at(f64::from(step) * 0.1, by);
        }
    };
    let all = probed(&[HOLE, BOSS, SLOT], 1, drift);
    let last = &all[all.len() - 1];
    println!("{}", last.ending);
    assert!(last.ending.is_displaced(), "{}", last.ending);
}

/// Nothing moves, and the arms find the features of all ten seeds as ever.
#[test]
fn contacts_of_an_arm_that_stays_are_where_they_were() {
    let mut worst: f64 = 0.0;
    for seed in 0..10 {
        for one in probed(&[HOLE, PLANE, SLOT, BOSS], seed, |_| {}) {
            assert!(
                one.found.is_some() && one.verified == one.touches.len(),
                "{}",
                one.ending
            );
            assert_eq!(one.references.len(), 3, "{:?}", one.references);
            worst = one
                .references
                .iter()
                .map(|again| again.off.abs() / again.sigma)
                .fold(worst, f64::max);
        }
    }
    println!("at most {worst:.1} standard deviations off");
}

/// 0.5 N rms are half of the trigger of 1 N; 0.2 N/s are more than it after 5 s.
#[test]
fn noise_is_refused_at_the_start_and_drift_is_named_as_drift() {
    let noise = ArmFault::Sensor(SensorFault::Noise(0.5));
    let all = probed(&[HOLE], 2, |arm| arm.fail_at(0.0, noise));
    assert!(
        matches!(&all[0].ending, Ending::Stopped(ProbeError::Noisy { noise_n, .. }) if (0.3..0.7).contains(noise_n)),
        "{}",
        all[0].ending
    );
    assert!(all[0].touches.is_empty());
    for rate in [Vector3::z() * 0.2, Vector3::z() * -0.2, Vector3::x() * 0.2] {
        let drift = ArmFault::Sensor(SensorFault::Drifts(rate));
        let all = probed(&[HOLE], 2, |arm| arm.fail_at(0.0, drift));
        assert!(
            matches!(&all[0].ending, Ending::Stopped(ProbeError::Drifts { per_s, .. }) if (0.15..0.25).contains(per_s)),
            "{}",
            all[0].ending
        );
    }
}
