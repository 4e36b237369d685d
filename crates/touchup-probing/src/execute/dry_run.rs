//! Dry run: touches and paths by the current mesh, checked, without motion of the arm.

use nalgebra::{Isometry3, Point3, UnitQuaternion};

use super::cell::RobotCell;
use super::ending::Ending;
use super::prober::{Flag, ProbeParams};
use super::route::{ArmFreeSpace, ToolState};
use super::way_out::WayOut;
use super::world::{World, distance};
use crate::arm::{ArmState, LimitError, Safety};
use crate::plan::{ExploreError, PatternParams, Slide, TouchPlan, TouchResult};
use touchup_method::stylus::Wrench;

/// A planned motion, with its number from 0 on within its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlannedMotion {
    /// number in [`Plan::touches`]
    #[error("touch {0}")]
    Touch(usize),
    /// number in [`Plan::slides`]
    #[error("slide {0}")]
    Slide(usize),
}

/// A planned touch or slide that is impossible.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {why}")]
pub struct HeldBack {
    /// the motion
    pub what: PlannedMotion,
    /// reason in words
    pub why: String,
}

/// The plan for a flag.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// path of the ball's centre, in O, m
    pub path: Vec<Point3<f64>>,
    /// moves through free air, from and to, in O, m
    pub links: Vec<[Point3<f64>; 2]>,
    /// touches, for a part that equals the mesh
    pub touches: Vec<TouchPlan>,
    /// slides after the touches
    pub slides: Vec<Slide>,
    /// places of the surface, m in O, without touches, for the scan has no part there
    pub left_out: Vec<Point3<f64>>,
    /// impossible touches and slides
    pub held_back: Vec<HeldBack>,
}

impl RobotCell {
    /// The arm at rest without load, with its tip at a pose in B and the joints of largest
    /// dexterity; for a plan without an arm. `None` out of reach.
    pub fn at_rest(&self, pose_bt: &Isometry3<f64>) -> Option<ArmState> {
        let joints = self
            .geometry
            .most_dexterous(&(pose_bt * self.pose_ft.inverse()))?;
        Some(ArmState {
            stamp_ns: 0,
            pose_bt: *pose_bt,
            wrench_b: Wrench::default(),
            raw_wrench_f: Wrench::default(),
            joints,
            safety: Safety::Normal,
        })
    }
}

/// Plans the probing of a flag.
///
/// - `now`: state of the arm; `way_out`: of the feature in which it stopped.
///
/// # Errors
/// [`ExploreError`] without a pattern for the flag.
pub fn plan(
    cell: &RobotCell,
    params: &ProbeParams,
    world: &dyn World,
    flag: &Flag,
    now: &ArmState,
    way_out: Option<&WayOut>,
) -> Result<Plan, ExploreError> {
    let way_out = way_out.filter(|way_out| way_out.begins_at(now));
    let in_free_air = way_out.map_or(*now, |way_out| way_out.end(cell, now));
    let (mut explorer, rotation) = flag.explorer(cell, params, world, &in_free_air)?;
    let space = ArmFreeSpace {
        cell,
        limits: &params.limits,
        world,
    };
    let mut dry_run = DryRun {
        space,
        rotation,
        at: ToolState::of(cell, &in_free_air),
        plan: Plan {
            path: vec![cell.place(&now.pose_bt)],
            ..Plan::default()
        },
    };
    let on_way_out = way_out.into_iter().flat_map(WayOut::places);
    dry_run.plan.path.extend(on_way_out);
    while let Some(planned) = explorer.next_touch() {
        explorer.take(&dry_run.touch(&planned, &params.pattern));
    }
    dry_run.plan.left_out = explorer.left_out().to_vec();
    if params.slides {
        for slide in explorer.slides() {
            dry_run.slide(slide);
        }
    }
    Ok(dry_run.plan)
}

/// State of a dry run.
struct DryRun<'a> {
    space: ArmFreeSpace<'a>,
    /// orientation of the tool at the touches
    rotation: UnitQuaternion<f64>,
    at: ToolState,
    plan: Plan,
}

impl DryRun<'_> {
    /// Goes through free air to a place above an allowed motion.
    fn reach(
        &mut self,
        allowed: Result<(), LimitError>,
        above: &Point3<f64>,
    ) -> Result<(), Ending> {
        allowed?;
        let route = self.space.route(&self.at, &self.rotation, above)?;
        for (place, turned) in route.stops {
            self.plan.links.push([self.at.place, place]);
            self.plan.path.push(place);
            (self.at.place, self.at.rotation) = (place, turned);
        }
        self.at.joints = route.joints;
        Ok(())
    }

    fn hold_back(&mut self, what: PlannedMotion, ending: &Ending) {
        let why = ending.why();
        self.plan.held_back.push(HeldBack { what, why });
    }

    /// Plans a touch, and returns its result on the mesh.
    fn touch(&mut self, planned: &TouchPlan, pattern: &PatternParams) -> TouchResult {
        let what = PlannedMotion::Touch(self.plan.touches.len());
        self.plan.touches.push(*planned);
        let allowed = self
            .space
            .may_touch(&self.rotation, planned, &self.at.joints);
        if let Err(ending) = self.reach(allowed, &planned.entry) {
            self.hold_back(what, &ending);
            return TouchResult::Unclear;
        }
        let result = contact_on_mesh(planned, pattern, self.space.world);
        let end = if let TouchResult::At { centre, .. } = result {
            centre
        } else {
            planned.from
        };
        // in again and out, slowly
        self.plan
            .path
            .extend([planned.from, end, planned.from, self.at.place]);
        result
    }

    /// Plans a slide.
    fn slide(&mut self, slide: Slide) {
        let what = PlannedMotion::Slide(self.plan.slides.len());
        let allowed = self
            .space
            .may_slide(&self.rotation, &slide, &self.at.joints);
        match self.reach(allowed, &slide.above(0)) {
            Ok(()) => {
                let last = slide.stations.len() - 1;
                let path = &mut self.plan.path;
                path.extend([slide.above(0), slide.lifted(0)]);
                path.extend(slide.stations.iter().map(|station| station.centre));
                path.extend([slide.lifted(last), slide.above(last), self.at.place]);
            }
            Err(ending) => self.hold_back(what, &ending),
        }
        self.plan.slides.push(slide);
    }
}

/// First contact of a ball with the mesh, by sphere tracing: each step is the remaining distance.
fn contact_on_mesh(planned: &TouchPlan, pattern: &PatternParams, world: &dyn World) -> TouchResult {
    let (
        PatternParams {
            ball_radius,
            touch_sigma: sigma,
            ..
        },
        distance,
    ) = (*pattern, distance(world));
    let mut gone = 0.0;
    while gone <= planned.search {
        let centre = planned.from + planned.direction.into_inner() * gone;
        let left = distance(&centre, ball_radius + planned.search) - ball_radius;
        if left < TOUCHES {
            return TouchResult::At { centre, sigma };
        }
        gone += left;
    }
    TouchResult::Nothing
}

/// Distance of a contact, m.
const TOUCHES: f64 = 5e-6;
