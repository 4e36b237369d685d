//! The files that an inspection rests on.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use crate::cli::{CliError, require};
use crate::io::features_file::{FeatureFile, FeatureRecord, read_features};
use crate::io::inspection_file::InspectedFile;
use crate::io::probed_touches_file::{TouchLine, read_probed_touches};
use crate::io::session_folder::{fingerprint, read_text};
use crate::io::touches_file::read_touches;
use crate::stylus::ProbedPoint;

/// What was measured, as its files have it.
pub(super) struct InspectionSource {
    pub features: FeatureFile,
    pub touches: Vec<ProbedPoint>,
    /// of an arm
    pub probed: Vec<TouchLine>,
    /// the mesh of the picture
    pub mesh: Option<PathBuf>,
    pub scene: Option<PathBuf>,
    /// all that were read
    pub files: Vec<InspectedFile>,
    /// what has to be known of them
    pub notes: Vec<String>,
}

impl InspectionSource {
    /// - `path`: a file of features, or a folder with one.
    /// - `named`: touches, mesh and scene, where flags name them; else they are looked for beside the features.
    pub fn read(path: &Path, named: [Option<&Path>; 3]) -> Result<Self, CliError> {
        if let Some(probed) = probed_file(path) {
            return Self::of_probing(&probed, named);
        }
        let features_path = if path.is_dir() { path.join("features.json") } else { path.to_owned() };
        let hint = "refine --features-out, features --out and probe write one; a session has it once it was saved";
        let is_there = !path.is_dir() || features_path.is_file();
        require(is_there, format_args!("{} has no features.json: {hint}", path.display()))?;
        let features = read_features(&features_path)?;
        let folder = features_path.parent().unwrap_or(Path::new("")).to_owned();
        let beside = |named: Option<&Path>, name: &str| {
            named.map(Path::to_owned).or_else(|| Some(folder.join(name)).filter(|path| path.is_file()))
        };
        let [touches_path, mesh, scene] = named;
        let (touches_path, mesh) = (beside(touches_path, "touches.csv"), beside(mesh, "refined.ply"));
        let scene = beside(scene, "scene.yaml");
        let touches = touches_path.as_deref().map_or_else(|| Ok(Vec::new()), read_touches)?;
        check_touches(&features, &touches, touches_path.as_deref())?;
        let probed_path = folder.join("probed_touches.jsonl");
        let probed = read_probed_touches(&probed_path).map_err(|error| CliError::inspected(&probed_path, error))?;
        let mut files = vec![inspected_file("features", &features_path)?];
        let probed_path = (!probed.is_empty()).then_some(probed_path);
        let others =
            [("touches", &touches_path), ("touches of the arm", &probed_path), ("mesh", &mesh), ("scene", &scene)];
        for (role, path) in others {
            files.extend(path.as_deref().map(|path| inspected_file(role, path)).transpose()?);
        }
        Ok(Self { features, touches, probed, mesh, scene, files, notes: Vec::new() })
    }

    /// What an arm measured: the feature of each flag, by the number of the flag, and the touches that it was measured by.
    fn of_probing(path: &Path, [_, mesh, scene]: [Option<&Path>; 3]) -> Result<Self, CliError> {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let beside = |named: Option<&Path>, name: &str| {
            named.map(Path::to_owned).or_else(|| Some(folder.join(name)).filter(|path| path.is_file()))
        };
        let text = read_text(path).map_err(|error| CliError::inspected(path, error))?;
        let ProbedFeatures { features } = serde_json::from_str(&text)
            .map_err(|error| CliError::new(("features", 3), format!("{}: {error}", path.display()), None))?;
        let probed_path = folder.join("probed_touches.jsonl");
        let probed = read_probed_touches(&probed_path).map_err(|error| CliError::inspected(&probed_path, error))?;
        let (mut found, mut touches) = (FeatureFile::default(), Vec::new());
        for ProbedFeature { flag, feature } in features {
            let Some(feature) = feature else { continue };
            let offset = touches.len() as u32;
            let mut of_flag: Vec<_> = probed.iter().filter(|touch| touch.flag == flag).collect();
            of_flag.sort_by_key(|touch| touch.index);
            touches.extend(of_flag.into_iter().map(point_of));
            found.features.push(renumbered(feature, flag, offset));
        }
        let (mesh, scene) = (beside(mesh, "refined.ply"), beside(scene, "scene.yaml"));
        check_touches(&found, &touches, Some(&probed_path))?;
        let mut files = vec![inspected_file("features of the arm", path)?];
        let probed_path = probed_path.is_file().then_some(probed_path);
        for (role, path) in [("touches of the arm", &probed_path), ("mesh", &mesh), ("scene", &scene)] {
            files.extend(path.as_deref().map(|path| inspected_file(role, path)).transpose()?);
        }
        let note =
            "Measured by an arm: ids are the numbers of the flags; form and relations were not measured.".to_owned();
        Ok(Self { features: found, touches, probed, mesh, scene, files, notes: vec![note] })
    }
}

/// `probed.json` as far as an inspection needs it.
#[derive(Deserialize)]
struct ProbedFeatures {
    features: Vec<ProbedFeature>,
}

#[derive(Deserialize)]
struct ProbedFeature {
    flag: u32,
    #[serde(default)]
    feature: Option<FeatureRecord>,
}

/// The file of a probing: it has the features that were flagged, also where few touches leave none in features.json.
fn probed_file(path: &Path) -> Option<PathBuf> {
    let probed = if path.is_dir() { path.join("probed.json") } else { path.to_owned() };
    (probed.file_name()? == "probed.json" && probed.is_file()).then_some(probed)
}

/// A touch of an arm; the ball meets the part in the direction of its search.
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

/// A feature by another number, and its touches counted from `offset` on: those of a flag are numbered from 1 on.
fn renumbered(mut feature: FeatureRecord, id: u32, offset: u32) -> FeatureRecord {
    feature.id = id;
    let of_all = |number: &mut u32| *number = (*number + offset).saturating_sub(1);
    feature.touches.values_mut().flatten().flatten().for_each(of_all);
    feature
}

/// A file with its length and checksum.
pub(super) fn inspected_file(role: &str, path: &Path) -> Result<InspectedFile, CliError> {
    let not_read = |error| CliError::inspected(path, error);
    let (_, crc32) = fingerprint(path).map_err(not_read)?;
    let bytes = Path::metadata(path).map_err(not_read)?.len();
    let (role, path) = (role.to_owned(), path.display().to_string());
    Ok(InspectedFile { role, path, bytes, crc32: format!("{crc32:08x}") })
}

/// Features name touches by number: a file of other touches is found where it is too short.
fn check_touches(features: &FeatureFile, touches: &[ProbedPoint], path: Option<&Path>) -> Result<(), CliError> {
    let Some(path) = path else { return Ok(()) };
    let runs = features.features.iter().flat_map(|feature| feature.touches.values().flatten());
    let Some(last) = runs.map(|[_, last]| *last as usize).max() else { return Ok(()) };
    let (path, count) = (path.display(), touches.len());
    let why = format!("{path} has {count} touches and the features name touch {last}: it is of another measurement");
    if last < count { Ok(()) } else { Err(CliError::new(("touches", 3), why, None)) }
}
