//! Surface around a flag with an opening in it. After a visit of the ball the mesh is open there,
//! and its place nearest to the flag is on a wall or the floor of the opening.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point2, Point3, Unit, Vector3};

use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::{mean, scatter, thinnest_direction, turned_to};

/// Rings around the flag in the search for the surface: the wall of an opening is searched no
/// farther than the last, 12 mm.
const RINGS: usize = 8;
/// Directions of each ring.
const DIRECTIONS: usize = 24;
/// Maximum height above the flag, or depth below it, of the surface around it, m.
const NEAR: f64 = 20e-3;
/// Maximum distance of a plane's places from it, m: a scan is off by that much beside a hole that
/// it has closed.
const ON_PLANE: f64 = 1e-3;
/// Minimum share of a ring's places on the plane of a surface: a hole may lie at the edge of a
/// part.
const ENOUGH: f64 = 0.6;
/// Cosine of the maximum lean of the surface from the expected normal: 25°.
const ALIKE: f64 = 0.9;
/// Depth below the surface beyond which a place is in the opening, m: half of the default height of
/// a search's start above the surface.
const IN_OPENING: f64 = 1.5e-3;

/// Places of a ring, seen from outside along the normal, in the frame of the flag; `None` if open.
type OpeningRing = [Option<Point3<f64>>; DIRECTIONS];

/// A plane in the frame of the flag.
#[derive(Clone, Copy)]
struct LevelPlane {
    point: Point3<f64>,
    normal: Unit<Vector3<f64>>,
}

impl LevelPlane {
    fn through([a, b, c]: [Point3<f64>; 3]) -> Option<Self> {
        let normal = (b - a).cross(&(c - a));
        let normal = Unit::try_new(normal * normal.z.signum(), 0.0)?;
        (normal.z > ALIKE).then_some(Self { point: a, normal })
    }

    fn off(&self, place: &Point3<f64>) -> f64 {
        (place - self.point).dot(&self.normal)
    }

    fn has(&self, place: &&Point3<f64>) -> bool {
        self.off(place).abs() < ON_PLANE
    }

    /// Height above the flag, m.
    fn above_flag(&self) -> f64 {
        -self.off(&Point3::origin()) / self.normal.z
    }

    /// Plane of most places of a ring, if they are enough.
    fn of_ring(ring: &OpeningRing) -> Option<Self> {
        let count = |plane: &Self| {
            ring.iter()
                .flatten()
                .filter(|place| plane.has(place))
                .count()
        };
        // three places a third of a turn apart, or, beside an edge, a quarter
        let hypotheses = [DIRECTIONS / 3, DIRECTIONS / 4]
            .into_iter()
            .flat_map(|step| {
                (0..DIRECTIONS).filter_map(move |at| {
                    let place = |times: usize| ring[(at + times * step) % DIRECTIONS];
                    Self::through([place(0)?, place(1)?, place(2)?])
                })
            });
        let best = hypotheses.max_by_key(count)?;
        (count(&best) as f64 >= ENOUGH * DIRECTIONS as f64).then_some(best)
    }

    /// Least-squares plane through all places on it.
    fn refined(self, rings: &[OpeningRing]) -> Option<Self> {
        let places = || {
            rings
                .iter()
                .flatten()
                .flatten()
                .filter(|place| self.has(place))
                .map(|place| place.coords)
        };
        let normal = thinnest_direction(scatter(places()));
        let normal = Unit::try_new(normal * normal.z.signum(), 0.0)?;
        (normal.z > ALIKE).then(|| Self {
            point: mean(places()).into(),
            normal,
        })
    }
}

/// Place of an opening's flag on the surface around it, m in O, and the outward normal of that
/// surface.
///
/// It is the nearest place, unless that lies in the opening: lower than the surface around it by
/// more than [`IN_OPENING`]. Of several surfaces, such as the floor of a wide pocket and the face
/// around the pocket, the one nearest to the flag counts.
///
/// - `flag`, `nearest`: m in O; `normal`: approximate normal of the surface around the flag.
/// - `radius`: of the innermost ring, m: it encloses an opening with the flag at most beside it;
///   `step`: from ring to ring, m.
pub(super) fn on_surface_around(
    mesh: &TriMesh,
    flag: &Point3<f64>,
    [radius, step]: [f64; 2],
    (nearest, normal): (Point3<f64>, Unit<Vector3<f64>>),
) -> (Point3<f64>, Unit<Vector3<f64>>) {
    let pose_of = Isometry3::from_parts(flag.coords.into(), turned_to(&normal));
    let rings = rings(mesh, &pose_of, [radius, step]);
    let planes = rings.iter().filter_map(LevelPlane::of_ring);
    let around = planes.min_by(|a, b| a.above_flag().abs().total_cmp(&b.above_flag().abs()));
    let around = around.and_then(|plane| plane.refined(&rings));
    match around.filter(|plane| plane.off(&pose_of.inverse_transform_point(&nearest)) < -IN_OPENING)
    {
        Some(plane) => {
            let place = Point3::new(0.0, 0.0, plane.above_flag());
            (
                pose_of * place,
                Unit::new_unchecked(pose_of.rotation * plane.normal.into_inner()),
            )
        }
        None => (nearest, normal),
    }
}

