//! Path of the tool from free air to the entry of a touch; the same for plan and execution.

use nalgebra::{Point3, UnitQuaternion};

use super::cell::RobotCell;
use super::ending::Ending;
use super::links::Clearance;
use super::world::{World, distance, highest};
use crate::arm::{
    ArmBodies, ArmState, Capsule, Joints, LimitError, Limits, Link, largest_turn, millimetres,
};
use crate::plan::{Slide, TouchPlan};

/// State of the tool in free air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ToolState {
    /// centre of the ball, m in O
    pub place: Point3<f64>,
    /// orientation of the tip in B
    pub rotation: UnitQuaternion<f64>,
    pub joints: Joints,
}

impl ToolState {
    pub(crate) fn of(cell: &RobotCell, state: &ArmState) -> Self {
        Self {
            place: cell.place(&state.pose_bt),
            rotation: state.pose_bt.rotation,
            joints: state.joints,
        }
    }
}

/// A path through free air.
#[derive(Clone, Debug)]
pub(super) struct Route {
    /// places of the ball's centre on the path, without the first, and the orientation at each; m
    /// in O, of the tip in B
    pub stops: Vec<(Point3<f64>, UnitQuaternion<f64>)>,
    /// joints at its end
    pub joints: Joints,
}

/// Step of orientations in the check of a turn, rad.
const TURN_STEP: f64 = 0.1;
/// Smallest turn that counts, rad.
const TURNS: f64 = 1e-6;

/// Step of places in the check of a straight path, m: over one step the distance from a singularity
/// changes by a hundredth.
const WAY_STEP: f64 = 10e-3;
/// Maximum turn of a joint in one step, rad.
const JUMP: f64 = 0.6;
/// Step of stations in the check of joints on a slide: a millimetre or two.
const CHECKED: usize = 10;
/// Distance of the arm's links from the mesh, m: for gaps of the scan, and volume beyond the
/// capsules.
const PART_GAP: f64 = 10e-3;

/// Free space of an arm: a cell, within limits, around the mesh.
#[derive(Clone, Copy)]
pub(super) struct ArmFreeSpace<'a> {
    pub cell: &'a RobotCell,
    pub limits: &'a Limits,
    pub world: &'a dyn World,
}

