//! The queries of a known surface: signed distance and closest point.

use nalgebra::{Isometry3, Point3, Vector3};

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// m, in O
    pub point: Point3<f64>,
    /// Unit normal of the surface there, out of the material; on an edge the normal of one adjacent
    /// piece.
    pub normal: Vector3<f64>,
}

/// Axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// smallest coordinates, m, in O
    pub min: Point3<f64>,
    /// largest coordinates, m, in O
    pub max: Point3<f64>,
}

impl Bounds {
    /// The smallest box around `points`; `None` without points.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Option<Self> {
        points.into_iter().fold(None, |bounds, p| {
            let Bounds { min, max } = bounds.unwrap_or(Bounds { min: *p, max: *p });
            Some(Bounds {
                min: min.inf(p),
                max: max.sup(p),
            })
        })
    }

    /// The box with every side moved outwards by `margin` (m).
    pub fn grown(&self, margin: f64) -> Self {
        let by = Vector3::repeat(margin);
        Self {
            min: self.min - by,
            max: self.max + by,
        }
    }

    /// The box around this one along the axes of a frame V.
    pub fn seen_from(&self, frame_ov: &Isometry3<f64>) -> Self {
        let frame_vo = frame_ov.inverse();
        let half = frame_vo.rotation.to_rotation_matrix().matrix().abs() * self.size() / 2.0;
        let centre = frame_vo * self.centre();
        Self {
            min: centre - half,
            max: centre + half,
        }
    }

    /// Length of the sides, m.
    pub fn size(&self) -> Vector3<f64> {
        self.max - self.min
    }

    /// Middle of the box, m, in O.
    pub fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.min, &self.max)
    }
}

/// An exactly known surface, with material behind it.
///
/// The distance of a point that is not finite is NaN, and so is its closest point.
pub trait Surface: Sync {
    /// Distance to the surface, m; positive outside the material, negative inside.
    fn signed_distance(&self, p: &Point3<f64>) -> f64;

    /// A point of the surface closest to `p`.
    fn closest(&self, p: &Point3<f64>) -> SurfacePoint;

    /// Box around the part of interest.
    fn bounds(&self) -> Bounds;

    /// Appends, for each smooth piece of the surface within `reach` (m) of `p`, its point closest
    /// to `p`: a possible contact of a ball around `p`. The closest of all is among them.
    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>);

    /// Unit vector along which the signed distance grows fastest: out of the material, also beside
    /// edges.
    fn outward(&self, p: &Point3<f64>) -> Vector3<f64> {
        let closest = self.closest(p);
        let offset = (p - closest.point) * self.signed_distance(p).signum();
        offset.try_normalize(COINCIDENT).unwrap_or(closest.normal)
    }
}

/// Minimum distance (m) of two points that give a direction: a thousand roundings of a coordinate
/// of 1 m.
const COINCIDENT: f64 = 1e3 * f64::EPSILON;
