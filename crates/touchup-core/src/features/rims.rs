//! Round openings of an open mesh: where a sheet ends in a circle there is a hole, though it has no
//! wall.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use super::facets::Facets;
use super::fit::{Cylinder, Fit, FitParams, Observation, Surface, fit};
use super::grow::ROUNDING;
use super::scene::Parted;
use crate::mesh::VertexId;
use crate::numeric::{mean, tangent_basis};

/// A round opening.
#[derive(Clone, Debug)]
pub(super) struct RoundOpening {
    pub fit: Fit<Cylinder>,
    /// in the middle of it, m, in O
    pub centre: Point3<f64>,
    /// unit vector out of the part
    pub out: Vector3<f64>,
    /// its corners, m
    pub corners: Vec<Point3<f64>>,
}

/// A loop of border edges, in the order of their faces: the part is on its left.
struct Loop {
    corners: Vec<Point3<f64>>,
    /// face of the edge that begins at each corner
    faces: Vec<u32>,
}

/// A round opening has at least so many corners: a missing face or the faces around a missing
/// vertex have fewer.
const LEAST_CORNERS: usize = 12;
/// Its corners are off the circle by at most this share of the radius, and by this in root mean
/// square.
const OFF: f64 = 0.05;
const OFF_ROOT_MEAN_SQUARE: f64 = 0.025;
/// Seen from the middle no edge spans more than this, rad: 45°.
const WIDEST: f64 = PI / 4.0;
/// The edges go around once, without going back by more than this share of it.
const BACK: f64 = 0.05;
/// The part around an opening faces out of it: cosine of 66°. That of a wall which ends there does
/// not.
const FACING: f64 = 0.4;
/// So much of the edges has to.
const FACING_SHARE: f64 = 0.9;
/// An opening is flat when it is within this many radii of a plane: then that has its axis …
const FLAT: f64 = 0.03;
/// … to this, rad; otherwise its shape decides.
const AXIS: f64 = 0.0087;

/// All round openings, in order of their first faces. The longest border of each piece is where the
/// piece ends.
pub(super) fn rims(parted: &Parted) -> Vec<RoundOpening> {
    let loops = loops(&parted.facets);
    let mut longest: BTreeMap<u32, (f64, usize)> = BTreeMap::new();
    for (at, border) in loops.iter().enumerate() {
        let of_piece = longest
            .entry(parted.bodies.piece_of(border.faces[0]))
            .or_insert((0.0, at));
        if border.length() > of_piece.0 {
            *of_piece = (border.length(), at);
        }
    }
    let is_inner = |at: usize| longest.values().all(|&(_, outer)| outer != at);
    (0..loops.len())
        .filter(|&at| is_inner(at))
        .filter_map(|at| loops[at].rim(parted))
        .collect()
}

/// Closed chains of edges of one face, those through a vertex where several meet left out.
fn loops(facets: &Facets) -> Vec<Loop> {
    let mut next: BTreeMap<VertexId, (VertexId, u32)> = BTreeMap::new();
    let mut forked: Vec<VertexId> = Vec::new();
    for (face, corners) in facets.mesh.faces() {
        for edge in facets.open_edges(face.0) {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            if next.insert(from, (to, face.0)).is_some() {
                forked.push(from);
            }
        }
    }
    let mut starts: Vec<(u32, VertexId)> = next
        .iter()
        .map(|(&from, &(_, face))| (face, from))
        .collect();
    starts.sort_unstable();
    let mut loops = Vec::new();
    for (_, start) in starts {
        let (mut at, mut border, mut is_simple) = (
            start,
            Loop {
                corners: Vec::new(),
                faces: Vec::new(),
            },
            true,
        );
        while let Some((to, face)) = next.remove(&at) {
            is_simple &= forked.binary_search(&at).is_err();
            border.corners.push(facets.mesh.position(at));
            border.faces.push(face);
            at = to;
        }
        if at == start && is_simple && !border.faces.is_empty() {
            loops.push(border);
        }
    }
    loops
}

