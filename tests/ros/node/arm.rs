//! The node with an arm, without any network: flagged, probed, shown, cancelled, refused.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use touchup::clock::Clock;
use touchup::node::ArmKind;
use touchup::probing::arm::{Arm, ArmError, ArmState, Command, Safety};
use touchup::ros::messages::{
    Feature, ProbeFeatureRequest, ProbeResult, ProbeSettings, ProbeTouch,
};
use touchup::ros::parameters::ParameterValue;
use touchup::ros::port::{ArmOrder, Arrival, Call, GoalEnd, Publication};

use super::cell::{Cell, HUNG, SimulatedArm};

/// Of a plane one raster: planned, made, and published.
#[test]
#[ignore = "a slow proof"]
fn what_was_found_is_slid_over_where_that_is_asked_for() {
    let cell = Cell::start(true);
    let id = cell.flag(Feature::KIND_PLANE, [45.0, 9.0, 12.0]);
    let slide = ProbeSettings {
        pattern: ProbeSettings::PATTERN_SLIDE,
        ..ProbeSettings::default()
    };
    let planned = cell.probe(
        id,
        ProbeSettings {
            dry_run: true,
            ..slide
        },
    );
    assert!(
        planned.code == ProbeResult::PLANNED && planned.message.contains("and 1 slides"),
        "{}",
        planned.message
    );
    let result = cell.probe(id, slide);
    assert_eq!(
        result.code,
        ProbeResult::TOLERANCE_REACHED,
        "{}",
        result.message
    );
    assert!(
        result
            .message
            .contains("1 of 1 slides arrived; check of the arm: none: robot.check"),
        "{}",
        result.message
    );
    // to and fro over a disc with a radius of 3 mm, 1.5 mm apart, at 10 mm/s
    assert!(
        result.duration > 2.0 && result.max_force < 4.5,
        "{} s, {} N",
        result.duration,
        result.max_force
    );
    cell.end();
}

/// The through hole of the plate, Ø 8 mm at (16, 36, 12), invisible in the scan; the mesh follows
/// by the topics.
#[test]
#[expect(clippy::too_many_lines)]
fn a_flagged_hole_is_probed_and_shown() {
    let cell = Cell::start(true);
    let id = cell.flag(Feature::KIND_HOLE, [17.5, 34.8, 12.0]);
    let planned = cell.probe(
        id,
        ProbeSettings {
            dry_run: true,
            ..ProbeSettings::default()
        },
    );
    assert_eq!(planned.code, ProbeResult::PLANNED, "{}", planned.message);
    let result = cell.probe(id, ProbeSettings::default());
    assert_eq!(
        result.code,
        ProbeResult::TOLERANCE_REACHED,
        "{}",
        result.message
    );
    let hole = &result.feature;
    assert_eq!(
        (hole.id, hole.kind, hole.status),
        (id, Feature::KIND_HOLE, Feature::STATUS_PROBED)
    );
    let off = (hole.center.x - 16e-3).hypot(hole.center.y - 36e-3);
    let (end, published) = cell.end();
    let touches = published
        .iter()
        .filter_map(|publication| match publication {
            Publication::ProbeTouch(touch) => Some(touch),
            _ => None,
        });
    let touches: Vec<_> = touches.collect();
    let results = published
        .iter()
        .filter_map(|publication| match publication {
            Publication::ProbeResult(result) => Some((result.code, result.touch_count as usize)),
            _ => None,
        });
    // results of the dry run and of the probing, as in the answers
    assert_eq!(
        results.collect::<Vec<_>>(),
        [(planned.code, 0), (result.code, touches.len())]
    );
    assert_eq!(result.touch_count as usize, touches.len());
    let numbered =
        |(index, touch): (usize, &&ProbeTouch)| (touch.id, touch.index as usize) == (id, index);
    assert!(touches.iter().enumerate().all(numbered));
    assert!(
        touches
            .iter()
            .all(|touch| touch.header.frame_id == "object")
    );
    println!(
        "{} touches, {:.0} s, {:.1} N, place {:.1} um, diameter {:+.1} um",
        touches.len(),
        result.duration,
        result.max_force,
        off * 1e6,
        (hole.diameter - 8e-3) * 1e6
    );
    assert!(off < 50e-6 && (hole.diameter - 8e-3).abs() < 50e-6);
    assert!(touches.len() < 40 && result.max_force < 4.5);
    let felt = touches.iter().filter(|touch| touch.contact.x.is_finite());
    assert!(felt.clone().count() > 8 && felt.clone().all(|touch| !touch.curve_force.is_empty()));
    // a touch of the wall lies on it: 4 mm from the axis
    let wall = felt.filter(|touch| touch.approach.z.abs() < 0.5);
    assert!(wall.clone().count() >= 8);
    let far = |touch: &&ProbeTouch| (touch.contact.x - 16e-3).hypot(touch.contact.y - 36e-3);
    assert!(
        wall.clone().all(|touch| (far(touch) - 4e-3).abs() < 0.3e-3),
        "{:?}",
        wall.map(far).collect::<Vec<_>>()
    );

    assert!(end.report.accepted > 5000, "{:?}", end.report);
    let last = published
        .iter()
        .rev()
        .find_map(|publication| match publication {
            Publication::Features(features) => features
                .features
                .iter()
                .find(|feature| feature.id == id)
                .cloned(),
            _ => None,
        });
    assert_eq!(last.unwrap().status, Feature::STATUS_PROBED);
    assert!(published.iter().any(
        |publication| matches!(publication, Publication::Path(path) if path.poses.len() > 10)
    ));
}

