//! `touchup probe`: an arm probes flagged features by itself, without ROS.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::arm::{ArmArguments, RobotName};
use super::probing::{Done, Probing, Ready, flag_of, picture_files};
use super::{CliError, Losses, print_result};
use crate::probing::arm::{Arm, Narrower};
use crate::probing::execute::{Flag, Plan};

#[derive(Debug, Args)]
pub(super) struct ProbeArguments {
    #[command(flatten)]
    arm: ArmArguments,
    /// The scene, with `robot` (config/probe.yaml is an example)
    #[arg(long, value_name = "YAML")]
    scene: PathBuf,
    /// Features to probe, in the frame of the scan: KIND@X,Y,Z or KIND@X,Y,Z,RADIUS in mm; repeat for each
    #[arg(long = "feature", value_name = "FLAG", required = true, allow_hyphen_values = true)]
    features: Vec<String>,
    /// How far a feature may be from its flag, mm, where the flag does not say
    #[arg(long, value_name = "R", default_value_t = 3.0)]
    search_radius_mm: f64,
    /// Target half width of the confidence interval of each dimension, at the confidence of the scene, mm
    #[arg(long, value_name = "T")]
    tolerance_mm: Option<f64>,
    /// Most touches of a feature
    #[arg(long, value_name = "N")]
    max_touches: Option<usize>,
    /// Largest force at the tip, N: less than the scene allows
    #[arg(long, value_name = "F")]
    max_force_n: Option<f64>,
    /// Longest time for a feature, s: less than the scene allows
    #[arg(long, value_name = "T")]
    max_duration_s: Option<f64>,
    /// Slides over the found feature with constant force, so that the mesh follows: along walls and across rims
    #[arg(long)]
    slide: bool,
    /// Plans, checks reach and paths, draws the plan, and moves nothing
    #[arg(long)]
    dry_run: bool,
    /// Folder for plan.png, touches.png, probed.json, probed_touches.jsonl, touch.mcap, refined.ply, features.json, touches.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Prints the result as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn probe(arguments: &ProbeArguments) -> Result<Losses, CliError> {
    let flags = arguments.flags()?;
    let (scan, unit) = arguments.arm.scan(&arguments.scene)?;
    let probing = Probing {
        scene: &arguments.scene,
        scan: &scan,
        unit,
        flags: &flags,
        is_simulated: arguments.arm.robot == RobotName::Sim,
        out: &arguments.out,
    };
    let mut ready = probing.ready()?;
    arguments.narrow(&mut ready)?;
    arguments.arm.with(&ready, |arm| arguments.run(&probing, &ready, arm))
}

impl ProbeArguments {
    fn flags(&self) -> Result<Vec<Flag>, CliError> {
        let radius = self.search_radius_mm / 1e3;
        if !(radius > 0.0 && radius.is_finite()) {
            return Err(CliError::Usage(format!("--search-radius-mm {} must be above 0", self.search_radius_mm)));
        }
        (1..).zip(&self.features).map(|(id, text)| flag_of(id, text, radius)).collect()
    }

    /// A request can ask for less than the scene allows.
    fn narrow(&self, ready: &mut Ready) -> Result<(), CliError> {
        let by = Narrower { force: self.max_force_n, time: self.max_duration_s, ..Narrower::default() };
        let wanted_mm = ready.tolerance_mm();
        ready.params = ready.params.narrowed(&by).map_err(|error| CliError::Usage(error.to_string()))?;
        let params = &mut ready.params;
        params.slides = self.slide;
        if let Some(touches) = self.max_touches {
            if touches == 0 || touches > params.pattern.budget {
                let most = params.pattern.budget;
                return Err(CliError::Usage(format!(
                    "--max-touches {touches} must be 1 to {most}, as the scene has it"
                )));
            }
            params.pattern.budget = touches;
        }
        if let Some(tolerance_mm) = self.tolerance_mm {
            if !(tolerance_mm > 0.0 && tolerance_mm.is_finite()) {
                return Err(CliError::Usage(format!("--tolerance-mm {tolerance_mm} must be above 0")));
            }
            params.pattern.sigma *= tolerance_mm / wanted_mm;
        }
        Ok(())
    }

    fn run(&self, probing: &Probing<'_>, ready: &Ready, arm: &mut dyn Arm) -> Result<Losses, CliError> {
        let plans = probing.planned(ready, arm)?;
        if self.dry_run {
            let report = DryRunReport::of(probing.flags, &plans, self.out.join("plan.png"));
            if self.json {
                print_result(&serde_json::to_string(&report).expect("numbers and names alone cannot fail"));
            } else {
                print_result(&report.to_string());
            }
            return Ok(Losses::new());
        }
        ready.may_move()?;
        let Done { summary, losses, .. } = probing.done(ready, arm)?;
        if self.json {
            print_result(&serde_json::to_string(&summary).expect("numbers and names alone cannot fail"));
        } else {
            let files: Vec<String> = picture_files(&self.out).iter().map(|path| path.display().to_string()).collect();
            print_result(&format!("{summary}\nwrote {}", files.join(", ")));
        }
        Ok(losses)
    }
}

/// What `--dry-run --json` prints.
#[derive(Debug, Serialize)]
struct DryRunReport {
    features: Vec<PlannedFeature>,
    picture: PathBuf,
}

/// The plan for one flag.
#[derive(Debug, Serialize)]
struct PlannedFeature {
    flag: u32,
    touches: usize,
    slides: usize,
    /// touches that cannot be made
    unreachable: Vec<UnreachableTouch>,
}

#[derive(Debug, Serialize)]
struct UnreachableTouch {
    touch: usize,
    reason: String,
}

impl DryRunReport {
    fn of(flags: &[Flag], plans: &[Plan], picture: PathBuf) -> Self {
        let planned = |(flag, plan): (&Flag, &Plan)| PlannedFeature {
            flag: flag.id,
            touches: plan.touches.len(),
            slides: plan.slides.len(),
            unreachable: plan
                .held_back
                .iter()
                .map(|(touch, reason)| UnreachableTouch { touch: *touch, reason: reason.to_string() })
                .collect(),
        };
        Self { features: flags.iter().zip(plans).map(planned).collect(), picture }
    }
}

/// The verdict, then each feature and what cannot be touched.
impl fmt::Display for DryRunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let touches: usize = self.features.iter().map(|feature| feature.touches).sum();
        let unreachable: usize = self.features.iter().map(|feature| feature.unreachable.len()).sum();
        writeln!(f, "{} of {touches} planned touches can be made; nothing moved", touches - unreachable)?;
        for PlannedFeature { flag, touches, slides, unreachable } in &self.features {
            let slides = if *slides == 0 { String::new() } else { format!(" and {slides} slides") };
            writeln!(f, "feature {flag}: {touches} touches{slides} planned, {} cannot be made", unreachable.len())?;
            unreachable.iter().try_for_each(|one| writeln!(f, "  touch {}: {}", one.touch, one.reason))?;
        }
        write!(f, "wrote {}", self.picture.display())
    }
}
