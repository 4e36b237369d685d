//! Carving (case 2): what the tip passes through is not there.
//!
//! All faces inside the tip are displaced at once, the deepest first: the closest one along the arm
//! from it to the centre of the ball, the others, of which only those count that the tip comes to
//! from the front, out of the tip along the shortest path.

use nalgebra::{Point3, Vector3};

use super::{CarveParams, Case, MOST_LOOKED_AT, Refiner, RegionFit, Update};
use crate::mesh::{FaceHit, FaceId, triangle};
use crate::numeric::length_and_direction;
use crate::stylus::{Ball, TipBody, TipPlace, TouchState};

/// Faces beside the closest one that move in one update, at most: those of a ball on a scan as
/// coarse as itself.
const MOST_OTHERS: usize = 6;
/// An arm whose sine to the face is below this lies sideways.
const SIDEWAYS: f64 = 0.2;

/// A point of a face inside the tip.
struct Inside {
    /// direction of the shortest path out of the tip, unit
    out: Vector3<f64>,
    /// m
    depth: f64,
    barycentric: [f64; 3],
}

impl Refiner {
    /// Moves what is inside the tip out of it, unless the touch is too light to say so.
    pub(super) fn carve(
        &mut self,
        ball: &Ball,
        state: TouchState,
        dt: f64,
        update: Update,
    ) -> Update {
        let Some(carve) = self.params.carve else {
            return update;
        };
        // a mesh that the tip does not enter by more than the tolerance is left alone
        let (tolerance, hint) = if state == TouchState::Contact {
            (carve.contact_tolerance.max(carve.tolerance), self.nearest)
        } else {
            (carve.tolerance, self.carve_region.roi.handle)
        };
        let place = TipPlace {
            centre: ball.centre,
            axis: self.axis,
        };
        let (height, bound) = self.body.bound();
        let (middle, reach) = (place.centre + place.axis * height, bound - tolerance);
        let Some(hit) = self
            .deformable
            .closest(&middle, hint, reach, &mut self.near_tip)
        else {
            return update;
        };
        // before the face is moved
        let mismatch =
            (update.case == Case::Free).then(|| self.mismatch_in_free_motion(ball, hit.face));
        if state == TouchState::Light {
            return Update { mismatch, ..update };
        }
        let counts = self.body.is_ball() && !self.deformable.is_stiff(hit.face);
        let first = if counts {
            self.penetration(&place.centre, &hit)
        } else {
            None
        };
        let mut fit = first.map(|inside| self.displace(&carve, hit.face, &inside, dt));
        self.gather(&place, tolerance, hit.face);
        for at in 0..self.inside_faces.len().min(MOST_OTHERS) {
            let face = self.inside_faces[at].1;
            // the faces before it have taken its corners along
            if let Some(inside) = self
                .inside(&place, face)
                .filter(|inside| inside.depth > tolerance)
            {
                let moved = self.displace(&carve, face, &inside, dt);
                fit = fit.or(Some(moved));
                // if the mesh cannot follow a deeper face, it does not follow those beside it
                // either
                if moved == RegionFit::CutBack {
                    break;
                }
            }
        }
        match update.case {
            Case::Free => Update {
                case: if fit.is_some() {
                    Case::MeshOnly
                } else {
                    Case::Free
                },
                mismatch,
                fit,
            },
            _ => update,
        }
    }

    /// Moves a face by the share of its depth that is carved in `dt` (s).
    fn displace(
        &mut self,
        carve: &CarveParams,
        face: FaceId,
        inside: &Inside,
        dt: f64,
    ) -> RegionFit {
        let Inside {
            out,
            depth,
            barycentric,
        } = inside;
        let share = -(-carve.rate * dt).exp_m1();
        let depth_step = (share * (depth - carve.tolerance))
            .min(2.0 * self.params.longest_step_edges * self.deformable.mean_edge);
        let weight: f64 = barycentric.iter().map(|x| x * x).sum();
        let steps = barycentric.map(|x| out * (depth_step * x / weight));
        let fit = self.deformable.deform(&mut self.carve_region, face, &steps);
        self.count(fit);
        fit
    }

