//! Sharp edges of a mesh, and their connections.

use nalgebra::Vector3;

use super::curvature::{VertexCurvature, VertexKind};
use super::facets::Facets;
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_geometry::numeric::{DisjointSets, voxel_neighbourhood, voxel_of};

/// Maximum number of points on all creases together, beside one for each: bounds the work on meshes
/// of pure noise.
const MOST_POINTS: f64 = 1e6;

/// Sign of the bend: convex or concave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bend {
    /// Outward, as the rim of a hole.
    Convex,
    /// Inward, as the bottom of a pocket along its wall.
    Concave,
}

/// A sharp edge, or a sharp vertex as an edge without length.
#[derive(Clone, Copy, Debug)]
pub(in crate::features) struct Crease {
    pub ends: [VertexId; 2],
    pub bend: Bend,
}

/// All creases of a mesh, in order of their faces; single vertices last.
#[derive(Clone, Debug)]
pub(in crate::features) struct Creases {
    pub list: Vec<Crease>,
}

impl Creases {
    /// - `sharp_angle`, `sharp_defect`: as in [`super::clusters::ClusterParams`], rad.
    pub(crate) fn find(
        mesh: &TriMesh,
        curvature: &[VertexCurvature],
        sharp_angle: f64,
        sharp_defect: f64,
    ) -> Self {
        let facets = Facets::of(mesh);
        let (mut list, mut has_crease) = (Vec::new(), vec![false; mesh.vertex_slots()]);
        let cos_sharp = sharp_angle.cos();
        for (face, corners) in mesh.faces() {
            for (edge, other) in facets.beside(face.0) {
                let ends = [corners[edge], corners[(edge + 1) % 3]];
                let (n, m) = (facets.normal(face.0), facets.normal(other));
                // once for each edge: the other face runs along it in the opposite direction
                if ends[0] < ends[1]
                    && n.dot(&m) < cos_sharp
                    && n != Vector3::zeros()
                    && m != Vector3::zeros()
                {
                    let along = mesh.position(ends[1]) - mesh.position(ends[0]);
                    let bend = if n.cross(&m).dot(&along) > 0.0 {
                        Bend::Convex
                    } else {
                        Bend::Concave
                    };
                    ends.iter().for_each(|v| has_crease[v.0 as usize] = true);
                    list.push(Crease { ends, bend });
                }
            }
        }
        let is_sharp =
            |c: &VertexCurvature| c.kind == VertexKind::Inner && c.defect.abs() > sharp_defect;
        for (v, c) in curvature
            .iter()
            .enumerate()
            .filter(|(v, c)| is_sharp(c) && !has_crease[*v])
        {
            let bend = if c.integrated_mean >= 0.0 {
                Bend::Convex
            } else {
                Bend::Concave
            };
            list.push(Crease {
                ends: [VertexId(v as u32); 2],
                bend,
            });
        }
        Self { list }
    }

    /// Creases of one kind that share a vertex, as sets.
    pub(crate) fn connected(&self) -> DisjointSets {
        let mut regions = DisjointSets::of(self.list.len());
        let ends =
            |(i, crease): (usize, &Crease)| crease.ends.map(|v| ((crease.bend, v), i as u32));
        let mut at_vertex: Vec<_> = self.list.iter().enumerate().flat_map(ends).collect();
        join_equal(&mut regions, &mut at_vertex);
        regions
    }

    /// Joins creases of one kind with points in one cell of a grid of size `near`, or in adjacent
    /// cells: all that are closer than `near`, none that are farther than 2√3 times that.
    pub(crate) fn merge(&self, regions: &mut DisjointSets, mesh: &TriMesh, near: f64) {
        let lengths = |crease: &Crease| {
            (mesh.position(crease.ends[1]) - mesh.position(crease.ends[0])).norm()
        };
        let spacing = (near / 2.0).max(self.list.iter().map(lengths).sum::<f64>() / MOST_POINTS);
        if !(spacing > 0.0 && spacing.is_finite()) {
            return;
        }
        let [low, _] = mesh.bounds();
        let mut in_cell = Vec::new();
        for (i, crease) in self.list.iter().enumerate() {
            let [a, b] = crease.ends.map(|v| mesh.position(v));
            let parts = ((b - a).norm() / spacing).ceil().max(1.0) as u32;
            in_cell.extend((0..=parts).map(|part| {
                let p = a + (b - a) * (f64::from(part) / f64::from(parts));
                ((crease.bend, voxel_of(&(p - low).into(), near)), i as u32)
            }));
        }
        join_equal(regions, &mut in_cell);
        in_cell.dedup_by_key(|(key, _)| *key);
        for &((bend, voxel), crease) in &in_cell {
            // half of the 26 around; the others see this one
            for near in voxel_neighbourhood(voxel).skip(14) {
                if let Ok(at) = in_cell.binary_search_by_key(&(bend, near), |(key, _)| *key) {
                    regions.join(crease, in_cell[at].1);
                }
            }
        }
    }
}

/// Sorts by key and joins equal keys.
fn join_equal<K: Ord + Copy>(sets: &mut DisjointSets, keyed: &mut [(K, u32)]) {
    keyed.sort_unstable();
    for pair in keyed.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        sets.join(pair[0].1, pair[1].1);
    }
}
