//! Room for the search for faces inside the tip.

use crate::mesh::{BoxQuery, FaceId};

/// Faces looked at for them, at most: on a scan finer than a tenth of the ball they are a sample.
pub(super) const MOST_LOOKED_AT: usize = 128;

/// Room for the search for faces inside the tip.
#[derive(Clone, Debug, Default)]
pub(super) struct InsideScratch {
    pub near: BoxQuery,
    /// with their depth, m
    pub deep: Vec<(f64, FaceId)>,
}

impl InsideScratch {
    pub fn new() -> Self {
        Self { near: BoxQuery::with_room(4 * MOST_LOOKED_AT), deep: Vec::with_capacity(MOST_LOOKED_AT) }
    }
}
