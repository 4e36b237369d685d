//! The files that an inspection rests on.

use std::path::{Path, PathBuf};

use crate::cli::{CliError, require};
use crate::io::features_file::{FeatureFile, read_features};
use crate::io::inspection_file::InspectedFile;
use crate::io::probed_touches_file::{TouchLine, read_probed_touches};
use crate::io::session_folder::fingerprint;
use crate::io::touches_file::read_touches;
use crate::stylus::ProbedPoint;

/// What was measured, as its files have it.
pub(super) struct Source {
    pub features: FeatureFile,
    pub touches: Vec<ProbedPoint>,
    /// of an arm
    pub probed: Vec<TouchLine>,
    /// the mesh of the picture
    pub mesh: Option<PathBuf>,
    pub scene: Option<PathBuf>,
    /// all that were read
    pub files: Vec<InspectedFile>,
}

impl Source {
    /// - `path`: a file of features, or a folder with one.
    /// - `named`: touches, mesh and scene, where flags name them; else they are looked for beside the features.
    pub fn read(path: &Path, named: [Option<&Path>; 3]) -> Result<Self, CliError> {
        let features_path = if path.is_dir() { path.join("features.json") } else { path.to_owned() };
        let hint = "refine --features-out, features --out and probe write it; a session has it once it was saved";
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
        Ok(Self { features, touches, probed, mesh, scene, files })
    }
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
