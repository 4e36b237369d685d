//! A point order that keeps neighbours in space close together: data read by one query is still in
//! the cache for the next.

use nalgebra::Point3;

/// Cells of the curve on each axis: 2 to this power.
const BITS: u32 = 10;

/// The indices of `points` along a Z-order curve through cells of 1/1024 of their box; in input
/// order within a cell.
///
/// - `points`: finite, fewer than 2³².
pub fn coherent_order(points: &[Point3<f64>]) -> Vec<u32> {
    let empty = [f64::INFINITY, f64::NEG_INFINITY].map(|x| Point3::new(x, x, x));
    let [lo, hi] = points
        .iter()
        .fold(empty, |[lo, hi], p| [lo.inf(p), hi.sup(p)]);
    // cubes: the order of a flat part is that of a plane
    let cells = f64::from(1 << BITS) / (hi - lo).amax().max(f64::MIN_POSITIVE);
    let mut keys: Vec<u64> = points
        .iter()
        .zip(0u64..)
        .map(|(p, at)| code(&((p - lo) * cells).into()) << 32 | at)
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// The interleaved bits of the three cell numbers.
fn code(cell: &[f64; 3]) -> u64 {
    let [x, y, z] = cell.map(|x| spread((x as u32).min((1 << BITS) - 1)));
    x << 2 | y << 1 | z
}

/// The lowest ten bits, two zeros between each and the next.
fn spread(x: u32) -> u64 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    u64::from((x | x << 2) & 0x0924_9249)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_cube_come_in_z_order_and_each_once() {
        let corner =
            |i: u32| Point3::new(f64::from(i >> 2), f64::from(i >> 1 & 1), f64::from(i & 1));
        let shuffled = [3, 7, 0, 5, 1, 6, 2, 4];
        let order = coherent_order(&shuffled.map(corner));
        assert_eq!(
            order
                .iter()
                .map(|&at| shuffled[at as usize])
                .collect::<Vec<_>>(),
            [0, 1, 2, 3, 4, 5, 6, 7]
        );
    }

    #[test]
    fn bits_are_spread_one_by_one() {
        for x in [0, 1, 2, 0b10_1101_0110, 1023] {
            let by_hand: u64 = (0..10)
                .map(|bit| u64::from(x >> bit & 1) << (3 * bit))
                .sum();
            assert_eq!(spread(x), by_hand);
        }
    }

    #[test]
    fn equal_points_and_none_are_ordered_too() {
        assert_eq!(coherent_order(&[Point3::new(1.0, 2.0, 3.0); 3]), [0, 1, 2]);
        assert!(coherent_order(&[]).is_empty());
    }
}