    /// Finds the faces deeper in the tip than `tolerance` (m), the deepest first; not the `first`,
    /// when the tip is a ball.
    fn gather(&mut self, place: &TipPlace, tolerance: f64, first: FaceId) {
        let (height, bound) = self.body.bound();
        let (middle, half) = (
            place.centre + place.axis * height,
            Vector3::repeat(bound - tolerance),
        );
        self.deformable
            .tree
            .faces_in_box(&(middle - half), &(middle + half), &mut self.near_faces);
        let near = &mut self.near_faces.faces;
        // in the order of their names: that of the tree depends on how it was built
        near.sort_unstable();
        let stride = near.len().div_ceil(MOST_LOOKED_AT).max(1);
        let mut found = std::mem::take(&mut self.inside_faces);
        found.clear();
        for &face in self
            .near_faces
            .faces
            .iter()
            .step_by(stride)
            .filter(|&&face| face != first || !self.body.is_ball())
        {
            if let Some(inside) = self
                .inside(place, face)
                .filter(|inside| inside.depth > tolerance)
            {
                found.push((inside.depth, face));
            }
        }
        found.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.inside_faces = found;
    }

    /// The deepest point of a face that the tip comes to from the front, of those that are looked
    /// at.
    fn inside(&self, place: &TipPlace, face: FaceId) -> Option<Inside> {
        if self.deformable.is_stiff(face) {
            return None;
        }
        let (mesh, body) = (&self.deformable.mesh, &self.body);
        let (corners, normal) = (mesh.triangle(face), mesh.normal(face));
        let (_, [u, v, w]) = deepest_point(body, place, &corners);
        let point =
            Point3::from(corners[0].coords * u + corners[1].coords * v + corners[2].coords * w);
        let (distance, out) = body.shortest_exit(place, &point);
        let is_front = normal.dot(&out) < -SIDEWAYS;
        (is_front && distance < 0.0).then_some(Inside {
            out,
            depth: -distance,
            barycentric: [u, v, w],
        })
    }

    /// The direction in which the mesh yields to the ball, and how deep the ball is in it.
    fn penetration(&self, centre: &Point3<f64>, hit: &FaceHit) -> Option<Inside> {
        let normal = self.deformable.mesh.normal(hit.face);
        let arm = centre - hit.point;
        let (distance, along) = length_and_direction(&arm);
        let height = arm.dot(&normal);
        if normal == Vector3::zeros() {
            return None;
        }
        // beside a rim the arm hardly separates inside from outside
        let away = if height.abs() <= SIDEWAYS * distance {
            normal
        } else {
            along * height.signum()
        };
        let depth = self.params.tip.radius - distance.copysign(height);
        Some(Inside {
            out: -away,
            depth,
            barycentric: hit.barycentric,
        })
    }
}

/// The point of a triangle deepest in the tip, with its barycentric coordinates; of a body that is
/// no ball, the best of the points closest to some balls along its axis.
fn deepest_point(
    body: &TipBody,
    place: &TipPlace,
    corners: &[Point3<f64>; 3],
) -> (Point3<f64>, [f64; 3]) {
    let first = triangle::closest_point(&place.centre, corners);
    if body.is_ball() {
        return first;
    }
    let (middle, bound) = body.bound();
    let heights = [0.25, 0.5, 1.0, 1.5].map(|share| share * middle);
    let others = heights
        .map(|height| triangle::closest_point(&(place.centre + place.axis * height), corners));
    let depth = |point: &Point3<f64>| body.signed_distance(place, point).min(bound);
    others.into_iter().fold(first, |best, other| {
        if depth(&other.0) < depth(&best.0) {
            other
        } else {
            best
        }
    })
}
