//! From a flag to a feature: plan, path, touch, and again.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion};

use super::ending::{Ending, FlagResult, ProbedSlide, ProbedTouch, ReferenceTouch};
use super::prober::{Flag, Prober};
use super::route::ToolState;
use super::way_out::WayOut;
use super::world::{Phase, Progress, World};
use crate::arm::{
    ArmState, OnsetVerdict, ProbeError, StopRequest, TouchOutcome, TouchRecord, TouchTarget,
    UNEXPECTED,
};
use crate::plan::{ExplorationResult, ExploreError, Explorer, TouchPlan, TouchResult};

/// A feature during its probing: the position of the ball, its path back into free air, and its
/// touches.
pub(super) struct FeatureProbing<'p, 'a> {
    pub prober: &'p mut Prober<'a>,
    pub flag: u32,
    /// orientation of the tip in B for the touches
    pub rotation: UnitQuaternion<f64>,
    /// last state of the tool in free air
    pub out: ToolState,
    /// whether the tool is there now
    pub is_out: bool,
    /// entry of the touch, below free air, m in O; `None` if it is the same place, or the ball was
    /// not there yet
    pub entry: Option<Point3<f64>>,
    /// start of the last search, m in O; `None` if the ball was not there yet
    pub from: Option<Point3<f64>>,
    /// whether the last touch ended away from its contact
    pub is_away: bool,
    /// whether the zero of the sensor is from this feature
    pub is_zeroed: bool,
    /// stamp of the zero by the arm's clock, ns
    pub zeroed_ns: i64,
    pub begun_ns: i64,
    pub ended_ns: i64,
    pub touches: Vec<ProbedTouch>,
    pub slides: Vec<ProbedSlide>,
    /// last touches of the references
    pub references: Vec<ReferenceTouch>,
    /// touches made until then
    pub verified: usize,
    pub peak_force: f64,
}

/// Length, m, by which a search may end early and still count as complete.
const SHORT: f64 = 0.1e-3;
/// Maximum distance of two starts of touches, over the ball's radius, for a move inside the
/// feature.
const INSIDE: f64 = 0.5;
/// Minimum travel after which an arm comes to a place with a new error, m. Touches without such
/// travel between them would share one error, and the fit takes the errors of touches for
/// independent.
const ANEW: f64 = 1e-3;

impl<'a> Prober<'a> {
    /// Probes one flagged feature. In any case the arm has stopped at the return, and has retracted
    /// unless it may no longer move.
    pub fn probe(&mut self, flag: &Flag) -> FlagResult {
        let (mut explorer, mut probing) = match self.begin(flag) {
            Ok(begun) => begun,
            Err(ending) => {
                let (touches, slides, references) = (Vec::new(), Vec::new(), Vec::new());
                let (found, left_out, seconds, peak_force) = (None, Vec::new(), 0.0, 0.0);
                return FlagResult {
                    flag: flag.id,
                    ending,
                    found,
                    known_surfaces: Vec::new(),
                    touches,
                    slides,
                    references,
                    verified: 0,
                    left_out,
                    seconds,
                    peak_force,
                };
            }
        };
        let mut ended = probing.explore(&mut explorer);
        if probing.prober.params.slides && ended.is_ok() {
            ended = probing.slide_over(explorer.slides());
        }
        // a time limit holds for these as well
        if ended.is_ok() {
            ended = probing
                .check_zero()
                .and_then(|()| probing.touch_references());
        }
        let ended = probing.finish(ended);
        let found = explorer.found();
        let ending = ending_of(ended, &found);
        // it is unknown which of its touches hold
        let found = found.ok().filter(|_| !ending.is_displaced());
        FlagResult {
            flag: flag.id,
            known_surfaces: found
                .iter()
                .flat_map(|_| explorer.known_surfaces())
                .collect(),
            found,
            ending,
            seconds: probing.seconds(),
            peak_force: probing.peak_force,
            touches: probing.touches,
            slides: probing.slides,
            references: probing.references,
            verified: probing.verified,
            left_out: explorer.left_out().to_vec(),
        }
    }

