//! Finds what machined parts are made of: holes, slots, pockets, bosses, edges, corners and planes.

mod borders;
mod cones;
mod detect;
mod facets;
mod feature;
pub mod fit;
mod holes;
mod measure;
mod observe;
mod primitive;
mod rays;
mod scene;
mod segment;
mod slots;
mod walls;

pub use detect::{Detection, detect};
pub use feature::{Feature, FittedTo, Kind, Measured};
