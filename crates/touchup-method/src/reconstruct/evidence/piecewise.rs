//! The touched surface as the zero set of a field: piecewise smooth, evaluated from stored
//! contacts.
//!
//! Contacts near the point form smooth pieces; each piece has its own fit, so that no average runs
//! over an edge, and the pieces combine by the larger value at a convex edge, by the smaller one at
//! a concave. Within a piece a chord is at right angles to the mean of its end normals, which is
//! exact on circles and cylinders:
//!
//! f(x) = Σ wⱼ ½(nⱼ + g)·(x − cⱼ) / Σ wⱼ,   g = Σ wⱼ nⱼ / |Σ wⱼ nⱼ|
//!
//! wⱼ = Wⱼ exp(−(|x − cⱼ|² − d²) / max(σ², d²/2)), with d the distance to the nearest contact of
//! the piece: far from the surface all of its contacts count, near it only the nearest.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_map::{ContactMap, MeanContact};
use touchup_geometry::numeric::{direction, tangent_basis};

/// Grouping and weights of contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldParams {
    /// range of contacts, m
    pub reach: f64,
    /// σ: width of the weight around the nearest contact, m
    pub sigma: f64,
    /// cosine of the widest angle between a contact and its piece
    pub piece_cosine: f64,
    /// maximum distance of a contact from the chord to the middle of its piece, m
    pub chord: f64,
    /// minimum weight of a piece; a sliding contact has weight 1
    pub least_weight: f64,
}

impl FieldParams {
    /// Settings for a ball of `radius` (m): the passes of a hand are up to two radii apart.
    pub(crate) fn for_ball(radius: f64) -> Self {
        Self {
            reach: 2.0 * radius,
            sigma: radius / 2.0,
            piece_cosine: 0.819,
            chord: radius / 5.0,
            least_weight: 2.0,
        }
    }
}

/// The field of the touches at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FieldValue {
    /// signed distance from the surface, m; positive outside the part
    pub value: f64,
    /// unit gradient
    pub gradient: Vector3<f64>,
    /// distance to the nearest contact, or to the extent of a known surface, m
    pub nearest: f64,
    /// the evidence that decides the value
    pub origin: FieldOrigin,
    /// the nearest contact is on an edge that the ball rolled over
    pub is_fan: bool,
    /// the contacts of the decisive piece do not surround the point: it is beyond the last of them
    pub is_border: bool,
    /// two surfaces, each touched away from edges, meet near the point in a convex edge
    pub is_edge: bool,
}

/// Origin of a value of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FieldOrigin {
    /// contacts; the number of the nearest one
    Contacts(u32),
    /// a known surface
    Known {
        /// its standard deviation, m
        sigma: f64,
        /// distance of the nearest contact along the surface, m
        from_contact: f64,
    },
}

impl FieldValue {
    /// Distance from the nearest contact along the surface, m.
    pub(crate) fn off_contact(&self) -> f64 {
        match self.origin {
            FieldOrigin::Contacts(_) => self.lateral(),
            FieldOrigin::Known { from_contact, .. } => from_contact,
        }
    }

    /// Distance from the nearest contact along the surface, of a known surface from its extent, m.
    pub(crate) fn lateral(&self) -> f64 {
        (self.nearest * self.nearest - self.value * self.value)
            .max(0.0)
            .sqrt()
    }
}

/// A contact near the point.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct Member {
    /// m²; weight of the fit once made
    pub(in crate::reconstruct) distance_squared: f64,
    pub(in crate::reconstruct) index: u32,
    /// number of its piece; [`NO_PIECE`] beyond the maximum
    pub(in crate::reconstruct) piece: u32,
}

/// Contacts that lie and face alike.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::reconstruct) struct Piece {
    weight: f64,
    /// weight of the members away from edges
    pub(in crate::reconstruct) flat_weight: f64,
    /// squared distance of the nearest member, m²
    pub(in crate::reconstruct) nearest_squared: f64,
    /// Σ W c and Σ W n while grouping, then Σ w c / Σ w and Σ w n of the fit
    pub(in crate::reconstruct) point: Vector3<f64>,
    normal: Vector3<f64>,
    /// unit
    pub(in crate::reconstruct) facing: Vector3<f64>,
    /// Σ w
    pub(in crate::reconstruct) fit_weight: f64,
    /// Σ w ½(n + g)·(x − c)
    fit_value: f64,
}

