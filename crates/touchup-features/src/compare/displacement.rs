//! Displacement of a surface between two refinements of a scan, and its significance against their
//! uncertainties.

use nalgebra::{Point3, Vector3};

use super::CompareError;
use super::comparison::IndexedMesh;
use super::deviation::{at_closest_places, signed};
use touchup_geometry::mesh::{FaceHit, TriMesh, VertexId, Workers};

/// Displacement along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// from the first surface to the second, m; positive: outwards, more material
    pub distance: f64,
    /// the larger standard deviation of the two surfaces there, m; `None` if neither is known
    pub sigma: Option<f64>,
}

impl Displacement {
    /// Bound of a significant displacement, m: `k` standard deviations; 0 if none is known.
    pub fn plus_minus(&self, k: f64) -> f64 {
        self.sigma.map_or(0.0, |sigma| k * sigma)
    }

    /// Whether the displacement exceeds `k` standard deviations.
    pub fn is_moved(&self, k: f64) -> bool {
        self.distance.abs() > self.plus_minus(k)
    }
}

/// The surface that owns the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplacedFrom {
    /// the first
    Before,
    /// the second
    After,
}

/// Displacement of each vertex slot of a mesh, along the normal of the first, if both share
/// vertices and faces; else `None`.
///
/// - `sigmas`: standard deviation of each vertex slot, m, of both.
pub fn displacements_by_vertex(
    before: &TriMesh,
    after: &TriMesh,
    sigmas: [Option<&[f64]>; 2],
) -> Option<Vec<Displacement>> {
    let is_same = before.vertex_slots() == after.vertex_slots() && before.faces().eq(after.faces());
    if !is_same {
        return None;
    }
    let mut normals = vec![Vector3::zeros(); before.vertex_slots()];
    for (face, corners) in before.faces() {
        let normal = before.double_area_normal(face);
        corners
            .into_iter()
            .for_each(|corner| normals[corner.0 as usize] += normal);
    }
    let places = before
        .positions()
        .iter()
        .zip(after.positions())
        .zip(&normals)
        .enumerate();
    let displaced = places.map(|(at, ((p, q), normal))| {
        let distance = normal
            .try_normalize(0.0)
            .map_or(0.0, |normal| (q - p).dot(&normal));
        let of = |sigma: &[f64]| sigma.get(at).copied();
        Displacement {
            distance,
            sigma: larger(sigmas.map(|sigma| sigma.and_then(of))),
        }
    });
    Some(displaced.collect())
}

/// Displacement at each vertex slot of one of two meshes, to the nearest place of the other
/// surface.
///
/// - `shape`: the mesh of the vertices; `sigma`: standard deviation of each, m.
/// - `other`: the other surface; `other_sigma`: of its vertices, m, interpolated between them.
///
/// # Errors
/// [`CompareError::NoFaces`] if the other one has none.
pub fn displacements_to_surface(
    shape: &TriMesh,
    sigma: Option<&[f64]>,
    from: DisplacedFrom,
    other: IndexedMesh<'_>,
    other_sigma: Option<&[f64]>,
    workers: &dyn Workers,
) -> Result<Vec<Displacement>, CompareError> {
    let there = |hit: &FaceHit, sigma: &[f64]| {
        let corners = other.mesh.corners(hit.face);
        let shares = corners.iter().zip(&hit.barycentric);
        shares
            .map(|(corner, share)| sigma.get(corner.0 as usize).map(|sigma| sigma * share))
            .sum::<Option<f64>>()
    };
    let places: Vec<Point3<f64>> = shape.positions().to_vec();
    let found = at_closest_places(&places, other.mesh, other.tree, workers, |p, hit| {
        let off = signed(p, other.mesh, hit);
        let distance = if from == DisplacedFrom::Before {
            -off
        } else {
            off
        };
        (distance, other_sigma.and_then(|sigma| there(hit, sigma)))
    })?;
    let own = |at: usize| sigma.and_then(|sigma| sigma.get(at).copied());
    let displaced = found.into_iter().enumerate();
    Ok(displaced
        .map(|(at, (distance, sigma))| Displacement {
            distance,
            sigma: larger([own(at), sigma]),
        })
        .collect())
}

/// `None` if neither is known.
fn larger(sigmas: [Option<f64>; 2]) -> Option<f64> {
    sigmas.into_iter().flatten().reduce(f64::max)
}

