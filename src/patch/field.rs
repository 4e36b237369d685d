//! The surface that the touches show, as the zero set of a field: piecewise smooth, evaluated from stored contacts.
//!
//! Contacts near the point are grouped into smooth pieces; each piece is fitted alone, so that nothing is averaged over
//! an edge, and the pieces are put together by the larger value at a convex edge, by the smaller one at a concave. Within
//! a piece a chord is at right angles to the mean of its end normals, which is exact on circles and cylinders:
//!
//! f(x) = Σ wⱼ ½(nⱼ + g)·(x − cⱼ) / Σ wⱼ,   g = Σ wⱼ nⱼ / |Σ wⱼ nⱼ|
//!
//! wⱼ = Wⱼ exp(−(|x − cⱼ|² − d²) / max(σ², d²/2)), where d is the distance to the nearest contact of the piece: far from
//! the surface all of its contacts count, near it only the nearest.

use nalgebra::{Point3, Vector3};

use super::contact_store::{ContactStore, MeanContact};

/// How contacts are grouped and weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldParams {
    /// contacts within this distance count, m
    pub reach: f64,
    /// σ: width of the weight around the nearest contact, m
    pub sigma: f64,
    /// cosine of the widest angle between a contact and its piece
    pub piece_cosine: f64,
    /// farthest that a contact may be off the chord to the middle of its piece, m
    pub chord: f64,
    /// a piece with less weight than this is not believed; a sliding contact weighs 1
    pub least_weight: f64,
}

impl FieldParams {
    /// Settings that hold for a ball of `radius` (m): two radii are what passes of a hand leave between them.
    pub fn for_ball(radius: f64) -> Self {
        Self { reach: 2.0 * radius, sigma: radius / 2.0, piece_cosine: 0.819, chord: radius / 5.0, least_weight: 2.0 }
    }
}

/// What the touches say at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldValue {
    /// signed distance from the surface, m; positive outside the part
    pub value: f64,
    /// direction in which it rises, unit
    pub gradient: Vector3<f64>,
    /// distance to the nearest contact, m
    pub nearest: f64,
    /// the nearest contact is one of an edge that the ball rolled over
    pub is_fan: bool,
    /// the contacts of the piece that decides do not surround the point: it is beyond the last of them
    pub is_border: bool,
    /// two surfaces, each felt away from edges, meet near the point in a convex edge
    pub is_edge: bool,
}

/// A contact near the point.
#[derive(Clone, Copy, Debug)]
struct Member {
    distance_squared: f64,
    index: u32,
    /// number of its piece; [`NO_PIECE`] for one too many
    piece: u32,
}

/// Contacts that lie and face alike.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    weight: f64,
    /// weight of the members that are not on an edge
    flat_weight: f64,
    /// squared distance of the nearest member, m²
    nearest_squared: f64,
    /// Σ W c and Σ W n of the members so far, then Σ w c / Σ w and Σ w n of the fit
    point: Vector3<f64>,
    normal: Vector3<f64>,
    /// unit
    facing: Vector3<f64>,
    /// Σ w
    fit_weight: f64,
    /// Σ w ½(n + g)·(x − c)
    fit_value: f64,
}

impl Piece {
    fn value(&self) -> f64 {
        self.fit_value / self.fit_weight
    }
}

/// Room for one evaluation, used again by the next.
#[derive(Clone, Debug, Default)]
pub struct FieldScratch {
    near: Vec<Member>,
    pieces: Vec<Piece>,
    angles: Vec<f64>,
}

/// Pieces looked at, at most: three faces of a corner, and fans between them.
const MOST_PIECES: usize = 8;
/// No piece.
const NO_PIECE: u32 = u32::MAX;
/// Pieces that stand at more than this to each other (cos 60°) make an edge.
const EDGE_COSINE: f64 = 0.5;
/// An edge is near within this many σ.
const EDGE_NEAR: f64 = 1.5;
/// Share of σ by which two pieces may seem to overlap at a convex edge.
const OVERLAP: f64 = 0.1;
/// Seen from a point at a border, contacts in the tangent plane leave a gap of this angle, rad.
const BORDER_GAP: f64 = 150.0 * std::f64::consts::PI / 180.0;
/// A contact nearer in the tangent plane than this share of σ is under the point.
const UNDER: f64 = 0.13;

impl FieldParams {
    /// The field at `x` (m, in O); `None` where no contact is within reach.
    pub fn at(&self, store: &ContactStore, x: &Point3<f64>, scratch: &mut FieldScratch) -> Option<FieldValue> {
        let FieldScratch { near, pieces, angles } = scratch;
        near.clear();
        store.near(x, self.reach, |distance_squared, index| {
            near.push(Member { distance_squared, index, piece: NO_PIECE });
        });
        near.sort_unstable_by(|a, b| a.distance_squared.total_cmp(&b.distance_squared).then(a.index.cmp(&b.index)));
        let nearest = *near.first()?;
        let means = store.means();
        self.group(means, near, pieces);
        self.fit(means, x, near, pieces);
        let combined = self.combine(pieces)?;
        let members = near.iter().filter(|member| member.piece == combined.piece);
        let arms = members.map(|member| means[member.index as usize].point - x);
        Some(FieldValue {
            value: combined.value,
            gradient: combined.gradient,
            nearest: nearest.distance_squared.sqrt(),
            is_fan: means[nearest.index as usize].is_fan,
            is_border: is_border(arms, &combined.gradient, UNDER * self.sigma, angles),
            is_edge: combined.is_edge,
        })
    }

