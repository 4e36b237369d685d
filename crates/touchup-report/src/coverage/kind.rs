//! Kinds of numbers with a stated uncertainty.

use touchup_method::names;

names! {
    /// Kind of a stated number.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum CoverageKind {
        /// touched, farther than 1 mm from every sharp edge of the true part
        PlaneVertex = "vertex, plane",
        /// touched, within 1 mm of a sharp edge other than a rim
        EdgeVertex = "vertex, edge",
        /// touched, within 1 mm of the opening of a hole or slot
        RimVertex = "vertex, rim",
        /// untouched, but interpolated from touches nearby
        InterpolatedVertex = "vertex, interpolated",
        /// across the axis, each direction
        HolePosition = "hole position",
        /// diameter of its wall
        HoleDiameter = "hole diameter",
        /// depth of a blind hole, from opening to floor
        HoleDepth = "hole depth",
        /// across the axis of the opening, each direction
        SlotPosition = "slot position",
        /// distance between its walls
        SlotWidth = "slot width",
        /// over its rounded ends
        SlotLength = "slot length",
        /// from opening to floor
        SlotDepth = "slot depth",
        /// across the axis, each direction
        BossPosition = "boss position",
        /// diameter of its wall
        BossDiameter = "boss diameter",
        /// from foot to top
        BossHeight = "boss height",
        /// along its normal
        PlanePosition = "plane position",
        /// across it, each direction
        EdgePosition = "edge position",
        /// numbers of features fitted to the mesh for lack of touches
        OfMesh = "feature fitted to the mesh",
    }
}

impl CoverageKind {
    /// Whether the kind concerns vertices.
    pub fn is_of_vertices(self) -> bool {
        matches!(
            self,
            Self::PlaneVertex | Self::EdgeVertex | Self::RimVertex | Self::InterpolatedVertex
        )
    }

    /// Demanded share of numbers within 1.96 standard deviations; `None`: the criterion is their
    /// root mean square.
    pub fn least_within(self) -> Option<f64> {
        match self {
            Self::EdgeVertex | Self::RimVertex => Some(0.90),
            _ if self.is_of_vertices() => Some(0.93),
            _ => None,
        }
    }
}
