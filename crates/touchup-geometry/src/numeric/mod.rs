//! Numerics shared by all rooms: order statistics, means, bases, voxels, sets, robust weights,
//! least squares, small rigid motions.

mod basis;
mod counted;
mod direction;
mod jackknife;
mod least_squares;
mod moments;
mod normal;
mod point_grid;
mod quantile;
mod robust;
mod running_median;
mod sets;
mod twist;
mod voxel;

pub use basis::{tangent_basis, turned_to};
pub use counted::counted;
pub use direction::{direction, length_and_direction};
pub use jackknife::jackknife_variance;
pub use least_squares::{DampedSearch, NormalEquations, SearchEnd};
pub use moments::{centroid_and_spread, mean, scatter, spreads, thinnest_direction};
pub use normal::{circle_probability, normal_cdf, normal_quantile};
pub use point_grid::PointGrid;
pub use quantile::{largest, median, order_statistic, quantile, weighted_quantile};
pub use robust::{SIGMA_OF_MEDIAN, TUKEY_WIDTH, biweight, cauchy_cost, cauchy_weight};
pub use running_median::RunningMedian;
pub use sets::{DisjointSets, distinct, flood, without_repeats};
pub use twist::{moved_by_twist, point_to_plane_row};
pub use voxel::{VoxelKey, voxel_neighbourhood, voxel_of};
