//! Input files of an inspection.

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use super::InspectionError;
use touchup_io::features_file::{FeatureFile, FeatureRecord, read_features};
use touchup_io::inspection_file::InspectedFile;
use touchup_io::probed_touches_file::{TouchLine, read_probed_touches};
use touchup_io::session_folder::{fingerprint, read_text};
use touchup_io::touches_file::read_touches;
use touchup_method::stylus::ProbedPoint;
use touchup_session::session::ResultFiles;

/// Measurement from its files.
pub struct InspectionSource {
    /// the measured features
    pub features: FeatureFile,
    /// touches behind them
    pub touches: Vec<ProbedPoint>,
    /// touches of an arm
    pub probed: Vec<TouchLine>,
    /// mesh of the picture
    pub mesh: Option<PathBuf>,
    /// scene of the session
    pub scene: Option<PathBuf>,
    /// all files read
    pub files: Vec<InspectedFile>,
    /// remarks for the reader
    pub notes: Vec<String>,
}

impl InspectionSource {
    /// - `path`: a features file, or a folder with one.
    /// - `named`: touches, mesh and scene from flags; otherwise the folder of the features supplies
    ///   them.
    pub fn read(path: &Path, named: [Option<&Path>; 3]) -> Result<Self, InspectionError> {
        if let Some(probed) = probed_file(path) {
            return Self::of_probing(&probed, named);
        }
        let (features_path, touches_name) = features_of(path)?;
        let features = read_features(&features_path)?;
        let folder = features_path.parent().unwrap_or(Path::new("")).to_owned();
        let beside = |named: Option<&Path>, name: &str| {
            named
                .map(Path::to_owned)
                .or_else(|| Some(folder.join(name)).filter(|path| path.is_file()))
        };
        let [touches_path, mesh, scene] = named;
        let (touches_path, mesh) = (
            beside(touches_path, touches_name),
            beside(mesh, ResultFiles::MESH),
        );
        let scene = beside(scene, "scene.yaml");
        let touches = touches_path
            .as_deref()
            .map_or_else(|| Ok(Vec::new()), read_touches)?;
        check_touches(&features, &touches, touches_path.as_deref())?;
        let probed_path = folder.join("probed_touches.jsonl");
        let probed =
            read_probed_touches(&probed_path).map_err(|error| not_read(&probed_path, error))?;
        let mut files = vec![inspected_file("features", &features_path)?];
        let of_arm = probed_file(&folder).as_deref().map(probed_features);
        let of_arm = of_arm.transpose()?.unwrap_or_default();
        let probed_path = (!probed.is_empty()).then_some(probed_path);
        let others = [
            ("touches", &touches_path),
            ("touches of the arm", &probed_path),
            ("mesh", &mesh),
            ("scene", &scene),
        ];
        for (role, path) in others {
            files.extend(
                path.as_deref()
                    .map(|path| inspected_file(role, path))
                    .transpose()?,
            );
        }
        Ok(Self {
            features,
            touches,
            probed,
            mesh,
            scene,
            files,
            notes: of_arm.iter().flat_map(ProbedFeature::notes).collect(),
        })
    }

