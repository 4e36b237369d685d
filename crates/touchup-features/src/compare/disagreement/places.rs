//! Inputs of the comparison, and properties of each place.

use nalgebra::{Point3, Vector3};

use super::edges::SharpEdges;
use crate::compare::IndexedMesh;
use touchup_method::names;

/// The source of a vertex of a refined mesh, as `refine` writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexBasis {
    /// the scan, or inference from touches nearby
    NotTouched,
    /// touches
    Touched,
    /// out of reach of the stylus
    Unreachable,
}

/// A refined mesh.
#[derive(Clone, Copy, Debug)]
pub struct RefinedShape<'a> {
    /// in the frame of the scan
    pub shape: IndexedMesh<'a>,
    /// by vertex slot
    pub known: &'a [VertexBasis],
}

names! {
    /// Class of a place.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Class {
        /// scan and touch agree within the noise of the scan
        Agrees = "agrees",
        /// a disagreement typical of this scanner: its noise, a rounded edge, a closed hole
        ScannerError = "scanner error",
        /// the part has changed since the scan
        ChangedPart = "changed part",
        /// the touch is wrong
        BadTouch = "bad touch",
        /// a change or a scanner error
        Unsure = "unsure",
        /// known from the scan alone
        NeverTouched = "never touched",
        /// out of reach of the ball
        Unreachable = "unreachable",
    }
}

impl Class {
    /// Whether touches measured it.
    pub(super) fn is_touched(self) -> bool {
        !matches!(self, Self::NeverTouched | Self::Unreachable)
    }
}

/// Properties of each vertex of the refined mesh beside its class.
pub(super) struct VertexProperties {
    /// m, by slot
    pub positions: Vec<Point3<f64>>,
    /// distance outside of the scan, m, by slot; without the rigid offset, once known
    pub off: Vec<f64>,
    /// whether it is touched, and the scan is there at all
    pub is_seen: Vec<bool>,
    /// whether a scanner of this resolution sees it at all: no narrow place
    pub is_wide: Vec<bool>,
    /// whether a scanner of this resolution sees it well: no edge near, and no narrow place
    pub is_open: Vec<bool>,
    /// edges that the scanner rounds
    pub edges: SharpEdges,
    /// whether an edge nearby may leave the scan too low, and too high
    pub may_be: Vec<[bool; 2]>,
    /// normals, by slot; zero without a normal
    pub normals: Vec<Vector3<f64>>,
    /// a third of the area of its faces, m²
    pub areas: Vec<f64>,
}

impl VertexProperties {
    /// Indices of places that the scanner sees well.
    pub(crate) fn open(&self) -> Vec<usize> {
        (0..self.off.len()).filter(|&at| self.is_open[at]).collect()
    }
}
