//! Surfaces of machined parts, and their fits to faces: by normals first, then by least squares
//! over corners.

use nalgebra::{Matrix2, Matrix3, Point3, SVector, Vector2, Vector3};

use super::facets::Facets;
use crate::features::fit::{Cone, Cylinder, FREEDOMS, Freedom, Plane, Sphere, Steps, SurfaceModel};
use touchup_geometry::mesh::{FaceId, VertexId};
use touchup_geometry::numeric::{NormalEquations, tangent_basis, thinnest_direction};

/// The surface of a piece of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Primitive {
    /// flat
    Plane(Plane),
    /// constant radius
    Cylinder(Cylinder),
    /// radius growing along its axis
    Cone(Cone),
    /// one distance from its centre
    Sphere(Sphere),
}

impl Primitive {
    /// Signed distance of `p`, m: positive in the air; and the outward unit normal at its foot.
    #[inline]
    pub(crate) fn distance_and_normal(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        match self {
            Self::Plane(plane) => plane.distance_and_normal(p),
            Self::Cylinder(cylinder) => cylinder.distance_and_normal(p),
            Self::Cone(cone) => cone.distance_and_normal(p),
            Self::Sphere(sphere) => sphere.distance_and_normal(p),
        }
    }

    /// Signed distance of `p`, m: positive in the air.
    #[inline]
    pub(crate) fn distance(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Plane(plane) => plane.distance(p),
            Self::Cylinder(cylinder) => cylinder.distance(p),
            Self::Cone(cone) => cone.distance(p),
            Self::Sphere(sphere) => sphere.distance(p),
        }
    }

    /// The plane, if flat.
    #[inline]
    pub(crate) fn plane(&self) -> Option<&Plane> {
        if let Self::Plane(plane) = self {
            Some(plane)
        } else {
            None
        }
    }
}

/// Cosine of the tolerance between the normals of a face and its primitive: 25°.
pub(in crate::features) const FACES_ALIKE: f64 = 0.906;

/// Whether a face lies on the primitive within `tolerance` (m), with a like normal.
pub(in crate::features) fn belongs(
    facets: &Facets,
    face: u32,
    primitive: &Primitive,
    tolerance: f64,
) -> bool {
    let normal = match primitive {
        // most are planes: loads and computes no more than they need
        Primitive::Plane(plane) => {
            let (point, normal) = (plane.point(), plane.normal());
            let off = |vertex: VertexId| (facets.mesh.position(vertex) - point).dot(&normal).abs();
            facets
                .mesh
                .corners(FaceId(face))
                .into_iter()
                .all(|vertex| off(vertex) <= tolerance)
                .then_some(normal)
        }
        Primitive::Cylinder(cylinder) => normal_beneath(facets, face, cylinder, tolerance),
        Primitive::Cone(cone) => normal_beneath(facets, face, cone, tolerance),
        Primitive::Sphere(sphere) => normal_beneath(facets, face, sphere, tolerance),
    };
    normal.is_some_and(|normal| {
        facets.normal(face).dot(&normal) > FACES_ALIKE || {
            // the normal of a sliver is meaningless
            let corners = facets.triangle(face);
            let longest = (0..3)
                .map(|i| (corners[i] - corners[(i + 1) % 3]).norm())
                .fold(0.0, f64::max);
            2.0 * facets.area(face) < tolerance * longest
        }
    })
}

/// The normal of a surface beneath the middle of a face, in O; `None`: a corner is farther from it
/// than `tolerance`, m.
fn normal_beneath(
    facets: &Facets,
    face: u32,
    surface: &impl SurfaceModel,
    tolerance: f64,
) -> Option<Vector3<f64>> {
    let own = surface.to_own();
    let is_near = |p: &Point3<f64>| surface.distance_at(&own(p)).value.abs() <= tolerance;
    let middle = || {
        surface
            .distance_at(&own(&facets.mesh.barycentre(FaceId(face))))
            .normal
    };
    facets
        .triangle(face)
        .iter()
        .all(is_near)
        .then(|| surface.pose_of().rotation * middle())
}

/// Rows and columns of the lower triangle of a symmetric matrix.
const LOWER: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

