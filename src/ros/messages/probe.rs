//! Probing by an arm: what is asked for, how it goes, how it ended. In the frame of the object.

use serde::{Deserialize, Serialize};

use super::{Feature, Header, Point, Pose, RosMessage, Vector3, Wrench, named};

/// What is wanted of a probing, and how far the arm may go for it. 0: as the node is configured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeSettings {
    /// the number that touches are chosen for: one of `QUANTITY_…`
    pub quantity: u8,
    /// it is to be known within ± this, m (axis: rad)
    pub tolerance: f64,
    /// with this probability
    pub confidence: f64,
    /// one of `PATTERN_…`
    pub pattern: u8,
    /// for each feature, at most
    pub max_touches: u32,
    /// for each feature, at most, s
    pub max_duration: f64,
    /// at the contact, N
    pub max_force: f64,
    /// of the tip while it looks for the surface, m/s
    pub max_search_speed: f64,
    /// of the tip through free space, m/s
    pub max_link_speed: f64,
    /// of one search, m
    pub max_search_travel: f64,
    /// plan and check alone
    pub dry_run: bool,
}

impl ProbeSettings {
    /// every length
    pub const QUANTITY_ALL: u8 = 0;
    /// position
    pub const QUANTITY_POSITION: u8 = 1;
    /// axis
    pub const QUANTITY_AXIS: u8 = 2;
    /// diameter
    pub const QUANTITY_DIAMETER: u8 = 3;
    /// length
    pub const QUANTITY_LENGTH: u8 = 4;
    /// width
    pub const QUANTITY_WIDTH: u8 = 5;
    /// depth
    pub const QUANTITY_DEPTH: u8 = 6;
    /// as the planner likes
    pub const PATTERN_PLANNED: u8 = 0;
    /// single touches alone
    pub const PATTERN_TOUCHES: u8 = 1;
    /// sliding with constant normal force
    pub const PATTERN_SLIDE: u8 = 2;
}

/// The record of one touch by the arm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeTouch {
    /// onset of the contact; where there is none, the end of the touch; frame of the object
    pub header: Header,
    /// number of the feature
    pub id: u32,
    /// number in the probing of this feature
    pub index: u32,
    /// what the curve of force over travel looks like: one of the constants
    pub verdict: u8,
    /// whether the feature's numbers use it
    pub accepted: bool,
    /// if not, why
    pub reason: String,
    /// of the tip at the onset, m
    pub pose: Pose,
    /// where the surface was touched, m
    pub contact: Point,
    /// along the normal, m
    pub contact_std: f64,
    /// outward, unit vector: the way the part pushed, which friction leaves aslant
    pub normal: Vector3,
    /// the way of the search, unit vector
    pub approach: Vector3,
    /// of the contact from the mesh as it was, m; positive outside
    pub deviation: f64,
    /// of the tip at the onset, m/s
    pub speed: f64,
    /// that was used, m
    pub tip_radius: f64,
    /// name of the calibration that was used; empty: none was named
    pub calibration: String,
    /// largest force, N, and torque about the tip's centre, N·m
    pub peak_wrench: Wrench,
    /// of each sample, s from the stamp
    pub curve_time: Vec<f32>,
    /// of each sample along the approach, m
    pub curve_travel: Vec<f32>,
    /// of each sample against the approach, N
    pub curve_force: Vec<f32>,
    /// of each sample across it, N
    pub curve_lateral_force: Vec<f32>,
}

impl ProbeTouch {
    /// as it should be
    pub const CLEAN: u8 = 1;
    /// the tip slid
    pub const SLIP: u8 = 2;
    /// the tip met an edge
    pub const EDGE: u8 = 3;
    /// the tip came off again
    pub const BOUNCE: u8 = 4;
    /// something hit the arm or the part
    pub const IMPACT: u8 = 5;
    /// no contact within the search travel
    pub const MISS: u8 = 6;
    /// not touched: the way to it was not clear, or beyond the limits
    pub const HELD_BACK: u8 = 7;
    /// something was felt whose curve says nothing
    pub const UNCLEAR: u8 = 8;
}

/// How the probing of one feature ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeResult {
    /// when it was done; frame of the object
    pub header: Header,
    /// number of the feature
    pub id: u32,
    /// how it ended: below 20 done, 20 to 39 refused, 40 to 59 stopped
    pub code: u8,
    /// the same in words
    pub message: String,
    /// as it is now
    pub feature: Feature,
    /// of the wanted number, m or rad
    pub uncertainty: f64,
    /// s
    pub duration: f64,
    /// on the tip, N
    pub max_force: f64,
    /// that were tried
    pub touch_count: u32,
}