    /// The explorer and the probing, if both can begin.
    pub(super) fn begin(
        &mut self,
        flag: &Flag,
    ) -> Result<(Explorer, FeatureProbing<'_, 'a>), Ending> {
        self.leave(flag)?;
        let state = self.ready_to_touch()?;
        let (explorer, rotation) = flag.explorer(self.cell, self.params, self.world, &state)?;
        let probing = FeatureProbing::new(self, flag.id, rotation, &state);
        Ok((explorer, probing))
    }

    /// Leaves the feature in which another probing stopped, if the arm still stands there.
    fn leave(&mut self, flag: &Flag) -> Result<(), Ending> {
        let Some(way_out) = self.way_out.take() else {
            return Ok(());
        };
        let arm = |error| ProbeError::Arm {
            doing: "asking where the arm is",
            error,
        };
        let now = self.arm.next_state().map_err(arm)?;
        if !way_out.begins_at(&now) {
            return Ok(());
        }
        let WayOut {
            from, entry, out, ..
        } = way_out;
        let begun = FeatureProbing::new(self, flag.id, out.rotation, &now);
        let mut probing = FeatureProbing {
            out,
            is_out: false,
            from,
            entry,
            ..begun
        };
        let left = probing.retract();
        probing.finish(left)
    }
}

impl<'p, 'a> FeatureProbing<'p, 'a> {
    /// A probing without touches.
    ///
    /// - `flag`: its number; `rotation`: of the tip in B for the touches; `state`: of the arm, in
    ///   free air.
    pub(crate) fn new(
        prober: &'p mut Prober<'a>,
        flag: u32,
        rotation: UnitQuaternion<f64>,
        state: &ArmState,
    ) -> Self {
        Self {
            flag,
            rotation,
            out: ToolState::of(prober.cell, state),
            is_out: true,
            entry: None,
            from: None,
            is_away: false,
            is_zeroed: false,
            zeroed_ns: state.stamp_ns,
            begun_ns: state.stamp_ns,
            ended_ns: state.stamp_ns,
            touches: Vec::new(),
            slides: Vec::new(),
            references: Vec::new(),
            verified: 0,
            peak_force: 0.0,
            prober,
        }
    }
}

impl FeatureProbing<'_, '_> {
    /// Records data of a motion, also if it ended early: the largest force, N, and the stamp of the
    /// last state, ns.
    pub(crate) fn keep(&mut self, (peak_force, seen_ns): (f64, Option<i64>)) {
        self.peak_force = self.peak_force.max(peak_force);
        self.ended_ns = seen_ns.unwrap_or(self.ended_ns).max(self.ended_ns);
    }

    pub(crate) fn seconds(&self) -> f64 {
        (self.ended_ns - self.begun_ns) as f64 * 1e-9
    }

    /// Whether the time for a feature is over.
    pub(crate) fn is_spent(&self) -> bool {
        self.seconds() > self.prober.params.limits.time
    }

    /// Retracts if the arm may move.
    pub(crate) fn finish<T>(&mut self, ended: Result<T, Ending>) -> Result<T, Ending> {
        use Ending::{Cancelled, NoClearPath, OutOfLimits, Stopped, TimeSpent};
        // a failed retraction outranks these
        let is_unbroken = matches!(
            ended,
            Ok(_) | Err(Cancelled(StopRequest::Retract) | TimeSpent)
        );
        let may_move = is_unbroken
            || matches!(
                ended,
                Err(NoClearPath(_)
                    | OutOfLimits(_)
                    | Stopped(ProbeError::TooLong { .. } | ProbeError::Displaced { .. }))
            );
        let retracted = if may_move { self.retract() } else { Ok(()) };
        // without a new state it ended with the last one
        let last = self.prober.arm.next_state();
        self.prober.way_out = last.as_ref().ok().and_then(|state| self.way_out(state));
        self.ended_ns = last.map_or(self.ended_ns, |state| state.stamp_ns.max(self.ended_ns));
        match retracted {
            Err(error) if is_unbroken => Err(error),
            // the first error is the one to report
            _ => ended,
        }
    }

