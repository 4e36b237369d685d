//! Deviation of each vertex from the nominal part, for the colours of the page.

use nalgebra::Point3;

use crate::page::vertex_numbers::{VertexNumber, frame};
use crate::ros::messages::MeshPatch;
use touchup_geometry::mesh::{FaceTree, TriMesh, signed_distance};

/// Maximum distance of a deviation, m: surfaces farther off belong to another part.
const REACH: f64 = 20e-3;

/// The nominal part, in the frame of the mesh.
#[derive(Debug)]
pub(in crate::page) struct Nominal {
    mesh: TriMesh,
    tree: FaceTree,
}

impl Nominal {
    /// - `mesh`: m, in O.
    pub fn new(mesh: TriMesh) -> Self {
        Self {
            tree: FaceTree::new(&mesh),
            mesh,
        }
    }

    /// Deviations of the vertices that a patch sets, positive outside of the nominal part; NaN
    /// beyond the reach. `None`: it sets no vertex.
    pub fn frame(&self, patch: &MeshPatch) -> Option<Vec<u8>> {
        if patch.vertices.is_empty() {
            return None;
        }
        let deviations = patch
            .positions
            .as_chunks()
            .0
            .iter()
            .map(|place| self.deviation(place));
        Some(frame(
            VertexNumber::Deviation,
            patch.vertices.iter().copied().zip(deviations),
        ))
    }

    fn deviation(&self, place: &[f32; 3]) -> f32 {
        let place = Point3::from(place.map(f64::from));
        signed_distance(&self.mesh, &self.tree, &place, REACH)
            .map_or(f32::NAN, |distance| distance as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_those_from_a_plane_and_none_where_the_nominal_part_is_far() {
        let corners =
            [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(|[x, y]| Point3::new(x, y, 0.0));
        let nominal =
            Nominal::new(TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap());
        let patch = MeshPatch {
            vertices: vec![5, 6, 9],
            positions: vec![0.05, 0.05, 0.001, 0.02, 0.07, -0.002, 0.05, 0.05, 0.5],
            ..MeshPatch::default()
        };
        let frame = nominal.frame(&patch).unwrap();
        assert_eq!(frame[..8], [2, 1, 0, 0, 3, 0, 0, 0]);
        let words: Vec<[u8; 4]> = frame[8..].as_chunks().0.to_vec();
        assert_eq!(words[..3], [5u32, 6, 9].map(u32::to_le_bytes));
        let numbers: Vec<f32> = words[3..]
            .iter()
            .map(|word| f32::from_le_bytes(*word))
            .collect();
        assert!(
            (numbers[0] - 1e-3).abs() < 1e-9
                && (numbers[1] + 2e-3).abs() < 1e-9
                && numbers[2].is_nan()
        );
        assert!(nominal.frame(&MeshPatch::default()).is_none());
    }
}
