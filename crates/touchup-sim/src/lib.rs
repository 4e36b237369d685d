//! Known surfaces, a scanner and a stylus for tests.
//!
//! A [`Surface`] has a signed distance at every point. The scanner makes a bad mesh of one, the
//! stylus slides a ball over it and records its contacts ([`touch`]). All randomness comes from a
//! seed.
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

#[macro_use]
mod settings;

mod arm;
mod arm_errors;
mod ball;
mod bending;
mod contour;
pub mod coupled;
mod error;
mod field;
mod habit;
mod markers;
mod mesh_surface;
mod mistake;
mod path;
mod peaks;
mod plate;
mod plate_mesh;
mod random;
mod scanner;
mod sensor;
mod sides;
mod stylus;
mod surface;
mod tip;
mod triangulate;
mod waterline;
pub mod wavy;
mod with_spheres;
mod world;

pub use arm::{ArmFault, ArmParams, SensorFault, SimArm, WEIGHTLESS};
pub use arm_errors::{ArmErrorSigmas, ArmErrors};
pub use ball::{BallContact, push_ball};
pub use bending::TipBending;
pub use error::SimError;
pub use habit::Habit;
pub use markers::{CameraParams, see_markers};
pub use mesh_surface::MeshSurface;
pub use mistake::{INPUT_MISTAKES, InputMistake, ToldRecording};
pub use path::{
    Lines, PathParams, RasterRegion, Stroke, around_wall, plan_demo, plan_mesh, plan_walls, raster,
};
pub use peaks::{Peaks, add_vertex_noise};
pub use plate::{Plate, PlateStadium, TruthFeature, TruthShape};
pub use scanner::{ScanQuality, ScannerParams, measure_quality, scan};
pub use sensor::{Moment, SensorParams};
pub use sides::plan_sides;
pub use stylus::{StylusParams, Touch, touch};
pub use surface::{Bounds, Surface, SurfacePoint};
pub use waterline::plan_waterlines;
pub use with_spheres::WithSpheres;
pub use world::{CalibrationStds, DrawnValue, DrawnWorld, SimWorld, Told, ToldOff};
