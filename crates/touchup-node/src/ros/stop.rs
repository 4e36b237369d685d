//! Stop state of the node's arm and of the samples.
//!
//! A stop request acts here, on the receiving thread; the arm thread reads it after each of its
//! states. So a stop waits for no queue and for no other thread: it acts within one period of the
//! arm, and the answer goes out at once. The table of events is in docs/ros.md.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::ros::locked;
use crate::ros::messages::{ProbeResult, SetBoolResponse, TriggerResponse};
use crate::ros::parameters::{ParameterError, ParameterValue, descriptor};
use touchup_probing::arm::StopRequest;
use touchup_session::clock::Clock;

/// The parameter that only the start of the node can set to true.
pub const ALLOW_MOTION: &str = "allow_motion";
/// Time without a look here after which the arm thread hangs, or its arm blocks it: it looks with
/// each state, some 500 a second, and five times a second without states.
const HANGS: Duration = Duration::from_secs(1);
/// Refusal of an order or a stop without an arm.
pub const NO_ARM: &str = "no arm configured: start the node with robot:=sim or robot:=ur";
/// Remedy if the arm thread does not stop the arm.
const BY_HAND: &str = "if the arm moves, press its emergency stop";

/// Maximum silence of a hold-to-run button; after a longer one the arm stops and stays.
///
/// The arm has to stand within 200 ms of the last beat. It looks here with each state, 2 ms apart,
/// and then brakes as at a fault: a tip of 100 mm/s with 5 m/s² stands 20 ms later
/// (`largest_mm_per_s`, `fault_stop_mm_per_s2`). That leaves 58 ms for late threads and for the
/// link of an arm. The page beats each 20 ms, so the arm goes on if four beats in a row are lost
/// and the next is less than 20 ms late, or if none is lost and one is less than 100 ms late.
pub const LONGEST_BEAT: Duration = Duration::from_millis(120);

/// Current motion of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ArmMotion {
    /// The arm rests.
    #[default]
    Rests,
    /// It moves to a feature, or touches it.
    Moves,
    /// It retracts into free air, at the end or after a stop.
    Retracts,
}

/// State of the arm thread.
#[derive(Clone, Debug, Default)]
enum ArmThread {
    /// There is no thread.
    #[default]
    None,
    /// It runs; time of its last look.
    Runs(Instant),
    /// It has ended; reason.
    Ended(String),
}

#[derive(Debug)]
struct Stops {
    is_ending: bool,
    is_paused: bool,
    may_move: bool,
    /// reason why the arm stays stopped until recovery
    stay: Option<&'static str>,
    /// whether `~/recover` was called after that
    is_recovery_asked: bool,
    motion: ArmMotion,
    thread: ArmThread,
    /// the last beat of a held button, if any
    beat: Option<Instant>,
    /// number of orders that need a held button
    held_orders: u32,
}

impl Stops {
    fn request(&self) -> Option<StopRequest> {
        let retract = self.is_ending || self.is_paused || !self.may_move;
        self.stay
            .map(|_| StopRequest::Stay)
            .or(retract.then_some(StopRequest::Retract))
    }

    /// Whether the arm retracts, by an earlier request or by itself.
    fn goes_back(&self) -> bool {
        self.motion == ArmMotion::Retracts
            || (self.motion == ArmMotion::Moves && self.request().is_some())
    }

    fn stay(&mut self, why: &'static str) {
        (self.stay, self.is_recovery_asked) = (Some(why), false);
    }

    fn is_held(&self, clock: &Clock) -> bool {
        self.beat
            .is_some_and(|beat| clock.since(beat) <= LONGEST_BEAT)
    }

    /// Reason why the arm thread does not respond, if so.
    fn unheard(&self, clock: &Clock) -> Option<String> {
        match &self.thread {
            ArmThread::None => None,
            ArmThread::Runs(looked) => {
                let since = clock.since(*looked);
                let seconds = since.as_secs_f64();
                (since > HANGS).then(|| {
                    format!("nothing has come from the arm's thread for {seconds:.1} s: {BY_HAND}")
                })
            }
            ArmThread::Ended(why) => Some(format!("the arm's thread has ended, {why}: {BY_HAND}")),
        }
    }
}

