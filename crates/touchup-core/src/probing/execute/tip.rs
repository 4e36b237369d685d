//! One flat spot, touched upright around it and with the probe leaning to all sides: the poses determine the tip (TCP) in the flange.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::cone::{NotReached, Orientation, leaned, rings};
use super::ending::{Ending, ProbedTouch};
use super::feature_probing::{EarlyEnd, FeatureProbing};
use super::prober::{Flag, Prober};
use super::repeat::SpotError;
use super::world::{normal_about, on_mesh};
use crate::features::Kind;
use crate::numeric::tangent_basis;
use crate::probing::plan::TouchPlan;

/// The poses of the touches of a spot, for tip (TCP) calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct TipPoses {
    /// where the spot was touched: the place that the scene has for the centre of the ball, with the axes of the flange, in B
    pub poses_bf: Vec<Isometry3<f64>>,
    /// out of the spot in B, about
    pub normal_b: Unit<Vector3<f64>>,
    /// orientations that were left out
    pub not_reached: Vec<NotReached>,
}

/// The ball begins to search this far above the spot, and searches twice as far, m: the tip may be off by less.
const STANDOFF: f64 = 6e-3;
/// The tool comes from this far above where it begins to search, m.
const ABOVE: f64 = 5e-3;
/// Upright the spot is touched this far to each side: that is how the plane lies, m.
const ASIDE: f64 = 5e-3;
/// Leans, °, and how many orientations around each.
const RINGS: [(f64, usize); 2] = [(20.0, 6), (40.0, 6)];

impl Prober<'_> {
    /// Touches one flat spot upright at four places around it, and then on it leaning to all sides.
    ///
    /// - `spot`: on the mesh or near it, m in O; flat for some 10 mm about.
    ///
    /// # Errors
    /// [`SpotError`]; the arm is stopped then, and has retracted wherever it was still allowed to move.
    pub fn measure_tip(&mut self, spot: &Point3<f64>) -> Result<TipPoses, SpotError> {
        let flag = Flag { id: 0, kind: Some(Kind::Plane), place: *spot, radius: ASIDE };
        let (_, mut probing) = self.begin(&flag).map_err(|broken| SpotError::Ended(broken.into()))?;
        let place = on_mesh(self.world, spot);
        let normal = normal_about(self.world, &place, &self.cell.shaft(&probing.rotation));
        let normal_b = Unit::new_normalize(self.cell.pose_bo.rotation * normal.into_inner());
        let mut measured = TipPoses { poses_bf: Vec::new(), normal_b, not_reached: Vec::new() };
        let touched = self.touch_leaning(&place, &normal, &mut probing, &mut measured);
        match self.finish(touched, &mut probing) {
            Err(broken) => Err(SpotError::Ended(broken.into())),
            Ok(Some(failed)) => Err(failed),
            Ok(None) => Ok(measured),
        }
    }

    /// Makes all touches; the error of the first that cannot be used.
    fn touch_leaning(
        &mut self,
        place: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        probing: &mut FeatureProbing,
        measured: &mut TipPoses,
    ) -> Result<Option<SpotError>, EarlyEnd> {
        let [u, v] = tangent_basis(normal).map(|across| across * ASIDE);
        let around = [u, v, -u, -v].map(|aside| (Orientation { lean: 0.0, towards: 0.0 }, aside));
        let leaning = rings(RINGS).map(|orientation| (orientation, Vector3::zeros()));
        let upright = probing.rotation;
        for (orientation, aside) in around.into_iter().chain(leaning) {
            if probing.seconds() > self.params.limits.time {
                return Ok(Some(SpotError::Ended(Ending::TimeSpent)));
            }
            probing.rotation = leaned(&upright, &orientation);
            let from = place + normal.into_inner() * (self.params.pattern.ball_radius + STANDOFF) + aside;
            let entry = from + normal.into_inner() * ABOVE;
            let planned = TouchPlan { entry, from, direction: -*normal, search: 2.0 * STANDOFF, expected: None };
            let left_out = |why: String| NotReached { orientation, why };
            match self.touch_and_retract(&planned, probing) {
                Ok(ProbedTouch { centre: Some(centre), refused: None, .. }) => {
                    let tip = self.cell.pose(&probing.rotation, &centre);
                    let rotation = tip.rotation * self.cell.pose_ft.rotation.inverse();
                    measured.poses_bf.push(Isometry3::from_parts(tip.translation, rotation));
                }
                Ok(ProbedTouch { refused, .. }) => {
                    let why = refused.unwrap_or_else(|| "nothing is there".to_owned());
                    return Ok(Some(SpotError::NoContact { touch: measured.poses_bf.len() + 1, why }));
                }
                Err(EarlyEnd::Limit(error)) => measured.not_reached.push(left_out(error.to_string())),
                Err(EarlyEnd::Link(error)) => measured.not_reached.push(left_out(error.to_string())),
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}
