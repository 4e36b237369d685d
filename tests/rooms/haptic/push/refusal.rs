//! Refused samples and settings.

use super::*;
use touchup::haptic::{DynamicsError, GuardParams, RefineError, RoiSize, StepRule};
use touchup::reconstruct::{Patcher, PatcherParams};
use touchup::stylus::{ContactGateParams, SampleError, SlidingParams};

/// Samples that no stylus can have sent after one at `tick`.
fn bad_after(tick: i64) -> Vec<Sample> {
    let good = sample(tick + 1, Point3::new(0.0, 0.0, RADIUS), Vector3::z() * 2.0);
    let mut bad = vec![];
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e9] {
        for axis in 0..3 {
            let mut one = good;
            one.pose_ot.translation.vector[axis] = value;
            bad.push(one);
            let mut one = good;
            one.wrench.force[axis] = value;
            bad.push(one);
            let mut one = good;
            one.wrench.torque[axis] = value;
            bad.push(one);
            let mut one = good;
            one.pose_ot.rotation.as_mut_unchecked().coords[axis] = value;
            bad.push(one);
        }
    }
    let mut no_rotation = good;
    no_rotation
        .pose_ot
        .rotation
        .as_mut_unchecked()
        .coords
        .fill(0.0);
    bad.push(no_rotation);
    // repeated, backward, and the earliest of all
    bad.extend(
        [tick, tick - 1, tick - 1000, i64::MIN / TICK_NS].map(|at| Sample {
            stamp_ns: at * TICK_NS,
            ..good
        }),
    );
    bad
}

#[test]
fn a_refused_sample_changes_nothing_and_the_loop_goes_on() {
    let samples = raster(6e-3, 3, 0.1, &BALL, |_| 2.0);
    let mut plain = Refiner::new(bumpy(2), RefineParams::robust(BALL)).unwrap();
    let mut plagued = plain.clone();
    for (tick, good) in samples.iter().enumerate() {
        let update = plain.push(good).unwrap();
        assert_eq!(plagued.push(good).unwrap(), update);
        if tick % 50 != 0 {
            continue;
        }
        let (before, counts) = (bits(plagued.mesh()), *plagued.counts());
        for bad in bad_after(tick as i64) {
            let refused = plagued.push(&bad).unwrap_err();
            assert!(matches!(refused, RefineError::Sample(_)), "{bad:?}");
            assert_eq!(*plagued.counts(), counts, "{bad:?}");
        }
        assert!(bits(plagued.mesh()) == before);
    }
    assert!(
        bits(plain.mesh()) == bits(plagued.mesh()),
        "nothing hidden was changed either"
    );
    assert_eq!(plain.counts(), plagued.counts());
    assert!(plain.counts().moved > 100);
}

#[test]
fn a_refusal_names_the_cause() {
    let mut refiner = Refiner::new(bumpy(2), RefineParams::robust(BALL)).unwrap();
    let good = sample(5, Point3::new(0.0, 0.0, RADIUS), Vector3::z());
    refiner.push(&good).unwrap();
    let repeated = SampleError::NotAfter {
        stamp_ns: 5 * TICK_NS,
        last_ns: 5 * TICK_NS,
    };
    assert_eq!(refiner.push(&good), Err(repeated.into()));
    let nan = sample(6, Point3::new(0.0, f64::NAN, RADIUS), Vector3::z());
    assert_eq!(
        refiner.push(&nan),
        Err(SampleError::NotFinite {
            what: "position",
            stamp_ns: 6 * TICK_NS
        }
        .into())
    );
}

/// The whole range of stamps: a difference that does not fit is no reason to stop.
#[test]
fn stamps_at_the_ends_of_time_are_taken() {
    let mut refiner = Refiner::new(bumpy(2), RefineParams::robust(BALL)).unwrap();
    for stamp_ns in [i64::MIN, -1, 0, i64::MAX] {
        let centre = Point3::new(0.0, 0.0, RADIUS);
        refiner
            .push(&Sample {
                stamp_ns,
                ..sample(0, centre, Vector3::z() * 2.0)
            })
            .unwrap();
    }
    assert!(
        refiner
            .mesh()
            .positions()
            .iter()
            .all(|p| p.coords.amax() < 0.1)
    );
}

/// By the reconstruction too: ten samples, a millisecond apart up to the last nanosecond, are one
/// stroke.
#[test]
fn touches_at_the_end_of_time_are_taken() {
    let mut refiner = Refiner::new(bumpy(2), RefineParams::robust(BALL)).unwrap();
    let mut patcher =
        Patcher::new(PatcherParams::new(BALL.radius, BALL.stiffness, 0.05e-3)).unwrap();
    for ago in (0..10).rev() {
        let stamp_ns = i64::MAX - ago * TICK_NS;
        refiner
            .push(&Sample {
                stamp_ns,
                ..sample(0, Point3::new(0.0, 0.0, RADIUS), Vector3::z() * 2.0)
            })
            .unwrap();
        patcher.push(refiner.contacts().latest().unwrap());
    }
    patcher.flush();
    assert_eq!(patcher.strokes(), 1);
    assert!(!patcher.probed().is_empty());
}

