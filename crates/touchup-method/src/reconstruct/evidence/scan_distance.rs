//! Signed distance of the scan at a point.

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{FaceTree, TriMesh, is_on_rim, pseudo_normal};

/// Signed distance and foot on the scan for one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScanDistance {
    /// signed distance, m: positive outside
    pub value: f64,
    /// unit normal of the scan at the foot
    pub normal: Vector3<f64>,
    /// closest point of the scan, m, in O
    pub foot: Point3<f64>,
    /// the foot lies on an open rim: beyond it the scan has no value
    pub is_on_rim: bool,
}

impl ScanDistance {
    /// Signed distance and foot of `scan` at `x` (m, in O); `None` without a face.
    pub(crate) fn at(scan: &TriMesh, tree: &FaceTree, x: &Point3<f64>) -> Option<Self> {
        let hit = tree.closest(scan, x, f64::INFINITY)?;
        let normal = pseudo_normal(scan, &hit);
        let is_behind = (x - hit.point).dot(&normal) < 0.0;
        let distance = hit.distance_squared.sqrt();
        let value = if is_behind { -distance } else { distance };
        Some(Self {
            value,
            normal,
            foot: hit.point,
            is_on_rim: is_on_rim(scan, &hit),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rim_of_an_open_sheet_is_distinguished_from_its_inside() {
        // four triangles around a middle vertex
        let p = [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5, 0.5]]
            .map(|[x, y]| Point3::new(x, y, 0.0));
        let sheet =
            TriMesh::new(p.into(), vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]).unwrap();
        let tree = FaceTree::new(&sheet);
        let at = |x, y, z| ScanDistance::at(&sheet, &tree, &Point3::new(x, y, z)).unwrap();
        assert_eq!(
            (at(0.5, 0.5, 0.2).value, at(0.5, 0.5, -0.2).value),
            (0.2, -0.2)
        );
        assert!(!at(0.5, 0.5, 0.2).is_on_rim, "above the middle vertex");
        assert!(!at(0.25, 0.25, 0.2).is_on_rim, "above an inner edge");
        assert!(
            at(0.5, -0.2, 0.0).is_on_rim && at(-1.0, -1.0, 0.0).is_on_rim,
            "beyond an edge, beyond a corner"
        );
    }
}
