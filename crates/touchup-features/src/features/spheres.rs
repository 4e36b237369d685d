//! Spheres as features: domes, seats of balls, ends of ball-nosed tools.

use super::feature::{Feature, FeatureKind, MeasuredValue};
use super::fit::{Fit, Freedom, SurfaceModel};
use super::measure::Measure;

/// All spheres, sure ones alone where nothing was touched.
pub(super) fn sphere_features(measure: &Measure) -> Vec<Feature> {
    let parted = measure.observed.parted;
    let is_shown = |&number: &usize| {
        let is_felt = !parted.segment(number).felt.is_empty();
        is_felt || (parted.is_strong(number) && parted.is_sure(number))
    };
    let numbers = 0..parted.segmentation.segments.len();
    let shown = numbers.filter(is_shown);
    shown
        .filter_map(|number| sphere_feature(measure, number))
        .collect()
}

fn sphere_feature(measure: &Measure, number: usize) -> Option<Feature> {
    let fitted = measure.sphere(number)?;
    let centre = MeasuredValue::new(
        fitted.surface.center(),
        fitted.confirmed().and_then(Fit::centre_std),
        fitted.touches.clone(),
    );
    Some(Feature {
        diameter: Some(fitted.number(2.0 * fitted.surface.radius, &[(Freedom::Size, 2.0)])),
        is_convex: Some(!fitted.surface.concave),
        facets: measure.facets(&fitted.surface, &[number]),
        ..Feature::new(
            FeatureKind::Sphere,
            centre,
            measure.observed.touched_share(&[number]),
            fitted.to,
        )
    })
}
