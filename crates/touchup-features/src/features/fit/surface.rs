//! Interface of all fitted surfaces: a pose and up to two sizes.

use nalgebra::{Isometry3, Point3, SVector, Translation3, UnitQuaternion, Vector3};

use super::FitError;

/// Number of [`Freedom`]s.
pub const FREEDOMS: usize = 8;

/// A small change of each freedom, m or rad, indexed by [`Freedom`].
pub type Steps = SVector<f64, FREEDOMS>;

/// One degree of freedom of a surface. Directions are in its own frame F, whose z is its axis or
/// normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Shift along x of F, m.
    X,
    /// Shift along y of F, m.
    Y,
    /// Shift along z of F, m.
    Z,
    /// z leans towards x, rad.
    TiltX,
    /// z leans towards y, rad.
    TiltY,
    /// Turn about z, rad.
    Turn,
    /// First size: radius of a cylinder, shift of a cone along its normal, width of a slot; m.
    Size,
    /// Second size: half angle of a cone (rad), length of a slot (m).
    Second,
}

impl Freedom {
    /// All, in the order of [`Steps`].
    pub const ALL: [Self; FREEDOMS] = [
        Self::X,
        Self::Y,
        Self::Z,
        Self::TiltX,
        Self::TiltY,
        Self::Turn,
        Self::Size,
        Self::Second,
    ];
}

/// Position of a point relative to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Signed distance, m, positive in the air.
    pub value: f64,
    /// Its gradient in F: the unit normal into the air at the nearest place.
    pub normal: Vector3<f64>,
    /// Its derivatives by the two sizes.
    pub by_size: [f64; 2],
}

/// A surface that [`super::fit`] can fit.
pub trait SurfaceModel: Clone {
    /// Names of its freedoms in errors; `None`: it lacks the freedom.
    const NAMES: [Option<&'static str>; FREEDOMS];
    /// Its freedoms.
    const FREE: [bool; FREEDOMS] = are_named(Self::NAMES);
    /// Freedoms without which a fit is worthless; the others may come out undetermined.
    const NEEDED: [bool; FREEDOMS] = Self::FREE;
    /// Whether its second size is a length.
    const SECOND_IS_LENGTH: bool = false;

    /// Maps its own frame F to O.
    fn pose_of(&self) -> &Isometry3<f64>;

    /// Distance of a point given in F.
    fn distance_at(&self, q: &Vector3<f64>) -> Distance;

    /// The same shape with another pose, and its sizes changed by `by`.
    fn with(&self, pose_of: Isometry3<f64>, by: [f64; 2]) -> Self;

    /// The same surface, described from its place amid points in F, at least one.
    fn described_from(&self, points: &[Vector3<f64>]) -> Self;

    /// Refuses sizes outside the range of the surface.
    ///
    /// # Errors
    /// [`FitError::BadSize`].
    fn check(&self) -> Result<(), FitError>;

    /// Map of points from O to F, for repeated use.
    fn to_own(&self) -> impl Fn(&Point3<f64>) -> Vector3<f64> + use<Self> {
        let (center, turn) = (self.center(), self.pose_of().rotation.to_rotation_matrix());
        move |point| turn.inverse_transform_vector(&(point - center))
    }

    /// Origin of F, m, in O: a point of a plane or of the axis of a cylinder, the centre of the
    /// circle of a cone, or of a slot.
    fn center(&self) -> Point3<f64> {
        self.pose_of().translation.vector.into()
    }

    /// Radius of its sections across its axis, m; `None` if flat.
    fn section_radius(&self) -> Option<f64> {
        None
    }

    /// Its axis or normal: z of F, in O.
    fn axis(&self) -> Vector3<f64> {
        self.pose_of().rotation * Vector3::z()
    }

    /// Its axis or normal, with the sign of a direction.
    fn axis_towards(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let axis = self.axis();
        if axis.dot(direction) < 0.0 {
            -axis
        } else {
            axis
        }
    }

    /// Signed distance of a point in O, m, positive in the air.
    #[inline]
    fn distance(&self, point: &Point3<f64>) -> f64 {
        self.distance_at(&self.pose_of().inverse_transform_point(point).coords)
            .value
    }

    /// Signed distance of a point in O, m, and the unit normal into the air at the nearest place,
    /// in O.
    #[inline]
    fn distance_and_normal(&self, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let Distance { value, normal, .. } =
            self.distance_at(&self.pose_of().inverse_transform_point(point).coords);
        (value, self.pose_of().rotation * normal)
    }

    /// Signed distance of a point in O and its derivatives by each freedom; 0 for missing ones.
    #[inline]
    fn derivatives(&self, point: &Point3<f64>) -> (f64, Steps) {
        self.derivatives_at(&self.pose_of().inverse_transform_point(point).coords)
    }

    /// [`Self::derivatives`] at a point given in F.
    ///
    /// Shifting F by t and turning it by ω (both in F) takes a fixed point from q to q − t − ω × q,
    /// so with the normal n the derivatives are −n by t and −q × n by ω; a tilt towards x is ω =
    /// (0, 1, 0), towards y (−1, 0, 0).
    #[inline]
    fn derivatives_at(&self, q: &Vector3<f64>) -> (f64, Steps) {
        let Distance {
            value,
            normal: n,
            by_size,
        } = self.distance_at(q);
        let turn = -q.cross(&n);
        let all = [
            -n.x, -n.y, -n.z, turn.y, -turn.x, turn.z, by_size[0], by_size[1],
        ];
        (
            value,
            Steps::from_fn(|i, _| if Self::FREE[i] { all[i] } else { 0.0 }),
        )
    }

    /// The surface after a step in each of its freedoms.
    fn moved(&self, steps: &Steps) -> Self {
        let shift = Translation3::new(steps[0], steps[1], steps[2]);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(-steps[4], steps[3], steps[5]));
        self.with(
            self.pose_of() * Isometry3::from_parts(shift, turn),
            [steps[6], steps[7]],
        )
    }

