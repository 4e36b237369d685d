//! Kinds of numbers that the program states with an uncertainty.

use touchup_core::names;

names! {
    /// What a stated number is of.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum CoverageKind {
        /// touched, farther than 1 mm from every sharp edge of the true part
        PlaneVertex = "vertex, plane",
        /// touched, within 1 mm of a sharp edge that is no rim
        EdgeVertex = "vertex, edge",
        /// touched, within 1 mm of the opening of a hole or slot
        RimVertex = "vertex, rim",
        /// not touched itself, but guessed from touches nearby
        InterpolatedVertex = "vertex, interpolated",
        /// across the axis, each direction
        HolePosition = "hole position",
        /// of its wall
        HoleDiameter = "hole diameter",
        /// of a blind one, from opening to floor
        HoleDepth = "hole depth",
        /// across the axis of the opening, each direction
        SlotPosition = "slot position",
        /// between its walls
        SlotWidth = "slot width",
        /// over its rounded ends
        SlotLength = "slot length",
        /// from opening to floor
        SlotDepth = "slot depth",
        /// across the axis, each direction
        BossPosition = "boss position",
        /// of its wall
        BossDiameter = "boss diameter",
        /// from foot to top
        BossHeight = "boss height",
        /// along its normal
        PlanePosition = "plane position",
        /// across it, each direction
        EdgePosition = "edge position",
        /// numbers of features that were fitted to the mesh, as too little of them was touched
        OfMesh = "feature fitted to the mesh",
    }
}

impl CoverageKind {
    /// Whether it is of the vertices.
    pub fn is_of_vertices(self) -> bool {
        matches!(
            self,
            Self::PlaneVertex | Self::EdgeVertex | Self::RimVertex | Self::InterpolatedVertex
        )
    }

    /// Demanded share of numbers within 1.96 standard deviations; `None`: their root mean square is
    /// what counts.
    pub fn least_within(self) -> Option<f64> {
        match self {
            Self::EdgeVertex | Self::RimVertex => Some(0.90),
            _ if self.is_of_vertices() => Some(0.93),
            _ => None,
        }
    }
}
