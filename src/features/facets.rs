//! What segmentation asks of each face again and again: normal, area, the faces beside it.

use nalgebra::{Point3, Vector3};

use crate::mesh::{FaceId, TriMesh};

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
            let facet = &mut facets[face.0 as usize];
            facet.area = double.norm() / 2.0;
            facet.normal = double.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            facet.beside = beside(mesh, face);
        }
        Self { mesh, facets }
    }

    pub fn normal(&self, face: u32) -> Vector3<f64> {
        self.facets[face as usize].normal
    }

    pub fn area(&self, face: u32) -> f64 {
        self.facets[face as usize].area
    }

    /// The faces beside, each with the number of its edge.
    pub fn beside(&self, face: u32) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.facets[face as usize].beside.iter().copied().enumerate().filter(|&(_, other)| other != NONE)
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

/// Across each edge the one face that runs along it the other way.
fn beside(mesh: &TriMesh, face: FaceId) -> [u32; 3] {
    let corners = mesh.corners(face);
    [0, 1, 2].map(|i| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        let (mut across, mut at_edge) = (NONE, 0);
        for &other in mesh.star(from) {
            let c = mesh.corners(other);
            let Some(at) = (0..3).find(|&k| c[k] == to) else { continue };
            at_edge += 1;
            if c[(at + 1) % 3] == from {
                across = other.0;
            }
        }
        if at_edge == 2 { across } else { NONE }
    })
}
