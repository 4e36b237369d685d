//! State shared by the arm thread and the others.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::ros::locked;
use crate::ros::messages::TriggerResponse;
use crate::ros::stop::StopState;
use touchup_probing::arm::{ArmError, ArmState, Safety};
use touchup_probing::execute::RobotCell;

/// State shared by the arm thread and the others.
#[derive(Debug)]
pub struct SharedArmState {
    is_busy: AtomicBool,
    /// stop state
    pub stops: Arc<StopState>,
    seen: Mutex<StateSeen>,
}

#[derive(Clone, Debug, Default)]
struct StateSeen {
    last: Option<ArmState>,
    fault: Option<String>,
    /// reason of the last stop, until acknowledged
    stop: Option<String>,
}

impl SharedArmState {
    /// Before the first state.
    pub fn new(stops: Arc<StopState>) -> Self {
        Self {
            is_busy: AtomicBool::new(false),
            stops,
            seen: Mutex::default(),
        }
    }

    /// Takes up an order; returns whether no other order is active.
    pub fn begin(&self) -> bool {
        !self.is_busy.swap(true, Ordering::AcqRel)
    }

    /// Marks the order as done.
    pub fn done(&self) {
        self.is_busy.store(false, Ordering::Release);
    }

    /// Handles a state; a reported stop latches until acknowledged, even if nobody moved the arm.
    pub fn see(&self, state: &ArmState) {
        let mut seen = locked(&self.seen);
        (seen.last, seen.fault) = (Some(*state), None);
        if state.safety != Safety::Normal {
            seen.stop.get_or_insert_with(|| state.safety.to_string());
        }
    }

    /// The last state.
    pub fn last(&self) -> Option<ArmState> {
        locked(&self.seen).last
    }

    /// Notes a missing state; returns whether that is new.
    pub fn miss(&self, error: &ArmError) -> bool {
        let mut seen = locked(&self.seen);
        use ArmError::{
            Client, Disobeys, GoesOn, Ignores, ProgramEnded, ProgramHangs, ProgramPaused, Stopped,
        };
        if let Stopped { .. }
        | ProgramEnded
        | ProgramPaused
        | ProgramHangs { .. }
        | Disobeys { .. }
        | Ignores { .. }
        | GoesOn { .. }
        | Client { .. } = error
        {
            seen.stop.get_or_insert_with(|| error.to_string());
        }
        seen.fault.replace(error.to_string()).is_none()
    }

    /// Notes a stop of the arm during motion.
    pub fn stop(&self, why: &str) {
        locked(&self.seen).stop = Some(why.to_owned());
    }

    /// Acknowledges stop and fault.
    pub fn recovered(&self) {
        let mut seen = locked(&self.seen);
        (seen.stop, seen.fault) = (None, None);
    }

    /// Whether the arm can move.
    ///
    /// # Errors
    /// The reason against it, in words.
    pub fn ready(&self) -> Result<(), String> {
        self.stops.ready()?;
        let seen = locked(&self.seen);
        match (&seen.fault, &seen.stop, seen.last.map(|state| state.safety)) {
            (Some(error), ..) => Err(error.clone()),
            (None, _, Some(safety)) if safety != Safety::Normal => Err(safety.to_string()),
            (None, Some(stop), _) => Err(format!(
                "the arm is stopped since this: {stop}; look, then call ~/recover"
            )),
            (None, None, Some(_)) => Ok(()),
            (None, None, None) => Err("nothing has come from the arm yet".to_owned()),
        }
    }

    /// `~/arm_state`
    pub fn state(&self, cell: &RobotCell) -> TriggerResponse {
        let ready = self.ready();
        let work = if self.is_busy.load(Ordering::Acquire) {
            "it works at an order"
        } else {
            "it waits for an order"
        };
        let words = ready.clone().map_or_else(|why| why, |()| work.to_owned());
        let place = self.last().map(|state| cell.place(&state.pose_bt) * 1e3);
        let place = place.map(|at| {
            format!(
                "; tip at ({:.1} {:.1} {:.1}) mm in the object",
                at.x, at.y, at.z
            )
        });
        TriggerResponse {
            success: ready.is_ok(),
            message: words + &place.unwrap_or_default(),
        }
    }
}
