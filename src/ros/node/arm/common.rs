//! What the thread of the arm and the others know of each other.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::probing::arm::{ArmError, ArmState, Safety};
use crate::probing::execute::Cell;
use crate::ros::locked;
use crate::ros::messages::{ProbeResult, TriggerResponse};

/// Read and written by any thread.
#[derive(Debug, Default)]
pub struct Common {
    is_busy: AtomicBool,
    is_ending: AtomicBool,
    is_paused: AtomicBool,
    has_motion: AtomicBool,
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
    /// Takes up an order; whether no other is worked at.
    pub fn begin(&self) -> bool {
        !self.is_busy.swap(true, Ordering::AcqRel)
    }

    /// The order is done.
    pub fn done(&self) {
        self.is_busy.store(false, Ordering::Release);
    }

    /// The node ends: the arm stops, retracts, and takes nothing up any more.
    pub fn end(&self) {
        self.is_ending.store(true, Ordering::Release);
    }

    /// Whether it does.
    pub fn is_ending(&self) -> bool {
        self.is_ending.load(Ordering::Acquire)
    }

    /// `~/pause`: what moves stops and retracts.
    pub fn pause(&self, is_paused: bool) {
        self.is_paused.store(is_paused, Ordering::Release);
    }

    /// The parameter `allow_motion`: where it is taken away, what moves stops and retracts.
    pub fn allow_motion(&self, is_allowed: bool) {
        self.has_motion.store(is_allowed, Ordering::Release);
    }

    /// Why the arm may not move now: a code of [`ProbeResult`], and in words.
    pub fn why_not(&self) -> Option<(u8, &'static str)> {
        if self.is_ending() {
            Some((ProbeResult::SHUTDOWN, "the node ends"))
        } else if self.is_paused.load(Ordering::Acquire) {
            Some((ProbeResult::PAUSED, "the node is paused"))
        } else if !self.has_motion.load(Ordering::Acquire) {
            Some((ProbeResult::MOTION_NOT_ALLOWED, "the parameter allow_motion is off"))
        } else {
            None
        }
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
        if let ArmError::Stopped { .. } | ArmError::ProgramEnded | ArmError::Client { .. } = error {
            seen.stop.get_or_insert_with(|| error.to_string());
        }
        seen.fault.replace(error.to_string()).is_none()
    }

    /// None will come.
    pub fn fail(&self, why: &str) {
        locked(&self.seen).fault = Some(why.to_owned());
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
        let seen = locked(&self.seen);
        match (&seen.fault, &seen.stop, seen.last.map(|state| state.safety)) {
            (Some(error), ..) => Err(error.clone()),
            (None, _, Some(safety)) if safety != Safety::Normal => Err(safety.to_string()),
            (None, Some(stop), _) => Err(format!("the arm is stopped since this: {stop}; look, then call ~/recover")),
            (None, None, Some(_)) => Ok(()),
            (None, None, None) => Err("nothing has come from the arm yet".to_owned()),
        }
    }

    /// `~/arm_state`
    pub fn state(&self, cell: &Cell) -> TriggerResponse {
        let ready = self.ready();
        let work = if self.is_busy.load(Ordering::Acquire) { "it works at an order" } else { "it waits for an order" };
        let words = ready.clone().map_or_else(|why| why, |()| work.to_owned());
        let place = self.last().map(|state| cell.place(&state.pose_bt) * 1e3);
        let place = place.map(|at| format!("; tip at ({:.1} {:.1} {:.1}) mm in the object", at.x, at.y, at.z));
        TriggerResponse { success: ready.is_ok(), message: words + &place.unwrap_or_default() }
    }
}
