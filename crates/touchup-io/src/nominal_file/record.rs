//! One characteristic of a drawing.

use serde::{Deserialize, Serialize};

use touchup_features::conformity::ToleranceLimits;
use touchup_features::features::{FeatureKind, InspectedQuantity};

/// A nominal value and its tolerance; lengths in mm, angles in degrees, in the frame of the mesh.
/// Unstated values are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NominalRecord {
    /// unique name in the report
    pub name: String,
    /// of the feature: `hole`, `slot`, `pocket`, `boss`, `edge`, `corner`, `plane`, `cylinder`,
    /// `notch`, `sphere`
    pub kind: String,
    /// inspected quantity, with its unit, such as `diameter_mm`
    pub quantity: String,
    /// nominal value of a length; 0 for a zone
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_mm: Option<f64>,
    /// nominal value of an angle
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_deg: Option<f64>,
    /// tolerance ± about the nominal value; for a zone its width or diameter
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance_mm: Option<f64>,
    /// tolerance ± of an angle
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance_deg: Option<f64>,
    /// lower limit deviation from the nominal value, mostly negative, in place of a tolerance ±;
    /// without the upper one a single limit
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower_deviation_mm: Option<f64>,
    /// upper limit deviation
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper_deviation_mm: Option<f64>,
    /// lower limit deviation of an angle
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower_deviation_deg: Option<f64>,
    /// upper limit deviation of an angle
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper_deviation_deg: Option<f64>,
    /// nominal centre of the feature, which identifies it
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_mm: Option<[f64; 3]>,
    /// nominal axis, for a plane its outward normal, of any length: it and the centre align drawing
    /// and part
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// its `id` in the file of features, in place of the centre
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub feature: Option<u32>,
    /// datum feature
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub datum: Option<DatumRecord>,
}

/// The datum of a relation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatumRecord {
    /// of the feature
    pub kind: String,
    /// its nominal centre
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_mm: Option<[f64; 3]>,
    /// its `id`, in place of the centre
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub feature: Option<u32>,
}

/// Tolerance of a characteristic in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NominalTolerance {
    /// limits of the characteristic itself, mm or degrees
    Limits(ToleranceLimits),
    /// none: a general tolerance applies
    General,
}

impl NominalRecord {
    /// The quantity, after the check.
    pub fn quantity(&self) -> Option<InspectedQuantity> {
        InspectedQuantity::of_name(&self.quantity)
    }

    /// The kind of the feature, after the check.
    pub fn kind(&self) -> Option<FeatureKind> {
        FeatureKind::of_name(&self.kind)
    }

    /// Nominal value, mm or degrees; 0 for a zone.
    pub fn nominal(&self) -> f64 {
        self.nominal_mm.or(self.nominal_deg).unwrap_or(0.0)
    }

    /// Its limits, in the unit of the quantity.
    pub fn tolerance(&self) -> NominalTolerance {
        let nominal = self.nominal();
        let is_zone = self.quantity().is_some_and(InspectedQuantity::is_zone);
        let lower = self.lower_deviation_mm.or(self.lower_deviation_deg);
        let upper = self.upper_deviation_mm.or(self.upper_deviation_deg);
        match (self.tolerance_mm.or(self.tolerance_deg), lower, upper) {
            (Some(width), ..) if is_zone => NominalTolerance::Limits(ToleranceLimits {
                lower: None,
                upper: Some(width),
            }),
            (Some(half), ..) => {
                NominalTolerance::Limits(ToleranceLimits::about(nominal, Some(-half), Some(half)))
            }
            (None, None, None) => NominalTolerance::General,
            (None, lower, upper) => {
                NominalTolerance::Limits(ToleranceLimits::about(nominal, lower, upper))
            }
        }
    }

    /// Whether both belong to the same feature: its kind, and its place or number.
    pub fn is_of_the_same_feature(&self, other: &Self) -> bool {
        self.kind == other.kind
            && self.feature == other.feature
            && self.center_mm == other.center_mm
    }

    /// Whether both are the same characteristic of the same feature.
    pub(super) fn is_the_same_as(&self, other: &Self) -> bool {
        self.is_of_the_same_feature(other)
            && self.quantity == other.quantity
            && self.datum == other.datum
    }

