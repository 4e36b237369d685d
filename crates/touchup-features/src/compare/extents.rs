//! Checks whether two meshes can belong to one part, by their bounding boxes.

use std::fmt;

use touchup_geometry::mesh::TriMesh;

/// Plausible ratio of the diagonals: a scan may show a fraction of the part.
const PLAUSIBLE: std::ops::Range<f64> = 0.125..8.0;

/// Maximum distance of boxes at one place, as a share of the truth's diagonal: a thin scan may lie
/// above it.
const BESIDE: f64 = 0.1;

/// Evidence against two meshes of one part, in one unit and one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UnlikeExtents {
    /// Ratio of the first diagonal to the second.
    Size(f64),
    /// Distance between the boxes, m.
    Apart(f64),
}

impl UnlikeExtents {
    /// `None` for plausible boxes.
    pub fn of(mesh: &TriMesh, truth: &TriMesh) -> Option<Self> {
        let ([low, high], [true_low, true_high]) = (mesh.bounds(), truth.bounds());
        let true_diagonal = (true_high - true_low).norm();
        let ratio = (high - low).norm() / true_diagonal;
        if !PLAUSIBLE.contains(&ratio) {
            return Some(Self::Size(ratio));
        }
        let gap = (true_low - high)
            .sup(&(low - true_high))
            .sup(&nalgebra::Vector3::zeros())
            .norm();
        (gap > BESIDE * true_diagonal).then_some(Self::Apart(gap))
    }
}

/// Evidence in words, for a mesh and its truth; without a remedy.
impl fmt::Display for UnlikeExtents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size(ratio) if ratio > 1.0 => {
                write!(f, "the mesh is {ratio:.1} times larger than the truth")
            }
            Self::Size(ratio) => write!(
                f,
                "the mesh is {:.1} times smaller than the truth",
                1.0 / ratio
            ),
            Self::Apart(gap) => write!(f, "the mesh lies {:.1} mm beside the truth", gap * 1e3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// A triangle with legs of `size` m from `x` on.
    fn triangle(x: f64, size: f64) -> TriMesh {
        let corners = [[x, 0.0, 0.0], [x + size, 0.0, 0.0], [x, size, 0.0]];
        TriMesh::new(corners.map(Point3::from).to_vec(), vec![[0, 1, 2]]).unwrap()
    }

    #[test]
    fn another_unit_and_another_place_are_seen_and_a_part_of_the_part_is_not() {
        let truth = triangle(0.0, 1.0);
        assert_eq!(UnlikeExtents::of(&triangle(0.5, 0.25), &truth), None);
        assert_eq!(UnlikeExtents::of(&triangle(1.1, 1.0), &truth), None);
        assert_eq!(
            UnlikeExtents::of(&triangle(0.0, 1e3), &truth),
            Some(UnlikeExtents::Size(1e3))
        );
        assert_eq!(
            UnlikeExtents::of(&triangle(3.0, 1.0), &truth),
            Some(UnlikeExtents::Apart(2.0))
        );
        assert_eq!(
            UnlikeExtents::of(&triangle(-3.0, 1.0), &truth),
            Some(UnlikeExtents::Apart(2.0))
        );
        let words = [UnlikeExtents::Size(0.001), UnlikeExtents::Apart(0.002)]
            .map(|unlike| unlike.to_string());
        assert_eq!(
            words,
            [
                "the mesh is 1000.0 times smaller than the truth",
                "the mesh lies 2.0 mm beside the truth"
            ]
        );
    }
}
