//! `touchup demo`: makes a plate, scans it badly, touches it, refines the scan, and prints the gain
//! in accuracy and the features.

use std::fmt;
#[cfg(any(feature = "ros", feature = "r2r"))]
use std::path::Path;
use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;
use serde::Serialize;

use super::common::found::FoundTable;
use super::common::progress::WorkProgress;
use super::common::refinement::{RefineSummary, RefinementFiles, RefinementResult};
use super::common::told::ToldFlags;
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::common::web::WebFlags;
use super::compare::{CompareArguments, compared};
use super::demo_robot::demo_robot;
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::node::end_text;
#[cfg(any(feature = "ros", feature = "r2r"))]
use super::page::{on_page, parameters_of};
use super::probing::arm::RobotName;
use super::simulate::{SimulatedInput, write_simulation};
use super::{CliError, Losses, print_result, reported, write_json};
use touchup_features::compare::TouchedRegion;
use touchup_geometry::mesh::{FaceTree, MeshError, TriMesh};
use touchup_io::features_file::read_features;
use touchup_io::mesh_file::{MeshFile, MeshUnit, read_mesh};
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_io::recording::{StampSource, Topics};
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_node::ros::parameters::ParameterValue;
use touchup_session::refinement::RefinementOptions;
use touchup_session::replay::RecordedAs;
#[cfg(any(feature = "ros", feature = "r2r"))]
use touchup_session::replay::Recording;
use touchup_session::session::ResultFiles;
use touchup_sim::{
    PathParams, Plate, ScanQuality, ScannerParams, StylusParams, Surface, measure_quality,
    plan_demo,
};

/// Largest distance of the written plate's round walls from circles, m.
const CHORD_ERROR: f64 = 10e-6;

