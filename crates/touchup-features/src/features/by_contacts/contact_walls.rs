//! Walls by contacts, round and flat ones, however coarse the mesh is there.
//!
//! A ball that runs along a round wall keeps its centre at one distance ρ from the axis: ρ = R − r
//! in a bore, R + r around a boss. Seen along the axis, two contacts with centres p, q and normals
//! m, n (into the air) determine it: the axis goes through p + ρ m = q + ρ n, with ρ positive in a
//! bore and negative around a boss. The radius of a large wall hardly follows from noisy normals:
//! there the circle goes through three centres. Candidate axes are the normals of the part's
//! planes, on which holes stand square, and directions from the normals of contacts off all planes.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::contacts::{
    ALIKE, LEAST, ProjectedContact, SQUARE, TOGETHER, axes, is_on, large_planes, projected,
    thinned, together,
};
use crate::features::fit::{Cylinder, FitParams, Plane, SurfaceModel, fit};
use crate::features::observe::{groups, observation};
use crate::features::segmentation::facets::NONE;
use crate::features::segmentation::primitive::{Primitive, belongs};
use crate::features::segmentation::scene::SegmentedMesh;
use crate::features::segmentation::segment::Segment;
use crate::features::walls::ALL_AROUND;
use touchup_geometry::mesh::{BoxQuery, FaceId};
use touchup_geometry::numeric::{distinct, mean, median, scatter, tangent_basis};
use touchup_method::stylus::ProbedPoint;

/// Maximum number of pairs, and of triples, of contacts to try in one group.
const PAIRS: usize = 400;
/// Seed of the draws.
const SEED: u64 = 1;
/// Minimum squared difference of the normals of a pair: 31°; minimum sine between the sides from
/// one of three contacts to the others: 15°.
const TURNED: f64 = 0.3;
const BENT: f64 = 0.26;
/// Tolerance of a contact on a circle in the search, as a share of the ball's radius.
const SEARCHED: f64 = 0.1;
/// Cosine of the tolerance of its normal: 35°.
const RADIAL: f64 = 0.82;
/// Parts of a turn.
const PARTS: usize = 24;
/// Minimum touched share of a turn of a cylinder.
const TURN: f64 = 0.42;
/// Maximum number of contacts to start a flat wall from, in one group.
const STARTS: usize = 40;
/// Minimum length of a flat wall, and width from which its contacts determine a tilt, in radii of
/// the ball.
const FLAT_RADII: f64 = 1.5;
const WIDE_RADII: f64 = 0.25;
/// Maximum share of a flat wall that is round in the mesh.
const MOST_ROUND: f64 = 0.3;
/// Maximum number of walls of one kind in one group.
const MOST_IN_GROUP: usize = 6;
/// Range of radii, in radii of the ball.
const RADII: [f64; 2] = [1.02, 40.0];
/// Maximum distance of a cylinder's faces from it, and beyond its ends, as a share of the ball's
/// radius.
const MESH_OFF: f64 = 0.25;
const MESH_BEYOND: f64 = 0.6;
/// Tolerance of radii and positions of one cylinder, as a share of the radius.
const SAME: f64 = 0.12;
/// Tolerance of radii and positions between a wall and its round piece of the mesh, as a share of
/// the radius, and of the ball's: a scan is blurred, and steps of a hole or shaft differ by more.
const SAME_WALL: f64 = 0.15;
const SAME_WALL_OF_BALL: f64 = 0.35;
/// Maximum number of contacts in the search for a shaft, its minimum radius in radii of the ball,
/// and its minimum touched share of a turn.
const MOST_ON_SHAFT: usize = 800;
const LARGE: f64 = 4.0;
const SHAFT_TURN: f64 = 0.6;
/// Tolerance of the axes of pieces of one wall, 6° as a cosine, and maximum gap along the axis, in
/// radii of the wall.
const ONE_AXIS: f64 = 0.9945;
const APART: f64 = 1.0;
/// Tolerance of the segment of such a wall, as a share of the ball's radius.
const TOLERANCE: f64 = 0.05;

