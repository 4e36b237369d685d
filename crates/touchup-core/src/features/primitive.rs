//! The surfaces that machined parts are made of, and how each is found from faces: by their normals first, then by least
//! squares over their corners.

use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

use super::facets::Facets;
use crate::mesh::FaceId;
use crate::numeric::{NormalEquations, tangent_basis};

/// Which side of a curved surface the material is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// the air is on the side of the axis: a hole
    Hole,
    /// the material is on the side of the axis: a boss
    Boss,
}

/// A surface without ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Primitive {
    /// a plane
    Plane {
        /// a point of it, m, in O
        point: Point3<f64>,
        /// outward unit normal
        normal: Vector3<f64>,
    },
    /// a round cylinder
    Cylinder {
        /// a point of the axis, m, in O
        point: Point3<f64>,
        /// unit vector
        axis: Vector3<f64>,
        /// m
        radius: f64,
        /// where the material is
        side: Side,
    },
    /// one half of a round cone
    Cone {
        /// m, in O
        apex: Point3<f64>,
        /// unit vector from the apex into the cone
        axis: Vector3<f64>,
        /// between axis and surface, rad
        half_angle: f64,
        /// where the material is
        side: Side,
    },
}

impl Side {
    fn sign(self) -> f64 {
        match self {
            Self::Hole => -1.0,
            Self::Boss => 1.0,
        }
    }
}

impl Primitive {
    /// Signed distance of `p`, m: positive in the air.
    #[inline]
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        match self {
            Self::Plane { point, normal } => (p - point).dot(normal),
            Self::Cylinder { point, axis, radius, side } => {
                let v = p - point;
                side.sign() * ((v - axis * v.dot(axis)).norm() - radius)
            }
            Self::Cone { apex, axis, half_angle, side } => {
                let v = p - apex;
                let t = v.dot(axis);
                side.sign() * ((v - axis * t).norm() * half_angle.cos() - t * half_angle.sin())
            }
        }
    }

    /// Outward unit normal at the foot of `p`.
    #[inline]
    pub fn normal_at(&self, p: &Point3<f64>) -> Vector3<f64> {
        let radial = |origin: &Point3<f64>, axis: &Vector3<f64>| {
            let v = p - origin;
            (v - axis * v.dot(axis)).try_normalize(0.0).unwrap_or_else(Vector3::zeros)
        };
        match self {
            Self::Plane { normal, .. } => *normal,
            Self::Cylinder { point, axis, side, .. } => radial(point, axis) * side.sign(),
            Self::Cone { apex, axis, half_angle, side } => {
                (radial(apex, axis) * half_angle.cos() - axis * half_angle.sin()) * side.sign()
            }
        }
    }
}

/// Sums over faces that determine a plane: exact moments of their area.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    origin: Point3<f64>,
    area: f64,
    first: Vector3<f64>,
    /// lower triangle
    second: Matrix3<f64>,
    normals: Vector3<f64>,
}

/// Rows and columns of the lower triangle of a symmetric matrix.
const LOWER: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

impl Moments {
    /// - `origin`: near the faces, so that squares stay small.
    pub fn about(origin: Point3<f64>) -> Self {
        Self { origin, area: 0.0, first: Vector3::zeros(), second: Matrix3::zeros(), normals: Vector3::zeros() }
    }

    pub fn add(&mut self, facets: &Facets, face: u32) {
        let area = facets.area(face);
        let corners = facets.mesh.corners(FaceId(face)).map(|vertex| facets.mesh.position(vertex) - self.origin);
        let sum = corners[0] + corners[1] + corners[2];
        self.area += area;
        self.first += sum * (area / 3.0);
        // ∫ x xᵀ over a triangle: A/12 (Σ vᵢ vᵢᵀ + (Σ vᵢ)(Σ vᵢ)ᵀ)
        for (i, j) in LOWER {
            let square = corners.iter().fold(sum[i] * sum[j], |sum, v| sum + v[i] * v[j]);
            self.second[(i, j)] += square * (area / 12.0);
        }
        self.normals += facets.normal(face) * area;
    }

