//! The surfaces that a probing knows.

use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::TriMesh;
use touchup::reconstruct::KnownSurfaces;
use touchup::sim::{Plate, Surface as _, TruthShape};

use super::plan::{SIGMA, touched};
use crate::plate_stream::plate_scan;

/// Deviations of one touch within which each surface is, at its contacts and up to its ends: a wall
/// goes on some times as far as between its touches.
const WITHIN: f64 = 8.0;

/// Of each feature of the plate, against its closed form: the surfaces of the drawing, and each
/// contact and each end on the part: rims, floors and edges among them.
#[test]
fn known_surfaces_are_those_of_the_drawing_up_to_their_edges() {
    let (plate, mut rng) = (Plate::default(), Pcg64::seed_from_u64(3));
    let scan: TriMesh = plate_scan(1);
    for feature in plate.features() {
        let count = match feature.shape {
            TruthShape::Hole { through: true, .. } => 2,
            TruthShape::Hole { .. } | TruthShape::Boss { .. } => 3,
            TruthShape::Slot { .. } => 6,
            TruthShape::Step { .. } => 2,
        };
        let distance = |p: &Point3<f64>| plate.signed_distance(p);
        // a flag is on what a scanner sees: on the top of the boss
        let flag = match feature.shape {
            TruthShape::Boss { height, .. } => feature.centre + Vector3::z() * height,
            _ => feature.centre,
        };
        let explorer = touched(feature.kind(), flag, &scan, &distance, &mut rng);
        let surfaces = explorer.known_surfaces();
        assert_eq!(surfaces.len(), count, "{}", feature.name);
        let mut all = KnownSurfaces::new(1.5e-3);
        for known in surfaces {
            for place in known.contacts.iter().chain(&known.ends) {
                let off = plate.signed_distance(place).abs();
                assert!(
                    off < WITHIN * SIGMA,
                    "{}: {known:?} is {off} m off at {place}",
                    feature.name
                );
            }
            assert!((0.0..WITHIN * SIGMA).contains(&known.sigma));
            all.add(known).unwrap();
        }
    }
}