/// A cylinder and the contacts on it.
#[derive(Clone, Debug)]
struct ContactCylinder {
    surface: Cylinder,
    /// along the axis from the centre of the surface, m: from the lowest to the highest contact
    ends: [f64; 2],
    /// share of a turn that they cover
    turn: f64,
    touches: Vec<usize>,
}

/// A flat wall and the contacts on it.
#[derive(Clone, Debug)]
struct ContactPlane {
    surface: Plane,
    touches: Vec<usize>,
}

/// All walls that contacts show.
#[derive(Default)]
struct ContactWalls {
    cylinders: Vec<ContactCylinder>,
    planes: Vec<ContactPlane>,
}

/// Adds the walls that contacts show to the segmentation, each with the faces of the mesh on it.
/// Returns for each contact whether it is on a wall that is round all around.
pub(in crate::features) fn add_contact_walls(
    parted: &mut SegmentedMesh,
    touches: &[ProbedPoint],
) -> Vec<bool> {
    let radius = touches.iter().map(|touch| touch.radius).fold(0.0, f64::max);
    let ContactWalls { cylinders, planes } = contact_walls(parted, touches);
    let of_planes = planes.iter().map(|found| {
        (
            Primitive::Plane(found.surface),
            faces_by(parted, found, touches),
            0.0,
        )
    });
    let of_cylinders = cylinders.iter().map(|found| {
        let faces = [
            faces_on(parted, found, radius),
            faces_of_same(parted, found, radius),
        ]
        .concat();
        (
            Primitive::Cylinder(found.surface),
            distinct(faces),
            found.turn,
        )
    });
    let found: Vec<_> = of_planes.chain(of_cylinders).collect();
    for (primitive, faces, felt_turn) in found {
        let area = parted.facets.area_of(&faces);
        if area > 0.0 {
            let tolerance = TOLERANCE * radius;
            let segment = Segment {
                primitive,
                faces,
                area,
                tolerance,
                is_exact: false,
                felt_turn,
            };
            parted.segmentation.add(&parted.facets, segment);
        }
    }
    let mut is_round = vec![false; touches.len()];
    for wall in cylinders.iter().filter(|wall| wall.turn >= ALL_AROUND) {
        wall.touches.iter().for_each(|&at| is_round[at] = true);
    }
    is_round
}

/// Faces of the mesh's round pieces of the same wall, with its untouched rest: one wall is one
/// feature.
fn faces_of_same(parted: &SegmentedMesh, found: &ContactCylinder, of_ball: f64) -> Vec<u32> {
    let Cylinder {
        radius, concave, ..
    } = found.surface;
    let near = (SAME_WALL * radius).min(SAME_WALL_OF_BALL * of_ball);
    let (axis, centre) = (found.surface.axis(), found.surface.center());
    let is_same = |segment: &&Segment| {
        let Primitive::Cylinder(other) = segment.primitive else {
            return false;
        };
        let aside = (other.center() - centre).cross(&axis).norm();
        let along = segment
            .faces
            .iter()
            .flat_map(|&face| parted.facets.triangle(face))
            .map(|p| (p - centre).dot(&axis));
        let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| {
            [low.min(t), high.max(t)]
        });
        other.concave == concave
            && (other.radius - radius).abs() < near
            && aside < near
            && other.axis().dot(&axis).abs() > ALIKE
            && low < found.ends[1] + radius
            && high > found.ends[0] - radius
    };
    parted
        .segmentation
        .segments
        .iter()
        .filter(is_same)
        .flat_map(|segment| segment.faces.iter().copied())
        .collect()
}

/// Faces of the mesh on a plane beside the contacts on it.
fn faces_by(parted: &SegmentedMesh, found: &ContactPlane, touches: &[ProbedPoint]) -> Vec<u32> {
    let primitive = Primitive::Plane(found.surface);
    let mut query = BoxQuery::default();
    let mut faces = Vec::new();
    for touch in found.touches.iter().map(|&at| &touches[at]) {
        let reach = Vector3::repeat(TOGETHER * touch.radius);
        parted
            .tree
            .faces_in_box(&(touch.point - reach), &(touch.point + reach), &mut query);
        faces.extend(query.faces.iter().map(|face| face.0));
    }
    let mut faces = distinct(faces);
    let radius = touches[found.touches[0]].radius;
    faces.retain(|&face| belongs(&parted.facets, face, &primitive, MESH_OFF * radius));
    // a few contacts of a round wall lie on a plane too
    let is_round = |face: &u32| {
        let number = parted.segmentation.of_face[*face as usize];
        number != NONE
            && matches!(
                parted.segment(number as usize).primitive,
                Primitive::Cylinder(_)
            )
    };
    let round: f64 = faces
        .iter()
        .filter(|face| is_round(face))
        .map(|&face| parted.facets.area(face))
        .sum();
    if round > MOST_ROUND * parted.facets.area_of(&faces) {
        Vec::new()
    } else {
        faces
    }
}

