//! Changes between two results beyond their uncertainties.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use super::error::SweepError;
use super::record::{JobRecord, read_record};
use super::run::JobOutcome;
use crate::session::ResultFiles;
use crate::threads::Threads;
use touchup_features::compare::{
    CompareError, DisplacedFrom, Displacement, IndexedMesh, angle_between, displacements_by_vertex,
    displacements_to_surface,
};
use touchup_features::features::InspectedQuantity;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_io::features_file::{FeatureRecord, read_features};
use touchup_io::mesh_file::{MeshFile, MeshFileError, read_mesh, read_vertex_columns};

/// Standard deviations in ±: about 95 % of correct measurements lie within.
pub const COVERAGE: f64 = 2.0;

/// Error of comparing two results.
#[derive(Debug, thiserror::Error)]
pub enum WhatIfError {
    /// An unreadable result.
    #[error(transparent)]
    Result(#[from] SweepError),
    /// A failed result.
    #[error("{} has no mesh: its job failed: {why}", path.display())]
    Failed {
        /// the folder
        path: PathBuf,
        /// the error of the job
        why: String,
    },
    /// The results belong to different parts or scans.
    #[error(
        "the two results are of different scans (sha256 {a:.12}… and {b:.12}…): nothing says where one lies on the other"
    )]
    OtherScan {
        /// hash of the first scan
        a: String,
        /// hash of the second scan
        b: String,
    },
    /// A mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// The meshes are not comparable.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

/// A result in its folder.
#[derive(Clone, Debug)]
pub struct JobResult {
    /// dependencies of the result
    pub record: JobRecord,
    /// m, in O
    pub mesh: TriMesh,
    /// standard deviation of each vertex slot, m; `None` if the scene has no uncertainty
    pub sigma: Option<Vec<f64>>,
    /// features of the mesh
    pub features: Vec<FeatureRecord>,
}

impl JobResult {
    /// # Errors
    /// [`WhatIfError`] for a missing or failed result.
    pub fn read(folder: &Path) -> Result<Self, WhatIfError> {
        let record = read_record(folder)?;
        if let Some(why) = JobOutcome::read(folder)?.failed {
            return Err(WhatIfError::Failed {
                path: folder.to_owned(),
                why,
            });
        }
        let path = folder.join(ResultFiles::MESH);
        let MeshFile { mesh, .. } = read_mesh(&path, record.mesh_unit)?;
        let [sigma] = read_vertex_columns(&path, record.mesh_unit, &mesh, ["sigma_mm"])?;
        let sigma = sigma.map(|column| column.into_iter().map(|mm| f64::from(mm) * 1e-3).collect());
        let features = read_features(&folder.join(ResultFiles::FEATURES))
            .map_err(SweepError::from)?
            .features;
        Ok(Self {
            record,
            mesh,
            sigma,
            features,
        })
    }
}

/// The keys with different values in two records, by path; `Null` for a missing key.
pub fn changed_keys(a: &JobRecord, b: &JobRecord) -> BTreeMap<String, [Value; 2]> {
    let [of_a, of_b] = [a, b].map(|record| {
        let mut keys = BTreeMap::new();
        flatten("", &record.scene, &mut keys);
        keys
    });
    let names: BTreeSet<&String> = of_a.keys().chain(of_b.keys()).collect();
    let value =
        |keys: &BTreeMap<String, Value>, name: &str| keys.get(name).cloned().unwrap_or_default();
    let pairs = names
        .into_iter()
        .map(|name| (name.clone(), [value(&of_a, name), value(&of_b, name)]));
    let mut changed: BTreeMap<_, _> = pairs.filter(|(_, [a, b])| a != b).collect();
    if a.recording_sha256 != b.recording_sha256 {
        let short =
            |record: &JobRecord| Value::from(format!("sha256 {:.12}…", record.recording_sha256));
        changed.insert("recording".to_owned(), [short(a), short(b)]);
    }
    if a.touchup != b.touchup {
        changed.insert(
            "touchup".to_owned(),
            [a, b].map(|record| Value::from(record.touchup.clone())),
        );
    }
    changed
}

