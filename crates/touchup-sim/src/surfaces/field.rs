//! A scalar field on a regular grid: the signed distance after a scanner's filters.

use nalgebra::{Isometry3, Point3, Vector3};

use super::surface::Surface;

/// Voxels along the side of a block for which one distance suffices far from the surface.
const BLOCK: usize = 4;

/// Values at the nodes of a grid in a frame V; x runs fastest.
#[derive(Clone, Debug)]
pub(crate) struct GridField {
    pub(crate) nodes: [usize; 3],
    /// first node, m, in V
    pub(crate) origin: Point3<f64>,
    /// m
    pub(crate) pitch: f64,
    values: Vec<f64>,
}

impl GridField {
    /// The signed distance, clamped to ± `band` (m), on a grid from `low` to `high` (m, in V).
    pub(crate) fn of_surface(
        surface: &dyn Surface,
        frame_ov: &Isometry3<f64>,
        [low, high]: [Point3<f64>; 2],
        pitch: f64,
        band: f64,
    ) -> Self {
        let nodes = [0, 1, 2].map(|i| ((high[i] - low[i]) / pitch).ceil() as usize + 1);
        let mut field = Self {
            nodes,
            origin: low,
            pitch,
            values: vec![band; nodes.iter().product()],
        };
        let distance = |p: &Point3<f64>| surface.signed_distance(&(frame_ov * p));
        // from the middle of a block to its outermost node
        let half = (BLOCK - 1) as f64 / 2.0;
        let reach = half * pitch * 3f64.sqrt();
        let blocks = nodes.map(|n| n.div_ceil(BLOCK));
        for block in cells(blocks) {
            let first = block.map(|b| b * BLOCK);
            let d = distance(&(field.node(first) + Vector3::repeat(half * pitch)));
            let far = (d.abs() > band + reach).then_some(band.copysign(d));
            let side = [0, 1, 2].map(|i| BLOCK.min(nodes[i] - first[i]));
            for inner in cells(side) {
                let node = [0, 1, 2].map(|i| first[i] + inner[i]);
                let at = field.index(node);
                field.values[at] =
                    far.unwrap_or_else(|| distance(&field.node(node)).clamp(-band, band));
            }
        }
        field
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.nodes[1] + j) * self.nodes[0] + i
    }

    /// Position of a node, m, in V.
    pub(crate) fn node(&self, node: [usize; 3]) -> Point3<f64> {
        self.origin + Vector3::from(node.map(|i| i as f64)) * self.pitch
    }

    /// The values in runs of at most `length` nodes along x, each with the position of its first
    /// node, m, in V.
    pub(crate) fn runs_mut(
        &mut self,
        length: usize,
    ) -> impl Iterator<Item = (Point3<f64>, &mut [f64])> {
        let ([width, height, _], origin, pitch) = (self.nodes, self.origin, self.pitch);
        self.values
            .chunks_mut(width)
            .enumerate()
            .flat_map(move |(line, row)| {
                let first = move |run: usize| [run * length, line % height, line / height];
                let place =
                    move |run: usize| origin + Vector3::from(first(run).map(|i| i as f64)) * pitch;
                row.chunks_mut(length)
                    .enumerate()
                    .map(move |(run, values)| (place(run), values))
            })
    }

    /// Closes gaps narrower than 2 `radius` (m) across z: in every layer a disc takes the smallest,
    /// then the largest.
    ///
    /// A flat disc fills holes level with their surroundings and leaves straight walls in place.
    /// Costs as many steps for each node as the disc has rows.
    pub(crate) fn close_mut(&mut self, radius: f64) {
        let disc = Disc::new(radius / self.pitch, self.nodes);
        let [width, height, _] = self.nodes;
        for layer in self.values.chunks_mut(width * height) {
            if layer.iter().all(|v| *v == layer[0]) {
                continue;
            }
            // the largest is the smallest of the opposite; two reversals restore the sign
            for _ in 0..2 {
                disc.take_smallest_mut(layer);
                layer.iter_mut().for_each(|v| *v = -*v);
            }
        }
    }

    /// Blurs with a Gaussian of standard deviation `sigma` (m), which rounds edges and leaves
    /// planes in place.
    pub(crate) fn blur_mut(&mut self, sigma: f64) {
        let reach = (3.0 * sigma / self.pitch).ceil() as isize;
        let bell = |i: isize| (-0.5 * (i as f64 * self.pitch / sigma).powi(2)).exp();
        let total: f64 = (-reach..=reach).map(bell).sum();
        if reach == 0 || !total.is_finite() {
            return;
        }
        let weights: Vec<f64> = (-reach..=reach).map(|i| bell(i) / total).collect();
        let strides = [1, self.nodes[0], self.nodes[0] * self.nodes[1]];
        for (axis, stride) in strides.into_iter().enumerate() {
            let last = self.nodes[axis] as isize - 1;
            let old = self.values.clone();
            for (at, value) in self.values.iter_mut().enumerate() {
                let here = (at / stride) % self.nodes[axis];
                let base = at - here * stride;
                // beyond the grid its outermost value goes on
                let term = |(w, i): (&f64, isize)| {
                    w * old[base + (here as isize + i).clamp(0, last) as usize * stride]
                };
                *value = weights.iter().zip(-reach..).map(term).sum();
            }
        }
    }

    /// Value at a point (m, in V) between the nodes, by linear interpolation; beyond the grid the
    /// outermost goes on.
    pub(crate) fn at(&self, p: &Point3<f64>) -> f64 {
        let q = (p - self.origin) / self.pitch;
        let cell = [0, 1, 2].map(|i| (q[i].max(0.0) as usize).min(self.nodes[i] - 2));
        let t = [0, 1, 2].map(|i| (q[i] - cell[i] as f64).clamp(0.0, 1.0));
        let corner = |k: usize| {
            let pick = |i: usize| k >> i & 1;
            let weight: f64 = (0..3)
                .map(|i| if pick(i) == 1 { t[i] } else { 1.0 - t[i] })
                .product();
            weight
                * self.values[self.index([cell[0] + pick(0), cell[1] + pick(1), cell[2] + pick(2)])]
        };
        (0..8).map(corner).sum()
    }

    /// Gradient by central differences over one pitch.
    pub(crate) fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        let h = self.pitch;
        Vector3::from_fn(|i, _| {
            let step = Vector3::ith(i, h);
            (self.at(&(p + step)) - self.at(&(p - step))) / (2.0 * h)
        })
    }
}

