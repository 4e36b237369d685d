//! First guesses of a surface from contacts around a place.

use nalgebra::{Matrix2, Matrix3, Point3, SVector, Vector2, Vector3};

use super::contact::ContactCell;
use crate::features::fit::{Cone, Cylinder, Plane};
use crate::features::segmentation::primitive::Primitive;
use touchup_geometry::numeric::{NormalEquations, tangent_basis, thinnest_direction};

/// Sines of the sharpest and of the flattest half angle of a cone: 10° and 80°.
const SINES: std::ops::Range<f64> = 0.17..0.985;
/// Cosine of the lean of contacts of one plane: 32°.
const ALIKE: f64 = 0.85;
/// Width from which contacts determine a tilt, in radii of the ball.
const WIDE: f64 = 0.25;
/// Root mean square component of normals along the axis of a cylinder.
const ALONG: f64 = 0.25;
/// Minimum length of the mean normal of a plane.
const LEAST_NORMAL: f64 = 0.5;

/// Sums over contacts.
struct ContactMean {
    /// m
    centre: Vector3<f64>,
    normal: Vector3<f64>,
    /// m
    radius: f64,
    /// of the centres, m²
    scatter: Matrix3<f64>,
    /// second moments of the normals
    normals: Matrix3<f64>,
}

impl ContactMean {
    fn of(near: &[&ContactCell]) -> Self {
        let count = near.len() as f64;
        let centre = near
            .iter()
            .map(|one| one.centre.coords)
            .sum::<Vector3<f64>>()
            / count;
        let square = |v: Vector3<f64>| v * v.transpose() / count;
        Self {
            centre,
            normal: near.iter().map(|one| one.normal).sum::<Vector3<f64>>() / count,
            radius: near.iter().map(|one| one.radius).sum::<f64>() / count,
            scatter: near
                .iter()
                .map(|one| square(one.centre.coords - centre))
                .sum(),
            normals: near.iter().map(|one| square(one.normal)).sum(),
        }
    }
}

/// Planes, cylinders and cones that may explain contacts around a seed.
pub(super) fn guesses_around(
    seed: &ContactCell,
    near: &[&ContactCell],
    axes: &[Vector3<f64>],
) -> Vec<Primitive> {
    if seed.land.is_some() {
        return at_edge(near);
    }
    let is_alike = |one: &&&ContactCell| one.normal.dot(&seed.normal) > ALIKE;
    let alike: Vec<&ContactCell> = near.iter().filter(is_alike).copied().collect();
    plane(&alike)
        .into_iter()
        .chain(curved(near, axes))
        .collect()
}

/// Planes, cylinders and cones that may explain contacts.
pub(super) fn guesses(near: &[&ContactCell], axes: &[Vector3<f64>]) -> Vec<Primitive> {
    plane(near).into_iter().chain(curved(near, axes)).collect()
}

/// Walls below an edge, square to the land beside it.
fn at_edge(near: &[&ContactCell]) -> Vec<Primitive> {
    let lands = near
        .iter()
        .filter_map(|one| Some(one.land.as_ref()?.normal));
    let Some(land) = lands.sum::<Vector3<f64>>().try_normalize(0.0) else {
        return Vec::new();
    };
    let mean = ContactMean::of(near);
    let normal = mean.normal - land * mean.normal.dot(&land);
    let plane = normal
        .try_normalize(LEAST_NORMAL)
        .map(|normal| Primitive::Plane(Plane::new(Point3::from(mean.centre), &normal)));
    plane.into_iter().chain(cylinder(near, &land)).collect()
}

/// Cylinders along the straightest and the flattest directions, and along known axes that may be
/// theirs, and a cone.
fn curved(near: &[&ContactCell], axes: &[Vector3<f64>]) -> Vec<Primitive> {
    let mean = ContactMean::of(near);
    let thin = thinnest_direction(mean.scatter);
    let thin = thin * thin.dot(&mean.normal).signum();
    let is_along = |axis: &&Vector3<f64>| axis.dot(&(mean.normals * *axis)) < ALONG * ALONG;
    let straight = straightest(near, &Point3::from(mean.centre), &thin);
    let own = straight
        .into_iter()
        .chain([thinnest_direction(mean.normals)]);
    let all = own.chain(axes.iter().filter(is_along).copied());
    let mut found: Vec<Primitive> = all.filter_map(|axis| cylinder(near, &axis)).collect();
    let axis = thinnest_direction(mean.normals - mean.normal * mean.normal.transpose());
    let sine = axis.dot(&mean.normal);
    if SINES.contains(&sine.abs()) {
        found.extend(cone(near, &axis, sine));
    }
    found
}

