//! The part of a mesh that is touched, and the rest of it, kept aside as plain triangles.

use nalgebra::{Point3, Vector3};

use super::stars::Valences;
use super::{FaceId, MeshError, TriMesh, VertexId};
use crate::numeric::distinct;

/// A box, m, in O.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// its lowest corner
    pub low: Point3<f64>,
    /// its highest corner
    pub high: Point3<f64>,
}

impl Region {
    /// Larger by `margin` (m) on all sides.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            low: self.low - Vector3::repeat(margin),
            high: self.high + Vector3::repeat(margin),
        }
    }

    /// Whether a point is in it.
    #[inline]
    pub fn contains(&self, p: &Point3<f64>) -> bool {
        self.low <= *p && *p <= self.high
    }

    /// Whether a triangle may reach into it: whether the box around it does.
    fn meets(&self, [a, b, c]: &[Point3<f64>; 3]) -> bool {
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        low <= self.high && self.low <= high
    }
}

/// What is left of a mesh when a part of it was cut out: faces without adjacency. It is bit by bit
/// what it was.
#[derive(Clone, Debug)]
pub struct Outside {
    /// of the vertices that the part does not have, m, in order of id
    positions: Vec<Point3<f64>>,
    /// for each vertex of the part its id in the whole, rising
    vertices: Vec<u32>,
    /// faces that the part does not have, by the ids of the whole, in order of id
    faces: Vec<[u32; 3]>,
    /// for each face of the part its place among all faces, rising
    places: Vec<u32>,
    /// vertices of the part that faces outside have, too, and where they are, m
    rim: Vec<(VertexId, Point3<f64>)>,
    /// edges of the part at which faces outside begin
    rim_edges: Vec<[VertexId; 2]>,
}

/// A part put back into what was left of its mesh.
#[derive(Clone, Debug)]
pub struct Sewn {
    /// the whole: vertices and faces have the order they had, new ones come last
    pub mesh: TriMesh,
    /// for each vertex slot of the part its vertex in the whole
    pub vertices: Vec<VertexId>,
}

impl Sewn {
    /// Values of the vertices of the part as values of those of the whole.
    ///
    /// - `outside`: of a vertex that the part does not have.
    pub fn column<T: Copy>(&self, of_part: &[T], outside: T) -> Vec<T> {
        let mut values = vec![outside; self.mesh.vertex_slots()];
        for (vertex, value) in self.vertices.iter().zip(of_part) {
            values[vertex.0 as usize] = *value;
        }
        values
    }
}

/// No vertex of the part.
const NOT_IN: u32 = u32::MAX;

impl TriMesh {
    /// The faces that reach into `region`, as a mesh of their own with all corners they have, and
    /// the rest.
    ///
    /// All faces around a vertex that lies in `region` are in the part. Vertices on its rim do not
    /// lie in `region`: they are not to be moved, or [`Outside::sew_to`] refuses.
    pub fn cut(&self, region: &Region) -> (TriMesh, Outside) {
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
            Outside {
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

/// A vertex of the rim, and where it was scanned.
type RimVertex = (VertexId, Point3<f64>);

/// Vertices and edges of the part at which faces outside begin, each once.
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

impl Outside {
    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Point3<f64>>()
            + self.faces.capacity() * size_of::<[u32; 3]>()
            + (self.vertices.capacity() + self.places.capacity()) * size_of::<u32>()
            + self.rim.capacity() * size_of::<RimVertex>()
            + self.rim_edges.capacity() * size_of::<[VertexId; 2]>()
    }

    /// Puts the part back, in which faces may have come, gone and moved.
    ///
    /// # Errors
    /// [`MeshError::TornRim`] where that reached the rim, [`MeshError::TooMany`].
    pub fn sew_to(&self, part: &TriMesh) -> Result<Sewn, MeshError> {
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
        Ok(Sewn {
            mesh: TriMesh::new(positions, faces)?,
            vertices,
        })
    }

    /// Faces in the order of the whole; those that were added to the part last.
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