impl Loop {
    fn edges(&self) -> impl Iterator<Item = (Point3<f64>, Point3<f64>)> + '_ {
        (0..self.corners.len())
            .map(|i| (self.corners[i], self.corners[(i + 1) % self.corners.len()]))
    }

    fn length(&self) -> f64 {
        self.edges().map(|(a, b)| (b - a).norm()).sum()
    }

    fn rim(&self, parted: &Parted) -> Option<RoundOpening> {
        if self.corners.len() < LEAST_CORNERS {
            return None;
        }
        let middle = Point3::from(mean(self.corners.iter().map(|p| p.coords)));
        // the part is on the left: around an opening it is gone around clockwise
        let area = self
            .edges()
            .map(|(a, b)| (a - middle).cross(&(b - middle)))
            .sum::<Vector3<f64>>();
        let out = -area.try_normalize(0.0)?;
        if !self.faces_out(parted, &out) {
            return None;
        }
        let fit = self.circle(parted, &middle, &out)?;
        let cylinder = &fit.surface;
        let out = cylinder.axis_towards(&out);
        let centre = cylinder.nearest_on_axis(&middle);
        let is_round = self.is_round(&centre, &out, cylinder.radius);
        is_round.then(|| RoundOpening {
            fit,
            centre,
            out,
            corners: self.corners.clone(),
        })
    }

    fn faces_out(&self, parted: &Parted, out: &Vector3<f64>) -> bool {
        let facing = self.edges().zip(&self.faces).map(|((a, b), &face)| {
            let is_facing = parted.facets.normal(face).dot(out) > FACING;
            if is_facing { (b - a).norm() } else { 0.0 }
        });
        facing.sum::<f64>() > FACING_SHARE * self.length()
    }

    fn circle(
        &self,
        parted: &Parted,
        middle: &Point3<f64>,
        out: &Vector3<f64>,
    ) -> Option<Fit<Cylinder>> {
        let away = |p: &Point3<f64>| (p - middle) - out * (p - middle).dot(out);
        let radius =
            self.corners.iter().map(|p| away(p).norm()).sum::<f64>() / self.corners.len() as f64;
        let height = self
            .corners
            .iter()
            .map(|p| (p - middle).dot(out).abs())
            .fold(0.0, f64::max);
        let sigma = parted.rounding.unwrap_or(ROUNDING * parted.diagonal);
        // triangles of a scan end before its rim does: all by as much as they please, up to an edge
        let common_sigma = if parted.rounding.is_some() {
            0.0
        } else {
            parted.edge / 12f64.sqrt()
        };
        let axis_sigma = (height < FLAT * radius).then_some(AXIS);
        let params = FitParams {
            axis_sigma,
            common_sigma,
            ..FitParams::default()
        };
        let observation = |(group, &point): (usize, &Point3<f64>)| Observation {
            point,
            offset: 0.0,
            sigma,
            group: group as u32,
        };
        let observations: Vec<_> = self.corners.iter().enumerate().map(observation).collect();
        fit(
            &Cylinder::new(*middle, out, radius, true),
            &observations,
            &params,
        )
        .ok()
    }

    fn is_round(&self, centre: &Point3<f64>, out: &Vector3<f64>, radius: f64) -> bool {
        let [e, g] = tangent_basis(out);
        let place = |p: &Point3<f64>| [(p - centre).dot(&e), (p - centre).dot(&g)];
        let off: Vec<f64> = self
            .corners
            .iter()
            .map(place)
            .map(|[x, y]| (x.hypot(y) / radius - 1.0).abs())
            .collect();
        let mean_square = off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64;
        let turns = self.edges().map(|(a, b)| {
            let ([x, y], [u, v]) = (place(&a), place(&b));
            ((v.atan2(u) - y.atan2(x)) + PI).rem_euclid(TAU) - PI
        });
        let turns: Vec<f64> = turns.collect();
        // `out` looks at us: the edges go clockwise
        let back: f64 = turns.iter().map(|turn| turn.max(0.0)).sum();
        let around: f64 = turns.iter().sum();
        off.iter().all(|&off| off < OFF)
            && mean_square.sqrt() < OFF_ROOT_MEAN_SQUARE
            && turns.iter().all(|turn| turn.abs() < WIDEST)
            && back < BACK * TAU
            && (around + TAU).abs() < BACK
    }
}
