//! Errors of a mesh against the truth, face by face.

use nalgebra::Point3;

use touchup_features::compare::angle_between;
use touchup_geometry::mesh::TriMesh;
use touchup_sim::Surface;

/// Errors of one mesh against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshErrors {
    /// mean distance error of the faces, mm
    pub distance_mm: f64,
    /// mean normal deviation of the faces, deg, up to 180
    pub normal_deg: f64,
    /// faces turned away from the truth by more than a right angle
    pub flipped: usize,
    /// distance of the farthest vertex, or of the farthest face plane if faces pair by index, mm
    pub farthest_mm: f64,
}

impl MeshErrors {
    /// The paper's metrics: face by face, |(b* − b)·n| and the angle between n* and n; `mesh` and
    /// `truth` have the same faces.
    pub fn by_index(mesh: &TriMesh, truth: &TriMesh) -> Self {
        let pairs = truth
            .faces()
            .filter(|&(face, _)| mesh.has_face(face))
            .map(|(face, _)| {
                let n = truth.normal(face);
                (
                    (mesh.barycentre(face) - truth.barycentre(face))
                        .dot(&n)
                        .abs(),
                    angle_between(&mesh.normal(face), &n),
                )
            });
        let pairs: Vec<_> = pairs.collect();
        Self::of(&pairs, pairs.iter().map(|pair| pair.0).fold(0.0, f64::max))
    }

    /// Distance of the faces' barycentres and of the vertices from the true surface, and angle to
    /// its normal there.
    pub fn by_surface(mesh: &TriMesh, truth: &dyn Surface) -> Self {
        let pairs = mesh.faces().map(|(face, _)| {
            let (b, n) = (mesh.barycentre(face), mesh.normal(face));
            let closest = truth.closest(&b);
            (
                (b - closest.point).norm(),
                angle_between(&n, &closest.normal),
            )
        });
        let far = |p: &Point3<f64>| truth.signed_distance(p).abs();
        Self::of(
            &pairs.collect::<Vec<_>>(),
            mesh.positions().iter().map(far).fold(0.0, f64::max),
        )
    }

    fn of(pairs: &[(f64, f64)], farthest: f64) -> Self {
        let mean = |value: fn(&(f64, f64)) -> f64| {
            pairs.iter().map(value).sum::<f64>() / pairs.len().max(1) as f64
        };
        let flipped = pairs
            .iter()
            .filter(|pair| pair.1 > std::f64::consts::FRAC_PI_2)
            .count();
        Self {
            distance_mm: mean(|pair| pair.0) * 1e3,
            normal_deg: mean(|pair| pair.1).to_degrees(),
            flipped,
            farthest_mm: farthest * 1e3,
        }
    }

    /// A text of one line.
    pub fn row(&self) -> String {
        let Self {
            distance_mm,
            normal_deg,
            flipped,
            farthest_mm,
        } = self;
        format!(
            "{distance_mm:8.3} mm {normal_deg:6.2} deg {flipped:3} flipped, farthest {farthest_mm:7.2} mm"
        )
    }
}
