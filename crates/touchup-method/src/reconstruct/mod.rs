//! The touched surface remeshed as one closed skin by construction.
//!
//! [`TouchFinder`] makes touches of samples; [`ContactMap`] and `FreeSpace` keep contacts and free
//! space. `Evidence` combines these and the scan at a point; the nodes of a regular [`Lattice`]
//! store the field, with a harmonic fill between the evidence. [`Patcher`] runs the whole pipeline:
//! everything at once, or the changes since the last time, as a [`PatchDelta`] for a mesh that
//! follows by [`Splice`].
//!
//! In a set of the lattice's cells, the *region*, the surface is the zero set of that field f (f <
//! 0 in the material), by dual contouring that cannot intersect itself (after \[Ju Udeshi 2006\]);
//! outside, the scan stays. On the squares that bound the region both sides share one *trace*: the
//! polyline in which the scan crosses that square. [`Cut`] clips the scan and holds the traces,
//! [`contour`] makes the new faces, [`Patch::applied_to`] joins both.
//!
//! [`surface_of_cloud`] first makes a mesh of a scan that is a point cloud.
//!
//! [`VertexKey`] names a vertex, so neighbours share vertices without a search and no crack can
//! arise. Each face has an [`Owner`] whose faces depend on the field, the region and the scan
//! nearby alone.

mod cloud_surface;
mod contour;
mod evidence;
mod field;
mod incremental;
mod table;

pub use cloud_surface::{CloudError, CloudSummary, CloudSurface, NormalSource, surface_of_cloud};
pub use contour::crossing::Crossing;
pub use contour::dual_contouring::contour;
pub use contour::patched::{OpenSquare, Patch, PatchedMesh, Support};
pub use contour::scan_clipping::Cut;
pub use contour::splice::Splice;
pub use evidence::contact_map::ContactMap;
pub use evidence::contact_map::GateParams;
pub use evidence::contact_map::MeanContact;
pub use evidence::contact_uncertainty::ContactSigma;
pub use evidence::contact_uncertainty::{CalibrationParams, UncertaintyParams};
pub use evidence::outliers::{Outlier, Outliers};
pub use evidence::point_evidence::EvidenceParams;
pub use evidence::stroke_log::StrokeSpan;
pub use evidence::touches::SurfaceContact;
pub use evidence::touches::{TipTouch, TouchFinder, TouchFinderParams};
pub use field::lattice::PatchFace;
pub use field::lattice::Square;
pub use field::lattice::{Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, Owner, VertexKey};
pub use field::piecewise::FieldParams;
pub use incremental::delta::PatchDelta;
pub use incremental::delta::PatchVertex;
pub(crate) use incremental::history::History;
pub use incremental::patcher::{PatchParams, Patcher, PatcherParams};
