//! Features files, JSON: lengths in mm, angles in degrees, in the mesh frame.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::de::{Deserializer, Error as _};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::file_error::{FileError, read_file, write_file};
use touchup_features::conformity::MeasuredNumber;
use touchup_features::features::{Bend, Cluster};
use touchup_features::features::{
    Feature, Form, InspectedQuantity, MeasuredValue, Relation, relations,
};
use touchup_geometry::form::Deviation;

/// Error of reading or writing a features file.
#[derive(Debug, thiserror::Error)]
pub enum FeaturesFileError {
    /// The file is unreadable or unwritable.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is no features file.
    #[error("{} is no file of features: {source}", path.display())]
    NoFeatures {
        /// path of the file
        path: PathBuf,
        /// cause, with line and column
        source: serde_json::Error,
    },
}

/// A whole file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FeatureFile {
    /// in order of `id`
    pub features: Vec<FeatureRecord>,
    /// relations between touched features
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub relations: Vec<RelationRecord>,
    /// share of the mesh's area that belongs to no plane, cylinder or cone and is not searched
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unexplained: Option<f64>,
    /// places of high curvature, the paper's method for features; only in that mode
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clusters: Vec<ClusterRecord>,
}

reported! {
    /// Vertices of high curvature that belong together.
    #[derive(Clone, Deserialize)]
    pub struct ClusterRecord, fn of(cluster: &Cluster) {
        /// their middle
        pub center_mm: [f64; 3] = point_mm(&cluster.center),
        /// number of vertices
        pub vertices: usize = cluster.vertices.len(),
        /// whether they bend outward, as the rim of a hole; absent if the number of clusters was
        /// given
        pub convex?: bool = cluster.bend.map(|bend| bend == Bend::Convex),
    }
}

reported! {
    /// Deviation of a touched surface from its ideal form: widths of the narrowest zones (ISO 1101)
    /// over its touched part. 0 if nothing stands out of the noise: then `std` is the amount that
    /// noise may hide.
    #[derive(Clone, Deserialize)]
    pub struct FormRecord, fn of(form: &Form) {
        /// round walls: `roundness_mm` of the mean section, `cylindricity_mm` for touches at
        /// several heights, `straightness_mm` for touches at three heights all around (diameter of
        /// the cylinder that holds the axis); planes: `flatness_mm`
        #[serde(flatten, deserialize_with = "known_numbers")]
        pub numbers: NumbersByQuantity = form
            .deviations()
            .map(|(quantity, deviation)| (quantity, quantity.from_si(deviation.minimum_zone.value)))
            .collect(),
        /// the same numbers about the least-squares reference
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub least_squares: BTreeMap<String, f64> = estimates(form, |deviation| deviation.least_squares.value),
        /// standard uncertainties by name of the number
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub std: BTreeMap<String, f64> = estimates(form, |deviation| deviation.minimum_zone.std),
        /// share of the turn, or of the rectangle around the touches, that they cover: the form of
        /// the rest is unknown
        #[serde(default)]
        pub coverage: f64 = form.coverage(),
        /// round walls: largest number of undulations per turn in the search
        pub undulations?: u32 = form.round().map(|round| round.undulations),
        /// round walls: undulations per turn of the lobes found
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub lobes: Vec<u32> = form.round().map_or_else(Vec::new, |round| round.lobes.clone()),
    }
}

fn estimates(form: &Form, number: impl Fn(Deviation) -> f64) -> BTreeMap<String, f64> {
    form.deviations()
        .map(|(quantity, deviation)| {
            (
                quantity.name().to_owned(),
                quantity.from_si(number(deviation)),
            )
        })
        .collect()
}

/// Numbers by their quantities, mm and degrees.
type NumbersByQuantity = BTreeMap<InspectedQuantity, f64>;

/// Ignores keys of other names.
fn known_numbers<'de, D: Deserializer<'de>>(object: D) -> Result<NumbersByQuantity, D::Error> {
    BTreeMap::<String, Option<Value>>::deserialize(object)?
        .into_iter()
        .filter_map(|(name, value)| Some((InspectedQuantity::of_name(&name)?, value?)))
        .map(|(quantity, value)| Ok((quantity, f64::deserialize(value).map_err(D::Error::custom)?)))
        .collect()
}

/// A number of a record with its standard uncertainty.
fn with_std(
    value: Option<f64>,
    std: &BTreeMap<String, f64>,
    quantity: InspectedQuantity,
) -> Option<MeasuredNumber> {
    let std = std.get(quantity.name()).copied();
    Some(MeasuredNumber::new(value?, std))
}

impl FormRecord {
    /// A deviation, mm.
    pub fn number(&self, quantity: InspectedQuantity) -> Option<MeasuredNumber> {
        with_std(self.numbers.get(&quantity).copied(), &self.std, quantity)
    }
}