impl Piece {
    pub(in crate::reconstruct) fn value(&self) -> f64 {
        self.fit_value / self.fit_weight
    }
}

/// Share of one pass over one place in the fit.
#[derive(Clone, Copy, Debug)]
pub(in crate::reconstruct) struct PassShare {
    pub(in crate::reconstruct) began_ns: i64,
    pub(in crate::reconstruct) noise: f64,
    pub(in crate::reconstruct) tilt: f64,
}

/// Buffers of an evaluation, reused by the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct FieldScratch {
    /// the point, m
    pub(in crate::reconstruct) at: Point3<f64>,
    pub(in crate::reconstruct) near: Vec<Member>,
    pub(in crate::reconstruct) pieces: Vec<Piece>,
    angles: Vec<(f64, f64, f64)>,
    /// number of the decisive piece
    pub(in crate::reconstruct) decides: u32,
    pub(in crate::reconstruct) shares: Vec<PassShare>,
}

impl FieldScratch {
    /// Difference between the value of the decisive piece and the nearest value of another piece,
    /// m.
    pub(in crate::reconstruct) fn nearest_other(&self, value: f64) -> f64 {
        let others = (0..)
            .zip(&self.pieces)
            .filter(|(at, _)| *at != self.decides);
        others
            .map(|(_, piece)| (piece.value() - value).abs())
            .fold(f64::INFINITY, f64::min)
    }
}

/// Maximum number of pieces: three faces of a corner, and fans between them.
const MOST_PIECES: usize = 8;
/// No piece.
const NO_PIECE: u32 = u32::MAX;
/// Cosine, 60°, of the angle from which two pieces make an edge, or the two sides of a thin wall.
const EDGE_COSINE: f64 = 0.5;
/// Share of the reach within which the tilted planes of an edge count as much as others.
const TILTED_REACH: f64 = 0.5;
/// Maximum distance of a near edge, in σ.
const EDGE_NEAR: f64 = 1.5;
/// Maximum apparent overlap of two pieces at a convex edge, in σ.
const OVERLAP: f64 = 0.1;
/// Maximum depth, in σ, at which noise lets a piece cut off the nearest contact.
const CUT: f64 = 0.3;
/// Cosine, 150°, of the minimum gap between contacts in the tangent plane, seen from a point at a
/// border.
const BORDER_COSINE: f64 = -0.866_025_403_784_438_6;
/// Distance in the tangent plane, in σ, within which a contact is under the point.
const UNDER: f64 = 0.13;

impl FieldParams {
    /// The field at `x` (m, in O); `None` without a contact in reach.
    pub(crate) fn at(
        &self,
        store: &ContactMap,
        x: &Point3<f64>,
        scratch: &mut FieldScratch,
    ) -> Option<FieldValue> {
        scratch.at = *x;
        let FieldScratch {
            near,
            pieces,
            angles,
            decides,
            ..
        } = scratch;
        near.clear();
        store.near(x, self.reach, |distance_squared, index| {
            near.push(Member {
                distance_squared,
                index,
                piece: NO_PIECE,
            });
        });
        near.sort_unstable_by(|a, b| {
            a.distance_squared
                .total_cmp(&b.distance_squared)
                .then(a.index.cmp(&b.index))
        });
        let nearest = *near.first()?;
        let means = store.means();
        self.group(means, near, pieces);
        self.fit(means, x, near, pieces);
        let arm = means[nearest.index as usize].point - x;
        let (value, decisive, is_edge) = self.combine(pieces, &arm)?;
        *decides = decisive as u32;
        let gradient = pieces[decisive].facing;
        let members = near.iter().filter(|member| member.piece == *decides);
        let arms = members.map(|member| means[member.index as usize].point - x);
        Some(FieldValue {
            value,
            gradient,
            nearest: nearest.distance_squared.sqrt(),
            origin: FieldOrigin::Contacts(nearest.index),
            is_fan: means[nearest.index as usize].is_fan,
            is_border: is_border(arms, &gradient, UNDER * self.sigma, angles),
            is_edge,
        })
    }

