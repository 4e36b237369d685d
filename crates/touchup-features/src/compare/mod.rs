//! Deviation of a mesh from the true part: point to surface and cloud to cloud, normals, and
//! pictures of them.
//!
//! All distances are in m. A deviation is positive if the mesh lies above the true part and
//! negative if it lies in its material, for points of either shape.

mod cloud;
mod colour;
mod comparison;
mod deviation;
mod disagreement;
mod displacement;
mod extents;
mod lines;
mod normals;
mod picture;
mod sampling;
mod summary;
mod touched;

pub use cloud::cloud_distances;
pub use colour::{Rgb, colour_of, colour_of_class};
pub use comparison::{
    CompareParams, Comparison, IndexedMesh, RegionComparison, Regions, SupportRegion, compare,
};
pub use deviation::{closest_places, deviations};
pub use disagreement::{
    BadTouches, Class, ClassMap, Disagreement, DisagreementRegion, RefinedShape, RegionEvidence,
    RigidOffset, Scanner, VertexBasis, disagreement,
};
pub use displacement::{
    DisplacedFrom, Displacement, displacements_by_vertex, displacements_to_surface, moved_count,
};
pub use extents::UnlikeExtents;
pub use lines::DrawnMesh;
pub use normals::{Tilt, TiltSummary, angle_between, tilts};
pub use picture::{
    PartView, Picture, PictureLabel, PicturePanel, PictureParams, draw_part, draw_picture,
};
pub use sampling::{SampledPoint, sample_surface, surface_area};
pub use summary::{Histogram, Summary};
pub use touched::TouchedRegion;

/// Why two shapes cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompareError {
    /// NaN or infinity.
    #[error("point {point} has a coordinate that is not finite")]
    NotFinite {
        /// index, from 0
        point: usize,
    },
    /// Empty mesh to measure to.
    #[error("the mesh to compare with has no faces")]
    NoFaces,
    /// Empty cloud to measure to.
    #[error("the cloud to compare with has no points")]
    NoPoints,
    /// More points than an index can count.
    #[error("{points} points are more than {most}: take fewer samples")]
    TooManyPoints {
        /// number of points
        points: usize,
        /// maximum number
        most: usize,
    },
}