#[test]
fn a_cancelled_goal_stops_and_retracts_and_the_node_goes_on() {
    let cell = Cell::start(true);
    let ids = [
        cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]),
        cell.flag(Feature::KIND_HOLE, [32.0, 34.5, 12.0]),
    ];
    let (world, (to, busy)) = (cell.world.clone(), sync_channel(1));
    let (end, response) = cell.goal(&ids, move |cancel| {
        let request = ProbeFeatureRequest {
            id: ids[1],
            settings: ProbeSettings::default(),
        };
        to.send(
            world
                .call(|reply| Call::Arm(ArmOrder::Feature(request, reply)))
                .recv()
                .unwrap()
                .result,
        )
        .unwrap();
        cancel.store(true, Ordering::Release);
    });
    let busy = busy.recv().unwrap();
    assert_eq!(busy.code, ProbeResult::BUSY, "{}", busy.message);
    assert_eq!(
        (end, response.code),
        (GoalEnd::Canceled, ProbeResult::CANCELLED),
        "{}",
        response.message
    );
    assert_eq!(
        (response.ids, response.codes),
        (vec![ids[0]], vec![ProbeResult::CANCELLED]),
        "the other is not begun"
    );
    let (can_move, state) = cell.state();
    assert!(can_move, "{state}");
    assert!(cell.height() > 14.0, "it retracted: {state}");
    cell.end();
}

#[test]
#[expect(clippy::too_many_lines)]
fn orders_that_must_not_be_are_refused_and_nothing_moves() {
    let cell = Cell::start(false);
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    let at = cell.state().1;
    let refused = |id: u32, settings: ProbeSettings| cell.probe(id, settings).code;
    assert_eq!(
        refused(id, ProbeSettings::default()),
        ProbeResult::MOTION_NOT_ALLOWED
    );
    assert_eq!(
        refused(id + 100, ProbeSettings::default()),
        ProbeResult::NO_SUCH_FEATURE
    );
    for bad in [
        ProbeSettings {
            max_force: 1e3,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            max_force: -1.0,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            max_link_speed: f64::NAN,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            quantity: ProbeSettings::QUANTITY_WIDTH,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            quantity: 77,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            max_touches: 1000,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            tolerance: -1.0,
            ..ProbeSettings::default()
        },
        ProbeSettings {
            confidence: 2.0,
            ..ProbeSettings::default()
        },
    ] {
        let result = cell.probe(id, bad);
        assert_eq!(
            result.code,
            ProbeResult::BAD_REQUEST,
            "{bad:?}: {}",
            result.message
        );
    }
    let all = cell
        .world
        .call(|reply| Call::Arm(ArmOrder::All(reply)))
        .recv()
        .unwrap();
    assert!(
        !all.success && all.message.contains("allow_motion"),
        "{}",
        all.message
    );
    assert!(
        cell.world
            .call(|reply| Call::Arm(ArmOrder::Recover(reply)))
            .recv()
            .unwrap()
            .success
    );
    let numbers = |text: &str| -> Vec<f64> {
        text.split([' ', '(', ')'])
            .filter_map(|word| word.parse().ok())
            .collect()
    };
    let (before, after) = (numbers(&at), numbers(&cell.state().1));
    assert_eq!((before.len(), after.len()), (3, 3), "{at}");
    assert!(
        before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 0.2),
        "it moved: {before:?} {after:?}"
    );
    cell.end();
}

