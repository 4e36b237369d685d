//! Measurements for payload identification by the arm itself: in free air it turns its probe about the ball into a cone of
//! orientations, dwells in each, and keeps the mean wrench of the sensor there.
//!
//! The first orientation of the arm is the middle. All paths are planned before anything moves. The sensor is zeroed in
//! each orientation, so that a weight that is not known yet is no force to stop for; what is kept is the raw wrench, which no
//! zero changes.

use nalgebra::{UnitQuaternion, Vector3};

use super::cell::Cell;
use super::cone::{NotReached, Orientation, leaned, rings};
use super::ending::Ending;
use super::feature_probing::EarlyEnd;
use super::links::Tool;
use super::prober::Prober;
use super::route::{Route, ToolState, route};
use crate::probing::arm::{ArmState, Watched};
use crate::stylus::Wrench;

/// Mean wrench over the dwell in one orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PayloadReading {
    /// Of the flange F in the base B.
    pub r_bf: UnitQuaternion<f64>,
    /// Mean of the raw wrench, in F about its origin.
    pub wrench_f: Wrench,
    /// Standard deviation of one reading of the force, per axis, N.
    pub noise: f64,
    /// Readings in the mean.
    pub readings: usize,
}

/// The static segments for payload identification.
#[derive(Clone, Debug, PartialEq)]
pub struct PayloadReadings {
    /// in their order
    pub segments: Vec<PayloadReading>,
    /// those that were left out
    pub not_reached: Vec<NotReached>,
}

/// Why the payload was not measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PayloadProbeError {
    /// The arm did not get so far.
    #[error("{0}")]
    Ended(Ending),
    /// Nothing moved.
    #[error(
        "the arm gets to {reached} of {wanted} orientations, {FEWEST} are needed; {why}. Nothing moved: bring the probe to where the \
         wrist has more room"
    )]
    TooFew {
        /// how many
        reached: usize,
        /// of how many
        wanted: usize,
        /// of the first that it does not get to
        why: String,
    },
}

/// Leans of the shaft, °, and how many orientations around each: two neighbours are 51° apart at the most.
const RINGS: [(f64, usize); 3] = [(0.0, 1), (30.0, 6), (60.0, 6)];
/// Six unknowns of the force and three equations from each; these leave degrees of freedom for the residuals.
const FEWEST: usize = 6;
/// A sensor and an arm that were just moved come to equilibrium in so long, s.
const SETTLE: f64 = 0.3;
/// The wrench is averaged over this time, s: 500 readings of a UR.
const AVERAGED: f64 = 1.0;

/// Sums over the states of one dwell.
#[derive(Default)]
struct WrenchSums {
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// Σ |fᵢ − fᵢ₋₁|²
    squares: f64,
    last: Option<ArmState>,
    count: usize,
}

impl WrenchSums {
    fn add(&mut self, state: &ArmState) {
        let Wrench { force, torque } = state.raw_wrench_f;
        self.force += force;
        self.torque += torque;
        let before = self.last.replace(*state).map_or(force, |last| last.raw_wrench_f.force);
        self.squares += (force - before).norm_squared();
        self.count += 1;
    }

    /// From a state to the last one, s.
    fn seconds_after(&self, state: &ArmState) -> f64 {
        self.last.map_or(0.0, |last| (last.stamp_ns - state.stamp_ns) as f64 * 1e-9)
    }

    /// `None` where there are fewer than two states.
    fn reading(&self, cell: &Cell) -> Option<PayloadReading> {
        let n = self.count as f64;
        let last = self.last.filter(|_| self.count > 1)?;
        Some(PayloadReading {
            r_bf: last.pose_bt.rotation * cell.pose_ft.rotation.inverse(),
            wrench_f: Wrench { force: self.force / n, torque: self.torque / n },
            // a difference of two readings has twice the variance of one, on three axes
            noise: (self.squares / (6.0 * (n - 1.0))).sqrt(),
            readings: self.count,
        })
    }
}