    /// Puts each contact, nearest first, to the piece it fits best, or makes it the first of a new one.
    fn group(&self, means: &[MeanContact], near: &mut [Member], pieces: &mut Vec<Piece>) {
        pieces.clear();
        for member in near {
            let mean = &means[member.index as usize];
            let at = match self.piece_of(mean, pieces) {
                Some(at) => at,
                None if pieces.len() < MOST_PIECES => {
                    pieces.push(Piece { nearest_squared: member.distance_squared, ..Piece::default() });
                    pieces.len() - 1
                }
                None => continue,
            };
            let piece = &mut pieces[at];
            piece.weight += mean.weight;
            piece.flat_weight += if mean.is_fan { 0.0 } else { mean.weight };
            piece.point += mean.point.coords * mean.weight;
            piece.normal += mean.normal * mean.weight;
            piece.facing = piece.normal.try_normalize(0.0).unwrap_or(mean.normal);
            member.piece = at as u32;
        }
    }

    /// The piece that faces most like a contact, among those whose chord it is on.
    fn piece_of(&self, mean: &MeanContact, pieces: &[Piece]) -> Option<usize> {
        let mut best = None;
        let mut closest = self.piece_cosine;
        for (at, piece) in pieces.iter().enumerate() {
            let cosine = piece.facing.dot(&mean.normal);
            let arm = mean.point.coords - piece.point / piece.weight;
            if cosine > closest && (0.5 * (mean.normal + piece.facing).dot(&arm)).abs() < self.chord {
                (best, closest) = (Some(at), cosine);
            }
        }
        best
    }

    fn fit(&self, means: &[MeanContact], x: &Point3<f64>, near: &mut [Member], pieces: &mut [Piece]) {
        for piece in pieces.iter_mut() {
            (piece.point, piece.normal) = (Vector3::zeros(), Vector3::zeros());
        }
        for member in near.iter_mut().filter(|member| member.piece != NO_PIECE) {
            let (mean, piece) = (&means[member.index as usize], &mut pieces[member.piece as usize]);
            let width = (self.sigma * self.sigma).max(piece.nearest_squared / 2.0);
            let weight = mean.weight * (-(member.distance_squared - piece.nearest_squared) / width).exp();
            piece.fit_weight += weight;
            piece.normal += mean.normal * weight;
            piece.point += mean.point.coords * weight;
            // from here on the weight is asked for alone
            member.distance_squared = weight;
        }
        for piece in pieces.iter_mut() {
            piece.facing = piece.normal.try_normalize(0.0).unwrap_or(piece.facing);
            piece.point /= piece.fit_weight;
        }
        for member in near.iter().filter(|member| member.piece != NO_PIECE) {
            let (mean, piece) = (&means[member.index as usize], &mut pieces[member.piece as usize]);
            piece.fit_value += member.distance_squared * 0.5 * (mean.normal + piece.facing).dot(&(x - mean.point));
        }
    }

    /// Puts the pieces together around the nearest one that is believed.
    fn combine(&self, pieces: &[Piece]) -> Option<Combined> {
        let is_believed = |piece: &Piece| piece.weight >= self.least_weight;
        let first_at = pieces.iter().position(is_believed).unwrap_or(0);
        let first = pieces.get(first_at)?;
        let mut combined =
            Combined { value: first.value(), gradient: first.facing, is_edge: false, piece: first_at as u32 };
        let slack = OVERLAP * self.sigma;
        for (at, piece) in pieces.iter().enumerate().filter(|(at, piece)| *at != first_at && is_believed(piece)) {
            let cosine = first.facing.dot(&piece.facing);
            if cosine > self.piece_cosine {
                continue;
            }
            let arm = piece.point - first.point;
            let (from_first, from_piece) = (first.facing.dot(&arm), piece.facing.dot(&arm));
            let is_convex = from_first <= slack && from_piece >= -slack;
            let is_concave = from_first > 0.0 && from_piece < 0.0;
            let (value, is_flat) = (piece.value(), first.flat_weight.min(piece.flat_weight) >= self.least_weight);
            let is_near = value.max(first.value()) < EDGE_NEAR * self.sigma;
            combined.is_edge |= is_convex && is_flat && is_near && cosine < EDGE_COSINE;
            if (is_convex && value > combined.value) || (is_concave && value < combined.value) {
                combined = Combined { value, gradient: piece.facing, piece: at as u32, ..combined };
            }
        }
        Some(combined)
    }
}

/// The pieces put together.
struct Combined {
    value: f64,
    gradient: Vector3<f64>,
    is_edge: bool,
    /// the one that decides
    piece: u32,
}

/// Whether contacts at `arms` from a point leave a wide gap in the plane across `normal`.
fn is_border(
    arms: impl Iterator<Item = Vector3<f64>>,
    normal: &Vector3<f64>,
    under: f64,
    angles: &mut Vec<f64>,
) -> bool {
    let side = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let u = normal.cross(&side).normalize();
    let v = normal.cross(&u);
    angles.clear();
    angles.extend(
        arms.map(|arm| (arm.dot(&u), arm.dot(&v))).filter(|(a, b)| a.hypot(*b) > under).map(|(a, b)| b.atan2(a)),
    );
    angles.sort_unstable_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else { return true };
    let around = first + std::f64::consts::TAU - last;
    angles.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max) >= BORDER_GAP
}
