//! What `touchup probe` and `touchup demo --robot sim` share: features are probed while the mesh follows, and all results are
//! written.

mod picture;
mod report;
mod world;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use tracing::info;

use super::progress::WorkProgress;
use super::refine::{RefineArguments, Refined};
use super::{CliError, Losses, not_written, require, write_json};
use crate::features::Kind;
use crate::io::atomic::create_folder;
use crate::io::mesh_file::{MeshFile, MeshUnit, read_mesh};
use crate::io::probed_touches_file::write_probed_touches;
use crate::io::recording::{Topics, write_recording};
use crate::mesh::{FaceTree, TriMesh};
use crate::probing::arm::Arm;
use crate::probing::execute::{Cell, Ending, Flag, Plan, ProbeParams, Probed, Prober, StaticWorld, plan};
use crate::scene::{Scene, simulated_arm};
use crate::sim::ArmParams;
use picture::{draw_plan, draw_touches};
pub(super) use report::ProbingSummary;
use report::records;
use world::LiveWorld;

/// Frame of the poses in the recording: the base of the arm.
const BASE_FRAME: &str = "base";
/// Frame of the wrenches: the probe's own.
const PROBE_FRAME: &str = "probe";

/// The features to probe, the cell, and the output files.
pub(super) struct Probing<'a> {
    /// with `robot`
    pub scene: &'a Path,
    pub scan: &'a Path,
    pub unit: MeshUnit,
    pub flags: &'a [Flag],
    /// the simulated arm waits for viewers; a real one does not
    pub is_simulated: bool,
    pub out: &'a Path,
}

/// A prepared probing.
pub(super) struct Ready {
    pub cell: Cell,
    pub params: ProbeParams,
    pub scene: Scene,
    mesh: TriMesh,
}

/// Its results.
pub(super) struct Done {
    pub summary: ProbingSummary,
    pub probed: Vec<Probed>,
    pub losses: Losses,
}

const NO_ROBOT: &str = "the scene names no `robot`, so the pose of the arm's base and its allowed volume are unknown: add \
                        `robot:` to it (config/probe.yaml is an example)";

const NO_MOTION: &str =
    "the scene does not allow the arm to move: look at plan.png first, then put `allow_motion: true` under `robot`";

fn probe_topics() -> Topics {
    Topics { pose: "/probe/pose".to_owned(), wrench: "/probe/wrench".to_owned(), markers: None }
}

impl Ready {
    /// Reads scene and scan.
    pub fn read(scene: &Path, scan: &Path, unit: MeshUnit) -> Result<Self, CliError> {
        let scene = Scene::read(scene)?;
        let (cell, params) = scene.probing().ok_or_else(|| CliError::usage(NO_ROBOT))?;
        let MeshFile { mesh, repair } = read_mesh(scan, unit)?;
        info!(%repair, "scan");
        Ok(Self { cell, params, scene, mesh })
    }

    /// A simulated arm of this cell.
    pub fn simulated_arm(&self, seed: u64) -> ArmParams {
        ArmParams { seed, ..simulated_arm(&self.cell, &self.params) }
    }

    /// The scan, unchanged during probing.
    pub fn static_world(&self) -> StaticWorld {
        StaticWorld::new(self.mesh.clone())
    }

    /// Target half width of the scene, mm.
    pub fn tolerance_mm(&self) -> f64 {
        self.scene.robot.as_ref().map_or(f64::NAN, |robot| robot.tolerance * 1e3)
    }

    /// Whether the scene allows motion.
    ///
    /// # Errors
    /// [`CliError::usage`]
    pub fn may_move(&self) -> Result<(), CliError> {
        require(self.scene.robot.as_ref().is_some_and(|robot| robot.allow_motion), NO_MOTION)
    }
}

