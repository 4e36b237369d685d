//! Common part of `touchup probe` and `touchup demo --robot sim`: probes features while the mesh
//! follows, and writes all results.

pub(super) mod arm;
mod files;
mod folder;
mod follower;
mod goals;
mod picture;
mod ready;
mod report;
mod world;

use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::common::progress::WorkProgress;
use super::common::refinement::{RefineSummary, RefinementFiles, RefinementResult};
use super::common::signals::StopSignals;
use super::common::told::ToldFlags;
use super::{CliError, Losses, not_written};
use files::{RECORDING, TOUCHES, probe_topics};
use folder::{ProbingFolder, ProbingRequest};
pub(super) use goals::goals_of;
use picture::{draw_plan, draw_touches};
pub(super) use ready::{ProbingSetup, check_temperature};
pub(super) use report::ProbingSummary;
use report::{CheckOfResults, ProbedFile, ProbedRecord};
use touchup_features::features::FeatureKind;
use touchup_io::atomic::create_folder;
use touchup_io::mesh_file::{MeshFile, MeshUnit, read_mesh};
use touchup_io::probed_touches_file::TouchLine;
use touchup_probing::arm::{Arm, ArmState};
use touchup_probing::execute::{Ending, Flag, FlagResult, Plan};
use touchup_session::probing_run::ProbingRun;
use touchup_session::refinement::RefinementOptions;
use touchup_session::replay::RecordedAs;
use touchup_session::session::ResultFiles;
use world::LiveWorld;
pub(super) use world::{KeptMeasurements, SpotWorld};

/// Features to probe, cell, and output files.
pub(super) struct Probing<'a> {
    /// Scene with `robot`.
    pub scene: &'a Path,
    pub scan: &'a Path,
    pub unit: MeshUnit,
    pub flags: &'a [Flag],
    /// Whether the arm is simulated and waits for viewers, unlike a real one.
    pub is_simulated: bool,
    /// Whether to write the mesh despite sure findings.
    pub is_forced: bool,
    pub out: &'a Path,
    /// STEP file, if requested.
    pub step: Option<&'a Path>,
}

/// Results of a probing.
pub(super) struct ProbingOutcome {
    pub summary: ProbingSummary,
    /// Features probed in this run.
    pub probed: Vec<FlagResult>,
    /// Unmet requests, or the reason of the end.
    pub outcome: Result<Losses, CliError>,
}

