//! `touchup calibrate scan`: where the scan lies in space, from picked pairs.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::{Isometry3, Vector3, Vector6};
use tracing::warn;

use super::super::{CliError, Losses, check_kept, reported, require};
use super::{Calibrated, CalibrationRecording, CalibrationTarget, DraftScene, rounded};
use crate::align::{PairsFit, PairsParams, PointPair, fit_pairs};
use crate::calibrate::{DwellFinder, DwellParams};
use crate::io::pairs_file::{PairsFile, read_pairs, read_scan_points};
use crate::scene::{GravityAxes, ScanToSpaceSection, Scene, Setting};
use crate::stylus::{ContactEstimator, ContactEstimatorParams};

#[derive(Debug, Args)]
pub(in crate::cli) struct ScanArguments {
    /// Pairs of points, CSV: scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm, where wanted name,
    /// sigma_mm
    #[arg(long, value_name = "CSV")]
    pairs: PathBuf,
    /// A recording in which the stylus dwells on each point for a second, in the order of the file, which then needs no
    /// columns of space
    #[arg(long, value_name = "RECORDING")]
    bag: Option<PathBuf>,
    /// Standard deviation of a pair per axis, mm; default: from the residuals
    #[arg(long, value_name = "S")]
    sigma_mm: Option<f64>,
    #[command(flatten)]
    source: CalibrationRecording,
    #[command(flatten)]
    target: CalibrationTarget,
}

/// The verb.
pub(super) fn scan(arguments: &ScanArguments) -> Result<Losses, CliError> {
    let ScanArguments { pairs: path, bag, sigma_mm, target, .. } = arguments;
    if let Some(sigma) = sigma_mm {
        require((1e-6..=1e3).contains(sigma), format!("--sigma-mm is {sigma}; it must be 1e-6 to 1000 mm"))?;
    }
    let draft = target.open("--pairs", path)?;
    let (PairsFile { pairs, names }, losses) = match bag {
        Some(bag) => arguments.touched_pairs(bag, &draft)?,
        None => (read_pairs(path)?, Losses::new()),
    };
    let params = PairsParams { sigma: sigma_mm.map(|sigma| sigma / 1e3), ..PairsParams::default() };
    let fit = fit_pairs(&pairs, &params).map_err(|error| CliError::calibration(path, error))?;
    warn_of_gravity(&draft.scene);
    let found = ScanFound::of(&pairs, &names, &fit);
    target.write(&draft, &found)?;
    Ok(losses)
}

impl ScanArguments {
    /// The points of the file, each with the place where the stylus dwelled.
    fn touched_pairs(&self, bag: &Path, draft: &DraftScene) -> Result<(PairsFile, Losses), CliError> {
        check_kept("--bag", bag, &self.target.out)?;
        draft.require_radius()?;
        let mut file = read_scan_points(&self.pairs)?;
        // the poses stay in space: that is what is looked for
        let scene = Scene { scan_to_space: None, ..draft.scene.clone() };
        let tip = scene.tip_params();
        let mut finder = DwellFinder::new(DwellParams { radius: tip.radius, ..DwellParams::default() });
        let recording = self.source.open(bag)?;
        let mut contacts = ContactEstimator::new(ContactEstimatorParams {
            compensator: scene.compensator_params(recording.wrench_frame),
            bias: scene.bias_tracking,
            gate: Some(scene.contact.unwrap_or_default()),
            sliding: None,
            tip,
        })?;
        let replayed = self.source.replay(recording, &scene, |sample| {
            contacts.observe(sample).into_iter().for_each(|contact| finder.push(contact));
        })?;
        let segments = finder.finish();
        if segments.len() != file.pairs.len() {
            let why = format!(
                "{} dwells of half a second in contact, and {} points picked on the scan; they are matched in order: dwell \
                 once on each, in the order of the file",
                segments.len(),
                file.pairs.len()
            );
            return Err(CliError::calibration(bag, why));
        }
        for (pair, rest) in file.pairs.iter_mut().zip(segments) {
            pair.to = rest.point;
        }
        Ok((file, replayed.losses))
    }
}