    /// One touch by itself: there, and back into free air.
    pub(crate) fn touch_and_retract(&mut self, planned: &TouchPlan) -> Result<ProbedTouch, Ending> {
        // zeroed again for each, as the touches are independent
        self.is_zeroed = false;
        let (_, touched) = self.go_and_touch(planned)?;
        self.prober.world.touched(self.flag, &touched);
        self.retract()?;
        Ok(touched)
    }

    fn explore(&mut self, explorer: &mut Explorer) -> Result<(), Ending> {
        while let Some(planned) = explorer.next_touch() {
            if self.is_spent() {
                return Err(Ending::TimeSpent);
            }
            self.publish(explorer, explorer.touches() + 1);
            let mut has_collided = false;
            let (result, touch) = match self.go_and_touch(&planned) {
                Ok(touched) => touched,
                // the first touch is at the place of the feature
                Err(ending @ (Ending::OutOfLimits(_) | Ending::NoClearPath(_)))
                    if self.touches.is_empty() =>
                {
                    return Err(ending);
                }
                Err(ending) if ending.is_of_one() => {
                    has_collided = matches!(ending, Ending::Stopped(_));
                    let refused = Some(ending.why());
                    let touch = ProbedTouch {
                        planned,
                        record: None,
                        centre: None,
                        deviation: None,
                        refused,
                    };
                    (TouchResult::Unclear, touch)
                }
                Err(ending) => return Err(ending),
            };
            self.prober.world.touched(self.flag, &touch);
            explorer.take(&result);
            self.touches.push(touch);
            if has_collided {
                self.touch_references()?;
            }
        }
        self.publish(explorer, explorer.touches());
        Ok(())
    }

    fn publish(&mut self, explorer: &Explorer, touch: usize) {
        let (budget, uncertainty) = (self.prober.params.pattern.budget, explorer.uncertainty());
        self.prober.world.publish(&Progress {
            flag: self.flag,
            touch,
            budget,
            uncertainty,
        });
    }

    /// A link move, or a guarded one, to a pose of the tip in B.
    fn line(
        &mut self,
        doing: &'static str,
        to: &Isometry3<f64>,
        guard: LineGuard,
    ) -> Result<(), Ending> {
        let touch = &self.prober.params.touch;
        let mut watched = self.prober.watched();
        watched.heeds = if guard == LineGuard::Retract {
            StopRequest::Stay
        } else {
            StopRequest::Retract
        };
        let moved = match guard {
            LineGuard::Link => watched.line(
                doing,
                to,
                touch.link_speed,
                touch,
                UNEXPECTED * touch.trigger,
            ),
            LineGuard::Slow => watched.line(doing, to, touch.safe_speed(), touch, touch.trigger),
            // the part may be in contact
            LineGuard::Out | LineGuard::Retract => {
                watched.leave(doing, to, touch.link_speed, touch)
            }
        };
        let seen = watched.seen();
        self.keep(seen);
        // nothing should be on a link of any speed
        moved.map_err(|error| match (error, guard) {
            (
                ProbeError::Obstacle {
                    doing,
                    force_n,
                    place_mm,
                    ..
                },
                LineGuard::Link,
            ) => ProbeError::Obstacle {
                doing,
                force_n,
                place_mm,
                is_link: true,
            }
            .into(),
            (error, _) => error.into(),
        })
    }

    /// Goes out, and checks that the sensor still reads nothing in free air.
    fn check_zero(&mut self) -> Result<(), Ending> {
        self.go_out("going up out of the feature", LineGuard::Out)?;
        if self.is_zeroed {
            let (zeroed_ns, touch) = (self.zeroed_ns, &self.prober.params.touch);
            self.prober.watched().check_zero(zeroed_ns, touch)?;
            // its drift is no contact
            self.is_zeroed = false;
        }
        Ok(())
    }

