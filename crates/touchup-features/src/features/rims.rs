//! Openings by their borders: a circular border of a sheet is a hole without a wall; and a closed
//! outline in a plane of a drawing is a recess or a boss of any shape.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use super::feature::FeatureKind;
use super::fit::{Cylinder, Fit, FitParams, Observation, SurfaceModel, fit_mesh};
use super::segmentation::facets::{Facets, NONE};
use super::segmentation::grow::{ROUNDING, SEEN_FACETS};
use super::segmentation::scene::SegmentedMesh;
use touchup_geometry::form::RoundForm;
use touchup_geometry::mesh::{FaceId, VertexId};
use touchup_geometry::numeric::{mean, tangent_basis};

/// A round opening.
#[derive(Clone, Debug)]
pub(super) struct RoundOpening {
    pub fit: Fit<Cylinder>,
    /// its middle, m, in O
    pub centre: Point3<f64>,
    /// unit vector out of the part
    pub out: Vector3<f64>,
    /// its corners, m
    pub corners: Vec<Point3<f64>>,
}

/// A recess in a plane, or a boss on it, that is neither round nor a slot.
#[derive(Clone, Debug)]
pub(super) struct OpeningOutline {
    /// a hole, or a boss
    pub kind: FeatureKind,
    /// the circle nearest to it
    pub rim: RoundOpening,
    /// distance from the plane to the floor or the top, or through to the other side, m
    pub depth: f64,
    /// whether it goes through; of a boss `None`
    pub through: Option<bool>,
    /// its deviation from the circle
    pub form: RoundForm,
}

/// A loop of border edges, in the order of their faces: the part is on its left.
struct BoundaryLoop {
    corners: Vec<Point3<f64>>,
    /// for the edge from each corner its face, or the one across it
    faces: Vec<u32>,
}

/// Minimum number of corners of a round opening: a missing face or the faces around a missing
/// vertex have fewer.
const LEAST_CORNERS: usize = 12;
/// Maximum deviation of its corners from the circle, and root mean square of it, as shares of the
/// radius.
const OFF: f64 = 0.05;
const OFF_ROOT_MEAN_SQUARE: f64 = 0.025;
/// Maximum angle of an edge, seen from the middle, rad: 45°.
const WIDEST: f64 = PI / 4.0;
/// Maximum length between points on an outline, as a share of it.
const PIECE: f64 = 1.0 / 48.0;
/// Material within this share of the radius belongs to the plane itself.
const AT_ONCE: f64 = 1e-3;
/// Distance of a place with material beside a corner of an outline, as a share of the radius.
const BESIDE: f64 = 0.02;
/// Maximum share of a turn by which the edges go back.
const BACK: f64 = 0.05;
/// Minimum cosine between normals around an opening and the direction out of it: 66°. The end of a
/// wall has less.
const FACING: f64 = 0.4;
/// Minimum share of edges with such normals.
const FACING_SHARE: f64 = 0.9;
/// Maximum distance of a flat opening from a plane, in radii: the plane then gives its axis.
const FLAT: f64 = 0.03;
/// Standard deviation of that axis, rad; without it the shape decides.
const AXIS: f64 = 0.0087;

/// All round openings, in order of their first faces. The longest border of each piece is its outer
/// end.
pub(super) fn rims(parted: &SegmentedMesh) -> Vec<RoundOpening> {
    let loops = loops(parted, open_edges(&parted.facets));
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

/// Outlines of recesses in the planes of a drawing and of bosses on them.
///
/// - `is_known`: by segment, whether it is a wall of a known feature.
pub(super) fn outlines(parted: &SegmentedMesh, is_known: &[bool]) -> Vec<OpeningOutline> {
    let of_plane = |number: usize| {
        let is_of = move |face: u32| parted.segmentation.of_face[face as usize] == number as u32;
        let faces = parted.segment(number).faces.iter();
        let edges = faces.flat_map(move |&face| {
            let corners = parted.facets.mesh.corners(FaceId(face));
            let beside = parted.facets.beside(face);
            let left = beside.filter(move |&(_, other)| !is_of(other));
            left.map(move |(edge, other)| (corners[edge], corners[(edge + 1) % 3], other))
        });
        let loops = loops(parted, edges);
        let outlines = loops
            .into_iter()
            .filter_map(move |border| border.outline(parted, number, is_known));
        outlines.collect::<Vec<_>>()
    };
    let planes = parted.planes().map(|(number, ..)| number);
    planes
        .filter(|&number| parted.is_strong(number))
        .flat_map(of_plane)
        .collect()
}

/// Edges of one face alone, with their start and end vertices.
fn open_edges<'a>(facets: &'a Facets) -> impl Iterator<Item = (VertexId, VertexId, u32)> + use<'a> {
    facets.mesh.faces().flat_map(|(face, corners)| {
        let open = facets.open_edges(face.0);
        open.map(move |edge| (corners[edge], corners[(edge + 1) % 3], face.0))
    })
}

