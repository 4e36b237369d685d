//! Repeated touches of one spot from both sides: repeatability and stiffness of the arm.

use nalgebra::{Point3, Unit, Vector3};

use super::ending::{Ending, ProbedTouch};
use super::feature_probing::FeatureProbing;
use super::prober::{Flag, Prober};
use super::world::{normal_about, on_mesh};
use crate::arm::{Onset, OnsetVerdict, TouchOutcome};
use crate::plan::TouchPlan;
use touchup_features::features::FeatureKind;
use touchup_geometry::numeric::tangent_basis;

/// One touch of the spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotTouch {
    /// Side from which the tool came: 1 or -1.
    pub side: i8,
    /// Height of the ball's centre at contact, along the outward normal, m from the origin of O.
    pub height: f64,
    /// Standard uncertainty of the height, m.
    pub sigma: f64,
    /// Stiffness of arm, probe and part together, and its standard uncertainty, N/m.
    pub stiffness: [f64; 2],
    /// Class of the curve.
    pub verdict: OnsetVerdict,
}

/// Results of the touches of one spot.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeatability {
    /// Touches in order; every second one from the other side.
    pub touches: Vec<SpotTouch>,
    /// Place of the spot on the mesh, m in O.
    pub place: Point3<f64>,
    /// Normal out of the part, in O.
    pub normal: Unit<Vector3<f64>>,
    /// Mean height of the touches, m.
    pub mean_height: f64,
    /// Range of the heights, m.
    pub range: f64,
    /// Standard deviation of one touch, m.
    pub deviation: f64,
    /// Mean height from the first side above that from the other, m.
    pub reversal: f64,
    /// Stiffness of arm, probe and part together, and its standard uncertainty, N/m: mean and
    /// scatter of the curves.
    pub stiffness: [f64; 2],
}

/// Why the spot gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpotError {
    /// An early end of the motion.
    #[error("{0}")]
    Ended(#[from] Ending),
    /// A touch without contact, or without a usable one.
    #[error("touch {touch}: {why}")]
    NoContact {
        /// number of the touch, from 1 on
        touch: usize,
        /// reason in words
        why: String,
    },
}

/// Height above the spot at which a search of twice this length begins, m.
const STANDOFF: f64 = 2e-3;
/// Distance of the tool's entry aside, and above the start of the search, m.
const ASIDE: f64 = 10e-3;
const ABOVE: f64 = 5e-3;

impl Prober<'_> {
    /// Touches one spot, from one side and from the other in turn, so that play of the joints
    /// shows.
    ///
    /// - `spot`: on the mesh or near it, m in O; flat for some 10 mm about.
    ///
    /// # Errors
    /// [`SpotError`]; the arm has then stopped, and has retracted unless it may no longer move.
    pub fn repeat(&mut self, spot: &Point3<f64>, count: usize) -> Result<Repeatability, SpotError> {
        self.at_spot(spot, |probing, place, normal| {
            let across = tangent_basis(&normal)[0];
            let from = place
                + normal.into_inner() * (probing.prober.params.pattern.ball_radius + STANDOFF);
            let mut touches = Vec::with_capacity(count);
            for touch in 1..=count {
                let side = if touch % 2 == 1 { 1 } else { -1 };
                let aside = across * (f64::from(side) * ASIDE);
                let entry = from + normal.into_inner() * ABOVE + aside;
                let planned = TouchPlan {
                    entry,
                    from,
                    direction: -normal,
                    search: 2.0 * STANDOFF,
                    expected: None,
                };
                let (onset, centre) = probing.touch_spot(&planned, touch)?;
                touches.push(SpotTouch {
                    side,
                    height: centre.coords.dot(&normal),
                    sigma: onset.sigma,
                    stiffness: [onset.stiffness, onset.stiffness_sigma],
                    verdict: onset.verdict,
                });
            }
            Ok(Repeatability::of(touches, place, normal))
        })
    }

    /// Begins at a spot, makes all its touches, and retracts.
    ///
    /// - `touch_all`: with the place of the spot on the mesh and its normal.
    pub(super) fn at_spot<T>(
        &mut self,
        spot: &Point3<f64>,
        touch_all: impl FnOnce(
            &mut FeatureProbing,
            Point3<f64>,
            Unit<Vector3<f64>>,
        ) -> Result<T, SpotError>,
    ) -> Result<T, SpotError> {
        let flag = Flag {
            id: 0,
            kind: Some(FeatureKind::Plane),
            place: *spot,
            radius: ASIDE,
        };
        let (_, mut probing) = self.begin(&flag)?;
        let (cell, world) = (probing.prober.cell, &*probing.prober.world);
        let place = on_mesh(world, spot);
        let normal = normal_about(world, &place, &cell.shaft(&probing.rotation));
        let touched = touch_all(&mut probing, place, normal);
        probing.finish_spot(touched)
    }
}

