//! The touched part of a mesh, and the rest of it as plain triangles.

use nalgebra::{Point3, Vector3};

use super::stars::Valences;
use super::{FaceId, MeshError, TriMesh, VertexId};
use crate::numeric::distinct;

/// A box, m, in O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// lowest corner
    pub low: Point3<f64>,
    /// highest corner
    pub high: Point3<f64>,
}

impl Region {
    /// The least box around points; `None` without any.
    pub fn around(points: &[Point3<f64>]) -> Option<Self> {
        let first = *points.first()?;
        let [low, high] = points
            .iter()
            .fold([first; 2], |[low, high], p| [low.inf(p), high.sup(p)]);
        Some(Self { low, high })
    }

    /// The box widened by `margin` (m) on all sides.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            low: self.low - Vector3::repeat(margin),
            high: self.high + Vector3::repeat(margin),
        }
    }

    /// Whether the box contains a point.
    #[inline]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.low <= *p && *p <= self.high
    }

    /// Whether the box of a triangle overlaps this box.
    fn meets(&self, [a, b, c]: &[Point3<f64>; 3]) -> bool {
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        low <= self.high && self.low <= high
    }
}

/// The rest of a mesh after a cut: faces without adjacency, bit by bit as before.
#[derive(Clone, Debug)]
pub struct MeshRemainder {
    /// of the vertices outside the part, m, in order of id
    positions: Vec<Point3<f64>>,
    /// id in the whole of each vertex of the part, rising
    vertices: Vec<u32>,
    /// faces outside the part, by the ids of the whole, in order of id
    faces: Vec<[u32; 3]>,
    /// place of each face of the part among all faces, rising
    places: Vec<u32>,
    /// vertices shared by the part and faces outside, and their positions, m
    rim: Vec<(VertexId, Point3<f64>)>,
    /// edges shared by the part and faces outside
    rim_edges: Vec<[VertexId; 2]>,
}

/// A whole mesh made of its rest and the part cut from it.
#[derive(Clone, Debug)]
pub struct SewnMesh {
    /// the whole: vertices and faces keep their order, new ones come last
    pub mesh: TriMesh,
    /// vertex in the whole of each vertex slot of the part
    pub vertices: Vec<VertexId>,
}

impl SewnMesh {
    /// Values of the vertices of the part as values of the vertices of the whole.
    ///
    /// - `outside`: value of vertices outside the part.
    pub fn column<T: Copy>(&self, of_part: &[T], outside: T) -> Vec<T> {
        let mut values = vec![outside; self.mesh.vertex_slots()];
        for (vertex, value) in self.vertices.iter().zip(of_part) {
            values[vertex.0 as usize] = *value;
        }
        values
    }
}

/// A vertex outside the part.
const NOT_IN: u32 = u32::MAX;