/// A pause, and motion that is no longer allowed, keep it from moving; only a pause ends while the
/// node runs.
#[test]
fn a_paused_arm_moves_again_and_one_that_may_not_move_needs_a_start() {
    let cell = Cell::start(true);
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    let code = || {
        cell.probe(
            id,
            ProbeSettings {
                max_touches: 3,
                ..ProbeSettings::default()
            },
        )
        .code
    };
    let allow = |may| {
        let set = |reply| {
            Arrival::SetParameter("allow_motion".to_owned(), ParameterValue::Bool(may), reply)
        };
        cell.world.ask(set).recv().unwrap()
    };
    assert!(cell.world.stops().pause(true).success);
    assert_eq!(code(), ProbeResult::PAUSED);
    let all = cell
        .world
        .call(|reply| Call::Arm(ArmOrder::All(reply)))
        .recv()
        .unwrap();
    assert!(!all.success, "{}", all.message);
    assert!(cell.world.stops().pause(false).success);
    // three touches find no hole
    assert_eq!(code(), ProbeResult::NOTHING_FOUND);
    allow(false).unwrap();
    let why = allow(true).unwrap_err();
    assert!(
        why.contains("start it again") && why.contains("scene"),
        "{why}"
    );
    assert_eq!(code(), ProbeResult::MOTION_NOT_ALLOWED);
    cell.end();
    // a node started with `allow_motion` off
    let cell = Cell::start(false);
    let set =
        |reply| Arrival::SetParameter("allow_motion".to_owned(), ParameterValue::Bool(true), reply);
    assert!(
        cell.world
            .ask(set)
            .recv()
            .unwrap()
            .unwrap_err()
            .contains("start it again")
    );
    cell.end();
}

/// An arm that stops by itself, even without a motion, stands until an operator has looked and says
/// so.
#[test]
fn a_stop_stands_until_it_is_recovered() {
    let (says, said) = sync_channel(1);
    let cell = Cell::with(true, |clock| {
        ArmKind::Real(Box::new(Stopping::new(said, clock)))
    });
    let id = cell.flag(Feature::KIND_HOLE, [16.5, 36.0, 12.0]);
    // returns when the node has seen a state of it
    let say = |safety| {
        let (seen, is_seen) = sync_channel(1);
        says.send((safety, seen)).unwrap();
        is_seen.recv_timeout(HUNG).unwrap();
    };
    let stop = says.clone();
    let (end, response) = cell.goal(&[id], move |_| {
        stop.send((Safety::ProtectiveStop, sync_channel(1).0))
            .unwrap()
    });
    assert_eq!(
        (end, response.code),
        (GoalEnd::Aborted, ProbeResult::PROTECTIVE_STOP),
        "{}",
        response.message
    );
    for _ in 0..2 {
        // a person frees it at its panel, and does not say so
        say(Safety::Normal);
        let (can_move, why) = cell.state();
        assert!(!can_move && why.contains("~/recover"), "{why}");
        assert_eq!(
            cell.probe(id, ProbeSettings::default()).code,
            ProbeResult::ARM_NOT_READY
        );
        assert!(
            cell.world
                .call(|reply| Call::Arm(ArmOrder::Recover(reply)))
                .recv()
                .unwrap()
                .success
        );
        say(Safety::Normal);
        let (can_move, why) = cell.state();
        assert!(can_move, "{why}");
        // the same when it stood still
        say(Safety::ProtectiveStop);
        assert!(!cell.state().0);
    }
    cell.end();
}

/// A simulated arm whose safety system has the state that the test sets.
struct Stopping {
    arm: SimulatedArm,
    said: Receiver<(Safety, SyncSender<()>)>,
    safety: Safety,
    /// a message when the node has taken the last state
    seen: Option<SyncSender<()>>,
}

impl Stopping {
    fn new(said: Receiver<(Safety, SyncSender<()>)>, clock: &Clock) -> Self {
        Self {
            arm: SimulatedArm::new(clock),
            said,
            safety: Safety::Normal,
            seen: None,
        }
    }
}

impl Arm for Stopping {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        if let Some(seen) = self.seen.take() {
            // who said it need not wait
            let _ = seen.send(());
        }
        if let Ok((safety, seen)) = self.said.try_recv() {
            (self.safety, self.seen) = (safety, Some(seen));
        }
        let state = self.arm.next_state()?;
        Ok(ArmState {
            safety: if self.safety == Safety::Normal {
                state.safety
            } else {
                self.safety
            },
            ..state
        })
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.arm.command(command)
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        self.arm.zero_sensor()
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        self.arm.recover()
    }

    fn period(&self) -> f64 {
        self.arm.period()
    }
}
