//! Calibration of the stylus from dedicated recordings: [`fit_payload`] finds weight, centre of
//! mass and bias from static poses, [`fit_tip`] finds the centre of the ball from a swing about it.
//!
//! [`fit_tip_by_plane`] finds that centre from touches of a plane with a leaning probe: for an arm,
//! which holds no ball in a cone.
//!
//! [`check_workspace`] finds repeatability, tip radius and growth of the error of an arm from
//! touches of spheres.
//!
//! [`DwellFinder`] finds points picked with the stylus.
//!
//! [`fit_payload`] and [`fit_tip`] are one robust least squares: zᵢ = Aᵢ x + y with a vector x seen
//! in turned axes and a constant y.

mod dwell;
mod fit;
mod payload;
mod sphere;
mod static_segments;
mod tip;
mod tip_by_plane;
mod workspace;

pub use dwell::{Dwell, DwellFinder, DwellParams};
pub use payload::{PayloadError, PayloadFit, PayloadParams, VectorEstimate, fit_payload};
pub use sphere::{ReferenceSphere, beside_spheres};
pub use static_segments::{SampleBlock, StaticPose, StaticSegmentFinder, StaticSegmentParams};
pub use tip::{SwingPose, TipError, TipFit, TipFitParams, fit_tip};
pub use tip_by_plane::{PlaneTipError, PlaneTipFit, fit_tip_by_plane};
pub use workspace::{CheckedPlace, SphereReading, WorkspaceCheck, WorkspaceError, check_workspace};
