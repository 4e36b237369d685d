//! Shafts: round walls with the material inside that are surfaces of the part, not edges smeared by
//! the scan.

use nalgebra::{Matrix3, Point3, Vector3};

use super::borders::Borders;
use super::feature::FittedTo;
use super::fit::{Plane, SurfaceModel};
use super::measure::Measure;
use super::segmentation::primitive::{FACES_ALIKE, Primitive};
use super::segmentation::segment::Segment;
use super::walls::Wall;
use touchup_geometry::mesh::FaceId;
use touchup_geometry::numeric::thinnest_direction;

/// Minimum share of a turn of a shaft: less is the rounding of an edge, which looks wider in a
/// measured mesh.
const ROUNDED_EDGE: f64 = 0.3;
const ROUNDED_EDGE_MEASURED: f64 = 0.45;
/// Minimum filled share of a shaft between its ends: the cylinder through four walls of a block has
/// few faces.
const FILLED: f64 = 0.8;
/// Number of rounds in which two planes share corners among them.
const ROUNDS: usize = 8;

/// Whether a wall has the material inside and is large enough to report. In a measured mesh an
/// untouched wall must also hold without the steps beside it, and be round.
pub(super) fn is_shaft(measure: &Measure, borders: &Borders, wall: &Wall) -> bool {
    let parted = measure.observed.parted;
    let of_wall = wall.segments.iter().map(|&number| parted.segment(number));
    let area: f64 = of_wall.map(|segment| segment.area).sum();
    let least = if parted.rounding.is_some() {
        ROUNDED_EDGE
    } else {
        ROUNDED_EDGE_MEASURED
    };
    let is_whole = |wall: &Wall| wall.coverage > least && wall.filled > FILLED;
    if !parted.is_large(area) || wall.is_concave || wall.is_cone() || !is_whole(wall) {
        return false;
    }
    if parted.rounding.is_some() || measure.cylinder(wall, None).to == FittedTo::Touches {
        return true;
    }
    let (facets, primitive) = (&parted.facets, &parted.segment(wall.segments[0]).primitive);
    let faces = without_steps(measure, borders, wall);
    let corners = faces.iter().flat_map(|&face| {
        let area = facets.area(face) / 3.0;
        facets.triangle(face).map(|corner| (corner, area))
    });
    Wall::of_faces(facets, primitive, &faces, wall.segments.clone()).is_some_and(|rest| {
        is_whole(&rest) && !is_edge(&rest, primitive, &corners.collect::<Vec<_>>())
    })
}

/// The faces of a wall without steps from touched planes to the scan beside them: those lie on the
/// planes within the tolerance of the wall, with another normal than its own.
fn without_steps(measure: &Measure, borders: &Borders, wall: &Wall) -> Vec<u32> {
    let parted = measure.observed.parted;
    let is_own = |number: u32| wall.segments.contains(&(number as usize));
    let beside = borders
        .keys()
        .filter_map(|&[a, b]| match [a, b].map(is_own) {
            [true, false] => measure.plane(b as usize),
            [false, true] => measure.plane(a as usize),
            _ => None,
        });
    let felt = beside.filter(|plane| plane.to == FittedTo::Touches);
    let felt: Vec<Plane> = felt.map(|plane| plane.surface).collect();
    let Segment {
        primitive,
        tolerance,
        ..
    } = parted.segment(wall.segments[0]);
    let is_step = |&face: &u32| {
        let middle = parted.facets.mesh.barycentre(FaceId(face));
        let (_, normal) = primitive.distance_and_normal(&middle);
        let corners = parted.facets.triangle(face);
        felt.iter().any(|plane| {
            let is_on = |p: &Point3<f64>| plane.distance(p).abs() <= *tolerance;
            plane.normal().dot(&normal) < FACES_ALIKE && corners.iter().all(is_on)
        })
    };
    let of_wall = wall
        .segments
        .iter()
        .flat_map(|&number| &parted.segment(number).faces);
    of_wall.copied().filter(|face| !is_step(face)).collect()
}

