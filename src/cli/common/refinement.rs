//! Refinement from files to files, for all refining verbs.

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;
use tracing::warn;

use super::progress::WorkProgress;
use super::told::{ToldNumbers, ToldScene};
use crate::cli::{CliError, Losses, by_reason, not_written};
use touchup_geometry::mesh::RepairReport;
use touchup_io::atomic::write_atomically;
use touchup_io::mesh_file::MeshUnit;
use touchup_method::reconstruct::CloudSummary;
use touchup_session::live::Quantiles;
use touchup_session::refinement::{
    AcceptedFinding, AcceptedScene, InputNames, OpenedInput, RefinedScan, Refinement,
    RefinementError, RefinementOptions, RefinementSummary,
};
use touchup_session::replay::RecordedAs;
use touchup_session::scene::{LeftOut, Memory, Scene, SceneCost};
use touchup_session::session::{ResultFiles, StepFileSummary};

/// Input and output files of a refinement.
#[derive(Clone, Debug)]
pub(in crate::cli) struct RefinementFiles {
    pub scan: PathBuf,
    /// Unit of the scan and of the refined mesh.
    pub mesh_unit: MeshUnit,
    pub recording: PathBuf,
    pub recorded: RecordedAs,
    pub out: ResultFiles,
}

/// Output of `--json`; times in s.
#[derive(Debug, Serialize)]
pub(in crate::cli) struct RefineSummary {
    /// Stages built from the scene, omitted ones with reasons, and the memory at start.
    scene: SceneCost,
    /// Numbers of tip and scan, and their sources.
    told: ToldNumbers,
    /// What was taken off by settings of the scene; absent without anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    taken_off: Option<AcceptedSummary>,
    /// Origin of the scan in a point cloud; absent for a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    cloud: Option<CloudSummary>,
    #[serde(flatten)]
    refinement: RefinementSummary,
    /// Faces of the STEP file; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<StepFileSummary>,
    load_s: f64,
    replay_s: f64,
}

/// What was taken off.
#[derive(Debug, Serialize)]
struct AcceptedSummary {
    /// File of the scene that was used.
    scene: String,
    /// The findings, one after the other.
    findings: Vec<AcceptedFinding>,
}

/// A refined scan before it is written; times in s.
struct MadeRefinement {
    refined: RefinedScan,
    repair: RepairReport,
    cloud: Option<CloudSummary>,
    cost: SceneCost,
    load_s: f64,
    replay_s: f64,
}

/// What remains of a change.
const PARTLY_KNOWN: &str = "what is unknown of a change is still in the mesh";
/// Name of the scene with what was taken off.
const ACCEPTED_SCENE: &str = "accepted_scene.yaml";

/// The file of the scene with what was taken off, beside a mesh.
pub(in crate::cli) fn accepted_scene_beside(mesh: &Path) -> PathBuf {
    mesh.with_file_name(ACCEPTED_SCENE)
}

/// Result of refining a scan.
pub(in crate::cli) struct RefinementResult {
    /// Repairs of the scan's file.
    pub repair: RepairReport,
    pub summary: RefineSummary,
    pub losses: Losses,
}

impl RefinementFiles {
    /// Writes refined.ply, features.json and touches.csv into the folder of the recording.
    ///
    /// - `recording`: its name in `folder`.
    pub fn in_folder(
        scan: &Path,
        mesh_unit: MeshUnit,
        folder: &Path,
        recording: &str,
        recorded: RecordedAs,
    ) -> Self {
        Self {
            scan: scan.to_owned(),
            mesh_unit,
            recording: folder.join(recording),
            recorded,
            out: ResultFiles::in_folder(folder),
        }
    }

    /// Reads scan and recording, refines, and writes mesh, features and touches.
    ///
    /// - `told`: sources of the numbers in `scene`.
    pub fn refine(
        &self,
        scene: Scene,
        told: ToldNumbers,
        options: RefinementOptions,
    ) -> Result<RefinementResult, CliError> {
        self.written(self.made(scene, options)?, told)
    }

    /// As [`Self::refine`], and takes sure findings off by settings of the scene, which it then
    /// writes beside the mesh.
    pub fn refine_accepting(
        &self,
        base: &ToldScene,
        options: RefinementOptions,
    ) -> Result<RefinementResult, CliError> {
        let mut accepted = AcceptedScene::new(base.scene.clone());
        let made = loop {
            match self.made(accepted.scene.clone(), options.clone()) {
                Err(RefinementError::Unsound { finding, .. }) if accepted.take_off(&finding)? => {}
                made => break made?,
            }
        };
        if accepted.findings.is_empty() {
            return self.written(made, base.numbers.clone());
        }
        let scene = accepted_scene_beside(&self.out.mesh);
        let text = base.accepted_text(&accepted, &scene)?;
        let told = ToldNumbers::of(&accepted.scene, &text, [None; 3]);
        let mut result = self.written(made, told)?;
        write_atomically(&scene, |file| file.write_all(text.as_bytes()))
            .map_err(not_written(&scene))?;
        let partly = accepted.findings.iter().filter(|of| !of.is_whole());
        let partly = partly.map(|of| format!("{PARTLY_KNOWN}: {}", of.finding.measured));
        result.losses.extend(partly);
        result.summary.taken_off = Some(AcceptedSummary {
            scene: scene.display().to_string(),
            findings: accepted.findings,
        });
        Ok(result)
    }