/// A solver that gives up refuses the sample as well: mesh and counts stay.
#[test]
fn a_step_that_fails_is_a_refused_sample() {
    let tip = TipParams {
        stiffness: None,
        ..BALL
    };
    let mut params = RefineParams {
        carve: None,
        ..RefineParams::robust(tip)
    };
    params.dynamics.rule = StepRule::DormandPrince;
    params.dynamics.alpha_m_per_n_s = 1e9;
    let mut refiner = Refiner::new(grid(15, EDGE, |_, _| 0.0), params).unwrap();
    let at = |tick| {
        sample(
            tick,
            Point3::new(0.3e-3, 0.2e-3, RADIUS + 0.2e-3),
            Vector3::z() * 2.0,
        )
    };
    // the first has no time to act in
    refiner.push(&at(0)).unwrap();
    let (before, counts) = (bits(refiner.mesh()), *refiner.counts());
    let refused = refiner.push(&at(1)).unwrap_err();
    assert!(
        matches!(refused, RefineError::Dynamics(DynamicsError::Stiff { .. })),
        "{refused}"
    );
    assert!(bits(refiner.mesh()) == before);
    assert_eq!(*refiner.counts(), counts);
}

type Change = fn(&mut RefineParams, f64);

/// Settings, by name.
const CHANGES: [(&str, Change); 25] = [
    ("tip radius", |p, x| p.tip.radius = x),
    ("tip stiffness", |p, x| p.tip.stiffness = Some(x)),
    ("scan noise", |p, x| p.scan_noise = x),
    ("longest step", |p, x| p.longest_step_edges = x),
    ("largest move in edges", |p, x| p.largest_move_edges = x),
    ("largest move in noises", |p, x| p.largest_move_noises = x),
    ("turning", |p, x| p.turning = Some(x)),
    ("radius of the region", |p, x| p.roi = RoiSize::Radius(x)),
    ("contact on", |p, x| {
        p.gate = Some(ContactGateParams {
            on: x,
            ..Default::default()
        })
    }),
    ("contact off", |p, x| {
        p.gate = Some(ContactGateParams {
            off: x,
            ..Default::default()
        })
    }),
    ("smoothing", |p, x| {
        p.sliding = Some(SlidingParams {
            smoothing: x,
            ..Default::default()
        })
    }),
    ("velocity smoothing", |p, x| {
        p.sliding = Some(SlidingParams {
            velocity_smoothing: x,
            ..Default::default()
        })
    }),
    ("slowest", |p, x| {
        p.sliding = Some(SlidingParams {
            slowest: x,
            ..Default::default()
        })
    }),
    ("cone cosine", |p, x| {
        p.sliding = Some(SlidingParams {
            cone_cosine: 2.0 * x,
            ..Default::default()
        })
    }),
    ("carving rate", |p, x| {
        p.carve = Some(CarveParams {
            rate: x,
            ..Default::default()
        })
    }),
    ("carving tolerance", |p, x| {
        p.carve = Some(CarveParams {
            tolerance: x,
            ..Default::default()
        })
    }),
    ("carving in contact", |p, x| {
        p.carve = Some(CarveParams {
            contact_tolerance: x,
            ..Default::default()
        })
    }),
    ("contact cosine", |p, x| p.smallest_contact_cosine = 2.0 * x),
    ("alpha", |p, x| p.dynamics.alpha_m_per_n_s = x),
    ("beta", |p, x| p.dynamics.beta_per_n2_s = x),
    ("quality", |p, x| {
        p.guard = Some(GuardParams {
            smallest_quality: x,
            ..Default::default()
        })
    }),
    ("turn cosine", |p, x| {
        p.guard = Some(GuardParams {
            smallest_turn_cosine: 2.0 * x,
            ..Default::default()
        })
    }),
    ("evidence cosine", |p, x| {
        p.guard = Some(GuardParams {
            smallest_evidence_cosine: 2.0 * x,
            ..Default::default()
        })
    }),
    ("fold cosine", |p, x| {
        p.guard = Some(GuardParams {
            smallest_fold_cosine: 2.0 * x,
            ..Default::default()
        })
    }),
    ("gap", |p, x| {
        p.guard = Some(GuardParams {
            gap_share: x,
            ..Default::default()
        })
    }),
];

/// Each setting with a value that has no meaning, by name.
#[test]
fn settings_without_a_meaning_are_refused() {
    let anywhere_bad = [f64::NAN, f64::INFINITY, -1.0];
    let mut taken = vec![];
    for (name, change) in CHANGES {
        for value in anywhere_bad {
            let mut params = RefineParams::robust(BALL);
            change(&mut params, value);
            if Refiner::new(bumpy(0), params).is_ok() {
                taken.push(format!("{name} {value}"));
            }
        }
    }
    assert!(taken.is_empty(), "taken: {}", taken.join(", "));
    for params in [RefineParams::robust(BALL), RefineParams::paper(BALL)] {
        Refiner::new(bumpy(0), params).unwrap();
    }
}

#[test]
fn a_mesh_without_faces_is_refused() {
    let empty = TriMesh::new(vec![Point3::origin()], vec![]).unwrap();
    assert!(matches!(
        Refiner::new(empty, RefineParams::robust(BALL)),
        Err(RefineError::Mesh(_))
    ));
}
