//! Small rigid offset between scan and touched part, from contacts against the untouched scan.
//!
//! Point to plane: a scan point q with normal n, moved by a small twist (t, θ) about the centre c,
//! meets the contact p when n · (p − q) = n · t + ((q − c) × n) · θ + b. A scan may also be too fat
//! or too thin all over, b; touches from one side cannot distinguish that from a shift, so b enters
//! with its prior. The noise of a scan is correlated: all contacts in one cell of the correlation
//! length count as one.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix6, Point3, SMatrix, SVector, Vector3, Vector6};

use super::ScanParams;
use crate::stylus::SettingError;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_geometry::numeric::mean;
use touchup_geometry::numeric::{
    NormalEquations, VoxelKey, cauchy_weight, direction, moved_by_twist, point_to_plane_row,
    voxel_neighbourhood, voxel_of,
};

/// Settings of a [`Registrar`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegistrationParams {
    /// Standard deviation of the scan from the true surface, m.
    pub scan_noise: f64,
    /// Edge of the square over which the noise of the scan counts as one value, m: the root of the
    /// area under its correlation. Default 9 mm, for waves smoothed by 3.5 mm.
    pub correlation: f64,
    /// Usual surface offset of a scan, fat or thin, standard deviation, m. Default 0.3 mm.
    pub surface_offset: f64,
    /// Distance below which contacts merge, m. Default 1 mm.
    pub spacing: f64,
}

impl Default for RegistrationParams {
    fn default() -> Self {
        Self {
            scan_noise: ScanParams::default().noise,
            correlation: 9e-3,
            surface_offset: 0.3e-3,
            spacing: 1e-3,
        }
    }
}

/// A rigid offset with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// Moves the scan onto the contacts: x ↦ c + R (x − c) + t.
    pub scan_to_part: Isometry3<f64>,
    /// The same motion as shift t of the centre and rotation vector θ, m and rad.
    pub twist: Vector6<f64>,
    /// Covariance of (t, θ), symmetric, m², m·rad and rad².
    pub covariance: Matrix6<f64>,
    /// Centre of the rotation: the middle of the contacts, m, in O.
    pub centre: Point3<f64>,
    /// Surface offset of the scan, positive if fatter, m, and its standard uncertainty.
    pub surface_offset: [f64; 2],
    /// Number of contacts in use, one per voxel.
    pub contacts: usize,
}

/// Reason for a missing [`Registration`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegistrationError {
    /// Too few touches.
    #[error(
        "{cells} separate places of the scan were touched, {needed} are needed: touch more of it"
    )]
    TooFew {
        /// cells of the correlation length
        cells: usize,
        /// minimum number of cells
        needed: usize,
    },
    /// The touched surfaces let the scan slide.
    #[error(
        "the touched surfaces let the scan move along {}: touch faces of other orientations",
        list(directions)
    )]
    Undetermined {
        /// shift and turn about the middle of the contacts; unit, with a turn expressed by its
        /// average shift
        directions: Vec<Vector6<f64>>,
    },
    /// Iterations that do not converge, or end outside the range of a small offset.
    #[error("the registration does not converge to one place of the scan")]
    NotConverged,
}

fn list(directions: &[Vector6<f64>]) -> String {
    let name = |d: &Vector6<f64>| {
        let part = |what, v: [f64; 3]| format!("{what} ({:.2}, {:.2}, {:.2})", v[0], v[1], v[2]);
        format!(
            "{} with {}",
            part("shift", [d[0], d[1], d[2]]),
            part("turn", [d[3], d[4], d[5]])
        )
    };
    directions.iter().map(name).collect::<Vec<_>>().join("; ")
}

/// Mean contact of a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    count: f64,
}

/// Twist and surface offset.
type Unknowns = SVector<f64, 7>;
type Information = SMatrix<f64, 7, 7>;

/// Collects contacts as the means of small cells, up to a maximum number.
#[derive(Clone, Debug)]
pub struct Registrar {
    params: RegistrationParams,
    means: BTreeMap<(VoxelKey, i8), Mean>,
}

