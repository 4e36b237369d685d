/// Errors of the simulation's parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A parameter outside its range.
    #[error("{name} is {value:?} {unit}, but must be {allowed}")]
    BadParameter {
        /// name of the parameter
        name: &'static str,
        /// given value
        value: f64,
        /// its unit
        unit: &'static str,
        /// the range
        allowed: &'static str,
    },
    /// The path does not start in the open.
    #[error(
        "the path starts {clearance_m} m from the part, less than the {radius_m} m of the tip around it: start higher"
    )]
    StartsInside {
        /// m, from the surface to the start
        clearance_m: f64,
        /// m
        radius_m: f64,
    },
    /// The start is out of the arm's reach.
    #[error("the arm does not reach its start: bring the part nearer, or take a longer arm")]
    OutOfReach,
    /// An impossible tip.
    #[error(transparent)]
    Tip(#[from] touchup_method::stylus::SettingError),
    /// The path is empty.
    #[error("the path has no point: give at least one stroke with two points")]
    EmptyPath,
    /// The scan exceeds the cell limit.
    #[error(
        "the part is {size_m:.3e} m long, with {margin_m:.3e} m around it for noise, bias and rounding: at edges of \
         {edge_m:.3e} m that is more than {limit} cells; use {}",
        if margin_m > size_m { "less of these three" } else { "longer edges" }
    )]
    TooFine {
        /// longest side of the part, m
        size_m: f64,
        /// added on every side, m
        margin_m: f64,
        /// m
        edge_m: f64,
        /// maximum number of cells
        limit: usize,
    },
    /// The scan's triangles are too large to leave any.
    #[error(
        "edges of {edge_m:?} m leave nothing of a part that is {size_m:.3e} m long: use shorter ones"
    )]
    TooCoarse {
        /// longest side of the part, m
        size_m: f64,
        /// m
        edge_m: f64,
    },
    /// No surface in the part's bounds, or no visible one.
    #[error(
        "the scanner sees nothing of the part: check the view direction and the size of the holes it closes"
    )]
    NothingSeen,
    /// The simulated scan is not a mesh.
    #[error(transparent)]
    Mesh(#[from] touchup_geometry::mesh::MeshError),
}

/// Refuses values that are not finite or not above zero.
pub(super) fn positive(name: &'static str, value: f64, unit: &'static str) -> Result<(), SimError> {
    require(
        value.is_finite() && value > 0.0,
        name,
        value,
        unit,
        "greater than zero",
    )
}

/// Refuses values that are not finite or below zero.
pub(super) fn not_negative(
    name: &'static str,
    value: f64,
    unit: &'static str,
) -> Result<(), SimError> {
    require(
        value.is_finite() && value >= 0.0,
        name,
        value,
        unit,
        "zero or more",
    )
}

/// Refuses values that are not finite, below zero or beyond `largest`, which `allowed` names.
pub(super) fn up_to(
    name: &'static str,
    value: f64,
    unit: &'static str,
    largest: f64,
    allowed: &'static str,
) -> Result<(), SimError> {
    require((0.0..=largest).contains(&value), name, value, unit, allowed)
}

/// Refuses a value unless `is_allowed`.
pub(super) fn require(
    is_allowed: bool,
    name: &'static str,
    value: f64,
    unit: &'static str,
    allowed: &'static str,
) -> Result<(), SimError> {
    if is_allowed {
        Ok(())
    } else {
        Err(SimError::BadParameter {
            name,
            value,
            unit,
            allowed,
        })
    }
}
