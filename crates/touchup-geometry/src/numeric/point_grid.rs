//! A voxel grid of points, for queries by place.

use std::collections::HashMap;

use nalgebra::Point3;

use super::voxel::{VoxelKey, voxel_neighbourhood, voxel_of};

/// Numbered points by voxel.
#[derive(Clone, Debug)]
pub struct PointGrid {
    size: f64,
    /// in order of insertion
    voxels: HashMap<VoxelKey, Vec<(u32, Point3<f64>)>>,
}

impl PointGrid {
    /// An empty grid.
    ///
    /// - `size`: of a voxel, m, more than 0: the largest distance of a query.
    pub fn new(size: f64) -> Self {
        Self {
            size: size.max(f64::MIN_POSITIVE),
            voxels: HashMap::new(),
        }
    }

    /// A grid of the entries of `points` with the given numbers.
    pub fn of(points: &[Point3<f64>], numbers: impl Iterator<Item = usize>, size: f64) -> Self {
        let mut grid = Self::new(size);
        numbers.for_each(|at| grid.insert(at as u32, &points[at]));
        grid
    }

    /// Adds a point under a number.
    pub fn insert(&mut self, number: u32, point: &Point3<f64>) {
        self.voxels
            .entry(voxel_of(point, self.size))
            .or_default()
            .push((number, *point));
    }

    /// Numbers of the points within `reach` (m, at most the size) of `p`.
    pub fn near(&self, p: &Point3<f64>, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let p = *p;
        let voxels = voxel_neighbourhood(voxel_of(&p, self.size))
            .filter_map(|voxel| self.voxels.get(&voxel));
        voxels
            .flatten()
            .filter(move |(_, point)| (point - p).norm() <= reach)
            .map(|(number, _)| *number as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_line_are_found_on_both_sides_of_a_voxel() {
        let line: Vec<_> = (-4..5)
            .map(|i| Point3::new(f64::from(i) * 0.25, 0.0, 0.0))
            .collect();
        let grid = PointGrid::of(&line, 0..line.len(), 0.5);
        let near = |x: f64| {
            grid.near(&Point3::new(x, 0.0, 0.0), 0.3)
                .collect::<Vec<_>>()
        };
        assert_eq!(near(0.0), [3, 4, 5]);
        assert_eq!(near(-1.0), [0, 1]);
        assert_eq!(near(1.31), Vec::<usize>::new());
    }
}