    /// Adds each contact, nearest first, to the piece it fits best, or starts a new one with it.
    fn group(&self, means: &[MeanContact], near: &mut [Member], pieces: &mut Vec<Piece>) {
        pieces.clear();
        for member in near {
            let mean = &means[member.index as usize];
            let at = match self.piece_of(mean, pieces) {
                Some(at) => at,
                None if pieces.len() < MOST_PIECES => {
                    pieces.push(Piece {
                        nearest_squared: member.distance_squared,
                        ..Piece::default()
                    });
                    pieces.len() - 1
                }
                None => continue,
            };
            let piece = &mut pieces[at];
            piece.weight += mean.weight;
            piece.flat_weight += if mean.is_fan { 0.0 } else { mean.weight };
            piece.point += mean.point.coords * mean.weight;
            piece.normal += mean.normal * mean.weight;
            piece.facing = direction(&piece.normal).unwrap_or(mean.normal);
            member.piece = at as u32;
        }
    }

    /// The piece that faces most like a contact, among pieces with the contact on their chord.
    fn piece_of(&self, mean: &MeanContact, pieces: &[Piece]) -> Option<usize> {
        let mut best = None;
        let mut closest = self.piece_cosine;
        for (at, piece) in pieces.iter().enumerate() {
            let cosine = piece.facing.dot(&mean.normal);
            let arm = mean.point.coords - piece.point / piece.weight;
            if cosine > closest && (0.5 * (mean.normal + piece.facing).dot(&arm)).abs() < self.chord
            {
                (best, closest) = (Some(at), cosine);
            }
        }
        best
    }

    fn fit(
        &self,
        means: &[MeanContact],
        x: &Point3<f64>,
        near: &mut [Member],
        pieces: &mut [Piece],
    ) {
        for piece in pieces.iter_mut() {
            (piece.point, piece.normal) = (Vector3::zeros(), Vector3::zeros());
        }
        for member in near.iter_mut().filter(|member| member.piece != NO_PIECE) {
            let (mean, piece) = (
                &means[member.index as usize],
                &mut pieces[member.piece as usize],
            );
            let width = (self.sigma * self.sigma).max(piece.nearest_squared / 2.0);
            let weight =
                mean.weight * (-(member.distance_squared - piece.nearest_squared) / width).exp();
            piece.fit_weight += weight;
            piece.normal += mean.normal * weight;
            piece.point += mean.point.coords * weight;
            // from here on only the weight matters
            member.distance_squared = weight;
        }
        for piece in pieces.iter_mut() {
            piece.facing = direction(&piece.normal).unwrap_or(piece.facing);
            piece.point /= piece.fit_weight;
        }
        for member in near.iter().filter(|member| member.piece != NO_PIECE) {
            let (mean, piece) = (
                &means[member.index as usize],
                &mut pieces[member.piece as usize],
            );
            piece.fit_value +=
                member.distance_squared * 0.5 * (mean.normal + piece.facing).dot(&(x - mean.point));
        }
    }

    /// Combines the pieces around the nearest one with enough weight. Tilted planes of edges that
    /// the ball rolled over mean little from afar: they can only cut off. A piece that would cut
    /// off the nearest contact itself is refuted. Returns the value, the number of the decisive
    /// piece, and whether there is an edge.
    ///
    /// - `arm`: from the point to the nearest contact, m.
    fn combine(&self, pieces: &[Piece], arm: &Vector3<f64>) -> Option<(f64, usize, bool)> {
        let is_flat = |at: usize| pieces[at].flat_weight >= self.least_weight;
        let is_tilted_afar = |at: usize| {
            !is_flat(at) && pieces[at].nearest_squared > (TILTED_REACH * self.reach).powi(2)
        };
        let supported = || (0..pieces.len()).filter(|&at| pieces[at].weight >= self.least_weight);
        let near = supported().filter(|&at| !is_tilted_afar(at));
        let mut in_order = near.chain(supported().filter(|&at| is_tilted_afar(at)));
        let first_at = in_order.next().unwrap_or(0);
        let first = pieces.get(first_at)?;
        let mut solid = Solid {
            values: [0.0; MOST_PIECES],
            is_convex: [0; MOST_PIECES],
        };
        solid.values[first_at] = first.value();
        let (mut taken, mut is_edge) = (1u8 << first_at, false);
        for at in in_order {
            let piece = &pieces[at];
            let Some(convex) = self.convex_among(pieces, taken, piece) else {
                continue;
            };
            if is_tilted_afar(at) && convex != taken {
                continue;
            }
            let cuts_by = piece.value() + piece.facing.dot(arm);
            if convex >> first_at & 1 == 1 && cuts_by > CUT * self.sigma && arm.norm() < self.sigma
            {
                continue;
            }
            solid.values[at] = piece.value();
            solid.take(at, convex);
            taken |= 1 << at;
            let is_near = piece.value().max(first.value()) < EDGE_NEAR * self.sigma;
            let meets =
                first.facing.dot(&piece.facing) < EDGE_COSINE && convex >> first_at & 1 == 1;
            is_edge |= is_near && meets && is_flat(first_at) && is_flat(at);
        }
        let (value, at) = solid.evaluate(taken, first_at);
        Some((value, at, is_edge))
    }