reported! {
    /// Relation of one touched feature to another, without inapplicable keys.
    #[derive(Clone, Deserialize)]
    pub struct RelationRecord, fn of(relation: &Relation) {
        /// `perpendicularity`, `parallelism`, `coaxiality` or `distance`
        pub kind: String = relation.kind.name().to_owned(),
        /// `id` of the toleranced feature, whose extent counts
        pub of: u32 = relation.of,
        /// `id` of the datum
        pub to: u32 = relation.to,
        /// - `perpendicularity_mm`: width of the zone between parallel planes, of an axis square to a
        ///   plane diameter of the cylinder
        /// - `parallelism_mm`: width of the zone between parallel planes, of an axis diameter of the
        ///   cylinder
        /// - `coaxiality_mm`: diameter of the cylinder about the axis of the datum that holds the axis
        /// - `concentricity_mm`: diameter of the circle about the axis of the datum that holds the
        ///   middle of the axis
        /// - `distance_mm`: of the middle of the touched part from the datum
        /// - `angle_deg`: between normals, axes, or an axis and a plane, 0 to 90
        #[serde(flatten, deserialize_with = "known_numbers")]
        pub numbers: NumbersByQuantity = relation
            .numbers()
            .map(|(quantity, estimate)| (quantity, quantity.from_si(estimate.value)))
            .collect(),
        /// standard uncertainties by name of the number
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub std: BTreeMap<String, f64> = relation
            .numbers()
            .map(|(quantity, estimate)| (quantity.name().to_owned(), quantity.from_si(estimate.std)))
            .collect(),
    }
}

impl RelationRecord {
    /// A number of the relation, mm or degrees.
    pub fn number(&self, quantity: InspectedQuantity) -> Option<MeasuredNumber> {
        with_std(self.numbers.get(&quantity).copied(), &self.std, quantity)
    }
}

reported! {
    /// One feature, without inapplicable or unknown keys.
    #[derive(Clone, Deserialize)]
    pub struct FeatureRecord, pub fn of(feature: &Feature) {
        /// constant during refinement of the feature
        #[serde(default)]
        pub id: u32 = feature.id,
        /// `hole`, `slot`, `pocket`, `boss`, `edge`, `corner` or `plane`
        pub kind: String = feature.kind.name().to_owned(),
        /// hole, slot, pocket: axis point in the opening; boss: middle of its foot; edge,
        /// plane: its middle; corner: itself
        pub center_mm?: [f64; 3] = Some(point_mm(&feature.centre.value)),
        /// hole, slot, pocket: out of the opening; boss: away from its foot; edge: along it; plane:
        /// outward normal. Unit vector
        pub axis?: [f64; 3] = feature.axis.as_ref().map(|axis| axis.value.into()),
        /// hole, boss
        pub diameter_mm?: f64 = size(feature, InspectedQuantity::Diameter),
        /// slot: over its ends, or the extent of its walls if open; pocket; edge: its visible
        /// extent
        pub length_mm?: f64 = size(feature, InspectedQuantity::Length),
        /// slot, pocket
        pub width_mm?: f64 = size(feature, InspectedQuantity::Width),
        /// hole, slot, pocket: from opening to floor, or the extent of the wall of a through
        /// feature (drilled hole: without the tip; round opening in a sheet: absent, like
        /// `through`); boss: its height. Touches on the wall but not on floor or top give their
        /// extent: see `depth_is_at_least`
        pub depth_mm?: f64 = size(feature, InspectedQuantity::Depth),
        /// whether `depth_mm` is a lower bound; absent if not
        pub depth_is_at_least?: bool = feature.depth.as_ref().filter(|depth| depth.is_at_least).map(|_| true),
        /// hole, slot, pocket; absent if the mesh ends before the hole, or if its floor is
        /// untouched
        pub through?: bool = feature.through,
        /// hole: full angle of its countersink
        pub cone_angle_deg?: f64 = size(feature, InspectedQuantity::ConeAngle),
        /// slot, pocket: along it, unit vector
        pub direction?: [f64; 3] = feature.direction.map(Into::into),
        /// shared by the steps of one stepped hole
        pub group?: u32 = feature.group,
        /// edge, slot, pocket: both ends
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub points_mm: Vec<[f64; 3]> = feature.points.iter().map(point_mm).collect(),
        /// edge, sphere: whether the material is inside of it
        pub convex?: bool = feature.is_convex,
        /// standard uncertainties by name of the number: `center_mm` (across the axis, of a plane
        /// along its normal, of a corner or sphere in space), `axis_deg`, `diameter_mm`, `length_mm`,
        /// `width_mm`, `depth_mm`, `cone_angle_deg`
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub std: BTreeMap<String, f64> =
            known(feature).filter_map(|(name, std, _)| Some((name.to_owned(), std?))).collect(),
        /// hole, notch, boss, cylinder, plane: deviation of the touched, or drawn, surface from its
        /// ideal form
        pub form?: FormRecord = feature.form.as_ref().map(FormRecord::of),
        /// hole, notch, boss, cylinder, slot, pocket of a drawing: distance of the middles of its
        /// facets inside the round surface through their corners; absent without facets
        pub facets_mm?: f64 = feature.facets.map(|m| m * 1e3),
        /// share of its surface within a ball's radius of a touch
        #[serde(default)]
        pub touched: f64 = feature.touched,
        /// `touches`, or `mesh` if touches are too few
        #[serde(default)]
        pub fitted_to: String = feature.fitted_to.name().to_owned(),
        /// touches behind each number, by its name: runs of numbers in the touches file, first and
        /// last
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub touches: BTreeMap<String, Vec<[u32; 2]>> = known(feature)
            .filter(|(.., touches)| !touches.is_empty())
            .map(|(name, _, touches)| (name.to_owned(), runs(touches)))
            .collect(),
    }
}

