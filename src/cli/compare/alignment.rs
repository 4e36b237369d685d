//! The mesh brought onto the truth, and how that is told.

use std::fmt;

use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use tracing::warn;

use crate::align::{IcpFit, IcpParams, Motion, icp};
use crate::cli::CliError;
use crate::cli::progress::Progress;
use crate::compare::{Shape, sample_surface, surface_area};
use crate::mesh::{TriMesh, VertexId};

/// Points of the mesh that are brought onto the truth.
const POINTS: f64 = 100_000.0;

/// What `--json` prints of the alignment.
#[derive(Debug, Serialize)]
pub(super) struct Alignment {
    method: &'static str,
    /// moves the mesh, as it is in its file, onto the truth: rows of the rotation
    rotation: [[f64; 3]; 3],
    /// and then the shift
    translation_mm: [f64; 3],
    /// of the points to the tangent planes
    rms_mm: f64,
    points: usize,
    inliers: usize,
    rounds: usize,
    /// small motions that leave the fit as it is
    undetermined: Vec<Loose>,
}

/// A motion that nothing holds: a shift along and a turn about a point.
#[derive(Debug, Serialize)]
struct Loose {
    /// of the point `about_mm`, times any length
    shift: [f64; 3],
    /// direction of the axis, times an angle per mm of the shift
    turn_rad_per_mm: [f64; 3],
    about_mm: [f64; 3],
}

/// The motion that brings `mesh` onto the truth, and what is said of it.
///
/// # Errors
/// [`CliError::Align`].
pub(super) fn aligned(mesh: &TriMesh, truth: Shape<'_>, seed: u64) -> Result<(Isometry3<f64>, Alignment), CliError> {
    let _aligning = Progress::stage("align");
    let samples = sample_surface(mesh, POINTS / surface_area(mesh).max(f64::MIN_POSITIVE), seed);
    let points: Vec<_> = samples.iter().map(|sample| sample.point).collect();
    let fit = icp(&points, truth.mesh, truth.tree, &Isometry3::identity(), &IcpParams::default())?;
    let told = Alignment::of(&fit, points.len());
    if !told.undetermined.is_empty() {
        warn!(
            "{} motions leave the mesh on the truth as it is: it stays where its file has it in these",
            told.undetermined.len()
        );
    }
    Ok((fit.source_to_target, told))
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

impl Alignment {
    fn of(fit: &IcpFit, points: usize) -> Self {
        let rotation = fit.source_to_target.rotation.to_rotation_matrix();
        let mm = |v: Vector3<f64>| [v.x, v.y, v.z].map(|x| x * 1e3);
        let loose = |motion: &Motion| Loose {
            shift: motion.shift.into(),
            turn_rad_per_mm: (motion.turn / fit.lever * 1e-3).into(),
            about_mm: mm(fit.centre.coords),
        };
        Self {
            method: "icp",
            rotation: std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)])),
            translation_mm: mm(fit.source_to_target.translation.vector),
            rms_mm: fit.rms * 1e3,
            points,
            inliers: fit.inliers,
            rounds: fit.rounds,
            undetermined: fit.undetermined().map(loose).collect(),
        }
    }
}

impl fmt::Display for Alignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, rms_mm, inliers, points, rounds, undetermined, .. } = self;
        let [x, y, z] = self.translation_mm;
        write!(
            f,
            "aligned by {method}: shift ({x:.3}, {y:.3}, {z:.3}) mm, rms {rms_mm:.4} mm of {inliers} of {points} points, \
             {rounds} rounds"
        )?;
        for Loose { shift, turn_rad_per_mm, about_mm } in undetermined {
            let three =
                |v: &[f64; 3], digits: usize| format!("({:.digits$}, {:.digits$}, {:.digits$})", v[0], v[1], v[2]);
            write!(
                f,
                "\n  not determined: shift {} mm with turn {} rad about {} mm",
                three(shift, 2),
                three(turn_rad_per_mm, 4),
                three(about_mm, 1)
            )?;
        }
        Ok(())
    }
}
