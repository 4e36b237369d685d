//! Angles between the faces of a mesh and the true surface.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use super::CompareError;
use super::deviation::closest_places;
use touchup_geometry::mesh::{FaceId, FaceTree, TriMesh};
use touchup_geometry::numeric::weighted_quantile;

/// The angle between the normals of a face and of the closest true face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// face of the mesh
    pub face: FaceId,
    /// 0 to π, rad
    pub angle: f64,
    /// area of the face, m²
    pub area: f64,
}

/// Statistics of a set of tilts, weighted by area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltSummary {
    /// rad
    pub median: f64,
    /// 95th percentile, rad
    pub p95: f64,
    /// share of the area with reversed normal: more than π/2
    pub flipped: f64,
}

/// The angle between two directions, rad, to full precision for any angle: atan2(|n × m|, n · m).
pub fn angle_between(n: &Vector3<f64>, m: &Vector3<f64>) -> f64 {
    n.cross(m).norm().atan2(n.dot(m))
}

/// The tilt of each face of `mesh` against the true face closest to its barycentre.
///
/// # Errors
/// [`CompareError::NoFaces`] if `truth` has none.
pub fn tilts(mesh: &TriMesh, truth: &TriMesh, tree: &FaceTree) -> Result<Vec<Tilt>, CompareError> {
    let faces: Vec<FaceId> = mesh.faces().map(|(face, _)| face).collect();
    let middles: Vec<Point3<f64>> = faces.iter().map(|&face| mesh.barycentre(face)).collect();
    let mut tilts: Vec<Tilt> = faces
        .into_iter()
        .map(|face| Tilt {
            face,
            angle: 0.0,
            area: 0.0,
        })
        .collect();
    closest_places(&middles, truth, tree, |at, hit| {
        let normal = mesh.double_area_normal(tilts[at].face);
        tilts[at].angle = angle_between(&normal, &truth.double_area_normal(hit.face));
        tilts[at].area = normal.norm() / 2.0;
    })?;
    Ok(tilts)
}

impl TiltSummary {
    /// `None` without area.
    pub(crate) fn of(tilts: &[Tilt]) -> Option<Self> {
        let mut angles: Vec<_> = tilts.iter().map(|tilt| (tilt.angle, tilt.area)).collect();
        let (median, p95) = (
            weighted_quantile(&mut angles, 0.5)?,
            weighted_quantile(&mut angles, 0.95)?,
        );
        let total: f64 = angles.iter().map(|(_, area)| area).sum();
        let flipped = angles
            .iter()
            .filter(|(angle, _)| *angle > FRAC_PI_2)
            .fold(0.0, |sum, (_, area)| sum + area);
        (total > 0.0).then(|| Self {
            median,
            p95,
            flipped: flipped / total,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_angles_keep_their_digits() {
        let x = Vector3::x();
        for angle in [1e-9, 0.3, 3.1] {
            let turned = Vector3::new(f64::cos(angle), f64::sin(angle), 0.0);
            assert!(
                (angle_between(&x, &(turned * 7.0)) - angle).abs() < 1e-15,
                "{angle}"
            );
        }
        assert_eq!(angle_between(&x, &-x), std::f64::consts::PI);
    }

    #[test]
    fn faces_count_by_area() {
        let tilt = |face, angle, area| Tilt {
            face: FaceId(face),
            angle,
            area,
        };
        let found =
            TiltSummary::of(&[tilt(0, 0.1, 6.0), tilt(1, 2.0, 1.0), tilt(2, 0.2, 3.0)]).unwrap();
        assert_eq!(
            found,
            TiltSummary {
                median: 0.1,
                p95: 2.0,
                flipped: 0.1
            }
        );
        assert_eq!(TiltSummary::of(&[]), None);
    }
}
