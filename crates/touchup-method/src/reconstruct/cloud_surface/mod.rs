//! Surface reconstruction from the points of a scan.

mod clean;
mod moving_least_squares;
mod normals;
mod summary;
mod surface;

pub use summary::{CloudSummary, NormalSource};
pub use surface::{CloudError, CloudSurface, surface_of_cloud};
