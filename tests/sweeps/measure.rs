//! How far a mesh is from the truth, and how that falls from sweep to sweep.

use nalgebra::{Point3, Vector3};
use touchup::mesh::TriMesh;
use touchup::sim::Surface;

/// Errors of one mesh against the truth.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// mean distance error of the faces, m
    pub distance: f64,
    /// mean normal deviation of the faces, rad, up to π
    pub normal: f64,
    /// faces turned away from the truth by more than a right angle
    pub flipped: usize,
    /// farthest vertex, or the farthest face plane where faces are compared by index, m
    pub farthest: f64,
}

impl Errors {
    pub fn row(&self) -> String {
        let Self { distance, normal, flipped, farthest } = *self;
        let (mm, deg) = (1e3 * distance, normal.to_degrees());
        format!("{mm:8.3} mm {deg:6.2} deg {flipped:3} flipped, farthest {:7.2} mm", 1e3 * farthest)
    }
}

/// The angle between two directions; |a × b| alone would call a flipped face right.
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// The paper's metrics: face by face, |(b* − b)·n| and the angle between n* and n.
pub fn by_index(mesh: &TriMesh, truth: &TriMesh) -> Errors {
    let pairs = truth.faces().map(|(face, _)| {
        let n = truth.normal(face);
        ((mesh.barycentre(face) - truth.barycentre(face)).dot(&n).abs(), angle(&mesh.normal(face), &n))
    });
    let pairs: Vec<_> = pairs.collect();
    collect(&pairs, pairs.iter().map(|pair| pair.0).fold(0.0, f64::max))
}

/// Distance of the faces' barycentres and of the vertices from the true surface, angle to its normal there.
pub fn by_surface(mesh: &TriMesh, truth: &dyn Surface) -> Errors {
    let pairs = mesh.faces().map(|(face, _)| {
        let (b, n) = (mesh.barycentre(face), mesh.normal(face));
        let closest = truth.closest(&b);
        ((b - closest.point).norm(), angle(&n, &closest.normal))
    });
    let far = |p: &Point3<f64>| truth.signed_distance(p).abs();
    collect(&pairs.collect::<Vec<_>>(), mesh.positions().iter().map(far).fold(0.0, f64::max))
}

fn collect(pairs: &[(f64, f64)], farthest: f64) -> Errors {
    let mean = |value: fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
    let flipped = pairs.iter().filter(|pair| pair.1 > std::f64::consts::FRAC_PI_2).count();
    Errors { distance: mean(|pair| pair.0), normal: mean(|pair| pair.1), flipped, farthest }
}

/// Twice the area over the longest edge squared, for each face: √3/2 at best, 0 without area.
pub fn qualities(mesh: &TriMesh) -> Vec<f64> {
    let quality = |[a, b, c]: [Point3<f64>; 3]| {
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        (b - a).cross(&(c - a)).norm() / (longest * longest)
    };
    mesh.faces().map(|(face, _)| quality(mesh.triangle(face))).collect()
}

/// A line through (x, y) by least squares: slope, and root mean square of what it leaves in y.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    let slope = xy / xx;
    let left = points.iter().map(|p| (p.1 - y - slope * (p.0 - x)).powi(2)).sum::<f64>() / n;
    (slope, left.sqrt())
}

/// Rate or exponent, and the root mean square error of the fit to the logarithms.
#[derive(Clone, Copy, Debug)]
pub struct Decay {
    /// e ∝ exp(−rate · sweep), sweeps 1 and later
    pub exponential: (f64, f64),
    /// e ∝ sweep^−exponent, sweeps 1 and later
    pub power: (f64, f64),
}

/// Fits both laws to the errors after sweep 1, 2, 3, …
pub fn fit_decay(errors: &[f64]) -> Decay {
    let fit = |x: fn(f64) -> f64| {
        let points: Vec<_> = errors.iter().enumerate().map(|(i, e)| (x(i as f64 + 1.0), e.ln())).collect();
        let (slope, left) = line(&points);
        (-slope, left)
    };
    Decay { exponential: fit(|sweep| sweep), power: fit(f64::ln) }
}
