//! Fitted axes and planes as the elements of relations, with their uncertainty and touched extent.

use nalgebra::{Matrix6, Point3, SymmetricEigen, Vector3, Vector6};

/// Shape of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// the axis of a round wall
    Axis,
    /// a plane
    Plane,
}

/// An axis or a plane, in O.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// its shape
    pub shape: Shape,
    /// point on the element, amid its touched part, m
    pub point: Point3<f64>,
    /// along an axis; the outward normal of a plane; unit vector
    pub direction: Vector3<f64>,
    /// covariance of small changes of point and direction, m and rad: without the errors common to
    /// the touches of all elements
    pub covariance: Matrix6<f64>,
    /// standard deviation of the common error of all planes along their normals, m: the calibration
    /// of the ball's radius
    pub calibration: f64,
    /// touched extent: both ends of an axis, corners of the touched part of a plane; m
    pub extent: Vec<Point3<f64>>,
}

impl Element {
    /// The element with changed point and direction; its extent follows.
    pub(super) fn moved(&self, by: &Vector6<f64>) -> Self {
        let [shift, turn] = [
            by.fixed_rows::<3>(0).into_owned(),
            by.fixed_rows::<3>(3).into_owned(),
        ];
        let (point, direction) = (self.point + shift, (self.direction + turn).normalize());
        let on = |p: &Point3<f64>| match self.shape {
            Shape::Axis => point + direction * (p - self.point).dot(&self.direction),
            Shape::Plane => p - direction * (p - point).dot(&direction),
        };
        let extent = self.extent.iter().map(on).collect();
        Self {
            point,
            direction,
            extent,
            ..self.clone()
        }
    }

    /// The element with a larger ball: planes move along their normals, axes not at all.
    pub(super) fn lifted(&self, by: f64) -> Self {
        let along = if self.shape == Shape::Plane {
            self.direction * by
        } else {
            Vector3::zeros()
        };
        self.moved(&Vector6::new(along.x, along.y, along.z, 0.0, 0.0, 0.0))
    }

    /// Changes by one standard deviation in each independent direction.
    pub(super) fn deviations(&self) -> Vec<Vector6<f64>> {
        // lengths and angles in their own units, so neither is lost beside the other
        let unit = |i: usize| {
            let start = if i < 3 { 0 } else { 3 };
            let largest = (start..start + 3)
                .map(|j| self.covariance[(j, j)])
                .fold(0.0, f64::max);
            if largest > 0.0 { largest.sqrt() } else { 1.0 }
        };
        let units = Vector6::from_fn(|i, _| unit(i));
        let scaled = Matrix6::from_fn(|i, j| self.covariance[(i, j)] / (units[i] * units[j]));
        if !scaled.iter().all(|x| x.is_finite()) {
            return Vec::new();
        }
        let eigen = SymmetricEigen::new(scaled);
        let directions = eigen
            .eigenvectors
            .column_iter()
            .zip(eigen.eigenvalues.iter());
        directions
            .filter(|(_, x)| **x > NOTHING)
            .map(|(v, x)| v.component_mul(&units) * x.sqrt())
            .collect()
    }

    /// Touched length of an axis, m.
    pub(super) fn length(&self) -> f64 {
        self.span(&self.direction)
    }

    /// Length of the touched extent along a direction, m.
    pub(super) fn span(&self, along: &Vector3<f64>) -> f64 {
        let heights = self.extent.iter().map(|p| (p - self.point).dot(along));
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        (high - low).max(0.0)
    }
}

/// Share of the largest variance below which a variance is rounding.
const NOTHING: f64 = 1e-12;
