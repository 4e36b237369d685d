//! Known surfaces, a scanner and a stylus for tests.
//!
//! A [`Surface`] has a signed distance at every point. The scanner makes a bad mesh of one, the
//! stylus slides a ball over it and records its contacts ([`touch`]). All randomness comes from a
//! seed.
//!
//! | files | content |
//! |---|---|
//! | `surfaces/` | known surfaces and their triangles |
//! | `paths/` | paths of the hand over a part |
//! | `scanner`, `stylus`, `sensor`, `markers`, `arm` | instruments, with the errors of real ones |
//! | `tip`, `ball`, `bending`, `coupled` | mechanics of a tip on a surface |
//! | `world`, `mistake` | drawn worlds with their calibration; mistakes that a check must name |
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

#[macro_use]
mod settings;

mod arm;
mod arm_errors;
mod ball;
mod bending;
pub mod coupled;
mod error;
mod markers;
mod mistake;
mod paths;
mod random;
mod scanner;
mod sensor;
mod stylus;
mod surfaces;
mod tip;
mod world;

pub use arm::{ArmFault, ArmParams, SensorFault, SimArm, WEIGHTLESS};
pub use arm_errors::{ArmErrorSigmas, ArmErrors};
pub use ball::{BallContact, push_ball};
pub use bending::TipBending;
pub use error::SimError;
pub use markers::{CameraParams, see_markers};
pub use mistake::{INPUT_MISTAKES, InputMistake, ToldRecording};
pub use paths::habit::Habit;
pub use paths::path::{
    PathParams, RasterDirection, RasterRegion, Stroke, around_wall, plan_demo, plan_mesh,
    plan_walls, raster,
};
pub use paths::sides::plan_sides;
pub use paths::waterline::plan_waterlines;
pub use scanner::{ScanQuality, ScannerParams, measure_quality, scan};
pub use sensor::{SensorParams, TrueState};
pub use stylus::{StylusParams, Touch, touch};
pub use surfaces::mesh_surface::MeshSurface;
pub use surfaces::peaks::{Peaks, add_vertex_noise};
pub use surfaces::plate::{Plate, PlateStadium, TruthFeature, TruthShape};
pub use surfaces::surface::{Bounds, Surface, SurfacePoint};
pub use surfaces::wavy;
pub use surfaces::with_spheres::WithSpheres;
pub use world::{CalibrationStds, DrawnValue, DrawnWorld, ReportedWorld, SimWorld, ToldOff};