    /// Measurement by an arm: one feature per flag, by the flag's number, and the touches behind
    /// it.
    fn of_probing(
        path: &Path,
        [_, mesh, scene]: [Option<&Path>; 3],
    ) -> Result<Self, InspectionError> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let beside = |named: Option<&Path>, name: &str| {
            named
                .map(Path::to_owned)
                .or_else(|| Some(folder.join(name)).filter(|path| path.is_file()))
        };
        let features = probed_features(path)?;
        let mut notes: Vec<String> = features.iter().flat_map(ProbedFeature::notes).collect();
        let probed_path = folder.join("probed_touches.jsonl");
        let probed =
            read_probed_touches(&probed_path).map_err(|error| not_read(&probed_path, error))?;
        let (mut found, mut touches) = (FeatureFile::default(), Vec::new());
        for ProbedFeature { flag, feature, .. } in features {
            let Some(feature) = feature else { continue };
            let offset = touches.len() as u32;
            let mut of_flag: Vec<_> = probed.iter().filter(|touch| touch.flag == flag).collect();
            of_flag.sort_by_key(|touch| touch.index);
            touches.extend(of_flag.into_iter().map(point_of));
            found.features.push(renumbered(feature, flag, offset));
        }
        let (mesh, scene) = (beside(mesh, ResultFiles::MESH), beside(scene, "scene.yaml"));
        check_touches(&found, &touches, Some(&probed_path))?;
        let mut files = vec![inspected_file("features of the arm", path)?];
        let probed_path = probed_path.is_file().then_some(probed_path);
        for (role, path) in [
            ("touches of the arm", &probed_path),
            ("mesh", &mesh),
            ("scene", &scene),
        ] {
            files.extend(
                path.as_deref()
                    .map(|path| inspected_file(role, path))
                    .transpose()?,
            );
        }
        notes.push("Measured by an arm: ids are the numbers of the flags; form and relations were not measured.".to_owned());
        Ok(Self {
            features: found,
            touches,
            probed,
            mesh,
            scene,
            files,
            notes,
        })
    }
}

fn not_read(path: &Path, source: io::Error) -> InspectionError {
    InspectionError::File {
        path: path.to_owned(),
        source,
    }
}

/// Names of features and touches files in a folder: from a finished or refined session, else from
/// `~/save_mesh` of a running session.
const IN_FOLDER: [(&str, &str); 2] = [
    (ResultFiles::FEATURES, ResultFiles::TOUCHES),
    ("refined.features.json", "refined.touches.csv"),
];

/// The features file that `path` names, or that its folder has, and the name of the touches file
/// beside it.
fn features_of(path: &Path) -> Result<(PathBuf, &'static str), InspectionError> {
    if !path.is_dir() {
        let is_saved = path.file_name().is_some_and(|name| name == IN_FOLDER[1].0);
        return Ok((path.to_owned(), IN_FOLDER[usize::from(is_saved)].1));
    }
    let there = IN_FOLDER.map(|(features, touches)| (path.join(features), touches));
    let found = there.into_iter().find(|(features, _)| features.is_file());
    found.ok_or_else(|| InspectionError::NoFeatures(path.to_owned()))
}

/// The part of `probed.json` that an inspection needs.
#[derive(Deserialize)]
struct ProbedFeatures {
    features: Vec<ProbedFeature>,
}

#[derive(Deserialize)]
struct ProbedFeature {
    flag: u32,
    #[serde(default)]
    feature: Option<FeatureRecord>,
    #[serde(default)]
    code: String,
    #[serde(default)]
    ending: String,
    #[serde(default)]
    touches: usize,
    /// absent in older files
    #[serde(default)]
    verified_touches: Option<usize>,
}

impl ProbedFeature {
    /// Remarks: cause of a stop of the arm, and touches in doubt, after which contact was missing
    /// at a place that had it.
    fn notes(&self) -> Vec<String> {
        let Self { flag, ending, .. } = self;
        let stopped = (self.code == "stopped").then(|| format!("Feature {flag}: {ending}."));
        let verified = self
            .verified_touches
            .filter(|verified| *verified < self.touches);
        let doubted = verified.map(|first| {
            let last = self.touches - 1;
            format!("Feature {flag}: touches {first} to {last} are in doubt: after them no contact was found where it had been.")
        });
        stopped.into_iter().chain(doubted).collect()
    }
}

/// Features of a probing file.
fn probed_features(path: &Path) -> Result<Vec<ProbedFeature>, InspectionError> {
    let text = read_text(path).map_err(|error| not_read(path, error))?;
    let file: ProbedFeatures =
        serde_json::from_str(&text).map_err(|source| InspectionError::Probed {
            path: path.to_owned(),
            source,
        })?;
    Ok(file.features)
}

/// Probing file: it has the flagged features, even if few touches leave none in features.json.
fn probed_file(path: &Path) -> Option<PathBuf> {
    let probed = if path.is_dir() {
        path.join("probed.json")
    } else {
        path.to_owned()
    };
    (probed.file_name()? == "probed.json" && probed.is_file()).then_some(probed)
}