#[derive(Debug, Args)]
pub(super) struct DemoArguments {
    /// Folder for truth.ply, scan.ply, touch.mcap, refined.ply, features.json, touches.csv,
    /// deviation.png (all in mm) and summary.json
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Seed of the scan and the path
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Probes the flagged features with an arm instead of a hand (probed.json, plan.png,
    /// touches.png)
    #[arg(long, value_name = "ARM")]
    robot: Option<RobotName>,
    #[cfg(any(feature = "ros", feature = "r2r"))]
    #[command(flatten)]
    web: WebFlags,
}

/// Content of `summary.json`; lengths in mm.
#[derive(Debug, Serialize)]
struct DemoSummary {
    scan: ScanErrors,
    touched_s: f64,
    /// Error of the scan inside the touched region.
    before: RegionError,
    /// Error of the refined mesh inside the touched region.
    after: RegionError,
    refine: RefineSummary,
    /// True features beside the found ones.
    found: FoundTable,
}

reported! {
    /// Errors of the whole scan against the part.
    struct ScanErrors, fn of(quality: &ScanQuality) {
        faces: usize = quality.faces,
        edge_median_mm: f64 = quality.edge_median * 1e3,
        mean_mm: f64 = quality.mean * 1e3,
        rms_mm: f64 = quality.rms * 1e3,
        p95_mm: f64 = quality.p95 * 1e3,
        bias_mm: f64 = quality.bias * 1e3,
    }
}

/// Runs the demo live on the operator page.
#[cfg(any(feature = "ros", feature = "r2r"))]
fn demo_on_page(web: &WebFlags, out: &Path, tip_radius: f64) -> Result<Losses, CliError> {
    let mut parameters = parameters_of(
        &out.join("scan.ply"),
        MeshUnit::Millimetre,
        &out.join("sessions"),
    )?;
    parameters
        .set("tip_radius_mm", &ParameterValue::Double(tip_radius * 1e3))
        .map_err(CliError::usage)?;
    let recording = Recording::open(
        &out.join("touch.mcap"),
        &Topics::default(),
        StampSource::Header,
    )?;
    // with the true plate the page can show the error of the scan
    let web = web.with_nominal(out.join("truth.ply"));
    let end = on_page(&web, parameters, recording, None)?;
    print_result(&end_text(&end))?;
    Ok(Losses::new())
}

pub(super) fn demo(arguments: &DemoArguments) -> Result<Losses, CliError> {
    match arguments.robot {
        None => {}
        Some(RobotName::Sim) => return demo_robot(&arguments.out, arguments.seed),
        Some(_) => return Err(CliError::usage("the demo has a simulated arm: --robot sim")),
    }
    let plate = Plate::default();
    let path = plan_demo(&plate, &PathParams::default())?;
    let scanner = ScannerParams {
        seed: arguments.seed,
        ..ScannerParams::default()
    };
    let truth = plate.mesh(CHORD_ERROR)?;
    let stylus = StylusParams::default();
    let SimulatedInput { scan, touch } = write_simulation(
        &plate,
        &truth,
        &path,
        &scanner,
        &stylus,
        None,
        &arguments.out,
    )?;

    let out = &arguments.out;
    #[cfg(any(feature = "ros", feature = "r2r"))]
    if arguments.web.is_wanted() {
        return demo_on_page(&arguments.web, out, stylus.radius);
    }
    let (scene, told) = ToldFlags::of_radius(stylus.radius).scene(None)?;
    let (scan_file, unit) = (out.join("scan.ply"), MeshUnit::Millimetre);
    let recorded = RecordedAs::default();
    let files = RefinementFiles::in_folder(&scan_file, unit, out, "touch.mcap", recorded);
    let RefinementResult {
        summary, losses, ..
    } = files.refine(scene, told, RefinementOptions::default())?;
    // measures the mesh as written
    let MeshFile { mesh: refined, .. } = read_mesh(&files.out.mesh, unit)?;

    let named = read_features(&out.join(ResultFiles::FEATURES))?.features;
    let found = FoundTable::of(&plate.features(), &named);
    compared(&CompareArguments::in_folder(out, named))?;

    let _measuring = WorkProgress::stage("measure");
    // true contacts of the ball with the part
    let contacts = touch.moments.iter().flat_map(|moment| &moment.contacts);
    let touched = TouchedRegion::of(contacts.map(|contact| contact.point));
    let demo = DemoSummary {
        scan: ScanErrors::of(&measure_quality(&scan, &plate, |_| true).ok_or(MeshError::Empty)?),
        touched_s: touch.moments.last().map_or(0.0, |moment| moment.t),
        before: RegionError::of(&touched, &plate, &scan),
        after: RegionError::of(&touched, &plate, &refined),
        refine: summary,
        found,
    };
    write_json(&out.join("summary.json"), &demo)?;
    let picture = out.join("deviation.png");
    print_result(&format!(
        "{demo}\nwrote {}; where it was wrong and is right: {}",
        out.display(),
        picture.display()
    ))?;
    Ok(losses)
}

impl fmt::Display for DemoSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ScanErrors {
            faces,
            edge_median_mm,
            mean_mm,
            rms_mm,
            p95_mm,
            bias_mm,
        } = &self.scan;
        writeln!(
            f,
            "scan: {faces} faces of {edge_median_mm:.2} mm; distance from the part: mean {mean_mm:.2} mm, \
                     rms {rms_mm:.2} mm, p95 {p95_mm:.2} mm, bias {bias_mm:+.2} mm"
        )?;
        writeln!(f, "touched for {:.0} s of simulated time", self.touched_s)?;
        writeln!(f, "{}", self.refine)?;
        writeln!(f, "error in the touched region, mean (p95):")?;
        let RegionError {
            part_to_mesh_mm: [pm, pm95],
            mesh_to_part_mm: [mp, mp95],
        } = self.before;
        let RegionError {
            part_to_mesh_mm: [qm, qm95],
            mesh_to_part_mm: [mq, mq95],
        } = self.after;
        writeln!(
            f,
            "  part to mesh {pm:.3} ({pm95:.3}) -> {qm:.3} ({qm95:.3}) mm, {:.1} times less",
            pm / qm
        )?;
        writeln!(
            f,
            "  mesh to part {mp:.3} ({mp95:.3}) -> {mq:.3} ({mq95:.3}) mm, {:.1} times less",
            mp / mq
        )?;
        write!(f, "\n{}\n", self.found)
    }
}

reported! {
    /// Distances between part and mesh in the touched region, mean and 95th percentile, mm.
    #[derive(Clone, Copy)]
    struct RegionError, fn of(touched: &TouchedRegion, part: &dyn Surface, mesh: &TriMesh) {
        /// Missing surface: from the touched points to the mesh.
        part_to_mesh_mm: [f64; 2] = part_to_mesh_mm(touched, mesh),
        /// Wrong surface: from the mesh to its closest points on the part, inside the region.
        mesh_to_part_mm: [f64; 2] = measure_quality(mesh, part, |p| touched.is_near(&part.closest(p).point))
            .map_or([0.0; 2], |quality| [quality.mean * 1e3, quality.p95 * 1e3]),
    }
}

fn part_to_mesh_mm(touched: &TouchedRegion, mesh: &TriMesh) -> [f64; 2] {
    let tree = FaceTree::new(mesh);
    let to_mesh = |p: &Point3<f64>| {
        tree.closest(mesh, p, f64::INFINITY)
            .map(|hit| (hit.point - p).norm())
    };
    let mut distances: Vec<f64> = touched.contacts().iter().filter_map(to_mesh).collect();
    distances.sort_by(f64::total_cmp);
    let mean = distances.iter().sum::<f64>() / distances.len().max(1) as f64;
    let p95 = distances
        .get(distances.len() * 95 / 100)
        .copied()
        .unwrap_or_default();
    [mean * 1e3, p95 * 1e3]
}