impl Probing<'_> {
    /// Reads scene and scan.
    pub fn ready(&self) -> Result<ProbingSetup, CliError> {
        let ready = ProbingSetup::read(self.scene, self.scan, self.unit)?;
        create_folder(self.out).map_err(not_written(self.out))?;
        Ok(ready)
    }

    /// Plans all touches and draws the plan; nothing moves.
    ///
    /// - `now`: state of the arm.
    pub fn planned(&self, ready: &ProbingSetup, now: &ArmState) -> Result<Vec<Plan>, CliError> {
        let _planning = WorkProgress::stage("plan");
        let world = ready.static_world()?;
        let run = ProbingRun::new(ready.cell.clone());
        let plan_of = |flag: &Flag| {
            run.plan(&ready.params, flag, now, &world)
                .map_err(|error| CliError::plan(flag.id, error))
        };
        let plans = self
            .flags
            .iter()
            .map(plan_of)
            .collect::<Result<Vec<_>, _>>()?;
        draw_plan(&ready.mesh, &plans, self.flags, &self.out.join("plan.png"))?;
        Ok(plans)
    }

    /// Refuses to overwrite an interrupted probing.
    pub fn check_free(&self) -> Result<(), CliError> {
        ProbingFolder { path: self.out }.check_free()
    }

    /// Probes all flags in order; writes each touch and each feature at once. A stop of the arm or
    /// a signal ends it. Surely wrong measurements prevent a mesh, unless forced.
    ///
    /// - `is_resumed`: skips the finished features of the folder.
    pub fn done(
        &self,
        ready: &ProbingSetup,
        arm: &mut dyn Arm,
        is_resumed: bool,
        signals: &StopSignals,
    ) -> Result<ProbingOutcome, CliError> {
        let folder = ProbingFolder { path: self.out };
        let request = ProbingRequest::new(
            self.scene,
            (self.scan, self.unit),
            self.is_simulated,
            self.flags,
            ready,
        )?;
        let mut file = ProbedFile {
            features: match is_resumed {
                true => folder.resume(&request)?,
                false => folder.check_own().map(|()| Vec::new())?,
            },
            check: Some(CheckOfResults::of(&ready.check)),
        };
        let mut world = LiveWorld::new(ready, self.out, [self.is_simulated, is_resumed], signals)?;
        if !is_resumed {
            folder.begin(&request)?;
        }
        let probed = self.probed(ready, arm, &mut world, &mut file)?;
        signals.arm_is_at_rest();
        let touches = world.finish()?;
        self.concluded(ready, file.features, probed, touches)
    }

    /// Probes the flags without a result in `file`, until one is broken off.
    fn probed(
        &self,
        ready: &ProbingSetup,
        arm: &mut dyn Arm,
        world: &mut LiveWorld<'_>,
        file: &mut ProbedFile,
    ) -> Result<Vec<FlagResult>, CliError> {
        let (mut run, mut probed) = (
            ProbingRun::new(ready.cell.clone()),
            Vec::<FlagResult>::new(),
        );
        for flag in self.flags {
            if file.features.iter().any(|record| record.flag == flag.id) {
                continue;
            }
            let one = run.probe(&ready.params, flag, arm, world);
            world.know(&one.known_surfaces)?;
            file.features.push(ProbedRecord::of(&one, flag));
            file.features.sort_by_key(|record| record.flag);
            // on disk at once, whatever comes after it
            ProbingFolder { path: self.out }.write(file)?;
            let is_over = matches!(one.ending, Ending::Stopped(_) | Ending::Cancelled(_));
            probed.push(one);
            if is_over {
                break;
            }
        }
        Ok(probed)
    }

    /// Makes the mesh, unless the last probing forbids it, and names the losses.
    ///
    /// - `touches`: number of written touches.
    fn concluded(
        &self,
        ready: &ProbingSetup,
        features: Vec<ProbedRecord>,
        probed: Vec<FlagResult>,
        touches: usize,
    ) -> Result<ProbingOutcome, CliError> {
        let path = self.out.join(TOUCHES);
        let places = format!("the touches ({touches}) are in {}", path.display());
        let ended = probed.last().map(|last| &last.ending);
        let (refine, outcome) = match self.without_mesh(&features, ended, &places) {
            Some(error) => (None, Err(error)),
            None => {
                let touched = ProbingFolder { path: self.out }.touches()?;
                let refined = self.refined(&touched);
                if refined.is_ok() {
                    let MeshFile { mesh, .. } =
                        read_mesh(&self.out.join(ResultFiles::MESH), self.unit)?;
                    let drawn = self.out.join("touches.png");
                    draw_touches(&mesh, &touched, &probed, self.flags, &drawn)?;
                }
                self.outcome(&features, ended, &places, refined)
            }
        };
        Ok(ProbingOutcome {
            summary: ProbingSummary {
                check: CheckOfResults::of(&ready.check),
                features,
                told: ready.told.clone(),
                refine,
            },
            probed,
            outcome,
        })
    }

    /// Reason against a mesh, if any.
    ///
    /// - `ended`: ending of the last feature; `places`: of the touches, in words.
    fn without_mesh(
        &self,
        features: &[ProbedRecord],
        ended: Option<&Ending>,
        places: &str,
    ) -> Option<CliError> {
        let next = match ended? {
            Ending::Cancelled(_) => "--resume goes on",
            ending if ending.is_displaced() && !self.is_forced => {
                "no mesh is made of touches that do not hold together"
            }
            _ => return None,
        };
        let is_finished = |record: &&ProbedRecord| record.is_finished();
        let finished = features.iter().filter(is_finished).count();
        let all = self.flags.len();
        Some(CliError::ended(ended?).with(format_args!(
            "{finished} of {all} features are finished, {places}; {next}"
        )))
    }

    /// Summary of the mesh, and the unmet requests or the reason of the end.
    fn outcome(
        &self,
        features: &[ProbedRecord],
        ended: Option<&Ending>,
        places: &str,
        refined: Result<RefinementResult, CliError>,
    ) -> (Option<RefineSummary>, Result<Losses, CliError>) {
        let (refine, mut losses, failed) = match refined {
            Ok(RefinementResult {
                summary, losses, ..
            }) => (Some(summary), losses, None),
            Err(error) => (None, Losses::new(), Some(error)),
        };
        losses.extend(features.iter().filter_map(ProbedRecord::loss));
        let (all, not_begun) = (self.flags.len(), self.flags.len() - features.len());
        if not_begun > 0 {
            losses.push(format!("{not_begun} of {all} flags were not begun"));
        }
        let outcome = match (ended, failed) {
            (Some(ending @ Ending::Stopped(_)), failed) => {
                losses.extend(failed.map(|error| error.message));
                Err(CliError::ended(ending).with(losses.join("; ")))
            }
            (_, Some(failed)) => Err(failed.with(format_args!(
                "{places}; --resume --force makes the mesh of them"
            ))),
            (_, None) => Ok(losses),
        };
        (refine, outcome)
    }

    /// Makes the mesh of the recording in the folder.
    fn refined(&self, touches: &[TouchLine]) -> Result<RefinementResult, CliError> {
        let (scene, told) = ToldFlags::default().scene(Some(self.scene))?;
        let recorded = RecordedAs::from(probe_topics());
        let mut files =
            RefinementFiles::in_folder(self.scan, self.unit, self.out, RECORDING, recorded);
        files.out.step = self.step.map(Path::to_owned);
        let options = RefinementOptions {
            // an arm without any contact has no measurement that could be wrong: each feature says
            // why
            force: self.is_forced || touches.iter().all(|touch| touch.centre_mm.is_none()),
            // the scan may lack any probed feature but a plane
            touches_flaws: self
                .flags
                .iter()
                .any(|flag| flag.kind != Some(FeatureKind::Plane)),
            ..RefinementOptions::default()
        };
        files.refine(scene, told, options)
    }
}