impl Probing<'_> {
    /// Reads scene and scan.
    pub fn ready(&self) -> Result<Ready, CliError> {
        let ready = Ready::read(self.scene, self.scan, self.unit)?;
        create_folder(self.out).map_err(not_written(self.out))?;
        Ok(ready)
    }

    /// Plans all touches and draws the plan; nothing moves.
    pub fn planned(&self, ready: &Ready, arm: &mut dyn Arm) -> Result<Vec<Plan>, CliError> {
        let _planning = WorkProgress::stage("plan");
        let now = arm.next_state().map_err(CliError::arm)?;
        let world = ready.static_world();
        let plan_of = |flag: &Flag| {
            plan(&ready.cell, &ready.params, &world, flag, &now).map_err(|error| CliError::plan(flag.id, error))
        };
        let plans = self.flags.iter().map(plan_of).collect::<Result<Vec<_>, _>>()?;
        draw_plan(&ready.mesh, &plans, self.flags, &self.out.join("plan.png"))?;
        Ok(plans)
    }

    /// Probes all flags, in their order, and writes all results. A stop of the arm ends it; what was measured until then is
    /// written.
    pub fn done(&self, ready: &Ready, arm: &mut dyn Arm) -> Result<Done, CliError> {
        let scan = Arc::new((ready.mesh.clone(), FaceTree::new(&ready.mesh)));
        let mut world = LiveWorld::new(scan, &ready.scene, &ready.cell, self.is_simulated)?;
        let mut probed = Vec::new();
        for flag in self.flags {
            probed.push(Prober::new(arm, &ready.cell, &ready.params, &mut world).probe(flag));
            if probed.last().is_some_and(|one| matches!(one.ending, Ending::Stopped(_) | Ending::Cancelled(_))) {
                break;
            }
        }
        // whatever becomes of the mesh, what was measured is kept
        let features = records(&probed, self.flags);
        write_json(&self.out.join("probed.json"), &BTreeMap::from([("features", &features)]))?;
        let path = self.out.join("probed_touches.jsonl");
        write_probed_touches(&probed, ready.params.pattern.ball_radius, &path).map_err(not_written(&path))?;
        let messages = world.finish()?;
        let bag = self.out.join("touch.mcap");
        write_recording(&bag, &probe_topics(), BASE_FRAME, PROBE_FRAME, messages).map_err(CliError::not_written)?;
        let (scan, scene) = (self.scan.to_owned(), Some(self.scene.to_owned()));
        let arguments = RefineArguments::in_folder(scan, self.unit, self.out, scene, probe_topics());
        let Refined { summary: refine, mut losses, .. } = arguments.refined()?;
        let is_found =
            |one: &&Probed| matches!(one.ending, Ending::ToleranceReached | Ending::TouchesSpent | Ending::TimeSpent);
        losses.extend(
            probed.iter().filter(|one| !is_found(one)).map(|one| format!("feature {}: {}", one.flag, one.ending)),
        );
        let not_begun = self.flags.len() - probed.len();
        if not_begun > 0 {
            losses.push(format!("{not_begun} of {} flags were not begun", self.flags.len()));
        }
        let MeshFile { mesh, .. } = read_mesh(&self.out.join("refined.ply"), self.unit)?;
        draw_touches(&mesh, &probed, self.flags, &self.out.join("touches.png"))?;
        Ok(Done { summary: ProbingSummary { features, refine }, probed, losses })
    }
}

/// Numbers that were written A,B,C in mm, m; `None` where one is no number.
fn metres(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|mm| mm.parse::<f64>().ok().filter(|mm| mm.is_finite()).map(|mm| mm / 1e3)).collect()
}

/// A place that was written X,Y,Z in mm, m.
pub(super) fn millimetres(flag: &str, text: &str) -> Result<Vector3<f64>, CliError> {
    let place: Option<[f64; 3]> = metres(text).and_then(|place| place.try_into().ok());
    place.map(Vector3::from).ok_or_else(|| CliError::usage(format!("{flag} {text} is not X,Y,Z in mm")))
}

/// A flag of a command line.
///
/// - `radius`: m, where it names none.
pub(super) fn flag_of(id: u32, text: &str, radius: f64) -> Result<Flag, CliError> {
    const FORM: &str =
        "KIND@X,Y,Z or KIND@X,Y,Z,RADIUS in mm, with KIND hole, slot, pocket, boss, edge, plane or unknown";
    let wrong = || CliError::usage(format!("--feature {text} is not {FORM}"));
    let (name, numbers) = text.split_once('@').ok_or_else(wrong)?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.name() == name);
    match metres(numbers).ok_or_else(wrong)?[..] {
        _ if kind.is_none() && name != "unknown" => Err(wrong()),
        [x, y, z] => Ok(Flag { id, kind, place: Point3::new(x, y, z), radius }),
        [x, y, z, radius] if radius > 0.0 => Ok(Flag { id, kind, place: Point3::new(x, y, z), radius }),
        _ => Err(wrong()),
    }
}
