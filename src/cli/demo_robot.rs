//! `touchup demo --robot sim`: a simulated arm probes a plate with its holes missing from the scan,
//! from one click per feature.

use std::f64::consts::TAU;
use std::fmt;
use std::io::Write;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use super::check::{CheckReport, Gates, SPOT_TOUCHES, touched};
use super::common::arm_errors::ArmErrorsName;
use super::common::progress::WorkProgress;
use super::common::signals::StopSignals;
use super::compare::{CompareArguments, compared};
use super::probing::{Probing, ProbingOutcome, ProbingSetup, ProbingSummary};
use super::{CliError, Losses, not_written, print_result, reported, write_json};
use touchup_features::calibrate::ReferenceSphere;
use touchup_features::features::{Feature, InspectedQuantity};
use touchup_geometry::mesh::TriMesh;
use touchup_io::atomic::{create_folder, write_atomically};
use touchup_io::features_file::FeatureRecord;
use touchup_io::mesh_file::{MeshUnit, write_mesh};
use touchup_probing::arm::Arm;
use touchup_probing::execute::{Flag, FlagResult, Prober};
use touchup_sim::{Plate, ScannerParams, SimArm, TruthFeature, TruthShape, WithSpheres, scan};

/// Scene of the demo, written beside the other files.
const SCENE: &str = include_str!("../../config/probe.yaml");
/// Scene lines of an arm with errors of `ArmErrorSigmas::CALIBRATED`, and the record of its check.
const CALIBRATED: &str =
    "  # what is not known of arm and place of the part, and what its check found
  check: check.json
  temperature_c: 21
  radius_sigma_mm: 0.002
  place_sigma_mm: 0.05
  turn_sigma_deg: 0.02
  registered_at_mm: [30, 25, 12]
  touch_sigma_mm: 0.03
  tolerance_mm: 0.12
";
/// Line of the check record in `CALIBRATED`.
const CHECK: &str = "  check: check.json\n";
/// Scene lines of an arm without errors, replaced by `CALIBRATED`.
const PERFECT: &str = "  # it comes to a place with no error of its own
  touch_sigma_mm: 0.005
  tolerance_mm: 0.02
";
/// Flat spot on the plate.
const SPOT: Point3<f64> = Point3::new(45e-3, 9e-3, 12e-3);
/// Spheres around the plate, centres and diameter, mm.
const SPHERES: [[f64; 3]; 4] = [
    [-70.0, 25.0, 20.0],
    [130.0, 25.0, 20.0],
    [30.0, -90.0, 40.0],
    [30.0, 150.0, 60.0],
];
const DIAMETER: f64 = 25.0;
/// Coverage factor of the printed uncertainties.
const COVERAGE: f64 = 2.0;
/// Chord error of the part's triangles, m: it changes probing results by no more than a touch does.
const CHORD_ERROR: f64 = 0.5e-6;
/// Largest error of a click, m.
const CLICK: f64 = 3e-3;

/// Content of `summary.json`; lengths in mm.
#[derive(Debug, Serialize)]
struct RobotSummary {
    check: CheckReport,
    probing: ProbingSummary,
    errors: Vec<ProbedError>,
}

reported! {
    /// Errors of a probed feature; `found`: its measurement, if any.
    struct ProbedError, fn of(flag: &Flag, truth: &TruthFeature, probed: Option<&FlagResult>, found: Option<&Feature>) {
        name: &'static str = truth.name,
        /// Error of the click.
        click_mm: f64 = (flag.place - truth.centre).xy().norm() * 1e3,
        touches: usize = probed.map_or(0, |probed| probed.touches.len()),
        duration_s: f64 = probed.map_or(0.0, |probed| probed.seconds),
        largest_force_n: f64 = probed.map_or(0.0, |probed| probed.peak_force),
        /// Across the axis, for a step across its edge.
        place_mm: Option<f64> = found.map(|found| place_error(found, truth) * 1e3),
        /// Errors of the diameter, or of width and length.
        sizes_mm: Vec<f64> = numbers(found, truth).iter().map(|number| number.error_mm).collect(),
        /// Place, and the numbers of `sizes_mm`.
        numbers: Vec<NumberError> = found.map(|found| place_number(found, truth)).into_iter().chain(numbers(found, truth)).collect(),
    }
}

/// Measured number beside its true value.
#[derive(Debug, Serialize)]
struct NumberError {
    number: &'static str,
    /// `None` for a place.
    #[serde(skip_serializing_if = "Option::is_none")]
    true_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    found_mm: Option<f64>,
    /// For a place: its distance from the true one.
    error_mm: f64,
    /// Twice the standard uncertainty.
    expanded_mm: f64,
}