/// Numbers in m from the text A,B,C in mm; `None` if one is no number.
pub(super) fn metres(text: &str) -> Option<Vec<f64>> {
    text.split(',')
        .map(|mm| {
            mm.parse::<f64>()
                .ok()
                .filter(|mm| mm.is_finite())
                .map(|mm| mm / 1e3)
        })
        .collect()
}

/// Place in m from the text X,Y,Z in mm.
pub(super) fn millimetres(flag: &str, text: &str) -> Result<Vector3<f64>, CliError> {
    let place: Option<[f64; 3]> = metres(text).and_then(|place| place.try_into().ok());
    place
        .map(Vector3::from)
        .ok_or_else(|| CliError::usage(format!("{flag} {text} is not X,Y,Z in mm")))
}

/// Flag from the command line.
///
/// - `radius`: default radius, m.
pub(super) fn flag_of(id: u32, text: &str, radius: f64) -> Result<Flag, CliError> {
    const FORM: &str = "KIND@X,Y,Z or KIND@X,Y,Z,RADIUS in mm, with KIND hole, slot, pocket, boss, edge, plane or unknown";
    let wrong = || CliError::usage(format!("--feature {text} is not {FORM}"));
    let (name, numbers) = text.split_once('@').ok_or_else(wrong)?;
    let kind = FeatureKind::of_name(name);
    let (place, radius) = match metres(numbers).ok_or_else(wrong)?[..] {
        _ if kind.is_none() && name != "unknown" => return Err(wrong()),
        [x, y, z] => (Point3::new(x, y, z), radius),
        [x, y, z, radius] if radius > 0.0 => (Point3::new(x, y, z), radius),
        _ => return Err(wrong()),
    };
    Ok(Flag {
        id,
        kind,
        place,
        radius,
    })
}
