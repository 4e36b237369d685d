//! Clusters of high curvature: candidate features, before their classification.
//!
//! [`paper_clusters`] is the method of the paper this crate follows; [`clusters`] determines their
//! number itself.

use nalgebra::{Point3, Vector3};

pub use super::creases::Bend;
use super::creases::Creases;
use super::curvature::VertexCurvature;
use super::k_means::k_means;
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_geometry::numeric::distinct;

/// Vertices of one cluster.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Mean of the vertices ([`paper_clusters`]) or of the creases by their length ([`clusters`]),
    /// m, in O.
    pub center: Point3<f64>,
    /// In rising order.
    pub vertices: Vec<VertexId>,
    /// Sign of the bend; `None` from [`paper_clusters`], which does not report it.
    pub bend: Option<Bend>,
}

/// Settings of [`paper_clusters`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperParams {
    /// Threshold of the absolute Gaussian curvature of marked vertices, 1/m².
    pub threshold: f64,
    /// Number of clusters.
    pub k: usize,
    /// Seed of k-means.
    pub seed: u64,
}

impl Default for PaperParams {
    /// 0.3 and 5, as printed. The paper gives no unit; its parts are in mm, hence 0.3/mm² here. It
    /// leaves open the area that divides a defect, whether depressions with K < 0 count (here they
    /// do: |K|), and the start of k-means.
    fn default() -> Self {
        Self {
            threshold: 0.3e6,
            k: 5,
            seed: 0,
        }
    }
}

/// k-means of the vertices above a threshold of Gaussian curvature; largest clusters first. Depends
/// on the density of the mesh, since at an edge or corner the curvature grows as the faces shrink.
///
/// - `curvature`: of `mesh`, from [`super::curvature::curvature`]
pub fn paper_clusters(
    mesh: &TriMesh,
    curvature: &[VertexCurvature],
    params: &PaperParams,
) -> Vec<Cluster> {
    let is_marked = |(_, c): &(usize, &VertexCurvature)| c.gaussian().abs() > params.threshold;
    let marked: Vec<_> = curvature
        .iter()
        .enumerate()
        .filter(is_marked)
        .map(|(v, _)| VertexId(v as u32))
        .collect();
    let points: Vec<_> = marked.iter().map(|&v| mesh.position(v)).collect();
    let found = k_means(&points, params.k, params.seed);
    let cluster = |center: &Point3<f64>| Cluster {
        center: *center,
        vertices: Vec::new(),
        bend: None,
    };
    let mut clusters: Vec<_> = found.centers.iter().map(cluster).collect();
    marked
        .iter()
        .zip(&found.labels)
        .for_each(|(v, label)| clusters[*label as usize].vertices.push(*v));
    clusters.retain(|cluster| !cluster.vertices.is_empty());
    clusters.sort_by_key(|cluster| std::cmp::Reverse(cluster.vertices.len()));
    clusters
}

/// Settings of [`clusters`]; none has a unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterParams {
    /// Minimum turn between the faces of a crease, rad: more than the facets of a round hole of 12
    /// sides (30°) and the noise of a scan, less than a chamfer (45°).
    pub sharp_angle: f64,
    /// Minimum absolute angle defect of a vertex without a crease, rad: the tip of a cone, a pit.
    /// Noise of a tenth of the edges makes defects of 0.3 rad.
    pub sharp_defect: f64,
    /// Distance, as a share of the diagonal of the box around the mesh, below which creases of one
    /// kind are one cluster, and minimum length of a crease: bridges gaps and drops specks from
    /// noise.
    pub merge_share: f64,
}

impl Default for ClusterParams {
    fn default() -> Self {
        Self {
            sharp_angle: 35f64.to_radians(),
            sharp_defect: 0.6,
            merge_share: 1e-3,
        }
    }
}

/// Connected creases of one kind, and single sharp vertices; in order of their lowest vertex.
///
/// A crease keeps its angle and a sharp vertex its defect when the faces are split, so the number
/// of clusters depends on neither the density of the mesh nor the unit. Connected means along
/// creases: edges of a wall would join two rims of a hole, but carry no information. Rims of an
/// open mesh do not count.
///
/// - `curvature`: of `mesh`, from [`super::curvature::curvature`]
pub fn clusters(
    mesh: &TriMesh,
    curvature: &[VertexCurvature],
    params: &ClusterParams,
) -> Vec<Cluster> {
    let creases = Creases::find(mesh, curvature, params.sharp_angle, params.sharp_defect);
    let [low, high] = mesh.bounds();
    let near = params.merge_share * (high - low).norm();
    let mut regions = creases.connected();
    creases.merge(&mut regions, mesh, near);
    let mut parts: Vec<(u32, usize)> = (0..creases.list.len())
        .map(|i| (regions.root(i as u32), i))
        .collect();
    parts.sort_unstable();
    let mut clusters: Vec<_> = parts
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|part| cluster_of(mesh, &creases, part, near))
        .collect();
    clusters.sort_by(|a, b| a.vertices.cmp(&b.vertices));
    clusters
}

/// The cluster of some creases; `None` if they are no longer than `least`. A single sharp vertex
/// always counts.
fn cluster_of(
    mesh: &TriMesh,
    creases: &Creases,
    part: &[(u32, usize)],
    least: f64,
) -> Option<Cluster> {
    let list = || part.iter().map(|&(_, i)| &creases.list[i]);
    let (mut sum, mut length) = (Vector3::zeros(), 0.0);
    for ends in list().map(|crease| crease.ends.map(|v| mesh.position(v))) {
        let own = (ends[1] - ends[0]).norm();
        sum += nalgebra::center(&ends[0], &ends[1]).coords * own;
        length += own;
    }
    let vertices = distinct(list().flat_map(|crease| crease.ends));
    let has_point = list().any(|crease| crease.ends[0] == crease.ends[1]);
    if length <= least && !has_point {
        return None;
    }
    let center = if length > 0.0 {
        (sum / length).into()
    } else {
        mesh.position(vertices[0])
    };
    Some(Cluster {
        center,
        vertices,
        bend: list().next().map(|crease| crease.bend),
    })
}