    fn now_ns(&mut self) -> Result<i64, Ending> {
        let arm = |error| ProbeError::Arm {
            doing: "zeroing the sensor in free air",
            error,
        };
        Ok(self.prober.arm.next_state().map_err(arm)?.stamp_ns)
    }

    /// Brings the ball to the entry of a touch, and touches.
    pub(crate) fn go_and_touch(
        &mut self,
        planned: &TouchPlan,
    ) -> Result<(TouchResult, ProbedTouch), Ending> {
        let is_away = std::mem::take(&mut self.is_away);
        self.prober
            .space()
            .may_touch(&self.rotation, planned, &self.out.joints)?;
        let near = INSIDE * self.prober.params.pattern.ball_radius;
        let is_near = self
            .from
            .is_some_and(|from| (from - planned.from).norm() < near);
        // otherwise it stays inside the feature
        if !is_near || !is_away || planned.from == planned.entry {
            self.reach(&planned.entry)?;
        }
        self.touch(planned)
    }

    /// Goes out of the feature, and through free air to a place above it.
    pub(crate) fn reach(&mut self, above: &Point3<f64>) -> Result<(), Ending> {
        self.prober.world.enter(Phase::Link);
        self.go_out("going up out of the feature", LineGuard::Out)?;
        let route = self
            .prober
            .space()
            .route(&self.out, &self.rotation, above)?;
        for (place, rotation) in route.stops {
            let pose = self.prober.cell.pose(&rotation, &place);
            self.line("going through free air", &pose, LineGuard::Link)?;
            (self.out.place, self.out.rotation) = (place, rotation);
        }
        self.out.joints = route.joints;
        if !self.is_zeroed {
            // again at the feature: turning the wrist loads its sensor
            self.prober.world.enter(Phase::Zeroing);
            self.prober.watched().zero()?;
            self.is_zeroed = true;
            self.zeroed_ns = self.now_ns()?;
        }
        self.is_out = false;
        if self.out.place != *above {
            self.prober.world.enter(Phase::Approach);
            let pose = self.prober.cell.pose(&self.rotation, above);
            self.line("coming near", &pose, LineGuard::Slow)?;
            self.entry = Some(*above);
        }
        Ok(())
    }

    fn touch(&mut self, planned: &TouchPlan) -> Result<(TouchResult, ProbedTouch), Ending> {
        let Prober { cell, params, .. } = *self.prober;
        let target = TouchTarget {
            standoff_bt: cell.pose(&self.rotation, &planned.from),
            direction: Unit::new_normalize(cell.pose_bo.rotation * planned.direction.into_inner()),
            search: planned.search,
            expected: planned.expected,
        };
        let before = distances(self.prober.world, planned, params.pattern.ball_radius);
        self.prober.world.enter(Phase::Search);
        let mut watched = self.prober.watched();
        let touched = watched.touch(&target, &params.touch);
        let (seen, reached) = (watched.seen(), watched.reached);
        self.keep(seen);
        // the retraction only visits places that the ball has reached
        if reached.is_some() {
            self.from = Some(planned.from);
        }
        let (result, touch) = self.probed_touch(*planned, touched?);
        self.is_away = ends_away(&touch);
        let deviation = touch
            .centre
            .and_then(|centre| deviation(&before, planned, &centre));
        Ok((result, ProbedTouch { deviation, ..touch }))
    }

    /// Result for the explorer, and record of the touch.
    fn probed_touch(&self, planned: TouchPlan, record: TouchRecord) -> (TouchResult, ProbedTouch) {
        let (result, refused) = match &record.outcome {
            TouchOutcome::Contact { onset, .. } if onset.verdict == OnsetVerdict::Impact => (
                TouchResult::Unclear,
                Some("an impact: the force was over before the surface held".to_owned()),
            ),
            TouchOutcome::Contact { onset, centre, .. } => {
                let centre = self.prober.cell.pose_bo.inverse_transform_point(centre);
                (
                    TouchResult::At {
                        centre,
                        sigma: onset.sigma,
                    },
                    None,
                )
            }
            TouchOutcome::Miss { travel } if *travel < planned.search - SHORT => {
                let why = format!(
                    "nothing within {:.1} mm, where the limit of a search ends",
                    travel * 1e3
                );
                (TouchResult::Unclear, Some(why))
            }
            TouchOutcome::Miss { .. } => (TouchResult::Nothing, None),
            TouchOutcome::Unclear(error) => (TouchResult::Unclear, Some(error.to_string())),
        };
        let centre = if let TouchResult::At { centre, .. } = result {
            Some(centre)
        } else {
            None
        };
        (
            result,
            ProbedTouch {
                planned,
                record: Some(record),
                centre,
                deviation: None,
                refused,
            },
        )
    }