/// Stop state of the node's arm and of the samples.
#[derive(Debug)]
pub struct StopState {
    clock: Clock,
    stops: Mutex<Stops>,
}

impl StopState {
    /// No stops yet.
    ///
    /// - `clock`: clock for detecting a hanging thread.
    pub fn new(clock: Clock) -> Self {
        let stops = Stops {
            is_ending: false,
            is_paused: false,
            may_move: true,
            stay: None,
            is_recovery_asked: false,
            motion: ArmMotion::Rests,
            thread: ArmThread::None,
            beat: None,
            held_orders: 0,
        };
        Self {
            clock,
            stops: Mutex::new(stops),
        }
    }

    /// `~/pause`: skips samples; a moving arm stops and retracts. Fails if the arm thread does not
    /// respond.
    pub fn pause(&self, is_paused: bool) -> SetBoolResponse {
        let mut stops = locked(&self.stops);
        stops.is_paused = is_paused;
        let words = if is_paused {
            "paused: samples are passed over"
        } else {
            "samples are taken"
        };
        let done = match stops.thread {
            _ if !is_paused => Ok(""),
            ArmThread::None => Ok(""),
            _ => stops
                .unheard(&self.clock)
                .map_or(Ok("; the arm does not move, or stops and retracts"), Err),
        };
        let success = done.is_ok();
        let message = done.map_or_else(
            |why| format!("{words}; but {why}"),
            |arm| words.to_owned() + arm,
        );
        SetBoolResponse { success, message }
    }

    /// Whether samples are skipped.
    pub fn is_paused(&self) -> bool {
        locked(&self.stops).is_paused
    }

    /// `~/stop`: a moving arm stops and stays, even in a retraction; no motion until `~/recover`.
    /// Fails without an arm, or if its thread does not respond.
    pub fn stop(&self) -> TriggerResponse {
        let mut stops = locked(&self.stops);
        stops.stay("~/stop was called");
        let done = match stops.thread {
            ArmThread::None => Err(NO_ARM.to_owned()),
            _ => stops.unheard(&self.clock).map_or(Ok(()), Err),
        };
        let message = done.clone().map_or_else(
            |why| format!("the stop is set; but {why}"),
            |()| "the arm stops and stays where it is: look, then call ~/recover".to_owned(),
        );
        TriggerResponse {
            success: done.is_ok(),
            message,
        }
    }

    /// The parameter `allow_motion`: a moving arm stops and retracts, a retracting one stops and
    /// stays.
    ///
    /// # Errors
    /// [`ParameterError`]: once false it stays false.
    pub fn allow(&self, may_move: &ParameterValue) -> Result<(), ParameterError> {
        let mut stops = locked(&self.stops);
        let now = ParameterValue::Bool(stops.may_move);
        if descriptor(ALLOW_MOTION)?.change(&now, may_move)? == ParameterValue::Bool(false) {
            if stops.goes_back() {
                stops.stay("allow_motion was taken away while the arm retracted");
            }
            stops.may_move = false;
            if let Some(why) = stops.unheard(&self.clock) {
                tracing::error!("allow_motion is false; but {why}");
            }
        }
        Ok(())
    }

    /// Notes a beat of a held button.
    pub fn beat(&self) {
        let now = self.clock.now();
        locked(&self.stops).beat = Some(now);
    }

    /// From here on the arm moves only while the button is held: after a silence longer than
    /// [`LONGEST_BEAT`] it stops and stays, until `~/recover`.
    ///
    /// # Errors
    /// In words, if nobody holds the button.
    pub fn hold_to_run(&self) -> Result<(), String> {
        let mut stops = locked(&self.stops);
        if !stops.is_held(&self.clock) {
            return Err(
                "the arm moves only while the button is held: hold it, then send the order"
                    .to_owned(),
            );
        }
        stops.held_orders += 1;
        Ok(())
    }

