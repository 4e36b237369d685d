//! Cubes of a regular grid, as keys of their contents.

use nalgebra::Point3;

/// Index of a cube of a grid from the origin, along x, y and z.
pub type VoxelKey = [i32; 3];

/// The cube of edge `size` (m, > 0) around `p`: ⌊p / size⌋. Points beyond the range of keys are in
/// the outermost one; NaN is in cube 0.
#[inline]
pub fn voxel_of(p: &Point3<f64>, size: f64) -> VoxelKey {
    [p.x, p.y, p.z].map(|x| (x / size).floor() as i32)
}

/// A cube and the 26 around it, x slowest.
pub fn voxel_neighbourhood(key: VoxelKey) -> impl Iterator<Item = VoxelKey> {
    (0..27)
        .map(move |i| [0, 1, 2].map(|axis| key[axis].saturating_add(i / [9, 3, 1][axis] % 3 - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_its_lower_faces_and_not_its_upper_ones() {
        assert_eq!(voxel_of(&Point3::new(0.0, 0.5, 1.0), 0.5), [0, 1, 2]);
        assert_eq!(voxel_of(&Point3::new(-1e-9, -0.5, 0.499), 0.5), [-1, -1, 0]);
        assert_eq!(
            voxel_of(&Point3::new(1e300, -1e300, f64::NAN), 0.5),
            [i32::MAX, i32::MIN, 0]
        );
    }

    #[test]
    fn the_27_around_a_cube_are_all_different_and_none_is_farther_than_one() {
        let around: std::collections::BTreeSet<_> = voxel_neighbourhood([4, -7, 0]).collect();
        let is_near = |key: &VoxelKey| {
            [4, -7, 0]
                .iter()
                .zip(key)
                .all(|(a, b): (&i32, _)| a.abs_diff(*b) <= 1)
        };
        assert!(around.len() == 27 && around.iter().all(is_near) && around.contains(&[4, -7, 0]));
    }
}