    /// Goes out of the feature into free air.
    fn retract(&mut self) -> Result<(), Ending> {
        self.prober.world.enter(Phase::Retract);
        self.go_out("retracting", LineGuard::Retract)
    }

    /// Remaining path out; `None` in free air.
    fn way_out(&self, now: &ArmState) -> Option<WayOut> {
        let Self {
            from, entry, out, ..
        } = *self;
        (!self.is_out).then_some(WayOut {
            stopped_bt: now.pose_bt,
            from,
            entry,
            out,
        })
    }

    /// Goes back through the past places of the ball, none of them twice, even after an early end
    /// of the remaining path.
    pub(crate) fn go_out(&mut self, doing: &'static str, guard: LineGuard) -> Result<(), Ending> {
        while !self.is_out {
            let place = self.from.or(self.entry).unwrap_or(self.out.place);
            let pose = self.prober.cell.pose(&self.rotation, &place);
            self.line(doing, &pose, guard)?;
            self.is_out = self.from.take().is_none() && self.entry.take().is_none();
        }
        Ok(())
    }
}

/// Ending of an exploration, from its touches and its result.
fn ending_of(ended: Result<(), Ending>, found: &Result<ExplorationResult, ExploreError>) -> Ending {
    match (ended, found) {
        (Err(ending), _) => ending,
        (Ok(()), Ok(found)) if !found.characteristics.is_empty() => {
            Ending::of_decisions(&found.characteristics)
        }
        (Ok(()), Ok(found)) if found.is_as_asked => Ending::ToleranceReached,
        (Ok(()), Ok(found)) => {
            found
                .limited
                .map_or(Ending::TouchesSpent, |over| Ending::CalibrationLimits {
                    over,
                })
        }
        (Ok(()), Err(error)) => Ending::NothingFound(error.clone()),
    }
}

/// Whether a touch ends with the ball away from its contact, so that the arm comes to the next one
/// anew.
fn ends_away(touch: &ProbedTouch) -> bool {
    match touch.record.as_ref().map(|record| &record.outcome) {
        Some(TouchOutcome::Contact { onset, .. }) => onset.travel > ANEW,
        Some(TouchOutcome::Miss { .. }) => true,
        Some(TouchOutcome::Unclear(_)) | None => false,
    }
}

/// Distance of a ball from the mesh at each [`SAMPLED`] on the path of a touch, before the touch
/// moves the mesh; m, positive outside, `None` without a near mesh.
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

/// Distance of a touched surface from the mesh, m, positive outside.
fn deviation(distances: &[Option<f64>], planned: &TouchPlan, centre: &Point3<f64>) -> Option<f64> {
    let at = ((centre - planned.from).dot(&planned.direction) / SAMPLED).max(0.0);
    let sample = at as usize;
    let (here, next) = ((*distances.get(sample)?)?, (*distances.get(sample + 1)?)?);
    Some(here + (next - here) * (at - at.floor()))
}

/// Distance of samples on the path of a touch, m: between two samples a wall with a radius of 1 mm
/// bends by 1 µm.
const SAMPLED: f64 = 0.1e-3;

/// Supervision of a line.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum LineGuard {
    /// fast, for a clear path
    Link,
    /// slow enough for any obstacle
    Slow,
    /// from a possible contact with the part
    Out,
    /// the same at the end, also of a cancelled probing
    Retract,
}

/// Reach of the mesh search from a contact, m.
const DEVIATION_REACH: f64 = 20e-3;
