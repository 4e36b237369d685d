//! Features of a mesh and its touches: holes, slots, pockets, bosses, edges, corners and planes.
//!
//! [`detect`] segments the mesh into planes, cylinders and cones, names the features that they
//! form, and measures each by its touches if there are enough, else by the mesh. [`curvature`] and
//! its [`clusters`] are the paper's method for the places of features.

mod bodies;
mod borders;
pub mod clusters;
mod cones;
mod contact_heads;
mod contact_slots;
mod contact_walls;
mod contacts;
mod creases;
pub mod curvature;
mod detect;
mod elements;
mod facets;
mod feature;
pub mod fit;
mod flats;
mod from_fits;
mod grow;
mod holes;
mod k_means;
mod marks;
mod measure;
mod numbers;
mod observe;
mod primitive;
mod quantity;
mod rays;
mod relations;
mod rims;
mod scene;
mod segment;
mod shafts;
mod slots;
mod track;
mod walls;

pub use detect::{Detection, detect};
pub use feature::{Feature, FeatureKind, FittedTo, Form, MeasuredValue, Walls};
pub use from_fits::End;
pub use k_means::KMeans;
pub use k_means::k_means;
pub use measure::{LEAST_TOUCHES, LEAST_TURN};
pub use quantity::InspectedQuantity;
pub use relations::{Relation, RelationKind, relations};
pub use track::Tracker;
