//! The surface meshed anew where it was touched, as one closed skin by construction.
//!
//! [`TouchFinder`] makes touches of samples; [`ContactMap`] and `SweptSpace` keep what was touched and where the tip
//! went. `Evidence` says what these and the scan know about a point; that is held at the nodes of a regular [`Lattice`] and
//! completed where nothing is known. [`Patcher`] is the whole way: everything at once, or what changed since the last time, as
//! a [`PatchDelta`] for a mesh that follows by [`Splice`].
//!
//! In a set of the lattice's cells, the *region*, the surface is the zero set of that field f (f < 0 in the material),
//! found by dual contouring that cannot intersect itself (after \[Ju Udeshi 2006\]); outside, the scan stays. On the
//! squares that bound the region both sides share one *trace*: the polyline in which the scan crosses that square. [`Cut`]
//! clips the scan and holds the traces, [`contour`] makes the new faces, [`Patch::applied_to`] puts the two together.
//!
//! Vertices are named by [`VertexKey`], so neighbours share them without a search and no crack can arise. Each face has an
//! [`Owner`] whose faces depend on the field, the region and the scan nearby alone.

mod boundary_loops;
mod clip;
mod contact_map;
mod contact_statistics;
mod contact_uncertainty;
mod contour;
mod crossing;
mod delta;
mod discontinuities;
mod double_contact;
mod dual;
mod evidence;
mod field;
mod field_uncertainty;
mod floating_components;
mod free_space;
mod grid;
mod harmonic_fill;
mod history;
mod incremental;
mod inner_corner;
mod lattice;
mod loops;
mod new_faces;
mod outliers;
mod passes;
mod patched;
mod patcher;
mod probed_log;
mod qef;
mod remesh;
mod scan_clipping;
mod scan_value;
mod splice;
mod table;
mod touch_history;
mod touches;
mod trace;
mod triangulation;
mod unreachable;
mod vertex_uncertainty;
mod voxel_set;

pub use contact_map::{ContactMap, GateParams, MeanContact, Verdict};
pub use contact_uncertainty::{CalibrationParams, ContactSigma};
pub use contour::{ContourParams, contour};
pub use crossing::Crossing;
pub use delta::{PatchDelta, PatchVertex};
pub use evidence::{EvidenceParams, Source};
pub use field::{FieldParams, FieldScratch, FieldValue};
pub use field_uncertainty::FitSigma;
pub use history::History;
pub use lattice::{Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, Owner, PatchFace, Square, VertexKey};
pub use new_faces::Patch;
pub use outliers::{Outlier, Outliers};
pub use patched::{Patched, Support};
pub use patcher::{PatchParams, PatchRegion, Patcher, PatcherParams, UncertaintyParams};
pub use scan_clipping::Cut;
pub use splice::Splice;
pub use table::{CellTable, Key};
pub use touches::{SurfaceContact, TipTouch, TouchFinder, TouchFinderParams};
pub use trace::OpenSquare;
