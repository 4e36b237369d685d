//! Features of a mesh and its touches: holes, slots, pockets, bosses, spheres, edges, corners and
//! planes.
//!
//! [`detect`] segments the mesh into planes, cylinders, cones and spheres, names the features that they
//! form, and measures each by its touches if there are enough, else by the mesh. [`curvature`] and
//! its [`clusters`] are the paper's method for the places of features.

mod borders;
mod boundary;
mod cones;
mod detect;
mod elements;
mod feature;
pub mod fit;
mod from_fits;
mod holes;
mod measure;
mod numbers;
mod observe;
mod quantity;
mod relations;
mod rims;
mod segmentation;
mod shafts;
mod spheres;
mod surfaces;
mod track;
mod voids;
mod walls;

pub use boundary::PartBoundary;
pub use detect::{Detection, detect, detect_boundary};
pub use feature::{Feature, FeatureKind, FittedTo, Form, MeasuredValue, Walls};
pub use from_fits::End;
pub use measure::{LEAST_TOUCHES, LEAST_TURN};
pub use quantity::InspectedQuantity;
pub use relations::{Relation, RelationKind, relations};
pub use segmentation::clusters::{
    Bend, Cluster, ClusterParams, PaperParams, clusters, paper_clusters,
};
pub use segmentation::curvature::{VertexCurvature, VertexKind, curvature};
pub use segmentation::k_means::{KMeans, k_means};
pub(crate) use segmentation::primitive::Primitive;
pub(crate) use surfaces::touched_surfaces;
pub use track::Tracker;