fn flatten(name: &str, value: &Value, into: &mut BTreeMap<String, Value>) {
    let Value::Object(keys) = value else {
        into.insert(name.to_owned(), value.clone());
        return;
    };
    for (key, value) in keys {
        let inner = if name.is_empty() {
            key.clone()
        } else {
            format!("{name}.{key}")
        };
        flatten(&inner, value, into);
    }
}

/// Differences of two results.
#[derive(Clone, Debug)]
pub struct WhatIf {
    /// both values by path of the key
    pub keys: BTreeMap<String, [Value; 2]>,
    /// displacement of each vertex slot of the first mesh
    pub of_a: Vec<Displacement>,
    /// displacement of each vertex slot of the second mesh; `None` if both have the same vertices
    pub of_b: Option<Vec<Displacement>>,
    /// changes of each pair, and features of one result only
    pub features: Vec<FeatureChange>,
}

impl WhatIf {
    /// Compares two results of one scan.
    ///
    /// # Errors
    /// [`WhatIfError::OtherScan`], [`WhatIfError::Compare`].
    pub fn of(a: &JobResult, b: &JobResult) -> Result<Self, WhatIfError> {
        let [of_a, of_b] = [a, b].map(|result| result.record.scan_sha256.clone());
        if of_a != of_b {
            return Err(WhatIfError::OtherScan { a: of_a, b: of_b });
        }
        let (keys, features) = (
            changed_keys(&a.record, &b.record),
            feature_changes(&a.features, &b.features, COVERAGE),
        );
        let [of_a, of_b] = [a, b].map(|result| result.sigma.as_deref());
        if let Some(displaced) = displacements_by_vertex(&a.mesh, &b.mesh, [of_a, of_b]) {
            return Ok(Self {
                keys,
                of_a: displaced,
                of_b: None,
                features,
            });
        }
        let trees = [a, b].map(|result| FaceTree::new_by(&result.mesh, &Threads));
        let [shape_a, shape_b] = [(a, &trees[0]), (b, &trees[1])].map(|(one, tree)| IndexedMesh {
            mesh: &one.mesh,
            tree,
        });
        let before = displacements_to_surface(
            &a.mesh,
            of_a,
            DisplacedFrom::Before,
            shape_b,
            of_b,
            &Threads,
        )?;
        let after =
            displacements_to_surface(&b.mesh, of_b, DisplacedFrom::After, shape_a, of_a, &Threads)?;
        Ok(Self {
            keys,
            of_a: before,
            of_b: Some(after),
            features,
        })
    }
}

/// A number of a feature in both results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NumberChange {
    /// as in features.json
    pub name: &'static str,
    /// value in the first result; `None` for a position or axis
    pub a: Option<f64>,
    /// value in the second result
    pub b: Option<f64>,
    /// difference from first to second; distance of positions, angle of axes
    pub change: f64,
    /// the larger ± of both; `None` if neither is known
    pub plus_minus: Option<f64>,
    /// whether the change exceeds ±; false without ±
    pub moved: bool,
}

/// A feature in both results, or in one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeatureChange {
    /// e.g. `hole`, `slot`
    pub kind: String,
    /// number in the first result
    pub id_a: Option<u32>,
    /// number in the second result
    pub id_b: Option<u32>,
    /// position in the first result that has it, mm
    pub center_mm: Option<[f64; 3]>,
    /// numbers of a feature in both results
    pub numbers: Vec<NumberChange>,
}

impl FeatureChange {
    /// Whether one of its numbers moved, or one result lacks it.
    pub fn is_moved(&self) -> bool {
        self.id_a.is_none() || self.id_b.is_none() || self.numbers.iter().any(|number| number.moved)
    }
}

