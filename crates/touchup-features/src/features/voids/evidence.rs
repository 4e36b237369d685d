//! Evidence of each segment: places of its faces and of its contacts.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3, Vector2, Vector3};

use crate::features::segmentation::scene::SegmentedMesh;
use touchup_geometry::mesh::Region;
use touchup_geometry::numeric::PointGrid;

/// Maximum number of parts of the side of a drawn face, and their minimum size, as a share of the
/// diagonal of the mesh.
const PARTS: f64 = 6.0;
const PART: f64 = 0.003;
/// Gap between pieces of one wall: in radii of the ball, in median edges of a measured mesh, and in a
/// drawing, m.
const GAP_RADII: f64 = 4.0;
const GAP_EDGES: f64 = 4.0;
const GAP_DRAWN: f64 = 2e-5;
/// Walls that face each other are parallel within 6°.
const PARALLEL: f64 = 0.9945;
/// Half of the extent of a contact, in radii of the ball.
const HALF_CONTACT: f64 = 0.1;
/// Components of a wall's normal along an axis: 6°; with contacts, which may lie along one edge, 16°.
const SQUARE: f64 = 0.1;
const SQUARE_FELT: f64 = 0.27;

/// A place of a surface.
#[derive(Clone, Copy)]
pub(super) struct SegmentPlace {
    pub point: Point3<f64>,
    /// half of its extent, m
    pub half: f64,
    pub segment: u32,
}

/// A connected piece of a flat wall, seen along an axis.
pub(super) struct WallPiece {
    pub segment: usize,
    pub at: Point2<f64>,
    pub normal: Vector2<f64>,
    /// range along the wall and along the axis, m
    pub span: [f64; 2],
    pub height: [f64; 2],
}

impl WallPiece {
    /// Unit vector along the wall.
    pub(super) fn along(&self) -> Vector2<f64> {
        Vector2::new(self.normal.y, -self.normal.x)
    }

    /// The unit vector across the void to a wall that faces this one, and its width, m.
    pub(super) fn width_to(&self, other: &Self) -> Option<(Vector2<f64>, f64)> {
        if self.normal.dot(&other.normal) > -PARALLEL {
            return None;
        }
        let across = (self.normal - other.normal).try_normalize(0.0)?;
        let width = (other.at - self.at).dot(&across);
        (width > 0.0).then_some((across, width))
    }
}

/// The evidence of a segmented mesh.
pub(super) struct SegmentEvidence<'a> {
    pub parted: &'a SegmentedMesh<'a>,
    pub of_segment: Vec<Vec<SegmentPlace>>,
    /// box of the places of each segment
    pub around: Vec<Region>,
    felt: Vec<SegmentPlace>,
    grid: PointGrid,
    /// gap between pieces of one surface, m, by segment
    gap: Vec<f64>,
    /// box of the faces of each segment, seams included
    bounds: Vec<Region>,
    /// radius of the ball, m
    pub radius: f64,
}

impl<'a> SegmentEvidence<'a> {
    /// - `of_face`: the segment of each face, seams included.
    pub(super) fn of(parted: &'a SegmentedMesh<'a>, of_face: &[u32], radius: f64) -> Self {
        let of_segment: Vec<Vec<SegmentPlace>> = (0..parted.segmentation.segments.len())
            .map(|number| evidence_of(parted, number, radius))
            .collect();
        let by_mesh = match parted.rounding {
            Some(_) => GAP_DRAWN,
            None => GAP_EDGES * parted.edge,
        };
        let gap = parted.segmentation.segments.iter().map(|segment| {
            if segment.felt.is_empty() {
                by_mesh
            } else {
                by_mesh.max(GAP_RADII * radius)
            }
        });
        let felt: Vec<SegmentPlace> = (0..parted.segmentation.segments.len())
            .flat_map(|number| felt_places(parted, number, radius))
            .collect();
        let mut grid = PointGrid::new(radius);
        (0..)
            .zip(&felt)
            .for_each(|(at, one)| grid.insert(at, &one.point));
        let around = of_segment.iter().map(|places| around(places)).collect();
        Self {
            parted,
            around,
            gap: gap.collect(),
            bounds: bounds(parted, of_face),
            of_segment,
            felt,
            grid,
            radius,
        }
    }

    /// Contacts around a place, of any segment.
    pub(super) fn felt_near(
        &self,
        p: &Point3<f64>,
        reach: f64,
    ) -> impl Iterator<Item = &SegmentPlace> {
        self.grid.near(p, reach).map(|number| &self.felt[number])
    }

    /// Whether a place is within a distance, m, of the bounds of a segment.
    pub(super) fn is_near(&self, number: usize, p: &Point3<f64>, distance: f64) -> bool {
        self.bounds[number].grown(distance).contains(p)
    }

    /// Whether a segment has contacts.
    pub(super) fn is_felt(&self, number: usize) -> bool {
        !self.parted.segment(number).felt.is_empty()
    }

