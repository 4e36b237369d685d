//! Signed distance of a point from a mesh.
//!
//! The sign is that of (p − c)·ñ, with the closest point c of the mesh and the *pseudo-normal* ñ
//! there: the normal of the face, the sum of the normals of the faces at the edge, or the sum of
//! the normals at the corner, weighted by the angle of each face there. On a closed mesh this sign
//! is right for every point \[Bærentzen Aanæs 2005\]; beyond the rims of an open one it continues
//! the nearest face.

use nalgebra::{Point3, Vector3};

use super::{FaceHit, FaceTree, TriMesh, VertexId};

/// Signed distance from `p` to the mesh, m: positive outside, negative in the material; `None` if
/// no face is nearer than `reach` (m).
pub fn signed_distance(
    mesh: &TriMesh,
    tree: &FaceTree,
    p: &Point3<f64>,
    reach: f64,
) -> Option<f64> {
    let hit = tree.closest(mesh, p, reach)?;
    let is_behind = (p - hit.point).dot(&pseudo_normal(mesh, &hit)) < 0.0;
    Some(hit.distance_squared.sqrt() * if is_behind { -1.0 } else { 1.0 })
}

/// Outward unit pseudo-normal of the mesh at a closest point; zero if the faces there have no area.
///
/// - `hit`: from [`FaceTree::closest`], whose barycentric coordinates are exactly 0 on edges and
///   corners.
pub fn pseudo_normal(mesh: &TriMesh, hit: &FaceHit) -> Vector3<f64> {
    let corners = mesh.corners(hit.face);
    let mut on = (0..3)
        .filter(|&i| hit.barycentric[i] != 0.0)
        .map(|i| corners[i]);
    let sum = match (on.next(), on.next(), on.next()) {
        (Some(corner), None, None) => corner_normal(mesh, corner),
        (Some(a), Some(b), None) => mesh.faces_at_edge(a, b).map(|face| mesh.normal(face)).sum(),
        _ => mesh.normal(hit.face),
    };
    sum.try_normalize(f64::EPSILON)
        .unwrap_or_else(|| mesh.normal(hit.face))
}

/// Sum of the normals of the faces around a vertex, each times its angle there (rad).
pub fn corner_normal(mesh: &TriMesh, vertex: VertexId) -> Vector3<f64> {
    let apex = mesh.position(vertex);
    let weighted = mesh.star(vertex).iter().map(|&face| {
        let [u, v] = mesh
            .other_corners(face, vertex)
            .map(|corner| mesh.position(corner) - apex);
        mesh.normal(face) * u.angle(&v)
    });
    weighted.sum()
}

/// Whether a closest point lies on an edge of a single face.
pub fn is_on_rim(mesh: &TriMesh, hit: &FaceHit) -> bool {
    let corners = mesh.corners(hit.face);
    let is_open = |a: VertexId, b: VertexId| mesh.faces_at_edge(a, b).nth(1).is_none();
    let mut on = (0..3)
        .filter(|&i| hit.barycentric[i] != 0.0)
        .map(|i| corners[i]);
    match (on.next(), on.next(), on.next()) {
        (Some(corner), None, None) => {
            let mut around = mesh
                .star(corner)
                .iter()
                .flat_map(|&face| mesh.corners(face));
            around.any(|other| other != corner && is_open(corner, other))
        }
        (Some(a), Some(b), None) => is_open(a, b),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A needle on its side: the apex at the origin, the other end a triangle at x = 1, normals
    /// outward.
    fn needle() -> TriMesh {
        let end = [(0.2, 0.0), (-0.1, 0.1), (-0.1, -0.1)].map(|(y, z)| Point3::new(1.0, y, z));
        let positions = [vec![Point3::origin()], end.into()].concat();
        TriMesh::new(positions, vec![[1, 2, 3], [0, 2, 1], [0, 3, 2], [0, 1, 3]]).unwrap()
    }

    #[test]
    fn a_point_beyond_a_sharp_apex_is_outside_whichever_face_is_named() {
        let mesh = needle();
        let tree = FaceTree::new(&mesh);
        // seen from the apex, each point lies behind some of the three faces
        for (y, z) in [
            (0.0, 0.0),
            (0.3, 0.0),
            (-0.3, 0.3),
            (-0.3, -0.3),
            (0.1, 0.4),
        ] {
            let p = Point3::new(-1.0, y, z);
            let d = signed_distance(&mesh, &tree, &p, f64::INFINITY).unwrap();
            assert!((d - p.coords.norm()).abs() < 1e-15, "{d} at {p}");
        }
        assert!(signed_distance(&mesh, &tree, &Point3::new(0.9, 0.0, 0.0), 1.0).unwrap() < 0.0);
        assert_eq!(
            signed_distance(&mesh, &tree, &Point3::new(-1.0, 0.0, 0.0), 0.9),
            None
        );
    }

    #[test]
    fn a_corner_weights_its_faces_by_angle() {
        // the corner of a cube at the origin, with its faces in one, one and two triangles: x, y
        // and z have the same weight
        let p = [
            [0., 0., 0.],
            [-1., 0., 0.],
            [0., -1., 0.],
            [0., 0., -1.],
            [-1., -1., 0.],
        ]
        .map(Point3::from);
        let mesh =
            TriMesh::new(p.into(), vec![[0, 2, 3], [0, 3, 1], [0, 1, 4], [0, 4, 2]]).unwrap();
        let normal = corner_normal(&mesh, VertexId(0)).normalize();
        assert!(
            (normal - Vector3::repeat(1.0 / 3.0_f64.sqrt())).norm() < 1e-15,
            "{normal}"
        );
    }
}