/// Places of the mesh on rings around the flag, at each the outermost along the normal.
fn rings(mesh: &TriMesh, pose_of: &Isometry3<f64>, [radius, step]: [f64; 2]) -> Vec<OpeningRing> {
    let to_f = pose_of.inverse();
    let radii = (0..RINGS).map(|ring| radius + step * ring as f64);
    let directions = (0..DIRECTIONS).map(|at| at as f64 / DIRECTIONS as f64 * TAU);
    let directions: Vec<_> = directions
        .map(|angle| Point2::new(angle.cos(), angle.sin()))
        .collect();
    let wanted: Vec<_> = radii
        .map(|radius| directions.iter().map(|at| at * radius).collect::<Vec<_>>())
        .collect();
    let farthest = radius + step * RINGS as f64;
    let mut rings = vec![[None; DIRECTIONS]; RINGS];
    for (face, _) in mesh.faces() {
        let corners = mesh.triangle(face).map(|corner| to_f * corner);
        let [low, high] = bounds(&corners);
        if low.coords.max() > farthest || high.coords.min() < -farthest {
            continue;
        }
        for (ring, wanted) in rings.iter_mut().zip(&wanted) {
            for (found, at) in ring.iter_mut().zip(wanted) {
                let is_near = (0..2).all(|i| low[i] <= at[i] && at[i] <= high[i]);
                let height = if is_near { height(&corners, at) } else { None };
                let higher =
                    |z: &f64| z.abs() < NEAR && found.is_none_or(|found: Point3<f64>| *z > found.z);
                if let Some(z) = height.filter(higher) {
                    *found = Some(Point3::new(at.x, at.y, z));
                }
            }
        }
    }
    rings
}

/// Bounds of a triangle, seen along z.
fn bounds(corners: &[Point3<f64>; 3]) -> [Point2<f64>; 2] {
    let [a, b, c] = corners.map(|corner| corner.xy().coords);
    [a.inf(&b).inf(&c).into(), a.sup(&b).sup(&c).into()]
}

