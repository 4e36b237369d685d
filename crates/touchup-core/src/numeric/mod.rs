//! Numbers and vectors of no room of their own: order statistics, bases, voxels, robust weights, least squares, small rigid motions.

mod basis;
mod least_squares;
mod quantile;
mod robust;
mod twist;
mod voxel;

pub(crate) use basis::tangent_basis;
pub(crate) use least_squares::NormalEquations;
pub(crate) use quantile::order_statistic;
pub use quantile::{median, quantile, weighted_quantile};
pub(crate) use robust::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, cauchy_weight};
pub(crate) use twist::{centroid_and_spread, moved_by_twist, point_to_plane_row};
pub(crate) use voxel::{VoxelKey, voxel_neighbourhood, voxel_of};
