//! Least squares fits of planes, cylinders, cones, spheres and slots to touches or a mesh, with a reliable
//! uncertainty.
//!
//! A surface has a pose and up to two sizes; [`SurfaceModel`] names its share of these eight
//! [`Freedom`]s. The fit minimises Σ wᵢ (dᵢ − oᵢ)² over the observations it keeps: dᵢ the signed
//! distance of a point from the surface, oᵢ its nominal offset. The centre of a touching ball is at
//! its radius from the surface, whatever the direction of the force: fitting centres to the offset
//! surface needs no measured normal, so friction does not enter.
//!
//! Observations of one group share their error and count together as one: wᵢ = 1/(σᵢ² n), n the
//! number of kept observations in the group of i. If errors are shared only in part this gives away
//! a little, never too much confidence. Beyond its group an error is shared by the wander of
//! [`TouchNoise`].
//!
//! Own code on nalgebra: the `levenberg-marquardt` crate asks for another nalgebra (0.34), and the
//! work is in weights, rank and covariance, which it leaves to its caller.

mod bias;
mod cone;
mod cylinder;
mod error;
mod estimate;
mod noise;
mod observation;
mod plane;
mod robust;
mod solver;
mod sphere;
mod stadium;
mod surface;
mod uncertainty;

pub use cone::Cone;
pub use cylinder::Cylinder;
pub use error::FitError;
pub use estimate::Fit;
pub use noise::TouchNoise;
pub(crate) use noise::Visit;
pub use observation::{FitParams, Observation};
pub use plane::Plane;
pub use robust::fit;
pub(crate) use robust::fit_mesh;
pub use sphere::{Sphere, SphereFit, fit_sphere};
pub use stadium::{Ends, Stadium, from_segment};
pub use surface::{Distance, FREEDOMS, Freedom, Steps, SurfaceModel};
