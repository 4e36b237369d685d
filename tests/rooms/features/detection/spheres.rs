//! Spheres on solids of revolution, whose sizes are those of their outlines.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind, FittedTo, detect};
use touchup::mesh::{TriMesh, VertexId};
use touchup::stylus::ProbedPoint;

use super::{found, of_kind};
use crate::shapes::{icosphere, revolved};

/// Arc about (0, height), m, from one angle above the horizontal to another.
fn arc(radius: f64, height: f64, [from, to]: [f64; 2], steps: u32) -> Vec<(f64, f64)> {
    let at = |i: u32| {
        let (sin, cos) = (from + (to - from) * f64::from(i) / f64::from(steps)).sin_cos();
        // both poles are on the axis
        ((radius * cos).max(0.0), height + radius * sin)
    };
    (0..=steps).map(at).collect()
}

/// A disc Ø 40, 10 high, with this outline from its top inward.
fn disc(inner: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let outer = [(0.0, 0.0), (0.02, 0.0), (0.02, 0.01)];
    [&outer[..], inner].concat()
}

/// Radius and height of the corners of an outline; radius and height of the centre of its sphere, and
/// its diameter, m; whether that is a dome.
type DrawnSphere = (Vec<(f64, f64)>, [f64; 3], bool);

/// A dome of 8 mm about the top, and a seat of 13 mm about 5 mm above it, 12 mm wide.
fn dome_and_seat() -> [DrawnSphere; 2] {
    let angle = (5.0f64 / 13.0).asin();
    [
        (
            disc(&arc(8e-3, 0.01, [0.0, FRAC_PI_2], 16)),
            [0.0, 0.01, 16e-3],
            true,
        ),
        (
            disc(&arc(13e-3, 0.015, [-angle, -FRAC_PI_2], 16)),
            [0.0, 0.015, 26e-3],
            false,
        ),
    ]
}

fn assert_one(features: &[Feature], [_, height, diameter]: [f64; 3], is_dome: bool, near: f64) {
    let spheres = of_kind(features, FeatureKind::Sphere);
    let [sphere] = spheres.as_slice() else {
        panic!("{} spheres", spheres.len());
    };
    let off = sphere.centre.value - nalgebra::Point3::new(0.0, 0.0, height);
    let size = sphere.diameter.as_ref().unwrap().value;
    assert!(
        off.norm() < near && (size - diameter).abs() < near,
        "{sphere:?}"
    );
    assert_eq!(sphere.is_convex, Some(is_dome));
}

#[test]
fn a_drawn_dome_and_a_seat_have_their_centres_and_diameters() {
    for sides in [24, 60] {
        for (outline, place, is_dome) in dome_and_seat() {
            let features = found(&revolved(&outline, sides));
            assert_one(&features, place, is_dome, 1e-7);
            assert!(of_kind(&features, FeatureKind::Hole).is_empty());
        }
    }
}

#[test]
fn a_rough_ball_has_its_diameter_within_the_error_of_its_mean() {
    let mut mesh = icosphere(0.012, 4);
    let mut rng = Pcg64::new(5, 9);
    for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
        let p = mesh.position(vertex);
        let noise: f64 = StandardNormal.sample(&mut rng);
        mesh.set_position(
            vertex,
            p + Vector3::from(p.coords.normalize()) * (10e-6 * noise),
        );
    }
    // twice the mean of 10 µm over the 1281 vertices of a fit has a deviation of 0.56 µm: four of them
    assert_one(&found(&mesh), [0.0, 0.0, 24e-3], true, 2.3e-6);
}

/// A hole Ø 8 whose end is a half ball: the wall is a cylinder, the end a sphere that touches it.
#[test]
fn the_end_of_a_ball_nosed_hole_is_a_sphere() {
    let mut inner = vec![(4e-3, 0.01)];
    inner.extend(arc(4e-3, 6e-3, [0.0, -FRAC_PI_2], 12));
    let features = found(&revolved(&disc(&inner), 48));
    assert_one(&features, [0.0, 6e-3, 8e-3], false, 1e-7);
    let holes = of_kind(&features, FeatureKind::Hole);
    assert_eq!(holes.len(), 1);
    let diameter = holes[0].diameter.as_ref().unwrap().value;
    assert!((diameter - 8e-3).abs() < 1e-7, "{diameter}");
}

/// A chamfer, a countersink and fillets of two rings or more are no spheres: the corners of each
/// ring are on one, but not its neighbours.
#[test]
fn rings_of_cones_and_fillets_are_no_spheres() {
    let fillet = |steps| {
        let turn = arc(3e-3, 0.0, [0.0, FRAC_PI_2], steps);
        let turn = turn.iter().map(|(r, z)| (r + 9e-3, z + 0.012));
        disc(&[vec![(0.012, 0.01)], turn.collect(), vec![(0.0, 0.015)]].concat())
    };
    let cones = disc(&[
        (0.01, 0.01),
        (5e-3, 5e-3),
        (5e-3, 2e-3),
        (3e-3, 1e-3),
        (0.0, 1e-3),
    ]);
    for outline in [cones, fillet(1), fillet(2), fillet(3), fillet(12)] {
        let features = found(&revolved(&outline, 36));
        assert!(of_kind(&features, FeatureKind::Sphere).is_empty());
    }
}

/// The corner of three fillets is a part of a sphere, but no feature.
#[test]
fn the_corner_of_fillets_is_no_feature() {
    let ball = icosphere(3e-3, 4);
    let apart = |p: Vector3<f64>| p.map(|x| x + 0.01 * if x > 1e-9 { 1.0 } else { -1.0 });
    let mut mesh: TriMesh = ball.clone();
    for vertex in (0..ball.vertex_slots() as u32).map(VertexId) {
        mesh.set_position(vertex, apart(ball.position(vertex).coords).into());
    }
    assert!(of_kind(&found(&mesh), FeatureKind::Sphere).is_empty());
}

/// Touches of a ball of 1.5 mm all over a dome of 8 mm, whose scan is 0.1 mm too large.
#[test]
fn touches_of_a_dome_give_its_diameter() {
    let ring = |row: u32| {
        let lean = 0.06 * f64::from(row + 1);
        (0..48).map(move |i| {
            let (sin, cos) = (0.13 * f64::from(i)).sin_cos();
            let normal = Vector3::new(lean.sin() * cos, lean.sin() * sin, lean.cos());
            let point = nalgebra::Point3::new(0.0, 0.0, 0.01) + normal * 8e-3;
            ProbedPoint {
                stamp_ns: i64::from(48 * row + i) * 200_000_000,
                stroke: row,
                centre: point + normal * 1.5e-3,
                radius: 1.5e-3,
                point,
                normal,
                sigma: 1e-5,
                calibration: 1e-6,
                place: 0.0,
                weight: 1.0,
                is_rejected: false,
            }
        })
    };
    let touches: Vec<_> = (0..22).flat_map(ring).collect();
    let scan = revolved(&disc(&arc(8.1e-3, 0.01, [0.0, FRAC_PI_2], 40)), 120);
    let features = detect(&scan, &touches).features;
    assert_one(&features, [0.0, 0.01, 16e-3], true, 1e-6);
    let sphere = of_kind(&features, FeatureKind::Sphere)[0];
    assert_eq!(sphere.fitted_to, FittedTo::Touches);
    let std = sphere.diameter.as_ref().unwrap().std.unwrap();
    // no less than the common error of all touches, twice
    assert!((2e-6..0.1e-3).contains(&std), "{std}");
    // the touches end at 76°: 1 − cos 76° of the half ball
    assert!(sphere.touched > 0.75, "{}", sphere.touched);
}
