//! First guesses from coarse facets.

use std::f64::consts::TAU;

use touchup::features::fit::{Cone, Cylinder, FitError, OrientedPoint, Plane, Surface};

use super::*;

/// Barycentres, normals and areas of the faces of a ring of `count` flat strips from radius `r` at z = 0 to `top` at z = h,
/// split in two triangles each, normals to the axis; `strips` of them from the first.
fn ring(pose: &Isometry3<f64>, count: u32, strips: u32, [r, top, h]: [f64; 3]) -> Vec<OrientedPoint> {
    let at = |i: u32, r: f64, z: f64| {
        let angle = TAU * f64::from(i) / f64::from(count);
        pose * Point3::new(r * angle.cos(), r * angle.sin(), z)
    };
    (0..strips)
        .flat_map(|i| {
            let [a, b, c, d] = [at(i, r, 0.0), at(i + 1, r, 0.0), at(i + 1, top, h), at(i, top, h)];
            [[a, c, b], [a, d, c]]
        })
        .map(|[a, b, c]| {
            let double = (b - a).cross(&(c - a));
            let point = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            OrientedPoint { point, normal: double.normalize(), weight: double.norm() / 2.0 }
        })
        .collect()
}

#[test]
fn twelve_facets_give_the_hole() {
    let pose = tilted();
    for strips in [12, 4, 2] {
        let hole = Cylinder::from_normals(&ring(&pose, 12, strips, [5.0 * MM, 5.0 * MM, 8.0 * MM])).unwrap();
        let center = pose.inverse_transform_point(&hole.center());
        assert!(hole.concave && hole.axis().cross(&(pose * Vector3::z())).norm() < 1e-6, "{strips}");
        // the lines along the normals pass the axis at a third of half a strip, half of them on either side
        assert!(center.x.hypot(center.y) < 0.3 * MM, "{strips}: {center}");
        // barycentres lie inside the circle, at most by the sagitta of 30°
        assert!((0.9..1.0).contains(&(hole.radius / (5.0 * MM))), "{strips}: {}", hole.radius);
    }
}

#[test]
fn facets_give_the_countersink() {
    let pose = tilted();
    for strips in [16, 6] {
        let sink = Cone::from_normals(&ring(&pose, 16, strips, [3.0 * MM, 5.0 * MM, 2.0 * MM])).unwrap();
        let along = sink.axis().dot(&(pose * Vector3::z()));
        assert!(sink.concave && along > 1.0 - 1e-9, "z towards the wide side: {along}");
        // flat strips are steeper than the cone by its cosine: tan = 2/2 · cos(180°/16)
        let flat = (TAU / 32.0).cos().atan();
        assert!((sink.half_angle - flat).abs() < 1e-9, "{}", sink.half_angle.to_degrees());
        let apex = pose.inverse_transform_point(&sink.apex().unwrap());
        assert!((apex - Point3::new(0.0, 0.0, -3.0 * MM)).norm() < 0.4 * MM, "{strips}: {apex}");
    }
}

#[test]
fn faces_of_a_plane_give_it_and_nothing_else() {
    let pose = tilted();
    let faces: Vec<_> = (0..5)
        .map(|i| OrientedPoint {
            point: pose * Point3::new(f64::from(i), f64::from(i * i), 0.0),
            normal: pose * Vector3::z(),
            weight: 1.0,
        })
        .collect();
    let plane = Plane::from_normals(&faces).unwrap();
    assert!((plane.normal() - pose * Vector3::z()).norm() < 1e-12);
    assert!(plane.distance(&pose.translation.vector.into()).abs() < 1e-12);
    assert_eq!(Cylinder::from_normals(&faces), Err(FitError::NoGuess { surface: "cylinder", count: 5 }));
    assert_eq!(Cone::from_normals(&faces), Err(FitError::NoGuess { surface: "cone", count: 5 }));
    assert_eq!(Plane::from_normals(&[]), Err(FitError::NoGuess { surface: "plane", count: 0 }));
}
