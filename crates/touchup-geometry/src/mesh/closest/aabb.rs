//! Axis-aligned bounding boxes of the tree.

use nalgebra::{Point3, Vector3};

use crate::mesh::{FaceId, TriMesh};

/// An axis-aligned box in single precision, relative to the tree's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aabb {
    pub lo: [f32; 3],
    pub hi: [f32; 3],
}

impl Aabb {
    pub(crate) const EMPTY: Self = Self {
        lo: [f32::INFINITY; 3],
        hi: [f32::NEG_INFINITY; 3],
    };

    #[inline]
    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            lo: std::array::from_fn(|i| lesser(self.lo[i], other.lo[i])),
            hi: std::array::from_fn(|i| greater(self.hi[i], other.hi[i])),
        }
    }

    /// Bounds of some faces.
    #[inline]
    pub(crate) fn around(
        mesh: &TriMesh,
        origin: &Point3<f64>,
        faces: impl Iterator<Item = FaceId>,
    ) -> Self {
        let mut bounds = Self::EMPTY;
        let mut is_empty = true;
        for face in faces {
            bounds.take(mesh, face, origin);
            is_empty = false;
        }
        if is_empty {
            bounds
        } else {
            bounds.rounded_outward()
        }
    }

    /// Extends the box by the corners of a face, rounded to nearest; [`Self::rounded_outward`]
    /// makes up for the rounding.
    #[inline]
    fn take(&mut self, mesh: &TriMesh, face: FaceId, origin: &Point3<f64>) {
        for corner in mesh.triangle(face) {
            let corner = [
                corner.x - origin.x,
                corner.y - origin.y,
                corner.z - origin.z,
            ]
            .map(|x| x as f32);
            self.lo = std::array::from_fn(|i| lesser(self.lo[i], corner[i]));
            self.hi = std::array::from_fn(|i| greater(self.hi[i], corner[i]));
        }
    }

    /// One unit in the last place wider on each side: rounding is monotone, so all corners are
    /// inside, and the union of widened boxes is the widened union.
    #[inline]
    pub(crate) fn rounded_outward(&self) -> Self {
        let unit = |x: f32| x.abs() * f32::EPSILON + f32::MIN_POSITIVE;
        Self {
            lo: self.lo.map(|x| x - unit(x)),
            hi: self.hi.map(|x| x + unit(x)),
        }
    }

    /// At least `margin` (m) wider on each side.
    #[inline]
    pub(crate) fn grown(&self, margin: f64) -> Self {
        let grown = |x: f32, margin: f64| (f64::from(x) + margin) as f32;
        Self {
            lo: self.lo.map(|x| grown(x, -margin)),
            hi: self.hi.map(|x| grown(x, margin)),
        }
        .rounded_outward()
    }

    /// Half of the surface, m²; the cost of a query grows with it.
    #[inline]
    pub(crate) fn half_area(&self) -> f32 {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|i| self.hi[i] - self.lo[i]);
        x * y + y * z + z * x
    }

    /// Whether this box contains all of another one.
    #[inline]
    pub(crate) fn encloses(&self, other: &Self) -> bool {
        (0..3).fold(true, |all, i| {
            all & (self.lo[i] <= other.lo[i]) & (self.hi[i] >= other.hi[i])
        })
    }

    /// Squared distance to a point (relative to the tree's origin), in single precision; 0 inside.
    #[inline]
    pub(crate) fn distance_squared(&self, p: &[f32; 3]) -> f32 {
        let outside = |i: usize| greater(greater(self.lo[i] - p[i], p[i] - self.hi[i]), 0.0);
        let (x, y, z) = (outside(0), outside(1), outside(2));
        x * x + y * y + z * z
    }

    /// The largest box of single precision within a box; it overlaps the same boxes of single
    /// precision.
    pub(crate) fn within(lo: &Vector3<f64>, hi: &Vector3<f64>) -> Self {
        let up = |x: f64| {
            if f64::from(x as f32) < x {
                (x as f32).next_up()
            } else {
                x as f32
            }
        };
        Self {
            lo: [lo.x, lo.y, lo.z].map(up),
            hi: [hi.x, hi.y, hi.z].map(|x| -up(-x)),
        }
    }

    /// Whether two boxes overlap; without branches, as the outcome is hard to predict.
    #[inline]
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        (0..3).fold(true, |all, i| {
            all & (self.lo[i] <= other.hi[i]) & (self.hi[i] >= other.lo[i])
        })
    }
}

/// The lesser of two numbers, neither of which is NaN; one instruction, unlike `min`.
#[inline]
pub(super) fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The greater of two numbers, neither of which is NaN.
#[inline]
pub(in crate::mesh) fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}