    /// Number of its freedoms.
    fn freedom_count() -> usize {
        Self::FREE.iter().filter(|free| **free).count()
    }
}

const fn are_named(names: [Option<&'static str>; FREEDOMS]) -> [bool; FREEDOMS] {
    let (mut free, mut at) = ([false; FREEDOMS], 0);
    while at < FREEDOMS {
        free[at] = names[at].is_some();
        at += 1;
    }
    free
}

/// Names of freedoms that several surfaces share.
pub(super) const AXIS: Option<&str> = Some("direction of the axis");
pub(super) const CENTRE: Option<&str> = Some("centre");
pub(super) const RADIUS: Option<&str> = Some("radius");

/// Distance of a point from the z axis and the unit vector away from it; x on the axis itself, as
/// every one will do.
#[inline]
pub(super) fn radial(q: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let rho = q.xy().norm();
    (
        rho,
        if rho > 0.0 {
            Vector3::new(q.x / rho, q.y / rho, 0.0)
        } else {
            Vector3::x()
        },
    )
}

/// +1 for inner material (a boss), −1 for inner air (a hole).
#[inline]
pub(super) fn side(concave: bool) -> f64 {
    if concave { -1.0 } else { 1.0 }
}

/// Refuses a size that is not more than 0.
pub(super) fn check_size(what: &'static str, value: f64) -> Result<(), FitError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(FitError::BadSize { what, value })
    }
}

/// The frame at a point whose z is a direction of any length but 0.
pub(super) fn pose_along(point: Point3<f64>, z: &Vector3<f64>) -> Isometry3<f64> {
    let across = if z.x.abs() < 0.5 * z.norm() {
        Vector3::x()
    } else {
        Vector3::y()
    };
    Isometry3::from_parts(point.into(), UnitQuaternion::face_towards(z, &across))
}
