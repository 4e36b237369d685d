//! Fitted walls as the elements of relations, and their form by the touches on them.

use nalgebra::{Matrix6, Point3, SMatrix, Vector3};

use super::feature::FittedTo;
use super::fit::{Cylinder, Fit, Plane, SurfaceModel};
use super::measure::{FittedSurface, Measure};
use super::observe::NOT_ALIKE;
use super::segmentation::grow::SEEN_FACETS;
use touchup_geometry::form::{
    Element, FlatForm, FormPoint, RoundForm, Shape, flat_form, round_form,
};
use touchup_geometry::numeric::{distinct, tangent_basis};

/// Number of directions of the outermost touches of a plane.
const CORNERS: usize = 16;

/// Covariance in O of point and direction of a fit, m and rad: without the common errors of all
/// touches.
fn own_covariance<S: SurfaceModel>(fit: &Fit<S>) -> Matrix6<f64> {
    let rotation = fit.surface.pose_of().rotation.to_rotation_matrix();
    // the freedoms in their order: shifts along x, y, z of F, z leans towards x and y
    let mut by_freedoms = SMatrix::<f64, 6, 8>::zeros();
    by_freedoms
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(rotation.matrix());
    by_freedoms
        .fixed_view_mut::<3, 2>(3, 3)
        .copy_from(&rotation.matrix().fixed_columns::<2>(0));
    by_freedoms * fit.own_covariance * by_freedoms.transpose()
}

impl Measure<'_> {
    /// Touched points on the true surface: contacts of the balls.
    fn form_points<S: SurfaceModel>(&self, fitted: &FittedSurface<S>) -> Vec<FormPoint> {
        let on_surface = |o: super::fit::Observation| {
            let (_, normal) = fitted.surface.distance_and_normal(&o.point);
            FormPoint {
                point: o.point - normal * o.offset,
                sigma: o.sigma,
                group: o.group,
            }
        };
        self.observed
            .of_touches(&fitted.touches)
            .into_iter()
            .map(on_surface)
            .collect()
    }

    /// Roundness, cylindricity and straightness of a wall fitted to touches; in an untouched
    /// drawing the roundness of its corners.
    ///
    /// - `segments`: of the wall.
    pub(crate) fn round_form(
        &self,
        fitted: &FittedSurface<Cylinder>,
        segments: &[usize],
    ) -> Option<RoundForm> {
        let (centre, axis) = (fitted.surface.center(), fitted.surface.axis());
        if fitted.to == FittedTo::Touches {
            let points = self.form_points(fitted);
            return round_form(&points, &centre, &axis, fitted.surface.radius);
        }
        let is_drawn = self.observed.parted.rounding.is_some() && fitted.is_confirmed;
        let corners = self.observed.of_mesh(segments);
        let corners = corners.iter().map(|corner| &corner.point);
        is_drawn.then(|| RoundForm::of_section(corners, &centre, &axis))?
    }

    /// Distance of a drawing's facets inside the surface through their corners, m; `None` if on it,
    /// and for a measured mesh.
    pub(crate) fn facets(&self, surface: &impl SurfaceModel, segments: &[usize]) -> Option<f64> {
        let parted = self.observed.parted;
        let rounding = parted.rounding?;
        let faces = segments
            .iter()
            .flat_map(|&number| &parted.segment(number).faces);
        let middles = faces.flat_map(|&face| {
            [0, 1, 2].map(|edge| {
                let [a, b] = parted.facets.edge(face, edge);
                nalgebra::center(&a, &b)
            })
        });
        let off = middles.map(|p| surface.distance(&p).abs());
        Some(off.fold(0.0, f64::max)).filter(|&off| off > SEEN_FACETS * rounding)
    }

    /// Flatness of a plane fitted to touches.
    pub(crate) fn flat_form(&self, fitted: &FittedSurface<Plane>) -> Option<FlatForm> {
        let points = self.form_points(fitted);
        flat_form(&points, &fitted.surface.point(), &fitted.surface.normal())
            .filter(|_| fitted.to == FittedTo::Touches)
    }

    /// The axis of a wall fitted to touches, over the heights of these.
    pub(crate) fn axis_element(&self, fitted: &FittedSurface<Cylinder>) -> Option<Element> {
        let direction = fitted.surface.axis();
        let places = self.touched_places(fitted)?;
        let heights = || {
            places
                .iter()
                .map(|p| (p - fitted.surface.center()).dot(&direction))
        };
        let ends = [
            heights().fold(f64::MAX, f64::min),
            heights().fold(f64::MIN, f64::max),
        ];
        let extent = ends
            .map(|height| fitted.surface.center() + direction * height)
            .to_vec();
        self.element(fitted, Shape::Axis, extent)
    }

    /// A plane fitted to touches, within the extent of these.
    pub(crate) fn plane_element(&self, fitted: &FittedSurface<Plane>) -> Option<Element> {
        let normal = fitted.surface.normal();
        let [u, v] = tangent_basis(&normal);
        let places = self.touched_places(fitted)?;
        let outermost = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / CORNERS as f64).sin_cos();
            let along = |at: usize| (u * cos + v * sin).dot(&places[at].coords);
            (0..places.len()).max_by(|&a, &b| along(a).total_cmp(&along(b)))
        };
        let corners = distinct((0..CORNERS).filter_map(outermost));
        let on =
            |at: usize| places[at] - normal * (places[at] - fitted.surface.point()).dot(&normal);
        self.element(fitted, Shape::Plane, corners.into_iter().map(on).collect())
    }

    fn touched_places<S: SurfaceModel>(
        &self,
        fitted: &FittedSurface<S>,
    ) -> Option<Vec<Point3<f64>>> {
        let is_touched = fitted.to == FittedTo::Touches && !fitted.touches.is_empty();
        is_touched.then(|| {
            self.form_points(fitted)
                .into_iter()
                .map(|p| p.point)
                .collect()
        })
    }

    fn element<S: SurfaceModel>(
        &self,
        fitted: &FittedSurface<S>,
        shape: Shape,
        extent: Vec<Point3<f64>>,
    ) -> Option<Element> {
        let fit = fitted.confirmed()?;
        let direction = fit.surface.axis();
        let [calibration, shift] = self.observed.systematic(&fitted.touches);
        // touches of another surface share only a part of the common errors
        let alone = NOT_ALIKE * calibration.hypot(shift);
        let mut covariance = own_covariance(fit);
        let free = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| match shape {
            Shape::Plane => direction * direction.dot(&axis),
            Shape::Axis => axis - direction * direction.dot(&axis),
        });
        for (i, column) in free.iter().enumerate() {
            let mut block = covariance.fixed_view_mut::<3, 1>(0, i);
            block += column * (alone * alone);
        }
        Some(Element {
            shape,
            point: fit.surface.center(),
            direction,
            covariance,
            calibration,
            extent,
        })
    }
}