    /// Ends an order that needs a held button.
    pub fn end_hold(&self) {
        let mut stops = locked(&self.stops);
        stops.held_orders = stops.held_orders.saturating_sub(1);
    }

    /// State of the arm: whether it may move, its motion, and the reason if it stays stopped;
    /// `None` without an arm.
    pub fn arm(&self) -> Option<(bool, ArmMotion, Option<&'static str>)> {
        let stops = locked(&self.stops);
        (!matches!(stops.thread, ArmThread::None)).then_some((
            stops.may_move,
            stops.motion,
            stops.stay,
        ))
    }

    /// Requests the end of the node: a moving arm stops and retracts; at a second request it stops
    /// and stays. Returns whether the request is new: `false` if there is nothing left to wait for.
    pub fn interrupt(&self) -> bool {
        let mut stops = locked(&self.stops);
        if !stops.is_ending {
            stops.is_ending = true;
            return true;
        }
        let is_new = stops.motion != ArmMotion::Rests && stops.stay.is_none();
        if is_new {
            stops.stay("the end of the node was asked for again");
        }
        is_new
    }

    /// Ends the node, for any reason.
    pub fn end(&self) {
        locked(&self.stops).is_ending = true;
    }

    /// Whether the node ends.
    pub fn is_ending(&self) -> bool {
        locked(&self.stops).is_ending
    }

    /// Notes a call of `~/recover`: it applies to the stops before it.
    pub fn ask_recovery(&self) {
        locked(&self.stops).is_recovery_asked = true;
    }

    /// Clears the stop after acknowledgement: the arm may move again.
    ///
    /// # Errors
    /// In words, if another stop came since.
    pub fn recover(&self) -> Result<(), String> {
        let mut stops = locked(&self.stops);
        match stops.stay {
            Some(why) if !stops.is_recovery_asked => Err(format!(
                "{why} after ~/recover: the arm stays stopped; look, then call ~/recover again"
            )),
            _ => {
                stops.stay = None;
                Ok(())
            }
        }
    }

    /// Notes a look of the arm thread: at its start, and with each state.
    pub fn look(&self) {
        locked(&self.stops).thread = ArmThread::Runs(self.clock.now());
    }

    /// Notes the end of the arm thread. The first reason counts.
    pub fn end_arm(&self, why: &str) {
        let mut stops = locked(&self.stops);
        if let ArmThread::Runs(_) = stops.thread {
            stops.thread = ArmThread::Ended(why.to_owned());
        }
    }

    /// Sets the motion of the arm.
    pub fn enter(&self, motion: ArmMotion) {
        locked(&self.stops).motion = motion;
    }

    /// Requested kind of stop, if any.
    pub fn request(&self) -> Option<StopRequest> {
        let mut stops = locked(&self.stops);
        if stops.held_orders > 0 && !stops.is_held(&self.clock) {
            stops.stay("the button was let go, or its page was lost");
        }
        stops.request()
    }

    /// Reason of this kind of stop, if any: a code of [`ProbeResult`], and words.
    pub fn why(&self, request: StopRequest) -> Option<(u8, &'static str)> {
        let stops = locked(&self.stops);
        if request == StopRequest::Stay {
            return stops.stay.map(|why| (ProbeResult::STOPPED_IN_PLACE, why));
        }
        let reasons = [
            (stops.is_ending, ProbeResult::SHUTDOWN, "the node ends"),
            (stops.is_paused, ProbeResult::PAUSED, "the node is paused"),
            (
                !stops.may_move,
                ProbeResult::MOTION_NOT_ALLOWED,
                "the parameter allow_motion is off",
            ),
        ];
        reasons
            .into_iter()
            .find(|(is_so, ..)| *is_so)
            .map(|(_, code, why)| (code, why))
    }