/// Height of a triangle that faces up, at a place in it.
fn height(corners: &[Point3<f64>; 3], at: &Point2<f64>) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| corner.xy() - at);
    let shares = [b.perp(&c), c.perp(&a), a.perp(&b)];
    let area: f64 = shares.iter().sum();
    let is_in = area > 0.0 && shares.iter().all(|share| *share >= 0.0);
    is_in.then(|| {
        shares
            .iter()
            .zip(corners)
            .map(|(share, corner)| share * corner.z)
            .sum::<f64>()
            / area
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights over a grid of 0.5 mm, 40 × 40 mm, m; `None` is open.
    fn surface(height: impl Fn(f64, f64) -> Option<f64>) -> TriMesh {
        let (side, at) = (81usize, |i: usize| i as f64 * 0.5e-3 - 20e-3);
        let places: Vec<_> = (0..side * side)
            .map(|i| [at(i % side), at(i / side)])
            .collect();
        let heights: Vec<_> = places.iter().map(|[x, y]| height(*x, *y)).collect();
        let positions = places
            .iter()
            .zip(&heights)
            .map(|([x, y], z)| Point3::new(*x, *y, z.unwrap_or(0.0)));
        let cells =
            (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| row * side + column));
        let faces = cells.flat_map(|a| [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]);
        let faces = faces.filter(|corners| corners.iter().all(|corner| heights[*corner].is_some()));
        TriMesh::new(
            positions.collect(),
            faces.map(|face| face.map(|corner| corner as u32)).collect(),
        )
        .unwrap()
    }

    /// Result by the rings of a flag with a radius of 3 mm and a ball of 1.5 mm.
    fn found(
        mesh: &TriMesh,
        flag: [f64; 3],
        nearest: [f64; 3],
    ) -> (Point3<f64>, Unit<Vector3<f64>>) {
        let mm = |place: [f64; 3]| Point3::from(place) * 1e-3;
        on_surface_around(
            mesh,
            &mm(flag),
            [4.5e-3, 1.5e-3],
            (mm(nearest), Vector3::z_axis()),
        )
    }

    /// A hole of Ø 7 mm, 5 mm deep or through, in z = 0.
    #[test]
    fn the_level_of_an_open_hole_is_that_of_the_surface_around_it_wherever_its_flag_is() {
        for floor in [Some(-5e-3), None] {
            let mesh = surface(|x, y| {
                if x.hypot(y) < 3.5e-3 {
                    floor
                } else {
                    Some(0.0)
                }
            });
            for (flag, nearest, level) in [
                ([0.0, 0.0, 0.0], [0.0, 0.0, -5.0], 0.0),
                ([1.0, -1.0, -4.0], [1.0, -1.0, -5.0], 0.0),
                ([0.0, 1.0, 2.0], [0.0, 0.0, -5.0], 0.0),
                ([0.0, 0.0, -2.0], [0.0, 4.0, -2.0], 0.0),
                // on the surface, or almost: unchanged
                ([0.0, 0.0, 0.0], [0.0, 4.0, 0.0], 0.0),
                ([0.0, 0.0, 2.0], [4.0, 0.0, 0.5], 0.5),
                ([0.0, 0.0, -1.0], [0.0, 4.0, -1.0], -1.0),
            ] {
                let (place, normal) = found(&mesh, flag, nearest);
                assert!(
                    (place.z - level * 1e-3).abs() < 1e-9,
                    "{flag:?}, {nearest:?}: {place}"
                );
                assert!(normal.z > 1.0 - 1e-12);
            }
        }
    }

    /// z = x / 10, an angle of 5.7°, up to y = 5 mm.
    #[test]
    fn the_normal_is_that_of_the_surface_around_it_beside_an_edge_as_well() {
        let slope = |x: f64, y: f64| match x.hypot(y) {
            r if r < 3.5e-3 => Some(-6e-3),
            _ if y > 5e-3 => None,
            _ => Some(0.1 * x),
        };
        let (place, normal) = found(&surface(slope), [0.0, 0.0, 0.0], [0.0, 0.0, -6.0]);
        let expected = Vector3::new(-0.1, 0.0, 1.0).normalize();
        assert!(
            (normal.into_inner() - expected).norm() < 1e-3 && place.z.abs() < 0.05e-3,
            "{place} {normal:?}"
        );
    }

    /// A pocket of 20 × 20 mm, 6 mm deep, and a hole in its floor.
    #[test]
    fn the_floor_of_a_wide_pocket_is_the_surface_of_a_hole_in_it_and_its_face_that_of_the_pocket() {
        let depth = |x: f64, y: f64| match x.abs().max(y.abs()) {
            r if r > 10e-3 => Some(0.0),
            _ if x.hypot(y) < 3e-3 => Some(-11e-3),
            _ => Some(-6e-3),
        };
        let mesh = surface(depth);
        let level =
            |flag: f64, nearest: f64| found(&mesh, [0.0, 0.0, flag], [0.0, 0.0, nearest]).0.z * 1e3;
        // the hole, flagged on the floor; the pocket, flagged at its former face: places at which a
        // ring crosses its wall have a share
        assert!((level(-6.0, -11.0) + 6.0).abs() < 0.1 && level(0.0, -6.0).abs() < 0.1);
        // with its flag on the floor it may be a hole there
        assert_eq!(level(-6.0, -6.0), -6.0);
    }

    /// Without such a surface only the nearest place is known.
    #[test]
    fn a_flag_without_a_surface_around_it_stays_where_it_is() {
        let mesh = surface(|x, y| (x.hypot(y) < 2e-3).then_some(-5e-3));
        assert_eq!(
            found(&mesh, [0.0, 0.0, 0.0], [0.0, 0.0, -5.0]).0,
            Point3::new(0.0, 0.0, -5e-3)
        );
        // 45° from the expected normal
        let steep = surface(|x, _| Some(x));
        assert_eq!(
            found(&steep, [0.0, 0.0, 0.0], [0.0, 0.0, -12.0]).0,
            Point3::new(0.0, 0.0, -12e-3)
        );
    }
}