/// Faces of the mesh on a cylinder, within its touched length.
fn faces_on(parted: &SegmentedMesh, found: &ContactCylinder, radius: f64) -> Vec<u32> {
    let Cylinder {
        radius: of_wall, ..
    } = found.surface;
    let (axis, centre) = (found.surface.axis(), found.surface.center());
    let ends = found.ends.map(|t| centre + axis * t);
    let reach = Vector3::repeat(of_wall + radius);
    let mut query = BoxQuery::default();
    parted.tree.faces_in_box(
        &(ends[0].inf(&ends[1]) - reach),
        &(ends[0].sup(&ends[1]) + reach),
        &mut query,
    );
    let primitive = Primitive::Cylinder(found.surface);
    let [low, high] = [
        found.ends[0] - MESH_BEYOND * radius,
        found.ends[1] + MESH_BEYOND * radius,
    ];
    let is_of = |face: u32| {
        let along = (parted.facets.mesh.barycentre(FaceId(face)) - centre).dot(&axis);
        (low..=high).contains(&along)
            && belongs(&parted.facets, face, &primitive, MESH_OFF * radius)
    };
    let mut faces: Vec<u32> = query
        .faces
        .iter()
        .map(|face| face.0)
        .filter(|&face| is_of(face))
        .collect();
    faces.sort_unstable();
    faces
}

impl ContactWalls {
    fn add(&mut self, one: ContactCylinder) {
        if !self.cylinders.iter().any(|other| is_same(other, &one)) {
            self.cylinders.push(one);
        }
    }

    /// Joins cylinders along one axis: a bore touched in pieces is one.
    fn join_pieces(&mut self, touches: &[ProbedPoint], radius: f64, group_of: &[u32]) {
        let mut at = 0;
        while at < self.cylinders.len() {
            let is_piece = |other: &usize| goes_on(&self.cylinders[at], &self.cylinders[*other]);
            let Some(piece) = (at + 1..self.cylinders.len()).find(is_piece) else {
                at += 1;
                continue;
            };
            let other = self.cylinders.remove(piece);
            let one = &self.cylinders[at];
            let ends = |wall: &ContactCylinder| {
                wall.ends
                    .map(|t| wall.surface.center() + wall.surface.axis() * t)
            };
            let [a, b] = [ends(one), ends(&other)];
            let along = a
                .into_iter()
                .flat_map(|p| b.map(|q| q - p))
                .max_by(|v, w| v.norm().total_cmp(&w.norm()));
            let along = along.unwrap_or_default();
            let axis = (along * along.dot(&one.surface.axis()).signum()).normalize();
            let [e, g] = tangent_basis(&axis);
            let middle = nalgebra::center(&one.surface.center(), &other.surface.center());
            let Cylinder {
                radius: of_wall,
                concave,
                ..
            } = one.surface;
            let rho = if concave {
                of_wall - radius
            } else {
                -of_wall - radius
            };
            let circle = (
                Point2::new(middle.coords.dot(&e), middle.coords.dot(&g)),
                rho,
                one.turn.max(other.turn),
            );
            let numbers: Vec<u32> = one
                .touches
                .iter()
                .chain(&other.touches)
                .map(|&touch| touch as u32)
                .collect();
            if let Some(joint) =
                cylinder_of(touches, &numbers, &axis, circle, [e, g], radius, group_of)
            {
                self.cylinders[at] = joint;
            }
        }
    }
}