impl TriMesh {
    /// Splits off the faces that reach into `region`, with all their corners, as a mesh of its own.
    ///
    /// The part has all faces around a vertex in `region`. Vertices on its rim lie outside `region`
    /// and must not move, or [`MeshRemainder::sew_to`] fails.
    pub fn cut(&self, region: &Region) -> (TriMesh, MeshRemainder) {
        let mut ids = vec![NOT_IN; self.vertex_slots()];
        let (mut inside, mut places, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        for (place, (face, corners)) in self.faces().enumerate() {
            let corners = corners.map(|vertex| vertex.0);
            if region.meets(&self.triangle(face)) {
                corners.iter().for_each(|&vertex| ids[vertex as usize] = 0);
                inside.push(corners);
                places.push(place as u32);
            } else {
                faces.push(corners);
            }
        }
        let (mut vertices, mut of_part, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        for (vertex, (id, p)) in ids.iter_mut().zip(self.positions()).enumerate() {
            if *id == NOT_IN {
                positions.push(*p);
            } else {
                *id = vertices.len() as u32;
                vertices.push(vertex as u32);
                of_part.push(*p);
            }
        }
        inside
            .iter_mut()
            .flatten()
            .for_each(|vertex| *vertex = ids[*vertex as usize]);
        let mut valences = Valences::new(of_part.len());
        inside.iter().for_each(|corners| valences.add(corners));
        let part = TriMesh::of_sound(of_part, inside, valences);
        let (rim, rim_edges) = rim_of(&part, &faces, &ids);
        (
            part,
            MeshRemainder {
                positions,
                vertices,
                faces,
                places,
                rim,
                rim_edges,
            },
        )
    }
}

/// A vertex of the rim, and its scanned position.
type RimVertex = (VertexId, Point3<f64>);

/// Vertices and edges shared by the part and faces outside, each once.
fn rim_of(part: &TriMesh, faces: &[[u32; 3]], ids: &[u32]) -> (Vec<RimVertex>, Vec<[VertexId; 2]>) {
    let mut edges = Vec::new();
    let mut vertices = Vec::new();
    for corners in faces {
        let corners = corners.map(|vertex| {
            Some(ids[vertex as usize])
                .filter(|&id| id != NOT_IN)
                .map(VertexId)
        });
        vertices.extend(corners.into_iter().flatten());
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let Some((a, b)) = corners[a].zip(corners[b]) else {
                continue;
            };
            if part.faces_at_edge(a, b).next().is_some() {
                edges.push([a.min(b), a.max(b)]);
            }
        }
    }
    let vertices = distinct(vertices)
        .into_iter()
        .map(|vertex| (vertex, part.position(vertex)))
        .collect();
    (vertices, distinct(edges))
}

impl MeshRemainder {
    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Point3<f64>>()
            + self.faces.capacity() * size_of::<[u32; 3]>()
            + (self.vertices.capacity() + self.places.capacity()) * size_of::<u32>()
            + self.rim.capacity() * size_of::<RimVertex>()
            + self.rim_edges.capacity() * size_of::<[VertexId; 2]>()
    }

    /// Joins the rest and the part, in which faces may have come, gone and moved.
    ///
    /// # Errors
    /// [`MeshError::TornRim`] if that reached the rim, [`MeshError::TooMany`].
    pub fn sew_to(&self, part: &TriMesh) -> Result<SewnMesh, MeshError> {
        let is_as_it_was = |&(vertex, p): &(VertexId, Point3<f64>)| {
            part.has_vertex(vertex) && part.position(vertex) == p
        };
        let is_joined = |&[a, b]: &[VertexId; 2]| part.faces_at_edge(a, b).next().is_some();
        if !self.rim.iter().all(is_as_it_was) || !self.rim_edges.iter().all(is_joined) {
            return Err(MeshError::TornRim);
        }
        let old = self.vertices.len();
        let slots = self.positions.len() + old;
        let added = (0..part.vertex_slots().saturating_sub(old)).map(|new| (slots + new) as u32);
        let vertices: Vec<_> = self
            .vertices
            .iter()
            .copied()
            .chain(added)
            .map(VertexId)
            .collect();

        let mut positions = vec![Point3::origin(); slots + part.vertex_slots().saturating_sub(old)];
        let mut others = self.positions.iter();
        let mut next = self.vertices.iter().peekable();
        for (id, p) in positions[..slots].iter_mut().enumerate() {
            if next.next_if(|&&vertex| vertex as usize == id).is_none() {
                *p = *others.next().expect("a vertex is in the part or outside");
            }
        }
        for (vertex, p) in vertices.iter().zip(part.positions()) {
            positions[vertex.0 as usize] = *p;
        }
        let faces = self.all_faces(part, |vertex| vertices[vertex.0 as usize].0);
        Ok(SewnMesh {
            mesh: TriMesh::new(positions, faces)?,
            vertices,
        })
    }

    /// Faces in the order of the whole; faces added to the part come last.
    fn all_faces(&self, part: &TriMesh, id_of: impl Fn(VertexId) -> u32) -> Vec<[u32; 3]> {
        let corners = |face: usize| {
            let face = FaceId(face as u32);
            part.has_face(face).then(|| part.corners(face).map(&id_of))
        };
        let mut faces = Vec::with_capacity(self.faces.len() + part.face_count());
        let (mut outside, mut known) = (self.faces.iter(), 0);
        for place in 0..self.faces.len() + self.places.len() {
            if self
                .places
                .get(known)
                .is_some_and(|&at| at as usize == place)
            {
                faces.extend(corners(known));
                known += 1;
            } else {
                faces.extend(outside.next());
            }
        }
        faces.extend((known..part.face_slots()).filter_map(corners));
        faces
    }
}
