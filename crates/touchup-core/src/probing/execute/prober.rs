//! From a flag to a feature: plan, path, touch, and again.

use nalgebra::{Isometry3, Point3, Unit};

use super::cell::Cell;
use super::ending::{Ending, Probed, ProbedTouch};
use super::feature_probing::FeatureProbing;
use super::links::{Clearance, LinkError, Tool};
use super::route::{ToolState, may_touch, route};
use super::world::{Phase, Progress, World, distance, normal_about, on_mesh};
use crate::features::Kind;
use crate::probing::arm::{
    Arm, ArmState, LimitError, Limits, Narrower, Observer, OnsetVerdict, ProbeError, TouchOutcome, TouchParams,
    TouchRecord, TouchTarget, Watched,
};
use crate::probing::plan::{ExploreError, Explorer, PatternParams, TouchPlan, TouchResult};

/// A place to probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flag {
    /// its number
    pub id: u32,
    /// what it is; `None`: unknown
    pub kind: Option<Kind>,
    /// m, in O
    pub place: Point3<f64>,
    /// it is no farther than this from the place, m
    pub radius: f64,
}

/// How is probed.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeParams {
    /// single touches
    pub touch: TouchParams,
    /// what is wanted of a feature; the radius around a flag is the flag's
    pub pattern: PatternParams,
    /// whether the ball slides over all of what its touches have found
    pub slides: bool,
    /// what must never be left
    pub limits: Limits,
}

/// The limit of force is so much above the force of a touch at least: the force grows a little while the arm brakes.
const HEADROOM: f64 = 1.3;

impl ProbeParams {
    /// These with what a request asks for, which can only be less.
    ///
    /// # Errors
    /// As [`Limits::narrowed`]; [`LimitError::TooSoft`].
    pub fn narrowed(&self, by: &Narrower) -> Result<Self, LimitError> {
        let limits = self.limits.narrowed(by)?;
        let mut touch = self.touch;
        touch.force = touch.force.min(limits.force / HEADROOM);
        if touch.force <= touch.trigger {
            return Err(LimitError::TooSoft { asked_n: limits.force, least_n: touch.trigger * HEADROOM });
        }
        Ok(Self { touch, limits, ..self.clone() })
    }
}

/// Probes features with an arm.
pub struct Prober<'a> {
    pub(super) arm: &'a mut dyn Arm,
    pub(super) cell: &'a Cell,
    pub(super) params: &'a ProbeParams,
    pub(super) world: &'a mut dyn World,
}

/// A search that ends this much before its planned length has not searched the remainder, m.
const SHORT: f64 = 0.1e-3;
/// Touches that begin nearer than this to each other, over the ball's radius, are gone between inside of the feature.
const INSIDE: f64 = 0.5;
/// An observer that does not cancel: for the retraction that ends a cancelled probing.
struct OnlyLooks<'a>(&'a mut dyn World);

impl Observer for OnlyLooks<'_> {
    fn on_state(&mut self, state: &ArmState) {
        self.0.on_state(state);
    }
}

impl<'a> Prober<'a> {
    /// - `arm`: at rest in free air.
    pub fn new(arm: &'a mut dyn Arm, cell: &'a Cell, params: &'a ProbeParams, world: &'a mut dyn World) -> Self {
        Self { arm, cell, params, world }
    }

    /// Probes one flagged feature. Whatever happens, the arm is stopped when this returns; it has retracted wherever it was still
    /// allowed to move.
    pub fn probe(&mut self, flag: &Flag) -> Probed {
        let (mut explorer, mut probing) = match self.begin(flag) {
            Ok(begun) => begun,
            Err(ending) => {
                let (touches, slides) = (Vec::new(), Vec::new());
                return Probed { flag: flag.id, ending, found: None, touches, slides, seconds: 0.0, peak_force: 0.0 };
            }
        };
        let mut ended = self.explore(&mut explorer, &mut probing);
        if self.params.slides && ended.is_ok() {
            ended = self.slide_over(explorer.slides(), &mut probing);
        }
        let ended = self.finish(ended, &mut probing);
        let found = explorer.found();
        let ending = match (ended, &found) {
            (Err(ending), _) => ending,
            (Ok(()), Ok(found)) if found.is_as_asked => Ending::ToleranceReached,
            // not done: the search did not end
            (Ok(()), Ok(_) | Err(ExploreError::NotDone { .. })) => Ending::TouchesSpent,
            (Ok(()), Err(error)) => Ending::NothingFound(error.clone()),
        };
        Probed {
            flag: flag.id,
            ending,
            found: found.ok(),
            seconds: probing.seconds(),
            peak_force: probing.peak_force,
            touches: probing.touches,
            slides: probing.slides,
        }
    }

