//! Alignment of the mesh to the truth, and its report.

use std::fmt;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use tracing::warn;

use crate::cli::common::progress::WorkProgress;
use crate::cli::{CliError, counted, print_report, reported};
use touchup_features::align::{
    Alternative, FeaturesError, FeaturesParams, FreeTurn, IcpFit, IcpMotion, IcpParams,
    OrientedSample, PairsParams, Surfaces, align_features, fit_pairs, icp,
};
use touchup_features::compare::{IndexedMesh, sample_surface, surface_area};
use touchup_features::features::detect;
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_io::tables::pairs_file::read_pairs;
use touchup_session::threads::Threads;

/// Number of points of the mesh for one alignment.
const POINTS: f64 = 100_000.0;
/// Number of points of the mesh for each of many trial motions.
const POINTS_EACH: f64 = 20_000.0;

/// Alignment in the output of `--json`.
#[derive(Debug, Default, Serialize)]
pub(super) struct AlignmentReport {
    method: &'static str,
    #[serde(flatten)]
    motion: MotionReport,
    /// Distances of the points from the tangent planes, or of the pairs.
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_mm: Option<f64>,
    /// Point to plane.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    fit: Option<FitReport>,
    /// By features.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    explained: Option<AlignmentEvidence>,
    /// Residual of each pair.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    residuals: Vec<Residual>,
    /// Small motions without effect on the fit.
    undetermined: Vec<UndeterminedMotionReport>,
}

reported! {
    /// Motion from the mesh in its file onto the truth.
    #[derive(Default)]
    struct MotionReport, fn of(motion: &Isometry3<f64>) {
        /// Rows of the rotation.
        rotation: [[f64; 3]; 3] = motion.rotation.to_rotation_matrix().matrix().transpose().into(),
        /// Shift after the rotation.
        translation_mm: [f64; 3] = (motion.translation.vector * 1e3).into(),
    }
}

reported! {
    struct FitReport, fn of(fit: &IcpFit, count: usize) {
        points: usize = count,
        inliers: usize = fit.inliers,
        rounds: usize = fit.rounds,
    }
}

reported! {
    struct AlignmentEvidence, fn of(alternative: &Alternative, counts: [usize; 2]) {
        /// Features of the mesh that coincide with a feature of the truth.
        explained_features: usize = alternative.explained.len(),
        mesh_features: usize = counts[0],
        truth_features: usize = counts[1],
        /// Share of the mesh's surface that lies on the truth.
        agreeing_share: Option<f64> = alternative.agreeing,
    }
}

reported! {
    /// Residual of a pair: truth − moved mesh.
    struct Residual, fn of(name: &str, residual: &Vector3<f64>) {
        pair: String = name.to_owned(),
        residual_mm: [f64; 3] = (residual * 1e3).into(),
        distance_mm: f64 = residual.norm() * 1e3,
    }
}

reported! {
    /// Unconstrained motion: a shift along and a turn about a point.
    struct UndeterminedMotionReport, fn of(motion: &IcpMotion, fit: &IcpFit) {
        /// Shift of the point `about_mm`, times any length.
        shift: [f64; 3] = motion.shift.into(),
        /// Direction of the axis, times an angle per mm of the shift.
        turn_rad_per_mm: [f64; 3] = (motion.turn / fit.lever * 1e-3).into(),
        about_mm: [f64; 3] = (fit.centre.coords * 1e3).into(),
    }
}

reported! {
    /// Alternative motions for the user's choice.
    struct Choices, fn of(alternatives: &[Alternative], counts: [usize; 2], error: &FeaturesError) {
        ambiguous: Vec<AlternativeReport> =
            (1..).zip(alternatives).map(|(number, one)| AlternativeReport::of(number, one, counts)).collect(),
        /// Axis of the free turn of each motion.
        free_turn?: FreeTurnReport = match error {
            FeaturesError::FreeTurn { turn, .. } => Some(FreeTurnReport::of(turn)),
            _ => None,
        },
    }
}

reported! {
    struct FreeTurnReport, fn of(turn: &FreeTurn) {
        axis: [f64; 3] = turn.axis.into(),
        through_mm: [f64; 3] = (turn.through.coords * 1e3).into(),
    }
}

reported! {
    struct AlternativeReport, fn of(number: usize, found: &Alternative, counts: [usize; 2]) {
        /// Number for --alternative.
        alternative: usize = number,
        #[serde(flatten)]
        motion: MotionReport = MotionReport::of(&found.source_to_target),
        #[serde(flatten)]
        explained: AlignmentEvidence = AlignmentEvidence::of(found, counts),
        rms_mm: Option<f64> = found.icp.as_ref().map(|fit| fit.rms * 1e3),
        /// Turn relative to the first.
        turn_deg: f64 = found.differs[0].norm().to_degrees(),
        turn_axis: [f64; 3] = found.differs[0].try_normalize(1e-9).unwrap_or_default().into(),
        /// Shift of the features' centre, relative to the first.
        shift_mm: [f64; 3] = (found.differs[1] * 1e3).into(),
    }
}

