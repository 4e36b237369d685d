//! The surface meshed anew where it was touched, as one closed skin by construction.
//!
//! [`TouchFinder`] makes touches of samples; [`ContactStore`] and [`SweptSpace`] keep what was touched and where the tip
//! went. [`Evidence`] says what these and the scan know about a point; that is held at the nodes of a regular [`Lattice`] and
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

mod clip;
mod complete;
mod contact_sigma;
mod contact_store;
mod contact_sums;
mod contour;
mod crossing;
mod cut;
mod delta;
mod dual;
mod evidence;
mod felt;
mod field;
mod fill;
mod fit_sigma;
mod history;
mod inner_corner;
mod jumps;
mod lattice;
mod loops;
mod lumps;
mod outliers;
mod outline;
mod patched;
mod patcher;
mod probed_log;
mod qef;
mod remesh;
mod restore;
mod scan_value;
mod settle;
mod splice;
mod swept;
mod table;
mod thinned;
mod touches;
mod trace;
mod two_points;
mod unreachable;
mod vertex_sigma;
mod visits;

pub use contact_sigma::{CalibrationParams, ContactSigma};
pub use contact_store::{ContactStore, GateParams, MeanContact, Verdict};
pub use contour::{ContourParams, Crossing, contour};
pub use cut::Cut;
pub use delta::{PatchDelta, PatchVertex};
pub use evidence::{Evidence, EvidenceParams, Finding, ScanPrior, Source};
pub use field::{FieldParams, FieldScratch, FieldValue};
pub use fit_sigma::FitSigma;
pub use history::History;
pub use lattice::{Edge, Lattice, LatticeNode, Owner, PatchFace, Square, VertexKey};
pub use outliers::{Outlier, Outliers};
pub use patched::{Patched, Support};
pub use patcher::{PatchRegion, Patcher, PatcherParams, UncertaintyParams};
pub use probed_log::ProbedLog;
pub use scan_value::ScanValue;
pub use splice::{Patch, Splice};
pub use swept::SweptSpace;
pub use table::{CellTable, Key};
pub use touches::{SurfaceContact, TipTouch, TouchFinder, TouchFinderParams};
pub use trace::OpenSquare;

/// The lattice cells in which the surface is replaced, each named by its lowest node.
pub type LatticeRegion = CellTable<LatticeNode, ()>;

/// The field at lattice nodes, m: negative in the material.
pub type NodeValues = CellTable<LatticeNode, f64>;