impl NumberError {
    fn holds(&self) -> bool {
        self.error_mm.abs() <= self.expanded_mm
    }
}

/// - `seed`: for scan, clicks and arm.
pub(super) fn demo_robot(out: &Path, seed: u64) -> Result<Losses, CliError> {
    let plate = Plate::default();
    create_folder(out).map_err(not_written(out))?;
    let [truth_path, scan_path, scene_path] =
        ["truth.ply", "scan.ply", "scene.yaml"].map(|name| out.join(name));
    let truth = write_part(&plate, [&truth_path, &scan_path], seed)?;
    let scene = SCENE.replace(PERFECT, CALIBRATED);
    let write_scene = |text: &str| {
        write_atomically(&scene_path, |file| file.write_all(text.as_bytes()))
            .map_err(not_written(&scene_path))
    };
    // a check record of another run is not valid for this arm
    write_scene(&scene.replace(CHECK, ""))?;

    let features = plate.features();
    let flags = clicks(&features, seed);
    let probing = Probing {
        scene: &scene_path,
        scan: &scan_path,
        unit: MeshUnit::Millimetre,
        flags: &flags,
        is_simulated: true,
        is_forced: false,
        out,
        step: None,
    };
    let spheres = SPHERES.map(|centre| ReferenceSphere {
        centre: Point3::from(Vector3::from(centre) / 1e3),
        radius: DIAMETER / 2e3,
    });
    let unchecked = probing.ready()?.beside(&spheres);
    let start = unchecked.cell.above(&unchecked.with_spheres(&truth)?);
    let around = WithSpheres {
        part: &plate,
        spheres: &spheres,
    };
    let errors = unchecked.simulated_arm(seed, ArmErrorsName::Calibrated);
    let mut arm = SimArm::new(&around, errors, &start)?;
    let check = checked(&unchecked, &mut arm)?;
    write_json(&out.join("check.json"), &check)?;
    write_scene(&scene)?;

    let ready = probing.ready()?;
    probing.planned(&ready, &arm.next_state().map_err(CliError::arm)?)?;
    // nothing real moves: a signal ends this as any other verb
    let ProbingOutcome {
        summary,
        probed,
        outcome,
    } = probing.done(&ready, &mut arm, false, &StopSignals::default())?;
    if summary.refine.is_none() {
        return outcome;
    }

    compare_refined(out, &probed)?;
    let demo = RobotSummary {
        check,
        probing: summary,
        errors: errors_of(&flags, &features, &probed),
    };
    write_json(&out.join("summary.json"), &demo)?;
    print_result(&format!(
        "{demo}\nwrote {}: plan.png is what the arm would do, touches.png what it did, deviation.png what is right now",
        out.display()
    ))?;
    outcome
}

/// Writes the mesh of the part, and its scan; returns the mesh.
fn write_part(
    plate: &Plate,
    [truth_path, scan_path]: [&Path; 2],
    seed: u64,
) -> Result<TriMesh, CliError> {
    let truth = plate.mesh(CHORD_ERROR)?;
    let scanning = WorkProgress::stage("scan");
    let scanner = ScannerParams {
        seed,
        ..ScannerParams::default()
    };
    let scanned = scan(plate, &scanner)?;
    drop(scanning);
    for (path, mesh) in [(truth_path, &truth), (scan_path, &scanned)] {
        write_mesh(path, mesh, MeshUnit::Millimetre).map_err(CliError::not_written)?;
    }
    Ok(truth)
}

/// A click near each feature.
fn clicks(features: &[TruthFeature], seed: u64) -> Vec<Flag> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (1..)
        .zip(features)
        .map(|(id, feature)| clicked(id, feature, &mut rng))
        .collect()
}

/// Compares the refined mesh with the part.
fn compare_refined(out: &Path, probed: &[FlagResult]) -> Result<(), CliError> {
    let named = probed.iter().filter_map(feature_of);
    let named = named.map(FeatureRecord::of).collect();
    compared(&CompareArguments::in_folder(out, named)).map(drop)
}

fn errors_of(flags: &[Flag], features: &[TruthFeature], probed: &[FlagResult]) -> Vec<ProbedError> {
    let errors = flags.iter().zip(features).map(|(flag, truth)| {
        let probed = probed.iter().find(|probed| probed.flag == flag.id);
        ProbedError::of(flag, truth, probed, probed.and_then(feature_of))
    });
    errors.collect()
}

