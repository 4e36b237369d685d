//! The simulated plate as its drawing has it, its arcs divided coarsely and finely. Sizes and places are those it is made
//! from.

use nalgebra::Point3;
use touchup::features::{Feature, Kind};
use touchup::sim::{Plate, TruthShape};

use crate::features::detection::{found, of_kind};

/// (depth, width, length or diameter) of the one feature at a place, mm.
fn sizes(features: &[Feature], kind: Kind, at: &Point3<f64>) -> Vec<f64> {
    let near = |feature: &&&Feature| (feature.centre.value - at).norm() < 1e-5;
    let features = of_kind(features, kind);
    let all: Vec<_> = features.iter().filter(near).collect();
    assert_eq!(all.len(), 1, "{kind:?} at {at}");
    let Feature { diameter, depth, width, length, .. } = all[0];
    [diameter, depth, width, length].into_iter().flatten().map(|size| size.value * 1e3).collect()
}

#[test]
fn everything_on_the_plate_is_found_however_finely_it_is_divided() {
    for chord in [50e-6, 10e-6, 2e-6] {
        let features = found(&Plate::default().mesh(chord).unwrap());
        let counts = [Kind::Hole, Kind::Slot, Kind::Pocket, Kind::Boss].map(|kind| of_kind(&features, kind).len());
        assert_eq!(counts, [2, 1, 0, 1], "chord {chord}");
        for truth in Plate::default().features() {
            let (kind, expected) = match truth.shape {
                // from which end a plain through-hole is told is left open
                TruthShape::Hole { through: true, .. } | TruthShape::Step { .. } => continue,
                TruthShape::Hole { diameter, depth, .. } => (Kind::Hole, vec![diameter, depth]),
                TruthShape::Boss { diameter, height } => (Kind::Boss, vec![diameter, height]),
                TruthShape::Slot { width, length, depth, .. } => (Kind::Slot, vec![depth, width, length]),
            };
            let measured = sizes(&features, kind, &truth.centre);
            let off = measured.iter().zip(&expected).map(|(is, should)| (is - should * 1e3).abs());
            assert!(measured.len() == expected.len() && off.fold(0.0, f64::max) < 1e-3, "{}: {measured:?}", truth.name);
        }
    }
}
