//! How the probing of a feature ended, and all that was measured.

use nalgebra::Point3;

use super::links::LinkError;
use crate::probing::arm::{LimitError, ProbeError, SlideRecord, TouchRecord};
use crate::probing::plan::{ExploreError, Found, Slide, TouchPlan};

/// How it ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// The number has the requested uncertainty.
    ToleranceReached,
    /// The touches are spent; it is as good as they made it.
    TouchesSpent,
    /// The time is spent.
    TimeSpent,
    /// There is no such feature where it was searched.
    NothingFound(ExploreError),
    /// A request cancelled it: the arm stopped, and retracted.
    Cancelled,
    /// The arm did not move: it would leave its limits.
    OutOfLimits(LimitError),
    /// The arm did not move: no path is clear of the mesh.
    NoClearPath(LinkError),
    /// The arm stopped.
    Stopped(ProbeError),
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::ToleranceReached => f.write_str("tolerance reached"),
            Self::TouchesSpent => f.write_str("tolerance not reached: the touches are spent"),
            Self::TimeSpent => f.write_str("tolerance not reached: the time is spent"),
            Self::NothingFound(error) => write!(f, "nothing found: {error}"),
            Self::Cancelled => f.write_str("cancelled: the arm stopped and retracted"),
            Self::OutOfLimits(error) => write!(f, "not begun: {error}"),
            Self::NoClearPath(error) => write!(f, "not begun: {error}"),
            Self::Stopped(error) => write!(f, "stopped: {error}"),
        }
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

impl Probed {
    /// Before the first motion.
    pub(super) fn not_begun(flag: u32, ending: Ending) -> Self {
        let (touches, slides) = (Vec::new(), Vec::new());
        Self { flag, ending, found: None, touches, slides, seconds: 0.0, peak_force: 0.0 }
    }
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
    /// by the arm's clock, s
    pub seconds: f64,
    /// largest force on the tip, N
    pub peak_force: f64,
}
