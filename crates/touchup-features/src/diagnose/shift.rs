//! Search for a common shift that puts the contacts on the scan.

use nalgebra::{Point3, Vector3};

use super::places::BallFit;
use touchup_geometry::mesh::{FaceTree, TriMesh, VertexId};

/// Contacts, and vertices of the scan, paired for candidate shifts.
const CONTACTS: usize = 24;
const VERTICES: usize = 48;
/// Contacts for the first evaluation of a shift.
const JUDGES: usize = 60;
/// Number of best shifts for refinement.
const REFINED: usize = 8;
/// Steps of the refinement: the first in tolerances, each next half as long.
const FIRST_STEP: f64 = 4.0;
const STEPS: usize = 6;

/// A shift of all contacts, and their fit after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactShift {
    /// m
    pub shift: Vector3<f64>,
    /// share of the contacts that the scan explains
    pub share: f64,
}

/// The shift with most contacts on the scan: candidates lay each of some contacts on each of some
/// vertices, and the best candidates are refined.
pub(super) fn best_shift(
    scan: &TriMesh,
    tree: &FaceTree,
    (centres, forces): (&[Point3<f64>], &[Vector3<f64>]),
    radius: f64,
    tolerance: f64,
) -> Option<ContactShift> {
    let every = |most: usize| centres.len().div_ceil(most).max(1);
    let some = |most: usize| centres.iter().step_by(every(most));
    let judges: Vec<Point3<f64>> = some(JUDGES).copied().collect();
    let of_judges: Vec<Vector3<f64>> = forces.iter().step_by(every(JUDGES)).copied().collect();
    let share_of = |of: &[Point3<f64>], forces: &[Vector3<f64>], shift: Vector3<f64>| {
        let moved = of.iter().map(|centre| centre + shift);
        BallFit::of(scan, tree, moved, radius, tolerance)
            .explained(forces, radius, tolerance)
            .on_scan()
    };
    let share = |of: &[Point3<f64>], shift| share_of(of, forces, shift);
    let vertices = (0..scan.vertex_slots()).step_by((scan.vertex_slots() / VERTICES).max(1));
    let vertices = vertices
        .map(|at| VertexId(at as u32))
        .filter(|&vertex| scan.has_vertex(vertex));
    let mut shifts: Vec<ContactShift> = vertices
        .filter_map(|vertex| {
            let normals = scan
                .star(vertex)
                .iter()
                .map(|&face| scan.double_area_normal(face))
                .sum::<Vector3<f64>>();
            Some(scan.position(vertex) + normals.try_normalize(0.0)? * radius)
        })
        .flat_map(|place| some(CONTACTS).map(move |centre| place - centre))
        .map(|shift| ContactShift {
            shift,
            share: share_of(&judges, &of_judges, shift),
        })
        .collect();
    shifts.sort_by(|a, b| b.share.total_cmp(&a.share));
    let refined = shifts.into_iter().take(REFINED).map(|mut best| {
        best.share = share(centres, best.shift);
        let mut step = FIRST_STEP * tolerance;
        for _ in 0..STEPS {
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let shift = best.shift + Vector3::ith(axis, sign * step);
                    let share = share(centres, shift);
                    if share > best.share {
                        best = ContactShift { shift, share };
                    }
                }
            }
            step /= 2.0;
        }
        best
    });
    refined.max_by(|a, b| a.share.total_cmp(&b.share))
}