impl FeatureProbing<'_, '_> {
    /// Retracts after the touches of a spot, if the arm may move.
    pub(crate) fn finish_spot<T>(&mut self, touched: Result<T, SpotError>) -> Result<T, SpotError> {
        let ended = match touched {
            Err(SpotError::Ended(ending)) => Err(ending),
            touched => Ok(touched),
        };
        self.finish(ended)?
    }

    /// One touch of a spot, and the centre of the ball.
    ///
    /// - `touch`: its number, from 1 on.
    pub(crate) fn touch_spot(
        &mut self,
        planned: &TouchPlan,
        touch: usize,
    ) -> Result<(Onset, Point3<f64>), SpotError> {
        if self.is_spent() {
            return Err(Ending::TimeSpent.into());
        }
        let ProbedTouch {
            record,
            centre,
            refused,
            ..
        } = self.touch_and_retract(planned)?;
        match (record.map(|record| record.outcome), centre, refused) {
            (Some(TouchOutcome::Contact { onset, .. }), Some(centre), None) => Ok((onset, centre)),
            (_, _, why) => Err(SpotError::NoContact {
                touch,
                why: why.unwrap_or_else(|| "nothing is there".to_owned()),
            }),
        }
    }
}

impl Repeatability {
    /// - `touches`: from both sides.
    fn of(touches: Vec<SpotTouch>, place: Point3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        let heights = || touches.iter().map(|touch| touch.height);
        let [low, high] = heights().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| {
            [a.min(h), b.max(h)]
        });
        let mean_height = mean(&touches, None);
        let squares: f64 = heights().map(|height| (height - mean_height).powi(2)).sum();
        let (count, all) = (touches.len() as f64, || {
            touches.iter().map(|touch| touch.stiffness[0])
        });
        let stiffness = all().sum::<f64>() / count;
        let scatter = (all().map(|k| (k - stiffness).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        Self {
            mean_height,
            range: high - low,
            deviation: (squares / (count - 1.0)).sqrt(),
            reversal: mean(&touches, Some(1)) - mean(&touches, Some(-1)),
            stiffness: [stiffness, scatter / count.sqrt()],
            touches,
            place,
            normal,
        }
    }
}

/// Mean height of the touches from one side, or from both, m.
fn mean(touches: &[SpotTouch], side: Option<i8>) -> f64 {
    let heights = touches
        .iter()
        .filter(|touch| side.is_none_or(|side| touch.side == side));
    let [sum, count] = heights.fold([0.0, 0.0], |[sum, count], touch| {
        [sum + touch.height, count + 1.0]
    });
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights in µm and stiffnesses in N/mm with sums checked by hand.
    #[test]
    fn numbers_are_those_made_by_hand() {
        let touch = |(at, height, k): (usize, f64, f64)| SpotTouch {
            side: if at % 2 == 0 { 1 } else { -1 },
            height: 12e-3 + height * 1e-6,
            sigma: 1e-6,
            stiffness: [k * 1e3, 100.0],
            verdict: OnsetVerdict::Clean,
        };
        let touches = [
            (0, 1.0, 14.0),
            (1, -3.0, 16.0),
            (2, 5.0, 14.0),
            (3, -3.0, 16.0),
        ]
        .map(touch)
        .to_vec();
        let spot = Repeatability::of(touches, Point3::origin(), Vector3::z_axis());
        let near =
            |value: f64, expected: f64| (value - expected).abs() < 1e-12 + 1e-9 * expected.abs();
        assert!(near(spot.range, 8e-6), "{}", spot.range);
        assert!(near(spot.reversal, 6e-6), "{}", spot.reversal);
        // mean 0, squares 1 + 9 + 25 + 9 over 3
        assert!(
            near(spot.deviation, (44.0f64 / 3.0).sqrt() * 1e-6),
            "{}",
            spot.deviation
        );
        let [k, u] = spot.stiffness;
        // mean 15, squares 4 over 3, over 4 touches
        assert!(
            near(k, 15e3) && near(u, (4.0f64 / 3.0).sqrt() / 2.0 * 1e3),
            "{k} {u}"
        );
    }
}
