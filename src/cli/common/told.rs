//! Settings of tip and scan that determine a result, and their sources.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::CliError;
use touchup_session::refinement::AcceptedScene;
use touchup_session::scene::{Scene, Setting};

/// Flags for tip and scan, over the scene.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct ToldFlags {
    /// Radius of the ball, mm; required if no scene has it
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    tip_radius_mm: Option<f64>,
    /// Stiffness of stylus and holder at the ball, N/mm
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    stiffness_n_per_mm: Option<f64>,
    /// Standard deviation of the scan from the true surface, mm
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    scan_noise_mm: Option<f64>,
}

impl ToldFlags {
    /// Flags with only the radius of the ball, m.
    pub fn of_radius(radius: f64) -> Self {
        Self {
            tip_radius_mm: Some(radius * 1e3),
            ..Self::default()
        }
    }

    /// Scene of a file, or the default one, with the flags over it, and the sources of its numbers.
    ///
    /// # Errors
    /// A missing tip radius, and a scene or a flag out of its range.
    pub fn scene(&self, path: Option<&Path>) -> Result<(Scene, ToldNumbers), CliError> {
        let (mut scene, yaml) = match path {
            Some(path) => Scene::read_with_text(path)?,
            None => (Scene::default(), String::new()),
        };
        self.tell(&mut scene, &yaml)?;
        let by_flag = [
            self.tip_radius_mm,
            self.stiffness_n_per_mm,
            self.scan_noise_mm,
        ];
        let told = ToldNumbers::of(
            &scene,
            &yaml,
            by_flag.map(|flag| flag.map(|_| ToldBy::Flag)),
        );
        Ok((scene, told))
    }

    /// Settings of a scene, one for each flag.
    pub fn settings(&self) -> Vec<Setting> {
        let flags = [
            ("tip.radius_mm", self.tip_radius_mm),
            ("tip.stiffness_n_per_mm", self.stiffness_n_per_mm),
            ("scan.noise_mm", self.scan_noise_mm),
        ];
        let given = |(key, number): (_, Option<f64>)| Some(Setting::number(key, number?));
        flags.into_iter().filter_map(given).collect()
    }

    /// Applies the flags.
    ///
    /// - `yaml`: text of the scene.
    ///
    /// # Errors
    /// A missing tip radius, and a flag out of its range.
    pub fn tell(&self, scene: &mut Scene, yaml: &str) -> Result<(), CliError> {
        if self.tip_radius_mm.is_none() {
            scene.require_radius(yaml)?;
        }
        scene.set(&self.settings())?;
        // the file was in range when read: a flag set any value out of range
        scene.validate().map_err(CliError::usage)
    }

    /// Text of a scene, or of the default one, with the values of the flags.
    ///
    /// # Errors
    /// As [`Self::scene`], and for a scene whose text form allows no edits.
    #[cfg(any(feature = "ros", feature = "r2r"))]
    pub fn scene_text(&self, path: Option<&Path>) -> Result<String, CliError> {
        let yaml = match path {
            Some(path) => Scene::read_with_text(path)?.1,
            None => Scene::template_without_radius(),
        };
        self.tell(&mut Scene::from_yaml(&yaml)?, &yaml)?;
        Ok(Scene::edited(&yaml, &self.settings(), "given by flags")?)
    }
}

/// A scene with its sources.
#[derive(Clone, Debug)]
pub(in crate::cli) struct ToldScene {
    pub scene: Scene,
    pub numbers: ToldNumbers,
    /// Its file; `None`: the default scene.
    pub path: Option<PathBuf>,
    /// Settings over the file.
    pub settings: Vec<Setting>,
}

impl ToldScene {
    /// Text of this scene with what was taken off, for a file at `place`.
    ///
    /// # Errors
    /// A scene whose text form allows no edits.
    pub fn accepted_text(
        &self,
        accepted: &AcceptedScene,
        place: &Path,
    ) -> Result<String, CliError> {
        let Some(path) = &self.path else {
            return Ok(accepted.text("", &self.settings)?);
        };
        let [own, other] = [path.as_path(), place].map(std::path::absolute);
        let (own, other) = (own?, other?);
        let mut settings = self.settings.clone();
        if let Some(folder) = own
            .parent()
            .filter(|folder| Some(*folder) != other.parent())
        {
            settings.extend(self.scene.files_in(folder)?);
        }
        Ok(accepted.text(&Scene::read_with_text(path)?.1, &settings)?)
    }
}

/// Number that determines the result.
#[derive(Clone, Debug, Serialize)]
struct ToldNumber {
    value: f64,
    source: ToldBy,
}

touchup_method::names! {
    /// Source of a number.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum ToldBy {
        /// A flag.
        Flag = "flag",
        /// A parameter of the node.
        Parameter = "parameter",
        /// The scene.
        Scene = "scene",
        /// Default of the program.
        Default = "default",
    }
}

/// Settings of tip and scan; a rigid tip has no stiffness.
#[derive(Clone, Debug, Serialize)]
pub(in crate::cli) struct ToldNumbers {
    tip_radius_mm: ToldNumber,
    stiffness_n_per_mm: Option<ToldNumber>,
    scan_noise_mm: ToldNumber,
}

impl ToldNumbers {
    /// - `yaml`: text of the scene; empty for none.
    /// - `others`: sources of radius, stiffness and noise over the scene.
    pub fn of(scene: &Scene, yaml: &str, others: [Option<ToldBy>; 3]) -> Self {
        let [by_radius, by_stiffness, by_noise] = others;
        let told = |value: f64, other: Option<ToldBy>, section: &str, key: &str| {
            let by_scene = if Scene::names(yaml, section, key) {
                ToldBy::Scene
            } else {
                ToldBy::Default
            };
            ToldNumber {
                value,
                source: other.unwrap_or(by_scene),
            }
        };
        let tip = scene.tip_params();
        let noise = scene.scan.as_ref().map_or(0.0, |scan| scan.quality.noise);
        Self {
            tip_radius_mm: told(tip.radius * 1e3, by_radius, "tip", "radius_mm"),
            stiffness_n_per_mm: tip
                .stiffness
                .map(|k| told(k / 1e3, by_stiffness, "tip", "stiffness_n_per_mm")),
            scan_noise_mm: told(noise * 1e3, by_noise, "scan", "noise_mm"),
        }
    }
}

impl fmt::Display for ToldNumbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            tip_radius_mm: radius,
            stiffness_n_per_mm: stiffness,
            scan_noise_mm: noise,
        } = self;
        write!(
            f,
            "tip: radius {:.4} mm ({}), ",
            radius.value, radius.source
        )?;
        match stiffness {
            Some(stiffness) => write!(
                f,
                "stiffness {:.4} N/mm ({})",
                stiffness.value, stiffness.source
            )?,
            None => write!(f, "rigid")?,
        }
        write!(f, "; scan: noise {:.3} mm ({})", noise.value, noise.source)
    }
}
