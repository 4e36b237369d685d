//! Plans the jobs of a sweep grid.

use std::path::{Component, Path, PathBuf};

use super::base_scene::{BaseScene, KeyError};
use super::error::SweepError;
use super::grid::SweepGrid;
use super::job::Job;
use super::record::JobRecord;
use super::sampling::KeySetting;
use super::simulated::{PartToTouch, SimulatedFiles};
use crate::scene::Scene;
use touchup_io::content_hash::{content_hash, hash_of};
use touchup_io::file_error::FileError;
use touchup_io::machine::VERSION;
use touchup_io::mesh_file::MeshUnit;

/// Maximum number of jobs in a plan.
pub const MOST_JOBS: u64 = 1_000_000;

/// Scan and recording of some jobs.
#[derive(Debug)]
struct PlannedInput {
    scan: PathBuf,
    scan_sha256: String,
    recording: PathBuf,
    recording_sha256: String,
    seed: Option<u64>,
}

/// Settings times recordings and seeds.
#[derive(Debug)]
pub struct SweepPlan {
    grid: SweepGrid,
    mesh_unit: MeshUnit,
    inputs: Vec<PlannedInput>,
    base: BaseScene,
    /// path and hash of the scene
    scene: Option<(PathBuf, String)>,
    settings: u64,
}

impl SweepPlan {
    /// Reads and checks the grid. Writes simulated scans and recordings below `folder`.
    ///
    /// - `grid`: the grid file.
    /// - `recordings`: further recordings, relative to the present folder.
    /// - `folder`: folder of the file of jobs, the base of their paths.
    ///
    /// # Errors
    /// [`SweepError`]
    pub fn read(grid: &Path, recordings: &[PathBuf], folder: &Path) -> Result<Self, SweepError> {
        let mut grid = SweepGrid::read(grid, recordings)?;
        let refused = |why: String| SweepError::Grid {
            path: grid.path.clone(),
            why,
        };
        grid.recorded.checked_stamps().map_err(refused)?;
        let (base, scene_scan, scene_hash) = match &grid.scene {
            None => (BaseScene::of("")?, None, None),
            Some(path) => {
                let (scene, text) = Scene::read_with_text(path)?;
                (
                    BaseScene::of(&text)?,
                    scene.scan_file(path),
                    Some(hash_of(text.as_bytes())),
                )
            }
        };
        let mut mesh_unit = grid.mesh_unit;
        if let (None, Some((file, unit))) = (&grid.scan, scene_scan)
            && grid.simulate.is_none()
        {
            (grid.scan, mesh_unit) = (Some(file), unit);
        }
        let settings = settings_of(&grid)?;
        // checks every setting before any output
        for at in 0..settings {
            let setting = grid.sampling.setting(&grid.keys, at);
            base.with(&setting).map_err(|error| blamed(&grid, error))?;
        }
        let inputs = inputs_of(&grid, folder)?;
        if grid.simulate.is_some() {
            mesh_unit = MeshUnit::Millimetre;
        }
        let scene = match (&grid.scene, scene_hash) {
            (Some(path), Some(hash)) => Some((beside(path, folder)?, hash)),
            _ => None,
        };
        Ok(Self {
            mesh_unit,
            inputs,
            base,
            scene,
            settings,
            grid,
        })
    }

    /// Number of jobs.
    pub fn count(&self) -> u64 {
        self.settings * self.inputs.len() as u64
    }

    /// All jobs: for each setting one per recording or seed.
    pub fn jobs(&self) -> impl Iterator<Item = Result<Job, SweepError>> {
        (0..self.settings).flat_map(|at| self.jobs_of(at))
    }

    fn jobs_of(&self, at: u64) -> Vec<Result<Job, SweepError>> {
        let keys = self.grid.sampling.setting(&self.grid.keys, at);
        let whole = match self.base.with(&keys) {
            Ok(scene) => scene.whole,
            Err(error) => return vec![Err(blamed(&self.grid, error))],
        };
        let first = at * self.inputs.len() as u64;
        let numbered = (first..).zip(&self.inputs);
        numbered
            .map(|(number, input)| Ok(self.job(number, input, keys.clone(), whole.clone())))
            .collect()
    }

