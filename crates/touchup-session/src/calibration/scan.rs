//! Pose of the scan in space, from points picked on both.

use std::fmt;
use std::path::Path;

use nalgebra::{Isometry3, Vector3, Vector6};
use touchup_features::align::{PairsFit, PairsParams, PointPair, fit_pairs};
use touchup_features::calibrate::{DwellFinder, DwellParams};
use touchup_io::tables::pairs_file::{PairsFile, read_pairs, read_scan_points};
use touchup_method::stylus::{ContactEstimator, ContactEstimatorParams};

use super::calibrated::{Calibration, CalibrationResult};
use super::error::CalibrationError;
use super::recording::CalibrationRecording;
use super::vector::rounded;
use crate::reported;
use crate::scene::{GravityAxes, Scene, Setting};

/// Fits the pose of the scan to a table of pairs ([`touchup_io::tables::pairs_file`]).
///
/// - `recording`: dwells of the stylus, one second on each point, in the order of the table; they
///   replace its columns of space, and the scene must give the radius of the ball.
/// - `sigma`: standard deviation of a pair per axis, m; `None`: from the residuals.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// [`CalibrationError`]
pub fn calibrate_scan(
    table: &Path,
    recording: Option<CalibrationRecording>,
    scene: &Scene,
    sigma: Option<f64>,
    at_each: &mut dyn FnMut(),
) -> Result<Calibration<ScanFound>, CalibrationError> {
    let (PairsFile { pairs, names }, losses) = match recording {
        Some(recording) => touched_pairs(table, recording, scene, at_each)?,
        None => (read_pairs(table)?, Vec::new()),
    };
    let bad = |error| CalibrationError::Pairs {
        path: table.to_owned(),
        error,
    };
    let fit = fit_pairs(
        &pairs,
        &PairsParams {
            sigma,
            ..PairsParams::default()
        },
    )
    .map_err(bad)?;
    let doubts = doubt_of_gravity(scene).into_iter().collect();
    Ok(Calibration {
        found: ScanFound::of(&pairs, &names, &fit),
        doubts,
        losses,
    })
}

/// The points of the table, each with the position of its dwell, and the losses of the recording.
fn touched_pairs(
    table: &Path,
    recording: CalibrationRecording,
    scene: &Scene,
    at_each: &mut dyn FnMut(),
) -> Result<(PairsFile, Vec<String>), CalibrationError> {
    let path = recording.path().to_owned();
    let mut file = read_scan_points(table)?;
    // the poses stay in space: the pose of the scan is unknown
    let scene = Scene {
        scan_to_space: None,
        ..scene.clone()
    };
    let tip = scene.tip_params();
    let mut finder = DwellFinder::new(DwellParams {
        radius: tip.radius,
        ..DwellParams::default()
    });
    let mut contacts = ContactEstimator::new(ContactEstimatorParams {
        compensator: scene.compensator_params(recording.wrench_frame()),
        bias: scene.bias_tracking,
        gate: Some(scene.contact.unwrap_or_default()),
        sliding: None,
        tip,
    })?;
    let replayed = recording.replay(&scene, at_each, |sample| {
        contacts
            .observe(sample)
            .into_iter()
            .for_each(|contact| finder.push(contact));
    })?;
    let (dwells, points) = (finder.finish(), file.pairs.len());
    if dwells.len() != points {
        return Err(CalibrationError::Dwells {
            path,
            dwells: dwells.len(),
            points,
        });
    }
    for (pair, dwell) in file.pairs.iter_mut().zip(dwells) {
        pair.to = dwell.point;
    }
    Ok((file, replayed.losses))
}

/// A doubt about gravity in the axes of the scan: its direction may not hold for the new pose.
fn doubt_of_gravity(scene: &Scene) -> Option<String> {
    let payload = scene.compensation.as_ref()?.payload.as_ref()?;
    let is_of_scan = payload.gravity_axes == GravityAxes::Object && payload.payload.mass > 0.0;
    is_of_scan.then(|| {
        "compensation.payload.gravity_m_per_s2 stays in the axes of the scan: see that it points down there, or calibrate the payload \
         again, which names it in those of space"
            .to_owned()
    })
}

reported! {
    /// Pose of the scan in space.
    #[derive(Clone)]
    pub struct ScanFound, fn of(picked: &[PointPair], names: &[String], fit: &PairsFit) {
        pairs: Vec<PairFound> = names.iter().zip(picked).zip(&fit.residuals).map(PairFound::of).collect(),
        rms_mm: f64 = fit.rms * 1e3,
        /// standard deviation of a pair of unit weight, per axis
        sigma_mm: f64 = fit.sigma * 1e3,
        /// p_space = R p_scan + t
        scan_to_space: ScanMotion = ScanMotion::of(&fit.motion),
        /// centroid of the pairs in space, the reference point of the shift
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
    #[derive(Clone)]
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

impl CalibrationResult for ScanFound {
    fn settings(&self) -> (Vec<Setting>, String) {
        let ScanMotion {
            position_mm,
            orientation_xyzw,
        } = self.scan_to_space;
        let settings = vec![
            Setting::list("scan_to_space.position_mm", &position_mm),
            Setting::list("scan_to_space.orientation_xyzw", &orientation_xyzw),
        ];
        (
            settings,
            format!(
                "scan: {} pairs, residuals {:.3} mm rms",
                self.pairs.len(),
                self.rms_mm
            ),
        )
    }
}

impl fmt::Display for ScanFound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self
            .pairs
            .iter()
            .map(|pair| pair.name.chars().count())
            .max()
            .unwrap_or(0)
            .max(4);
        writeln!(
            f,
            "{:width$}  {:^29}  {:^26}  {:>6}",
            "pair", "on the scan, mm", "residual, mm", "|r|"
        )?;
        for PairFound {
            name,
            scan_mm: [x, y, z],
            residual_mm: [u, v, w],
            distance_mm,
        } in &self.pairs
        {
            writeln!(
                f,
                "{name:width$}  {x:9.3} {y:9.3} {z:9.3}  {u:8.3} {v:8.3} {w:8.3}  {distance_mm:6.3}"
            )?;
        }
        let [x, y, z] = self.shift_std_mm;
        let [a, b, c] = self.turn_std_deg;
        writeln!(
            f,
            "rms {:.3} mm; one axis of a pair is good to {:.3} mm",
            self.rms_mm, self.sigma_mm
        )?;
        let ([p, q, r], [i, j, k, w]) = (
            self.scan_to_space.position_mm,
            self.scan_to_space.orientation_xyzw,
        );
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