impl ProbeResult {
    /// the wanted tolerance is reached
    pub const TOLERANCE_REACHED: u8 = 1;
    /// the touches are spent and the tolerance is not reached
    pub const TOUCHES_SPENT: u8 = 2;
    /// the time is spent and the tolerance is not reached
    pub const TIME_SPENT: u8 = 3;
    /// dry run: the plan is complete
    pub const PLANNED: u8 = 4;
    /// nothing was found where it was looked for
    pub const NOTHING_FOUND: u8 = 5;
    /// the caller cancelled
    pub const CANCELLED: u8 = 6;
    /// no arm is configured
    pub const NO_ARM: u8 = 20;
    /// the parameter `allow_motion` is off
    pub const MOTION_NOT_ALLOWED: u8 = 21;
    /// there is no feature with this number, or no flagged one
    pub const NO_SUCH_FEATURE: u8 = 22;
    /// a setting is out of its range
    pub const BAD_REQUEST: u8 = 23;
    /// another probing is running
    pub const BUSY: u8 = 24;
    /// no power, not in remote control, or in a stop
    pub const ARM_NOT_READY: u8 = 25;
    /// tip, payload or place of the object is not calibrated
    pub const NOT_CALIBRATED: u8 = 26;
    /// the frames of object and arm are not connected
    pub const NO_TRANSFORM: u8 = 27;
    /// the plan leaves reach or workspace
    pub const OUT_OF_LIMITS: u8 = 28;
    /// no way keeps clear of the mesh
    pub const NO_CLEAR_PATH: u8 = 29;
    /// the node is paused
    pub const PAUSED: u8 = 30;
    /// the force rose over its limit
    pub const FORCE_OVER_LIMIT: u8 = 40;
    /// a touch where nothing should be
    pub const UNEXPECTED_CONTACT: u8 = 41;
    /// the surface came before it was looked for
    pub const EARLY_CONTACT: u8 = 42;
    /// speed, travel or workspace limit overrun while moving
    pub const LIMIT_OVERRUN: u8 = 43;
    /// protective stop of the controller
    pub const PROTECTIVE_STOP: u8 = 44;
    /// an operator stopped the arm
    pub const OPERATOR_STOP: u8 = 45;
    /// the link to the controller broke, or its program ended
    pub const LINK_LOST: u8 = 46;
    /// poses or wrenches stopped, grew stale, or came too seldom
    pub const DATA_LOST: u8 = 47;
    /// the process that drives the arm hung or died
    pub const DRIVER_LOST: u8 = 48;
    /// the node is shutting down
    pub const SHUTDOWN: u8 = 49;
    /// a fault of touchup
    pub const FAULT: u8 = 60;
}
named!("touchup_msgs/msg": ProbeSettings, ProbeTouch, ProbeResult);

/// Goal of the action `Probe`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeGoal {
    /// in this order; empty: all that are flagged, nearest first
    pub ids: Vec<u32>,
    /// of each
    pub settings: ProbeSettings,
}

/// Result of the action `Probe`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeResponse {
    /// when it was done; frame of the object
    pub header: Header,
    /// how the last one ended, as in [`ProbeResult`]
    pub code: u8,
    /// the same in words
    pub message: String,
    /// of each feature that was begun, the last 128
    pub ids: Vec<u32>,
    /// how each of them ended, as in [`ProbeResult`]
    pub codes: Vec<u8>,
}

/// Feedback of the action `Probe`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeFeedback {
    /// the feature at hand
    pub id: u32,
    /// number of it among them, from 1 on
    pub feature: u32,
    /// how many there are
    pub feature_count: u32,
    /// one of the constants
    pub phase: u8,
    /// the touch at hand, from 1 on
    pub touch: u32,
    /// how many are planned
    pub touch_count: u32,
    /// on the tip, N
    pub force: f64,
    /// of the wanted number now, m or rad
    pub uncertainty: f64,
    /// since the goal was taken up, s
    pub elapsed: f64,
}

impl ProbeFeedback {
    /// where to touch is being chosen
    pub const PLANNING: u8 = 1;
    /// through free space
    pub const LINK: u8 = 2;
    /// the force sensor is set to zero
    pub const ZEROING: u8 = 3;
    /// to where the search begins
    pub const APPROACH: u8 = 4;
    /// for the surface
    pub const SEARCH: u8 = 5;
    /// the slow one
    pub const SECOND_TOUCH: u8 = 6;
    /// along the surface
    pub const SLIDE: u8 = 7;
    /// away from the surface
    pub const RETRACT: u8 = 8;
}

impl RosMessage for ProbeGoal {
    const TYPE_NAME: &'static str = "touchup_msgs/action/Probe_Goal";
}

impl RosMessage for ProbeResponse {
    const TYPE_NAME: &'static str = "touchup_msgs/action/Probe_Result";
}

impl RosMessage for ProbeFeedback {
    const TYPE_NAME: &'static str = "touchup_msgs/action/Probe_Feedback";
}
