//! Cached properties of each face for segmentation: normal, area, adjacent faces.

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};

/// No face lies across this edge: the mesh ends, more than two faces meet, or the neighbour is
/// turned over. For a face: no segment, no piece.
pub(in crate::features) const NONE: u32 = u32::MAX;

/// All faces of a mesh, by id; each property has an array of its own, so that reading one does not
/// load the others.
#[derive(Clone, Debug)]
pub(in crate::features) struct Facets<'a> {
    pub mesh: &'a TriMesh,
    /// outward unit normals; zero for a face without area
    pub normals: Vec<Vector3<f64>>,
    /// m²
    pub areas: Vec<f64>,
    /// the faces across the edges that begin at each corner
    pub beside: Vec<[u32; 3]>,
}

impl<'a> Facets<'a> {
    pub(crate) fn of(mesh: &'a TriMesh) -> Self {
        let slots = mesh.face_slots();
        let (mut normals, mut areas) = (Vec::with_capacity(slots), Vec::with_capacity(slots));
        for face in (0..slots as u32).map(FaceId) {
            let double = if mesh.has_face(face) {
                mesh.double_area_normal(face)
            } else {
                Vector3::zeros()
            };
            let length = double.norm();
            areas.push(length / 2.0);
            normals.push(if length > 0.0 {
                double / length
            } else {
                Vector3::zeros()
            });
        }
        let mut beside = vec![[NONE; 3]; slots];
        let mut fan = VertexFan::default();
        for vertex in (0..mesh.vertex_slots() as u32)
            .map(VertexId)
            .filter(|&vertex| mesh.has_vertex(vertex))
        {
            fan.gather(mesh, vertex);
            fan.join(vertex, &mut beside);
        }
        Self {
            mesh,
            normals,
            areas,
            beside,
        }
    }

    /// Number of faces, with removed ones.
    pub(crate) fn slots(&self) -> usize {
        self.areas.len()
    }

    #[inline]
    pub(crate) fn normal(&self, face: u32) -> Vector3<f64> {
        self.normals[face as usize]
    }

    #[inline]
    pub(crate) fn area(&self, face: u32) -> f64 {
        self.areas[face as usize]
    }

    /// m²
    pub(crate) fn area_of(&self, faces: &[u32]) -> f64 {
        faces.iter().map(|&face| self.area(face)).sum()
    }

    /// The faces beside, each with the number of its edge.
    pub(crate) fn beside(&self, face: u32) -> impl Iterator<Item = (usize, u32)> + use<> {
        self.beside[face as usize]
            .into_iter()
            .enumerate()
            .filter(|&(_, other)| other != NONE)
    }

    /// Numbers of the edges of a face without any other face.
    pub(crate) fn open_edges(&self, face: u32) -> impl Iterator<Item = usize> + '_ {
        let corners = self.mesh.corners(FaceId(face));
        let beside = self.beside[face as usize];
        let is_open = move |&edge: &usize| {
            let ends = (corners[edge], corners[(edge + 1) % 3]);
            beside[edge] == NONE && self.mesh.faces_at_edge(ends.0, ends.1).count() == 1
        };
        (0..3).filter(is_open)
    }

    pub(crate) fn triangle(&self, face: u32) -> [Point3<f64>; 3] {
        self.mesh.triangle(FaceId(face))
    }

    /// Ends of an edge, m.
    pub(crate) fn edge(&self, face: u32, edge: usize) -> [Point3<f64>; 2] {
        let corners = self.triangle(face);
        [corners[edge], corners[(edge + 1) % 3]]
    }
}

/// The faces around a vertex: the vertices before and after it in each, the face, and the number of
/// its edge to the next.
#[derive(Default)]
struct VertexFan {
    before: Vec<u32>,
    after: Vec<u32>,
    faces: Vec<(u32, usize)>,
}

/// Number of neighbours compared at once; places without one have no number of a vertex.
const AT_ONCE: usize = 8;

impl VertexFan {
    fn gather(&mut self, mesh: &TriMesh, vertex: VertexId) {
        let star = mesh.star(vertex);
        let size = star.len().next_multiple_of(AT_ONCE);
        self.faces.clear();
        for numbers in [&mut self.before, &mut self.after] {
            numbers.clear();
            numbers.resize(size, NONE);
        }
        let places = self.before.iter_mut().zip(&mut self.after);
        self.faces
            .extend(star.iter().zip(places).map(|(&face, place)| {
                let [a, b, c] = mesh.corners(face).map(|corner| corner.0);
                let (before, after, edge) = match vertex.0 {
                    v if v == a => (c, b, 0),
                    v if v == b => (a, c, 1),
                    _ => (b, a, 2),
                };
                (*place.0, *place.1) = (before, after);
                (face.0, edge)
            }));
    }

    /// The place of the face across the edge to vertex `next`, if it is the only one and runs along
    /// it in the opposite direction.
    fn across(&self, next: u32) -> Option<usize> {
        let (mut faces, mut place) = (0, 0);
        let (before, after) = (
            self.before.as_chunks::<AT_ONCE>().0,
            self.after.as_chunks::<AT_ONCE>().0,
        );
        for (chunk, (before, after)) in before.iter().zip(after).enumerate() {
            for at in 0..AT_ONCE {
                let is_across = before[at] == next;
                faces += u32::from(is_across) + u32::from(after[at] == next);
                place += if is_across {
                    (chunk * AT_ONCE + at + 1) as u32
                } else {
                    0
                };
            }
        }
        if faces == 2 {
            (place as usize).checked_sub(1)
        } else {
            None
        }
    }

    /// Sets the faces across each edge between the vertex and a later one.
    fn join(&self, vertex: VertexId, beside: &mut [[u32; 3]]) {
        for (&(face, edge), &next) in self
            .faces
            .iter()
            .zip(&self.after)
            .filter(|&(_, &next)| next > vertex.0)
        {
            if let Some(place) = self.across(next) {
                // its edge to this vertex ends at the start of the one from here
                let (other, its_edge) = self.faces[place];
                beside[face as usize][edge] = other;
                beside[other as usize][(its_edge + 2) % 3] = face;
            }
        }
    }
}
