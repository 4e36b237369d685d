//! What segmentation asks of each face again and again: normal, area, the faces beside it.

use nalgebra::{Point3, Vector3};

use crate::mesh::{FaceId, TriMesh, VertexId};

/// No face lies across this edge: the mesh ends, more than two faces meet, or the one there is turned over.
pub(super) const NONE: u32 = u32::MAX;

/// One face, flat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// outward unit normal; zero for a face without area
    pub normal: Vector3<f64>,
    /// m²
    pub area: f64,
    /// the face across the edge that begins at each corner
    pub beside: [u32; 3],
}

/// All faces of a mesh, by id.
#[derive(Clone, Debug)]
pub(super) struct Facets<'a> {
    pub mesh: &'a TriMesh,
    pub facets: Vec<Facet>,
}

impl<'a> Facets<'a> {
    pub fn of(mesh: &'a TriMesh) -> Self {
        let gone = Facet { normal: Vector3::zeros(), area: 0.0, beside: [NONE; 3] };
        let mut facets = vec![gone; mesh.face_slots()];
        for (face, _) in mesh.faces() {
            let double = mesh.double_area_normal(face);
            let length = double.norm();
            let facet = &mut facets[face.0 as usize];
            facet.area = length / 2.0;
            facet.normal = if length > 0.0 { double / length } else { Vector3::zeros() };
        }
        let mut corners = Vec::new();
        for vertex in 0..mesh.vertex_slots() as u32 {
            join_around(mesh, VertexId(vertex), &mut corners, &mut facets);
        }
        Self { mesh, facets }
    }

    pub fn normal(&self, face: u32) -> Vector3<f64> {
        self.facets[face as usize].normal
    }

    pub fn area(&self, face: u32) -> f64 {
        self.facets[face as usize].area
    }

    /// m²
    pub fn area_of(&self, faces: &[u32]) -> f64 {
        faces.iter().map(|&face| self.area(face)).sum()
    }

    /// The faces beside, each with the number of its edge.
    pub fn beside(&self, face: u32) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.facets[face as usize].beside.iter().copied().enumerate().filter(|&(_, other)| other != NONE)
    }

    /// Ends of the edges of a face that have no other face at all, m.
    pub fn open_edges(&self, face: u32) -> impl Iterator<Item = [Point3<f64>; 2]> + '_ {
        let corners = self.mesh.corners(FaceId(face));
        let beside = self.facets[face as usize].beside;
        let is_open = move |&edge: &usize| {
            let ends = (corners[edge], corners[(edge + 1) % 3]);
            beside[edge] == NONE && self.mesh.faces_at_edge(ends.0, ends.1).count() == 1
        };
        (0..3).filter(is_open).map(move |edge| self.edge(face, edge))
    }

    pub fn triangle(&self, face: u32) -> [Point3<f64>; 3] {
        self.mesh.triangle(FaceId(face))
    }

    /// Ends of an edge, m.
    pub fn edge(&self, face: u32, edge: usize) -> [Point3<f64>; 2] {
        let corners = self.triangle(face);
        [corners[edge], corners[(edge + 1) % 3]]
    }
}

/// A face around a vertex: the vertices before and after it there, the face, and the number of its edge to the next.
type Corner = (u32, u32, u32, usize);

/// Sets what is across each edge that begins at a vertex: the one other face there, when it runs along it the other way.
fn join_around(mesh: &TriMesh, vertex: VertexId, corners: &mut Vec<Corner>, facets: &mut [Facet]) {
    if !mesh.has_vertex(vertex) {
        return;
    }
    corners.clear();
    for &face in mesh.star(vertex) {
        let [a, b, c] = mesh.corners(face).map(|corner| corner.0);
        corners.push(match vertex.0 {
            v if v == a => (c, b, face.0, 0),
            v if v == b => (a, c, face.0, 1),
            _ => (b, a, face.0, 2),
        });
    }
    for &(_, next, face, edge) in corners.iter() {
        let (mut across, mut at_edge) = (NONE, 0);
        for &(before, after, other, _) in corners.iter() {
            at_edge += u32::from(before == next) + u32::from(after == next);
            if before == next {
                across = other;
            }
        }
        facets[face as usize].beside[edge] = if at_edge == 2 { across } else { NONE };
    }
}