/// The plane through the middle of the area of faces, square to its thinnest direction, by exact
/// moments of the area; `None` without area.
///
/// - `origin`: near the faces, so that squares stay small.
pub(in crate::features) fn plane_of(
    facets: &Facets,
    origin: Point3<f64>,
    faces: impl Iterator<Item = u32>,
) -> Option<Primitive> {
    let (mut all, mut first, mut second, mut normals) =
        (0.0, Vector3::zeros(), Matrix3::zeros(), Vector3::zeros());
    for face in faces {
        let area = facets.area(face);
        let corners = facets
            .mesh
            .corners(FaceId(face))
            .map(|vertex| facets.mesh.position(vertex) - origin);
        let sum = corners[0] + corners[1] + corners[2];
        all += area;
        first += sum * (area / 3.0);
        // ∫ x xᵀ over a triangle: A/12 (Σ vᵢ vᵢᵀ + (Σ vᵢ)(Σ vᵢ)ᵀ)
        for (i, j) in LOWER {
            let square = corners
                .iter()
                .fold(sum[i] * sum[j], |sum, v| sum + v[i] * v[j]);
            second[(i, j)] += square * (area / 12.0);
        }
        normals += facets.normal(face) * area;
    }
    let mean = first / all;
    second.fill_upper_triangle_with_lower_triangle();
    let spread = second / all - mean * mean.transpose();
    let towards = normals.try_normalize(0.0)?;
    if !spread.iter().all(|x| x.is_finite()) {
        return None;
    }
    let normal = thinnest_direction(spread);
    // faces on a line have no thinnest direction of their own
    let cosine = normal.dot(&towards);
    let normal = if cosine.abs() > 0.9 {
        normal * cosine.signum()
    } else {
        towards
    };
    Some(Primitive::Plane(Plane::new(origin + mean, &normal)))
}

/// Statistics of the normals of a curved surface.
#[derive(Clone, Copy, Debug)]
pub(in crate::features) struct NormalSpread {
    /// largest standard deviation of the normals from their mean
    pub spread: f64,
    /// second moments of the normals
    second: Matrix3<f64>,
}

impl NormalSpread {
    pub(crate) fn of(facets: &Facets, faces: &[u32]) -> Option<Self> {
        let (mut area, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for &face in faces {
            let (a, n) = (facets.area(face), facets.normal(face));
            area += a;
            first += n * a;
            LOWER
                .iter()
                .for_each(|&(i, j)| second[(i, j)] += n[i] * n[j] * a);
        }
        if area <= 0.0 {
            return None;
        }
        second.fill_upper_triangle_with_lower_triangle();
        let (mean, second) = (first / area, second / area);
        let spread = root(
            (second - mean * mean.transpose())
                .symmetric_eigenvalues()
                .max(),
        );
        Some(Self { spread, second })
    }

    /// Axis of a cylinder with these normals: the direction of their least second moment.
    pub(crate) fn cylinder_axis(&self) -> Option<Vector3<f64>> {
        let eigen = self.second.symmetric_eigen();
        let mut pairs = [0, 1, 2].map(|i| {
            (
                eigen.eigenvalues[i],
                eigen.eigenvectors.column(i).into_owned(),
            )
        });
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        (root(pairs[0].0) < CLEAR * root(pairs[1].0)).then_some(pairs[0].1)
    }
}

/// Root of a number that rounding may make negative.
fn root(x: f64) -> f64 {
    x.max(0.0).sqrt()
}

/// Maximum ratio of the normals' spread along a clear axis to the next one.
const CLEAR: f64 = 0.5;

/// The cylinder about this axis from normals: the lines along them meet at its axis.
pub(in crate::features) fn cylinder_of(
    facets: &Facets,
    faces: &[u32],
    axis: &Vector3<f64>,
) -> Option<Primitive> {
    let [e, g] = tangent_basis(axis);
    let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&e), v.dot(&g));
    let origin = facets.triangle(faces[0])[0];
    let (mut m, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for &face in faces {
        let corners = facets.triangle(face);
        let middle = (corners[0] - origin + (corners[1] - origin) + (corners[2] - origin)) / 3.0;
        let n = flat(&facets.normal(face));
        let across =
            (Matrix2::identity() * n.norm_squared() - n * n.transpose()) * facets.area(face);
        m += across;
        right += across * flat(&middle);
    }
    let centre = m.try_inverse()? * right;
    let centre = origin + e * centre.x + g * centre.y;
    let (mut reach, mut inward, mut count) = (0.0, 0.0, 0.0);
    for &face in faces {
        for p in facets.triangle(face) {
            let v = p - centre;
            let v = v - axis * v.dot(axis);
            reach += v.norm();
            count += 1.0;
            inward -= v.dot(&facets.normal(face)) * facets.area(face);
        }
    }
    Some(Primitive::Cylinder(Cylinder::new(
        centre,
        axis,
        reach / count,
        inward > 0.0,
    )))
}