/// Maximum distance of a feature pair, mm: same kind, and no other feature nearer.
const NEAR_MM: f64 = 1.5;
/// Minimum cosine between the axes of a pair: within 30°.
const SAME_AXIS: f64 = 0.866;

fn far(a: &FeatureRecord, b: &FeatureRecord) -> Option<f64> {
    let (p, q) = a.center_mm.zip(b.center_mm)?;
    let apart = nalgebra::Vector3::from(p) - nalgebra::Vector3::from(q);
    let axes = a.axis.zip(b.axis).map(|(n, m)| {
        nalgebra::Vector3::from(n)
            .dot(&nalgebra::Vector3::from(m))
            .abs()
    });
    let is_same = a.kind == b.kind && axes.is_none_or(|cosine| cosine > SAME_AXIS);
    // a plane extends in itself: its centre moves with the touches on it
    let normal = a
        .axis
        .filter(|_| a.kind == "plane")
        .map(nalgebra::Vector3::from);
    let off = normal.map_or(apart.norm(), |normal| {
        apart.dot(&normal).abs().max(apart.norm() / PLANE_SPREAD)
    });
    (is_same && off < NEAR_MM).then_some(off)
}

/// Ratio of a plane's permitted centre shifts, within it to along its normal.
const PLANE_SPREAD: f64 = 10.0;

/// Pairs features, the nearest first, and compares them.
fn feature_changes(a: &[FeatureRecord], b: &[FeatureRecord], k: f64) -> Vec<FeatureChange> {
    let all = a.iter().enumerate().flat_map(|(i, of_a)| {
        b.iter()
            .enumerate()
            .filter_map(move |(j, of_b)| Some((far(of_a, of_b)?, i, j)))
    });
    let mut all: Vec<_> = all.collect();
    all.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let (mut partner_of_a, mut partner_of_b) = (vec![None; a.len()], vec![None; b.len()]);
    for (_, i, j) in all {
        if partner_of_a[i].is_none() && partner_of_b[j].is_none() {
            (partner_of_a[i], partner_of_b[j]) = (Some(j), Some(i));
        }
    }
    let of_a = a
        .iter()
        .zip(&partner_of_a)
        .map(|(one, partner)| change(Some(one), partner.map(|j| &b[j]), k));
    let alone = b
        .iter()
        .zip(&partner_of_b)
        .filter(|(_, partner)| partner.is_none());
    of_a.chain(alone.map(|(one, _)| change(None, Some(one), k)))
        .collect()
}

fn change(a: Option<&FeatureRecord>, b: Option<&FeatureRecord>, k: f64) -> FeatureChange {
    let first = a.or(b);
    FeatureChange {
        kind: first.map_or(String::new(), |one| one.kind.clone()),
        id_a: a.map(|one| one.id),
        id_b: b.map(|one| one.id),
        center_mm: first.and_then(|one| one.center_mm),
        numbers: a.zip(b).map_or_else(Vec::new, |(a, b)| numbers(a, b, k)),
    }
}

