//! The fault of a boundary, and its place.

/// Why parts are no sound boundary. Numbers of elements count from 0 in their lists.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BrepError {
    /// Nothing to bound.
    #[error("no faces: a boundary has one or more")]
    Empty,
    /// A number.
    #[error(
        "{place}: a number is not finite, a direction has no length 1, or a size is out of range"
    )]
    BadNumber {
        /// vertex, edge or face
        place: String,
    },
    /// A reference.
    #[error("{place} uses {used}, which does not exist")]
    Missing {
        /// edge or face
        place: String,
        /// vertex or edge
        used: String,
    },
    /// An edge that is no arc of its curve.
    #[error("edge {edge}: vertex {vertex} is {off} m off its curve, more than {tolerance} m")]
    VertexOffCurve {
        /// the edge
        edge: usize,
        /// its first or last vertex
        vertex: usize,
        /// m
        off: f64,
        /// m
        tolerance: f64,
    },
    /// A line from a point to itself.
    #[error("edge {edge}: a line needs two different vertices")]
    EmptyLine {
        /// the edge
        edge: usize,
    },
    /// A bound outside of its surface.
    #[error(
        "face {face} ({name}): its {bound} is {off} m off its surface, more than {tolerance} m"
    )]
    BoundOffSurface {
        /// the face
        face: usize,
        /// of the face
        name: String,
        /// edge or vertex
        bound: String,
        /// m
        off: f64,
        /// m
        tolerance: f64,
    },
    /// A loop whose edges do not join.
    #[error("face {face} ({name}): loop {at} does not close at edge {edge}")]
    OpenLoop {
        /// the face
        face: usize,
        /// of the face
        name: String,
        /// number of the loop
        at: usize,
        /// the edge that does not begin at the end of the one before it
        edge: usize,
    },
    /// A surface without a bound, or with bounds that enclose no part of it.
    #[error(
        "face {face} ({name}): its loops enclose no part of its surface; seen from outside the \
         outer loop runs counter-clockwise, loops around holes clockwise"
    )]
    Unbounded {
        /// the face
        face: usize,
        /// of the face
        name: String,
    },
    /// More or fewer uses of an edge than a surface has.
    #[error("edge {edge} bounds {count} faces: an edge bounds one, or two")]
    WrongUses {
        /// the edge
        edge: usize,
        /// uses by loops
        count: usize,
    },
    /// Neighbours with opposite outward sides.
    #[error(
        "edge {edge}: both of its faces use it in the same direction: the sense of one is wrong"
    )]
    SameDirection {
        /// the edge
        edge: usize,
    },
}
