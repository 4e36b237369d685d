//! First guesses from places with normals.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, SymmetricEigen, UnitQuaternion, Vector2, Vector3};

/// Directions whose spread is below this share of the largest are taken for none: 1° of normals about their mean.
const NO_SPREAD: f64 = 3e-4;

/// A place on a surface: a vertex with its normal, or the barycentre of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedPoint {
    /// m, in O
    pub point: Point3<f64>,
    /// Unit normal into the air, in O.
    pub normal: Vector3<f64>,
    /// How much it counts, > 0: the area of the face.
    pub weight: f64,
}

/// The frame at a point whose z is a direction of any length but 0.
pub(super) fn pose_along(point: Point3<f64>, z: &Vector3<f64>) -> Isometry3<f64> {
    let across = if z.x.abs() < 0.5 * z.norm() { Vector3::x() } else { Vector3::y() };
    Isometry3::from_parts(point.into(), UnitQuaternion::face_towards(z, &across))
}

/// An axis, a circle around it, and how the normals stand to it.
pub(super) struct AxisGuess {
    /// origin: centre of the circle; z: the axis
    pub pose_of: Isometry3<f64>,
    pub radius: f64,
    /// whether the normals point to the axis
    pub concave: bool,
    /// mean of normal · z
    pub along: f64,
}

impl AxisGuess {
    /// The axis is across all normals.
    pub fn across_normals(faces: &[OrientedPoint]) -> Option<Self> {
        Self::with_axis(faces, &least_direction(faces, &Vector3::zeros())?)
    }

    /// The axis is the normal of the plane on which the tips of the normals lie.
    pub fn of_tips(faces: &[OrientedPoint]) -> Option<Self> {
        let mean = faces.iter().map(|f| f.normal * f.weight).sum::<Vector3<f64>>() / total(faces);
        Self::with_axis(faces, &least_direction(faces, &mean)?)
    }

    /// Where the lines along the normals pass the axis closest: Σ w (I − n nᵀ)(c − p) = 0 in the plane across it.
    fn with_axis(faces: &[OrientedPoint], axis: &Vector3<f64>) -> Option<Self> {
        let weight = total(faces);
        let mean = faces.iter().map(|f| f.point.coords * f.weight).sum::<Vector3<f64>>() / weight;
        let upright = pose_along(mean.into(), axis);
        let (mut a, mut b) = (Matrix2::zeros(), Vector2::zeros());
        for face in faces {
            let Some(n) = upright.inverse_transform_vector(&face.normal).xy().try_normalize(NO_SPREAD) else {
                continue;
            };
            let across = (Matrix2::identity() - n * n.transpose()) * face.weight;
            a += across;
            b += across * upright.inverse_transform_point(&face.point).coords.xy();
        }
        // parallel lines meet nowhere
        let center = (a.determinant() > (NO_SPREAD * weight).powi(2)).then(|| a.try_inverse())?? * b;
        let pose_of = upright * nalgebra::Translation3::new(center.x, center.y, 0.0);
        let (mut radius, mut outward, mut along) = (0.0, 0.0, 0.0);
        for face in faces {
            let q = pose_of.inverse_transform_point(&face.point).coords.xy();
            let n = pose_of.inverse_transform_vector(&face.normal);
            radius += face.weight * q.norm() / weight;
            outward += face.weight * q.dot(&n.xy());
            along += face.weight * n.z / weight;
        }
        (radius > 0.0 && radius.is_finite()).then_some(Self { pose_of, radius, concave: outward < 0.0, along })
    }
}

fn total(faces: &[OrientedPoint]) -> f64 {
    faces.iter().map(|f| f.weight).sum()
}

/// The unit vector along which the normals, taken from `from`, spread least; `None` unless they spread in two others.
fn least_direction(faces: &[OrientedPoint], from: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut spread = Matrix3::zeros();
    for face in faces {
        let n = face.normal - from;
        spread += n * n.transpose() * face.weight;
    }
    if !spread.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let [least, middle, most] = order.map(|i| eigen.eigenvalues[i]);
    let is_fixed = most > 0.0 && middle > NO_SPREAD * most && middle > least;
    is_fixed.then(|| eigen.eigenvectors.column(order[0]).into())
}
