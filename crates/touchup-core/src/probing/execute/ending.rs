//! How the probing of a feature ended, and all that was measured.

use std::error::Error;

use nalgebra::Point3;

use super::links::LinkError;
use crate::probing::arm::{LimitError, ProbeError, SlideRecord, StopRequest, TouchRecord};
use crate::probing::plan::{DecidedCharacteristic, ExploreError, Found, Slide, TouchPlan};

/// How it ended; as an error, why it ended before all was done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Ending {
    /// The number has the requested uncertainty.
    #[error("tolerance reached")]
    ToleranceReached,
    /// The touches are spent; it is as good as they made it.
    #[error("tolerance not reached: the touches are spent")]
    TouchesSpent,
    /// More touches would not help.
    #[error(
        "tolerance not reached: what radius of the ball, place of the part and kinematics leave uncertain is in all touches alike, and \
         with it the number is {over:.1} times as uncertain as asked for: calibrate them, or ask for less"
    )]
    CalibrationLimits {
        /// standard uncertainty over the requested one
        over: f64,
    },
    /// Each characteristic passes or fails.
    #[error("decided")]
    Decided,
    /// The touches are spent before that.
    #[error(
        "undecided: the touches are spent, and {names} may still pass or fail: allow more touches, or agree on other limits"
    )]
    Undecided {
        /// of what is open
        names: String,
    },
    /// More touches would not help.
    #[error(
        "undecided: what radius of the ball, place of the part and kinematics leave uncertain is in all touches alike, and leaves {names} \
         open however often it is touched: calibrate them, or agree on other limits"
    )]
    Undecidable {
        /// of what is open
        names: String,
    },
    /// The time is spent.
    #[error("tolerance not reached: the time is spent")]
    TimeSpent,
    /// There is no such feature where it was searched.
    #[error("nothing found: {0}")]
    NothingFound(#[from] ExploreError),
    /// A request stopped it.
    #[error("cancelled: {0}")]
    Cancelled(StopRequest),
    /// The arm did not move: it would leave its limits.
    #[error("not begun: {0}")]
    OutOfLimits(#[from] LimitError),
    /// The arm did not move: no path is clear of the mesh.
    #[error("not begun: {0}")]
    NoClearPath(#[from] LinkError),
    /// The arm stopped.
    #[error("stopped: {0}")]
    Stopped(#[source] ProbeError),
}

impl From<ProbeError> for Ending {
    fn from(error: ProbeError) -> Self {
        match error {
            ProbeError::Cancelled { request, .. } => Self::Cancelled(request),
            error => Self::Stopped(error),
        }
    }
}

impl Ending {
    /// Where a decision was the goal.
    pub(super) fn of_decisions(characteristics: &[DecidedCharacteristic]) -> Self {
        let names = |is_it: fn(&DecidedCharacteristic) -> bool| {
            let named = characteristics
                .iter()
                .filter(|one| is_it(one))
                .map(|one| one.sought.name.as_str());
            named.collect::<Vec<_>>().join(", ")
        };
        let (open, limited) = (
            names(DecidedCharacteristic::is_open),
            names(|one| one.is_limited),
        );
        match (open.is_empty(), limited.is_empty()) {
            (true, true) => Self::Decided,
            (true, false) => Self::Undecidable { names: limited },
            (false, _) => Self::Undecided { names: open },
        }
    }

    /// Whether tip, part or arm are not where they were: which of the touches hold is not known.
    pub fn is_displaced(&self) -> bool {
        matches!(self, Self::Stopped(ProbeError::Displaced { .. }))
    }

    /// The reason alone.
    pub(super) fn why(&self) -> String {
        self.source()
            .map_or_else(|| self.to_string(), ToString::to_string)
    }

    /// Whether only this touch or slide cannot be made.
    pub(super) fn is_of_one(&self) -> bool {
        use Ending::{NoClearPath, OutOfLimits, Stopped};
        matches!(
            self,
            OutOfLimits(_) | NoClearPath(_) | Stopped(ProbeError::Obstacle { is_link: false, .. })
        )
    }
}

/// One touch of a probing.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbedTouch {
    /// as planned, in O
    pub planned: TouchPlan,
    /// as measured; `None` when the arm was held back before
    pub record: Option<TouchRecord>,
    /// centre of the ball at contact, m in O
    pub centre: Option<Point3<f64>>,
    /// of the contact from the mesh as it was before, m, positive outside
    pub deviation: Option<f64>,
    /// why it does not count; `None`: it does
    pub refused: Option<String>,
}

/// One slide of a probing.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbedSlide {
    /// as planned, in O
    pub slide: Slide,
    /// as measured; `None` when the arm was held back before
    pub record: Option<SlideRecord>,
    /// why it was not made; `None`: it was
    pub refused: Option<String>,
}

/// A reference that the arm touched again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceTouch {
    /// number of the feature that it belongs to
    pub flag: u32,
    /// which touch of that feature, from 0 on
    pub index: usize,
    /// how much farther along its search it is than it was, m
    pub off: f64,
    /// standard uncertainty of that, m
    pub sigma: f64,
}

/// The result of a flag.
#[derive(Clone, Debug)]
pub struct Probed {
    /// its number
    pub flag: u32,
    /// how it ended
    pub ending: Ending,
    /// what was found, also where it ended early
    pub found: Option<Found>,
    /// all touches, in their order
    pub touches: Vec<ProbedTouch>,
    /// and the slides after them
    pub slides: Vec<ProbedSlide>,
    /// the contacts that were touched again last, none of which had moved
    pub references: Vec<ReferenceTouch>,
    /// so many of the touches were made before that
    pub verified: usize,
    /// places of the surface, m in O, that were not touched, for the scan has no part there
    pub left_out: Vec<Point3<f64>>,
    /// by the arm's clock, s
    pub seconds: f64,
    /// largest force on the tip, N
    pub peak_force: f64,
}