type AlignmentResult = Result<(Isometry3<f64>, Option<AlignmentReport>), CliError>;

/// Motion that aligns `mesh` to the truth from roughly in place, and its report.
///
/// # Errors
/// [`CliError`].
pub(super) fn aligned_by_icp(mesh: &TriMesh, truth: IndexedMesh<'_>, seed: u64) -> AlignmentResult {
    let _aligning = WorkProgress::stage("align");
    let points: Vec<_> = spread(mesh, POINTS, seed).iter().map(|p| p.point).collect();
    let fit = icp(
        &points,
        truth.mesh,
        truth.tree,
        &Isometry3::identity(),
        &IcpParams::default(),
        &Threads,
    )?;
    let alignment = AlignmentReport::of_icp("icp", &fit, points.len());
    alignment.warn();
    Ok((fit.source_to_target, Some(alignment)))
}

/// Motion that aligns `mesh` to the truth from anywhere, by features, and its report.
///
/// - `alternative`: number of the motion among several, from 1 on.
///
/// # Errors
/// [`CliError`], after printing the alternatives to stdout; [`CliError::usage`] if there are fewer.
pub(super) fn aligned_by_features(
    mesh: &TriMesh,
    truth: IndexedMesh<'_>,
    seed: u64,
    alternative: Option<usize>,
    json: bool,
) -> AlignmentResult {
    let _aligning = WorkProgress::stage("align by features");
    let own = detect(mesh, &[]).features;
    let theirs = detect(truth.mesh, &[]).features;
    let points = spread(mesh, POINTS_EACH, seed);
    let surfaces = Surfaces {
        points: &points,
        target: truth.mesh,
        tree: truth.tree,
    };
    let counts = [own.len(), theirs.len()];
    let (found, undecided) =
        match align_features(&own, &theirs, Some(&surfaces), &FeaturesParams::default()) {
            Ok(only) => (vec![only], None),
            Err(
                ref error @ (FeaturesError::Ambiguous { ref alternatives }
                | FeaturesError::FreeTurn {
                    ref alternatives, ..
                }),
            ) => (alternatives.clone(), Some(error.clone())),
            Err(error) => return Err(error.into()),
        };
    let chosen = match (alternative, undecided) {
        (Some(number), _) => found.get(number.wrapping_sub(1)).ok_or_else(|| {
            let motions = counted(found.len(), "motion was", "motions were");
            CliError::usage(format!(
                "--alternative {number} is not there: {motions} found"
            ))
        })?,
        (None, None) => &found[0],
        (None, Some(error)) => {
            let choices = Choices::of(&found, counts, &error);
            print_report(json, &choices, || choices.to_string())?;
            return Err(error.into());
        }
    };
    let alignment = match &chosen.icp {
        Some(fit) => AlignmentReport::of_icp("features", fit, points.len()),
        None => AlignmentReport::of("features", &chosen.source_to_target),
    };
    let alignment = AlignmentReport {
        explained: Some(AlignmentEvidence::of(chosen, counts)),
        ..alignment
    };
    alignment.warn();
    Ok((chosen.source_to_target, Some(alignment)))
}

/// Motion that fits picked point pairs; `scan` is the mesh and `space` the truth.
///
/// # Errors
/// [`CliError`], [`CliError::calibration`].
pub(super) fn aligned_by_pairs(path: &Path) -> AlignmentResult {
    let file = read_pairs(path)?;
    let fit = fit_pairs(&file.pairs, &PairsParams::default())
        .map_err(|error| CliError::calibration(path, error))?;
    let numbered: Vec<String> = (1..=file.pairs.len())
        .map(|number| number.to_string())
        .collect();
    let names = if file.names.len() == file.pairs.len() {
        &file.names
    } else {
        &numbered
    };
    let residuals = names
        .iter()
        .zip(&fit.residuals)
        .map(|(name, residual)| Residual::of(name, residual))
        .collect();
    let alignment = AlignmentReport {
        residuals,
        rms_mm: Some(fit.rms * 1e3),
        ..AlignmentReport::of("pairs", &fit.motion)
    };
    Ok((fit.motion, Some(alignment)))
}

fn spread(mesh: &TriMesh, count: f64, seed: u64) -> Vec<OrientedSample> {
    let samples = sample_surface(
        mesh,
        count / surface_area(mesh).max(f64::MIN_POSITIVE),
        seed,
    );
    samples
        .iter()
        .map(|sample| OrientedSample {
            point: sample.point,
            normal: mesh.normal(sample.face),
        })
        .collect()
}

/// The mesh after a motion.
pub(super) fn moved(mesh: &TriMesh, pose: &Isometry3<f64>) -> TriMesh {
    let mut moved = mesh.clone();
    if *pose != Isometry3::identity() {
        for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
            moved.set_position(vertex, pose * mesh.position(vertex));
        }
    }
    moved
}

