//! Folder of a probing: its request, and its finished features.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::files::{RECORDING, TOUCHES};
use super::ready::ProbingSetup;
use super::report::{ProbedFile, ProbedRecord, kind_of};
use crate::cli::{CliError, require, write_json};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::probed_touches_file::{TouchLine, read_probed_touches};
use touchup_io::session_folder::{fingerprint, read_text};
use touchup_probing::execute::Flag;

const REQUEST: &str = "probing.json";
const RECORDS: &str = "probed.json";

/// Request of a probing, `probing.json`; only an equal request continues it.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ProbingRequest {
    scene: PathBuf,
    scene_crc32: u32,
    scan: PathBuf,
    scan_crc32: u32,
    mesh_unit: MeshUnit,
    is_simulated: bool,
    flags: Vec<FlagRecord>,
    settings: ProbingSettings,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct FlagRecord {
    flag: u32,
    kind: String,
    place_mm: [f64; 3],
    search_radius_mm: f64,
}

/// Settings of the scene that the command line can change.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct ProbingSettings {
    /// Target standard uncertainty.
    sigma_mm: f64,
    most_touches: usize,
    largest_force_n: f64,
    longest_s: f64,
    slides: bool,
    /// From a check of the arm, or from the scene.
    #[serde(default)]
    touch_sigma_mm: f64,
    #[serde(default)]
    growth_mm_per_m: f64,
    /// Characteristics to decide, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    until_decided: Vec<String>,
}

impl ProbingRequest {
    /// - `scan`: its file and the unit of its coordinates.
    pub fn new(
        scene: &Path,
        (scan, mesh_unit): (&Path, MeshUnit),
        is_simulated: bool,
        flags: &[Flag],
        ready: &ProbingSetup,
    ) -> Result<Self, CliError> {
        let (scene, scene_crc32) = fingerprint(scene).map_err(not_read(scene))?;
        let (scan, scan_crc32) = fingerprint(scan).map_err(not_read(scan))?;
        let flag_record = |flag: &Flag| FlagRecord {
            flag: flag.id,
            kind: kind_of(flag).to_owned(),
            place_mm: (flag.place * 1e3).coords.into(),
            search_radius_mm: flag.radius * 1e3,
        };
        let params = &ready.params;
        let settings = ProbingSettings {
            sigma_mm: params.pattern.sigma * 1e3,
            most_touches: params.pattern.budget,
            largest_force_n: params.limits.force,
            longest_s: params.limits.time,
            slides: params.slides,
            touch_sigma_mm: params.pattern.touch_sigma * 1e3,
            growth_mm_per_m: params.pattern.shared.growth * 1e3,
            until_decided: params
                .goals
                .iter()
                .map(|(flag, goal)| format!("{flag}: {goal:?}"))
                .collect(),
        };
        let flags = flags.iter().map(flag_record).collect();
        Ok(Self {
            scene,
            scene_crc32,
            scan,
            scan_crc32,
            mesh_unit,
            is_simulated,
            flags,
            settings,
        })
    }

    /// Difference from the request before; `None`: none of importance.
    fn difference(&self, before: &Self) -> Option<&'static str> {
        let differences = [
            (self.is_simulated != before.is_simulated, "--robot"),
            (self.scene_crc32 != before.scene_crc32, "the scene"),
            (
                (self.scan_crc32, self.mesh_unit) != (before.scan_crc32, before.mesh_unit),
                "the scan or its unit",
            ),
            (self.flags != before.flags, "the list of features"),
            (
                self.settings != before.settings,
                "tolerance, nominal values, touches, force, time, slides or the check of the arm",
            ),
        ];
        differences
            .into_iter()
            .find_map(|(differs, what)| differs.then_some(what))
    }
}

fn not_read(path: &Path) -> impl FnOnce(std::io::Error) -> CliError {
    move |error| {
        CliError::new(
            ("probing", 3),
            format_args!("{}: {error}", path.display()),
            Some(&error),
        )
    }
}

/// Folder of `--out`.
#[derive(Clone, Copy)]
pub(super) struct ProbingFolder<'a> {
    pub path: &'a Path,
}

impl ProbingFolder<'_> {
    /// Begins a probing in place of an older one.
    pub fn begin(self, request: &ProbingRequest) -> Result<(), CliError> {
        write_json(&self.path.join(REQUEST), request)?;
        self.write(&ProbedFile::default())
    }

    /// Refuses to overwrite a recording of another origin, as a session's.
    pub fn check_own(self) -> Result<(), CliError> {
        let recording = self.path.join(RECORDING);
        let is_own = self.path.join(REQUEST).exists() || !recording.exists();
        require(
            is_own,
            format_args!(
                "{} is there and of no probing: name another folder by --out",
                recording.display()
            ),
        )
    }

    /// Refuses to overwrite touches of an interrupted probing.
    pub fn check_free(self) -> Result<(), CliError> {
        let Some(request) = self.read::<ProbingRequest>(REQUEST)? else {
            return Ok(());
        };
        let records = self.records()?;
        let is_over = |flag: &FlagRecord| {
            records
                .iter()
                .any(|record| record.flag == flag.flag && !record.is_broken_off())
        };
        let is_done = request.flags.iter().all(is_over);
        let finished = records
            .iter()
            .filter(|record| !record.is_broken_off())
            .count();
        let out = self.path.display();
        let why = format!(
            "{out} holds a probing that was broken off, with {finished} of {} features finished: go on with --resume, or name \
             another folder by --out",
            request.flags.len()
        );
        require(is_done || self.touches()?.is_empty(), why)
    }

    /// Finished features, if the folder's probing has the same request.
    pub fn resume(self, request: &ProbingRequest) -> Result<Vec<ProbedRecord>, CliError> {
        let out = self.path.display();
        let none = || {
            CliError::usage(format_args!(
                "--resume: {out} holds no probing to go on with"
            ))
        };
        let before = self.read::<ProbingRequest>(REQUEST)?.ok_or_else(none)?;
        if let Some(what) = request.difference(&before) {
            let why = format!(
                "--resume: {what} differs from what the probing in {out} began with: repeat that command as it was, or probe \
                 into another folder"
            );
            return Err(CliError::usage(why));
        }
        let mut records = self.records()?;
        records.retain(ProbedRecord::is_finished);
        Ok(records)
    }

    /// Writes the probed features.
    pub fn write(self, records: &ProbedFile) -> Result<(), CliError> {
        write_json(&self.path.join(RECORDS), records)
    }

    /// All touches.
    pub fn touches(self) -> Result<Vec<TouchLine>, CliError> {
        let path = self.path.join(TOUCHES);
        read_probed_touches(&path).map_err(not_read(&path))
    }

    fn records(self) -> Result<Vec<ProbedRecord>, CliError> {
        Ok(self
            .read::<ProbedFile>(RECORDS)?
            .unwrap_or_default()
            .features)
    }

    /// Content of a file; `None` if missing.
    fn read<T: DeserializeOwned>(self, name: &str) -> Result<Option<T>, CliError> {
        let path = self.path.join(name);
        let text = read_text(&path).map_err(not_read(&path))?;
        if text.is_empty() {
            return Ok(None);
        }
        let damaged = |error: serde_json::Error| {
            let why = format!(
                "{}: {error}; is that the folder of a probing?",
                path.display()
            );
            CliError::new(("probing", 3), why, None)
        };
        serde_json::from_str(&text).map(Some).map_err(damaged)
    }
}