    /// Whether the arm thread responds.
    ///
    /// # Errors
    /// In words: it hangs or has ended.
    pub fn heard(&self) -> Result<(), String> {
        locked(&self.stops).unheard(&self.clock).map_or(Ok(()), Err)
    }

    /// Whether the arm can move, as far as known here.
    ///
    /// # Errors
    /// In words: it stays stopped, or its thread hangs or has ended.
    pub fn ready(&self) -> Result<(), String> {
        let stops = locked(&self.stops);
        match (stops.unheard(&self.clock), stops.stay) {
            (Some(why), _) => Err(why),
            (None, Some(why)) => Err(format!(
                "the arm is stopped since this: {why}; look, then call ~/recover"
            )),
            (None, None) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answers_say_whether_there_is_an_arm_and_whether_its_thread_hears_them() {
        let (clock, hand) = Clock::manual();
        let state = StopState::new(clock);
        assert!(
            state.pause(true).success
                && !state.stop().success
                && state.stop().message.contains(NO_ARM)
        );
        state.look();
        assert!(state.stop().success && state.pause(true).success && state.heard().is_ok());
        hand.advance(HANGS + Duration::from_millis(500));
        for (success, message) in [
            (state.stop().success, state.stop().message),
            (state.pause(true).success, state.pause(true).message),
            (state.heard().is_ok(), state.heard().unwrap_err()),
            (state.ready().is_ok(), state.ready().unwrap_err()),
        ] {
            assert!(
                !success && message.contains("nothing has come from the arm's thread for 1.5 s"),
                "{message}"
            );
        }
        assert_eq!(
            state.request(),
            Some(StopRequest::Stay),
            "it holds all the same"
        );
        assert!(state.pause(false).success);
        state.look();
        assert!(state.stop().success);
        state.end_arm("at its end");
        state.end_arm("later");
        assert!(
            state.stop().message.contains("has ended, at its end"),
            "{}",
            state.stop().message
        );
    }

    #[test]
    fn an_arm_that_is_held_to_run_stays_as_soon_as_the_beats_end_and_until_it_is_recovered() {
        let (clock, hand) = Clock::manual();
        let state = StopState::new(clock);
        assert!(
            state
                .hold_to_run()
                .unwrap_err()
                .contains("while the button is held")
        );
        state.beat();
        state.hold_to_run().unwrap();
        for _ in 0..100 {
            hand.advance(Duration::from_millis(100));
            state.beat();
            assert_eq!(state.request(), None);
        }
        hand.advance(LONGEST_BEAT);
        assert_eq!(state.request(), None);
        hand.advance(Duration::from_millis(1));
        assert_eq!(state.request(), Some(StopRequest::Stay));
        state.beat();
        assert_eq!(
            state.request(),
            Some(StopRequest::Stay),
            "a late beat moves nothing"
        );
        state.end_hold();
        state.ask_recovery();
        state.recover().unwrap();
        state.hold_to_run().unwrap();
        state.hold_to_run().unwrap();
        // a second, refused order ends only its own hold
        state.end_hold();
        hand.advance(LONGEST_BEAT * 2);
        assert_eq!(state.request(), Some(StopRequest::Stay));
        state.end_hold();
        state.ask_recovery();
        state.recover().unwrap();
        hand.advance(Duration::from_secs(10));
        assert_eq!(state.request(), None, "nobody has to hold it any more");
    }

    #[test]
    fn the_end_is_asked_for_again_only_where_an_arm_moves() {
        let state = StopState::new(Clock::system());
        assert!(state.interrupt() && !state.interrupt());
        state.enter(ArmMotion::Retracts);
        assert_eq!(state.request(), Some(StopRequest::Retract));
        assert!(
            state.interrupt() && !state.interrupt(),
            "the third waits for nothing"
        );
        assert_eq!(state.request(), Some(StopRequest::Stay));
    }
}
