//! `touchup refine`: a scan and a recording in, the refined mesh out.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::latency::{Latencies, Quantiles};
use super::replay::{replay, wrench_frame};
use super::{CliError, Losses, tell};
use crate::io::mesh_file::{MeshFile, MeshFileError, MeshUnit, check_target, read_mesh, write_mesh};
use crate::io::recording::{RecordingReader, Topics};
use crate::mesh::{TriMesh, VertexId};
use crate::refine::{RefineError, Refiner};
use crate::scene::{Mode, Scene};
use crate::touch::Synchroniser;

#[derive(Debug, Args)]
pub(super) struct RefineArguments {
    /// The scan: PLY, STL or OBJ
    #[arg(long, value_name = "MESH")]
    scan: PathBuf,
    /// The touches: a ROS 2 recording, MCAP or SQLite, a file or a folder
    #[arg(long, value_name = "RECORDING")]
    bag: PathBuf,
    /// Where the refined mesh goes: PLY, STL or OBJ, in the unit of the scan
    #[arg(long, value_name = "MESH")]
    out: PathBuf,
    /// Unit of the coordinates in the scan's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Names the parts and their parameters; the flags below override it
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    /// geometry_msgs/WrenchStamped: what the part does to the stylus
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/wrench")]
    wrench_topic: String,
    /// geometry_msgs/PoseStamped: centre of the ball in the frame of the scan
    #[arg(long, value_name = "TOPIC", default_value = "/stylus/pose")]
    pose_topic: String,
    /// Radius of the ball, mm
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    tip_radius_mm: Option<f64>,
    /// Stiffness of stylus and holder at the ball, N/mm
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    stiffness_n_per_mm: Option<f64>,
    /// Standard deviation of the scan from the true surface, mm
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    scan_noise_mm: Option<f64>,
    /// The repaired method, or the paper's taken literally
    #[arg(long)]
    mode: Option<Mode>,
    /// Prints the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// What `--json` prints; times in s, `push_ns` in ns.
#[derive(Debug, Serialize)]
struct Summary {
    /// wrenches of the recording: each could be a sample
    samples: u64,
    /// those that the refiner took
    accepted: u64,
    /// those that it did not, by reason; `pose_…` are lost poses and not samples
    refused: BTreeMap<String, u64>,
    /// times that the stylus came into contact
    contacts: u64,
    /// faces that are not where the scan had them
    moved_faces: u64,
    /// updates made smaller because a face would have folded
    cut_back: u64,
    /// of one sample through the whole chain
    push_ns: Quantiles,
    load_s: f64,
    replay_s: f64,
}

const NOTHING_MOVES: &str = "the scene names no `refine`, so nothing would move the mesh: add `refine:` to it";

pub(super) fn refine(arguments: &RefineArguments) -> Result<Losses, CliError> {
    let scene = arguments.scene()?;
    arguments.check_out()?;
    let topics = Topics { pose: arguments.pose_topic.clone(), wrench: arguments.wrench_topic.clone() };
    let started = Instant::now();
    let MeshFile { mesh, repair } = read_mesh(&arguments.scan, arguments.mesh_unit).map_err(CliError::ReadMesh)?;
    let wrench_frame = wrench_frame(&arguments.bag, &topics).map_err(CliError::ReadRecording)?;
    let recording = RecordingReader::open(&arguments.bag, &topics).map_err(CliError::ReadRecording)?;
    let mut sync = Synchroniser::new(scene.sync_params())?;
    let params = scene.refine_params(wrench_frame).ok_or_else(|| CliError::Usage(NOTHING_MOVES.to_owned()))?;
    let as_scanned = mesh.clone();
    let mut refiner = Refiner::new(mesh, params)?;
    let load_s = started.elapsed().as_secs_f64();

    let started = Instant::now();
    let mut latencies = Latencies::new();
    let (mut accepted, mut refused) = (0, BTreeMap::<String, u64>::new());
    let replayed = replay(recording, &mut sync, |sample| {
        let begun = Instant::now();
        let pushed = refiner.push(sample);
        latencies.record(begun.elapsed());
        match pushed {
            Ok(_) => accepted += 1,
            Err(error) => *refused.entry(reason_of(&error).to_owned()).or_default() += 1,
        }
    })
    .map_err(CliError::ReadRecording)?;
    let replay_s = started.elapsed().as_secs_f64();
    write_mesh(&arguments.out, refiner.mesh(), arguments.mesh_unit).map_err(CliError::WriteMesh)?;

    refused.extend(replayed.refused);
    let counts = refiner.counts();
    let summary = Summary {
        samples: replayed.wrenches,
        accepted,
        refused,
        contacts: counts.contacts,
        moved_faces: moved_faces(&as_scanned, refiner.mesh()),
        cut_back: counts.cut_back,
        push_ns: latencies.quantiles(),
        load_s,
        replay_s,
    };
    if arguments.json {
        tell(&serde_json::to_string(&summary).expect("numbers and names alone cannot fail"));
    } else {
        tell(&format!("scan: {repair}\n{summary}\nwrote {}", arguments.out.display()));
    }
    Ok(replayed.losses)
}

/// Why the refiner did not take a sample. The synchroniser lets only checked samples out, in order of time, so that what
/// is left here is a step whose result is no number.
fn reason_of(error: &RefineError) -> &'static str {
    match error {
        RefineError::Sample(_) => "sample",
        RefineError::Setting(_) | RefineError::Dynamics(_) => "dynamics",
        RefineError::Mesh(_) => "mesh",
    }
}

