//! Least squares fits of planes, cylinders, cones and slots to what was touched, with an
//! uncertainty that holds.
//!
//! A surface has a pose and up to two sizes; [`Surface`] says which of these eight [`Freedom`]s it
//! has. The fit makes Σ wᵢ (dᵢ − oᵢ)² least over the observations it keeps: dᵢ the signed distance
//! of a point from the surface, oᵢ the offset it should have. A ball that touches has its centre at
//! its radius from the surface, whatever the direction of the force: fitting centres to the offset
//! surface needs no measured normal, so friction does not enter.
//!
//! Observations of one group share their error and count together as one: wᵢ = 1/(σᵢ² n), n the
//! observations kept of the group of i. If errors are shared only in part this gives away a little,
//! never too much confidence.
//!
//! Own code on nalgebra: the `levenberg-marquardt` crate asks for another nalgebra (0.34), and the
//! work is in weights, rank and covariance, which it leaves to its caller.

mod bias;
mod cone;
mod cylinder;
mod error;
mod estimate;
mod observation;
mod plane;
mod robust;
mod solver;
mod stadium;
mod surface;
mod uncertainty;

pub use cone::Cone;
pub use cylinder::Cylinder;
pub use error::FitError;
pub use estimate::Fit;
pub use observation::{FitParams, Observation};
pub use plane::Plane;
pub use robust::fit;
pub(crate) use robust::fit_mesh;
pub(crate) use stadium::from_segment;
pub use stadium::{Ends, Stadium};
pub use surface::{Distance, FREEDOMS, Freedom, Steps, Surface};
