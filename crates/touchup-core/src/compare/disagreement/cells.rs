//! Points found by place: cubes of one side.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::numeric::{VoxelKey, voxel_neighbourhood, voxel_of};

/// Numbers of points by the cube they lie in.
pub(super) struct Cells<'a> {
    side: f64,
    points: &'a [Point3<f64>],
    cells: BTreeMap<VoxelKey, Vec<u32>>,
}

impl<'a> Cells<'a> {
    /// - `side`: m, more than 0; the largest distance that will be asked for.
    /// - `numbers`: of the points that are to be found.
    pub fn new(points: &'a [Point3<f64>], numbers: impl Iterator<Item = usize>, side: f64) -> Self {
        let side = side.max(f64::MIN_POSITIVE);
        let mut cells: BTreeMap<VoxelKey, Vec<u32>> = BTreeMap::new();
        numbers.for_each(|at| cells.entry(voxel_of(&points[at], side)).or_default().push(at as u32));
        Self { side, points, cells }
    }

    /// Numbers of the points within `reach` (m, at most the side) of `p`.
    pub fn near(&self, p: &Point3<f64>, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let p = *p;
        let cubes = voxel_neighbourhood(voxel_of(&p, self.side)).filter_map(|voxel| self.cells.get(&voxel));
        cubes.flatten().map(|&at| at as usize).filter(move |&at| (self.points[at] - p).norm() <= reach)
    }
}
