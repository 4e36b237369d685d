//! `touchup simulate`: scan and touches of a known surface by a bad scanner and a stylus, as input
//! files of `refine`.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};
use nalgebra::{Unit, Vector3};
use tracing::warn;

use super::common::progress::WorkProgress;
use super::simulated_world::{OffFactor, world_named, write_told_scene, write_truth};
use super::{CliError, Losses, check_kept, not_written, print_result, require};
use touchup_geometry::mesh::TriMesh;
use touchup_io::atomic::{create_folder, write_atomically};
use touchup_io::mesh_file::{MeshUnit, write_mesh};
use touchup_io::recording::{Record, Topics, write_recording};
use touchup_method::names;
use touchup_method::stylus::{MarkerFrame, Message};
use touchup_session::scan::{Scan, read_scan};
use touchup_sim::{
    CameraParams, DrawnWorld, Habit, MeshSurface, PathParams, ScannerParams, SimError, SimWorld,
    Stroke, StylusParams, Surface, Touch, TrueState, plan_sides, scan, see_markers, touch,
};

/// File of the true part, in the output folder.
const TRUTH_NAME: &str = "truth.ply";
/// File of the true contacts, in the output folder: one in `CONTACT_EVERY` ticks of 1 ms.
const CONTACTS_NAME: &str = "truth_contacts.csv";
const CONTACT_EVERY: usize = 10;
const CONTACTS_HEAD: &str =
    "t_s,centre_x_mm,centre_y_mm,centre_z_mm,contact_x_mm,contact_y_mm,contact_z_mm\n";
/// Tip radii, mm. The hand moves 0.08 mm in each tick of the simulation: a smaller ball would go
/// through the part, at endless run time.
const TIP_RADII_MM: RangeInclusive<f64> = 0.1..=100.0;
/// Frame of the poses in the recordings.
const OBJECT_FRAME: &str = "object";
/// Frame of the wrenches: the stylus' own.
const STYLUS_FRAME: &str = "stylus";
/// Topic of the markers.
const MARKERS_TOPIC: &str = "/stylus/markers";

#[derive(Debug, Args)]
pub(super) struct SimulateArguments {
    /// True part: a closed mesh, PLY, STL or OBJ
    #[arg(long, value_name = "MESH")]
    truth: PathBuf,
    /// Unit of the coordinates in the part's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
    /// Folder for truth.ply, scan.ply (both in mm) and touch.mcap
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: SimulationSettings,
    /// Also writes the markers on the stylus, with occlusion, swaps and outliers, as the topic
    /// /stylus/markers
    #[arg(long)]
    markers: bool,
}

/// Settings of a simulated scan and touch.
#[derive(Clone, Debug, Args)]
pub struct SimulationSettings {
    /// Seed of the scan and the path
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Draws true values without a flag from the ranges of a world, and writes a calibration of it
    /// as scene.yaml (for refine --scene) and each true value as truth.json: workshop_stylus,
    /// optical_tracker, ur, soft_probe, careless_operator
    #[arg(long, value_name = "NAME", value_parser = world_named, conflicts_with = "markers")]
    pub world: Option<SimWorld>,
    /// Factor of the calibration errors relative to the scene's uncertainties: 3 for all, radius=3
    /// for one (radius, stiffness, tip-offset, registration, clock, tare); repeat for each
    #[arg(long, value_name = "FACTOR", requires = "world")]
    pub told_off: Vec<OffFactor>,
    /// True radius of the ball, mm [default: 1.5, or as the world draws it]
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    pub tip_radius_mm: Option<f64>,
    /// True stiffness of stylus and holder at the ball, N/mm [default: 20, or as the world draws
    /// it]
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    pub stiffness_n_per_mm: Option<f64>,
    /// Coefficient of friction between ball and part [default: 0.15, or as the world draws it]
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    pub friction: Option<f64>,
    /// Median edge of the scan's triangles, mm [default: 2.4, or as the world draws it]
    #[arg(long, value_name = "E", allow_negative_numbers = true)]
    pub scan_edge_mm: Option<f64>,
    /// Noise of the scan along its normals, mm [default: 0.6, or as the world draws it]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub scan_noise_mm: Option<f64>,
    /// Quality of the scanner [default: cheap, or as the world draws it]
    #[arg(long, value_enum)]
    pub scanner: Option<ScannerKind>,
    /// Sides from which the hand reaches the part, by the axis that points there: z,x,-y
    #[arg(
        long,
        value_name = "AXES",
        value_delimiter = ',',
        default_value = "z",
        allow_hyphen_values = true
    )]
    pub sides: Vec<Side>,
}

names! {
    /// Quality of a scanner.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
    pub enum ScannerKind {
        /// Hand-held: noisy, rounded, holes closed over
        Cheap = "cheap",
        /// Stationary: fine and exact, without the floors of deep holes
        Good = "good",
    }
}

/// Side of the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Direction towards the hand, in O.
    towards: Unit<Vector3<f64>>,
}

