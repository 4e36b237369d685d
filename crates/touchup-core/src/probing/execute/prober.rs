//! From a flag to a feature: plan, path, touch, and again.

use nalgebra::{Isometry3, Point3, Unit};

use super::cell::Cell;
use super::ending::{Ending, Probed, ProbedTouch};
use super::feature_probing::{EarlyEnd, FeatureProbing};
use super::links::{LinkError, Tool};
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
        let mut explorer = None;
        let (ended, probing) = self.run(flag, &mut explorer);
        let found = explorer.as_ref().map(Explorer::found);
        let ending = match ended {
            Ok(Some(ending)) => ending,
            Ok(None) => match &found {
                Some(Ok(found)) if found.is_as_asked => Ending::ToleranceReached,
                Some(Ok(_)) => Ending::TouchesSpent,
                // the search did not end
                Some(Err(ExploreError::NotDone { .. })) => Ending::TouchesSpent,
                Some(Err(error)) => Ending::NothingFound(error.clone()),
                None => Ending::TouchesSpent,
            },
            Err(broken) => broken.into(),
        };
        let mut probed = Probed { found: found.and_then(Result::ok), ..Probed::not_begun(flag.id, ending) };
        if let Some(probing) = probing {
            probed.seconds = probing.seconds();
            (probed.touches, probed.slides, probed.peak_force) = (probing.touches, probing.slides, probing.peak_force);
        }
        probed
    }

    /// Where the arm is, at rest in free air with its sensor zeroed.
    pub(super) fn in_free_air(&mut self) -> Result<ArmState, EarlyEnd> {
        // zeroing the sensor would remove a force that acts now
        let world = &*self.world;
        let clear = |place: &Point3<f64>, reach: f64| distance(world, place, reach);
        let arm = |error| ProbeError::Arm { doing: "asking where the arm is", error };
        let now = self.arm.next_state().map_err(arm)?;
        let (here, bare) = (self.cell.place(&now.pose_bt), Tool { margin: 0.0, ..self.cell.tool });
        if bare.room(&here, &self.cell.shaft(&now.pose_bt.rotation), &clear, 0.0) < 0.0 {
            let place_mm = (here * 1e3).coords.into();
            return Err(EarlyEnd::Link(LinkError::InPart { place_mm }));
        }
        // in free air, where it is stopped: the first link is watched by the force as well
        let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
        watched.zero()?;
        Ok(self.arm.next_state().map_err(arm)?)
    }

    /// The explorer and where the arm is, when both can begin.
    pub(super) fn begin(&mut self, flag: &Flag) -> Result<(Explorer, FeatureProbing), EarlyEnd> {
        let state = self.in_free_air()?;
        let shaft_now = self.cell.shaft(&state.pose_bt.rotation);
        let place = on_mesh(self.world, &flag.place);
        let normal = normal_about(self.world, &place, &shaft_now);
        let rotation = self.cell.upright(&state.pose_bt.rotation, &normal);
        let pattern = PatternParams { flag_radius: flag.radius, ..self.params.pattern };
        let explorer = Explorer::new(flag.kind, &place, &normal, pattern).map_err(EarlyEnd::Explore)?;
        let probing = FeatureProbing {
            flag: flag.id,
            rotation,
            out: ToolState {
                place: self.cell.place(&state.pose_bt),
                rotation: state.pose_bt.rotation,
                joints: state.joints,
            },
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

    fn run(
        &mut self,
        flag: &Flag,
        kept: &mut Option<Explorer>,
    ) -> (Result<Option<Ending>, EarlyEnd>, Option<FeatureProbing>) {
        let (explorer, mut probing) = match self.begin(flag) {
            Ok(begun) => begun,
            Err(broken) => return (Err(broken), None),
        };
        let explorer = kept.insert(explorer);
        let mut ended = self.explore(explorer, &mut probing);
        if self.params.slides && matches!(ended, Ok(None)) {
            ended = self.slide_over(explorer.slides(), &mut probing).map(|()| None);
        }
        (self.finish(ended, &mut probing), Some(probing))
    }

    /// Retracts, wherever the arm is allowed to move.
    pub(super) fn finish<T>(
        &mut self,
        ended: Result<T, EarlyEnd>,
        probing: &mut FeatureProbing,
    ) -> Result<T, EarlyEnd> {
        let retracted = if is_movable(&ended) { self.retract(probing) } else { Ok(()) };
        // where nothing comes any more it ended when it was seen last
        probing.ended_ns = self.arm.next_state().map_or(probing.ended_ns, |state| state.stamp_ns.max(probing.ended_ns));
        match (ended, retracted) {
            // a failed retraction outranks a cancellation
            (Ok(_) | Err(EarlyEnd::Arm(ProbeError::Cancelled { .. })), Err(error)) => Err(error.into()),
            // the first error is the one to report
            (ended, _) => ended,
        }
    }

    /// One touch by itself: there, and back into free air.
    pub(super) fn touch_and_retract(
        &mut self,
        planned: &TouchPlan,
        probing: &mut FeatureProbing,
    ) -> Result<ProbedTouch, EarlyEnd> {
        let joints = may_touch(self.cell, &self.params.limits, &probing.rotation, planned, &probing.out.joints);
        probing.out.joints = joints.map_err(EarlyEnd::Limit)?;
        // zeroed again for each, as another touch has nothing to do with it
        self.go(planned, probing, &mut false)?;
        let (_, touched) = self.touch(planned, probing)?;
        self.retract(probing)?;
        Ok(touched)
    }

    fn explore(&mut self, explorer: &mut Explorer, probing: &mut FeatureProbing) -> Result<Option<Ending>, EarlyEnd> {
        let mut is_zeroed = false;
        while let Some(planned) = explorer.next_touch() {
            if probing.seconds() > self.params.limits.time {
                return Ok(Some(Ending::TimeSpent));
            }
            self.publish(explorer, probing, explorer.touches() + 1);
            match may_touch(self.cell, &self.params.limits, &probing.rotation, &planned, &probing.out.joints) {
                Ok(joints) => probing.out.joints = joints,
                // the first one is where the feature is
                Err(error) if probing.touches.is_empty() => return Err(EarlyEnd::Limit(error)),
                Err(error) => {
                    explorer.take(&TouchResult::Unclear);
                    probing.touches.push(held_back(planned, error.to_string()));
                    continue;
                }
            }
            let touched = self.go(&planned, probing, &mut is_zeroed).and_then(|()| self.touch(&planned, probing));
            let (result, touch) = match touched {
                Ok((result, touch)) => (result, touch),
                Err(EarlyEnd::Arm(error @ ProbeError::Obstacle { is_link: false, .. })) => {
                    (TouchResult::Unclear, held_back(planned, error.to_string()))
                }
                Err(EarlyEnd::Link(error)) if !probing.touches.is_empty() => {
                    (TouchResult::Unclear, held_back(planned, error.to_string()))
                }
                Err(EarlyEnd::Limit(error)) if !probing.touches.is_empty() => {
                    (TouchResult::Unclear, held_back(planned, error.to_string()))
                }
                Err(error) => return Err(error),
            };
            explorer.take(&result);
            probing.touches.push(touch);
        }
        self.publish(explorer, probing, explorer.touches());
        Ok(None)
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
    ) -> Result<(), EarlyEnd> {
        let TouchParams { link_speed, trigger, .. } = self.params.touch;
        let (speed, trigger) = match guard {
            LineGuard::Link => (link_speed, LINK_TRIGGER * trigger),
            LineGuard::Slow => (self.params.touch.safe_speed(), trigger),
            // the part may be in contact
            LineGuard::Retract => (link_speed, self.params.limits.force),
        };
        let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
        let moved = watched.line(doing, to, speed, &self.params.touch, trigger);
        probing.keep(&watched);
        // however slow a link is, nothing should be there
        moved.map_err(|error| match (error, guard) {
            (ProbeError::Obstacle { doing, force_n, place_mm, .. }, LineGuard::Link) => {
                EarlyEnd::Arm(ProbeError::Obstacle { doing, force_n, place_mm, is_link: true })
            }
            (error, _) => EarlyEnd::Arm(error),
        })
    }

    /// Brings the ball to where a touch is entered from.
    fn go(&mut self, planned: &TouchPlan, probing: &mut FeatureProbing, is_zeroed: &mut bool) -> Result<(), EarlyEnd> {
        let near = INSIDE * self.params.pattern.ball_radius;
        if probing.from.is_some_and(|from| (from - planned.from).norm() < near) && planned.from != planned.entry {
            // stays inside of the feature
            return Ok(());
        }
        self.reach(&planned.entry, probing, is_zeroed)
    }

    /// Out of the feature, and through free air to a place above it.
    pub(super) fn reach(
        &mut self,
        above: &Point3<f64>,
        probing: &mut FeatureProbing,
        is_zeroed: &mut bool,
    ) -> Result<(), EarlyEnd> {
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
            let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
            watched.zero()?;
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
    ) -> Result<(TouchResult, ProbedTouch), EarlyEnd> {
        let target = TouchTarget {
            standoff_bt: self.cell.pose(&probing.rotation, &planned.from),
            direction: Unit::new_normalize(self.cell.pose_bo.rotation * planned.direction.into_inner()),
            search: planned.search,
            expected: planned.expected,
        };
        let before = Before::of(self.world, planned, self.params.pattern.ball_radius);
        self.world.enter(Phase::Search);
        let mut watched = Watched::new(self.arm, self.params.limits.clone(), self.world);
        let touched = watched.touch(&target, &self.params.touch);
        probing.keep(&watched);
        // where the ball has not been it does not go on the retraction
        if touched.as_ref().map_or_else(ProbeError::was_at_standoff, |_| true) {
            probing.from = Some(planned.from);
        }
        let record = touched?;
        Ok(self.probed_touch(*planned, record, &before))
    }

    /// The result for the explorer, and the record of the touch.
    fn probed_touch(&self, planned: TouchPlan, record: TouchRecord, before: &Before) -> (TouchResult, ProbedTouch) {
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
        let deviation = centre.and_then(|centre| before.deviation(&planned, &centre));
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

/// How far the mesh is along the path of a touch, as it is before the touch moves it.
struct Before {
    /// distance of a ball from it at each [`SAMPLED`] of the path, m, positive outside; `None` where no mesh is near
    distances: Vec<Option<f64>>,
}

impl Before {
    fn of(world: &dyn World, planned: &TouchPlan, ball_radius: f64) -> Self {
        let count = (planned.search / SAMPLED).ceil() as usize + 1;
        let at = |sample: usize| {
            let centre = planned.from + planned.direction.into_inner() * (SAMPLED * sample as f64);
            let hit = world.closest_face(&centre, DEVIATION_REACH)?;
            let off = centre - hit.point;
            Some(off.norm().copysign(off.dot(&world.mesh().normal(hit.face))) - ball_radius)
        };
        Self { distances: (0..=count).map(at).collect() }
    }

    /// How far the surface that a ball touched is from the mesh, m, positive outside.
    fn deviation(&self, planned: &TouchPlan, centre: &Point3<f64>) -> Option<f64> {
        let at = ((centre - planned.from).dot(&planned.direction) / SAMPLED).max(0.0);
        let sample = at as usize;
        let (here, next) = ((*self.distances.get(sample)?)?, (*self.distances.get(sample + 1)?)?);
        Some(here + (next - here) * (at - at.floor()))
    }
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

fn held_back(planned: TouchPlan, refused: String) -> ProbedTouch {
    ProbedTouch { planned, record: None, centre: None, deviation: None, refused: Some(refused) }
}

/// Whether the arm is allowed to move.
fn is_movable<T>(ended: &Result<T, EarlyEnd>) -> bool {
    matches!(
        ended,
        Ok(_)
            | Err(EarlyEnd::Link(_)
                | EarlyEnd::Limit(_)
                | EarlyEnd::Arm(ProbeError::Cancelled { .. } | ProbeError::TooLong { .. }))
    )
}