/// A touch of an arm; the ball meets the part in the search direction.
fn point_of(touch: &TouchLine) -> ProbedPoint {
    let normal = -Vector3::from(touch.approach);
    let centre = Point3::from(touch.centre_mm.unwrap_or(touch.from_mm)) * 1e-3;
    let radius = touch.tip_radius_mm * 1e-3;
    ProbedPoint {
        stamp_ns: touch.begun_ns.unwrap_or_default(),
        centre,
        radius,
        point: centre - normal * radius,
        normal,
        sigma: touch.sigma_mm.unwrap_or_default() * 1e-3,
        is_rejected: !touch.accepted,
        stroke: 0,
        calibration: 0.0,
        place: 0.0,
        weight: 1.0,
    }
}

/// A feature with another number, and its touches counted from `offset`; a flag numbers its touches
/// from 1.
fn renumbered(mut feature: FeatureRecord, id: u32, offset: u32) -> FeatureRecord {
    feature.id = id;
    let of_all = |number: &mut u32| *number = (*number + offset).saturating_sub(1);
    feature
        .touches
        .values_mut()
        .flatten()
        .flatten()
        .for_each(of_all);
    feature
}

/// A file with its length and checksum.
pub(super) fn inspected_file(role: &str, path: &Path) -> Result<InspectedFile, InspectionError> {
    let not_read = |error| not_read(path, error);
    let (_, crc32) = fingerprint(path).map_err(not_read)?;
    let bytes = Path::metadata(path).map_err(not_read)?.len();
    let (role, path) = (role.to_owned(), path.display().to_string());
    Ok(InspectedFile {
        role,
        path,
        bytes,
        crc32: format!("{crc32:08x}"),
    })
}

/// Checks touch numbers of features: a file of other touches shows if it is too short.
fn check_touches(
    features: &FeatureFile,
    touches: &[ProbedPoint],
    path: Option<&Path>,
) -> Result<(), InspectionError> {
    let Some(path) = path else { return Ok(()) };
    let runs = features
        .features
        .iter()
        .flat_map(|feature| feature.touches.values().flatten());
    let Some(last) = runs.map(|[_, last]| *last as usize).max() else {
        return Ok(());
    };
    let (count, other) = (touches.len(), path.to_owned());
    if last < count {
        Ok(())
    } else {
        Err(InspectionError::OtherTouches {
            path: other,
            count,
            named: last,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mesh feature without touches.
    fn write(folder: &Path, features: &str, touches: &str) {
        let text =
            r#"{"features": [{"id": 1, "kind": "hole", "diameter_mm": 8.0, "fitted_to": "mesh"}]}"#;
        touchup_io::session_folder::write_text_file(&folder.join(features), text).unwrap();
        touchup_io::touches_file::write_touches(&folder.join(touches), &[]).unwrap();
    }

    #[test]
    fn what_was_saved_of_a_session_counts_until_it_is_over() {
        let folder = tempfile::tempdir().unwrap();
        let read = || InspectionSource::read(folder.path(), [None; 3]);
        let why = read().map(drop).unwrap_err().to_string();
        assert!(
            why.contains("has no features.json") && why.contains("once it was saved"),
            "{why}"
        );
        let names = |source: InspectionSource| -> Vec<String> {
            source
                .files
                .iter()
                .map(|file| file.path.rsplit('/').next().unwrap_or_default().to_owned())
                .collect()
        };
        write(
            folder.path(),
            "refined.features.json",
            "refined.touches.csv",
        );
        assert_eq!(
            names(read().unwrap()),
            ["refined.features.json", "refined.touches.csv"]
        );
        write(folder.path(), "features.json", "touches.csv");
        assert_eq!(names(read().unwrap()), ["features.json", "touches.csv"]);
        let saved = InspectionSource::read(&folder.path().join("refined.features.json"), [None; 3]);
        assert_eq!(
            names(saved.unwrap()),
            ["refined.features.json", "refined.touches.csv"]
        );
    }
}