/// All walls that contacts show, the largest number of contacts first.
fn contact_walls(parted: &SegmentedMesh, touches: &[ProbedPoint]) -> ContactWalls {
    let kept = thinned(touches);
    let Some(radius) = kept.first().map(|&at| touches[at].radius) else {
        return ContactWalls::default();
    };
    let planes = large_planes(parted);
    let is_on_plane =
        |touch: &ProbedPoint| planes.iter().any(|&number| is_on(parted, number, touch));
    let free: Vec<usize> = kept
        .iter()
        .copied()
        .filter(|&at| !is_on_plane(&touches[at]))
        .collect();
    let group_of = groups(touches);
    let mut found = ContactWalls::default();
    let mut left = vec![true; touches.len()];
    for axis in axes(parted, &planes, touches, &free, radius) {
        let is_wall = |&at: &usize| left[at] && touches[at].normal.dot(&axis).abs() < SQUARE;
        let walls: Vec<usize> = free.iter().copied().filter(is_wall).collect();
        for members in together(touches, &walls, TOGETHER * radius) {
            for (one, on) in circles(touches, &members, &axis, radius, &group_of) {
                on.iter().for_each(|&at| left[at] = false);
                found.add(one);
            }
        }
        // touches of a shaft come in strips that are far apart
        let walls: Vec<usize> = walls.into_iter().filter(|&at| left[at]).collect();
        let some: Vec<usize> = walls
            .iter()
            .copied()
            .step_by(walls.len().div_ceil(MOST_ON_SHAFT).max(1))
            .collect();
        for (one, on) in circles(touches, &some, &axis, radius, &group_of) {
            let Cylinder {
                radius: of_wall,
                concave,
                ..
            } = one.surface;
            if !concave && of_wall > LARGE * radius && one.turn > SHAFT_TURN {
                on.iter().for_each(|&at| left[at] = false);
                found.add(one);
            }
        }
    }
    found.join_pieces(touches, radius, &group_of);
    let rest: Vec<usize> = free.into_iter().filter(|&at| left[at]).collect();
    for members in together(touches, &rest, TOGETHER * radius) {
        found.planes.extend(flat_walls(touches, members));
    }
    found
        .planes
        .sort_by_key(|one| std::cmp::Reverse(one.touches.len()));
    found
        .cylinders
        .sort_by_key(|one| std::cmp::Reverse(one.touches.len()));
    found
}

/// The planes through contacts.
fn flat_walls(touches: &[ProbedPoint], mut left: Vec<usize>) -> Vec<ContactPlane> {
    let mut found = Vec::new();
    while found.len() < MOST_IN_GROUP && left.len() >= LEAST {
        let on = |plane: &Plane| -> Vec<usize> {
            let is_on = |&at: &usize| {
                let touch = &touches[at];
                let off = plane.distance(&touch.centre) - touch.radius;
                off.abs() < SEARCHED * touch.radius && plane.normal().dot(&touch.normal) > ALIKE
            };
            left.iter().copied().filter(is_on).collect()
        };
        let starts = left
            .iter()
            .step_by(left.len().div_ceil(STARTS))
            .map(|&at| &touches[at]);
        let planes = starts.map(|touch| on(&Plane::new(touch.point, &touch.normal)));
        let Some(members) = planes.max_by_key(Vec::len) else {
            break;
        };
        let Some(plane) = plane_through(touches, &members) else {
            break;
        };
        let members = on(&plane);
        let is_wide = members.len() >= LEAST
            && extent(touches, &members) > FLAT_RADII * touches[members[0]].radius;
        if !is_wide {
            break;
        }
        left.retain(|at| members.binary_search(at).is_err());
        if !is_edge(touches, &members, &plane) {
            found.push(ContactPlane {
                surface: plane,
                touches: members,
            });
        }
    }
    found
}

