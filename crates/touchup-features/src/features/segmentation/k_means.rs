//! Lloyd's k-means in space.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Draws for each centre at the start: 2 + ln k for the few clusters of a part.
const DRAWS: usize = 4;
/// Maximum number of rounds; points of a mesh converge in tens.
const MOST_ROUNDS: usize = 300;

/// Centres and the points that belong to them.
#[derive(Clone, Debug, PartialEq)]
pub struct KMeans {
    /// Means of their points, m.
    pub centers: Vec<Point3<f64>>,
    /// For each point the index of its nearest centre; empty for `k` = 0.
    pub labels: Vec<u32>,
}

/// Parts points into `k` groups, each about its mean, from a start by k-means++ \[Arthur and
/// Vassilvitskii 2007\].
///
/// Ends when no point changes its group: at a least sum of squares among near partitions, not among
/// all. Returns fewer groups for fewer than `k` distinct points. Own code: the kept crates for it
/// bring threads and arrays of their own.
pub fn k_means(points: &[Point3<f64>], k: usize, seed: u64) -> KMeans {
    let mut centers = seeds(points, k, seed);
    let mut labels = vec![u32::MAX; if centers.is_empty() { 0 } else { points.len() }];
    for _ in 0..MOST_ROUNDS {
        let mut sums = vec![(Vector3::zeros(), 0.0); centers.len()];
        let mut changed = false;
        for (p, label) in points.iter().zip(&mut labels) {
            let nearest = nearest(p, &centers);
            changed |= *label != nearest;
            *label = nearest;
            let (sum, count) = &mut sums[nearest as usize];
            *sum += p.coords;
            *count += 1.0;
        }
        if !changed {
            break;
        }
        for (center, (sum, count)) in centers
            .iter_mut()
            .zip(&sums)
            .filter(|(_, (_, count))| *count > 0.0)
        {
            *center = (sum / *count).into();
        }
    }
    KMeans { centers, labels }
}

#[inline]
fn nearest(p: &Point3<f64>, centers: &[Point3<f64>]) -> u32 {
    let (mut best, mut least) = (0, f64::INFINITY);
    for (i, center) in centers.iter().enumerate() {
        let distance = (p - center).norm_squared();
        best = if distance < least { i as u32 } else { best };
        least = least.min(distance);
    }
    best
}

/// The first at random; then each time the best of a few draws with a chance as the square of their
/// distance from the previous ones: the draw with the least remaining sum of squares. One draw
/// alone often puts two into one group.
fn seeds(points: &[Point3<f64>], k: usize, seed: u64) -> Vec<Point3<f64>> {
    if points.is_empty() || k == 0 {
        return Vec::new();
    }
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut centers = vec![points[rng.random_range(0..points.len())]];
    let mut squares: Vec<f64> = points
        .iter()
        .map(|p| (p - centers[0]).norm_squared())
        .collect();
    while centers.len() < k {
        let total: f64 = squares.iter().sum();
        let draws: Vec<f64> = (0..DRAWS)
            .map(|_| rng.random_range(0.0..1.0) * total)
            .collect();
        let drawn = draws
            .into_iter()
            .filter_map(|rest| drawn(&squares, rest))
            .map(|i| points[i]);
        let left = |c: &Point3<f64>| -> f64 {
            points
                .iter()
                .zip(&squares)
                .map(|(p, square)| square.min((p - c).norm_squared()))
                .sum()
        };
        let best = drawn
            .map(|c| (left(&c), c))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, center)) = best else { break };
        points
            .iter()
            .zip(&mut squares)
            .for_each(|(p, square)| *square = square.min((p - center).norm_squared()));
        centers.push(center);
    }
    centers
}

/// The place at which the running sum passes `rest`, or the last positive one; `None`: all are 0.
fn drawn(squares: &[f64], mut rest: f64) -> Option<usize> {
    let passes = |square: &f64| {
        rest -= square;
        rest < 0.0 && *square > 0.0
    };
    squares
        .iter()
        .position(passes)
        .or_else(|| squares.iter().rposition(|square| *square > 0.0))
}