    /// The pieces in the set `taken` with which another one makes a convex edge; with the others it
    /// makes a concave one. `None` if it makes neither with some.
    fn convex_among(&self, pieces: &[Piece], taken: u8, piece: &Piece) -> Option<u8> {
        let mut convex = 0;
        for at in members(taken) {
            let other = &pieces[at];
            if other.facing.dot(&piece.facing) > self.piece_cosine {
                return None;
            }
            let arm = piece.point - other.point;
            let (from_other, from_piece) = (other.facing.dot(&arm), piece.facing.dot(&arm));
            let slack = OVERLAP * self.sigma;
            if from_other <= slack && from_piece >= -slack {
                convex |= 1 << at;
            } else if from_other <= 0.0 || from_piece >= 0.0 {
                return None;
            }
        }
        Some(convex)
    }
}

/// The half-spaces behind the pieces, combined to the solid with the same edges: intersections at
/// convex edges, unions at concave ones. Their order follows from all pairs: a union of parts
/// without a convex edge between them, an intersection of parts without a concave edge between them
/// (the cotree of the graph of convex edges).
struct Solid {
    values: [f64; MOST_PIECES],
    /// bit k of entry i: pieces i and k meet in a convex edge
    is_convex: [u8; MOST_PIECES],
}

/// Members of a set.
fn members(set: u8) -> impl Iterator<Item = usize> {
    (0..MOST_PIECES).filter(move |&at| set >> at & 1 == 1)
}

impl Solid {
    /// Adds a piece with convex edges to the pieces in the set `convex`.
    fn take(&mut self, at: usize, convex: u8) {
        self.is_convex[at] |= convex;
        members(convex).for_each(|other| self.is_convex[other] |= 1 << at);
    }

    /// Value of the solid of the pieces in `set`, and the decisive piece; of the part with `first`
    /// if the edges contradict each other.
    fn evaluate(&self, set: u8, first: usize) -> (f64, usize) {
        if set.is_power_of_two() {
            let at = set.trailing_zeros() as usize;
            return (self.values[at], at);
        }
        let of_parts = |are_convex: bool| {
            let mut rest = set;
            std::iter::from_fn(move || {
                let part = self.connected(rest, are_convex);
                rest &= !part;
                (part != 0).then_some(part)
            })
        };
        if self.connected(set, true) != set {
            let parts = of_parts(true).map(|part| self.evaluate(part, first));
            return parts
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((self.values[first], first));
        }
        if self.connected(set, false) != set {
            let parts = of_parts(false).map(|part| self.evaluate(part, first));
            return parts
                .max_by(|a, b| a.0.total_cmp(&b.0))
                .unwrap_or((self.values[first], first));
        }
        // the farthest contradicts
        let last = members(set)
            .filter(|&at| at != first)
            .last()
            .unwrap_or(first);
        self.evaluate(set & !(1 << last), first)
    }

    /// The part of `set` connected with its lowest member by convex edges, or by concave ones.
    fn connected(&self, set: u8, by_convex: bool) -> u8 {
        let mut part = set & set.wrapping_neg();
        loop {
            let joined = |at: usize| {
                if by_convex {
                    self.is_convex[at]
                } else {
                    !self.is_convex[at]
                }
            };
            let next = members(part).fold(part, |next, at| next | joined(at) & set);
            if next == part {
                return part;
            }
            part = next;
        }
    }
}

