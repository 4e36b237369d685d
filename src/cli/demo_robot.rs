//! `touchup demo --robot sim`: a plate whose scan has lost its holes is probed by a simulated arm, from one click for each feature.

use std::f64::consts::TAU;
use std::fmt;
use std::io::Write;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use super::compare::{CompareArguments, compared};
use super::found::kind_of;
use super::probing::{Done, Probing, ProbingSummary};
use super::progress::WorkProgress;
use super::signals::StopSignals;
use super::{CliError, Losses, not_written, print_result, reported, write_json};
use crate::features::{Feature, Measured};
use crate::io::atomic::{create_folder, write_atomically};
use crate::io::features_file::FeatureRecord;
use crate::io::mesh_file::{MeshUnit, write_mesh};
use crate::probing::arm::Arm;
use crate::probing::execute::{Flag, Probed};
use crate::sim::{Plate, ScannerParams, SimArm, TruthFeature, TruthShape, scan};

/// Its scene, written beside the other files.
const SCENE: &str = include_str!("../../config/probe.yaml");
/// The triangles of the part are this near to it, m: what is probed on them differs from the drawing by no more than a touch does.
const CHORD_ERROR: f64 = 0.5e-6;
/// Largest error of a click, m.
const CLICK: f64 = 3e-3;

/// What `summary.json` holds; lengths in mm.
#[derive(Debug, Serialize)]
struct RobotSummary {
    probing: ProbingSummary,
    errors: Vec<ProbedError>,
}

reported! {
    /// Errors of the probed features; `found` is what was measured of one, if anything was.
    struct ProbedError, fn of(flag: &Flag, truth: &TruthFeature, probed: Option<&Probed>, found: Option<&Feature>) {
        name: &'static str = truth.name,
        /// error of the click
        click_mm: f64 = (flag.place - truth.centre).xy().norm() * 1e3,
        touches: usize = probed.map_or(0, |probed| probed.touches.len()),
        duration_s: f64 = probed.map_or(0.0, |probed| probed.seconds),
        largest_force_n: f64 = probed.map_or(0.0, |probed| probed.peak_force),
        /// across the axis, of an edge across itself
        place_mm: Option<f64> = found.map(|found| place_error(found, truth) * 1e3),
        /// of the diameter, or of the width and the length
        sizes_mm: Vec<f64> = found.map_or(Vec::new(), |found| size_errors(found, truth)),
    }
}

/// - `seed`: of the scan, the clicks and the arm.
pub(super) fn demo_robot(out: &Path, seed: u64) -> Result<Losses, CliError> {
    let plate = Plate::default();
    create_folder(out).map_err(not_written(out))?;
    let [truth_path, scan_path, scene_path] = ["truth.ply", "scan.ply", "scene.yaml"].map(|name| out.join(name));
    let truth = plate.mesh(CHORD_ERROR)?;
    let scanning = WorkProgress::stage("scan");
    let scanner = ScannerParams { seed, ..ScannerParams::default() };
    let scanned = scan(&plate, &scanner)?;
    drop(scanning);
    for (path, mesh) in [(&truth_path, &truth), (&scan_path, &scanned)] {
        write_mesh(path, mesh, MeshUnit::Millimetre).map_err(CliError::not_written)?;
    }
    write_atomically(&scene_path, |file| file.write_all(SCENE.as_bytes())).map_err(not_written(&scene_path))?;

    let features = plate.features();
    let mut rng = Pcg64::seed_from_u64(seed);
    let flags: Vec<Flag> = (1..).zip(&features).map(|(id, feature)| clicked(id, feature, &mut rng)).collect();
    let probing = Probing {
        scene: &scene_path,
        scan: &scan_path,
        unit: MeshUnit::Millimetre,
        flags: &flags,
        is_simulated: true,
        out,
    };
    let ready = probing.ready()?;
    let start = ready.cell.above(&truth);
    let mut arm = SimArm::new(&plate, ready.simulated_arm(seed), &start)?;
    let now = arm.next_state().map_err(CliError::arm)?;
    probing.planned(&ready, &now)?;
    // nothing real moves: a signal ends it as any other verb
    let Done { summary, probed, outcome } = probing.done(&ready, &mut arm, false, &StopSignals::default())?;

    let named = probed.iter().filter_map(feature_of).map(FeatureRecord::of).collect();
    compared(&CompareArguments::in_folder(out, named))?;
    let errors = flags.iter().zip(&features).map(|(flag, truth)| {
        let probed = probed.iter().find(|probed| probed.flag == flag.id);
        ProbedError::of(flag, truth, probed, probed.and_then(feature_of))
    });
    let demo = RobotSummary { probing: summary, errors: errors.collect() };
    write_json(&out.join("summary.json"), &demo)?;
    print_result(&format!(
        "{demo}\nwrote {}: plan.png is what the arm would do, touches.png what it did, deviation.png what is right now",
        out.display()
    ));
    outcome
}

fn feature_of(probed: &Probed) -> Option<&Feature> {
    probed.found.as_ref()?.feature.as_ref()
}

/// One click near a feature, as a person makes it: a kind, and no size.
fn clicked(id: u32, feature: &TruthFeature, rng: &mut Pcg64) -> Flag {
    let (angle, off) = (rng.random_range(0.0..TAU), rng.random_range(0.0..CLICK));
    let top = if let TruthShape::Boss { height, .. } = feature.shape { height } else { 0.0 };
    let place: Point3<f64> = feature.centre + Vector3::new(off * angle.cos(), off * angle.sin(), top);
    Flag { id, kind: Some(kind_of(&feature.shape)), place, radius: CLICK }
}

/// Error of the place, m.
fn place_error(found: &Feature, truth: &TruthFeature) -> f64 {
    let off = found.centre.value - truth.centre;
    match truth.shape {
        // where along it the edge was touched is no error
        TruthShape::Step { direction, .. } => (off - direction * off.dot(&direction)).norm(),
        _ => off.norm(),
    }
}

/// Errors of the sizes against the drawing, mm.
fn size_errors(found: &Feature, truth: &TruthFeature) -> Vec<f64> {
    let error = |measured: &Option<Measured<f64>>, size: f64| {
        (measured.as_ref().map_or(f64::NAN, |measured| measured.value) - size) * 1e3
    };
    match truth.shape {
        TruthShape::Hole { diameter, .. } | TruthShape::Boss { diameter, .. } => vec![error(&found.diameter, diameter)],
        TruthShape::Slot { width, length, .. } => vec![error(&found.width, width), error(&found.length, length)],
        TruthShape::Step { .. } => Vec::new(),
    }
}

impl fmt::Display for RobotSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.probing)?;
        writeln!(f, "against the drawing:")?;
        writeln!(
            f,
            "  {:<13} {:>9} {:>8} {:>6} {:>7} {:>10}  size mm",
            "", "click mm", "touches", "s", "N", "place mm"
        )?;
        for error in &self.errors {
            let place = error.place_mm.map_or_else(|| "-".to_owned(), |mm| format!("{mm:.4}"));
            let sizes: Vec<String> = error.sizes_mm.iter().map(|mm| format!("{mm:+.4}")).collect();
            writeln!(
                f,
                "  {:<13} {:>9.1} {:>8} {:>6.0} {:>7.1} {:>10}  {}",
                error.name,
                error.click_mm,
                error.touches,
                error.duration_s,
                error.largest_force_n,
                place,
                sizes.join(" ")
            )?;
        }
        Ok(())
    }
}