/// All index triples below `size`, x fastest.
pub(crate) fn cells([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// The nodes of a layer around one of them, row by row.
struct Disc {
    /// half the width of a row, by its distance along y
    halves: Vec<usize>,
    /// nodes in a row of the layer
    width: usize,
}

impl Disc {
    /// `radius` in nodes, clipped to the layer, since nodes beyond it have no effect.
    fn new(radius: f64, [width, height, _]: [usize; 3]) -> Self {
        let reach = (radius.floor() as usize).min(height - 1);
        let half = |dy: usize| {
            ((radius.powi(2) - (dy * dy) as f64).max(0.0).sqrt() as usize).min(width - 1)
        };
        Self {
            halves: (0..=reach).map(half).collect(),
            width,
        }
    }

    /// Gives every node the smallest value of the disc around it.
    fn take_smallest_mut(&self, layer: &mut [f64]) {
        let (width, height) = (self.width, layer.len() / self.width);
        let old = layer.to_vec();
        let mut runs = Runs::new(self.halves[0], width);
        let mut smallest = vec![0.0; width];
        for (y, row) in old.chunks(width).enumerate() {
            runs.of_row_mut(row);
            for (dy, &half) in self.halves.iter().enumerate() {
                runs.smallest_into(half, &mut smallest);
                let rows = [y.checked_sub(dy), Some(y + dy)];
                for to in rows.into_iter().flatten().filter(|&to| to < height) {
                    take_smaller_mut(&mut layer[to * width..][..width], &smallest);
                }
            }
        }
    }
}

/// Smallest values of all runs of 1, 2, 4, … nodes of one row: two overlapping runs make up any
/// window.
struct Runs {
    /// by the power of two; the row has `margin` infinite values at both ends
    levels: Vec<Vec<f64>>,
    margin: usize,
}

impl Runs {
    /// For windows of up to `half` nodes on both sides.
    fn new(half: usize, width: usize) -> Self {
        let count = (2 * half + 1).ilog2() as usize + 1;
        Self {
            levels: vec![vec![f64::INFINITY; width + 2 * half]; count],
            margin: half,
        }
    }

    fn of_row_mut(&mut self, row: &[f64]) {
        self.levels[0][self.margin..][..row.len()].copy_from_slice(row);
        for power in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(power);
            let (from, to) = (&finer[power - 1], &mut coarser[0]);
            to.copy_from_slice(from);
            take_smaller_mut(to, &from[1 << (power - 1)..]);
        }
    }

    /// The smallest value of up to `half` nodes on both sides of each.
    fn smallest_into(&self, half: usize, smallest: &mut [f64]) {
        let length = 2 * half + 1;
        let power = length.ilog2() as usize;
        let runs = &self.levels[power][self.margin - half..];
        smallest.copy_from_slice(&runs[..smallest.len()]);
        take_smaller_mut(smallest, &runs[length - (1 << power)..]);
    }
}

/// Replaces each value by the smaller of itself and its partner, up to the shorter length.
fn take_smaller_mut(values: &mut [f64], others: &[f64]) {
    for (value, &other) in values.iter_mut().zip(others) {
        *value = if other < *value { other } else { *value };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closing by its definition: the smallest, then the largest over all nodes of the layer within
    /// the radius.
    fn closed(field: &GridField, radius: f64) -> Vec<f64> {
        let over_disc = |values: &[f64], worst: f64, pick: fn(f64, f64) -> f64| -> Vec<f64> {
            let near = |[i, j, k]: [usize; 3], [a, b, c]: [usize; 3]| {
                let far = (a.abs_diff(i).pow(2) + b.abs_diff(j).pow(2)) as f64;
                c == k && far <= (radius / field.pitch).powi(2)
            };
            let around = |node| {
                let disc = cells(field.nodes).filter(move |&other| near(node, other));
                disc.map(|other| values[field.index(other)])
                    .fold(worst, pick)
            };
            cells(field.nodes).map(around).collect()
        };
        let smallest = over_disc(&field.values, f64::INFINITY, f64::min);
        over_disc(&smallest, f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn closing_is_the_largest_of_the_smallest_over_a_disc() {
        let nodes = [13, 9, 3];
        // no pattern: the fractional parts of multiples of the golden ratio
        let values = (0..nodes.iter().product())
            .map(|i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5);
        let field = GridField {
            nodes,
            origin: Point3::origin(),
            pitch: 0.5,
            values: values.collect(),
        };
        for radius in [0.0, 0.4, 0.5, 0.75, 1.2, 1.5, 2.3, 4.0, 6.4, 50.0, 1e300] {
            let mut found = field.clone();
            found.close_mut(radius);
            assert_eq!(found.values, closed(&field, radius), "radius {radius}");
        }
    }
}