/// Maximum number of contact cells; the registrar ignores later ones elsewhere.
const MOST_MEANS: usize = 50_000;
/// Minimum number of separate places that determines six numbers.
const LEAST_CELLS: usize = 20;
/// Smallest cosine between the normals of a contact and its face: 37°.
const SMALLEST_COSINE: f64 = 0.8;
/// Smallest part of the normals in a determined direction: 6° of noise is 0.01.
const LEAST_SHARE: f64 = 0.02;
/// Maximum rounds of closest points.
const ROUNDS: usize = 30;
/// Motion below which a round is the last, in scan noises: below it contacts alternate between
/// faces.
const REST: f64 = 0.02;
/// Largest alternation of late iterations that count as converged, in standard uncertainties.
const SMALL_STEP: f64 = 0.3;
/// Smallest mean square error, in squares of the scan's noise.
const LEAST_SCALE: f64 = 0.05;
/// Error with half the weight, in scan noises.
const HALF_WEIGHT: f64 = 3.0;
/// Maximum distance of a contact from the scan, in scan noises: beyond it is a missing feature.
const REACH: f64 = 4.0;

impl Registrar {
    /// # Errors
    /// [`SettingError`] unless all settings are more than 0.
    pub fn new(params: RegistrationParams) -> Result<Self, SettingError> {
        let RegistrationParams {
            scan_noise,
            correlation,
            surface_offset,
            spacing,
        } = params;
        for (name, value) in [
            ("scan noise (m)", scan_noise),
            ("correlation length of the scan (m)", correlation),
            ("surface offset of the scan (m)", surface_offset),
            ("spacing of contacts (m)", spacing),
        ] {
            SettingError::check(name, value, value > 0.0, "more than 0")?;
        }
        Ok(Self {
            params,
            means: BTreeMap::new(),
        })
    }

    /// Takes a point of the part, m, with its outward unit normal, in O.
    pub fn push(&mut self, point: &Point3<f64>, normal: &Vector3<f64>) {
        // keeps the two sides of a thin wall apart
        let facing = (normal.iamax() as i8 + 1) * if normal[normal.iamax()] < 0.0 { -1 } else { 1 };
        let cell = (voxel_of(point, self.params.spacing), facing);
        if self.means.len() >= MOST_MEANS && !self.means.contains_key(&cell) {
            return;
        }
        let mean = self.means.entry(cell).or_default();
        mean.point += point.coords;
        mean.normal += normal;
        mean.count += 1.0;
    }

    /// Offset at which the scan fits the contacts best.
    ///
    /// - `scan`: untouched, with the tree over its faces.
    ///
    /// # Errors
    /// [`RegistrationError`].
    pub fn estimate(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
    ) -> Result<Registration, RegistrationError> {
        let contacts: Vec<_> = self.means.values().filter_map(contact_of).collect();
        let centre = Point3::from(mean(contacts.iter().map(|(p, _)| p.coords)));
        let mut pose = Isometry3::identity();
        for round in 0..ROUNDS {
            let fit = RegistrationRound::of(self, &contacts, scan, tree, &centre, &pose)?;
            let [shift, turn] = [0, 3].map(|at| fit.step.fixed_rows::<3>(at).into_owned());
            pose = moved_by_twist(&pose, &centre, &shift, &turn);
            let largest = pose.translation.vector.norm() + (pose * centre - centre).norm();
            if !largest.is_finite()
                || (pose * centre - centre).norm() > REACH * self.params.scan_noise
            {
                break;
            }
            let moved = shift.norm() + turn.norm() * fit.lever;
            let is_at_rest = moved < REST * self.params.scan_noise;
            if is_at_rest || (round >= ROUNDS / 2 && fit.step_in_sigmas() < SMALL_STEP) {
                return Ok(fit.registration(&pose, &centre));
            }
        }
        Err(RegistrationError::NotConverged)
    }
}