/// Number of moved vertices among those present in a mesh.
pub fn moved_count(mesh: &TriMesh, displacements: &[Displacement], k: f64) -> usize {
    let is_moved = |(at, one): &(usize, &Displacement)| {
        mesh.has_vertex(VertexId(*at as u32)) && one.is_moved(k)
    };
    displacements.iter().enumerate().filter(is_moved).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_geometry::mesh::{FaceTree, SerialWorkers};

    /// A square of 4 × 4 cells of 1 mm at height `z` (m) of each vertex, by column and row.
    fn sheet(z: impl Fn(usize, usize) -> f64, is_turned: bool) -> TriMesh {
        let at = |x: usize, y: usize| Point3::new(x as f64 * 1e-3, y as f64 * 1e-3, z(x, y));
        let vertices = (0..25).map(|n| at(n % 5, n / 5)).collect();
        let faces = (0..16).flat_map(|n| {
            let v = (n / 4 * 5 + n % 4) as u32;
            if is_turned {
                [[v, v + 1, v + 5], [v + 1, v + 6, v + 5]]
            } else {
                [[v, v + 1, v + 6], [v, v + 6, v + 5]]
            }
        });
        TriMesh::new(vertices, faces.collect()).unwrap()
    }

    /// A sheet that rises by 0.01 mm for each column, known to ± 0.02 mm (k = 2): by hand, the
    /// columns 3 and 4 rise by more.
    #[test]
    fn vertices_that_rise_by_more_than_their_plus_minus_are_counted() {
        let flat = sheet(|_, _| 0.0, false);
        let raised = sheet(|x, _| x as f64 * 1e-5, false);
        let (fine, coarse) = (vec![0.5e-5; 25], vec![1e-5; 25]);
        let sigmas = [Some(&fine[..]), Some(&coarse[..])];
        let moved = displacements_by_vertex(&flat, &raised, sigmas).unwrap();
        assert_eq!(moved_count(&flat, &moved, 2.0), 10);
        assert_eq!(
            moved
                .iter()
                .map(|one| one.sigma.unwrap())
                .fold(0.0, f64::max),
            1e-5,
            "the larger of both"
        );
        assert!((moved[4].distance - 4e-5).abs() < 1e-15);
        let sunk = displacements_by_vertex(&raised, &flat, sigmas).unwrap();
        assert!(sunk[4].distance < 0.0, "back again there is less material");
        assert!(
            displacements_by_vertex(&flat, &sheet(|_, _| 0.0, true), sigmas).is_none(),
            "other faces"
        );
    }

    /// The same by the nearest place of a sheet with other faces: parallel to it all vertices rise
    /// equally.
    #[test]
    fn where_the_faces_differ_the_nearest_surface_counts_and_outwards_is_outwards_from_both() {
        let (low, high) = (sheet(|_, _| 0.0, false), sheet(|_, _| 3e-5, true));
        let trees = [&low, &high].map(FaceTree::new);
        let [low_shape, high_shape] =
            [(&low, &trees[0]), (&high, &trees[1])].map(|(mesh, tree)| IndexedMesh { mesh, tree });
        // known to ± 0.02 mm in the two columns on the left, to ± 0.04 mm on the right
        let sigma: Vec<f64> = (0..25)
            .map(|n| if n % 5 < 2 { 1e-5 } else { 2e-5 })
            .collect();
        let from_low = displacements_to_surface(
            &low,
            Some(&sigma),
            DisplacedFrom::Before,
            high_shape,
            None,
            &SerialWorkers,
        )
        .unwrap();
        let from_high = displacements_to_surface(
            &high,
            None,
            DisplacedFrom::After,
            low_shape,
            Some(&sigma),
            &SerialWorkers,
        )
        .unwrap();
        for displaced in [from_low, from_high] {
            assert!(
                displaced
                    .iter()
                    .all(|one| (one.distance - 3e-5).abs() < 1e-15),
                "{displaced:?}"
            );
            assert_eq!(moved_count(&low, &displaced, 2.0), 10);
        }
        let unknown = displacements_to_surface(
            &low,
            None,
            DisplacedFrom::Before,
            high_shape,
            None,
            &SerialWorkers,
        )
        .unwrap();
        assert_eq!(
            moved_count(&low, &unknown, 2.0),
            25,
            "where nothing is known all that lies elsewhere is moved"
        );
    }
}