/// Number of rounds of least squares.
const ROUNDS: usize = 6;
/// Step that ends the rounds, as a share of the radius.
const REST: f64 = 1e-7;
/// Weight of a normal beside a corner: as an arm of this share of the radius.
const NORMAL_ARM: f64 = 0.2;
/// Number of a cylinder's faces from which one corner each counts, not all: neighbours share
/// theirs.
const FEW: usize = 40;
/// Maximum number of faces in a fit while a region grows.
const MOST_ROWS: usize = 500;

/// The curved surface fitted by least squares to the corners of the faces, and a cylinder also to
/// their normals; planes stay the same.
pub(in crate::features) fn refined(
    primitive: &Primitive,
    facets: &Facets,
    faces: &[u32],
) -> Option<Primitive> {
    match primitive {
        _ if faces.is_empty() => None,
        Primitive::Plane(_) => Some(*primitive),
        Primitive::Cylinder(cylinder) => {
            moved_to::<_, 5>(cylinder, facets, faces, |cylinder| cylinder.radius, true)
                .map(Primitive::Cylinder)
        }
        Primitive::Cone(cone) => {
            let cone = moved_to::<_, 6>(cone, facets, faces, |cone| cone.radius, false);
            cone.filter(|cone| cone.half_angle > 0.0)
                .map(Primitive::Cone)
        }
        Primitive::Sphere(sphere) => {
            moved_to::<_, 4>(sphere, facets, faces, |sphere| sphere.radius, false)
                .map(Primitive::Sphere)
        }
    }
}

/// Least squares over the N freedoms of the surface.
///
/// - `are_square`: whether the normals of the surface are square to its axis; then those of the
///   faces count.
fn moved_to<S: SurfaceModel, const N: usize>(
    start: &S,
    facets: &Facets,
    faces: &[u32],
    radius: fn(&S) -> f64,
    are_square: bool,
) -> Option<S> {
    let free = const { numbers_of_free::<N>(S::FREE) };
    // the surface turns about the middle of the faces
    let own = start.to_own();
    let places: Vec<_> = faces
        .iter()
        .map(|&face| own(&facets.triangle(face)[0]))
        .collect();
    let mut surface = start.described_from(&places);
    for _ in 0..ROUNDS {
        let mut equations = NormalEquations::<N>::default();
        let (own, turn) = (surface.to_own(), surface.pose_of().rotation);
        for (at, &face) in faces
            .iter()
            .step_by(faces.len().div_ceil(MOST_ROWS))
            .enumerate()
        {
            let corners = facets.triangle(face);
            let is_one = are_square && faces.len() >= FEW;
            for corner in if is_one {
                &corners[at % 3..=at % 3]
            } else {
                &corners[..]
            } {
                let (distance, by) = surface.derivatives_at(&own(corner));
                equations.add(&SVector::from_fn(|i, _| by[free[i]]), -distance, 1.0);
            }
            if are_square {
                let normal = turn.inverse_transform_vector(&facets.normal(face));
                let [x, y, z] = (normal * (NORMAL_ARM * radius(&surface))).into();
                let by =
                    Steps::ith(Freedom::TiltX as usize, x) + Steps::ith(Freedom::TiltY as usize, y);
                equations.add(&SVector::from_fn(|i, _| by[free[i]]), -z, 1.0);
            }
        }
        let solution = equations.solution()?;
        let mut step = Steps::zeros();
        (0..N).for_each(|i| step[free[i]] = solution[i]);
        surface = surface.moved(&step);
        surface.check().ok()?;
        if step.norm() < REST * radius(&surface) {
            break;
        }
    }
    Some(surface)
}

/// Numbers of the freedoms of a surface.
pub(in crate::features) const fn numbers_of_free<const N: usize>(
    has: [bool; FREEDOMS],
) -> [usize; N] {
    let (mut numbers, mut count, mut freedom) = ([0; N], 0, 0);
    while freedom < FREEDOMS {
        if has[freedom] {
            numbers[count] = freedom;
            count += 1;
        }
        freedom += 1;
    }
    assert!(count == N, "the freedoms are counted wrongly");
    numbers
}
