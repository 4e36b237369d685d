//! MATLAB's `peaks` as a height field of 50 × 50 × 20 mm, the smooth surface of the paper's
//! simulations (Sec 4.3).
//!
//! With x, y in units of 50/6 mm,
//! z ∝ 3(1−x)² e^(−x²−(y+1)²) − 10(x/5 − x³ − y⁵) e^(−x²−y²) − ⅓ e^(−(x+1)²−y²).

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::surface::{Bounds, Surface, SurfacePoint};
use super::wavy::height_field;
use crate::error::{SimError, positive, require};
use crate::random::gauss_vector;
use touchup_geometry::mesh::TriMesh;

/// Length of the sides, m.
const SIDE: f64 = 0.050;
/// From the lowest to the highest point, m.
const HEIGHT: f64 = 0.020;
/// m per unit of x and y in the formula, whose square is six units wide.
const UNIT: f64 = SIDE / 6.0;
/// Extremes of the formula, in its own unit.
const RANGE: [f64; 2] = [-6.551_133_332_835_84, 8.106_213_589_442_332];
/// Pitch of the search's starting grid, m: a quarter of the smallest radius of curvature (1.57 mm).
const PITCH: f64 = 0.4e-3;
/// Reach of the grid beyond the square, m; there the formula is below 1e-6 of its height.
const MARGIN: f64 = 0.015;
/// Maximum number of cells along a side of the mesh.
const MAX_CELLS: f64 = 2000.0;
/// Maximum number of Newton steps; ten are usual, with damping a few more.
const MAX_STEPS: usize = 60;

/// The surface z = f(x, y), material below it; the square is centred on the origin and z = 0 is its
/// middle height.
///
/// The formula continues beyond the square, so the distance has no rim.
#[derive(Clone, Debug)]
pub struct Peaks {
    /// heights at the nodes of the starting grid, row after row, m
    heights: Vec<f64>,
    nodes: usize,
}

/// Height, slope and second derivatives of the surface at one place.
struct Jet {
    z: f64,
    slope: Vector2<f64>,
    bend: Matrix2<f64>,
}

impl Default for Peaks {
    fn default() -> Self {
        let nodes = ((SIDE + 2.0 * MARGIN) / PITCH).ceil() as usize + 1;
        let at = |i: usize| i as f64 * PITCH - SIDE / 2.0 - MARGIN;
        let heights = (0..nodes * nodes)
            .map(|k| jet(&Point2::new(at(k % nodes), at(k / nodes))).z)
            .collect();
        Self { heights, nodes }
    }
}

impl Peaks {
    /// Height at (x, y), m.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        jet(&Point2::new(x, y)).z
    }

    /// The square as a grid of right triangles whose legs are `edge` long or a little shorter (m),
    /// outward up.
    ///
    /// # Errors
    /// [`SimError::BadParameter`] for an `edge` that is no length, or that makes more than eight
    /// million faces.
    pub fn mesh(&self, edge: f64) -> Result<TriMesh, SimError> {
        positive("the edge length", edge, "m")?;
        let cells = (SIDE / edge).ceil();
        require(
            cells <= MAX_CELLS,
            "the edge length",
            edge,
            "m",
            "25 µm or more",
        )?;
        Ok(height_field(
            cells as u32,
            |i| (f64::from(i) / cells - 0.5) * SIDE,
            |x, y| self.height(x, y),
        )?)
    }

    /// Nodes of the starting grid closer to `p` than their neighbours, within `reach` (m) sideways.
    fn starts(&self, p: &Point3<f64>, reach: f64) -> Vec<Point2<f64>> {
        let last = self.nodes - 1;
        let index = |x: f64| (((x + SIDE / 2.0 + MARGIN) / PITCH).max(0.0) as usize).min(last);
        let at = |i: usize| i as f64 * PITCH - SIDE / 2.0 - MARGIN;
        let far = |i: usize, j: usize| {
            Vector3::new(
                at(i) - p.x,
                at(j) - p.y,
                self.heights[j * self.nodes + i] - p.z,
            )
            .norm_squared()
        };
        let around = |i: usize| i.saturating_sub(1)..=(i + 1).min(last);
        let (is, js) = (
            [p.x - reach, p.x + reach].map(index),
            [p.y - reach, p.y + reach].map(index),
        );
        let up_to = |k: usize| (k + 1).min(last);
        let nodes =
            (js[0]..=up_to(js[1])).flat_map(|j| (is[0]..=up_to(is[1])).map(move |i| (i, j)));
        let lowest = nodes.filter(|&(i, j)| {
            let mine = far(i, j);
            around(j).all(|m| around(i).all(|k| far(k, m) >= mine))
        });
        lowest.map(|(i, j)| Point2::new(at(i), at(j))).collect()
    }

    /// Closest points, one for each dip of the distance within `reach`.
    fn dips(&self, p: &Point3<f64>, reach: f64) -> Vec<SurfacePoint> {
        let from = [p.xy()].into_iter().chain(self.starts(p, reach));
        from.map(|start| on_surface(&descend(p, start))).collect()
    }
}

