//! Known surfaces: where analytic surfaces explain the touches, the surface of the part is theirs.
//!
//! A [`KnownSurface`] comes from a fit outside this crate, with the contacts that it explains. It
//! goes on between these contacts, and a little beyond them, to where it meets another known
//! surface: f is the larger of both values at a convex edge, the smaller one at a concave edge.

mod extent;
mod known_surface;
mod known_surfaces;

pub use known_surface::{KnownSurface, KnownSurfaceError};
pub use known_surfaces::KnownSurfaces;
pub(in crate::reconstruct) use known_surfaces::KnownValue;