/// Whether contacts on a plane are on an edge: rolling around it moves the centre and hardly the
/// contact, and in a corner the normal turns while the centre stays.
fn is_edge(touches: &[ProbedPoint], members: &[usize], plane: &Plane) -> bool {
    let radius = touches[members[0]].radius;
    let basis = tangent_basis(&plane.normal());
    let spread = |of: fn(&ProbedPoint) -> Vector3<f64>| -> Matrix2<f64> {
        let seen = |&at: &usize| basis.map(|axis| of(&touches[at]).dot(&axis));
        scatter(members.iter().map(seen).map(Vector2::from)) / members.len() as f64
    };
    let centres = spread(|touch| touch.centre.coords);
    let eigen = centres.symmetric_eigen();
    let across = eigen
        .eigenvectors
        .column(eigen.eigenvalues.imin())
        .into_owned();
    let wide = |spread: &Matrix2<f64>| across.dot(&(spread * across)).max(0.0).sqrt();
    let moved = wide(&centres);
    let is_rolled =
        moved > ROLLED * radius && wide(&spread(|touch| touch.point.coords)) < ROLLED_SHARE * moved;
    let is_corner =
        moved < CORNER * radius && spread(|touch| touch.normal).trace() > CORNER_TURN.powi(2);
    is_rolled || is_corner
}

/// Contacts of an edge: minimum motion of the centre across it, in radii, and maximum motion of the
/// contact, as a share of that. Contacts of a corner: maximum motion of the centre across it, in
/// radii, and minimum turn of the normals, rad.
const ROLLED: f64 = 0.05;
const ROLLED_SHARE: f64 = 0.6;
const CORNER: f64 = 0.1;
const CORNER_TURN: f64 = 0.12;

/// The plane through contacts; in undetermined directions by their normals.
fn plane_through(touches: &[ProbedPoint], members: &[usize]) -> Option<Plane> {
    let normal: Vector3<f64> = members.iter().map(|&at| touches[at].normal).sum();
    let normal = normal.try_normalize(0.0)?;
    let centres = members.iter().map(|&at| touches[at].centre.coords);
    let middle = mean(centres.clone());
    let eigen = (scatter(centres) / members.len() as f64).symmetric_eigen();
    let widths = [0, 1, 2].map(|i| eigen.eigenvalues[i].max(0.0).sqrt());
    let longest = eigen
        .eigenvectors
        .column(eigen.eigenvalues.imax())
        .into_owned();
    let radius = touches[members[0]].radius;
    let mut rising = widths;
    rising.sort_by(f64::total_cmp);
    let thinnest = eigen
        .eigenvectors
        .column(eigen.eigenvalues.imin())
        .into_owned();
    let fitted = if rising[1] > WIDE_RADII * radius {
        thinnest
    } else {
        normal - longest * normal.dot(&longest)
    };
    let fitted = fitted.try_normalize(0.0)? * fitted.dot(&normal).signum();
    Some(Plane::new(Point3::from(middle) - fitted * radius, &fitted))
}

/// Diagonal of the box around contacts, m.
fn extent(touches: &[ProbedPoint], members: &[usize]) -> f64 {
    let points = members.iter().map(|&at| touches[at].point);
    let bounds = points.fold(None, |bounds: Option<[Point3<f64>; 2]>, p| {
        Some(bounds.map_or([p, p], |[low, high]| [low.inf(&p), high.sup(&p)]))
    });
    bounds.map_or(0.0, |[low, high]| (high - low).norm())
}

/// The circles through contacts, seen along an axis, with the contacts of each.
fn circles(
    touches: &[ProbedPoint],
    members: &[usize],
    axis: &Vector3<f64>,
    radius: f64,
    group_of: &[u32],
) -> Vec<(ContactCylinder, Vec<usize>)> {
    let [e, g] = tangent_basis(axis);
    let mut left = projected(touches, members, [e, g]);
    let mut found = Vec::new();
    while found.len() < MOST_IN_GROUP && left.len() >= LEAST {
        let Some((centre, rho, turn)) = best_circle(&left, radius) else {
            break;
        };
        let on: Vec<usize> = (0..left.len())
            .filter(|&at| is_on_circle(&left[at], &centre, rho, radius))
            .collect();
        let numbers: Vec<u32> = on.iter().map(|&at| left[at].touch as u32).collect();
        if let Some(one) = cylinder_of(
            touches,
            &numbers,
            axis,
            (centre, rho, turn),
            [e, g],
            radius,
            group_of,
        ) {
            found.push((one, numbers.iter().map(|&number| number as usize).collect()));
        }
        let is_on = |projected: &ProjectedContact| is_on_circle(projected, &centre, rho, radius);
        left.retain(|projected| !is_on(projected));
    }
    found
}

