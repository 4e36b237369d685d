//! Known surfaces, a scanner and a stylus to test against.
//!
//! A [`Surface`] knows how far every point is from it. The scanner makes a bad mesh of one, the stylus slides a ball
//! over it and says what it felt. All randomness comes from a seed.

mod peaks;
mod plate;
mod plate_mesh;
mod surface;
mod triangulate;

pub use peaks::{Peaks, add_vertex_noise};
pub use plate::{Plate, Stadium, TruthFeature, TruthShape};
pub use surface::{Bounds, Surface, SurfacePoint};