/// Touches the spot and all spheres.
fn checked(ready: &ProbingSetup, arm: &mut dyn Arm) -> Result<CheckReport, CliError> {
    let _checking = WorkProgress::stage("check");
    let mut world = ready.static_world()?;
    let mut prober = Prober::new(arm, &ready.cell, &ready.params, &mut world);
    let touches = touched(&mut prober, Some(&(SPOT, SPOT_TOUCHES)), &ready.spheres)?;
    CheckReport::of(
        &touches,
        &ready.spheres,
        &ready.scene,
        None,
        Gates::default(),
    )
}

fn feature_of(probed: &FlagResult) -> Option<&Feature> {
    probed.found.as_ref()?.feature.as_ref()
}

/// Click near a feature, as by a person: a kind, and no size.
fn clicked(id: u32, feature: &TruthFeature, rng: &mut Pcg64) -> Flag {
    let (angle, off) = (rng.random_range(0.0..TAU), rng.random_range(0.0..CLICK));
    let top = if let TruthShape::Boss { height, .. } = feature.shape {
        height
    } else {
        0.0
    };
    let place: Point3<f64> =
        feature.centre + Vector3::new(off * angle.cos(), off * angle.sin(), top);
    Flag {
        id,
        kind: Some(feature.kind()),
        place,
        radius: CLICK,
    }
}

/// Error of the place in the directions of its uncertainty, m: across the axis, for a step across
/// its edge.
fn place_error(found: &Feature, truth: &TruthFeature) -> f64 {
    let off = found.centre.value - truth.centre;
    // where along it the edge was touched is no error
    let along = truth.direction();
    (off - along * off.dot(&along)).norm()
}

/// Error of the place, with its expanded uncertainty.
fn place_number(found: &Feature, truth: &TruthFeature) -> NumberError {
    let expanded_mm = COVERAGE * found.centre.std.unwrap_or(f64::NAN) * 1e3;
    let error_mm = place_error(found, truth) * 1e3;
    NumberError {
        number: "place",
        true_mm: None,
        found_mm: None,
        error_mm,
        expanded_mm,
    }
}

/// Sizes against the drawing.
fn numbers(found: Option<&Feature>, truth: &TruthFeature) -> Vec<NumberError> {
    let Some(found) = found else {
        return Vec::new();
    };
    let number = |(quantity, size): (InspectedQuantity, f64)| {
        let measured = found.size(quantity);
        let value = measured.map_or(f64::NAN, |measured| measured.value);
        let std = measured.and_then(|measured| measured.std);
        let (true_mm, found_mm) = (Some(size * 1e3), Some(value * 1e3));
        NumberError {
            number: quantity.parts().0,
            true_mm,
            found_mm,
            error_mm: (value - size) * 1e3,
            expanded_mm: COVERAGE * std.unwrap_or(f64::NAN) * 1e3,
        }
    };
    let mut sizes = truth.sizes();
    sizes.retain(|(quantity, _)| *quantity != InspectedQuantity::Depth);
    sizes.into_iter().map(number).collect()
}

impl fmt::Display for RobotSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n", self.check)?;
        writeln!(f, "{}", self.probing)?;
        writeln!(
            f,
            "against the drawing, ± with a coverage factor of {COVERAGE}:"
        )?;
        writeln!(
            f,
            "  {:<13} {:>9} {:>8} {:>4} {:>5}  {:<9} {:>8} {:>9} {:>8} {:>8}",
            "",
            "click mm",
            "touches",
            "s",
            "N",
            "number",
            "true mm",
            "found mm",
            "± mm",
            "error mm"
        )?;
        let or_none = |mm: Option<f64>| mm.map_or_else(|| "-".to_owned(), |mm| format!("{mm:.4}"));
        for error in &self.errors {
            let ProbedError {
                name,
                click_mm,
                touches,
                duration_s,
                largest_force_n,
                numbers,
                ..
            } = error;
            let mut before = format!(
                "{name:<13} {click_mm:>9.1} {touches:>8} {duration_s:>4.0} {largest_force_n:>5.1}"
            );
            if numbers.is_empty() {
                writeln!(f, "  {before}  not found")?;
            }
            for one in numbers {
                let NumberError {
                    number,
                    true_mm,
                    found_mm,
                    error_mm,
                    expanded_mm,
                } = one;
                let beyond = if one.holds() { "" } else { "  beyond its ±" };
                let (true_mm, found_mm) = (or_none(*true_mm), or_none(*found_mm));
                writeln!(
                    f,
                    "  {before:<43}  {number:<9} {true_mm:>8} {found_mm:>9} {expanded_mm:>8.4} {error_mm:>+8.4}{beyond}"
                )?;
                before.clear();
            }
        }
        let all = || self.errors.iter().flat_map(|error| &error.numbers);
        let held = all().filter(|number| number.holds()).count();
        writeln!(f, "  within their ±: {held} of {}", all().count())
    }
}