fn is_on_circle(one: &ProjectedContact, centre: &Point2<f64>, rho: f64, radius: f64) -> bool {
    let v = centre - one.at;
    let distance = v.norm();
    (distance - rho.abs()).abs() < SEARCHED * radius
        && v.dot(&one.normal) * rho.signum() > RADIAL * distance
}

/// The circle of ball centres with the largest touched share of a turn: its centre and ρ, m, and
/// that share; `None`: the share is too small.
fn best_circle(all: &[ProjectedContact], radius: f64) -> Option<(Point2<f64>, f64, f64)> {
    let mut best: Option<(usize, usize, Point2<f64>, f64)> = None;
    // the same contacts give the same circles
    let mut rng = Pcg64::seed_from_u64(SEED);
    for _ in 0..PAIRS.min(all.len() * all.len()) {
        let [one, other, third] = [(); 3].map(|()| &all[rng.random_range(0..all.len())]);
        for (centre, rho) in [
            circle_of_two(one, other),
            circle_of_three([one, other, third]),
        ]
        .into_iter()
        .flatten()
        {
            let of_wall = rho.abs() + radius * rho.signum();
            if of_wall < RADII[0] * radius * f64::from(rho > 0.0)
                || of_wall > RADII[1] * radius
                || of_wall <= 0.0
            {
                continue;
            }
            let (count, turn) = support(all, &centre, rho, radius);
            if best
                .as_ref()
                .is_none_or(|&(most, number, ..)| (turn, count) > (most, number))
            {
                best = Some((turn, count, centre, rho));
            }
        }
    }
    let (_, _, mut centre, mut rho) = best?;
    for _ in 0..3 {
        (centre, rho) = fitted_circle(all, centre, rho, radius)?;
    }
    let (count, turn) = support(all, &centre, rho, radius);
    let turn = turn as f64 / PARTS as f64;
    (count >= LEAST && turn >= TURN).then_some((centre, rho, turn))
}

/// The circle by the centres and normals of two contacts: p + ρ m = q + ρ n, by least squares.
fn circle_of_two(one: &ProjectedContact, other: &ProjectedContact) -> Option<(Point2<f64>, f64)> {
    let (apart, turned) = (one.at - other.at, one.normal - other.normal);
    if turned.norm_squared() < TURNED {
        return None;
    }
    let rho = -apart.dot(&turned) / turned.norm_squared();
    Some((
        nalgebra::center(
            &(one.at + one.normal * rho),
            &(other.at + other.normal * rho),
        ),
        rho,
    ))
}

/// The circle through three centres; its sign is from the first normal.
fn circle_of_three([one, other, third]: [&ProjectedContact; 3]) -> Option<(Point2<f64>, f64)> {
    let (a, b) = (other.at - one.at, third.at - one.at);
    let twice_area = a.perp(&b);
    if twice_area.abs() < BENT * a.norm() * b.norm() {
        return None;
    }
    let to_centre = Vector2::new(
        b.y * a.norm_squared() - a.y * b.norm_squared(),
        a.x * b.norm_squared() - b.x * a.norm_squared(),
    ) / (2.0 * twice_area);
    Some((
        one.at + to_centre,
        to_centre.norm().copysign(to_centre.dot(&one.normal)),
    ))
}

/// Number of contacts on a circle, and of touched parts of a turn.
fn support(
    all: &[ProjectedContact],
    centre: &Point2<f64>,
    rho: f64,
    radius: f64,
) -> (usize, usize) {
    let (mut parts, mut count) = ([false; PARTS], 0);
    for one in all
        .iter()
        .filter(|one| is_on_circle(one, centre, rho, radius))
    {
        let v = one.at - centre;
        let turn = v.y.atan2(v.x) / std::f64::consts::TAU;
        parts[((turn * PARTS as f64).floor() as i64).rem_euclid(PARTS as i64) as usize] = true;
        count += 1;
    }
    (count, parts.iter().filter(|part| **part).count())
}

