//! Parts a mesh into segments.

use super::bodies::Bodies;
use super::borders::{borders, without_seams};
use super::facets::Facets;
use super::grow::median_edge;
use super::scene::Parted;
use super::segment::Segmentation;
use crate::mesh::{FaceTree, TriMesh};

impl<'a> Parted<'a> {
    pub fn of(mesh: &'a TriMesh, tree: &'a FaceTree) -> Self {
        let facets = Facets::of(mesh);
        let segmentation = Segmentation::of(&facets);
        let [lo, hi] = mesh.bounds();
        let edge = median_edge(&facets);
        let bodies = Bodies::of(&facets);
        let exact = segmentation.segments.iter().filter(|segment| segment.is_exact).map(|segment| segment.tolerance);
        let rounding = exact.min_by(f64::total_cmp);
        let mut parted = Self { rounding, facets, bodies, tree, segmentation, diagonal: (hi - lo).norm(), edge };
        let of_face = without_seams(&parted);
        let beside: Vec<_> = borders(&parted, &of_face).into_keys().collect();
        parted.segmentation.join_planes(&parted.facets, beside.into_iter());
        parted
    }
}