/// Moves every vertex by independent Gaussian noise along x, y and z and by a common offset.
///
/// - `noise`: standard deviation per axis, m (the paper's scan: 3 mm).
/// - `offset`: m (the paper's scan: 2 mm along z).
///
/// Faces keep their ids, for a comparison of the noisy and true mesh face by face.
pub fn add_vertex_noise(mesh: &mut TriMesh, noise: f64, offset: &Vector3<f64>, seed: u64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    for vertex in 0..mesh.vertex_count() as u32 {
        let vertex = touchup_geometry::mesh::VertexId(vertex);
        mesh.set_position(
            vertex,
            mesh.position(vertex) + gauss_vector(&mut rng) * noise + offset,
        );
    }
}

/// The formula and its derivatives, scaled to m.
fn jet(q: &Point2<f64>) -> Jet {
    let (x, y) = (q.x / UNIT, q.y / UNIT);
    let mut sum = Jet {
        z: 0.0,
        slope: Vector2::zeros(),
        bend: Matrix2::zeros(),
    };
    // a polynomial g times exp(−(x−a)² − (y−b)²), with the derivatives of g
    let mut add = |g: [f64; 6], a: f64, b: f64| {
        let [g, gx, gy, gxx, gxy, gyy] = g;
        let (u, v) = (-2.0 * (x - a), -2.0 * (y - b));
        let e = (-(x - a).powi(2) - (y - b).powi(2)).exp();
        sum.z += g * e;
        sum.slope += Vector2::new(gx + g * u, gy + g * v) * e;
        let xx = gxx + 2.0 * gx * u + g * (u * u - 2.0);
        let xy = gxy + gx * v + gy * u + g * u * v;
        let yy = gyy + 2.0 * gy * v + g * (v * v - 2.0);
        sum.bend += Matrix2::new(xx, xy, xy, yy) * e;
    };
    add(
        [
            3.0 * (1.0 - x).powi(2),
            -6.0 * (1.0 - x),
            0.0,
            6.0,
            0.0,
            0.0,
        ],
        0.0,
        -1.0,
    );
    let (x2, y3) = (x * x, y * y * y);
    let g = -10.0 * (x / 5.0 - x2 * x - y3 * y * y);
    add(
        [
            g,
            -2.0 + 30.0 * x2,
            50.0 * y3 * y,
            60.0 * x,
            0.0,
            200.0 * y3,
        ],
        0.0,
        0.0,
    );
    add([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0], -1.0, 0.0);
    let scale = HEIGHT / (RANGE[1] - RANGE[0]);
    let middle = (RANGE[0] + RANGE[1]) / 2.0;
    Jet {
        z: scale * (sum.z - middle),
        slope: sum.slope * (scale / UNIT),
        bend: sum.bend * (scale / UNIT / UNIT),
    }
}

/// Newton's method for the stationary distance to `p`, damped so that the distance never grows.
fn descend(p: &Point3<f64>, start: Point2<f64>) -> Point2<f64> {
    let half_square =
        |q: &Point2<f64>, z: f64| ((q - p.xy()).norm_squared() + (z - p.z).powi(2)) / 2.0;
    let mut q = start;
    for _ in 0..MAX_STEPS {
        let j = jet(&q);
        let gradient = (q - p.xy()) + j.slope * (j.z - p.z);
        let tangent = Matrix2::identity() + j.slope * j.slope.transpose();
        let full = tangent + j.bend * (j.z - p.z);
        // without the bend the matrix is positive definite and the step always goes down
        let hessian = if full.determinant() > 0.0 && full.trace() > 0.0 {
            full
        } else {
            tangent
        };
        let step = hessian
            .try_inverse()
            .map_or(gradient, |inverse| inverse * gradient);
        let now = half_square(&q, j.z);
        let next = (0..40)
            .map(|k| q - step * 0.5f64.powi(k))
            .find(|x| half_square(x, jet(x).z) < now);
        let Some(next) = next else { return q };
        q = next;
    }
    q
}

fn on_surface(q: &Point2<f64>) -> SurfacePoint {
    let j = jet(q);
    SurfacePoint {
        point: Point3::new(q.x, q.y, j.z),
        normal: Vector3::new(-j.slope.x, -j.slope.y, 1.0).normalize(),
    }
}

impl Surface for Peaks {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        (p - self.closest(p).point)
            .norm()
            .copysign(p.z - self.height(p.x, p.y))
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        // the surface has a point straight above or below: none farther sideways can be closer
        let reach = (p.z - self.height(p.x, p.y)).abs();
        self.dips(p, reach)
            .into_iter()
            .min_by(|a, b| {
                (p - a.point)
                    .norm_squared()
                    .total_cmp(&(p - b.point).norm_squared())
            })
            .expect("the search starts at least straight above or below the point")
    }

    fn bounds(&self) -> Bounds {
        let half = Vector3::new(SIDE, SIDE, HEIGHT) / 2.0;
        Bounds {
            min: Point3::from(-half),
            max: Point3::from(half),
        }
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        found.extend(
            self.dips(p, reach)
                .into_iter()
                .filter(|dip| (p - dip.point).norm() <= reach),
        );
    }
}