/// Faces of which a corner is not where it was.
fn moved_faces(before: &TriMesh, after: &TriMesh) -> u64 {
    let is_moved = |corners: [VertexId; 3]| corners.iter().any(|&v| before.position(v) != after.position(v));
    after.faces().filter(|&(_, corners)| is_moved(corners)).count() as u64
}

impl RefineArguments {
    /// The work is not begun when its result cannot be kept.
    fn check_out(&self) -> Result<(), CliError> {
        check_target(&self.out).map_err(|error| match error {
            MeshFileError::UnknownFormat { path } => {
                CliError::Usage(format!("--out {} must end in .ply, .stl or .obj", path.display()))
            }
            error => CliError::WriteMesh(error),
        })
    }

    /// The scene with the flags over it.
    fn scene(&self) -> Result<Scene, CliError> {
        let mut scene = self.scene.as_deref().map_or_else(|| Ok(Scene::default()), Scene::read)?;
        if let Some(radius_mm) = self.tip_radius_mm {
            scene.tip.get_or_insert_default().radius_mm = radius_mm;
        }
        if let Some(stiffness) = self.stiffness_n_per_mm {
            scene.tip.get_or_insert_default().stiffness_n_per_mm = Some(stiffness);
        }
        if let Some(noise_mm) = self.scan_noise_mm {
            scene.scan.get_or_insert_default().noise_mm = noise_mm;
        }
        if let Some(mode) = self.mode {
            scene.refine.get_or_insert_default().mode = mode;
        }
        // the file was in range when it was read: what is not now came by a flag
        scene.check().map_err(|error| CliError::Usage(error.to_string()))?;
        Ok(scene)
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let refused: Vec<_> = self.refused.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
        let Quantiles { median, p99, p999, max } = self.push_ns;
        writeln!(f, "samples: {} read, {} accepted; refused: {}", self.samples, self.accepted, list(&refused))?;
        writeln!(
            f,
            "contacts: {}; faces moved: {}; updates cut back: {}",
            self.contacts, self.moved_faces, self.cut_back
        )?;
        write!(f, "push: median {median} ns, p99 {p99} ns, p99.9 {p999} ns, max {max} ns; ")?;
        write!(f, "loaded in {:.2} s, replayed in {:.2} s", self.load_s, self.replay_s)
    }
}

fn list(items: &[String]) -> String {
    if items.is_empty() { "none".to_owned() } else { items.join(", ") }
}