impl AlignmentReport {
    fn of(method: &'static str, motion: &Isometry3<f64>) -> Self {
        Self {
            method,
            motion: MotionReport::of(motion),
            ..Self::default()
        }
    }

    fn of_icp(method: &'static str, fit: &IcpFit, points: usize) -> Self {
        Self {
            rms_mm: Some(fit.rms * 1e3),
            fit: Some(FitReport::of(fit, points)),
            undetermined: fit
                .undetermined()
                .map(|motion| UndeterminedMotionReport::of(motion, fit))
                .collect(),
            ..Self::of(method, &fit.source_to_target)
        }
    }

    /// Method and residuals of the alignment.
    pub(super) fn in_short(&self) -> String {
        let rms = self
            .rms_mm
            .map_or_else(String::new, |rms_mm| format!(", rms {rms_mm:.4} mm"));
        format!("aligned by {}{rms}", self.method)
    }

    /// Points of the alignment, if any.
    pub(super) fn details(&self) -> Option<String> {
        let FitReport {
            points,
            inliers,
            rounds,
        } = self.fit.as_ref()?;
        Some(format!(
            "aligned by {inliers} of {points} points, {}",
            counted(*rounds, "round", "rounds")
        ))
    }

    fn warn(&self) {
        let count = self.undetermined.len();
        if count > 0 {
            let (motions, these) = (
                counted(count, "motion leaves", "motions leave"),
                if count == 1 { "this" } else { "these" },
            );
            warn!("{motions} the mesh on the truth as it is: it stays where it is in {these}");
        }
    }
}

impl fmt::Display for AlignmentReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.motion.translation_mm;
        write!(
            f,
            "aligned by {}: shift ({x:.3}, {y:.3}, {z:.3}) mm",
            self.method
        )?;
        self.explained
            .iter()
            .try_for_each(|explained| write!(f, ", {explained}"))?;
        self.rms_mm
            .iter()
            .try_for_each(|rms_mm| write!(f, ", rms {rms_mm:.4} mm"))?;
        for Residual {
            pair,
            residual_mm: [x, y, z],
            distance_mm,
        } in &self.residuals
        {
            write!(
                f,
                "\n  pair {pair}: off by ({x:.3}, {y:.3}, {z:.3}) mm, {distance_mm:.3} mm"
            )?;
        }
        for UndeterminedMotionReport {
            shift,
            turn_rad_per_mm,
            about_mm,
        } in &self.undetermined
        {
            let [[a, b, c], [p, q, r], [x, y, z]] = [shift, turn_rad_per_mm, about_mm];
            write!(
                f,
                "\n  not determined: shift ({a:.2}, {b:.2}, {c:.2}) mm with turn ({p:.4}, {q:.4}, {r:.4}) rad about ({x:.1}, \
                 {y:.1}, {z:.1}) mm"
            )?;
        }
        Ok(())
    }
}

impl fmt::Display for AlignmentEvidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {}",
            self.explained_features,
            counted(self.mesh_features, "feature", "features")
        )?;
        self.agreeing_share
            .iter()
            .try_for_each(|share| write!(f, " and {:.1} % of the surface agree", share * 100.0))
    }
}

impl fmt::Display for Choices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.free_turn {
            None => writeln!(
                f,
                "these motions explain the mesh about equally well; --alternative K takes one"
            )?,
            Some(FreeTurnReport {
                axis: [a, b, c],
                through_mm: [x, y, z],
            }) => writeln!(
                f,
                "free to turn about ({a:.3}, {b:.3}, {c:.3}) through ({x:.2}, {y:.2}, {z:.2}) mm; --alternative K takes one \
                 with the turn that it has"
            )?,
        }
        write!(
            f,
            "{:>2}  {:>30}  {:>8}  {:>7}  {:>8}   against the first: turn about, and shift",
            "K", "shift, mm", "features", "surface", "rms, mm"
        )?;
        for choice in &self.ambiguous {
            let three = |v: &[f64; 3], digits: usize| {
                format!("{:.digits$} {:.digits$} {:.digits$}", v[0], v[1], v[2])
            };
            let AlignmentEvidence {
                explained_features,
                mesh_features,
                agreeing_share,
                ..
            } = &choice.explained;
            let surface =
                agreeing_share.map_or_else(String::new, |share| format!("{:.1} %", share * 100.0));
            let rms = choice
                .rms_mm
                .map_or_else(String::new, |rms| format!("{rms:.4}"));
            write!(
                f,
                "\n{:>2}  {:>30}  {:>8}  {surface:>7}  {rms:>8}   {:.2}° ({}), ({}) mm",
                choice.alternative,
                three(&choice.motion.translation_mm, 3),
                format!("{explained_features}/{mesh_features}"),
                choice.turn_deg,
                three(&choice.turn_axis, 3),
                three(&choice.shift_mm, 3)
            )?;
        }
        Ok(())
    }
}
