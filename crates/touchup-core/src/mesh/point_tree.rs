//! Nearest points of a cloud.

use nalgebra::Point3;

/// Points of a leaf at most: their distances are found together.
const LEAF: usize = 16;

/// A k-d tree over points, which stand in its leaves one after the other.
pub struct PointTree {
    /// of each axis, by leaf
    coordinates: [Vec<f64>; 3],
    /// what each point is named outside
    names: Vec<u32>,
    /// axis and place where the points below a node are divided in two halves; node n has the nodes 2n + 1 and 2n + 2 below it
    splits: Vec<(u8, f64)>,
}

impl PointTree {
    /// Points that the numbers of the tree can count, by far.
    pub const MOST_POINTS: usize = 1 << 28;

    /// The tree over `points`.
    ///
    /// - `points`: finite, m; at least one and at most [`Self::MOST_POINTS`].
    ///
    /// # Panics
    /// Without a point, or with more.
    pub fn new(points: &[Point3<f64>]) -> Self {
        assert!((1..=Self::MOST_POINTS).contains(&points.len()), "{} points", points.len());
        let mut sorted: Vec<(Point3<f64>, u32)> = points.iter().copied().zip(0..).collect();
        let mut splits = Vec::new();
        split(&mut sorted, 0, &mut splits);
        let coordinates = std::array::from_fn(|axis| sorted.iter().map(|(p, _)| p[axis]).collect());
        Self { coordinates, names: sorted.iter().map(|(_, name)| *name).collect(), splits }
    }

    /// The nearest `count` points within `radius` of `p`, nearest first, of equally near ones the first: the index of each and its
    /// distance, m.
    ///
    /// - `p`: finite; `radius`: m, may be infinite.
    pub fn nearest(&self, p: &Point3<f64>, count: u32, radius: f64) -> impl Iterator<Item = (usize, f64)> + use<> {
        let found = Vec::with_capacity(count as usize + 1);
        let mut search = Search { p, count: count as usize, limit: radius * radius, found, beyond: [0.0; 3] };
        if count > 0 {
            self.visit(0, 0..self.names.len(), &mut search);
        }
        search.found.into_iter().map(|(square, name)| (name as usize, square.sqrt()))
    }

    fn visit(&self, node: usize, part: std::ops::Range<usize>, search: &mut Search<'_>) {
        if part.len() <= LEAF {
            return self.visit_leaf(part, search);
        }
        let (axis, at) = self.splits[node];
        let (axis, middle) = (usize::from(axis), middle(part.start, part.end));
        let halves = [(2 * node + 1, part.start..middle), (2 * node + 2, middle..part.end)];
        let away = search.p[axis] - at;
        let [near, far] = if away < 0.0 {
            halves
        } else {
            let [a, b] = halves;
            [b, a]
        };
        self.visit(near.0, near.1, search);
        let before = std::mem::replace(&mut search.beyond[axis], away);
        // as the distance of a point is rounded, so is this, so that none is missed
        let [x, y, z] = search.beyond;
        if x * x + y * y + z * z <= search.limit {
            self.visit(far.0, far.1, search);
        }
        search.beyond[axis] = before;
    }

    fn visit_leaf(&self, part: std::ops::Range<usize>, search: &mut Search<'_>) {
        let [xs, ys, zs] = self.coordinates.each_ref().map(|all| &all[part.clone()]);
        let mut squares = [0.0; LEAF];
        for (square, ((x, y), z)) in squares.iter_mut().zip(xs.iter().zip(ys).zip(zs)) {
            let [x, y, z] = [search.p.x - x, search.p.y - y, search.p.z - z];
            *square = x * x + y * y + z * z;
        }
        for (square, name) in squares.into_iter().zip(&self.names[part]) {
            if square <= search.limit {
                search.take(square, *name);
            }
        }
    }
}

/// The first of the upper half.
fn middle(start: usize, end: usize) -> usize {
    start + (end - start) / 2
}

/// Orders points so that the lower half of them is below the upper along their longest side, and so on.
fn split(points: &mut [(Point3<f64>, u32)], node: usize, splits: &mut Vec<(u8, f64)>) {
    if points.len() <= LEAF {
        return;
    }
    let [low, high] = points.iter().fold([points[0].0; 2], |[low, high], (p, _)| [low.inf(p), high.sup(p)]);
    let axis = (high - low).imax();
    let middle = middle(0, points.len());
    let (_, (first, _), _) = points.select_nth_unstable_by(middle, |(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
    if splits.len() <= node {
        splits.resize(node + 1, (0, 0.0));
    }
    splits[node] = (axis as u8, first[axis]);
    let (lower, upper) = points.split_at_mut(middle);
    split(lower, 2 * node + 1, splits);
    split(upper, 2 * node + 2, splits);
}

/// A search while it goes on.
struct Search<'a> {
    p: &'a Point3<f64>,
    count: usize,
    /// square of the distance beyond which nothing is wanted
    limit: f64,
    /// square of the distance and name of the nearest so far
    found: Vec<(f64, u32)>,
    /// how far the current part lies beyond the planes that divide it from the place, for each axis
    beyond: [f64; 3],
}

impl Search<'_> {
    fn take(&mut self, square: f64, name: u32) {
        let is_before = |other: &&(f64, u32)| (square, name) < **other;
        let at = self.found.len() - self.found.iter().rev().take_while(is_before).count();
        if at == self.count {
            return;
        }
        self.found.insert(at, (square, name));
        self.found.truncate(self.count);
        if self.found.len() == self.count {
            self.limit = self.found[self.count - 1].0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    #[test]
    fn the_nearest_of_a_row_come_in_order_up_to_the_radius() {
        let row: Vec<_> = (0..100).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let tree = PointTree::new(&row);
        let found = |count, radius| tree.nearest(&Point3::new(7.25, 0.0, 0.0), count, radius).collect::<Vec<_>>();
        assert_eq!(found(3, f64::INFINITY), [(7, 0.25), (8, 0.75), (6, 1.25)]);
        assert_eq!(found(40, 1.0), [(7, 0.25), (8, 0.75)]);
        assert_eq!(found(0, 1.0), []);
    }

    #[test]
    fn the_nearest_are_those_of_a_search_through_all_points() {
        let mut random = Pcg64::seed_from_u64(1);
        // whole numbers: many are equally near, and some are there twice
        let mut whole = |most: i32| Point3::from([0; 3].map(|_| f64::from(random.random_range(0..=most))));
        for (count, most) in [(1, 3), (17, 3), (300, 0), (300, 5), (1000, 40)] {
            let points: Vec<_> = (0..count).map(|_| whole(most)).collect();
            let tree = PointTree::new(&points);
            for (wanted, radius) in [(1, f64::INFINITY), (24, f64::INFINITY), (64, 3.0)] {
                let place = whole(most + 1);
                let distance = |at: usize| (points[at] - place).norm_squared().sqrt();
                let mut all: Vec<_> =
                    (0..points.len()).map(|at| (at, distance(at))).filter(|(_, d)| *d <= radius).collect();
                all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
                all.truncate(wanted as usize);
                assert_eq!(tree.nearest(&place, wanted, radius).collect::<Vec<_>>(), all);
            }
        }
    }
}
