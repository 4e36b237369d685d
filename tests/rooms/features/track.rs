//! Features followed between two looks at the mesh: numbers stay, and new touches count at once.

use crate::plate_stream::{contacts_of, plate_stream};
use touchup::features::{Feature, FeatureKind, FittedTo, Tracker};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{Patcher, PatcherParams};
use touchup::sim::StylusParams;
use touchup::stylus::ProbedPoint;

/// The demo's plate after all touches, and the touches.
fn touched_plate(seed: u64) -> (TriMesh, Vec<ProbedPoint>) {
    let stylus = StylusParams::default();
    let (stream, _) = plate_stream(&stylus, seed);
    let mut params = PatcherParams::new(stylus.radius, Some(stylus.stiffness), stream.noise);
    params.uncertainty = Some(touchup::reconstruct::UncertaintyParams::new(stream.noise));
    let mut patcher = Patcher::new(params).unwrap();
    let contacts = contacts_of(stylus.radius, Some(stylus.stiffness), &stream.samples);
    contacts.iter().for_each(|contact| patcher.push(contact));
    patcher.flush();
    let patched = patcher
        .patched(&stream.scan, &FaceTree::new(&stream.scan))
        .unwrap();
    (patched.mesh, patcher.probed().to_vec())
}

fn sizes(features: &[Feature]) -> Vec<(u32, FeatureKind, f64)> {
    let size = |f: &Feature| {
        f.diameter
            .as_ref()
            .or(f.width.as_ref())
            .map(|size| (f.id, f.kind, size.value))
    };
    features.iter().filter_map(size).collect()
}

#[test]
fn new_touches_are_in_the_numbers_at_once() {
    let (mesh, touches) = touched_plate(3);
    // runs along the walls come at the end of the demo: leave most of them out at first
    let early = &touches[..touches.len() * 3 / 4];
    let mut tracker = Tracker::default();
    let before = sizes(tracker.renew(&mesh, early));
    let known: Vec<Feature> = tracker.features().to_vec();
    let changed = tracker.update(&touches);
    assert!(!changed.is_empty());
    for (feature, before) in tracker.features().iter().zip(&known) {
        if !changed.contains(&feature.id) {
            assert_eq!(feature, before, "not touched, so not changed");
        }
    }
    // true sizes of the plate: 8 and 6 mm, a slot of 6 mm, a boss of 10 mm
    let after = sizes(tracker.features());
    let true_mm = |mm: f64| {
        [6.0, 8.0, 10.0]
            .map(|truth: f64| (truth - mm).abs())
            .into_iter()
            .fold(f64::MAX, f64::min)
    };
    for (id, kind, size) in &after {
        if changed.contains(id) {
            assert!(
                true_mm(size * 1e3) < 0.03,
                "{kind:?} {id}: {} mm",
                size * 1e3
            );
            let feature = tracker.features().iter().find(|f| f.id == *id).unwrap();
            assert_eq!(feature.fitted_to, FittedTo::Touches);
            let latest = feature
                .diameter
                .as_ref()
                .or(feature.width.as_ref())
                .unwrap()
                .touches
                .last()
                .copied();
            assert!(
                latest.is_some_and(|touch| touch as usize >= early.len()),
                "the new touches are named"
            );
        }
    }
    assert_eq!(before.len(), after.len());
    // a search of the whole mesh agrees within the error of the subsampled fit, and keeps the
    // numbers
    let whole = sizes(tracker.renew(&mesh, &touches));
    assert_eq!(whole.len(), after.len());
    for ((id, kind, size), (other_id, other_kind, other)) in whole.iter().zip(&after) {
        assert_eq!((id, kind), (other_id, other_kind));
        assert!(
            (size - other).abs() < 0.02e-3,
            "{kind:?} {id}: {} and {} mm",
            size * 1e3,
            other * 1e3
        );
    }
}

#[test]
fn nothing_new_changes_nothing() {
    let (mesh, touches) = touched_plate(5);
    let mut tracker = Tracker::default();
    let first = tracker.renew(&mesh, &touches).to_vec();
    assert!(tracker.update(&touches).is_empty());
    assert_eq!(tracker.features(), first);
    assert!(
        tracker.update(&touches[..100]).is_empty(),
        "a stroke was undone"
    );
    // numbers of touches mean others now, and some are beyond the last
    let others: Vec<ProbedPoint> = touches.iter().step_by(2).copied().collect();
    assert!(tracker.update(&others).is_empty());
    assert_eq!(tracker.features(), first);
    assert_eq!(
        tracker.renew(&mesh, &touches),
        first,
        "the same, by the same numbers"
    );
}
