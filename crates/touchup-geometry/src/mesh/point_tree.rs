//! Nearest points of a cloud.

use nabo::{CandidateContainer, KDTree, NotNan, Parameters, Point};
use nalgebra::Point3;

/// Steps along the larger side of the cloud, 1e-13 m in 100 mm: whole numbers of steps can always
/// be halved, so no two points are too near for the tree.
const STEPS: f64 = (1u64 << 40) as f64;

/// A point of the tree, in steps.
#[derive(Clone, Copy, Default)]
struct GridPoint([NotNan<f64>; 3]);

impl Point<f64> for GridPoint {
    const DIM: u32 = 3;

    fn set(&mut self, axis: u32, value: NotNan<f64>) {
        self.0[axis as usize] = value;
    }

    fn get(&self, axis: u32) -> NotNan<f64> {
        self.0[axis as usize]
    }
}

/// A k-d tree over points.
pub struct PointTree {
    tree: KDTree<f64, GridPoint>,
    low: Point3<f64>,
    /// steps per metre
    steps: f64,
}

impl PointTree {
    /// Maximum number of points, within the range of the tree's indices by far.
    pub const MOST_POINTS: usize = 1 << 28;

    /// The tree over `points`.
    ///
    /// - `points`: finite, m; at least one and at most [`Self::MOST_POINTS`].
    ///
    /// # Panics
    /// Without a point, or with more than the maximum.
    pub fn new(points: &[Point3<f64>]) -> Self {
        assert!(
            (1..=Self::MOST_POINTS).contains(&points.len()),
            "{} points",
            points.len()
        );
        let [low, high] = points
            .iter()
            .fold([points[0]; 2], |[low, high], p| [low.inf(p), high.sup(p)]);
        let steps = STEPS / (high - low).amax().max(f64::MIN_POSITIVE * STEPS);
        let cloud: Vec<GridPoint> = points.iter().map(|p| place(p, &low, steps)).collect();
        Self {
            tree: KDTree::new(&cloud),
            low,
            steps,
        }
    }

    /// Error bound of a distance in the tree, m: rounding of both points by one step along each
    /// axis.
    pub fn resolution(&self) -> f64 {
        2.0 * 3.0_f64.sqrt() / self.steps
    }

    /// The nearest `count` points within `radius` of `p`, nearest first: the index of each and its
    /// distance, m.
    ///
    /// - `p`: finite; `radius`: m, may be infinite.
    pub fn nearest(
        &self,
        p: &Point3<f64>,
        count: u32,
        radius: f64,
    ) -> impl Iterator<Item = (usize, f64)> + use<> {
        let parameters = Parameters {
            epsilon: 0.0,
            max_radius: radius * self.steps,
            allow_self_match: true,
            sort_results: true,
        };
        let container = if count <= 16 {
            CandidateContainer::Linear
        } else {
            CandidateContainer::BinaryHeap
        };
        let found = self.tree.knn_advanced(
            count,
            &place(p, &self.low, self.steps),
            container,
            &parameters,
            None,
        );
        let steps = self.steps;
        found
            .into_iter()
            .map(move |near| (near.index as usize, near.dist2.into_inner().sqrt() / steps))
    }
}

fn place(p: &Point3<f64>, low: &Point3<f64>, steps: f64) -> GridPoint {
    let whole = ((p - low) * steps).map(f64::floor);
    GridPoint([whole.x, whole.y, whole.z].map(|x| NotNan::new(x).unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_a_row_come_in_order_up_to_the_radius() {
        let row: Vec<_> = (0..100)
            .map(|i| Point3::new(f64::from(i), 0.0, 0.0))
            .collect();
        let tree = PointTree::new(&row);
        let found = |count, radius| {
            tree.nearest(&Point3::new(7.25, 0.0, 0.0), count, radius)
                .collect::<Vec<_>>()
        };
        let close = |found: &[(usize, f64)], by_hand: &[(usize, f64)]| {
            found.len() == by_hand.len()
                && found
                    .iter()
                    .zip(by_hand)
                    .all(|(a, b)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-9)
        };
        assert!(close(
            &found(3, f64::INFINITY),
            &[(7, 0.25), (8, 0.75), (6, 1.25)]
        ));
        assert!(close(&found(40, 1.0), &[(7, 0.25), (8, 0.75)]));
    }
}