fn numbers(a: &FeatureRecord, b: &FeatureRecord, k: f64) -> Vec<NumberChange> {
    let changed = |name: &'static str, values: [Option<f64>; 2], change: f64| {
        let stds = [a, b].map(|one| one.std.get(name).copied());
        let plus_minus = stds
            .into_iter()
            .flatten()
            .reduce(f64::max)
            .map(|std| k * std);
        let moved = plus_minus.is_some_and(|known| change.abs() > known);
        NumberChange {
            name,
            a: values[0],
            b: values[1],
            change,
            plus_minus,
            moved,
        }
    };
    let place = a.center_mm.zip(b.center_mm).map(|(p, q)| {
        let apart = nalgebra::Vector3::from(q) - nalgebra::Vector3::from(p);
        // the standard uncertainty is across the axis, for a plane along its normal, for a corner
        // in space
        let axis = a.axis.map(nalgebra::Vector3::from);
        let off = match (axis, &*a.kind) {
            (Some(axis), "plane") => apart.dot(&axis).abs(),
            (Some(axis), _) => (apart - axis * apart.dot(&axis)).norm(),
            (None, _) => apart.norm(),
        };
        changed("center_mm", [None, None], off)
    });
    let axis = a.axis.zip(b.axis).map(|(n, m)| {
        let angle = angle_between(&n.into(), &m.into());
        changed(
            "axis_deg",
            [None, None],
            angle.min(std::f64::consts::PI - angle).to_degrees(),
        )
    });
    let sizes = InspectedQuantity::SIZES.iter().filter_map(|quantity| {
        let [x, y] = [a.number(*quantity)?.value, b.number(*quantity)?.value];
        Some(changed(quantity.name(), [Some(x), Some(y)], y - x))
    });
    place.into_iter().chain(axis).chain(sizes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hole(id: u32, center: [f64; 3], diameter: f64, std: f64) -> FeatureRecord {
        serde_json::from_value(serde_json::json!({
            "id": id, "kind": "hole", "center_mm": center, "axis": [0, 0, 1], "diameter_mm": diameter,
            "std": { "diameter_mm": std, "center_mm": 0.01 }
        }))
        .unwrap()
    }

    /// By hand: 6.00 and 6.05 with ± 2 · 0.02 moved, with ± 2 · 0.03 not; 0.3 mm along the axis is
    /// no change of position.
    #[test]
    fn a_number_moves_when_it_changes_by_more_than_the_larger_plus_minus() {
        let a = [
            hole(1, [0.0, 0.0, 0.0], 6.0, 0.01),
            hole(2, [20.0, 0.0, 0.0], 6.0, 0.03),
            hole(3, [40.0, 0.0, 0.0], 5.0, 0.01),
        ];
        let b = [
            hole(7, [20.0, 0.0, 0.3], 6.05, 0.01),
            hole(8, [0.015, 0.0, 0.0], 6.05, 0.02),
            hole(9, [0.0, 30.0, 0.0], 5.0, 0.01),
        ];
        let changes = feature_changes(&a, &b, 2.0);
        let pairs: Vec<_> = changes
            .iter()
            .map(|one| (one.id_a, one.id_b, one.is_moved()))
            .collect();
        let expected = [
            (Some(1), Some(8), true),
            (Some(2), Some(7), false),
            (Some(3), None, true),
            (None, Some(9), true),
        ];
        assert_eq!(pairs, expected);
        let moved: Vec<_> = changes[0]
            .numbers
            .iter()
            .filter(|number| number.moved)
            .map(|number| number.name)
            .collect();
        assert_eq!(
            moved,
            ["diameter_mm"],
            "0.015 mm of its place is within ± 0.02 mm"
        );
        assert_eq!(changes[0].numbers[2].plus_minus, Some(0.04));
    }

    #[test]
    fn keys_that_differ_are_named_with_both_values() {
        let record = |scene: &str| {
            JobRecord::new(
                "a",
                Default::default(),
                "b",
                &Default::default(),
                serde_json::from_str(scene).unwrap(),
            )
        };
        let a =
            record(r#"{"tip": {"radius_mm": 1.5, "stiffness_n_per_mm": 20}, "guard": {"x": 1}}"#);
        let b = record(r#"{"tip": {"radius_mm": 1.5, "stiffness_n_per_mm": 10}, "guard": "off"}"#);
        let changed = changed_keys(&a, &b);
        let names: Vec<_> = changed.keys().map(String::as_str).collect();
        assert_eq!(names, ["guard", "guard.x", "tip.stiffness_n_per_mm"]);
        assert_eq!(
            changed["tip.stiffness_n_per_mm"],
            [Value::from(20), Value::from(10)]
        );
        assert_ne!(a.id, b.id);
    }
}
