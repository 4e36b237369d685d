//! The patch, new faces for a part of a scan; and the patched scan, with support and uncertainty of
//! each vertex.

use crate::reconstruct::support::Support;
use nalgebra::Point3;

use crate::reconstruct::lattice::{LatticeNode, PatchFace, Square, VertexKey};
use crate::reconstruct::table::CellTable;
use touchup_geometry::mesh::{FaceId, MeshError, TriMesh, VertexId};

/// New faces for a region, and the faces of the scan that they replace.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// positions, m, in O; [`PatchFace::corners`] counts them in this order
    pub vertices: CellTable<VertexKey, Point3<f64>>,
    /// the new faces
    pub faces: Vec<PatchFace>,
    /// removed faces of the scan, by id
    pub removed: Vec<FaceId>,
    /// squares without a join of scan and patch
    pub open: Vec<OpenSquare>,
}

impl Patch {
    /// The patched scan, and the id in it of each vertex of the patch that a face uses: vertices
    /// and untouched faces of the scan keep their ids.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice, [`MeshError::NotFinite`] for
    /// crossings of the field that are not finite.
    pub fn applied_to(
        &self,
        mut mesh: TriMesh,
    ) -> Result<(TriMesh, Vec<Option<VertexId>>), MeshError> {
        for &face in &self.removed {
            mesh.remove_face(face);
        }
        let mut ids: Vec<Option<VertexId>> = vec![None; self.vertices.len()];
        for face in &self.faces {
            let mut corners = [VertexId(0); 3];
            for (corner, &at) in corners.iter_mut().zip(&face.corners) {
                *corner = match (ids[at as usize], self.vertices.entry(at)) {
                    (Some(id), _) | (None, &(VertexKey::Scan(id), _)) => id,
                    (None, (_, position)) => mesh.add_vertex(*position)?,
                };
                ids[at as usize] = Some(*corner);
            }
            mesh.add_face(corners)?;
        }
        Ok((mesh, ids))
    }
}

/// A square on the rim of the region on which scan and field disagree: both end there unless the
/// region grows by the cell beyond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenSquare {
    /// the square
    pub square: Square,
    /// the cell on its other side, not in the region
    pub beyond: LatticeNode,
    /// whether the scan crosses the square; if not, the field goes on past the end of the scan and
    /// the region would widen without end
    pub is_scanned: bool,
}

/// A scan with its touched part remeshed.
#[derive(Clone, Debug)]
pub struct PatchedMesh {
    /// untouched vertices and faces keep their ids
    pub mesh: TriMesh,
    /// the support of each vertex, by id
    pub support: Vec<Support>,
    /// standard deviation of each vertex along the normal, m, by id; none without
    /// [`crate::reconstruct::PatcherParams::uncertainty`]
    pub sigma: Vec<f64>,
    /// maximum distance of the new faces from the touched surface, m
    pub tolerance: f64,
    /// whether `tolerance` is larger than usual, as a finer lattice would not have fitted
    pub is_coarser: bool,
    /// removed faces of the scan
    pub removed_faces: usize,
    /// added faces
    pub added_faces: usize,
    /// vertices of the scan moved to touched positions, with the detail between them
    pub moved_vertices: usize,
    /// squares without a join of scan and patch
    pub open_squares: usize,
}

impl Support {
    /// Touched share: 1 touched, 0.5 guessed from touches nearby, 0 scan.
    fn touched(self) -> f32 {
        match self {
            Self::Touched => 1.0,
            Self::Guessed | Self::Unreachable => 0.5,
            Self::Scan => 0.0,
        }
    }

    /// Its number: 0 scan, 1 touched, 2 guessed, 3 out of the ball's reach.
    fn number(self) -> f32 {
        f32::from(self as u8)
    }
}

impl PatchedMesh {
    /// Columns of a file for each vertex beside its position, by id: `touched`, `support`, and
    /// `sigma_mm` if known.
    pub fn columns(&self) -> Vec<(&'static str, Vec<f32>)> {
        let of_support = |number: fn(Support) -> f32| {
            self.support
                .iter()
                .map(|&support| number(support))
                .collect()
        };
        let mut columns = vec![
            ("touched", of_support(Support::touched)),
            ("support", of_support(Support::number)),
        ];
        if !self.sigma.is_empty() {
            columns.push((
                "sigma_mm",
                self.sigma
                    .iter()
                    .map(|sigma| (sigma * 1e3) as f32)
                    .collect(),
            ));
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_vertex_has_its_columns() {
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let mesh = TriMesh::new(
            vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)],
            vec![[0, 1, 2], [0, 2, 3]],
        )
        .unwrap();
        let support = vec![
            Support::Scan,
            Support::Touched,
            Support::Guessed,
            Support::Unreachable,
        ];
        let sigma = vec![0.6e-3, 2e-6, 0.1e-3, 0.25e-3];
        let mut patched = PatchedMesh {
            mesh,
            support,
            sigma,
            tolerance: 1.0,
            is_coarser: false,
            removed_faces: 0,
            added_faces: 0,
            moved_vertices: 0,
            open_squares: 0,
        };
        let [touched, number] = [
            ("touched", vec![0.0, 1.0, 0.5, 0.5]),
            ("support", vec![0.0, 1.0, 2.0, 3.0]),
        ];
        let sigma_mm = ("sigma_mm", vec![0.6f32, 2e-3, 0.1, 0.25]);
        assert_eq!(
            patched.columns(),
            [touched.clone(), number.clone(), sigma_mm]
        );
        patched.sigma.clear();
        assert_eq!(patched.columns(), [touched, number], "without uncertainty");
    }
}
