//! Carving (case 2): moves surface out of the path of the tip.
//!
//! All faces inside the tip move at once, the deepest first: the closest one along the arm from it
//! to the centre of the ball, the others out of the tip along the shortest path, if the tip comes
//! to them from the front.

use nalgebra::{Point3, Vector3};

use super::{CarveParams, Case, MOST_LOOKED_AT, Refiner, RegionFit, Update};
use crate::stylus::{Ball, TipBody, TipPlace, TouchState};
use touchup_geometry::mesh::{FaceHit, FaceId, triangle};
use touchup_geometry::numeric::length_and_direction;

/// Maximum number of faces to move in one update beside the closest one: a ball on a scan as coarse
/// as itself.
const MOST_OTHERS: usize = 6;
/// Sine of the angle between arm and face below which the arm lies sideways.
const SIDEWAYS: f64 = 0.2;

/// A point of a face inside the tip.
struct Penetration {
    /// direction of the shortest path out of the tip, unit
    out: Vector3<f64>,
    /// m
    depth: f64,
    barycentric: [f64; 3],
}

impl Refiner {
    /// Moves faces out of the tip, unless the touch is too light to decide.
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
        // penetration up to the tolerance leaves the mesh as it is
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
        // before the face moves
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
            // the faces before it have moved its corners
            if let Some(inside) = self
                .inside(&place, face)
                .filter(|inside| inside.depth > tolerance)
            {
                let moved = self.displace(&carve, face, &inside, dt);
                fit = fit.or(Some(moved));
                // a mesh that cannot follow a deeper face does not follow the faces beside it
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

    /// Moves a face by the share of its depth to carve in `dt` (s).
    fn displace(
        &mut self,
        carve: &CarveParams,
        face: FaceId,
        inside: &Penetration,
        dt: f64,
    ) -> RegionFit {
        let Penetration {
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

    /// Finds the faces deeper in the tip than `tolerance` (m), the deepest first; without `first`
    /// if the tip is a ball.
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
        // in order of ids: the order in the tree depends on its construction
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

    /// Deepest tested point of a face, if the tip comes to the face from the front.
    fn inside(&self, place: &TipPlace, face: FaceId) -> Option<Penetration> {
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
        (is_front && distance < 0.0).then_some(Penetration {
            out,
            depth: -distance,
            barycentric: [u, v, w],
        })
    }

    /// Direction in which the mesh yields to the ball, and depth of the ball in it.
    fn penetration(&self, centre: &Point3<f64>, hit: &FaceHit) -> Option<Penetration> {
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
        Some(Penetration {
            out: -away,
            depth,
            barycentric: hit.barycentric,
        })
    }
}

/// Point of a triangle deepest in the tip, with its barycentric coordinates; for a body that is no
/// ball, the best of the points closest to some balls along its axis.
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