impl ArmFreeSpace<'_> {
    /// Checks a place of the ball; returns joints for it.
    ///
    /// # Errors
    /// As [`Limits::check_pose`]; [`LimitError::Part`].
    pub(crate) fn check(
        &self,
        rotation: &UnitQuaternion<f64>,
        at: &Point3<f64>,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let RobotCell {
            geometry, pose_ft, ..
        } = self.cell;
        let pose_bt = self.cell.pose(rotation, at);
        let joints = self.limits.check_pose(geometry, pose_ft, &pose_bt, near)?;
        let bodies = ArmBodies::new(geometry, &joints, pose_ft);
        // the probe belongs at the part: `Clearance` checks it
        let mut links = bodies
            .links()
            .filter(|(link, _)| !matches!(link, Link::Base | Link::Probe));
        match links.find(|(_, capsule)| self.is_at_part(capsule)) {
            Some((link, _)) => {
                let place_mm = millimetres(&pose_bt.translation.vector);
                Err(LimitError::Part {
                    place_mm,
                    link: link.clone(),
                    least_mm: PART_GAP * 1e3,
                })
            }
            None => Ok(joints),
        }
    }

    /// Whether a link is too near the mesh: by balls along its axis, a radius apart, that cover all
    /// of it.
    fn is_at_part(&self, capsule: &Capsule) -> bool {
        let [from, to] = capsule
            .ends
            .map(|end| self.cell.pose_bo.inverse_transform_point(&end));
        let reach = capsule.radius * 1.25f64.sqrt() + PART_GAP;
        let [low, high] = self.world.mesh().bounds();
        let is_far = (0..3)
            .any(|i| from[i].max(to[i]) < low[i] - reach || from[i].min(to[i]) > high[i] + reach);
        let count = ((to - from).norm() / capsule.radius).ceil() as usize;
        let mut places =
            (0..=count).map(|at| from + (to - from) * (at as f64 / count.max(1) as f64));
        !is_far && places.any(|place| self.world.closest_face(&place, reach).is_some())
    }

    /// Checks all of a straight path; returns joints for its end.
    ///
    /// - `near`: joints at its beginning.
    ///
    /// # Errors
    /// As [`Self::check`]; [`LimitError::Jump`].
    fn check_way(
        &self,
        rotation: &UnitQuaternion<f64>,
        [from, to]: [&Point3<f64>; 2],
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let count = ((to - from).norm() / WAY_STEP).ceil().max(1.0) as usize;
        (1..=count).try_fold(*near, |joints, step| {
            self.step(
                rotation,
                &(from + (to - from) * (step as f64 / count as f64)),
                &joints,
            )
        })
    }

    /// Checks one step of a path.
    fn step(
        &self,
        rotation: &UnitQuaternion<f64>,
        to: &Point3<f64>,
        near: &Joints,
    ) -> Result<Joints, LimitError> {
        let joints = self.check(rotation, to, near)?;
        let turn = largest_turn(&joints, near);
        if turn > JUMP {
            let place_mm = millimetres(&self.cell.pose(rotation, to).translation.vector);
            return Err(LimitError::Jump {
                place_mm,
                turn_deg: turn.to_degrees(),
            });
        }
        Ok(joints)
    }

    /// Checks all of the path of a touch, from its entry on.
    ///
    /// - `near`: joints of the arm in free air.
    ///
    /// # Errors
    /// As [`Self::check`]; [`LimitError::Jump`].
    pub(crate) fn may_touch(
        &self,
        rotation: &UnitQuaternion<f64>,
        planned: &TouchPlan,
        near: &Joints,
    ) -> Result<(), LimitError> {
        let TouchPlan { entry, from, .. } = planned;
        let deepest =
            from + planned.direction.into_inner() * planned.search.min(self.limits.search);
        let at_entry = self.check(rotation, entry, near)?;
        let begun = self.check_way(rotation, [entry, from], &at_entry)?;
        self.check_way(rotation, [from, &deepest], &begun)
            .map(|_| ())
    }

    /// Checks all of a slide, from above its beginning to above its end.
    ///
    /// - `near`: joints of the arm in free air.
    ///
    /// # Errors
    /// As [`Self::check`]; [`LimitError::Jump`].
    pub(crate) fn may_slide(
        &self,
        rotation: &UnitQuaternion<f64>,
        slide: &Slide,
        near: &Joints,
    ) -> Result<(), LimitError> {
        let last = slide.stations.len() - 1;
        let mut joints = self.check(rotation, &slide.above(0), near)?;
        joints = self.check_way(rotation, [&slide.above(0), &slide.lifted(0)], &joints)?;
        for station in (0..last).step_by(CHECKED).chain([last]) {
            for place in [slide.stations[station].centre, slide.lifted(station)] {
                joints = self.step(rotation, &place, &joints)?;
            }
        }
        self.check_way(rotation, [&slide.lifted(last), &slide.above(last)], &joints)
            .map(|_| ())
    }

    /// Path of the tool to a place at or above the entry of a touch: first it turns, then it goes.
    ///
    /// # Errors
    /// [`Ending::OutOfLimits`], [`Ending::NoClearPath`].
    pub(crate) fn route(
        &self,
        from: &ToolState,
        rotation: &UnitQuaternion<f64>,
        to: &Point3<f64>,
    ) -> Result<Route, Ending> {
        let (cell, clear) = (self.cell, distance(self.world));
        let mut route = Route {
            stops: Vec::new(),
            joints: from.joints,
        };
        let mut place = from.place;
        let turn = from.rotation.rotation_to(rotation);
        let angle = turn.angle();
        if let Some(axis) = turn.axis().filter(|_| angle > TURNS) {
            let turned =
                |share: f64| UnitQuaternion::from_axis_angle(&axis, share * angle) * from.rotation;
            let shaft = |share: f64| cell.shaft(&turned(share));
            let upon = Clearance {
                tool: &cell.tool,
                shaft: shaft(0.0),
                distance: &clear,
            };
            place = upon.turning_place(&from.place, angle, &shaft)?;
            route.joints = self.check_way(&from.rotation, [&from.place, &place], &route.joints)?;
            let steps = (angle / TURN_STEP).ceil().max(1.0);
            for step in 0..=steps as usize {
                route.joints = self.step(&turned(step as f64 / steps), &place, &route.joints)?;
            }
            route
                .stops
                .extend([(place, from.rotation), (place, *rotation)]);
        }
        let clearance = Clearance {
            tool: &cell.tool,
            shaft: cell.shaft(rotation),
            distance: &clear,
        };
        let entry = clearance.entry(to)?;
        for next in clearance.path(&place, &entry, highest(self.world.mesh(), &clearance.shaft))? {
            route.joints = self.check_way(rotation, [&place, &next], &route.joints)?;
            route.stops.push((next, *rotation));
            place = next;
        }
        Ok(route)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    use super::super::links::Tool;
    use super::super::world::StaticWorld;
    use super::*;
    use crate::arm::UrGeometry;
    use touchup_geometry::mesh::TriMesh;

    /// A UR5e with its base in the frame of the part, its probe down.
    fn cell() -> RobotCell {
        let down =
            UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI);
        let pose_ft = Isometry3::from_parts(nalgebra::Vector3::new(0.0, 0.0, 0.15).into(), down);
        RobotCell {
            geometry: UrGeometry::UR5E.into(),
            pose_bo: Isometry3::identity(),
            pose_ft,
            tool: Tool::default(),
        }
    }

    fn wide() -> Limits {
        let (lowest, highest) = (Point3::new(-1.0, -1.0, -1.0), Point3::new(1.0, 1.0, 1.0));
        Limits {
            lowest,
            highest,
            ..Limits::default()
        }
    }

    /// One square millimetre of a part, horizontal, with its middle at `place`.
    fn world(place: [f64; 3]) -> StaticWorld {
        let middle = Point3::from(place);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]];
        let corner = |[x, y]: [f64; 2]| middle + nalgebra::Vector3::new(x, y, 0.0) * 0.5e-3;
        StaticWorld::new(TriMesh::new(corners.map(corner).to_vec(), vec![[0, 1, 2]]).unwrap())
    }

    const FAR: [f64; 3] = [0.0, 0.0, -0.9];

    fn joints_at(space: &ArmFreeSpace<'_>, place: &Point3<f64>) -> Joints {
        space
            .cell
            .at_rest(&space.cell.pose(&UnitQuaternion::identity(), place))
            .unwrap()
            .joints
    }

    /// Both ends are half a metre from the base, on either side of it; halfway the tip would be in
    /// it.
    #[test]
    fn a_straight_way_through_the_base_is_refused_though_both_its_ends_are_reached() {
        let (cell, limits, world, upright) =
            (cell(), wide(), world(FAR), UnitQuaternion::identity());
        let space = ArmFreeSpace {
            cell: &cell,
            limits: &limits,
            world: &world,
        };
        let [from, to] = [[-0.5, 0.05, 0.1], [0.5, 0.05, 0.1]].map(Point3::from);
        let joints = joints_at(&space, &from);
        assert!(space.check(&upright, &to, &joints).is_ok());
        let refused = space
            .check_way(&upright, [&from, &to], &joints)
            .unwrap_err();
        let is_on_the_way = matches!(
            refused,
            LimitError::Reach { .. }
                | LimitError::Singular { .. }
                | LimitError::Jump { .. }
                | LimitError::OwnLinks { .. }
        );
        assert!(is_on_the_way, "{refused}");
        // a path beside the base is possible
        let beside = Point3::new(-0.5, -0.4, 0.1);
        let aside = space
            .check_way(&upright, [&from, &beside], &joints)
            .unwrap();
        assert!(largest_turn(&aside, &joints) < 2.0);
    }

    #[test]
    fn a_link_at_the_part_or_out_of_its_box_is_named() {
        let (cell, limits, upright) = (cell(), wide(), UnitQuaternion::identity());
        let place = Point3::new(-0.4, -0.1, 0.1);
        let free = world(FAR);
        let joints = joints_at(
            &ArmFreeSpace {
                cell: &cell,
                limits: &limits,
                world: &free,
            },
            &place,
        );
        let elbow = ArmBodies::new(&cell.geometry, &joints, &cell.pose_ft)
            .links()
            .nth(2)
            .unwrap()
            .1
            .ends[0];
        // a corner of the part 50 mm above the axis of the forearm at its elbow: inside of its
        // radius of 58 mm
        let at_elbow = world([elbow.x, elbow.y, elbow.z + 50e-3]);
        let space = ArmFreeSpace {
            cell: &cell,
            limits: &limits,
            world: &at_elbow,
        };
        let refused = space.check(&upright, &place, &joints).unwrap_err();
        assert!(
            matches!(
                refused,
                LimitError::Part {
                    link: Link::Forearm | Link::UpperArm,
                    ..
                }
            ),
            "{refused}"
        );
        // the elbow is the highest place; its radius sticks out of a box that ends at its axis
        let boxed = Limits {
            arm_highest: Some(Point3::new(1.0, 1.0, elbow.z)),
            ..wide()
        };
        let space = ArmFreeSpace {
            cell: &cell,
            limits: &boxed,
            world: &free,
        };
        let refused = space.check(&upright, &place, &joints).unwrap_err();
        assert!(
            matches!(refused, LimitError::ArmBox { by_mm, .. } if by_mm > 50.0),
            "{refused}"
        );
        let roomy = Limits {
            arm_highest: Some(Point3::new(1.0, 1.0, elbow.z + 0.2)),
            ..wide()
        };
        assert!(
            ArmFreeSpace {
                limits: &roomy,
                ..space
            }
            .check(&upright, &place, &joints)
            .is_ok()
        );
    }

    /// A joint that has made a turn does not go back by it.
    #[test]
    fn joints_stay_on_the_turn_that_they_have_made() {
        let (cell, limits, world, upright) =
            (cell(), wide(), world(FAR), UnitQuaternion::identity());
        let space = ArmFreeSpace {
            cell: &cell,
            limits: &limits,
            world: &world,
        };
        let place = Point3::new(-0.4, -0.1, 0.1);
        let mut joints = joints_at(&space, &place);
        joints[5] += if joints[5] > 0.0 {
            -std::f64::consts::TAU
        } else {
            std::f64::consts::TAU
        };
        let next = space
            .check(
                &upright,
                &(place + nalgebra::Vector3::new(5e-3, 0.0, 0.0)),
                &joints,
            )
            .unwrap();
        assert!(largest_turn(&next, &joints) < 0.1, "{joints:?} {next:?}");
    }

    proptest! {
        /// Joints can follow any allowed path: between places 1 mm apart no joint turns by more
        /// than a tenth of a radian.
        #[test]
        fn an_allowed_way_has_no_place_that_joints_jump_at(
            ends in proptest::array::uniform2((-0.7..0.7f64, -0.7..0.7f64, 0.0..0.4f64))
        ) {
            let (cell, limits, world, upright) = (cell(), wide(), world(FAR), UnitQuaternion::identity());
            let space = ArmFreeSpace { cell: &cell, limits: &limits, world: &world };
            let [from, to] = ends.map(|(x, y, z)| Point3::new(x, y, z));
            let Some(rest) = cell.at_rest(&cell.pose(&upright, &from)) else { return Ok(()) };
            prop_assume!(space.check(&upright, &from, &rest.joints).is_ok());
            prop_assume!(space.check_way(&upright, [&from, &to], &rest.joints).is_ok());
            let flange = |at: f64| cell.pose(&upright, &(from + (to - from) * at)) * cell.pose_ft.inverse();
            let count = ((to - from).norm() / 1e-3).ceil();
            let mut joints = rest.joints;
            for step in 1..=count as usize {
                let next = cell.geometry.nearest(&flange(step as f64 / count), &joints);
                let far = next.as_ref().map_or(f64::INFINITY, |next| largest_turn(next, &joints));
                prop_assert!(far < 0.1, "{far} rad at {step} of {count}");
                joints = next.unwrap();
            }
        }
    }
}