/// The circle of least squares through the contacts on one: x² + y² = 2 a x + 2 b y + c.
fn fitted_circle(
    all: &[ProjectedContact],
    centre: Point2<f64>,
    rho: f64,
    radius: f64,
) -> Option<(Point2<f64>, f64)> {
    let rows = all
        .iter()
        .filter(|one| is_on_circle(one, &centre, rho, radius))
        .map(|one| {
            let v = one.at - centre;
            (
                nalgebra::SVector::<f64, 3>::new(2.0 * v.x, 2.0 * v.y, 1.0),
                v.norm_squared(),
            )
        });
    let solution = touchup_geometry::numeric::NormalEquations::of(rows).solution()?;
    let moved = Vector2::new(solution.x, solution.y);
    let square = solution.z + moved.norm_squared();
    (square > 0.0).then(|| (centre + moved, square.sqrt().copysign(rho)))
}

/// The cylinder about a circle, with a fitted axis if the contacts determine it.
fn cylinder_of(
    touches: &[ProbedPoint],
    numbers: &[u32],
    axis: &Vector3<f64>,
    (centre, rho, turn): (Point2<f64>, f64, f64),
    [e, g]: [Vector3<f64>; 2],
    radius: f64,
    group_of: &[u32],
) -> Option<ContactCylinder> {
    let along = |axis: &Vector3<f64>, from: &Point3<f64>| -> Vec<f64> {
        numbers
            .iter()
            .map(|&number| (touches[number as usize].point - from).dot(axis))
            .collect()
    };
    let height = median(&mut along(axis, &Point3::origin()))?;
    let middle = Point3::from(e * centre.x + g * centre.y + axis * height);
    let of_wall = rho.abs() + radius * rho.signum();
    let guess = Cylinder::new(middle, axis, of_wall, rho > 0.0);
    let observations: Vec<_> = numbers
        .iter()
        .map(|&number| observation(&touches[number as usize], group_of[number as usize]))
        .collect();
    let params = FitParams {
        axis_sigma: Some(AXIS_SIGMA),
        ..FitParams::default()
    };
    let surface = fit(&guess, &observations, &params).map_or(guess, |fit| fit.surface);
    let is_near = (surface.radius - of_wall).abs() < SAME * of_wall
        && surface.axis_towards(axis).dot(axis) > ALIKE;
    let surface = if is_near { surface } else { guess };
    let of_axis = along(&surface.axis(), &surface.center());
    let ends = of_axis
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &t| {
            [low.min(t), high.max(t)]
        });
    let touches = numbers.iter().map(|&number| number as usize).collect();
    Some(ContactCylinder {
        surface,
        ends,
        turn,
        touches,
    })
}

/// Prior standard deviation of the direction of an axis, rad: 3°.
const AXIS_SIGMA: f64 = 0.05;

fn is_same(one: &ContactCylinder, other: &ContactCylinder) -> bool {
    let (a, b) = (&one.surface, &other.surface);
    let v = b.center() - a.center();
    let aside = v.cross(&a.axis()).norm();
    let along = other.ends.map(|t| (v + b.axis() * t).dot(&a.axis()));
    let is_beside = along[0].max(along[1]) > one.ends[0] && along[0].min(along[1]) < one.ends[1];
    a.concave == b.concave
        && is_beside
        && a.axis().dot(&b.axis()).abs() > ALIKE
        && (a.radius - b.radius).abs() < SAME * a.radius
        && aside < SAME * a.radius
}

/// Whether two cylinders are pieces of one wall, beside each other along its axis.
fn goes_on(one: &ContactCylinder, other: &ContactCylinder) -> bool {
    let (a, b) = (&one.surface, &other.surface);
    let ends = other.ends.map(|t| b.center() + b.axis() * t - a.center());
    let along = ends.map(|v| v.dot(&a.axis()));
    let gap = (along[0].min(along[1]) - one.ends[1]).max(one.ends[0] - along[0].max(along[1]));
    let aside = ends.map(|v| v.cross(&a.axis()).norm());
    a.concave == b.concave
        && a.axis().dot(&b.axis()).abs() > ONE_AXIS
        && (a.radius - b.radius).abs() < SAME * a.radius
        && aside[0].min(aside[1]) < SAME_WALL * a.radius
        && gap < APART * a.radius
}
