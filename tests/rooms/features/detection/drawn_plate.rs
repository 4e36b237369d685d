//! The simulated plate as its drawing has it, its arcs divided coarsely and finely, and a hole with
//! a broken edge. Sizes and places are those of the construction.

use nalgebra::Point3;
use touchup::features::{Feature, FeatureKind};
use touchup::sim::{Plate, TruthShape};

use crate::features::detection::{found, of_kind};
use crate::shapes::revolved;

/// (depth, width, length or diameter) of the one feature at a place, mm.
fn sizes(features: &[Feature], kind: FeatureKind, at: &Point3<f64>) -> Vec<f64> {
    let near = |feature: &&&Feature| (feature.centre.value - at).norm() < 1e-5;
    let features = of_kind(features, kind);
    let all: Vec<_> = features.iter().filter(near).collect();
    assert_eq!(all.len(), 1, "{kind:?} at {at}");
    let Feature {
        diameter,
        depth,
        width,
        length,
        ..
    } = all[0];
    [diameter, depth, width, length]
        .into_iter()
        .flatten()
        .map(|size| size.value * 1e3)
        .collect()
}

#[test]
fn everything_on_the_plate_is_found_however_finely_it_is_divided() {
    for chord in [50e-6, 10e-6, 2e-6] {
        let features = found(&Plate::default().mesh(chord).unwrap());
        let counts = [
            FeatureKind::Hole,
            FeatureKind::Slot,
            FeatureKind::Pocket,
            FeatureKind::Boss,
        ]
        .map(|kind| of_kind(&features, kind).len());
        assert_eq!(counts, [2, 1, 0, 1], "chord {chord}");
        for truth in Plate::default().features() {
            let (kind, expected) = match truth.shape {
                // either end describes a plain through-hole
                TruthShape::Hole { through: true, .. } | TruthShape::Step { .. } => continue,
                TruthShape::Hole {
                    diameter, depth, ..
                } => (FeatureKind::Hole, vec![diameter, depth]),
                TruthShape::Boss { diameter, height } => {
                    (FeatureKind::Boss, vec![diameter, height])
                }
                TruthShape::Slot {
                    width,
                    length,
                    depth,
                    ..
                } => (FeatureKind::Slot, vec![depth, width, length]),
            };
            let measured = sizes(&features, kind, &truth.centre);
            let off = measured
                .iter()
                .zip(&expected)
                .map(|(is, should)| (is - should * 1e3).abs());
            assert!(
                measured.len() == expected.len() && off.fold(0.0, f64::max) < 1e-3,
                "{}: {measured:?}",
                truth.name
            );
        }
    }
}

/// Another shape than a countersink breaks an edge: the hole begins at the plane all the same, and
/// not at the start of its wall.
#[test]
fn a_hole_with_a_broken_edge_is_as_deep_as_from_its_plane() {
    // with a flat floor, and with the tip of a drill of 118°
    for (broken, tip) in [0.0, 0.2e-3, 0.4e-3]
        .into_iter()
        .flat_map(|broken| [(broken, 0.0), (broken, 2.4e-3)])
    {
        let (r, depth, below) = (4e-3, 10e-3, -15e-3);
        let mut outline = vec![
            (0.0, below),
            (20e-3, below),
            (20e-3, 0.0),
            (r + broken, 0.0),
            (r, -broken),
        ];
        outline.extend([(r, -depth), (0.0, -depth - tip)]);
        outline.dedup();
        let features = found(&revolved(&outline, 128));
        let holes = of_kind(&features, FeatureKind::Hole);
        assert_eq!(holes.len(), 1, "broken by {broken}");
        let hole = holes[0];
        let value =
            |size: &Option<touchup::features::MeasuredValue<f64>>| size.as_ref().unwrap().value;
        assert!(
            (value(&hole.depth) - depth).abs() < 1e-6,
            "broken by {broken}: {:?}",
            hole.depth
        );
        assert!(
            (value(&hole.diameter) - 2.0 * r).abs() < 5e-6,
            "broken by {broken}: {:?}",
            hole.diameter
        );
        assert!(
            (hole.centre.value - Point3::origin()).norm() < 1e-6 && hole.through == Some(false),
            "{hole:?}"
        );
    }
}
