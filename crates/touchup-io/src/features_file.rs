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

/// Vertices of high curvature that belong together.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClusterRecord {
    /// their middle
    pub center_mm: [f64; 3],
    /// how many
    pub vertices: usize,
    /// whether they bend outward, as the rim of a hole; left out where the number of clusters was given
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convex: Option<bool>,
}

impl From<&Cluster> for ClusterRecord {
    fn from(cluster: &Cluster) -> Self {
        Self {
            center_mm: point_mm(&cluster.center),
            vertices: cluster.vertices.len(),
            convex: cluster.bend.map(|bend| bend == Bend::Convex),
        }
    }
}

/// One feature; what does not apply to its kind, or is not known, is left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FeatureRecord {
    /// stays the same while the feature is refined
    #[serde(default)]
    pub id: u32,
    /// `hole`, `slot`, `pocket`, `boss`, `edge`, `corner` or `plane`
    pub kind: String,
    /// hole, slot, pocket: where the axis goes through the opening; boss: middle of its foot; edge, plane: its middle;
    /// corner: itself
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_mm: Option<[f64; 3]>,
    /// hole, slot, pocket: out of the opening; boss: away from its foot; edge: along it; plane: outward normal. Unit vector
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// hole, boss
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter_mm: Option<f64>,
    /// slot: over its ends, of an open one as far as its walls go; pocket; edge: as far as it was seen
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_mm: Option<f64>,
    /// slot, pocket
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_mm: Option<f64>,
    /// hole, slot, pocket: from opening to floor, of one that goes through as far as its wall goes (of a drilled hole
    /// without the tip; of a round opening in a sheet left out, as is `through`); boss: its height
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// hole, slot, pocket; left out where the mesh ends before the hole does, or its floor is untouched
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub through: Option<bool>,
    /// hole: full angle of its countersink
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cone_angle_deg: Option<f64>,
    /// slot, pocket: along it, unit vector
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// holes with the same number are steps of one
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<u32>,
    /// edge, slot, pocket: both ends
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points_mm: Vec<[f64; 3]>,
    /// edge: whether the material is inside of it
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convex: Option<bool>,
    /// standard uncertainties by name of the number: `center_mm` (across the axis, of a plane along its normal, of a corner
    /// in space), `axis_deg`, `diameter_mm`, `length_mm`, `width_mm`, `depth_mm`, `cone_angle_deg`
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub std: BTreeMap<String, f64>,
    /// share of its surface within a ball's radius of a touch
    #[serde(default)]
    pub touched: f64,
    /// `touches`, or `mesh` where too little was touched
    #[serde(default)]
    pub fitted_to: String,
    /// the touches behind each number, by its name: runs of numbers in the file of touches, first and last
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub touches: BTreeMap<String, Vec<[u32; 2]>>,
}

impl From<&Feature> for FeatureRecord {
    fn from(feature: &Feature) -> Self {
        let (mut std, mut touches) = (BTreeMap::new(), BTreeMap::new());
        let mut note = |name: &str, sigma: Option<f64>, behind: &[u32], unit: f64| {
            std.extend(sigma.map(|sigma| (name.to_owned(), sigma * unit)));
            if !behind.is_empty() {
                touches.insert(name.to_owned(), runs(behind));
            }
        };
        note("center_mm", feature.centre.std, &feature.centre.touches, 1e3);
        if let Some(axis) = &feature.axis {
            note("axis_deg", axis.std, &axis.touches, 1f64.to_degrees());
        }
        let mut number = |name: &str, measured: &Option<Measured<f64>>, unit: f64| {
            let measured = measured.as_ref()?;
            note(name, measured.std, &measured.touches, unit);
            Some(measured.value * unit)
        };
        Self {
            id: feature.id,
            kind: feature.kind.name().to_owned(),
            center_mm: Some(point_mm(&feature.centre.value)),
            axis: feature.axis.as_ref().map(|axis| axis.value.into()),
            diameter_mm: number("diameter_mm", &feature.diameter, 1e3),
            length_mm: number("length_mm", &feature.length, 1e3),
            width_mm: number("width_mm", &feature.width, 1e3),
            depth_mm: number("depth_mm", &feature.depth, 1e3),
            through: feature.through,
            cone_angle_deg: number("cone_angle_deg", &feature.cone_angle, 1f64.to_degrees()),
            direction: feature.direction.map(Into::into),
            group: feature.group,
            points_mm: feature.points.iter().map(point_mm).collect(),
            convex: feature.is_convex,
            std,
            touched: feature.touched,
            fitted_to: feature.fitted_to.name().to_owned(),
            touches,
        }
    }
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
        let features = features.iter().map(FeatureRecord::from).collect();
        Self { features, unexplained: Some(unexplained), clusters: Vec::new() }
    }

    /// Clusters alone.
    pub fn of_clusters(clusters: &[Cluster]) -> Self {
        Self { clusters: clusters.iter().map(ClusterRecord::from).collect(), ..Self::default() }
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