fn contact_of(mean: &Mean) -> Option<(Point3<f64>, Vector3<f64>)> {
    Some((
        Point3::from(mean.point / mean.count),
        direction(&mean.normal)?,
    ))
}

/// Equation of one contact: its distance from the scan by the unknowns.
struct ContactRow {
    row: Unknowns,
    /// distance along its normal, m
    error: f64,
    /// square of its distance from the centre, m²
    arm_squared: f64,
    contact: Point3<f64>,
}

impl ContactRow {
    /// Distance after a step.
    fn left(&self, step: &Unknowns) -> f64 {
        self.error - self.row.dot(step)
    }
}

/// Step by reweighted least squares, and the distance at which a contact has half of its weight.
///
/// - `prior`: information about the surface offset.
/// - `unit`: information of a contact of weight 1.
fn robust_step(
    rows: &[ContactRow],
    scan_noise: f64,
    prior: f64,
    unit: f64,
) -> Result<(Unknowns, f64), RegistrationError> {
    let (mut step, mut half_weight) = (Unknowns::zeros(), f64::INFINITY);
    for _ in 0..5 {
        let mut equations = NormalEquations::default();
        equations.information[(6, 6)] = prior;
        let values = rows.iter().map(|row| (row.row, row.error));
        equations.add_reweighted(values, &step, |_, left| {
            cauchy_weight((left / half_weight).powi(2)) * unit
        });
        step = equations
            .solution()
            .ok_or(RegistrationError::NotConverged)?;
        half_weight = HALF_WEIGHT * scan_noise;
    }
    Ok((step, half_weight))
}

/// Covariance of the step, by the growth of the weighted errors instead of the weights.
///
/// - `scale`: variance of the errors, of that of the scan.
fn covariance(
    rows: &[ContactRow],
    weights: &[f64],
    prior: f64,
    unit: f64,
    scale: f64,
) -> Result<Information, RegistrationError> {
    let mut slopes = Information::zeros();
    slopes[(6, 6)] = prior;
    for (ContactRow { row, .. }, weight) in rows.iter().zip(weights) {
        slopes += row * row.transpose() * (weight * (2.0 * weight - 1.0) * unit);
    }
    let inverse = slopes
        .try_inverse()
        .ok_or(RegistrationError::NotConverged)?;
    let mut covariance = inverse * scale;
    // the prior of the surface offset does not depend on the errors
    covariance += inverse.column(6) * inverse.column(6).transpose() * (prior * (1.0 - scale));
    Ok(covariance)
}

/// One round of least squares.
struct RegistrationRound {
    /// t, θ, and the surface offset itself
    step: Unknowns,
    covariance: Information,
    lever: f64,
    contacts: usize,
}

impl RegistrationRound {
    /// Length of the step in standard uncertainties; infinite without valid ones.
    fn step_in_sigmas(&self) -> f64 {
        let twist = self.step.fixed_rows::<6>(0).into_owned();
        let covariance = self.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        covariance
            .cholesky()
            .map_or(f64::INFINITY, |c| twist.dot(&c.solve(&twist)).sqrt())
    }

