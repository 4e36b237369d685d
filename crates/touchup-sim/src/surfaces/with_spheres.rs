//! Exact spheres beside another surface.

use nalgebra::{Point3, Vector3};

use super::surface::{Bounds, Surface, SurfacePoint};
use touchup_features::calibrate::ReferenceSphere;

/// A surface, and spheres outside of it.
pub struct WithSpheres<'a> {
    /// the other surface
    pub part: &'a dyn Surface,
    /// disjoint spheres
    pub spheres: &'a [ReferenceSphere],
}

fn distance(sphere: &ReferenceSphere, p: &Point3<f64>) -> f64 {
    (p - sphere.centre).norm() - sphere.radius
}

fn closest(sphere: &ReferenceSphere, p: &Point3<f64>) -> SurfacePoint {
    let normal = (p - sphere.centre)
        .try_normalize(0.0)
        .unwrap_or_else(Vector3::z);
    SurfacePoint {
        point: sphere.centre + normal * sphere.radius,
        normal,
    }
}

impl Surface for WithSpheres<'_> {
    fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        self.spheres
            .iter()
            .map(|sphere| distance(sphere, p))
            .fold(self.part.signed_distance(p), f64::min)
    }

    fn closest(&self, p: &Point3<f64>) -> SurfacePoint {
        let nearest = self
            .spheres
            .iter()
            .min_by(|a, b| distance(a, p).abs().total_cmp(&distance(b, p).abs()));
        match nearest
            .filter(|sphere| distance(sphere, p).abs() < self.part.signed_distance(p).abs())
        {
            Some(sphere) => closest(sphere, p),
            None => self.part.closest(p),
        }
    }

    fn bounds(&self) -> Bounds {
        let corners = self.spheres.iter().map(|sphere| {
            Bounds {
                min: sphere.centre,
                max: sphere.centre,
            }
            .grown(sphere.radius)
        });
        corners.fold(self.part.bounds(), |all, one| Bounds {
            min: all.min.inf(&one.min),
            max: all.max.sup(&one.max),
        })
    }

    fn near(&self, p: &Point3<f64>, reach: f64, found: &mut Vec<SurfacePoint>) {
        self.part.near(p, reach, found);
        found.extend(
            self.spheres
                .iter()
                .filter(|sphere| distance(sphere, p).abs() <= reach)
                .map(|sphere| closest(sphere, p)),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Plate;

    #[test]
    fn the_nearer_of_part_and_sphere_is_closest() {
        let (plate, spheres) = (
            Plate::default(),
            [ReferenceSphere {
                centre: Point3::new(100e-3, 25e-3, 12e-3),
                radius: 10e-3,
            }],
        );
        let both = WithSpheres {
            part: &plate,
            spheres: &spheres,
        };
        let above = Point3::new(100e-3, 25e-3, 30e-3);
        assert!((both.signed_distance(&above) - 8e-3).abs() < 1e-15);
        assert!((both.closest(&above).point - Point3::new(100e-3, 25e-3, 22e-3)).norm() < 1e-15);
        let mut found = Vec::new();
        both.near(&above, 9e-3, &mut found);
        assert_eq!(found, [both.closest(&above)]);
        let at_plate = Point3::new(45e-3, 9e-3, 13e-3);
        assert_eq!(both.closest(&at_plate), plate.closest(&at_plate));
        assert_eq!(
            both.signed_distance(&at_plate),
            plate.signed_distance(&at_plate)
        );
        assert!(
            (both.bounds().max - Point3::new(110e-3, plate.bounds().max.y, 22e-3)).norm() < 1e-12
        );
    }
}
