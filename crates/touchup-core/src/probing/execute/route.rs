//! How the tool gets from free air to where a touch is entered from; the same for what is planned and for what is done.

use nalgebra::{Point3, UnitQuaternion};

use super::cell::Cell;
use super::ending::Ending;
use super::links::Clearance;
use super::world::{World, distance, highest};
use crate::probing::arm::{ArmState, Joints, LimitError, Limits};
use crate::probing::plan::{Slide, TouchPlan};

/// Where the tool is, in free air.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToolState {
    /// centre of the ball, m in O
    pub place: Point3<f64>,
    /// of the tip in B
    pub rotation: UnitQuaternion<f64>,
    pub joints: Joints,
}

impl ToolState {
    pub fn of(cell: &Cell, state: &ArmState) -> Self {
        Self { place: cell.place(&state.pose_bt), rotation: state.pose_bt.rotation, joints: state.joints }
    }
}

/// A path through free air.
#[derive(Clone, Debug)]
pub(super) struct Route {
    /// the places of the ball's centre that it goes through, without the first, and the orientation that it has when it is there;
    /// m in O, of the tip in B
    pub stops: Vec<(Point3<f64>, UnitQuaternion<f64>)>,
    /// at its end
    pub joints: Joints,
}

/// Orientations that a turn is checked at for the joints, rad apart.
const TURN_STEP: f64 = 0.1;
/// A smaller turn is left out, rad.
const TURNS: f64 = 1e-6;

/// Every so many stations of a slide the joints are checked: a millimetre or two.
const CHECKED: usize = 10;

/// Where an arm goes: a cell, within limits, around the mesh.
#[derive(Clone, Copy)]
pub(super) struct FreeSpace<'a> {
    pub cell: &'a Cell,
    pub limits: &'a Limits,
    pub world: &'a dyn World,
}

impl FreeSpace<'_> {
    /// Whether the limits allow the ball there; joints for it.
    ///
    /// # Errors
    /// As [`Limits::check_pose`].
    pub fn check(&self, rotation: &UnitQuaternion<f64>, at: &Point3<f64>, near: &Joints) -> Result<Joints, LimitError> {
        let Cell { geometry, pose_ft, .. } = self.cell;
        self.limits.check_pose(geometry, pose_ft, &self.cell.pose(rotation, at), near)
    }

    /// Whether the arm may be everywhere on the path of a touch; joints for where it ends.
    pub fn may_touch(
        &self,
        rotation: &UnitQuaternion<f64>,
        planned: &TouchPlan,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let deepest = planned.from + planned.direction.into_inner() * planned.search.min(self.limits.search);
        let places = [planned.entry, planned.from, deepest];
        places.iter().try_fold(*near, |joints, place| self.check(rotation, place, &joints))
    }

    /// Whether the arm may be everywhere on a slide; joints for where it ends.
    pub fn may_slide(
        &self,
        rotation: &UnitQuaternion<f64>,
        slide: &Slide,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let last = slide.stations.len() - 1;
        let checked = (0..last).step_by(CHECKED).chain([last]);
        let mut joints = self.check(rotation, &slide.above(0), near)?;
        for station in checked {
            for place in [slide.lifted(station), slide.stations[station].centre] {
                joints = self.check(rotation, &place, &joints)?;
            }
        }
        self.check(rotation, &slide.above(last), &joints)
    }

    /// The path from where the tool is to a place at or above where a touch is entered from: first it turns, then it goes.
    ///
    /// # Errors
    /// [`Ending::OutOfLimits`], [`Ending::NoClearPath`].
    pub fn route(&self, from: &ToolState, rotation: &UnitQuaternion<f64>, to: &Point3<f64>) -> Result<Route, Ending> {
        let (cell, clear) = (self.cell, distance(self.world));
        let mut route = Route { stops: Vec::new(), joints: from.joints };
        let mut place = from.place;
        let turn = from.rotation.rotation_to(rotation);
        let angle = turn.angle();
        if let Some(axis) = turn.axis().filter(|_| angle > TURNS) {
            let turned = |share: f64| UnitQuaternion::from_axis_angle(&axis, share * angle) * from.rotation;
            let shaft = |share: f64| cell.shaft(&turned(share));
            let upon = Clearance { tool: &cell.tool, shaft: shaft(0.0), distance: &clear };
            place = upon.turning_place(&from.place, angle, &shaft)?;
            let steps = (angle / TURN_STEP).ceil().max(1.0);
            for step in 0..=steps as usize {
                route.joints = self.check(&turned(step as f64 / steps), &place, &route.joints)?;
            }
            route.stops.extend([(place, from.rotation), (place, *rotation)]);
        }
        let clearance = Clearance { tool: &cell.tool, shaft: cell.shaft(rotation), distance: &clear };
        let entry = clearance.entry(to)?;
        for place in clearance.path(&place, &entry, highest(self.world.mesh(), &clearance.shaft))? {
            route.joints = self.check(rotation, &place, &route.joints)?;
            route.stops.push((place, *rotation));
        }
        Ok(route)
    }
}
