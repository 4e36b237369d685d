//! The mesh as it changes, and why.

use serde::{Deserialize, Serialize};

use super::{Header, Point, Vector3, named};

/// A change of the mesh from one version to the next, or the whole state (from version 0).
///
/// Faces go first, then vertices are set, faces added, and vertices that no face uses any more go.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshPatch {
    /// of the newest sample in it; frame of the object
    pub header: Header,
    /// another name means another mesh
    pub session: String,
    /// state that this leads to
    pub version: u64,
    /// state that it leads from; 0: the empty mesh
    pub base_version: u64,
    /// number of this part
    pub part: u32,
    /// how many parts there are
    pub part_count: u32,
    /// faces that go
    pub removed_faces: Vec<u32>,
    /// vertices that are set
    pub vertices: Vec<u32>,
    /// x y z of each, m
    pub positions: Vec<f32>,
    /// of each along the normal, m²; NaN: nothing tells it
    pub variance: Vec<f32>,
    /// what each rests on: one of `SUPPORT_…`
    pub support: Vec<u8>,
    /// faces that are added, or have other corners now
    pub faces: Vec<u32>,
    /// three vertices of each, counter-clockwise seen from outside
    pub corners: Vec<u32>,
    /// vertices that go
    pub removed_vertices: Vec<u32>,
    /// in `version`
    pub vertex_count: u32,
    /// in `version`
    pub face_count: u32,
}

impl MeshPatch {
    /// the scan
    pub const SUPPORT_SCAN: u8 = 0;
    /// a touch
    pub const SUPPORT_TOUCHED: u8 = 1;
    /// a guess between touches
    pub const SUPPORT_GUESSED: u8 = 2;
    /// a guess where the tip does not reach
    pub const SUPPORT_UNREACHABLE: u8 = 3;
}

/// What was felt against what the mesh lets expect, for one sample. NaN where something has no meaning in the case.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HapticMismatch {
    /// of the sample; frame of the object
    pub header: Header,
    /// one of the cases
    pub contact_case: u8,
    /// that the sample acts on, or [`Self::NO_FACE`]
    pub face: u32,
    /// in which that face has this number: the one before the sample
    pub mesh_version: u64,
    /// centre of the ball, or middle of a flat end, m
    pub tip: Point,
    /// felt, N
    pub actual_force: Vector3,
    /// expected, N
    pub expected_force: Vector3,
    /// felt − expected, N
    pub linear: Vector3,
    /// expected × felt, N²
    pub rotational: Vector3,
    /// from the face to the point of the tip that touches, m; positive outside
    pub signed_distance: f64,
}

impl HapticMismatch {
    /// nothing felt, nothing expected
    pub const FREE: u8 = 1;
    /// expected and not felt
    pub const MESH_ONLY: u8 = 2;
    /// felt and not expected
    pub const SURFACE_ONLY: u8 = 3;
    /// felt and expected
    pub const BOTH: u8 = 4;
    /// no face is acted on
    pub const NO_FACE: u32 = u32::MAX;
}
named!("touchup_msgs/msg": MeshPatch, HapticMismatch);
