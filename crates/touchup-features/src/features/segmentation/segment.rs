//! Segmentation of a mesh into pieces of one surface each.

use std::collections::BTreeSet;

use nalgebra::Point3;

use super::facets::{Facets, NONE};
use super::marks::sort;
use super::primitive::{Primitive, belongs, plane_of};
use crate::features::fit::SurfaceModel;
use touchup_geometry::numeric::{DisjointSets, distinct};

/// A connected piece of the mesh that one primitive explains.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// the surface
    pub primitive: Primitive,
    /// ids of its faces, in ascending order
    pub faces: Vec<u32>,
    /// m²
    pub area: f64,
    /// maximum distance of its corners from the primitive, m
    pub tolerance: f64,
    /// its corners lie on it as in a drawing, not as in a measurement
    pub is_exact: bool,
    /// contacts that show it, by the numbers of their touches
    pub felt: Vec<FeltPlace>,
}

/// A place of a surface that a touch shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FeltPlace {
    /// number of the touch
    pub touch: u32,
    /// m, in O
    pub place: Point3<f64>,
    /// at an edge of the surface over which the ball rolled: standard deviation of the place, in
    /// those of the touch
    pub at_edge: Option<f64>,
}

impl Segment {
    /// Numbers of the touches on its face, not on an edge.
    pub(crate) fn touches(&self) -> impl Iterator<Item = u32> + '_ {
        let on_face = self.felt.iter().filter(|felt| felt.at_edge.is_none());
        on_face.map(|felt| felt.touch)
    }
}

/// All segments of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Segmentation {
    /// the largest first
    pub segments: Vec<Segment>,
    /// number of the segment of each face, by id; [`NONE`]: none
    pub of_face: Vec<u32>,
}

impl Segmentation {
    /// Adds a segment, which takes its faces from others; returns its number.
    pub(in crate::features) fn add(&mut self, facets: &Facets, mut segment: Segment) -> usize {
        let number = self.segments.len() as u32;
        segment.faces.sort_unstable();
        let mut poorer = Vec::new();
        for &face in &segment.faces {
            let before = std::mem::replace(&mut self.of_face[face as usize], number);
            if before != NONE {
                self.segments[before as usize].area -= facets.area(face);
                poorer.push(before);
            }
        }
        for before in distinct(poorer) {
            self.segments[before as usize]
                .faces
                .retain(|&face| self.of_face[face as usize] == before);
        }
        self.segments.push(segment);
        number as usize
    }

    /// Lets each round surface of a drawing take the pieces beside it that lie on its chords as a
    /// whole: a tessellation puts corners of neighbours there, and its facets may then look like
    /// planes of their own.
    ///
    /// - `tolerance`: distance of chords from the surface, m.
    pub(in crate::features) fn join_chords(&mut self, facets: &Facets, tolerance: f64) {
        for number in 0..self.segments.len() {
            let Segment {
                primitive,
                is_exact: true,
                ..
            } = self.segments[number]
            else {
                continue;
            };
            // a sphere would take the first ring of a surface that it touches
            if matches!(primitive, Primitive::Plane(_) | Primitive::Sphere(_)) {
                continue;
            }
            let is_on = |&face: &u32| belongs(facets, face, &primitive, tolerance);
            let mut front = self.segments[number].faces.clone();
            let mut examined = BTreeSet::from([number as u32]);
            while !front.is_empty() {
                let mut taken = Vec::new();
                for other in front
                    .iter()
                    .flat_map(|&face| facets.beside(face))
                    .map(|(_, other)| other)
                {
                    let label = self.of_face[other as usize];
                    if label == NONE {
                        if is_on(&other) {
                            self.of_face[other as usize] = number as u32;
                            taken.push(other);
                        }
                        continue;
                    }
                    let is_smaller =
                        self.segments[label as usize].area < self.segments[number].area;
                    if is_smaller
                        && examined.insert(label)
                        && self.segments[label as usize].faces.iter().all(is_on)
                    {
                        let piece = &mut self.segments[label as usize];
                        piece.area = 0.0;
                        for face in std::mem::take(&mut piece.faces) {
                            self.of_face[face as usize] = number as u32;
                            taken.push(face);
                        }
                    }
                }
                let whole = &mut self.segments[number];
                whole.area += facets.area_of(&taken);
                whole.faces.extend(&taken);
                front = taken;
            }
            self.segments[number].faces.sort_unstable();
        }
        self.drop_empty();
    }

    /// Drops segments without faces.
    fn drop_empty(&mut self) {
        self.segments.retain(|segment| !segment.faces.is_empty());
        self.segments.sort_by(|a, b| b.area.total_cmp(&a.area));
        for (number, segment) in self.segments.iter().enumerate() {
            segment
                .faces
                .iter()
                .for_each(|&face| self.of_face[face as usize] = number as u32);
        }
    }

    /// Merges planes that continue each other.
    ///
    /// - `beside`: pairs of adjacent segments, over seams too, the smaller number first.
    pub(in crate::features) fn join_planes(
        &mut self,
        facets: &Facets,
        beside: impl Iterator<Item = [u32; 2]>,
    ) {
        let mut sets = DisjointSets::of(self.segments.len());
        for pair in beside {
            let [a, b] = pair.map(|number| sets.root(number));
            if a != b && is_one_plane(&self.segments[a as usize], &self.segments[b as usize]) {
                sets.join(a, b);
            }
        }
        let parts = std::mem::take(&mut self.segments);
        let mut number_of = vec![0; parts.len()];
        let mut joint = Vec::new();
        // the largest is first, so that each root comes before its members
        for (at, part) in parts.into_iter().enumerate() {
            let of = sets.root(at as u32) as usize;
            if of == at {
                number_of[at] = self.segments.len();
                self.segments.push(part);
                continue;
            }
            let whole = &mut self.segments[number_of[of]];
            whole.area += part.area;
            whole.tolerance = whole.tolerance.max(part.tolerance);
            whole.faces.extend(part.faces);
            if part.felt.len() > whole.felt.len() {
                whole.primitive = part.primitive;
            }
            whole.felt.extend(part.felt);
            joint.push(number_of[of]);
        }
        for number in distinct(joint) {
            let whole = &mut self.segments[number];
            sort(&mut whole.faces, facets.slots());
            if !whole.felt.is_empty() {
                whole.felt.sort_by_key(|felt| felt.touch);
                continue;
            }
            let origin = facets.triangle(whole.faces[0])[0];
            whole.primitive =
                plane_of(facets, origin, whole.faces.iter().copied()).unwrap_or(whole.primitive);
        }
        for (number, segment) in self.segments.iter().enumerate() {
            segment
                .faces
                .iter()
                .for_each(|&face| self.of_face[face as usize] = number as u32);
        }
    }
}

/// Normals of one plane differ by less than this: 4°.
const SAME_NORMAL: f64 = 0.9976;
/// Maximum distance of the middle of a piece from the plane of the larger one, in tolerances.
const SAME_PLANE: f64 = 1.5;

/// Whether the smaller of two segments lies on the larger.
fn is_one_plane(one: &Segment, other: &Segment) -> bool {
    let (large, small) = if one.area < other.area {
        (other, one)
    } else {
        (one, other)
    };
    let Some((plane, other)) = large.primitive.plane().zip(small.primitive.plane()) else {
        return false;
    };
    let near = SAME_PLANE * large.tolerance.max(small.tolerance);
    plane.normal().dot(&other.normal()) > SAME_NORMAL && plane.distance(&other.point()).abs() < near
}