    /// The arm, watched by all that watches it.
    pub(super) fn watched(&mut self) -> Watched<'_> {
        Watched::new(self.arm, self.params.limits.clone(), self.world)
    }

    /// Where the arm is, at rest in free air with its sensor zeroed.
    pub(super) fn in_free_air(&mut self) -> Result<ArmState, Ending> {
        // zeroing the sensor would remove a force that acts now
        let arm = |error| ProbeError::Arm { doing: "asking where the arm is", error };
        let now = self.arm.next_state().map_err(arm)?;
        let (here, bare) = (self.cell.place(&now.pose_bt), Tool { margin: 0.0, ..self.cell.tool });
        let shaft = self.cell.shaft(&now.pose_bt.rotation);
        let room = Clearance { tool: &bare, shaft, distance: &distance(&*self.world) }.room(&here, 0.0);
        if room < 0.0 {
            let place_mm = (here * 1e3).coords.into();
            return Err(LinkError::InPart { place_mm }.into());
        }
        // in free air, where it is stopped: the first link is watched by the force as well
        self.watched().zero()?;
        Ok(self.arm.next_state().map_err(arm)?)
    }

    /// The explorer and where the arm is, when both can begin.
    pub(super) fn begin(&mut self, flag: &Flag) -> Result<(Explorer, FeatureProbing), Ending> {
        let state = self.in_free_air()?;
        let shaft_now = self.cell.shaft(&state.pose_bt.rotation);
        let place = on_mesh(self.world, &flag.place);
        let normal = normal_about(self.world, &place, &shaft_now);
        let rotation = self.cell.upright(&state.pose_bt.rotation, &normal);
        let pattern = PatternParams { flag_radius: flag.radius, ..self.params.pattern };
        let explorer = Explorer::new(flag.kind, &place, &normal, pattern)?;
        let probing = FeatureProbing {
            flag: flag.id,
            rotation,
            out: ToolState::of(self.cell, &state),
            is_out: true,
            entry: None,
            from: None,
            begun_ns: state.stamp_ns,
            ended_ns: state.stamp_ns,
            touches: Vec::new(),
            slides: Vec::new(),
            peak_force: 0.0,
        };
        Ok((explorer, probing))
    }

    /// Retracts, wherever the arm is allowed to move.
    pub(super) fn finish<T>(&mut self, ended: Result<T, Ending>, probing: &mut FeatureProbing) -> Result<T, Ending> {
        use Ending::{Cancelled, NoClearPath, OutOfLimits, Stopped, TimeSpent};
        // a failed retraction outranks these
        let is_unbroken = matches!(ended, Ok(_) | Err(Cancelled | TimeSpent));
        let may_move =
            is_unbroken || matches!(ended, Err(NoClearPath(_) | OutOfLimits(_) | Stopped(ProbeError::TooLong { .. })));
        let retracted = if may_move { self.retract(probing) } else { Ok(()) };
        // where nothing comes any more it ended when it was seen last
        probing.ended_ns = self.arm.next_state().map_or(probing.ended_ns, |state| state.stamp_ns.max(probing.ended_ns));
        match retracted {
            Err(error) if is_unbroken => Err(error.into()),
            // the first error is the one to report
            _ => ended,
        }
    }

    /// One touch by itself: there, and back into free air.
    pub(super) fn touch_and_retract(
        &mut self,
        planned: &TouchPlan,
        probing: &mut FeatureProbing,
    ) -> Result<ProbedTouch, Ending> {
        // zeroed again for each, as another touch has nothing to do with it
        let (_, touched) = self.go_and_touch(planned, probing, &mut false)?;
        self.retract(probing)?;
        Ok(touched)
    }

    fn explore(&mut self, explorer: &mut Explorer, probing: &mut FeatureProbing) -> Result<(), Ending> {
        let mut is_zeroed = false;
        while let Some(planned) = explorer.next_touch() {
            if probing.seconds() > self.params.limits.time {
                return Err(Ending::TimeSpent);
            }
            self.publish(explorer, probing, explorer.touches() + 1);
            let (result, touch) = match self.go_and_touch(&planned, probing, &mut is_zeroed) {
                Ok(touched) => touched,
                // the first one is where the feature is
                Err(ending @ (Ending::OutOfLimits(_) | Ending::NoClearPath(_))) if probing.touches.is_empty() => {
                    return Err(ending);
                }
                Err(ending) if ending.is_of_one() => {
                    let refused = Some(ending.why());
                    (
                        TouchResult::Unclear,
                        ProbedTouch { planned, record: None, centre: None, deviation: None, refused },
                    )
                }
                Err(ending) => return Err(ending),
            };
            explorer.take(&result);
            probing.touches.push(touch);
        }
        self.publish(explorer, probing, explorer.touches());
        Ok(())
    }

    fn publish(&mut self, explorer: &Explorer, probing: &FeatureProbing, touch: usize) {
        self.world.publish(&Progress {
            flag: probing.flag,
            touch,
            budget: self.params.pattern.budget,
            uncertainty: explorer.uncertainty(),
        });
    }

    /// A link move, or one that is guarded, to a pose of the tip in B.
    fn line(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        probing: &mut FeatureProbing,
        guard: LineGuard,
    ) -> Result<(), Ending> {
        let ProbeParams { touch, limits, .. } = self.params;
        let (speed, trigger) = match guard {
            LineGuard::Link => (touch.link_speed, LINK_TRIGGER * touch.trigger),
            LineGuard::Slow => (touch.safe_speed(), touch.trigger),
            // the part may be in contact
            LineGuard::Retract => (touch.link_speed, limits.force),
        };
        let mut watched = self.watched();
        let moved = watched.line(doing, to, speed, touch, trigger);
        probing.keep(&watched);
        // however slow a link is, nothing should be there
        moved.map_err(|error| match (error, guard) {
            (ProbeError::Obstacle { doing, force_n, place_mm, .. }, LineGuard::Link) => {
                ProbeError::Obstacle { doing, force_n, place_mm, is_link: true }.into()
            }
            (error, _) => error.into(),
        })
    }

    /// Brings the ball to where a touch is entered from, and touches.
    fn go_and_touch(
        &mut self,
        planned: &TouchPlan,
        probing: &mut FeatureProbing,
        is_zeroed: &mut bool,
    ) -> Result<(TouchResult, ProbedTouch), Ending> {
        let joints = may_touch(self.cell, &self.params.limits, &probing.rotation, planned, &probing.out.joints);
        probing.out.joints = joints?;
        let near = INSIDE * self.params.pattern.ball_radius;
        let is_near = probing.from.is_some_and(|from| (from - planned.from).norm() < near);
        // else it stays inside of the feature
        if !is_near || planned.from == planned.entry {
            self.reach(&planned.entry, probing, is_zeroed)?;
        }
        self.touch(planned, probing)
    }

    /// Out of the feature, and through free air to a place above it.
    pub(super) fn reach(
        &mut self,
        above: &Point3<f64>,
        probing: &mut FeatureProbing,
        is_zeroed: &mut bool,
    ) -> Result<(), Ending> {
        self.world.enter(Phase::Link);
        while let Some(place) = probing.next_out() {
            let pose = self.cell.pose(&probing.rotation, &place);
            self.line("going up out of the feature", &pose, probing, LineGuard::Retract)?;
            probing.is_at_next_out();
        }
        let route = route(self.cell, &self.params.limits, &*self.world, &probing.out, &probing.rotation, above)?;
        for (place, rotation) in route.stops {
            let pose = self.cell.pose(&rotation, &place);
            self.line("going through free air", &pose, probing, LineGuard::Link)?;
            (probing.out.place, probing.out.rotation) = (place, rotation);
        }
        probing.out.joints = route.joints;
        if !*is_zeroed {
            // again where it is touched: turning the wrist loads its sensor
            self.world.enter(Phase::Zeroing);
            self.watched().zero()?;
            *is_zeroed = true;
        }
        probing.is_out = false;
        if probing.out.place != *above {
            self.world.enter(Phase::Approach);
            let pose = self.cell.pose(&probing.rotation, above);
            self.line("coming near", &pose, probing, LineGuard::Slow)?;
            probing.entry = Some(*above);
        }
        Ok(())
    }

    fn touch(
        &mut self,
        planned: &TouchPlan,
        probing: &mut FeatureProbing,
    ) -> Result<(TouchResult, ProbedTouch), Ending> {
        let target = TouchTarget {
            standoff_bt: self.cell.pose(&probing.rotation, &planned.from),
            direction: Unit::new_normalize(self.cell.pose_bo.rotation * planned.direction.into_inner()),
            search: planned.search,
            expected: planned.expected,
        };
        let before = distances(self.world, planned, self.params.pattern.ball_radius);
        self.world.enter(Phase::Search);
        let touch = &self.params.touch;
        let mut watched = self.watched();
        let touched = watched.touch(&target, touch);
        probing.keep(&watched);
        // where the ball has not been it does not go on the retraction
        if touched.as_ref().map_or_else(ProbeError::was_at_standoff, |_| true) {
            probing.from = Some(planned.from);
        }
        let record = touched?;
        Ok(self.probed_touch(*planned, record, &before))
    }

    /// The result for the explorer, and the record of the touch.
    fn probed_touch(
        &self,
        planned: TouchPlan,
        record: TouchRecord,
        before: &[Option<f64>],
    ) -> (TouchResult, ProbedTouch) {
        let (result, refused) = match &record.outcome {
            TouchOutcome::Contact { onset, .. } if onset.verdict == OnsetVerdict::Impact => {
                (TouchResult::Unclear, Some("an impact: the force was over before the surface held".to_owned()))
            }
            TouchOutcome::Contact { onset, centre, .. } => {
                let centre = self.cell.pose_bo.inverse_transform_point(centre);
                (TouchResult::At { centre, sigma: onset.sigma }, None)
            }
            TouchOutcome::Miss { travel } if *travel < planned.search - SHORT => {
                let why = format!("nothing within {:.1} mm, where the limit of a search ends", travel * 1e3);
                (TouchResult::Unclear, Some(why))
            }
            TouchOutcome::Miss { .. } => (TouchResult::Nothing, None),
            TouchOutcome::Unclear(error) => (TouchResult::Unclear, Some(error.to_string())),
        };
        let centre = if let TouchResult::At { centre, .. } = result { Some(centre) } else { None };
        let deviation = centre.and_then(|centre| deviation(before, &planned, &centre));
        (result, ProbedTouch { planned, record: Some(record), centre, deviation, refused })
    }

    /// Out of the feature into free air.
    fn retract(&mut self, probing: &mut FeatureProbing) -> Result<(), ProbeError> {
        self.world.enter(Phase::Retract);
        let (touch, limits) = (&self.params.touch, &self.params.limits);
        let mut onlooker = OnlyLooks(self.world);
        let mut watched = Watched::new(self.arm, limits.clone(), &mut onlooker);
        let mut retracted = Ok(());
        while let (Ok(()), Some(place)) = (&retracted, probing.next_out()) {
            let pose = self.cell.pose(&probing.rotation, &place);
            retracted = watched.line("retracting", &pose, touch.link_speed, touch, limits.force);
            if retracted.is_ok() {
                probing.is_at_next_out();
            }
        }
        probing.keep(&watched);
        retracted
    }
}