/// Whether contacts at `arms` from a point leave a wide gap in the plane across `normal`.
fn is_border(
    arms: impl Iterator<Item = Vector3<f64>>,
    normal: &Vector3<f64>,
    under: f64,
    angles: &mut Vec<(f64, f64, f64)>,
) -> bool {
    let [u, v] = tangent_basis(normal);
    angles.clear();
    let flat = arms
        .map(|arm| (arm.dot(&u), arm.dot(&v)))
        .filter(|(a, b)| a * a + b * b > under * under);
    angles.extend(flat.map(|(a, b)| (turn(a, b), a, b)));
    angles.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else {
        return true;
    };
    let next = angles.iter().cycle().skip(1);
    first.0 == last.0
        || angles
            .iter()
            .zip(next)
            .any(|(&(_, a, b), &(_, c, d))| is_gap(a, b, c, d))
}

/// Grows with the angle of (a, b), from −2 at −180° to 2 at 180°.
fn turn(a: f64, b: f64) -> f64 {
    let side = b / (a.abs() + b.abs());
    if a >= 0.0 {
        side
    } else {
        (2.0 - side.abs()).copysign(b)
    }
}

/// Whether the turn to the left from (a, b) to (c, d) is a gap at a border.
fn is_gap(a: f64, b: f64, c: f64, d: f64) -> bool {
    let (cross, dot) = (a * d - b * c, a * c + b * d);
    // the same direction twice is no gap
    cross < 0.0
        || dot < 0.0
            && dot * dot >= BORDER_COSINE * BORDER_COSINE * ((a * a + b * b) * (c * c + d * d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::{ContactSigma, SurfaceContact};

    const RADIUS: f64 = 1.5e-3;

    /// A point of a surface and its normal, if the surface has these parameters.
    type ParametricSurface<'a> = &'a dyn Fn(f64, f64) -> Option<(Point3<f64>, Vector3<f64>)>;

    /// Contacts of a surface at the points of a grid of 0.5 mm, each weighing 5.
    fn store_of(surfaces: &[ParametricSurface<'_>]) -> ContactMap {
        let mut store = ContactMap::new(RADIUS / 3.0, 2.0 * RADIUS, None);
        for surface in surfaces {
            for (i, j) in (-16..=16).flat_map(|i| (-16..=16).map(move |j| (i, j))) {
                if let Some((point, normal)) = surface(f64::from(i) * 0.5e-3, f64::from(j) * 0.5e-3)
                {
                    let sigma = ContactSigma::default();
                    store.add(&SurfaceContact {
                        point,
                        normal,
                        weight: 5.0,
                        stamp_ns: 0,
                        sigma,
                    });
                }
            }
        }
        store
    }

    fn value(store: &ContactMap, x: f64, y: f64, z: f64) -> f64 {
        let x = Point3::new(x, y, z) * 1e-3;
        FieldParams::for_ball(RADIUS)
            .at(store, &x, &mut FieldScratch::default())
            .unwrap()
            .value
            * 1e3
    }

    /// A cylinder around z of radius `radius` (m), seen from outside (1) or inside (−1), below z =
    /// 0; `a` runs around it.
    fn cylinder(
        radius: f64,
        side: f64,
    ) -> impl Fn(f64, f64) -> Option<(Point3<f64>, Vector3<f64>)> {
        move |a, z| {
            let normal = Vector3::new((a / radius).cos(), (a / radius).sin(), 0.0);
            (z < -0.4e-3).then(|| {
                (
                    Point3::from(normal * radius + Vector3::z() * z),
                    normal * side,
                )
            })
        }
    }

    #[test]
    fn a_gap_of_more_than_150_degrees_makes_a_border() {
        let is_border_of = |degrees: &[f64]| {
            let arms = degrees
                .iter()
                .map(|a| Vector3::new(a.to_radians().cos(), a.to_radians().sin(), 0.3) * 1e-3);
            is_border(arms, &Vector3::z(), 0.1e-3, &mut Vec::new())
        };
        for start in [-170.0, -80.0, 0.0, 33.0, 95.0] {
            let at = |gap: f64| [0.0, 100.0, 360.0 - gap].map(|a| a + start);
            assert!(
                is_border_of(&at(151.0)) && !is_border_of(&at(149.0)) && is_border_of(&at(200.0)),
                "{start}"
            );
            assert!(
                is_border_of(&[start])
                    && is_border_of(&[start; 3])
                    && is_border_of(&[start, start + 120.0])
            );
        }
        assert!(is_border_of(&[]));
    }

    #[test]
    fn a_plane_and_a_cylinder_are_exact() {
        let plane = store_of(&[&|x, y| Some((Point3::new(x, y, 0.0), Vector3::z()))]);
        assert!((value(&plane, 0.3, 0.2, 0.7) - 0.7).abs() < 1e-9);
        let tube = store_of(&[&cylinder(4e-3, 1.0)]);
        for radius in [3.6, 4.0, 4.5] {
            assert!(
                (value(&tube, radius, 0.1, -3.0) - (radius.hypot(0.1) - 4.0)).abs() < 0.02,
                "{radius}"
            );
        }
    }

    #[test]
    fn the_far_side_of_a_hole_does_not_cut_the_face_around_it() {
        let radius = 2.5e-3;
        let around =
            |x: f64, y: f64| (x.hypot(y) > radius).then(|| (Point3::new(x, y, 0.0), Vector3::z()));
        let hole = store_of(&[&around, &cylinder(radius, -1.0)]);
        for turn in 0..24 {
            let angle = f64::from(turn) * std::f64::consts::TAU / 24.0;
            for (from_axis, z) in [
                (2.9, -0.4),
                (3.3, -0.8),
                (3.3, -0.2),
                (2.8, 0.3),
                (2.1, -0.5),
                (2.2, 0.2),
            ] {
                let (x, y) = (from_axis * angle.cos(), from_axis * angle.sin());
                // the solid: below the face and outside the hole
                let is_material = z < 0.0 && from_axis > 2.5;
                assert_eq!(
                    value(&hole, x, y, z) < 0.0,
                    is_material,
                    "{from_axis} {z} at {angle}"
                );
            }
        }
    }

    #[test]
    fn a_tilted_wall_does_not_cut_off_what_was_touched() {
        // a step along y = 0; the wall was touched 2 mm aside alone, and drag has tilted its
        // normals
        let top = |x: f64, y: f64| (y <= 0.0).then(|| (Point3::new(x, y, 0.0), Vector3::z()));
        let tilted = Vector3::new(0.15, 0.99, 0.0).normalize();
        let wall = |x: f64, z: f64| {
            ((-4.1e-3..-1.9e-3).contains(&x) && z < -0.4e-3)
                .then(|| (Point3::new(x, 0.0, z), tilted))
        };
        let step = store_of(&[&top, &wall]);
        for y in [-0.2, -0.1] {
            assert!(
                (value(&step, 0.0, y, -0.2) + 0.2).abs() < 1e-9,
                "{y}: {}",
                value(&step, 0.0, y, -0.2)
            );
        }
        // at its contacts the wall ends the face
        assert!(value(&step, -3.0, 0.4, -0.4) > 0.2);
    }

    #[test]
    fn convex_pieces_on_a_floor_stay_a_boss() {
        // two walls of a boss (0, 1) on a floor (2), as seen from the foot of its corner
        let solid = |values: [f64; 3]| {
            let mut solid = Solid {
                values: [0.0; MOST_PIECES],
                is_convex: [0; MOST_PIECES],
            };
            solid.values[..3].copy_from_slice(&values);
            solid.take(1, 0b001);
            solid.take(2, 0);
            solid.evaluate(0b111, 0)
        };
        assert_eq!(
            solid([-1.0, 0.5, 2.0]),
            (0.5, 1),
            "beside the boss, above the floor"
        );
        assert_eq!(solid([-1.0, -0.5, 2.0]), (-0.5, 1), "in the boss");
        assert_eq!(solid([1.0, 0.5, -0.2]), (-0.2, 2), "in the floor");
    }

    #[test]
    fn edges_that_contradict_each_other_leave_out_the_farthest() {
        // a path 0–1–2–3 of convex edges has no solid
        let mut solid = Solid {
            values: [1.0, 2.0, 3.0, -9.0, 0.0, 0.0, 0.0, 0.0],
            is_convex: [0; MOST_PIECES],
        };
        solid.take(1, 0b001);
        solid.take(2, 0b010);
        solid.take(3, 0b100);
        assert_eq!(solid.evaluate(0b1111, 0), (2.0, 1), "max(1, min(0, 2))");
    }
}
