//! The evidence behind each vertex.

/// The evidence for a vertex, in the order of its numbers in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Support {
    /// the scan
    #[default]
    Scan,
    /// touches
    Touched,
    /// suggested by touches, free space and scan nearby; not touched itself
    Guessed,
    /// as guessed, and out of reach: the ball does not enter an inner corner, or a narrower gap,
    /// that far
    Unreachable,
}
