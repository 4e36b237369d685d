//! A surface that touches show.

use crate::features::segmentation::primitive::Primitive;
use crate::features::segmentation::segment::FeltPlace;

/// A surface, and the touches that it explains.
pub(crate) struct TouchedSurface {
    pub primitive: Primitive,
    /// by the numbers of their touches
    pub felt: Vec<FeltPlace>,
}
