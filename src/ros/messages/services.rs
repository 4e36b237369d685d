//! Requests and responses of the services. `success` and `message` are the same everywhere: whether it was done, and why
//! not, or what was done.

use serde::{Deserialize, Serialize};

use super::{PointStamped, ProbeResult, ProbeSettings, RosMessage};

/// Flags a place to be looked at.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FlagFeatureRequest {
    /// as in [`super::Feature`]
    pub kind: u8,
    /// in any frame that is connected to the object's, m
    pub point: PointStamped,
    /// from the point, m; 0: as the node is configured
    pub search_radius: f64,
}

/// Whether it was flagged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlagFeatureResponse {
    /// whether it was
    pub success: bool,
    /// why not, or what was
    pub message: String,
    /// number of the feature, a known one or a new one
    pub id: u32,
}

/// Takes a flag back.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnflagFeatureRequest {
    /// number of the feature
    pub id: u32,
}

/// Whether it was taken back.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnflagFeatureResponse {
    /// whether it was
    pub success: bool,
    /// why not
    pub message: String,
}

/// Looks for features in the mesh as it is.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectFeaturesRequest {
    /// counted and named in the answer, as in [`super::Feature`]; empty: all
    pub kinds: Vec<u8>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DetectFeaturesResponse {
    /// whether it was done
    pub success: bool,
    /// why not, or what was found
    pub message: String,
    /// state of the mesh that was looked at
    pub mesh_version: u64,
    /// of the kinds that were asked for
    pub count: u32,
    /// their numbers, ascending
    pub ids: Vec<u32>,
}

/// Writes the mesh into the folder of the session.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveMeshRequest {
    /// file name, its ending says the format; empty: refined.ply
    pub name: String,
    /// replace a file of that name
    pub overwrite: bool,
    /// write features and touches beside it
    pub with_features: bool,
}

/// Whether it was written.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveMeshResponse {
    /// whether all of it was
    pub success: bool,
    /// why not
    pub message: String,
    /// where it is, as seen by the node
    pub path: String,
    /// state that was written
    pub mesh_version: u64,
    /// how many
    pub vertex_count: u32,
    /// how many
    pub face_count: u32,
}

/// Asks for the whole mesh on `mesh_patch`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResyncMeshRequest {
    /// that the caller has; empty: none
    pub session: String,
    /// that the caller has; 0: none
    pub version: u64,
}

/// Whether it will come.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResyncMeshResponse {
    /// whether it will
    pub success: bool,
    /// why not
    pub message: String,
    /// now
    pub session: String,
    /// now; what comes is this one or a later one
    pub version: u64,
}

/// Takes strokes back, or does them again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UndoRequest {
    /// how many; 0 counts as 1
    pub strokes: u32,
}

/// Whether any stroke was changed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UndoResponse {
    /// whether any was
    pub success: bool,
    /// why not
    pub message: String,
    /// how many were
    pub strokes: u32,
    /// state of the mesh afterwards
    pub mesh_version: u64,
}

/// Has the arm probe one feature.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeFeatureRequest {
    /// number of the feature
    pub id: u32,
    /// what is wanted of it, and the limits
    pub settings: ProbeSettings,
}

/// How it ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ProbeFeatureResponse {
    /// and what was measured
    pub result: ProbeResult,
}

/// Nothing: what does it is the call. An empty message has one byte on the wire.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// 0, means nothing
    pub structure_needs_at_least_one_member: u8,
}

/// Whether it was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// whether it was
    pub success: bool,
    /// why not, or what was
    pub message: String,
}

/// On or off.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolRequest {
    /// on
    pub data: bool,
}

/// Whether it was done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetBoolResponse {
    /// whether it was
    pub success: bool,
    /// why not, or what was
    pub message: String,
}

/// Names request and response of services: `services!("std_srvs": Trigger(TriggerRequest, TriggerResponse))`.
macro_rules! services {
    ($package:literal: $($name:ident($request:ident, $response:ident)),+ $(,)?) => {
        $(impl RosMessage for $request {
            const TYPE_NAME: &'static str = concat!($package, "/srv/", stringify!($name), "_Request");
        }
        impl RosMessage for $response {
            const TYPE_NAME: &'static str = concat!($package, "/srv/", stringify!($name), "_Response");
        })+
    };
}

services!("std_srvs": Trigger(TriggerRequest, TriggerResponse), SetBool(SetBoolRequest, SetBoolResponse));
services!("touchup_msgs":
    FlagFeature(FlagFeatureRequest, FlagFeatureResponse),
    UnflagFeature(UnflagFeatureRequest, UnflagFeatureResponse),
    DetectFeatures(DetectFeaturesRequest, DetectFeaturesResponse),
    SaveMesh(SaveMeshRequest, SaveMeshResponse),
    ResyncMesh(ResyncMeshRequest, ResyncMeshResponse),
    Undo(UndoRequest, UndoResponse),
    ProbeFeature(ProbeFeatureRequest, ProbeFeatureResponse),
);
