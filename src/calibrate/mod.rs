//! What the scene must know about the stylus, from recordings made for it: [`fit_payload`] finds weight, centre of mass
//! and bias from still poses, [`fit_tip`] finds the centre of the ball from a swing about it.
//!
//! [`RestFinder`] finds points that were picked with the stylus.
//!
//! The first two are one robust least squares: zᵢ = Aᵢ x + y with a vector x seen in turned axes and a constant y.

mod fit;
mod payload;
mod rests;
mod still;
mod tip;

pub use payload::{Known, PayloadError, PayloadFit, PayloadParams, fit_payload};
pub use rests::{Rest, RestFinder, RestParams};
pub use still::{StaticPose, StillFinder, StillParams};
pub use tip::{SwingPose, TipError, TipFit, TipFitParams, fit_tip};