    fn job(
        &self,
        job: u64,
        input: &PlannedInput,
        keys: KeySetting,
        whole: serde_json::Value,
    ) -> Job {
        let PlannedInput {
            scan,
            scan_sha256,
            recording,
            recording_sha256,
            seed,
        } = input;
        let recorded = self.grid.recorded.clone();
        let record = JobRecord::new(
            scan_sha256,
            self.mesh_unit,
            recording_sha256,
            &recorded,
            whole,
        );
        let (scene, scene_sha256) = self.scene.clone().unzip();
        Job {
            job,
            id: record.id,
            touchup: VERSION.to_owned(),
            scan: scan.clone(),
            scan_sha256: scan_sha256.clone(),
            mesh_unit: self.mesh_unit,
            recording: recording.clone(),
            recording_sha256: recording_sha256.clone(),
            recorded,
            scene,
            scene_sha256,
            seed: *seed,
            keys,
        }
    }
}

/// Number of settings.
fn settings_of(grid: &SweepGrid) -> Result<u64, SweepError> {
    let settings = grid.sampling.count(&grid.keys);
    let inputs = match &grid.simulate {
        Some(simulate) => simulate.seeds.len(),
        None => grid.recordings.len(),
    };
    let jobs = settings.and_then(|settings| settings.checked_mul(inputs as u64));
    match (settings, jobs) {
        (Some(settings), Some(jobs)) if settings.max(jobs) <= MOST_JOBS => Ok(settings),
        (_, jobs) => Err(SweepError::TooMany {
            path: grid.path.clone(),
            jobs: jobs.map_or_else(
                || "more than can be counted:".to_owned(),
                |jobs| jobs.to_string(),
            ),
            most: MOST_JOBS,
        }),
    }
}

fn blamed(grid: &SweepGrid, KeyError { key, why }: KeyError) -> SweepError {
    match key {
        Some(key) => grid.at_key(&key, why),
        None => SweepError::Grid {
            path: grid.path.clone(),
            why,
        },
    }
}

fn inputs_of(grid: &SweepGrid, folder: &Path) -> Result<Vec<PlannedInput>, SweepError> {
    let input = |scan: &Path, scan_sha256: &str, recording: &Path, seed| {
        Ok(PlannedInput {
            scan: beside(scan, folder)?,
            scan_sha256: scan_sha256.to_owned(),
            recording: beside(recording, folder)?,
            recording_sha256: content_hash(recording)?,
            seed,
        })
    };
    if let Some(simulate) = &grid.simulate {
        let part = PartToTouch::new(&simulate.part, grid.mesh_unit)?;
        let of_seed = |seed: &u64| {
            let SimulatedFiles { scan, recording } = part.write(*seed, folder)?;
            input(&scan, &content_hash(&scan)?, &recording, Some(*seed))
        };
        return simulate.seeds.iter().map(of_seed).collect();
    }
    let why =
        "there is no scan: name it as scan: scan.ply, or in the scene as scan: { file: scan.ply }"
            .to_owned();
    let scan = grid.scan.as_ref().ok_or(SweepError::Grid {
        path: grid.path.clone(),
        why,
    })?;
    let scan_sha256 = content_hash(scan)?;
    grid.recordings
        .iter()
        .map(|recording| input(scan, &scan_sha256, recording, None))
        .collect()
}

/// The path of a file relative to a folder.
fn beside(path: &Path, folder: &Path) -> Result<PathBuf, FileError> {
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        path.canonicalize().map_err(|source| FileError::Read {
            path: path.to_owned(),
            source,
        })
    };
    Ok(relative(&whole(path)?, &whole(folder)?))
}

/// - `path`, `folder`: absolute.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let (mut path, mut folder) = (path.components().peekable(), folder.components().peekable());
    while path.peek().is_some() && path.peek() == folder.peek() {
        path.next();
        folder.next();
    }
    folder.map(|_| Component::ParentDir).chain(path).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_named_from_the_folder_of_the_jobs_on() {
        for (path, folder, expected) in [
            ("/a/b/scan.ply", "/a/b", "scan.ply"),
            ("/a/b/scan.ply", "/a", "b/scan.ply"),
            ("/a/b/scan.ply", "/a/c/d", "../../b/scan.ply"),
        ] {
            assert_eq!(
                relative(Path::new(path), Path::new(folder)),
                Path::new(expected)
            );
        }
    }
}
