//! Files of features, JSON: lengths in mm, angles in degrees, in the frame of the mesh.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::file_error::{FileError, read_file, write_file};
use touchup_core::features::clusters::{Bend, Cluster};
use touchup_core::features::{Feature, Measured};

/// Why a file of features could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FeaturesFileError {
    /// It could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// It is no file of features.
    #[error("{} is no file of features: {source}", path.display())]
    NoFeatures {
        /// the file
        path: PathBuf,
        /// why, with line and column
        source: serde_json::Error,
    },
}

/// A whole file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FeatureFile {
    /// in order of `id`
    pub features: Vec<FeatureRecord>,
    /// share of the mesh's area that belongs to no plane, cylinder or cone and is not searched
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unexplained: Option<f64>,
    /// places of high curvature, the paper's method for features; there only in that mode
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clusters: Vec<ClusterRecord>,
}

reported! {
    /// Vertices of high curvature that belong together.
    #[derive(Clone, Deserialize)]
    pub struct ClusterRecord, fn of(cluster: &Cluster) {
        /// their middle
        pub center_mm: [f64; 3] = point_mm(&cluster.center),
        /// how many
        pub vertices: usize = cluster.vertices.len(),
        /// whether they bend outward, as the rim of a hole; left out where the number of clusters was given
        pub convex?: bool = cluster.bend.map(|bend| bend == Bend::Convex),
    }
}

reported! {
    /// One feature; what does not apply to its kind, or is not known, is left out.
    #[derive(Clone, Deserialize)]
    pub struct FeatureRecord, pub fn of(feature: &Feature) {
        /// stays the same while the feature is refined
        #[serde(default)]
        pub id: u32 = feature.id,
        /// `hole`, `slot`, `pocket`, `boss`, `edge`, `corner` or `plane`
        pub kind: String = feature.kind.name().to_owned(),
        /// hole, slot, pocket: where the axis goes through the opening; boss: middle of its foot; edge, plane: its middle;
        /// corner: itself
        pub center_mm?: [f64; 3] = Some(point_mm(&feature.centre.value)),
        /// hole, slot, pocket: out of the opening; boss: away from its foot; edge: along it; plane: outward normal. Unit vector
        pub axis?: [f64; 3] = feature.axis.as_ref().map(|axis| axis.value.into()),
        /// hole, boss
        pub diameter_mm?: f64 = times(&feature.diameter, 1e3),
        /// slot: over its ends, of an open one as far as its walls go; pocket; edge: as far as it was seen
        pub length_mm?: f64 = times(&feature.length, 1e3),
        /// slot, pocket
        pub width_mm?: f64 = times(&feature.width, 1e3),
        /// hole, slot, pocket: from opening to floor, of one that goes through as far as its wall goes (of a drilled hole
        /// without the tip; of a round opening in a sheet left out, as is `through`); boss: its height. Where the wall was touched
        /// and floor or top was not, as far as that was: see `depth_is_at_least`
        pub depth_mm?: f64 = times(&feature.depth, 1e3),
        /// whether `depth_mm` is a lower bound; left out where it is none
        pub depth_is_at_least?: bool = feature.depth.as_ref().filter(|depth| depth.is_at_least).map(|_| true),
        /// hole, slot, pocket; left out where the mesh ends before the hole does, or its floor is untouched
        pub through?: bool = feature.through,
        /// hole: full angle of its countersink
        pub cone_angle_deg?: f64 = times(&feature.cone_angle, 1f64.to_degrees()),
        /// slot, pocket: along it, unit vector
        pub direction?: [f64; 3] = feature.direction.map(Into::into),
        /// holes with the same number are steps of one
        pub group?: u32 = feature.group,
        /// edge, slot, pocket: both ends
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub points_mm: Vec<[f64; 3]> = feature.points.iter().map(point_mm).collect(),
        /// edge: whether the material is inside of it
        pub convex?: bool = feature.is_convex,
        /// standard uncertainties by name of the number: `center_mm` (across the axis, of a plane along its normal, of a corner
        /// in space), `axis_deg`, `diameter_mm`, `length_mm`, `width_mm`, `depth_mm`, `cone_angle_deg`
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub std: BTreeMap<String, f64> =
            known(feature).filter_map(|(name, std, _)| Some((name.to_owned(), std?))).collect(),
        /// share of its surface within a ball's radius of a touch
        #[serde(default)]
        pub touched: f64 = feature.touched,
        /// `touches`, or `mesh` where too little was touched
        #[serde(default)]
        pub fitted_to: String = feature.fitted_to.name().to_owned(),
        /// the touches behind each number, by its name: runs of numbers in the file of touches, first and last
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
    fn note<'a, T>(name: &'static str, measured: &'a Measured<T>, unit: f64) -> KnownNumber<'a> {
        (name, measured.std.map(|std| std * unit), &measured.touches)
    }
    let numbers = [
        ("diameter_mm", &feature.diameter, 1e3),
        ("length_mm", &feature.length, 1e3),
        ("width_mm", &feature.width, 1e3),
        ("depth_mm", &feature.depth, 1e3),
        ("cone_angle_deg", &feature.cone_angle, 1f64.to_degrees()),
    ];
    let centre = note("center_mm", &feature.centre, 1e3);
    let axis = feature.axis.as_ref().map(|axis| note("axis_deg", axis, 1f64.to_degrees()));
    let numbers = numbers.into_iter().filter_map(|(name, number, unit)| Some(note(name, number.as_ref()?, unit)));
    [centre].into_iter().chain(axis).chain(numbers)
}

fn times(measured: &Option<Measured<f64>>, unit: f64) -> Option<f64> {
    measured.as_ref().map(|measured| measured.value * unit)
}

fn point_mm(p: &Point3<f64>) -> [f64; 3] {
    (p * 1e3).coords.into()
}

/// Numbers in ascending order as runs, first and last.
fn runs(numbers: &[u32]) -> Vec<[u32; 2]> {
    numbers.chunk_by(|a, b| a + 1 == *b).map(|run| [run[0], run[run.len() - 1]]).collect()
}

impl FeatureFile {
    /// The features as a file has them.
    pub fn of(features: &[Feature], unexplained: f64) -> Self {
        let features = features.iter().map(FeatureRecord::of).collect();
        Self { features, unexplained: Some(unexplained), clusters: Vec::new() }
    }

    /// Clusters alone.
    pub fn of_clusters(clusters: &[Cluster]) -> Self {
        Self { clusters: clusters.iter().map(ClusterRecord::of).collect(), ..Self::default() }
    }
}

/// Writes features, as a whole or not at all.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_features(path: &Path, file: &FeatureFile) -> Result<(), FeaturesFileError> {
    let text = serde_json::to_string_pretty(file).expect("finite numbers and names alone cannot fail");
    Ok(write_file(path, |out| writeln!(out, "{text}"))?)
}

/// Reads features.
///
/// # Errors
/// [`FeaturesFileError`].
pub fn read_features(path: &Path) -> Result<FeatureFile, FeaturesFileError> {
    let text = read_file(path)?;
    serde_json::from_slice(&text).map_err(|source| FeaturesFileError::NoFeatures { path: path.to_owned(), source })
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
