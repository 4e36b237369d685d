//! The scan with its touched part remeshed, with support and uncertainty of each vertex.

use crate::mesh::TriMesh;

/// The evidence for a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Support {
    /// the scan
    #[default]
    Scan,
    /// touches
    Touched,
    /// what touches, free space and scan nearby suggest; nothing was touched here
    Guessed,
    /// as that, and nothing can be touched here: the ball does not go so far into an inner corner, or into what is narrower
    Unreachable,
}

/// A scan with its touched part remeshed.
#[derive(Clone, Debug)]
pub struct Patched {
    /// vertices and faces that were not touched keep their ids
    pub mesh: TriMesh,
    /// the support of each vertex, by id
    pub support: Vec<Support>,
    /// standard deviation of each vertex along the normal, m, by id; none without [`crate::reconstruct::PatcherParams::uncertainty`]
    pub sigma: Vec<f64>,
    /// edge length of the lattice, m
    pub pitch: f64,
    /// faces of the scan that were removed
    pub removed_faces: usize,
    /// faces that were added
    pub added_faces: usize,
    /// squares on which scan and patch could not be joined
    pub open_squares: usize,
}

impl Support {
    /// How much of it was touched: 1 touched, 0.5 guessed from touches nearby, 0 scan.
    fn touched(self) -> f32 {
        match self {
            Self::Touched => 1.0,
            Self::Guessed | Self::Unreachable => 0.5,
            Self::Scan => 0.0,
        }
    }

    /// Its number: 0 scan, 1 touched, 2 guessed, 3 out of the ball's reach.
    fn number(self) -> f32 {
        match self {
            Self::Scan => 0.0,
            Self::Touched => 1.0,
            Self::Guessed => 2.0,
            Self::Unreachable => 3.0,
        }
    }
}

impl Patched {
    /// Columns of a file for each vertex beside its position, by id: `touched`, `support`, and `sigma_mm` where that is known.
    pub fn columns(&self) -> Vec<(&'static str, Vec<f32>)> {
        let of_support = |number: fn(Support) -> f32| self.support.iter().map(|&support| number(support)).collect();
        let mut columns = vec![("touched", of_support(Support::touched)), ("support", of_support(Support::number))];
        if !self.sigma.is_empty() {
            columns.push(("sigma_mm", self.sigma.iter().map(|sigma| (sigma * 1e3) as f32).collect()));
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn each_vertex_has_its_columns() {
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let mesh = TriMesh::new(vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)], vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let support = vec![Support::Scan, Support::Touched, Support::Guessed, Support::Unreachable];
        let sigma = vec![0.6e-3, 2e-6, 0.1e-3, 0.25e-3];
        let mut patched =
            Patched { mesh, support, sigma, pitch: 1.0, removed_faces: 0, added_faces: 0, open_squares: 0 };
        let [touched, number] = [("touched", vec![0.0, 1.0, 0.5, 0.5]), ("support", vec![0.0, 1.0, 2.0, 3.0])];
        let sigma_mm = ("sigma_mm", vec![0.6f32, 2e-3, 0.1, 0.25]);
        assert_eq!(patched.columns(), [touched.clone(), number.clone(), sigma_mm]);
        patched.sigma.clear();
        assert_eq!(patched.columns(), [touched, number], "without uncertainty");
    }
}
