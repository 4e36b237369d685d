//! The grid file of a sweep.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use super::error::SweepError;
use super::sampling::{KeyValues, Sampling};
use crate::replay::RecordedAs;
use crate::scene::yaml_error;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::text_file::read_text;

/// The grid file as written; paths are relative to its folder.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GridFile {
    scan: Option<PathBuf>,
    mesh_unit: Option<MeshUnit>,
    scene: Option<PathBuf>,
    #[serde(default)]
    recordings: Vec<PathBuf>,
    #[serde(default)]
    recorded: RecordedAs,
    simulate: Option<SimulatedPart>,
    #[serde(default)]
    keys: BTreeMap<String, Value>,
    #[serde(default)]
    sampling: Sampling,
}

/// A part for simulated scan and touch, once per seed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulatedPart {
    /// `plate`, the part of `touchup demo`, or a closed mesh
    pub part: PathBuf,
    pub seeds: Vec<u64>,
}

/// The grid of a sweep.
#[derive(Debug)]
pub(super) struct SweepGrid {
    pub path: PathBuf,
    /// text of the file, to name its lines
    text: String,
    pub scan: Option<PathBuf>,
    pub mesh_unit: MeshUnit,
    pub scene: Option<PathBuf>,
    pub recordings: Vec<PathBuf>,
    pub recorded: RecordedAs,
    pub simulate: Option<SimulatedPart>,
    pub keys: BTreeMap<String, KeyValues>,
    pub sampling: Sampling,
}

impl SweepGrid {
    /// - `more`: recordings of the command line, relative to the present folder.
    pub fn read(path: &Path, more: &[PathBuf]) -> Result<Self, SweepError> {
        let text = read_text(path)?;
        let refused = |why: String| SweepError::Grid {
            path: path.to_owned(),
            why,
        };
        let file: GridFile = serde_saphyr::from_str(&text)
            .map_err(|error| refused(yaml_error(&error).to_string()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let beside = |path: PathBuf| folder.join(path);
        let recordings = file
            .recordings
            .into_iter()
            .map(beside)
            .chain(more.iter().cloned())
            .collect();
        let simulate = file.simulate.map(|it| SimulatedPart {
            part: named_part(folder, it.part),
            ..it
        });
        let mut grid = Self {
            path: path.to_owned(),
            text,
            scan: file.scan.map(beside),
            mesh_unit: file.mesh_unit.unwrap_or_default(),
            scene: file.scene.map(beside),
            recordings,
            recorded: file.recorded,
            simulate,
            keys: BTreeMap::new(),
            sampling: file.sampling,
        };
        grid.check()?;
        for (key, values) in file.keys {
            let values = KeyValues::of(values).map_err(|why| grid.at_key(&key, why))?;
            grid.sampling
                .check(&values)
                .map_err(|why| grid.at_key(&key, why))?;
            grid.keys.insert(key, values);
        }
        grid.sampling.check_count(&grid.keys).map_err(refused)?;
        Ok(grid)
    }

    fn check(&self) -> Result<(), SweepError> {
        let refused = |why: &str| {
            Err(SweepError::Grid {
                path: self.path.clone(),
                why: why.to_owned(),
            })
        };
        match &self.simulate {
            Some(_) if self.scan.is_some() || !self.recordings.is_empty() => refused(
                "simulate makes scan and recordings: leave out scan, recordings, and those of the command line",
            ),
            Some(simulate) if simulate.seeds.is_empty() => {
                refused("simulate.seeds is empty: give at least one, as [1]")
            }
            None if self.recordings.is_empty() => refused(
                "there is no recording: name them under recordings, or on the command line behind the file",
            ),
            _ => Ok(()),
        }
    }

    /// The error of a key, with its line.
    pub fn at_key(&self, key: &str, why: String) -> SweepError {
        let names = |line: &str| {
            let rest = line
                .split_once(key)
                .filter(|(before, _)| !before.ends_with(|c: char| c.is_alphanumeric() || c == '_'));
            rest.is_some_and(|(_, rest)| {
                rest.trim_start_matches(['"', '\''])
                    .trim_start()
                    .starts_with(':')
            })
        };
        let line = self
            .text
            .lines()
            .position(names)
            .map_or(String::new(), |at| format!("line {}: ", at + 1));
        SweepError::Grid {
            path: self.path.clone(),
            why: format!("{line}{key}: {why}"),
        }
    }
}

/// The plate has no file.
fn named_part(folder: &Path, part: PathBuf) -> PathBuf {
    if part.as_os_str() == "plate" {
        part
    } else {
        folder.join(part)
    }
}
