//! Touches of a sphere of known diameter, from its pole down within its upper half, with the probe
//! upright and leaning.
//!
//! In each orientation of the shaft s the ball touches the sphere along −s at the pole that faces
//! the shaft, and along six more normals 60° from s: behind the ball the shaft then leads away from
//! the sphere, and with a lean of 25° no touch is below the equator, the side of a possible post.

use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

use super::cone::{NotReached, ShaftOrientation, leaned, rings};
use super::ending::Ending;
use super::feature_probing::FeatureProbing;
use super::prober::Prober;
use super::repeat::SpotError;
use super::route::ToolState;
use crate::plan::TouchPlan;
use touchup_features::calibrate::ReferenceSphere;
use touchup_geometry::numeric::tangent_basis;

/// The touches of a sphere in one orientation of the probe.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereOrientation {
    /// of the shaft, against its first one
    pub orientation: ShaftOrientation,
    /// centres of the ball at contact, m in O
    pub centres: Vec<Point3<f64>>,
}

/// The touches of a sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereTouches {
    /// reached orientations
    pub orientations: Vec<SphereOrientation>,
    /// orientations left out
    pub not_reached: Vec<NotReached>,
}

/// Leans of the shaft, °, and the number of orientations around each.
const RINGS: [(f64, usize); 2] = [(0.0, 1), (25.0, 4)];
/// Touches around the pole, and their angle from it.
const AROUND: usize = 6;
const POLAR: f64 = std::f64::consts::FRAC_PI_3;
/// Minimum number of touches: four unknowns, and one more.
const FEWEST: usize = 5;
/// Distance from the expected sphere at which a search of twice this length begins, m.
const STANDOFF: f64 = 3e-3;
/// Height of the tool's entry above that, along the shaft, m.
const ABOVE: f64 = 5e-3;

impl Prober<'_> {
    /// Touches a sphere in several orientations of the probe around its present one, without those
    /// out of reach. Then it goes back to its start.
    ///
    /// The mesh of the world has to hold the sphere, so that no link leads through it.
    ///
    /// - `sphere`: expected place; within 2 mm.
    ///
    /// # Errors
    /// [`SpotError`]; the arm has then stopped, and has retracted unless it may no longer move.
    pub fn touch_sphere(&mut self, sphere: &ReferenceSphere) -> Result<SphereTouches, SpotError> {
        let home = ToolState::of(self.cell, &self.ready_to_touch()?);
        let mut touched = SphereTouches {
            orientations: Vec::new(),
            not_reached: Vec::new(),
        };
        let mut made = 0;
        for orientation in rings(RINGS) {
            match self.touch_oriented(sphere, &leaned(&home.rotation, &orientation), &mut made)? {
                Ok(centres) => touched.orientations.push(SphereOrientation {
                    orientation,
                    centres,
                }),
                Err(why) => touched.not_reached.push(NotReached { orientation, why }),
            }
        }
        // back to the first orientation
        let here = ToolState::of(self.cell, &self.ready_to_touch()?);
        let back = self.space().route(&here, &home.rotation, &home.place)?;
        self.turn_along(&back)?;
        Ok(touched)
    }

    /// All touches in one orientation, or why fewer than five are possible.
    ///
    /// - `made`: number of touches of the sphere until now.
    fn touch_oriented(
        &mut self,
        sphere: &ReferenceSphere,
        rotation: &UnitQuaternion<f64>,
        made: &mut usize,
    ) -> Result<Result<Vec<Point3<f64>>, String>, SpotError> {
        let planned = touches(
            sphere,
            self.params.pattern.ball_radius,
            &self.cell.shaft(rotation),
        );
        // its time limit is a feature's
        let state = self.ready_to_touch()?;
        let mut probing = FeatureProbing::new(self, 0, *rotation, &state);
        let (mut centres, mut left_out) = (Vec::new(), None);
        let touched =
            planned
                .iter()
                .try_for_each(|planned| match probing.touch_spot(planned, *made + 1) {
                    Ok((_, centre)) => {
                        *made += 1;
                        centres.push(centre);
                        Ok(())
                    }
                    Err(SpotError::Ended(
                        ending @ (Ending::OutOfLimits(_) | Ending::NoClearPath(_)),
                    )) => {
                        left_out.get_or_insert(ending.why());
                        Ok(())
                    }
                    Err(error) => Err(error),
                });
        probing.finish_spot(touched)?;
        Ok(if centres.len() >= FEWEST {
            Ok(centres)
        } else {
            Err(left_out.unwrap_or_default())
        })
    }
}

/// Touches at a pole and on a ring around it.
fn touches(
    sphere: &ReferenceSphere,
    ball_radius: f64,
    shaft: &Unit<Vector3<f64>>,
) -> Vec<TouchPlan> {
    let [u, v] = tangent_basis(shaft);
    let around = (0..AROUND).map(|at| std::f64::consts::TAU * at as f64 / AROUND as f64);
    let ring = around.map(|towards| {
        (u * towards.cos() + v * towards.sin()) * POLAR.sin() + shaft.as_ref() * POLAR.cos()
    });
    let touch = |out: Vector3<f64>| {
        let from = sphere.centre + out * (sphere.radius + ball_radius + STANDOFF);
        let entry = from + shaft.into_inner() * ABOVE;
        let direction = Unit::new_normalize(-out);
        TouchPlan {
            entry,
            from,
            direction,
            search: 2.0 * STANDOFF,
            expected: None,
        }
    };
    [shaft.into_inner()]
        .into_iter()
        .chain(ring)
        .map(touch)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Neither the shaft behind the ball nor the approach comes nearer to the sphere than the ball,
    /// and no touch is below the equator.
    #[test]
    fn the_shaft_leads_away_from_the_sphere_and_its_post_is_left_alone() {
        let (sphere, ball) = (
            ReferenceSphere {
                centre: Point3::new(0.1, 0.0, 0.05),
                radius: 12.5e-3,
            },
            1.5e-3,
        );
        for orientation in rings(RINGS) {
            let shaft = Unit::new_normalize(
                leaned(&UnitQuaternion::identity(), &orientation) * Vector3::z(),
            );
            let planned = touches(&sphere, ball, &shaft);
            assert_eq!(planned.len(), 7);
            for touch in planned {
                let contact = sphere.centre - touch.direction.into_inner() * (sphere.radius + ball);
                assert!(contact.z > sphere.centre.z, "{orientation:?}");
                for up in 1..60 {
                    let behind = contact + shaft.into_inner() * (1e-3 * f64::from(up));
                    assert!((behind - sphere.centre).norm() > sphere.radius + ball);
                    let above = touch.from + shaft.into_inner() * (1e-3 * f64::from(up));
                    assert!((above - sphere.centre).norm() > (touch.from - sphere.centre).norm());
                }
            }
        }
    }
}
