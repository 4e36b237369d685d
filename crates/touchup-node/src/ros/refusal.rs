//! Refusals of calls with a reason, in the type of each call.

use crate::ros::messages::*;
use crate::ros::port::{ArmOrder, Arrival, Call, Goal, GoalEnd};

/// A direction without meaning.
pub const NO_VECTOR: Vector3 = Vector3 {
    x: f64::NAN,
    y: f64::NAN,
    z: f64::NAN,
};

/// A place without meaning.
pub const NO_POINT: Point = Point {
    x: f64::NAN,
    y: f64::NAN,
    z: f64::NAN,
};

/// A feature of which nothing is measured.
pub fn unknown_feature(id: u32) -> Feature {
    let nan = f64::NAN;
    Feature {
        id,
        status: Feature::STATUS_FLAGGED,
        fitted_to: Feature::FITTED_TO_NOTHING,
        search_radius: nan,
        center: NO_POINT,
        center_std: nan,
        axis: NO_VECTOR,
        axis_std: nan,
        direction: NO_VECTOR,
        diameter: nan,
        diameter_std: nan,
        length: nan,
        length_std: nan,
        width: nan,
        width_std: nan,
        depth: nan,
        depth_std: nan,
        cone_angle: nan,
        cone_angle_std: nan,
        through: Feature::UNKNOWN,
        convex: Feature::UNKNOWN,
        group: Feature::NO_GROUP,
        ..Feature::default()
    }
}

/// The result of a probing that was not begun.
///
/// - `code`: of [`ProbeResult`]
pub fn not_probed(id: u32, code: u8, why: &str) -> ProbeResult {
    let feature = unknown_feature(id);
    ProbeResult {
        id,
        code,
        message: why.to_owned(),
        feature,
        uncertainty: f64::NAN,
        ..ProbeResult::default()
    }
}

impl Arrival {
    /// Refuses the arrival, if it expects an answer.
    ///
    /// - `code`: of [`ProbeResult`]
    pub fn refuse(self, code: u8, why: &str) {
        match self {
            Self::Call(call) => call.refuse(code, why),
            Self::SetParameter(_, _, reply) => reply.send(Err(why.to_owned())),
            Self::Replay(_, reply) => reply.send(Err(why.to_owned())),
            _ => {}
        }
    }
}

impl Call {
    fn refuse(self, code: u8, why: &str) {
        let message = why.to_owned();
        match self {
            Self::Flag(_, reply) => reply.send(FlagFeatureResponse {
                message,
                ..Default::default()
            }),
            Self::Unflag(_, reply) => reply.send(UnflagFeatureResponse {
                message,
                ..Default::default()
            }),
            Self::Detect(_, reply) => reply.send(DetectFeaturesResponse {
                message,
                ..Default::default()
            }),
            Self::Save(_, reply) => reply.send(SaveMeshResponse {
                message,
                ..Default::default()
            }),
            Self::Resync(_, reply) => reply.send(ResyncMeshResponse {
                message,
                ..Default::default()
            }),
            Self::Undo(_, reply) | Self::Redo(_, reply) => reply.send(UndoResponse {
                message,
                ..Default::default()
            }),
            Self::TakeOut(_, reply) => reply.send(TakeOutTouchResponse {
                message,
                ..Default::default()
            }),
            Self::Reset(reply) | Self::ArmState(reply) => reply.send(TriggerResponse {
                message,
                ..Default::default()
            }),
            Self::Arm(order) => order.refuse(Header::default(), code, why),
        }
    }
}

impl ArmOrder {
    /// Refuses the order.
    ///
    /// - `code`: of [`ProbeResult`]
    pub fn refuse(self, header: Header, code: u8, why: &str) {
        match self {
            Self::Feature(request, reply) => {
                let result = ProbeResult {
                    header,
                    ..not_probed(request.id, code, why)
                };
                reply.send(ProbeFeatureResponse { result });
            }
            Self::Goal(goal, Goal { accept, result, .. }) => {
                accept.send(true);
                let first = goal.ids.first().copied();
                let (ids, codes) = first.map(|id| (id, code)).into_iter().unzip();
                result.send((
                    GoalEnd::Aborted,
                    ProbeResponse {
                        header,
                        code,
                        message: why.to_owned(),
                        ids,
                        codes,
                    },
                ));
            }
            Self::All(reply) | Self::Recover(reply) => {
                reply.send(TriggerResponse {
                    success: false,
                    message: why.to_owned(),
                });
            }
        }
    }
}
