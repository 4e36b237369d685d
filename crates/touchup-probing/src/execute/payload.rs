//! Measurements for payload identification by the arm itself: in free air it turns its probe about
//! the ball into a cone of orientations, dwells in each, and keeps the mean wrench of its sensor.
//!
//! The first orientation of the arm is the middle. The plan of all paths comes before any motion.
//! Zeroing the sensor in each orientation keeps an unknown weight from stopping the arm; the
//! readings are of the raw wrench, which no zero changes.

use nalgebra::UnitQuaternion;

use super::cell::RobotCell;
use super::cone::{NotReached, ShaftOrientation, leaned, rings};
use super::ending::Ending;
use super::links::Tool;
use super::prober::Prober;
use super::route::{ArmFreeSpace, Route, ToolState};
use touchup_features::calibrate::{SampleBlock, StaticPose};
use touchup_method::stylus::Sample;

/// Static segments for payload identification.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadReadings {
    /// segments in order: orientation of the flange in the base, raw wrench in the axes of the
    /// flange about its origin
    pub segments: Vec<StaticPose>,
    /// orientations left out
    pub not_reached: Vec<NotReached>,
}

/// Why there is no measurement of the payload.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PayloadProbeError {
    /// An early end of the motion.
    #[error("{0}")]
    Ended(#[from] Ending),
    /// Too few orientations; nothing moved.
    #[error(
        "the arm gets to {reached} of {wanted} orientations, {FEWEST} are needed; {why}. Nothing moved: bring the probe to where the \
         wrist has more room"
    )]
    TooFew {
        /// reachable orientations
        reached: usize,
        /// planned orientations
        wanted: usize,
        /// reason of the first unreachable one
        why: String,
    },
}

/// Leans of the shaft, °, and the number of orientations around each: two neighbours are 51° apart
/// at the most.
const RINGS: [(f64, usize); 3] = [(0.0, 1), (30.0, 6), (60.0, 6)];
/// Minimum number of orientations: six unknowns of the force and three equations from each; these
/// leave degrees of freedom for the residuals.
const FEWEST: usize = 6;
/// Settling time of sensor and arm after a motion, s.
const SETTLE: f64 = 0.3;
/// Averaging time of the wrench, s: 500 readings of a UR.
const AVERAGED: f64 = 1.0;

impl Prober<'_> {
    /// Measures the wrench of the payload in free air around the pose of the arm, and goes back
    /// there.
    ///
    /// # Errors
    /// [`PayloadProbeError`]; the arm has then stopped.
    pub fn measure_payload(&mut self) -> Result<PayloadReadings, PayloadProbeError> {
        let (state, _) = self.in_free_air(self.params.limits.force)?;
        let home = ToolState::of(self.cell, &state);
        // the whole probe up to the flange keeps clear
        let length = self.cell.pose_ft.translation.vector.norm();
        let cell = RobotCell {
            tool: Tool {
                shaft_length: length,
                ..self.cell.tool
            },
            ..self.cell.clone()
        };
        let space = ArmFreeSpace {
            cell: &cell,
            ..self.space()
        };
        let (routes, not_reached, last) = routes(&space, &home);
        if routes.len() < FEWEST {
            let why = not_reached
                .into_iter()
                .next()
                .map_or_else(String::new, |first: NotReached| first.why);
            return Err(PayloadProbeError::TooFew {
                reached: routes.len(),
                wanted: orientations().count(),
                why,
            });
        }
        let back = space.route(&last, &home.rotation, &home.place)?;
        let mut segments = Vec::new();
        for route in &routes {
            self.turn_along(route)?;
            let Some((segment, ended_ns)) = self.dwell()? else {
                continue;
            };
            if (ended_ns - state.stamp_ns) as f64 * 1e-9 > self.params.limits.time {
                return Err(Ending::TimeSpent.into());
            }
            self.world.weighed(&segment);
            segments.push(segment);
        }
        self.turn_along(&back)?;
        Ok(PayloadReadings {
            segments,
            not_reached,
        })
    }

    pub(super) fn turn_along(&mut self, route: &Route) -> Result<(), Ending> {
        let (cell, touch, most) = (self.cell, &self.params.touch, self.params.limits.force);
        let mut watched = self.watched();
        for (place, rotation) in &route.stops {
            let pose = cell.pose(rotation, place);
            // an unknown weight loads the sensor as the probe turns
            watched.line("turning in free air", &pose, touch.link_speed, touch, most)?;
        }
        Ok(())
    }

    /// Dwells, averages the wrench, and zeroes the sensor; returns the segment, and the stamp of
    /// its end, ns.
    fn dwell(&mut self) -> Result<Option<(StaticPose, i64)>, Ending> {
        let r_tf = self.cell.pose_ft.rotation.inverse();
        let mut watched = self.watched();
        watched.dwell("settling in free air", SETTLE, &mut |_| {})?;
        let (mut block, mut r_bt) = (None::<SampleBlock>, UnitQuaternion::identity());
        watched.dwell("measuring the payload", AVERAGED, &mut |state| {
            let sample = Sample {
                stamp_ns: state.stamp_ns,
                pose_ot: state.pose_bt,
                wrench: state.raw_wrench_f,
            };
            match &mut block {
                Some(block) => block.add(&sample),
                None => block = Some(SampleBlock::of(&sample)),
            }
            r_bt = state.pose_bt.rotation;
        })?;
        let most = watched.limits.force;
        watched.zero_below(most)?;
        Ok(block.map(|block| {
            (
                StaticPose {
                    r_wt: r_bt * r_tf,
                    ..block.static_pose()
                },
                block.end_ns,
            )
        }))
    }
}

/// Paths from one orientation to the next, orientations without a path, and the end of the last
/// path.
fn routes(space: &ArmFreeSpace, home: &ToolState) -> (Vec<Route>, Vec<NotReached>, ToolState) {
    let (mut routes, mut not_reached, mut at) = (Vec::new(), Vec::new(), *home);
    for orientation in orientations() {
        let rotation = leaned(&home.rotation, &orientation);
        match space.route(&at, &rotation, &home.place) {
            Ok(route) => {
                let place = route.stops.last().map_or(at.place, |(place, _)| *place);
                at = ToolState {
                    place,
                    rotation,
                    joints: route.joints,
                };
                routes.push(route);
            }
            Err(ending) => not_reached.push(NotReached {
                orientation,
                why: ending.why(),
            }),
        }
    }
    (routes, not_reached, at)
}

fn orientations() -> impl Iterator<Item = ShaftOrientation> {
    rings(RINGS)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_shaft_leans_as_far_and_to_where_it_should() {
        let shafts: Vec<_> = orientations()
            .map(|one| {
                (
                    one,
                    leaned(&UnitQuaternion::identity(), &one) * Vector3::z(),
                )
            })
            .collect();
        assert_eq!(shafts.len(), 13);
        for (one, shaft) in &shafts {
            let (sin, cos) = one.towards.sin_cos();
            let expected = Vector3::new(one.lean.sin() * cos, one.lean.sin() * sin, one.lean.cos());
            assert!((shaft - expected).norm() < 1e-12, "{one:?}: {shaft}");
        }
        // from one to the next: 2 asin(sin 60° sin 30°) = 51.3°
        let turns = shafts.windows(2).map(|pair| pair[0].1.angle(&pair[1].1));
        assert!(turns.fold(0.0, f64::max) < 51.4f64.to_radians());
    }
}
