//! Numbers and vectors of no room of their own: order statistics, bases, voxels, robust weights, least squares, small rigid motions.

mod basis;
mod least_squares;
mod quantile;
mod robust;
mod twist;
mod voxel;

pub use basis::tangent_basis;
pub use least_squares::NormalEquations;
pub use quantile::{median, order_statistic, quantile, weighted_quantile};
pub use robust::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, cauchy_weight};
pub use twist::{centroid_and_spread, moved_by_twist, point_to_plane_row};
pub use voxel::{VoxelKey, voxel_neighbourhood, voxel_of};