/// Name of a number, its standard uncertainty, and the touches behind it.
type KnownNumber<'a> = (&'static str, Option<f64>, &'a [u32]);

/// The measured numbers of a feature.
fn known(feature: &Feature) -> impl Iterator<Item = KnownNumber<'_>> {
    fn note<'a, T>(
        name: &'static str,
        measured: &'a MeasuredValue<T>,
        unit: f64,
    ) -> KnownNumber<'a> {
        (name, measured.std.map(|std| std * unit), &measured.touches)
    }
    let centre = note("center_mm", &feature.centre, 1e3);
    let axis = feature
        .axis
        .as_ref()
        .map(|axis| note("axis_deg", axis, 1f64.to_degrees()));
    let sizes = feature
        .sizes()
        .map(|(quantity, size)| note(quantity.name(), size, quantity.from_si(1.0)));
    [centre].into_iter().chain(axis).chain(sizes)
}

/// A size, mm or degrees.
fn size(feature: &Feature, quantity: InspectedQuantity) -> Option<f64> {
    Some(quantity.from_si(feature.size(quantity)?.value))
}

impl FeatureRecord {
    /// A size or deviation of form, mm or degrees.
    pub fn number(&self, quantity: InspectedQuantity) -> Option<MeasuredNumber> {
        let value = match quantity {
            InspectedQuantity::Diameter => self.diameter_mm,
            InspectedQuantity::Length => self.length_mm,
            InspectedQuantity::Width => self.width_mm,
            InspectedQuantity::Depth => self.depth_mm,
            InspectedQuantity::ConeAngle => self.cone_angle_deg,
            _ => return self.form.as_ref()?.number(quantity),
        };
        let is_at_least =
            quantity == InspectedQuantity::Depth && self.depth_is_at_least == Some(true);
        Some(MeasuredNumber {
            is_at_least,
            ..with_std(value, &self.std, quantity)?
        })
    }
}

fn point_mm(p: &Point3<f64>) -> [f64; 3] {
    (p * 1e3).coords.into()
}

/// Numbers in ascending order as runs, first and last.
fn runs(numbers: &[u32]) -> Vec<[u32; 2]> {
    numbers
        .chunk_by(|a, b| a + 1 == *b)
        .map(|run| [run[0], run[run.len() - 1]])
        .collect()
}

impl FeatureFile {
    /// Content of a features file.
    pub fn of(features: &[Feature], unexplained: f64) -> Self {
        let relations = relations(features).iter().map(RelationRecord::of).collect();
        let features = features.iter().map(FeatureRecord::of).collect();
        Self {
            features,
            relations,
            unexplained: Some(unexplained),
            clusters: Vec::new(),
        }
    }

    /// Feature by number.
    pub fn feature(&self, id: u32) -> Option<&FeatureRecord> {
        self.features.iter().find(|feature| feature.id == id)
    }

    /// A file of clusters alone.
    pub fn of_clusters(clusters: &[Cluster]) -> Self {
        Self {
            clusters: clusters.iter().map(ClusterRecord::of).collect(),
            ..Self::default()
        }
    }
}

/// Writes features, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_features(path: &Path, file: &FeatureFile) -> Result<(), FileError> {
    let text =
        serde_json::to_string_pretty(file).expect("finite numbers and names alone cannot fail");
    write_file(path, |out| writeln!(out, "{text}"))
}

/// Reads features.
///
/// # Errors
/// [`FeaturesFileError`].
pub fn read_features(path: &Path) -> Result<FeatureFile, FeaturesFileError> {
    let text = read_file(path)?;
    serde_json::from_slice(&text).map_err(|source| FeaturesFileError::NoFeatures {
        path: path.to_owned(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_touches_are_named_by_their_ends() {
        assert_eq!(runs(&[3, 4, 5, 9, 11, 12]), [[3, 5], [9, 9], [11, 12]]);
        assert!(runs(&[]).is_empty());
    }
}