    /// The fault, and the remedy.
    pub(super) fn check(&self) -> Result<(), String> {
        let Self {
            name,
            kind,
            quantity,
            ..
        } = self;
        if name.trim().is_empty() {
            return Err("it has no name: give one in the column name".to_owned());
        }
        check_kind(name, kind)?;
        let Some(quantity) = InspectedQuantity::of_name(quantity) else {
            return Err(format!(
                "{name}: there is no quantity {quantity:?}: take one of {}",
                InspectedQuantity::ALL
                    .map(InspectedQuantity::name)
                    .join(", ")
            ));
        };
        if !self.kind().is_some_and(|kind| quantity.is_of(kind)) {
            let others = InspectedQuantity::ALL
                .into_iter()
                .filter(|other| self.kind().is_some_and(|kind| other.is_of(kind)));
            let others = others
                .map(InspectedQuantity::name)
                .collect::<Vec<_>>()
                .join(", ");
            return Err(format!(
                "{name}: a {kind} has no {quantity}: take one of {others}"
            ));
        }
        self.check_units(quantity)?;
        self.check_limits(quantity)?;
        if quantity == InspectedQuantity::Position && self.center_mm.is_none() {
            return Err(format!(
                "{name}: {quantity} needs the nominal centre: fill in center_x_mm, center_y_mm and center_z_mm"
            ));
        }
        match &self.datum {
            Some(_) if !quantity.needs_datum() => Err(format!(
                "{name}: {quantity} has no datum: leave the columns of the datum empty"
            )),
            Some(datum) => check_kind(name, &datum.kind),
            None if quantity.needs_datum() => Err(format!(
                "{name}: {quantity} needs a datum: fill in datum_kind, and its centre or its number"
            )),
            None => Ok(()),
        }
    }

    fn check_units(&self, quantity: InspectedQuantity) -> Result<(), String> {
        let of_mm = [
            ("nominal", self.nominal_mm),
            ("tolerance", self.tolerance_mm),
            ("lower_deviation", self.lower_deviation_mm),
            ("upper_deviation", self.upper_deviation_mm),
        ];
        let of_deg = [
            ("nominal", self.nominal_deg),
            ("tolerance", self.tolerance_deg),
            ("lower_deviation", self.lower_deviation_deg),
            ("upper_deviation", self.upper_deviation_deg),
        ];
        let name = &self.name;
        let (other, wrong) = if quantity.unit() == "mm" {
            (of_deg, "deg")
        } else {
            (of_mm, "mm")
        };
        if let Some((column, _)) = other.iter().find(|(_, number)| number.is_some()) {
            let unit = quantity.unit();
            return Err(format!(
                "{name}: {quantity} is in {unit}: put the number into {column}_{unit} and leave {column}_{wrong} empty"
            ));
        }
        let numbers = of_mm
            .iter()
            .chain(&of_deg)
            .filter_map(|(_, number)| *number);
        let places = [
            self.center_mm,
            self.axis,
            self.datum.as_ref().and_then(|datum| datum.center_mm),
        ];
        match numbers
            .chain(places.into_iter().flatten().flatten())
            .find(|number| !number.is_finite())
        {
            Some(number) => Err(format!("{name}: {number} is no finite number")),
            None if self.axis == Some([0.0; 3]) => Err(format!(
                "{name}: axis_x, axis_y, axis_z are 0: leave them empty"
            )),
            None => Ok(()),
        }
    }

    fn check_limits(&self, quantity: InspectedQuantity) -> Result<(), String> {
        let (name, unit) = (&self.name, quantity.unit());
        let nominal = self.nominal_mm.or(self.nominal_deg);
        if !quantity.is_zone() && nominal.is_none() {
            return Err(format!(
                "{name}: {quantity} needs a nominal value: fill in nominal_{unit}"
            ));
        }
        if quantity.is_zone() && nominal.is_some_and(|nominal| nominal != 0.0) {
            return Err(format!(
                "{name}: the nominal value of {quantity} is 0: leave nominal_{unit} empty"
            ));
        }
        let tolerance = self.tolerance_mm.or(self.tolerance_deg);
        let lower = self.lower_deviation_mm.or(self.lower_deviation_deg);
        let upper = self.upper_deviation_mm.or(self.upper_deviation_deg);
        if tolerance.is_some_and(|tolerance| tolerance <= 0.0) {
            return Err(format!("{name}: tolerance_{unit} must be above 0"));
        }
        if tolerance.is_some() && (lower.is_some() || upper.is_some()) {
            return Err(format!(
                "{name}: give tolerance_{unit}, or limit deviations, not both"
            ));
        }
        match (lower, upper) {
            (Some(_), _) if quantity.is_zone() => Err(format!(
                "{name}: {quantity} cannot be below 0: leave lower_deviation_{unit} empty"
            )),
            (_, Some(upper)) if quantity.is_zone() && upper <= 0.0 => Err(format!(
                "{name}: upper_deviation_{unit} must be above 0, it is the width of the zone"
            )),
            (Some(lower), Some(upper)) if lower >= upper => Err(format!(
                "{name}: lower_deviation_{unit} {lower} is not below upper_deviation_{unit} {upper}: exchange them"
            )),
            _ => Ok(()),
        }
    }
}

impl DatumRecord {
    /// The kind of the feature, after the check.
    pub fn kind(&self) -> Option<FeatureKind> {
        FeatureKind::of_name(&self.kind)
    }
}

fn check_kind(name: &str, kind: &str) -> Result<(), String> {
    let kinds = || FeatureKind::ALL.map(FeatureKind::name).join(", ");
    FeatureKind::of_name(kind)
        .map(drop)
        .ok_or_else(|| format!("{name}: there is no kind {kind:?}: take one of {}", kinds()))
}