    fn of(
        registrar: &Registrar,
        contacts: &[(Point3<f64>, Vector3<f64>)],
        scan: &TriMesh,
        tree: &FaceTree,
        centre: &Point3<f64>,
        pose: &Isometry3<f64>,
    ) -> Result<Self, RegistrationError> {
        let RegistrationParams {
            scan_noise,
            correlation,
            surface_offset,
            ..
        } = registrar.params;
        // the scan stays in place: the contacts move back
        let rows: Vec<_> = contacts
            .iter()
            .filter_map(|(p, n)| {
                let hit = tree.closest(scan, &(pose.inverse() * p), REACH * scan_noise)?;
                let is_same = scan.normal(hit.face).dot(&(pose.inverse() * n)) >= SMALLEST_COSINE;
                let arm = p - centre;
                let row = point_to_plane_row(&arm, n, 1.0).insert_row(6, -1.0);
                is_same.then(|| ContactRow {
                    row,
                    error: n.dot(&(p - pose * hit.point)),
                    arm_squared: arm.norm_squared(),
                    contact: *p,
                })
            })
            .collect();
        let cells: std::collections::BTreeSet<_> = rows
            .iter()
            .map(|row| voxel_of(&row.contact, correlation))
            .collect();
        if cells.len() < LEAST_CELLS {
            return Err(RegistrationError::TooFew {
                cells: cells.len(),
                needed: LEAST_CELLS,
            });
        }
        let count = rows.len() as f64;
        let lever = (rows.iter().map(|row| row.arm_squared).sum::<f64>() / count).sqrt();
        check_directions(&rows.iter().map(|row| row.row).collect::<Vec<_>>(), lever)?;

        let prior = 1.0 / (surface_offset * surface_offset);
        let unit = independent(rows.iter().map(|row| &row.contact), correlation)
            / count
            / (scan_noise * scan_noise);
        let (step, half_weight) = robust_step(&rows, scan_noise, prior, unit)?;
        let weights: Vec<f64> = rows
            .iter()
            .map(|row| cauchy_weight((row.left(&step) / half_weight).powi(2)))
            .collect();
        // no better than the stated noise of the scan: few places can agree by chance
        let square: f64 = rows
            .iter()
            .zip(&weights)
            .map(|(row, w)| w * row.left(&step).powi(2))
            .sum();
        let scale =
            (square / weights.iter().sum::<f64>() / (scan_noise * scan_noise)).max(LEAST_SCALE);
        Ok(Self {
            step,
            covariance: covariance(&rows, &weights, prior, unit, scale)?,
            lever,
            contacts: rows.len(),
        })
    }

    fn registration(&self, pose: &Isometry3<f64>, centre: &Point3<f64>) -> Registration {
        let (shift, turn) = (pose * centre - centre, pose.rotation.scaled_axis());
        Registration {
            scan_to_part: *pose,
            twist: Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z),
            covariance: self.covariance.fixed_view::<6, 6>(0, 0).into_owned(),
            centre: *centre,
            surface_offset: [self.step[6], self.covariance[(6, 6)].sqrt()],
            contacts: self.contacts,
        }
    }
}

/// Number of independent values of the scan's noise among `points`: n² / Σ ρ(p − q) with a
/// correlation ρ that falls linearly to 0 over `correlation` on each axis.
fn independent<'a>(points: impl Iterator<Item = &'a Point3<f64>>, correlation: f64) -> f64 {
    let mut cells: BTreeMap<VoxelKey, f64> = BTreeMap::new();
    points.for_each(|p| *cells.entry(voxel_of(p, correlation / 2.0)).or_insert(0.0) += 1.0);
    let total: f64 = cells.values().sum();
    let mut alike = 0.0;
    for (cell, count) in &cells {
        for near in voxel_neighbourhood(*cell) {
            let steps = cell.iter().zip(near).filter(|(a, b)| *a != b).count();
            alike += count * cells.get(&near).copied().unwrap_or(0.0) * 0.5f64.powi(steps as i32);
        }
    }
    total * total / alike
}

/// Refuses if a direction of motion leaves all planes in place.
fn check_directions(rows: &[Unknowns], lever: f64) -> Result<(), RegistrationError> {
    let mut information = Matrix6::zeros();
    for row in rows {
        let row = Vector6::from_fn(|i, _| {
            if i < 3 {
                row[i]
            } else {
                row[i] / lever.max(f64::MIN_POSITIVE)
            }
        });
        information += row * row.transpose() / rows.len() as f64;
    }
    let eigen = information.symmetric_eigen();
    let loose = (0..6).filter(|&i| eigen.eigenvalues[i] < LEAST_SHARE);
    let directions: Vec<_> = loose
        .map(|i| eigen.eigenvectors.column(i).into_owned())
        .collect();
    if directions.is_empty() {
        Ok(())
    } else {
        Err(RegistrationError::Undetermined { directions })
    }
}
