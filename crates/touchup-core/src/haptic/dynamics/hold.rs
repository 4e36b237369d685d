//! One face held against one sample, and what the position flow did to it.

/// One face held against one sample, seen along the direction a in which the face may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// h at the start, m
    pub h: f64,
    /// dh/dt that does not come from the motion of the face, m/s
    pub drift: f64,
    /// a · n
    pub cosine: f64,
    /// F · n, N
    pub force: f64,
    /// α, m/(N·s)
    pub alpha: f64,
    /// s
    pub dt: f64,
}

/// What one position flow did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    /// s = α ∫ (F·n − f) dt, m, along a
    pub displacement: f64,
    /// J = ∫ f dt, N·s
    pub impulse: f64,
}