    /// The pieces of flat walls along an axis, of walls that others face.
    ///
    /// - `basis`: of the plane square to it; `has_ends`: whether half-round walls are along the axis,
    ///   which may face any wall.
    pub(super) fn pieces(
        &self,
        axis: &Vector3<f64>,
        basis: &[Vector3<f64>; 2],
        has_ends: bool,
    ) -> Vec<WallPiece> {
        let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&basis[0]), v.dot(&basis[1]));
        let wall = |(number, point, normal): (usize, Point3<f64>, Vector3<f64>)| {
            let is_felt = self.is_felt(number);
            let square = if is_felt { SQUARE_FELT } else { SQUARE };
            let is_named = is_felt || self.parted.is_strong(number);
            if !is_named || normal.dot(axis).abs() > square {
                return None;
            }
            Some(WallPiece {
                segment: number,
                at: Point2::from(flat(&point.coords)),
                normal: flat(&normal).try_normalize(0.0)?,
                span: NOTHING,
                height: NOTHING,
            })
        };
        let walls: Vec<WallPiece> = self.parted.planes().filter_map(wall).collect();
        let is_faced =
            |one: &&WallPiece| has_ends || walls.iter().any(|other| one.width_to(other).is_some());
        let faced = walls.iter().filter(is_faced);
        faced
            .flat_map(|whole| self.parts(whole, axis, basis))
            .collect()
    }

    /// The connected pieces of a wall.
    fn parts(
        &self,
        whole: &WallPiece,
        axis: &Vector3<f64>,
        basis: &[Vector3<f64>; 2],
    ) -> Vec<WallPiece> {
        let along = whole.along();
        let along = basis[0] * along.x + basis[1] * along.y;
        let origin = (basis[0] * whole.at.x + basis[1] * whole.at.y).dot(&along);
        let gap = self.gap[whole.segment];
        // places of a drawn face reach its corners
        let reach = if self.parted.rounding.is_some() {
            0.0
        } else {
            1.0
        };
        // places that begin within a gap are of one piece
        let mut bins: BTreeMap<i64, WallSpan> = BTreeMap::new();
        for one in &self.of_segment[whole.segment] {
            let v = one.point.coords;
            let (x, z, half) = (v.dot(&along) - origin, v.dot(axis), one.half);
            let bin = bins.entry(((x - half) / gap).floor() as i64);
            let span = bin.or_insert(WallSpan::EMPTY);
            span.begin = span.begin.min(x - half);
            span.end = span.end.max(x + half);
            span.span = widened(span.span, x, reach * half);
            span.height = widened(span.height, z, reach * half);
        }
        let mut parts: Vec<WallPiece> = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for span in bins.values() {
            if span.begin > last + gap {
                parts.push(WallPiece { ..*whole });
            }
            last = last.max(span.end);
            if let Some(part) = parts.last_mut() {
                part.span = joined(part.span, span.span);
                part.height = joined(part.height, span.height);
            }
        }
        parts
    }
}

/// Extent of places of a wall along it.
struct WallSpan {
    /// with the extent of each place, m
    begin: f64,
    end: f64,
    /// ranges along the wall and along the axis, m
    span: [f64; 2],
    height: [f64; 2],
}

impl WallSpan {
    const EMPTY: Self = Self {
        begin: f64::INFINITY,
        end: f64::NEG_INFINITY,
        span: NOTHING,
        height: NOTHING,
    };
}

const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn widened([low, high]: [f64; 2], x: f64, half: f64) -> [f64; 2] {
    [low.min(x - half), high.max(x + half)]
}

fn joined(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Box of places.
fn around(places: &[SegmentPlace]) -> Region {
    let [low, high] = NOTHING.map(|x| Point3::from(Vector3::repeat(x)));
    places
        .iter()
        .fold(Region { low, high }, |around, one| Region {
            low: around.low.inf(&(one.point - Vector3::repeat(one.half))),
            high: around.high.sup(&(one.point + Vector3::repeat(one.half))),
        })
}

/// Box of the faces of each segment.
fn bounds(parted: &SegmentedMesh, of_face: &[u32]) -> Vec<Region> {
    let [low, high] = NOTHING.map(|x| Point3::from(Vector3::repeat(x)));
    let mut bounds = vec![Region { low, high }; parted.segmentation.segments.len()];
    for (face, &number) in (0..).zip(of_face) {
        if let Some(Region { low, high }) = bounds.get_mut(number as usize) {
            for corner in parted.facets.triangle(face) {
                (*low, *high) = (low.inf(&corner), high.sup(&corner));
            }
        }
    }
    bounds
}

fn evidence_of(parted: &SegmentedMesh, number: usize, radius: f64) -> Vec<SegmentPlace> {
    let segment = parted.segment(number);
    let mut all = Vec::new();
    let place = |point, half| SegmentPlace {
        point,
        half,
        segment: number as u32,
    };
    for &face in &segment.faces {
        let [a, b, c] = parted.facets.triangle(face);
        let size = (b - a).norm().max((c - a).norm()).max((c - b).norm());
        if parted.rounding.is_none() {
            all.push(place(a + ((b - a) + (c - a)) / 3.0, size / 3.0));
            continue;
        }
        let parts = (size / (PART * parted.diagonal)).ceil().clamp(1.0, PARTS);
        let last = parts as usize;
        for (i, k) in (0..=last).flat_map(|i| (0..=last - i).map(move |k| (i, k))) {
            let [u, v] = [i, k].map(|at| at as f64 / parts);
            let point = a + (b - a) * u + (c - a) * v;
            all.push(place(point, size / (2.0 * parts)));
        }
    }
    all.extend(felt_places(parted, number, radius));
    all
}

/// Places of the touches of a segment.
fn felt_places<'a>(
    parted: &'a SegmentedMesh,
    number: usize,
    radius: f64,
) -> impl Iterator<Item = SegmentPlace> + 'a {
    let felt = parted.segment(number).felt.iter();
    felt.map(move |felt| SegmentPlace {
        point: felt.place,
        half: HALF_CONTACT * radius,
        segment: number as u32,
    })
}
