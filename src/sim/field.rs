//! A scalar field on a regular grid: the signed distance as a scanner's filters leave it.

use nalgebra::{Isometry3, Point3, Vector3};

use super::surface::Surface;

/// Voxels along the side of a block that is decided by one distance where the surface is far.
const BLOCK: usize = 4;

/// Values at the nodes of a grid in a frame V; x runs fastest.
#[derive(Clone, Debug)]
pub(super) struct Field {
    pub(super) nodes: [usize; 3],
    /// first node, m, in V
    pub(super) origin: Point3<f64>,
    /// m
    pub(super) pitch: f64,
    values: Vec<f64>,
}

impl Field {
    /// The signed distance, cut off at ± `band` (m), on a grid from `low` to `high` (m, in V).
    pub(super) fn of_surface(
        surface: &dyn Surface,
        frame_ov: &Isometry3<f64>,
        [low, high]: [Point3<f64>; 2],
        pitch: f64,
        band: f64,
    ) -> Self {
        let nodes = [0, 1, 2].map(|i| ((high[i] - low[i]) / pitch).ceil() as usize + 1);
        let mut field = Self { nodes, origin: low, pitch, values: vec![band; nodes.iter().product()] };
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
                field.values[at] = far.unwrap_or_else(|| distance(&field.node(node)).clamp(-band, band));
            }
        }
        field
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.nodes[1] + j) * self.nodes[0] + i
    }

    /// Value at a node.
    pub(super) fn value(&self, node: [usize; 3]) -> f64 {
        self.values[self.index(node)]
    }

    /// Position of a node, m, in V.
    pub(super) fn node(&self, node: [usize; 3]) -> Point3<f64> {
        self.origin + Vector3::from(node.map(|i| i as f64)) * self.pitch
    }

    /// Applies `f(position in V, value)` to every node.
    pub(super) fn map_mut(&mut self, f: impl Fn(&Point3<f64>, f64) -> f64) {
        for node in cells(self.nodes) {
            let at = self.index(node);
            self.values[at] = f(&self.node(node), self.values[at]);
        }
    }

    /// Closes what is narrower than 2 `radius` (m) across z: in every layer a disc takes the smallest, then the largest.
    ///
    /// A flat disc fills holes level with what surrounds them and leaves straight walls where they are.
    pub(super) fn close_mut(&mut self, radius: f64) {
        let reach = (radius / self.pitch).floor() as isize;
        if reach == 0 {
            return;
        }
        let half_width = |dy: isize| ((radius / self.pitch).powi(2) - (dy * dy) as f64).max(0.0).sqrt() as usize;
        let rows: Vec<_> = (-reach..=reach).map(|dy| (dy, half_width(dy))).collect();
        let [width, height, _] = self.nodes;
        for layer in self.values.chunks_mut(width * height) {
            if layer.iter().all(|v| *v == layer[0]) {
                continue;
            }
            disc_filter(layer, width, &rows, f64::min);
            disc_filter(layer, width, &rows, f64::max);
        }
    }

    /// Blurs with a Gaussian of standard deviation `sigma` (m), which rounds edges and leaves planes where they are.
    pub(super) fn blur_mut(&mut self, sigma: f64) {
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
                let term = |(w, i): (&f64, isize)| w * old[base + (here as isize + i).clamp(0, last) as usize * stride];
                *value = weights.iter().zip(-reach..).map(term).sum();
            }
        }
    }

    /// Value at a point (m, in V) between the nodes, by linear interpolation; beyond the grid the outermost goes on.
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        let q = (p - self.origin) / self.pitch;
        let cell = [0, 1, 2].map(|i| (q[i].max(0.0) as usize).min(self.nodes[i] - 2));
        let t = [0, 1, 2].map(|i| (q[i] - cell[i] as f64).clamp(0.0, 1.0));
        let corner = |k: usize| {
            let pick = |i: usize| k >> i & 1;
            let weight: f64 = (0..3).map(|i| if pick(i) == 1 { t[i] } else { 1.0 - t[i] }).product();
            weight * self.values[self.index([cell[0] + pick(0), cell[1] + pick(1), cell[2] + pick(2)])]
        };
        (0..8).map(corner).sum()
    }

    /// Gradient by central differences over one pitch.
    pub(super) fn gradient(&self, p: &Point3<f64>) -> Vector3<f64> {
        let h = self.pitch;
        Vector3::from_fn(|i, _| {
            let step = Vector3::ith(i, h);
            (self.at(&(p + step)) - self.at(&(p - step))) / (2.0 * h)
        })
    }
}

/// All index triples below `size`, x fastest.
pub(super) fn cells([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// `pick` over a disc around every node of one layer; `rows`: offset along y and half width along x of its rows.
fn disc_filter(layer: &mut [f64], width: usize, rows: &[(isize, usize)], pick: fn(f64, f64) -> f64) {
    let height = (layer.len() / width) as isize;
    let old = layer.to_vec();
    for (y, line) in layer.chunks_mut(width).enumerate() {
        for &(dy, half) in rows {
            let from = (y as isize + dy).clamp(0, height - 1) as usize * width;
            let source = &old[from..from + width];
            for (x, value) in line.iter_mut().enumerate() {
                let window = &source[x.saturating_sub(half)..(x + half + 1).min(width)];
                *value = window.iter().copied().fold(*value, pick);
            }
        }
    }
}