/// Whether two planes explain a wall better than its own surface: a smeared edge.
///
/// - `corners`: of its faces, m, in O, with their shares of the area, m².
fn is_edge(wall: &Wall, primitive: &Primitive, corners: &[(Point3<f64>, f64)]) -> bool {
    let across = wall.axis.cross(&wall.towards);
    let mut sides: Vec<bool> = corners
        .iter()
        .map(|(p, _)| (p - wall.origin).dot(&across) > 0.0)
        .collect();
    let mut off = f64::INFINITY;
    for _ in 0..ROUNDS {
        let on = |side: bool| {
            corners
                .iter()
                .zip(&sides)
                .filter(move |&(_, of)| *of == side)
                .map(|(corner, _)| corner)
        };
        let (Some(one), Some(other)) = (plane_through(on(true)), plane_through(on(false))) else {
            return false;
        };
        let squares = corners
            .iter()
            .map(|(p, _)| [&one, &other].map(|plane| plane.distance(p).powi(2)));
        let squares: Vec<_> = squares.collect();
        off = corners
            .iter()
            .zip(&squares)
            .map(|((_, area), [a, b])| area * a.min(*b))
            .sum();
        sides = squares.iter().map(|[a, b]| a < b).collect();
    }
    off < corners
        .iter()
        .map(|(p, area)| area * primitive.distance(p).powi(2))
        .sum()
}

/// The plane of least squares through weighted points; `None` without any.
fn plane_through<'a>(
    points: impl Iterator<Item = &'a (Point3<f64>, f64)> + Clone,
) -> Option<Plane> {
    let all: f64 = points.clone().map(|(_, weight)| weight).sum();
    let mean = points
        .clone()
        .map(|(p, weight)| p.coords * (weight / all))
        .sum::<Vector3<f64>>();
    let scatter: Matrix3<f64> = points
        .map(|(p, weight)| (p.coords - mean) * (p.coords - mean).transpose() * *weight)
        .sum();
    (all > 0.0).then(|| Plane::new(mean.into(), &thinnest_direction(scatter)))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::fit::Cylinder;
    use super::super::segmentation::facets::Facets;
    use super::super::segmentation::primitive::refined;
    use super::*;
    use touchup_geometry::mesh::TriMesh;

    /// Whether a strip of 12 mm along x, its cross-section with noise, m, is a smeared edge.
    fn is_edge_of(section: impl Fn(f64) -> [f64; 2]) -> bool {
        const SIDES: [u32; 2] = [12, 6];
        let mut random = Pcg64::seed_from_u64(1);
        let mut noise = || random.random_range(-0.5e-3..0.5e-3);
        let places = (0..=SIDES[0]).flat_map(|i| (0..=SIDES[1]).map(move |k| (i, k)));
        let positions = places.map(|(i, k)| {
            let [y, z] = section(f64::from(i) / f64::from(SIDES[0]));
            Point3::new(2e-3 * f64::from(k), y + noise(), z + noise())
        });
        let cells = (0..SIDES[0]).flat_map(|i| (0..SIDES[1]).map(move |k| i * (SIDES[1] + 1) + k));
        let faces = cells.flat_map(|a| {
            let b = a + SIDES[1] + 1;
            [[a, a + 1, b + 1], [a, b + 1, b]]
        });
        let mesh = TriMesh::new(positions.collect(), faces.collect()).unwrap();
        let (facets, faces) = (
            Facets::of(&mesh),
            (0..mesh.face_slots() as u32).collect::<Vec<_>>(),
        );
        let guess = Cylinder::new(Point3::origin(), &Vector3::x(), 4e-3, false);
        let round = refined(&Primitive::Cylinder(guess), &facets, &faces).unwrap();
        let wall = Wall::of_faces(&facets, &round, &faces, Vec::new()).unwrap();
        assert!((0.4..0.7).contains(&wall.coverage), "{}", wall.coverage);
        let corners = faces
            .iter()
            .flat_map(|&face| facets.triangle(face).map(|p| (p, facets.area(face))));
        is_edge(&wall, &round, &corners.collect::<Vec<_>>())
    }

    #[test]
    fn two_flats_with_a_blunt_corner_are_an_edge_and_a_rough_half_round_is_none() {
        // 8 mm of each flat, about a place 4 mm inside both
        assert!(is_edge_of(|t| {
            let s = 16e-3 * (t - 0.5);
            let blunt = 0.5e-3;
            [
                4e-3 - s.max(0.0) - blunt * f64::from(s == 0.0),
                4e-3 + s.min(0.0) - blunt * f64::from(s == 0.0),
            ]
        }));
        assert!(!is_edge_of(|t| {
            let (sine, cosine) = (std::f64::consts::PI * t).sin_cos();
            [4e-3 * cosine, 4e-3 * sine]
        }));
    }
}