impl FromStr for Side {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (sign, axis) = text
            .strip_prefix('-')
            .map_or((1.0, text), |axis| (-1.0, axis));
        let axis = match axis {
            "x" => Vector3::x(),
            "y" => Vector3::y(),
            "z" => Vector3::z(),
            _ => return Err(format!("{text} is no side: give x, -x, y, -y, z or -z")),
        };
        Ok(Self {
            towards: Unit::new_unchecked(axis * sign),
        })
    }
}

/// Runs `touchup simulate`: scans the part from above (along −z), touches it from its sides, and
/// prints the folder.
pub(super) fn simulate(arguments: &SimulateArguments) -> Result<Losses, CliError> {
    arguments.settings.check()?;
    check_kept("--truth", &arguments.truth, &arguments.out.join(TRUTH_NAME))?;
    let Scan {
        mesh: truth,
        repair,
        ..
    } = read_scan(&arguments.truth, arguments.mesh_unit)?;
    if repair.boundary_edges > 0 {
        warn!(
            "{} edges of the part are open: near them inside and outside are guessed",
            repair.boundary_edges
        );
    }
    let surface = MeshSurface::new(&truth)?;
    let world = arguments.settings.world()?;
    let camera = arguments.markers.then(CameraParams::default);
    let stage = WorkProgress::stage("strokes");
    let path = world.path(&surface, &arguments.settings.sides)?;
    drop(stage);
    let (
        out,
        SimulationWorld {
            scanner,
            stylus,
            drawn,
        },
    ) = (&arguments.out, world);
    let SimulatedInput { scan, touch } = write_simulation(
        &surface,
        &truth,
        &path,
        &scanner,
        &stylus,
        camera.as_ref(),
        out,
    )?;
    if let Some(drawn) = &drawn {
        write_told_scene(drawn, DrawnWorld::lever(&surface), &out.join("scene.yaml"))?;
        write_truth(drawn, &out.join("truth.json"))?;
    }
    let seconds = touch.moments.last().map_or(0.0, |moment| moment.t);
    let of_world = drawn.as_ref().map_or_else(String::new, |drawn| {
        format!("world: {}\n", drawn.world.name())
    });
    print_result(&format!(
        "{of_world}scan: {} faces\ntouched for {seconds:.0} s of simulated time: {} messages\nwrote {}",
        scan.face_count(),
        touch.messages.len(),
        out.display()
    ))?;
    Ok(Losses::new())
}

/// True scanner, stylus and hand, and their world.
struct SimulationWorld {
    scanner: ScannerParams,
    stylus: StylusParams,
    drawn: Option<DrawnWorld>,
}

impl SimulationWorld {
    fn path(&self, surface: &dyn Surface, sides: &[Side]) -> Result<Vec<Stroke>, SimError> {
        let hand = PathParams {
            radius: self.stylus.radius,
            ..PathParams::default()
        };
        let habit = self
            .drawn
            .as_ref()
            .map_or(Habit::Slide, |drawn| drawn.habit);
        let sides: Vec<_> = sides.iter().map(|side| side.towards).collect();
        plan_sides(surface, &sides, habit, &hand)
    }
}

/// Scan and touch of a part, without files.
#[derive(Debug)]
pub struct Simulation {
    /// Scan of the part.
    pub scan: TriMesh,
    /// Touch of the part.
    pub touch: Touch,
    /// Calibration of the world, as the text of a scene; `None` without a world.
    pub scene: Option<String>,
}

impl SimulationSettings {
    /// Scans and touches a part.
    ///
    /// - `truth`: the part, closed, m.
    ///
    /// # Errors
    /// [`CliError`] for settings out of their range and for an untouchable part.
    pub fn simulated(&self, truth: &TriMesh) -> Result<Simulation, CliError> {
        self.check()?;
        let surface = MeshSurface::new(truth)?;
        let world = self.world()?;
        let path = world.path(&surface, &self.sides)?;
        let scan = scan(&surface, &world.scanner)?;
        let touch = touch(&surface, &path, &world.stylus, world.scanner.seed)?;
        let scene = world
            .drawn
            .map(|drawn| drawn.told_scene(DrawnWorld::lever(&surface)));
        Ok(Simulation { scan, touch, scene })
    }

    fn check(&self) -> Result<(), CliError> {
        let Some(given) = self.tip_radius_mm else {
            return Ok(());
        };
        let (smallest, largest) = (TIP_RADII_MM.start(), TIP_RADII_MM.end());
        let why = format!("--tip-radius-mm {given} must be {smallest} to {largest} mm");
        require(TIP_RADII_MM.contains(&given), why)
    }