    /// Reads scan and recording, and refines.
    fn made(
        &self,
        scene: Scene,
        options: RefinementOptions,
    ) -> Result<MadeRefinement, RefinementError> {
        let started = Instant::now();
        let OpenedInput {
            input,
            repair,
            cloud,
            recording,
            markers,
        } = OpenedInput::open(
            scene,
            (&self.scan, self.mesh_unit),
            (&self.recording, &self.recorded),
        )?;
        let mut refinement = Refinement::new(input, recording.wrench_frame, options)?;
        let load_s = started.elapsed().as_secs_f64();
        let cost = self.cost(&refinement);

        let started = Instant::now();
        let mut progress = WorkProgress::new("replay", recording.message_count());
        refinement.replay(recording, markers, &mut || progress.step())?;
        drop(progress);
        let replay_s = started.elapsed().as_secs_f64();
        let _stage = WorkProgress::stage("reconstruct");
        let names = InputNames {
            scan: &self.scan,
            recording: &self.recording,
        };
        Ok(MadeRefinement {
            refined: refinement.finish(names)?,
            repair,
            cloud,
            cost,
            load_s,
            replay_s,
        })
    }

    fn written(
        &self,
        made: MadeRefinement,
        told: ToldNumbers,
    ) -> Result<RefinementResult, CliError> {
        let MadeRefinement {
            refined,
            repair,
            cloud,
            cost,
            load_s,
            replay_s,
        } = made;
        let RefinedScan {
            mesh,
            summary: refinement,
            losses,
        } = refined;
        refinement
            .findings
            .iter()
            .for_each(|finding| warn!("{finding}"));
        let stage = WorkProgress::stage("write");
        let written = self.out.write(mesh, &self.scan, self.mesh_unit)?;
        let step = written.transpose()?;
        drop(stage);
        let summary = RefineSummary {
            scene: cost,
            told,
            taken_off: None,
            cloud,
            refinement,
            step,
            load_s,
            replay_s,
        };
        Ok(RefinementResult {
            repair,
            summary,
            losses,
        })
    }

    /// Stages built from the scene for these samples.
    fn cost(&self, refinement: &Refinement) -> SceneCost {
        let unused = [
            LeftOut {
                part: "robot",
                reason: "a replay moves no arm",
            },
            LeftOut {
                part: "markers",
                reason: "the recording is read for poses",
            },
        ];
        let unused = match self.recorded.markers_topic {
            Some(_) => &unused[..1],
            None => &unused,
        };
        let input = refinement.input();
        SceneCost {
            parts: input.scene.built(unused, &touchup_node::FEATURES),
            memory: Memory::of(refinement.footprint(), input.bytes()),
        }
    }
}

impl RefineSummary {
    /// Counts of samples, timings, and the stages built from the scene.
    pub fn details(&self) -> String {
        let RefinementSummary {
            samples,
            accepted,
            refused,
            cut_back,
            push_ns,
            outcome,
            ..
        } = &self.refinement;
        let refused = by_reason(refused);
        let Quantiles {
            median,
            p99,
            p999,
            max,
        } = push_ns;
        let mut lines = vec![
            format!("samples: {samples} read, {accepted} accepted; refused: {refused}"),
            format!(
                "faces moved: {}; updates cut back: {cut_back}",
                outcome.moved_faces
            ),
        ];
        lines.extend(
            outcome
                .patch
                .as_ref()
                .map(|patch| format!("reconstruction: {:.2} s", patch.build_s)),
        );
        lines.push(format!(
            "time of a sample: median {median} ns, p99 {p99} ns, p99.9 {p999} ns, max {max} ns"
        ));
        lines.push(format!(
            "loaded in {:.2} s, replayed in {:.2} s",
            self.load_s, self.replay_s
        ));
        lines.push(self.scene.to_string());
        lines.join("\n")
    }
}

/// Verdict, then further results.
impl fmt::Display for RefineSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.refinement.verdict(), self.told)?;
        if let Some(AcceptedSummary { scene, findings }) = &self.taken_off {
            let mut findings = findings.iter().map(|of| &of.finding.measured);
            findings.try_for_each(|measured| write!(f, "\ntaken off: {measured}"))?;
            write!(f, "\nscene with what was taken off: {scene}")?;
        }
        match self.refinement.to_string() {
            further if further.is_empty() => {}
            further => write!(f, "\n{further}")?,
        }
        match &self.step {
            Some(step) => write!(f, "\nSTEP: {step}"),
            None => Ok(()),
        }
    }
}
