//! What a viewer draws.

use serde::{Deserialize, Serialize};

use super::{Duration, Header, Point, Pose, Vector3, named};

/// A colour, each part 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorRGBA {
    /// red
    pub r: f32,
    /// green
    pub g: f32,
    /// blue
    pub b: f32,
    /// how much it covers; 0 is not seen
    pub a: f32,
}
named!("std_msgs/msg": ColorRGBA);

/// A picture as a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CompressedImage {
    /// of its taking
    pub header: Header,
    /// png, jpeg
    pub format: String,
    /// the file
    pub data: Vec<u8>,
}
named!("sensor_msgs/msg": CompressedImage);

/// A place in a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UVCoordinate {
    /// across, 0 to 1
    pub u: f32,
    /// upwards, 0 to 1
    pub v: f32,
}

/// A mesh as a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshFile {
    /// its name, of which the ending counts
    pub filename: String,
    /// the file
    pub data: Vec<u8>,
}

/// Something to be drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// frame of the pose
    pub header: Header,
    /// group, which a viewer can hide
    pub ns: String,
    /// number in the group; a later one with the same takes its place
    pub id: i32,
    /// one of the shapes
    pub r#type: i32,
    /// [`Self::ADD`], [`Self::DELETE`] or [`Self::DELETEALL`]
    pub action: i32,
    /// frame of the points
    pub pose: Pose,
    /// size along the axes, m; of an arrow: shaft, head, length of the head; of lists of triangles 1
    pub scale: Vector3,
    /// of all of it
    pub color: ColorRGBA,
    /// after which it goes; 0: never
    pub lifetime: Duration,
    /// moves with its frame
    pub frame_locked: bool,
    /// m
    pub points: Vec<Point>,
    /// of each point; empty: `color`
    pub colors: Vec<ColorRGBA>,
    /// where a texture is
    pub texture_resource: String,
    /// the texture itself
    pub texture: CompressedImage,
    /// of each point
    pub uv_coordinates: Vec<UVCoordinate>,
    /// what is written
    pub text: String,
    /// where a mesh is
    pub mesh_resource: String,
    /// the mesh itself
    pub mesh_file: MeshFile,
    /// draws that mesh in its own colours
    pub mesh_use_embedded_materials: bool,
}

impl Marker {
    /// shape: from the first point to the second
    pub const ARROW: i32 = 0;
    /// shape: a box
    pub const CUBE: i32 = 1;
    /// shape: a ball or ellipsoid
    pub const SPHERE: i32 = 2;
    /// shape: along z
    pub const CYLINDER: i32 = 3;
    /// shape: from point to point
    pub const LINE_STRIP: i32 = 4;
    /// shape: one for each two points
    pub const LINE_LIST: i32 = 5;
    /// shape: one for each point
    pub const CUBE_LIST: i32 = 6;
    /// shape: one for each point
    pub const SPHERE_LIST: i32 = 7;
    /// shape: squares that face the viewer
    pub const POINTS: i32 = 8;
    /// shape: a text that faces the viewer, `scale.z` high
    pub const TEXT_VIEW_FACING: i32 = 9;
    /// shape: from a file
    pub const MESH_RESOURCE: i32 = 10;
    /// shape: one for each three points
    pub const TRIANGLE_LIST: i32 = 11;
    /// action: draws it, or changes what is drawn
    pub const ADD: i32 = 0;
    /// action: takes it away
    pub const DELETE: i32 = 2;
    /// action: takes all of the topic away
    pub const DELETEALL: i32 = 3;
}

/// Things to be drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// in any order
    pub markers: Vec<Marker>,
}
named!("visualization_msgs/msg": UVCoordinate, MeshFile, Marker, MarkerArray);
