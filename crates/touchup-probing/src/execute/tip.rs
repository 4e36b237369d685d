//! Touches of one flat spot, upright around it and leaning to all sides: their poses determine the
//! tip (TCP) in the flange.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::cone::{NotReached, ShaftOrientation, leaned, rings};
use super::ending::Ending;
use super::prober::Prober;
use super::repeat::SpotError;
use crate::plan::TouchPlan;
use touchup_geometry::numeric::tangent_basis;

/// Poses of the touches of a spot, for tip (TCP) calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct TipPoses {
    /// poses of the touches in B: the scene's centre of the ball, with the axes of the flange
    pub poses_bf: Vec<Isometry3<f64>>,
    /// approximate normal out of the spot, in B
    pub normal_b: Unit<Vector3<f64>>,
    /// orientations left out
    pub not_reached: Vec<NotReached>,
}

/// Height above the spot at which a search of twice this length begins, m: the tip may be off by
/// less.
const STANDOFF: f64 = 6e-3;
/// Height of the tool's entry above the start of the search, m.
const ABOVE: f64 = 5e-3;
/// Distance of upright touches to each side, which determine the plane, m.
const ASIDE: f64 = 5e-3;
/// Leans, °, and the number of orientations around each.
const RINGS: [(f64, usize); 2] = [(20.0, 6), (40.0, 6)];

impl Prober<'_> {
    /// Touches one flat spot upright at four places around it, and then on it leaning to all sides.
    ///
    /// - `spot`: on the mesh or near it, m in O; flat for some 10 mm about.
    ///
    /// # Errors
    /// [`SpotError`]; the arm has then stopped, and has retracted unless it may no longer move.
    pub fn measure_tip(&mut self, spot: &Point3<f64>) -> Result<TipPoses, SpotError> {
        self.at_spot(spot, |probing, place, normal| {
            let Prober { cell, params, .. } = *probing.prober;
            let normal_b = Unit::new_normalize(cell.pose_bo.rotation * normal.into_inner());
            let mut measured = TipPoses {
                poses_bf: Vec::new(),
                normal_b,
                not_reached: Vec::new(),
            };
            let [u, v] = tangent_basis(&normal).map(|across| across * ASIDE);
            let around = [u, v, -u, -v].map(|aside| {
                (
                    ShaftOrientation {
                        lean: 0.0,
                        towards: 0.0,
                    },
                    aside,
                )
            });
            let leaning = rings(RINGS).map(|orientation| (orientation, Vector3::zeros()));
            let upright = probing.rotation;
            for (orientation, aside) in around.into_iter().chain(leaning) {
                probing.rotation = leaned(&upright, &orientation);
                let from =
                    place + normal.into_inner() * (params.pattern.ball_radius + STANDOFF) + aside;
                let entry = from + normal.into_inner() * ABOVE;
                let planned = TouchPlan {
                    entry,
                    from,
                    direction: -normal,
                    search: 2.0 * STANDOFF,
                    expected: None,
                };
                match probing.touch_spot(&planned, measured.poses_bf.len() + 1) {
                    Ok((_, centre)) => {
                        let tip = cell.pose(&probing.rotation, &centre);
                        let rotation = tip.rotation * cell.pose_ft.rotation.inverse();
                        measured
                            .poses_bf
                            .push(Isometry3::from_parts(tip.translation, rotation));
                    }
                    Err(SpotError::Ended(
                        ending @ (Ending::OutOfLimits(_) | Ending::NoClearPath(_)),
                    )) => {
                        measured.not_reached.push(NotReached {
                            orientation,
                            why: ending.why(),
                        });
                    }
                    Err(error) => return Err(error),
                }
            }
            Ok(measured)
        })
    }
}
