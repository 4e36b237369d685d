//! Boundary representation: trimmed analytic faces of a part, sound or refused, and the curves in
//! which analytic surfaces meet (the terms of ISO 10303-42).
//!
//! [`intersection()`] gives the curves of two surfaces, [`BrepParts`] trims them to vertices, and
//! [`Brep::new`] refuses everything that is no boundary. Periodic faces need no seam: two circles
//! bound a cylinder.

mod check;
mod circles;
mod curve;
mod error;
mod intersection;
mod meridian;
mod parts;
mod placement;
mod ruling;
mod spline;
mod surface;
mod turning;

pub use check::{Brep, BrepShell};
pub use curve::SpaceCurve;
pub use error::BrepError;
pub use intersection::intersection;
pub use parts::{
    BrepEdge, BrepFace, BrepParts, FaceLoop, OrientedEdge, StandardUncertainty, UncertaintyUnit,
};
pub use placement::AxisPlacement;
pub use spline::{CurveNode, SplineForm, spline_form};
pub use surface::{AnalyticSurface, SurfaceShape};
pub use turning::area_and_turn;