/// A weight whose direction was named in the axes of the scan may not have been meant for the scan as it lies now.
fn warn_of_gravity(scene: &Scene) {
    let payload = scene.compensation.as_ref().and_then(|compensation| compensation.payload.as_ref());
    if payload.is_some_and(|payload| payload.gravity_axes == GravityAxes::Object && payload.payload.mass > 0.0) {
        warn!(
            "compensation.payload.gravity_m_per_s2 stays in the axes of the scan: see that it points down there, or calibrate \
             the payload again, which names it in those of space"
        );
    }
}

reported! {
    /// What `--json` prints.
    struct ScanFound, fn of(picked: &[PointPair], names: &[String], fit: &PairsFit) {
        pairs: Vec<PairFound> = names.iter().zip(picked).zip(&fit.residuals).map(PairFound::of).collect(),
        rms_mm: f64 = fit.rms * 1e3,
        /// of a pair of unit weight, per axis
        sigma_mm: f64 = fit.sigma * 1e3,
        /// p_space = R p_scan + t
        scan_to_space: ScanMotion = ScanMotion::of(&fit.motion),
        /// middle of the pairs in space, for which the shift is given
        centroid_mm: [f64; 3] = (fit.centroid.coords * 1e3).into(),
        shift_std_mm: [f64; 3] = (sigma(fit).fixed_rows::<3>(0) * 1e3).into(),
        turn_std_deg: [f64; 3] = (sigma(fit).fixed_rows::<3>(3) * 1f64.to_degrees()).into(),
    }
}

/// Standard deviations of shift, m, and turn, rad.
fn sigma(fit: &PairsFit) -> Vector6<f64> {
    fit.covariance.diagonal().map(f64::sqrt)
}

reported! {
    struct PairFound, fn of(found: ((&String, &PointPair), &Vector3<f64>)) {
        name: String = found.0.0.clone(),
        scan_mm: [f64; 3] = (found.0.1.from.coords * 1e3).into(),
        residual_mm: [f64; 3] = (found.1 * 1e3).into(),
        distance_mm: f64 = found.1.norm() * 1e3,
    }
}

reported! {
    #[derive(Clone, Copy)]
    struct ScanMotion, fn of(motion: &Isometry3<f64>) {
        position_mm: [f64; 3] = motion.translation.vector.map(|x| rounded(x * 1e3, 7)).into(),
        orientation_xyzw: [f64; 4] = motion.rotation.coords.map(|c| rounded(c, 12)).into(),
    }
}

impl Calibrated for ScanFound {
    fn set_in(&self, scene: &mut Scene) -> (Vec<Setting>, String) {
        let ScanMotion { position_mm, orientation_xyzw } = self.scan_to_space;
        let position = Vector3::from(position_mm) / 1e3;
        scene.scan_to_space = Some(ScanToSpaceSection { position, orientation_xyzw });
        let settings = vec![
            Setting::list("scan_to_space.position_mm", &position_mm),
            Setting::list("scan_to_space.orientation_xyzw", &orientation_xyzw),
        ];
        (settings, format!("scan: {} pairs, residuals {:.3} mm rms", self.pairs.len(), self.rms_mm))
    }
}

impl fmt::Display for ScanFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.pairs.iter().map(|pair| pair.name.chars().count()).max().unwrap_or(0).max(4);
        writeln!(f, "{:width$}  {:^29}  {:^26}  {:>6}", "pair", "on the scan, mm", "residual, mm", "|r|")?;
        for PairFound { name, scan_mm: [x, y, z], residual_mm: [u, v, w], distance_mm } in &self.pairs {
            writeln!(f, "{name:width$}  {x:9.3} {y:9.3} {z:9.3}  {u:8.3} {v:8.3} {w:8.3}  {distance_mm:6.3}")?;
        }
        let [x, y, z] = self.shift_std_mm;
        let [a, b, c] = self.turn_std_deg;
        writeln!(f, "rms {:.3} mm; one axis of a pair is good to {:.3} mm", self.rms_mm, self.sigma_mm)?;
        let ([p, q, r], [i, j, k, w]) = (self.scan_to_space.position_mm, self.scan_to_space.orientation_xyzw);
        writeln!(
            f,
            "scan to space: position ({p:.3}, {q:.3}, {r:.3}) mm, orientation xyzw ({i:.6}, {j:.6}, {k:.6}, {w:.6})"
        )?;
        write!(
            f,
            "known to ({x:.3}, {y:.3}, {z:.3}) mm in the middle of the pairs, and to ({a:.3}, {b:.3}, {c:.3})° about it"
        )
    }
}
