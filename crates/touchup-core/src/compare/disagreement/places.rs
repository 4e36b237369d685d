//! What is compared, and what is known of each place of it.

use nalgebra::{Point3, Vector3};

use super::edges::SharpEdges;
use crate::compare::IndexedMesh;
use crate::names;

/// The source of a vertex of a refined mesh, as `refine` writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexBasis {
    /// the scan, or what is near touches suggests
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
    /// What a place is.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Class {
        /// scan and touch agree within the noise of the scan
        Agrees = "agrees",
        /// they do not, and it looks like this scanner: its noise, a rounded edge, a closed hole
        ScannerError = "scanner error",
        /// the part is not what was scanned
        ChangedPart = "changed part",
        /// the touch is wrong
        BadTouch = "bad touch",
        /// may be changed as well as the scanner's error
        Unsure = "unsure",
        /// nothing is known but the scan
        NeverTouched = "never touched",
        /// the ball does not get there
        Unreachable = "unreachable",
    }
}

impl Class {
    /// Whether a touch says something of it.
    pub(super) fn is_touched(self) -> bool {
        !matches!(self, Self::NeverTouched | Self::Unreachable)
    }
}

/// What is known of each vertex of the refined mesh beside its class.
pub(super) struct Places {
    /// m, by slot
    pub positions: Vec<Point3<f64>>,
    /// how far it lies outside of the scan, m, by slot; without the rigid offset, once that is
    /// known
    pub off: Vec<f64>,
    /// whether it was touched, and the scan is there at all
    pub is_seen: Vec<bool>,
    /// whether a scanner of this resolution sees it at all: no narrow place
    pub is_wide: Vec<bool>,
    /// whether a scanner of this resolution sees it well: no edge near, and no narrow place
    pub is_open: Vec<bool>,
    /// edges that the scanner rounds
    pub edges: SharpEdges,
    /// whether one of them near may leave it too low, and too high
    pub may_be: Vec<[bool; 2]>,
    /// normals, by slot; zero where there are none
    pub normals: Vec<Vector3<f64>>,
    /// a third of the faces at it, m²
    pub areas: Vec<f64>,
}

impl Places {
    /// Numbers of those that the scanner sees well.
    pub fn open(&self) -> Vec<usize> {
        (0..self.off.len()).filter(|&at| self.is_open[at]).collect()
    }
}
