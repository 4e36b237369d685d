//! The patch: where the scan was touched it is meshed anew, as one closed skin by construction.
//!
//! A regular [`Lattice`] lies over the part. In a set of its cells, the *region*, the surface is the zero set of a field f
//! (f < 0 in the material), found by dual contouring that cannot intersect itself (after \[Ju Udeshi 2006\]); outside, the
//! scan stays. On the squares that bound the region both sides share one *trace*: the polyline in which the scan crosses
//! that square. [`Cut`] clips the scan and holds the traces, [`contour`] makes the new faces, [`Patch::applied_to`] puts
//! the two together.
//!
//! Vertices are named by [`VertexKey`], so neighbours share them without a search and no crack can arise. Each face has an
//! [`Owner`] whose faces depend on the field, the region and the scan nearby alone.

mod clip;
mod contour;
mod cut;
mod dual;
mod fill;
mod lattice;
mod loops;
mod outline;
mod qef;
mod splice;
mod table;
mod trace;

pub use contour::{ContourParams, Crossing, contour};
pub use cut::Cut;
pub use lattice::{Edge, Lattice, Node, Owner, PatchFace, Square, VertexKey};
pub use splice::Patch;
pub use table::{Key, Table};
pub use trace::OpenSquare;

/// The lattice cells in which the surface is replaced, each named by its lowest node.
pub type Region = Table<Node, ()>;

/// The field at lattice nodes, m: negative in the material.
pub type NodeValues = Table<Node, f64>;
