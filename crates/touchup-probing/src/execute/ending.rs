//! Ending of the probing of a feature, and all its measurements.

use std::error::Error;

use nalgebra::Point3;

use super::links::LinkError;
use crate::arm::{LimitError, ProbeError, SlideRecord, StopRequest, TouchRecord};
use crate::plan::{DecidedCharacteristic, ExplorationResult, ExploreError, Slide, TouchPlan};
use touchup_method::reconstruct::KnownSurface;

/// How a probing ended; as an error, why it ended early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Ending {
    /// The number has the requested uncertainty.
    #[error("tolerance reached")]
    ToleranceReached,
    /// The touches are spent; the number is as good as they made it.
    #[error("tolerance not reached: the touches are spent")]
    TouchesSpent,
    /// The calibration limits the number: more touches would not help.
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
    /// The touches are spent before each characteristic passes or fails.
    #[error(
        "undecided: the touches are spent, and {names} may still pass or fail: allow more touches, or agree on other limits"
    )]
    Undecided {
        /// open characteristics
        names: String,
    },
    /// The calibration leaves characteristics open: more touches would not help.
    #[error(
        "undecided: what radius of the ball, place of the part and kinematics leave uncertain is in all touches alike, and leaves {names} \
         open however often it is touched: calibrate them, or agree on other limits"
    )]
    Undecidable {
        /// open characteristics
        names: String,
    },
    /// The time is spent.
    #[error("tolerance not reached: the time is spent")]
    TimeSpent,
    /// No such feature in the searched place.
    #[error("nothing found: {0}")]
    NothingFound(#[from] ExploreError),
    /// A stop on request.
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
    /// Ending of a decision goal.
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

    /// Whether tip, part or arm have moved: then it is unknown which touches hold.
    pub fn is_displaced(&self) -> bool {
        matches!(self, Self::Stopped(ProbeError::Displaced { .. }))
    }

    /// The reason alone.
    pub(super) fn why(&self) -> String {
        self.source()
            .map_or_else(|| self.to_string(), ToString::to_string)
    }

    /// Whether only this touch or slide is impossible.
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
    /// plan, in O
    pub planned: TouchPlan,
    /// measurement; `None` if the arm was held back before
    pub record: Option<TouchRecord>,
    /// centre of the ball at contact, m in O
    pub centre: Option<Point3<f64>>,
    /// distance of the contact from the earlier mesh, m, positive outside
    pub deviation: Option<f64>,
    /// why it does not count; `None`: it counts
    pub refused: Option<String>,
}

/// One slide of a probing.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbedSlide {
    /// plan, in O
    pub slide: Slide,
    /// measurement; `None` if the arm was held back before
    pub record: Option<SlideRecord>,
    /// why it is missing; `None`: it is not
    pub refused: Option<String>,
}

/// A repeated touch of a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceTouch {
    /// number of its feature
    pub flag: u32,
    /// number of the touch in that feature, from 0 on
    pub index: usize,
    /// shift of the contact along its search, m
    pub off: f64,
    /// standard uncertainty of the shift, m
    pub sigma: f64,
}

/// The result of a flag.
#[derive(Clone, Debug)]
pub struct FlagResult {
    /// number of the flag
    pub flag: u32,
    /// its ending
    pub ending: Ending,
    /// the feature, also after an early ending
    pub found: Option<ExplorationResult>,
    /// the surfaces of the feature
    pub known_surfaces: Vec<KnownSurface>,
    /// all touches, in order
    pub touches: Vec<ProbedTouch>,
    /// slides after the touches
    pub slides: Vec<ProbedSlide>,
    /// last touches of the references, none of them moved
    pub references: Vec<ReferenceTouch>,
    /// number of touches made before these
    pub verified: usize,
    /// places of the surface, m in O, without touches, for the scan has no part there
    pub left_out: Vec<Point3<f64>>,
    /// duration by the arm's clock, s
    pub seconds: f64,
    /// largest force on the tip, N
    pub peak_force: f64,
}
