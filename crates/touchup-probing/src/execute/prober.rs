//! Object, settings and arm of a probing.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitQuaternion};

use super::cell::RobotCell;
use super::ending::Ending;
use super::links::{Clearance, LinkError, Tool};
use super::opening_surface::on_surface_around;
use super::reference::References;
use super::route::ArmFreeSpace;
use super::way_out::WayOut;
use super::world::{World, distance, normal_about, on_mesh};
use crate::arm::{
    Arm, ArmState, LimitError, Limits, ProbeError, RequestLimits, SupervisedArm, TouchParams,
};
use crate::plan::{DecisionGoal, ExploreError, Explorer, PatternParams};
use touchup_features::features::FeatureKind;

/// A place to probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flag {
    /// number of the flag
    pub id: u32,
    /// kind of the feature; `None`: unknown
    pub kind: Option<FeatureKind>,
    /// place of the flag, m in O
    pub place: Point3<f64>,
    /// maximum distance of the feature from the place, m
    pub radius: f64,
}

/// Settings of a probing.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeParams {
    /// settings of single touches
    pub touch: TouchParams,
    /// request for a feature; the radius around a flag is the flag's
    pub pattern: PatternParams,
    /// decision goals, in place of an uncertainty, by the numbers of their flags
    pub goals: BTreeMap<u32, DecisionGoal>,
    /// whether the ball slides over the whole feature after its touches
    pub slides: bool,
    /// limits of all motions
    pub limits: Limits,
}

/// Minimum ratio of the force limit to the force of a touch: the force grows a little while the arm
/// brakes.
const HEADROOM: f64 = 1.3;

/// Minimum ratio of the trigger to the noise: by chance two readings in a row are above it once in
/// hundreds of hours.
const QUIET: f64 = 4.0;

impl ProbeParams {
    /// These settings, tightened by a request.
    ///
    /// # Errors
    /// As [`Limits::narrowed`]; [`LimitError::TooSoft`].
    pub fn narrowed(&self, by: &RequestLimits) -> Result<Self, LimitError> {
        let limits = self.limits.narrowed(by)?;
        let mut touch = self.touch;
        touch.force = touch.force.min(limits.force / HEADROOM);
        if touch.force <= touch.trigger {
            return Err(LimitError::TooSoft {
                asked_n: limits.force,
                least_n: touch.trigger * HEADROOM,
            });
        }
        Ok(Self {
            touch,
            limits,
            ..self.clone()
        })
    }
}

impl Flag {
    /// Explorer of the flag, and the orientation of the tip in B for it.
    ///
    /// - `now`: state of the arm.
    ///
    /// # Errors
    /// [`ExploreError`] without a pattern for the flag.
    pub(super) fn explorer(
        &self,
        cell: &RobotCell,
        params: &ProbeParams,
        world: &dyn World,
        now: &ArmState,
    ) -> Result<(Explorer, UnitQuaternion<f64>), ExploreError> {
        let pattern = PatternParams {
            flag_radius: self.radius,
            ..params.pattern
        };
        let nearest = on_mesh(world, &self.place);
        let normal = normal_about(world, &nearest, &cell.shaft(&now.pose_bt.rotation));
        let (place, normal) = match self.kind {
            Some(FeatureKind::Hole | FeatureKind::Slot | FeatureKind::Pocket) => {
                let ball = pattern.ball_radius;
                on_surface_around(
                    world.mesh(),
                    &self.place,
                    [self.radius + ball, ball],
                    (nearest, normal),
                )
            }
            _ => (nearest, normal),
        };
        let explorer = Explorer::new(self.kind, &place, &normal, pattern, world.mesh())?;
        let explorer = match params.goals.get(&self.id) {
            Some(goal) => explorer.until_decided(goal.clone()),
            None => explorer,
        };
        Ok((explorer, cell.upright(&now.pose_bt.rotation, &normal)))
    }
}

/// Probes features with an arm.
pub struct Prober<'a> {
    pub(super) arm: &'a mut dyn Arm,
    pub(super) cell: &'a RobotCell,
    pub(super) params: &'a ProbeParams,
    pub(super) world: &'a mut dyn World,
    /// path out of the feature in which the last probing stopped, with which the next one begins if
    /// the arm still stands there; `None`: the arm is in free air, or its place is unknown
    pub way_out: Option<WayOut>,
    /// contacts of earlier features that the arm touches again after the next one
    pub references: References,
}

impl<'a> Prober<'a> {
    /// - `arm`: at rest in free air, or at the beginning of [`Self::way_out`].
    pub fn new(
        arm: &'a mut dyn Arm,
        cell: &'a RobotCell,
        params: &'a ProbeParams,
        world: &'a mut dyn World,
    ) -> Self {
        Self {
            arm,
            cell,
            params,
            world,
            way_out: None,
            references: References::default(),
        }
    }

    /// The arm under all supervision.
    pub(super) fn watched(&mut self) -> SupervisedArm<'_> {
        SupervisedArm::new(self.arm, self.params.limits.clone(), self.world)
    }

    /// Free space of the arm.
    pub(super) fn space(&self) -> ArmFreeSpace<'_> {
        ArmFreeSpace {
            cell: self.cell,
            limits: &self.params.limits,
            world: &*self.world,
        }
    }

    /// State of the arm, at rest in free air, its sensor zeroed and quiet enough for touches.
    pub(super) fn ready_to_touch(&mut self) -> Result<ArmState, Ending> {
        let (state, noise_n) = self.in_free_air(self.params.limits.tare)?;
        let (trigger_n, least_n) = (self.params.touch.trigger, QUIET * noise_n);
        if trigger_n < least_n {
            return Err(Ending::Stopped(ProbeError::Noisy {
                doing: "zeroing the sensor in free air",
                noise_n,
                trigger_n,
                least_n,
            }));
        }
        Ok(state)
    }

    /// State of the arm, at rest in free air with its sensor zeroed.
    ///
    /// - `most_n`: largest force on the sensor before, N.
    /// - returns also the noise of its force, N.
    pub(super) fn in_free_air(&mut self, most_n: f64) -> Result<(ArmState, f64), Ending> {
        // zeroing the sensor would remove a present force
        let arm = |error| ProbeError::Arm {
            doing: "asking where the arm is",
            error,
        };
        let now = self.arm.next_state().map_err(arm)?;
        let (here, bare) = (
            self.cell.place(&now.pose_bt),
            Tool {
                margin: 0.0,
                ..self.cell.tool
            },
        );
        let shaft = self.cell.shaft(&now.pose_bt.rotation);
        let room = Clearance {
            tool: &bare,
            shaft,
            distance: &distance(&*self.world),
        }
        .room(&here, 0.0);
        if room < 0.0 {
            let place_mm = (here * 1e3).coords.into();
            return Err(LinkError::InPart { place_mm }.into());
        }
        // in free air, at a stop: the force guards the first link as well
        let noise_n = self.watched().zero_below(most_n)?;
        Ok((self.arm.next_state().map_err(arm)?, noise_n))
    }
}
