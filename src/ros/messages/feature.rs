//! Features of the part, in the frame of the object.

use serde::{Deserialize, Serialize};

use super::{Header, Point, Vector3, named};

/// A feature, with its size, its place and how well each is known.
///
/// What does not apply to the kind, or is not known yet, is NaN; fields that end in `_std` are standard uncertainties.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Feature {
    /// never given twice in a session
    pub id: u32,
    /// one of `KIND_…`
    pub kind: u8,
    /// one of `STATUS_…`
    pub status: u8,
    /// one of `FITTED_TO_…`
    pub fitted_to: u8,
    /// share of its surface that was touched, 0 to 1
    pub touched: f64,
    /// touches that its numbers rest on
    pub touch_count: u32,
    /// how far around its center a flagged one is looked for, m
    pub search_radius: f64,
    /// where the axis goes through the opening, or the middle, m
    pub center: Point,
    /// across the axis, m
    pub center_std: f64,
    /// out of the opening, along the edge, or the outward normal; unit vector
    pub axis: Vector3,
    /// rad
    pub axis_std: f64,
    /// along a slot or pocket; unit vector
    pub direction: Vector3,
    /// m
    pub diameter: f64,
    /// m
    pub diameter_std: f64,
    /// m
    pub length: f64,
    /// m
    pub length_std: f64,
    /// m
    pub width: f64,
    /// m
    pub width_std: f64,
    /// to the floor, or as far as the wall goes, m
    pub depth: f64,
    /// m
    pub depth_std: f64,
    /// full angle of a countersink, rad
    pub cone_angle: f64,
    /// rad
    pub cone_angle_std: f64,
    /// whether it goes through: [`Self::UNKNOWN`], [`Self::NO`] or [`Self::YES`]
    pub through: u8,
    /// whether the material is inside of the edge: the same
    pub convex: u8,
    /// holes with the same number are steps of one; [`Self::NO_GROUP`]: none
    pub group: i32,
    /// both ends of an edge, slot or pocket, m
    pub points: Vec<Point>,
}

impl Feature {
    /// a region to be explored
    pub const KIND_UNKNOWN: u8 = 0;
    /// hole
    pub const KIND_HOLE: u8 = 1;
    /// slot
    pub const KIND_SLOT: u8 = 2;
    /// pocket
    pub const KIND_POCKET: u8 = 3;
    /// boss
    pub const KIND_BOSS: u8 = 4;
    /// edge
    pub const KIND_EDGE: u8 = 5;
    /// corner
    pub const KIND_CORNER: u8 = 6;
    /// plane
    pub const KIND_PLANE: u8 = 7;
    /// somebody pointed at it
    pub const STATUS_FLAGGED: u8 = 1;
    /// measured from the mesh, or from touches by hand
    pub const STATUS_FOUND: u8 = 2;
    /// touched by an arm until the tolerance was reached or the budget spent
    pub const STATUS_PROBED: u8 = 3;
    /// it has no numbers
    pub const FITTED_TO_NOTHING: u8 = 0;
    /// too little of it was touched
    pub const FITTED_TO_MESH: u8 = 1;
    /// its numbers rest on touches
    pub const FITTED_TO_TOUCHES: u8 = 2;
    /// not known
    pub const UNKNOWN: u8 = 0;
    /// no
    pub const NO: u8 = 1;
    /// yes
    pub const YES: u8 = 2;
    /// it is not a step of anything
    pub const NO_GROUP: i32 = -1;
}

/// All features that are known, flagged ones among them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeatureArray {
    /// of the newest sample in the numbers; frame of the object
    pub header: Header,
    /// as in [`super::MeshPatch`]
    pub session: String,
    /// state of the mesh that they belong to
    pub mesh_version: u64,
    /// in ascending order of id
    pub features: Vec<Feature>,
    /// share of the area that belongs to no plane, cylinder or cone; NaN before the first detection
    pub unexplained: f64,
}
named!("touchup_msgs/msg": Feature, FeatureArray);
