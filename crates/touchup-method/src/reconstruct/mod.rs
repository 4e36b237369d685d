//! The touched surface remeshed as one closed skin by construction.
//!
//! [`TouchFinder`] makes touches of samples; [`ContactMap`] and `FreeSpace` keep contacts and free
//! space. `Evidence` combines these and the scan at a point; the nodes of a regular [`Lattice`]
//! store the field, with a harmonic fill between the evidence. Where analytic surfaces are known to
//! explain the touches ([`KnownSurface`]), the field is theirs. [`Patcher`] runs the whole pipeline:
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
mod evidence_changes;
mod field;
mod history;
mod incremental;
mod lattice;
mod model;
mod support;
mod table;

pub use cloud_surface::{CloudError, CloudSummary, CloudSurface, NormalSource, surface_of_cloud};
pub use contour::crossing::Crossing;
pub use contour::dual_contouring::contour;
pub use contour::patched::{OpenSquare, Patch, PatchedMesh};
pub use contour::scan_clipping::Cut;
pub use evidence::contact_map::{ContactMap, MeanContact};
pub use evidence::contact_uncertainty::{CalibrationParams, ContactSigma, UncertaintyParams};
pub use evidence::outliers::{Outlier, Outliers};
pub use evidence::piecewise::FieldParams;
pub use evidence::point_evidence::EvidenceParams;
pub use evidence::stroke_log::StrokeSpan;
pub use evidence::touches::{SurfaceContact, TipTouch, TouchFinder, TouchFinderParams};
pub(crate) use history::History;
pub use incremental::delta::{PatchDelta, PatchVertex};
pub use incremental::patcher::{PatchParams, Patcher, PatcherParams};
pub use incremental::splice::Splice;
pub use lattice::{
    Edge, Lattice, LatticeNode, LatticeRegion, NodeValues, Owner, PatchFace, Square, VertexKey,
};
pub use model::{KnownSurface, KnownSurfaceError, KnownSurfaces};
pub use support::Support;