    /// The plane through the middle of the area, square to its thinnest direction; `None` without area.
    pub fn plane(&self) -> Option<Primitive> {
        let mean = self.first / self.area;
        let mut second = self.second;
        second.fill_upper_triangle_with_lower_triangle();
        let spread = second / self.area - mean * mean.transpose();
        let towards = self.normals.try_normalize(0.0)?;
        if !spread.iter().all(|x| x.is_finite()) {
            return None;
        }
        let eigen = spread.symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        // faces on a line have no thinnest direction of their own
        let cosine = normal.dot(&towards);
        let normal = if cosine.abs() > 0.9 { normal * cosine.signum() } else { towards };
        Some(Primitive::Plane { point: self.origin + mean, normal })
    }
}

/// Statistics of the normals of a curved surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalSpread {
    /// largest standard deviation of the normals from their mean
    pub spread: f64,
    /// second moments of the normals
    second: Matrix3<f64>,
}

impl NormalSpread {
    pub fn of(facets: &Facets, faces: &[u32]) -> Option<Self> {
        let (mut area, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for &face in faces {
            let (a, n) = (facets.area(face), facets.normal(face));
            area += a;
            first += n * a;
            LOWER.iter().for_each(|&(i, j)| second[(i, j)] += n[i] * n[j] * a);
        }
        if area <= 0.0 {
            return None;
        }
        second.fill_upper_triangle_with_lower_triangle();
        let (mean, second) = (first / area, second / area);
        let spread = root((second - mean * mean.transpose()).symmetric_eigenvalues().max());
        Some(Self { spread, second })
    }

    /// Axis of the cylinder whose normals these could be: the direction along which there is least of them.
    pub fn cylinder_axis(&self) -> Option<Vector3<f64>> {
        let eigen = self.second.symmetric_eigen();
        let mut pairs = [0, 1, 2].map(|i| (eigen.eigenvalues[i], eigen.eigenvectors.column(i).into_owned()));
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        (root(pairs[0].0) < CLEAR * root(pairs[1].0)).then_some(pairs[0].1)
    }
}

/// Rounding may leave less than nothing.
fn root(x: f64) -> f64 {
    x.max(0.0).sqrt()
}

/// The direction without normals is clear when they differ so much more in the next.
const CLEAR: f64 = 0.5;

/// The cylinder with this axis whose normals these are: the lines along them meet at its axis.
pub(super) fn cylinder_of(facets: &Facets, faces: &[u32], axis: &Vector3<f64>) -> Option<Primitive> {
    let [e, g] = tangent_basis(axis);
    let flat = |v: &Vector3<f64>| SVector::<f64, 2>::new(v.dot(&e), v.dot(&g));
    let origin = facets.triangle(faces[0])[0];
    let (mut m, mut right) = (SMatrix::<f64, 2, 2>::zeros(), SVector::<f64, 2>::zeros());
    for &face in faces {
        let corners = facets.triangle(face);
        let middle = (corners[0] - origin + (corners[1] - origin) + (corners[2] - origin)) / 3.0;
        let n = flat(&facets.normal(face));
        let across = (SMatrix::<f64, 2, 2>::identity() * n.norm_squared() - n * n.transpose()) * facets.area(face);
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
    let side = if inward > 0.0 { Side::Hole } else { Side::Boss };
    Some(Primitive::Cylinder { point: centre, axis: *axis, radius: reach / count, side })
}

/// Rounds of least squares.
const ROUNDS: usize = 6;
/// A step below this share of the size ends them.
const REST: f64 = 1e-7;
/// How much a normal counts beside a corner: as an arm of this share of the radius.
const NORMAL_ARM: f64 = 0.2;

/// The curved surface moved to the least squares over corners and normals of the faces; planes stay as they are.
pub(super) fn refined(primitive: &Primitive, facets: &Facets, faces: &[u32]) -> Option<Primitive> {
    match *primitive {
        _ if faces.is_empty() => None,
        Primitive::Plane { .. } => Some(*primitive),
        Primitive::Cylinder { .. } => refined_cylinder(primitive, facets, faces),
        Primitive::Cone { .. } => refined_cone(primitive, facets, faces),
    }
}

fn refined_cylinder(start: &Primitive, facets: &Facets, faces: &[u32]) -> Option<Primitive> {
    let Primitive::Cylinder { mut point, mut axis, mut radius, side } = *start else { return None };
    // the axis turns about the middle of the faces
    let along: f64 =
        faces.iter().map(|&f| (facets.triangle(f)[0] - point).dot(&axis)).sum::<f64>() / faces.len() as f64;
    point += axis * along;
    let step = faces.len().div_ceil(MOST_ROWS);
    for _ in 0..ROUNDS {
        let [e, g] = tangent_basis(&axis);
        let mut normal = NormalEquations::<5>::default();
        for (at, &face) in faces.iter().step_by(step).enumerate() {
            let mut corner = |p: &Point3<f64>| {
                let v = p - point;
                let t = v.dot(&axis);
                let q = v - axis * t;
                let distance = q.norm();
                let u = q / distance.max(f64::MIN_POSITIVE);
                let (ue, ug) = (u.dot(&e), u.dot(&g));
                normal.add(&[ue, ug, t * ue, t * ug, 1.0].into(), distance - radius, 1.0);
            };
            let corners = facets.triangle(face);
            match faces.len() < FEW {
                true => corners.iter().for_each(&mut corner),
                false => corner(&corners[at % 3]),
            }
            let n = facets.normal(face);
            let arm = NORMAL_ARM * radius;
            normal.add(&[0.0, 0.0, n.dot(&e) * arm, n.dot(&g) * arm, 0.0].into(), -n.dot(&axis) * arm, 1.0);
        }
        let x = normal.solution()?;
        point += e * x[0] + g * x[1];
        axis = (axis + e * x[2] + g * x[3]).normalize();
        radius += x[4];
        if !(radius > 0.0 && radius.is_finite()) {
            return None;
        }
        if x.norm() < REST * radius {
            break;
        }
    }
    Some(Primitive::Cylinder { point, axis, radius, side })
}

/// Of fewer faces all corners count, of more one each: neighbours share theirs.
const FEW: usize = 40;
/// So many faces are enough while a region grows.
const MOST_ROWS: usize = 500;

fn refined_cone(start: &Primitive, facets: &Facets, faces: &[u32]) -> Option<Primitive> {
    let Primitive::Cone { mut apex, mut axis, mut half_angle, side } = *start else { return None };
    let step = faces.len().div_ceil(MOST_ROWS);
    for _ in 0..ROUNDS {
        let [e, g] = tangent_basis(&axis);
        let (sine, cosine) = half_angle.sin_cos();
        let (mut normal, mut size) = (NormalEquations::<6>::default(), 0.0f64);
        for p in faces.iter().step_by(step).flat_map(|&face| facets.triangle(face)) {
            let v = p - apex;
            let t = v.dot(&axis);
            let q = v - axis * t;
            let distance = q.norm();
            let u = q / distance.max(f64::MIN_POSITIVE);
            let slope = t * cosine + distance * sine;
            let (ue, ug) = (u.dot(&e), u.dot(&g));
            let row = [ue * cosine, ug * cosine, -sine, ue * slope, ug * slope, slope];
            normal.add(&row.into(), distance * cosine - t * sine, 1.0);
            size = size.max(distance);
        }
        let x = normal.solution()?;
        apex += e * x[0] + g * x[1] + axis * x[2];
        axis = (axis + e * x[3] + g * x[4]).normalize();
        half_angle += x[5];
        if !(half_angle > 0.0 && half_angle < std::f64::consts::FRAC_PI_2) {
            return None;
        }
        if x.norm() < REST * size {
            break;
        }
    }
    Some(Primitive::Cone { apex, axis, half_angle, side })
}