    /// World as drawn, with the named values in place.
    fn world(&self) -> Result<SimulationWorld, CliError> {
        let off = OffFactor::joined(&self.told_off)?;
        let mut drawn = self
            .world
            .map(|world| world.draw_told_off(self.seed, &off))
            .transpose()?;
        let usual = || (ScannerParams::default(), StylusParams::default());
        let (mut scanner, mut stylus) = drawn
            .as_ref()
            .map_or_else(usual, |drawn| (drawn.scanner, drawn.stylus));
        if let Some(kind) = self.scanner {
            scanner = if kind == ScannerKind::Good {
                ScannerParams::good()
            } else {
                ScannerParams::default()
            };
            if let Some(drawn) = &mut drawn {
                drawn.set_truth("scan_edge", scanner.edge);
                drawn.set_truth("scan_noise", scanner.noise);
            }
        }
        scanner.seed = self.seed;
        for (given, unit, name, place) in [
            (self.tip_radius_mm, 1e-3, "tip_radius", &mut stylus.radius),
            (
                self.stiffness_n_per_mm,
                1e3,
                "stiffness",
                &mut stylus.stiffness,
            ),
            (self.friction, 1.0, "friction", &mut stylus.friction),
            (self.scan_edge_mm, 1e-3, "scan_edge", &mut scanner.edge),
            (self.scan_noise_mm, 1e-3, "scan_noise", &mut scanner.noise),
        ] {
            let Some(given) = given else { continue };
            *place = given * unit;
            if let Some(drawn) = &mut drawn {
                drawn.set_truth(name, given * unit);
            }
        }
        Ok(SimulationWorld {
            scanner,
            stylus,
            drawn,
        })
    }
}

/// Simulated scan and touch.
pub(super) struct SimulatedInput {
    pub scan: TriMesh,
    pub touch: Touch,
}

/// Scans and touches `surface`, and writes truth.ply, scan.ply (both in mm) and touch.mcap into
/// `folder`; with a camera the recording also has its view of the markers on the stylus. All
/// randomness comes from the seed of `scanner`.
pub(super) fn write_simulation(
    surface: &dyn Surface,
    truth: &TriMesh,
    path: &[Stroke],
    scanner: &ScannerParams,
    stylus: &StylusParams,
    camera: Option<&CameraParams>,
    folder: &Path,
) -> Result<SimulatedInput, CliError> {
    create_folder(folder).map_err(not_written(folder))?;
    let stage = WorkProgress::stage("scan");
    let scan = scan(surface, scanner)?;
    drop(stage);
    let _stage = WorkProgress::stage("touch");
    let touch = touch(surface, path, stylus, scanner.seed)?;
    let see = |camera| see_markers(&touch.moments, stylus.stiffness, camera, scanner.seed);
    let frames = camera.map_or_else(|| Ok(Vec::new()), see)?;
    let topics = Topics {
        markers: camera.map(|_| MARKERS_TOPIC.to_owned()),
        ..Topics::default()
    };
    for (name, mesh) in [(TRUTH_NAME, truth), ("scan.ply", &scan)] {
        write_mesh(&folder.join(name), mesh, MeshUnit::Millimetre)
            .map_err(CliError::not_written)?;
    }
    write_recording(
        &folder.join("touch.mcap"),
        &topics,
        OBJECT_FRAME,
        STYLUS_FRAME,
        merged(&touch.messages, frames),
    )
    .map_err(CliError::not_written)?;
    write_contacts(&touch.moments, &folder.join(CONTACTS_NAME))?;
    Ok(SimulatedInput { scan, touch })
}

/// Writes the true ball centres and contact points: a line for each contact, mm, in O.
fn write_contacts(moments: &[TrueState], path: &Path) -> Result<(), CliError> {
    let touched = moments
        .iter()
        .step_by(CONTACT_EVERY)
        .filter(|moment| !moment.contacts.is_empty());
    let lines = touched.flat_map(|moment| {
        let centre = moment.pose_ot.translation.vector * 1e3;
        moment.contacts.iter().map(move |contact| {
            let p = contact.point.coords * 1e3;
            format!(
                "{:.3},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4}\n",
                moment.t, centre.x, centre.y, centre.z, p.x, p.y, p.z
            )
        })
    });
    let text: String = std::iter::once(CONTACTS_HEAD.to_owned())
        .chain(lines)
        .collect();
    write_atomically(path, |out| std::io::Write::write_all(out, text.as_bytes()))
        .map_err(not_written(path))
}

/// Messages, with each frame of markers before the first later message.
fn merged(messages: &[Message], frames: Vec<MarkerFrame>) -> impl Iterator<Item = Record> {
    let mut frames = frames.into_iter().peekable();
    let last_ns = messages.iter().map(Message::stamp_ns).max();
    messages.iter().flat_map(move |message| {
        let until_ns = if Some(message.stamp_ns()) == last_ns {
            i64::MAX
        } else {
            message.stamp_ns()
        };
        let before = std::iter::from_fn(|| frames.next_if(|frame| frame.stamp_ns < until_ns));
        let before: Vec<_> = before
            .map(|frame| Record::Markers(Box::new(frame)))
            .collect();
        before.into_iter().chain([Record::Message(*message)])
    })
}