/// Closed chains of edges, without those through a vertex of several.
///
/// - `edges`: start vertex, end vertex and a face of each.
fn loops(
    parted: &SegmentedMesh,
    edges: impl Iterator<Item = (VertexId, VertexId, u32)>,
) -> Vec<BoundaryLoop> {
    let mut next: BTreeMap<VertexId, (VertexId, u32)> = BTreeMap::new();
    let mut forked: Vec<VertexId> = Vec::new();
    for (from, to, face) in edges {
        if next.insert(from, (to, face)).is_some() {
            forked.push(from);
        }
    }
    forked.sort_unstable();
    let mut starts: Vec<(u32, VertexId)> = next
        .iter()
        .map(|(&from, &(_, face))| (face, from))
        .collect();
    starts.sort_unstable();
    let mut loops = Vec::new();
    for (_, start) in starts {
        let (mut at, mut border, mut is_simple) = (
            start,
            BoundaryLoop {
                corners: Vec::new(),
                faces: Vec::new(),
            },
            true,
        );
        while let Some((to, face)) = next.remove(&at) {
            is_simple &= forked.binary_search(&at).is_err();
            border.corners.push(parted.facets.mesh.position(at));
            border.faces.push(face);
            at = to;
        }
        if at == start && is_simple && !border.faces.is_empty() {
            loops.push(border);
        }
    }
    loops
}

