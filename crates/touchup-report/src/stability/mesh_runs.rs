//! Runs of a whole refiner: a ball presses on a face of a sheet, from equilateral triangles to
//! needles and slivers.

use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;

use super::face_runs::{RunEnding, goes_over, log_uniform};
use touchup_geometry::mesh::{FaceId, TriMesh};
use touchup_method::haptic::{RefineParams, Refiner, RegionFit};
use touchup_method::names;
use touchup_method::stylus::{Sample, TipParams, Wrench};

/// Cells along each side of the sheet.
const CELLS: u32 = 12;
/// Samples in each run.
const SAMPLES: i64 = 30;
/// Radius of the ball, m.
const RADIUS: f64 = 1.5e-3;
/// Stiffness of the probe, N/m.
const STIFFNESS: f64 = 2e4;
/// Least crossing of the rest point that counts, m.
const CROSSING: f64 = 1e-9;
/// Decades of the quality: from one in a thousand to one.
pub(super) const QUALITY: std::ops::Range<f64> = -3.0..0.0;

names! {
    /// Kind of degenerate triangle.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum BadShape {
        /// two long sides and a short one
        Needle = "needles",
        /// one long side with the other two almost on it
        Sliver = "slivers",
    }
}

/// One press on one sheet.
#[derive(Clone, Debug)]
pub(super) struct MeshRun {
    /// altitude over longest side of all triangles; 0.87 for equilateral ones
    pub quality: f64,
    /// relaxation over one step: α k dt
    pub stiffness: f64,
    pub shape: BadShape,
    edge: f64,
    dt_s: f64,
    alpha: f64,
    face: u32,
    tilt: Vector3<f64>,
    depth: f64,
}

impl MeshRun {
    /// Draws a press on a sheet of such triangles.
    pub fn draw(rng: &mut Pcg64, shape: BadShape) -> Self {
        // a sample acts for 30 ms at most
        let dt_s = log_uniform(rng, -6.0..-1.5);
        let stiffness = log_uniform(rng, -6.0..6.0);
        Self {
            quality: 0.75f64.sqrt() * log_uniform(rng, QUALITY),
            stiffness,
            shape,
            edge: log_uniform(rng, -3.5..-2.0),
            dt_s,
            alpha: stiffness / (STIFFNESS * dt_s),
            // in the middle of the sheet
            face: (CELLS * CELLS / 2 + CELLS / 2) * 2 + rng.random_range(0..2),
            tilt: 0.2
                * Vector3::new(
                    rng.random_range(-1.0..1.0),
                    rng.random_range(-1.0..1.0),
                    0.0,
                ),
            depth: 1e-4 * rng.random_range(-1.0..1.0),
        }
    }

    /// A flat sheet of equal triangles with sides of at most `edge`, slightly curled: all normals
    /// differ.
    fn sheet(&self) -> TriMesh {
        let height = self.quality * self.edge;
        let is_sliver = self.shape == BadShape::Sliver;
        // the top over the end of the base, or over its middle
        let lean = if is_sliver { 0.5 } else { 0.0 };
        let turn = Rotation3::from_euler_angles(0.3, -0.2, 0.7);
        let row = CELLS + 1;
        let at = |k: u32| {
            let (i, j) = (k % row, k / row);
            let (x, y) = (f64::from(i) + lean * f64::from(j % 2), f64::from(j));
            let bent = 0.02 * height * ((f64::from(i) * 1.3).sin() + (f64::from(j) * 0.7).cos());
            turn * Point3::new(x * self.edge, y * height, bent)
        };
        let faces = (0..CELLS * CELLS).flat_map(|k| {
            let (a, is_odd) = (k % CELLS + k / CELLS * row, k / CELLS % 2 == 1);
            let [b, c, d] = [a + 1, a + row + 1, a + row];
            if is_odd && is_sliver {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            }
        });
        let positions = (0..row * row).map(at).collect();
        TriMesh::new(positions, faces.collect())
            .unwrap_or_else(|error| unreachable!("the sheet is sound: {error}"))
    }

    /// Presses, and judges the mesh.
    pub fn judge(&self) -> RunEnding {
        let mesh = self.sheet();
        let mut params = RefineParams::robust(TipParams {
            radius: RADIUS,
            stiffness: Some(STIFFNESS),
        });
        params.dynamics.alpha_m_per_n_s = self.alpha;
        let before: Vec<Vector3<f64>> = mesh.faces().map(|(face, _)| mesh.normal(face)).collect();
        let (barycentre, normal) = (
            mesh.barycentre(FaceId(self.face)),
            mesh.normal(FaceId(self.face)),
        );
        let Ok(mut refiner) = Refiner::new(mesh, params) else {
            return RunEnding::GaveUp;
        };
        let measured = (normal + self.tilt).normalize();
        let force = 2.0 * measured;
        let centre = barycentre + measured * (RADIUS + self.depth) - force / STIFFNESS;
        let wrench = Wrench {
            force,
            torque: Vector3::zeros(),
        };
        let pose_ot = Isometry3::from_parts(centre.coords.into(), UnitQuaternion::identity());
        let point = centre - measured * RADIUS;
        let mut last = None;
        for i in 1..=SAMPLES {
            let stamp_ns = (i as f64 * self.dt_s * 1e9) as i64;
            let Ok(update) = refiner.push(&Sample {
                stamp_ns,
                pose_ot,
                wrench,
            }) else {
                return RunEnding::GaveUp;
            };
            if update.fit == Some(RegionFit::CutBack) {
                return RunEnding::CutBack;
            }
            let Some(mismatch) = update.mismatch else {
                continue;
            };
            let face = mismatch.face;
            let now = (
                face,
                refiner.mesh().barycentre(face),
                refiner.mesh().normal(face),
            );
            if last
                .replace(now)
                .is_some_and(|last| crosses(last, now, &point, &force))
            {
                return RunEnding::Overshot;
            }
        }
        if refiner.counts().cut_back > 0 {
            RunEnding::CutBack
        } else {
            sound(refiner.mesh(), &before)
        }
    }
}

/// The pressed face after one sample: its barycentre and its normal.
type PressedFace = (FaceId, Point3<f64>, Vector3<f64>);

/// Whether the face crossed its rest point from one sample to the `next`, for the normals before
/// and after.
fn crosses(
    last: PressedFace,
    next: PressedFace,
    point: &Point3<f64>,
    force: &Vector3<f64>,
) -> bool {
    // distance to equilibrium, m
    let [from, to] = [last.1, next.1].map(|barycentre| {
        [last.2, next.2].map(|n| (point - barycentre).dot(&n) + force.dot(&n) / STIFFNESS)
    });
    last.0 == next.0 && goes_over(from, to, CROSSING)
}

/// Checks for finite positions, and unit normals in their old directions.
fn sound(mesh: &TriMesh, before: &[Vector3<f64>]) -> RunEnding {
    if !mesh
        .positions()
        .iter()
        .all(|p| p.iter().all(|x| x.is_finite()))
    {
        return RunEnding::NotFinite;
    }
    for (face, _) in mesh.faces() {
        let normal = mesh.normal(face);
        if (normal.norm() - 1.0).abs() > 1e-9 && mesh.double_area_normal(face) != Vector3::zeros() {
            return RunEnding::NotUnit;
        }
        if normal.dot(&before[face.0 as usize]) <= 0.0 {
            return RunEnding::Flipped;
        }
    }
    RunEnding::Stable
}