impl Prober<'_> {
    /// Measures the wrench of the payload in free air around the pose of the arm, and goes back there.
    ///
    /// # Errors
    /// [`PayloadProbeError`]; the arm is stopped then.
    pub fn measure_payload(&mut self) -> Result<PayloadReadings, PayloadProbeError> {
        let ended = |broken: EarlyEnd| PayloadProbeError::Ended(broken.into());
        let state = self.in_free_air().map_err(ended)?;
        let home = ToolState {
            place: self.cell.place(&state.pose_bt),
            rotation: state.pose_bt.rotation,
            joints: state.joints,
        };
        // all of the probe up to the flange keeps clear
        let length = self.cell.pose_ft.translation.vector.norm();
        let cell = Cell { tool: Tool { shaft_length: length, ..self.cell.tool }, ..self.cell.clone() };
        let (routes, not_reached, last) = self.routes(&cell, &home);
        if routes.len() < FEWEST {
            let why = not_reached.into_iter().next().map_or_else(String::new, |first: NotReached| first.why);
            return Err(PayloadProbeError::TooFew { reached: routes.len(), wanted: orientations().count(), why });
        }
        let back = route(&cell, &self.params.limits, &*self.world, &last, &home.rotation, &home.place);
        let back = back.map_err(|barred| ended(barred.into()))?;
        let mut segments = Vec::new();
        for route in &routes {
            self.turn_along(route).map_err(ended)?;
            let sums = self.dwell().map_err(ended)?;
            if sums.seconds_after(&state) > self.params.limits.time {
                return Err(PayloadProbeError::Ended(Ending::TimeSpent));
            }
            segments.extend(sums.reading(&cell));
        }
        self.turn_along(&back).map_err(ended)?;
        Ok(PayloadReadings { segments, not_reached })
    }

    /// The paths from one orientation to the next, the orientations without a path, and where the last path ends.
    fn routes(&self, cell: &Cell, home: &ToolState) -> (Vec<Route>, Vec<NotReached>, ToolState) {
        let (mut routes, mut not_reached, mut at) = (Vec::new(), Vec::new(), *home);
        for orientation in orientations() {
            let rotation = leaned(&home.rotation, &orientation);
            match route(cell, &self.params.limits, &*self.world, &at, &rotation, &home.place) {
                Ok(route) => {
                    let place = route.stops.last().map_or(at.place, |(place, _)| *place);
                    at = ToolState { place, rotation, joints: route.joints };
                    routes.push(route);
                }
                Err(barred) => not_reached.push(NotReached { orientation, why: barred.to_string() }),
            }
        }
        (routes, not_reached, at)
    }

    fn turn_along(&mut self, route: &Route) -> Result<(), EarlyEnd> {
        let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
        let (touch, most) = (&self.params.touch, self.params.limits.force);
        for (place, rotation) in &route.stops {
            let pose = self.cell.pose(rotation, place);
            // a weight that is not known yet loads the sensor as the probe turns
            watched.line("turning in free air", &pose, touch.link_speed, touch, most)?;
        }
        Ok(())
    }

    /// Dwells, averages the wrench, and zeroes the sensor.
    fn dwell(&mut self) -> Result<WrenchSums, EarlyEnd> {
        let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
        watched.dwell("settling in free air", SETTLE, &mut |_| {})?;
        let mut sums = WrenchSums::default();
        watched.dwell("measuring the payload", AVERAGED, &mut |state| sums.add(state))?;
        watched.zero()?;
        Ok(sums)
    }
}

fn orientations() -> impl Iterator<Item = Orientation> {
    rings(RINGS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shaft_leans_as_far_and_to_where_it_should() {
        let shafts: Vec<_> =
            orientations().map(|one| (one, leaned(&UnitQuaternion::identity(), &one) * Vector3::z())).collect();
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