impl BoundaryLoop {
    fn edges(&self) -> impl Iterator<Item = (Point3<f64>, Point3<f64>)> + '_ {
        (0..self.corners.len())
            .map(|i| (self.corners[i], self.corners[(i + 1) % self.corners.len()]))
    }

    fn length(&self) -> f64 {
        self.edges().map(|(a, b)| (b - a).norm()).sum()
    }

    /// Its middle, and the unit vector out of an opening inside it.
    fn middle(&self) -> Option<(Point3<f64>, Vector3<f64>)> {
        let middle = Point3::from(mean(self.corners.iter().map(|p| p.coords)));
        // the part is on the left: the loop around an opening is clockwise
        let area = self
            .edges()
            .map(|(a, b)| (a - middle).cross(&(b - middle)))
            .sum::<Vector3<f64>>();
        Some((middle, -area.try_normalize(0.0)?))
    }

    /// The same with points on long edges: the corners of a square alone lie on a circle.
    fn followed(&self) -> Self {
        let longest = PIECE * self.length();
        let along = |(a, b): (Point3<f64>, Point3<f64>)| {
            let count = ((b - a).norm() / longest).ceil().max(1.0);
            (0..count as usize).map(move |i| a + (b - a) * (i as f64 / count))
        };
        let faces = Vec::new();
        let corners = self.edges().flat_map(along).collect();
        Self { corners, faces }
    }

    /// The recess in plane number `plane` or the boss on it, if the loop goes around it.
    fn outline(
        &self,
        parted: &SegmentedMesh,
        plane: usize,
        is_known: &[bool],
    ) -> Option<OpeningOutline> {
        if self.corners.len() < LEAST_CORNERS {
            return None;
        }
        let followed = self.followed();
        let (middle, out) = followed.middle()?;
        let edges = || {
            self.edges()
                .zip(&self.faces)
                .map(|((a, b), &face)| ((b - a).norm(), face))
        };
        let is_of_known = |face: u32| {
            let number = parted.segmentation.of_face[face as usize];
            number != NONE && is_known[number as usize]
        };
        let known = edges().filter(|&(_, face)| is_of_known(face));
        let is_outer = out.dot(&parted.plane(plane)?.normal()) < 0.0;
        if is_outer || 2.0 * known.map(|(length, _)| length).sum::<f64>() > self.length() {
            return None;
        }
        let fit = followed.circle(parted, &middle, &out)?;
        let (centre, radius) = (fit.surface.nearest_on_axis(&middle), fit.surface.radius);
        if !followed.goes_around(&centre, &out) {
            return None;
        }
        let height = |face: u32| (parted.facets.mesh.barycentre(FaceId(face)) - middle).dot(&out);
        let is_raised = edges()
            .map(|(length, face)| length * height(face))
            .sum::<f64>()
            > 0.0;
        let (kind, way) = if is_raised {
            (FeatureKind::Boss, out)
        } else {
            (FeatureKind::Hole, -out)
        };
        let around = parted.around(plane);
        let mut rays = around.rays(radius);
        let mut met = |from: Point3<f64>, before: f64| {
            let met = rays.first(&(from - way * before), &way, parted.diagonal)?;
            Some(met.distance - before)
        };
        let floor = met(centre, AT_ONCE * radius);
        let beside = self.corners[0] + (self.corners[0] - centre).normalize() * (BESIDE * radius);
        let depth = floor.or_else(|| met(beside, -AT_ONCE * radius))?;
        let form = RoundForm::of_section(followed.corners.iter(), &centre, &out)?;
        let corners = self.corners.clone();
        // polygons, ribs and steps are no circles out of round, and a circle has a wall
        let by_corners = RoundForm::of_section(self.corners.iter(), &centre, &out)?;
        let is_circle = by_corners.roundness.minimum_zone.value <= SEEN_FACETS * parted.rounding?;
        let is_round = !is_circle && form.roundness.minimum_zone.value < 2.0 * OFF * radius;
        // a depth in the plane itself is a groove around an island
        (is_round && depth > AT_ONCE * radius).then_some(OpeningOutline {
            kind,
            rim: RoundOpening {
                fit,
                centre,
                out,
                corners,
            },
            depth,
            through: (!is_raised).then_some(floor.is_none()),
            form,
        })
    }

    fn rim(&self, parted: &SegmentedMesh) -> Option<RoundOpening> {
        if self.corners.len() < LEAST_CORNERS {
            return None;
        }
        let (middle, out) = self.middle()?;
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

    fn faces_out(&self, parted: &SegmentedMesh, out: &Vector3<f64>) -> bool {
        let facing = self.edges().zip(&self.faces).map(|((a, b), &face)| {
            let is_facing = parted.facets.normal(face).dot(out) > FACING;
            if is_facing { (b - a).norm() } else { 0.0 }
        });
        facing.sum::<f64>() > FACING_SHARE * self.length()
    }

    fn circle(
        &self,
        parted: &SegmentedMesh,
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
        let rounding = parted.rounding.unwrap_or(ROUNDING * parted.diagonal);
        let off = self.corners.iter().map(|p| away(p).norm() - radius);
        let square = off.map(|off| off * off).sum::<f64>() / self.corners.len() as f64;
        let sigma = square.sqrt().max(rounding);
        // triangles of a scan end before its rim: all by any length, up to an edge
        let common_sigma = if parted.rounding.is_some() {
            0.0
        } else {
            parted.edge / 12f64.sqrt()
        };
        // an oval is a circle of a leaning cylinder, and a drawn plane does not lean
        let known = parted.rounding.map_or(AXIS, |rounding| rounding / radius);
        let axis_sigma = (height < FLAT * radius).then_some(known);
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
        let guess = Cylinder::new(*middle, out, radius, true);
        fit_mesh(&guess, &observations, &params, 0.0, 0.0).ok()
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
        off.iter().all(|&off| off < OFF)
            && mean_square.sqrt() < OFF_ROOT_MEAN_SQUARE
            && self.turns(centre, out).all(|turn| turn.abs() < WIDEST)
            && self.goes_around(centre, out)
    }

    /// The angle of each edge, seen from a place, rad.
    fn turns(&self, centre: &Point3<f64>, out: &Vector3<f64>) -> impl Iterator<Item = f64> {
        let [e, g] = tangent_basis(out);
        let angle = move |p: Point3<f64>| (p - centre).dot(&g).atan2((p - centre).dot(&e));
        self.edges()
            .map(move |(a, b)| (angle(b) - angle(a) + PI).rem_euclid(TAU) - PI)
    }

    /// Whether it goes around a place once.
    fn goes_around(&self, centre: &Point3<f64>, out: &Vector3<f64>) -> bool {
        // `out` points at the viewer: the edges go clockwise
        let back: f64 = self.turns(centre, out).map(|turn| turn.max(0.0)).sum();
        let around: f64 = self.turns(centre, out).sum();
        back < BACK * TAU && (around + TAU).abs() < BACK
    }
}
