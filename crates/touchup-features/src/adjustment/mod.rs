//! One least-squares adjustment of a session: the surfaces of the part together with what the
//! session is made with, from its contacts alone.
//!
//! A press on a surface with signed distance d, whose recorded centre p and turn R of the stylus
//! were taken with a ball that is o off its assumed place in T and sinks by κ F:
//!
//! d(p + R o + κ F) = r
//!
//! The surfaces, κ and o are unknowns of one robust problem, as in a self-calibrating bundle
//! (Brown 1971; Triggs et al. 2000). The scan is no part of it. A plane takes up any o in whose
//! direction the stylus does not turn: what the presses do not determine stays as uncertain as
//! before them.
//!
//! While the session lasts the part may move, or the tip bend, at once or slowly: places that were
//! touched before and after show it. Each such change at each of some times is one more set of
//! unknowns, and the alternatives compete by their likelihood, each with a price for its unknowns
//! (Schwarz 1978).
//!
//! The forces of presses that slide over these surfaces show the sensor: what turns them, their
//! gains, their zero and a weight in them.

mod along_time;
mod force_adjustment;
mod force_fault;
mod grouped_scores;
mod merged;
mod numbers;
mod placed_press;
mod pressed_surface;
mod problem;
mod recorded_press;
mod session_adjustment;
mod session_change;

pub(crate) use force_adjustment::ForceAdjustment;
pub(crate) use force_fault::{FaultNumbers, ForceFault, without_trace};
pub(crate) use numbers::SessionNumbers;
pub(crate) use recorded_press::RecordedPress;
pub(crate) use session_adjustment::{LikelyChange, SessionAdjustment};
pub(crate) use session_change::ChangeCause;

#[cfg(test)]
mod force_tests;
#[cfg(test)]
mod tests;