/// Distance of a ball from the mesh at each [`SAMPLED`] of the path of a touch, before the touch moves the mesh; m, positive outside,
/// `None` where no mesh is near.
fn distances(world: &dyn World, planned: &TouchPlan, ball_radius: f64) -> Vec<Option<f64>> {
    let count = (planned.search / SAMPLED).ceil() as usize + 1;
    let at = |sample: usize| {
        let centre = planned.from + planned.direction.into_inner() * (SAMPLED * sample as f64);
        let hit = world.closest_face(&centre, DEVIATION_REACH)?;
        let off = centre - hit.point;
        Some(off.norm().copysign(off.dot(&world.mesh().normal(hit.face))) - ball_radius)
    };
    (0..=count).map(at).collect()
}

/// How far the surface that a ball touched was from the mesh, m, positive outside.
fn deviation(distances: &[Option<f64>], planned: &TouchPlan, centre: &Point3<f64>) -> Option<f64> {
    let at = ((centre - planned.from).dot(&planned.direction) / SAMPLED).max(0.0);
    let sample = at as usize;
    let (here, next) = ((*distances.get(sample)?)?, (*distances.get(sample + 1)?)?);
    Some(here + (next - here) * (at - at.floor()))
}

/// The distance from the mesh is sampled this often along the path of a touch, m: between two of them a wall with a radius of 1 mm bends by 1 µm.
const SAMPLED: f64 = 0.1e-3;

/// How a line is watched.
#[derive(Clone, Copy)]
enum LineGuard {
    /// fast, where the path is clear
    Link,
    /// slow enough for whatever is there
    Slow,
    /// where the part may be in contact
    Retract,
}

/// In a fast move the sensor also measures accelerations: more force than this many triggers is an obstacle.
const LINK_TRIGGER: f64 = 1.5;
/// The mesh is searched this far from a contact, m.
const DEVIATION_REACH: f64 = 20e-3;
