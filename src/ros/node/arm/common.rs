//! What the thread of the arm and the others know of each other.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::probing::arm::{ArmError, ArmState, Safety};
use crate::probing::execute::Cell;
use crate::ros::locked;
use crate::ros::messages::TriggerResponse;
use crate::ros::stop::StopState;

/// Read and written by any thread.
#[derive(Debug)]
pub struct Common {
    is_busy: AtomicBool,
    /// what stops it
    pub stops: Arc<StopState>,
    seen: Mutex<StateSeen>,
}

#[derive(Clone, Debug, Default)]
struct StateSeen {
    last: Option<ArmState>,
    fault: Option<String>,
    /// what it was stopped by, until somebody has looked and says so
    stop: Option<String>,
}

impl Common {
    /// Nothing is known yet.
    pub fn new(stops: Arc<StopState>) -> Self {
        Self {
            is_busy: AtomicBool::new(false),
            stops,
            seen: Mutex::default(),
        }
    }

    /// Takes up an order; whether no other is worked at.
    pub fn begin(&self) -> bool {
        !self.is_busy.swap(true, Ordering::AcqRel)
    }

    /// The order is done.
    pub fn done(&self) {
        self.is_busy.store(false, Ordering::Release);
    }

    /// A state came. A stop in it is one until somebody has looked, also when nobody moved the arm.
    pub fn see(&self, state: &ArmState) {
        let mut seen = locked(&self.seen);
        (seen.last, seen.fault) = (Some(*state), None);
        if state.safety != Safety::Normal {
            seen.stop.get_or_insert_with(|| state.safety.to_string());
        }
    }

    /// The last one.
    pub fn last(&self) -> Option<ArmState> {
        locked(&self.seen).last
    }

    /// None came; whether that is new.
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

    /// The arm was stopped while it moved.
    pub fn stop(&self, why: &str) {
        locked(&self.seen).stop = Some(why.to_owned());
    }

    /// Somebody has looked.
    pub fn recovered(&self) {
        let mut seen = locked(&self.seen);
        (seen.stop, seen.fault) = (None, None);
    }

    /// Why it cannot be sent anywhere, when it cannot.
    ///
    /// # Errors
    /// In words.
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
    pub fn state(&self, cell: &Cell) -> TriggerResponse {
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