/// The plane through the centres of contacts, less the radius of the ball; along a line of them by
/// their normals.
fn plane(near: &[&ContactCell]) -> Option<Primitive> {
    let mean = ContactMean::of(near);
    let normal = mean.normal.try_normalize(LEAST_NORMAL)?;
    let eigen = mean.scatter.symmetric_eigen();
    let [least, most] = [eigen.eigenvalues.imin(), eigen.eigenvalues.imax()];
    if least == most {
        return None;
    }
    let width = eigen.eigenvalues[3 - least - most].max(0.0).sqrt();
    let longest = eigen.eigenvectors.column(most).into_owned();
    let thin = if width > WIDE * mean.radius {
        eigen.eigenvectors.column(least).into_owned()
    } else {
        (normal - longest * normal.dot(&longest)).try_normalize(0.0)?
    };
    let thin = thin * thin.dot(&normal).signum();
    let point = Point3::from(mean.centre - thin * mean.radius);
    Some(Primitive::Plane(Plane::new(point, &thin)))
}

/// Direction in which centres are straightest, by their curvature.
fn straightest(
    near: &[&ContactCell],
    mean: &Point3<f64>,
    normal: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    /// Share of a constant in a parabola whose coordinates are lengths, m.
    const CONSTANT: f64 = 1e-3;
    let [e, g] = tangent_basis(normal);
    let row = |one: &&ContactCell| {
        let v = one.centre - mean;
        let (x, y) = (v.dot(&e), v.dot(&g));
        (
            SVector::<f64, 6>::from([x * x / 2.0, x * y, y * y / 2.0, x, y, CONSTANT]),
            v.dot(normal),
        )
    };
    let by = NormalEquations::of(near.iter().map(row)).solution()?;
    let eigen = Matrix2::new(by[0], by[1], by[1], by[2]).symmetric_eigen();
    let least = usize::from(eigen.eigenvalues[1].abs() < eigen.eigenvalues[0].abs());
    let v = eigen.eigenvectors.column(least);
    (e * v[0] + g * v[1]).try_normalize(0.0)
}

/// The cylinder about an axis: the lines along the normals meet there, after one length all.
fn cylinder(near: &[&ContactCell], axis: &Vector3<f64>) -> Option<Primitive> {
    let basis = tangent_basis(axis);
    let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&basis[0]), v.dot(&basis[1]));
    // p + t m = c
    let rows = near.iter().flat_map(|one| {
        let (p, m) = (flat(&one.centre.coords), flat(&one.normal));
        [
            (SVector::<f64, 3>::from([1.0, 0.0, -m.x]), p.x),
            (SVector::<f64, 3>::from([0.0, 1.0, -m.y]), p.y),
        ]
    });
    let by = NormalEquations::of(rows).solution()?;
    let about = AxisPlace::new(near, axis, Vector2::new(by[0], by[1]))?;
    let cylinder = Cylinder::new(about.origin, axis, about.radius, about.is_concave);
    Some(Primitive::Cylinder(cylinder))
}

/// The cone about an axis: the lines along the normals come nearest to it.
///
/// - `sine`: component of the normals along the axis.
fn cone(near: &[&ContactCell], axis: &Vector3<f64>, sine: f64) -> Option<Primitive> {
    let basis = tangent_basis(axis);
    let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&basis[0]), v.dot(&basis[1]));
    let (mut m, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for one in near {
        let n = flat(&one.normal).try_normalize(0.0)?;
        let across = Matrix2::identity() - n * n.transpose();
        m += across;
        right += across * flat(&one.centre.coords);
    }
    let about = AxisPlace::new(near, axis, m.try_inverse()? * right)?;
    // the outward normal of a hollow cone that widens along its axis leans along it
    let half = sine.asin() * if about.is_concave { 1.0 } else { -1.0 };
    let cone = Cone::new(about.origin, axis, about.radius, half, about.is_concave);
    Some(Primitive::Cone(cone))
}

/// An axis, and contacts around it.
struct AxisPlace {
    /// its point beside the mean contact, m
    origin: Point3<f64>,
    /// mean distance of the contacts, m
    radius: f64,
    is_concave: bool,
}

impl AxisPlace {
    /// - `centre`: its place in the basis of the plane square to it, m.
    fn new(near: &[&ContactCell], axis: &Vector3<f64>, centre: Vector2<f64>) -> Option<Self> {
        let [e, g] = tangent_basis(axis);
        let count = near.len() as f64;
        let on_axis = e * centre.x + g * centre.y;
        let across = |v: Vector3<f64>| v - axis * v.dot(axis);
        let outwards = near.iter().map(|one| across(one.point.coords - on_axis));
        let radius = outwards.clone().map(|v| v.norm()).sum::<f64>() / count;
        let inward = outwards.zip(near).map(|(v, one)| -v.dot(&one.normal));
        let is_concave = inward.sum::<f64>() > 0.0;
        let height = near
            .iter()
            .map(|one| one.centre.coords.dot(axis))
            .sum::<f64>()
            / count;
        (radius > 0.0 && radius.is_finite()).then_some(Self {
            origin: Point3::from(on_axis + axis * height),
            radius,
            is_concave,
        })
    }
}
