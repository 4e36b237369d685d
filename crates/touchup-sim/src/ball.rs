//! A rigid ball pushed against a rigid surface without entering it.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::surfaces::surface::{Surface, SurfacePoint};

/// Rounds of linearising the surface around the ball. Each gains a factor of about radius / step;
/// ten are usual.
const ROUNDS: usize = 40;
/// Maximum number of planes that join in one round.
const JOINS: usize = 40;
/// Tolerance of a plane, m.
const BROKEN: f64 = REST / 4.0;
/// Minimum span of the normals (determinant of their Gram matrix): below it planes count as
/// parallel, and one represents all.
const PARALLEL: f64 = 1e-10;
/// Maximum step of a ball at rest, m, and its maximum penetration.
const REST: f64 = 1e-12;
/// Minimum push of a contact, as a share of the hardest.
const IDLE: f64 = 1e-6;

/// Place and strength of a contact of the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallContact {
    /// Point of the surface, m, in O.
    pub point: Point3<f64>,
    /// Contact normal, also on edges and corners: unit vector in O from there to the centre of the
    /// ball, or out of the tip.
    pub normal: Vector3<f64>,
    /// Distance along `normal` by which the contact holds the ball back from the guide, m.
    pub held_back: f64,
}

/// One ball of a tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TipBall {
    /// middle from the origin of T, m, in T or O
    pub offset: Vector3<f64>,
    /// m
    pub radius: f64,
}

/// The plane that keeps the ball outside one piece of the surface: normal · centre ≥ level.
struct BallConstraint {
    point: Point3<f64>,
    normal: Vector3<f64>,
    level: f64,
    held_back: f64,
}

/// Equilibrium of the ball, and penetration of the planes that hold it, m.
type BallRest = (Point3<f64>, Vec<(usize, f64)>);

/// Moves a ball from the free place `from` towards `to`, and returns its place of rest, the point
/// nearest to `to`, near `from`, without penetration, and its contacts there.
///
/// It solves min |x − to|² under n_i·(x − q_i) ≥ radius, for the points q_i of the surface around
/// the ball and the directions n_i from them to its centre, again and again until x rests. to − x
/// is then a positive combination of −n_i.
///
/// - `radius`: m; the step should be a small share of it.
pub fn push_ball(
    surface: &dyn Surface,
    from: &Point3<f64>,
    to: &Point3<f64>,
    radius: f64,
) -> (Point3<f64>, Vec<BallContact>) {
    push_balls(
        surface,
        from,
        to,
        &[TipBall {
            offset: Vector3::zeros(),
            radius,
        }],
    )
}

/// As [`push_ball`], for rigidly connected balls: `from`, `to` and the result are their common
/// origin.
pub(super) fn push_balls(
    surface: &dyn Surface,
    from: &Point3<f64>,
    to: &Point3<f64>,
    balls: &[TipBall],
) -> (Point3<f64>, Vec<BallContact>) {
    let step = (to - from).norm();
    let (mut near, mut planes) = (Vec::new(), Vec::new());
    let mut x = *to;
    for _ in 0..ROUNDS {
        planes.clear();
        for ball in balls {
            near.clear();
            let middle = x + ball.offset;
            surface.near(&middle, ball.radius + 2.0 * step, &mut near);
            planes.extend(near.iter().filter_map(|s| plane(&middle, s, ball)));
        }
        let next = nearest_in_front(&mut planes, to);
        let moved = (next - x).norm();
        x = next;
        let is_free =
            |ball: &TipBall| surface.signed_distance(&(x + ball.offset)) >= ball.radius - REST;
        if moved <= REST && balls.iter().all(is_free) {
            return (x, contacts(&planes));
        }
    }
    // no rest (the gap is too narrow): stay at the free start, without contacts
    (*from, Vec::new())
}

fn plane(middle: &Point3<f64>, s: &SurfacePoint, ball: &TipBall) -> Option<BallConstraint> {
    let normal = (middle - s.point).try_normalize(0.0)?;
    let level = normal.dot(&s.point.coords) + ball.radius - normal.dot(&ball.offset);
    Some(BallConstraint {
        point: s.point,
        normal,
        level,
        held_back: 0.0,
    })
}

/// The point nearest to `to` in front of all planes, with each plane's share in its `held_back`.
///
/// Active set: the most violated plane joins, planes that no longer push leave, until none is
/// violated.
fn nearest_in_front(planes: &mut [BallConstraint], to: &Point3<f64>) -> Point3<f64> {
    let (mut x, mut active) = (*to, Vec::new());
    for _ in 0..JOINS {
        let slack = |p: &BallConstraint| p.normal.dot(&x.coords) - p.level;
        let worst =
            (0..planes.len()).min_by(|&a, &b| slack(&planes[a]).total_cmp(&slack(&planes[b])));
        let Some(worst) = worst.filter(|&w| slack(&planes[w]) < -BROKEN && !active.contains(&w))
        else {
            break;
        };
        active.push(worst);
        let Some((next, pushing)) = nearest_in_front_of_few(planes, &active, to) else {
            break;
        };
        planes.iter_mut().for_each(|p| p.held_back = 0.0);
        pushing
            .iter()
            .for_each(|&(i, held_back)| planes[i].held_back = held_back);
        active.retain(|&i| planes[i].held_back > 0.0);
        x = next;
    }
    x
}

/// The same for at most four planes, by trying every three, two and one of them; with the shares of
/// the pushing planes.
fn nearest_in_front_of_few(
    planes: &[BallConstraint],
    few: &[usize],
    to: &Point3<f64>,
) -> Option<BallRest> {
    (1u32..1 << few.len())
        .filter(|set| set.count_ones() <= 3)
        .find_map(|set| {
            let chosen: Vec<usize> = (0..few.len())
                .filter(|i| set >> i & 1 == 1)
                .map(|i| few[i])
                .collect();
            let mut normals = Matrix3::zeros();
            let mut missing = Vector3::zeros();
            for (row, &i) in chosen.iter().enumerate() {
                normals.set_row(row, &planes[i].normal.transpose());
                missing[row] = planes[i].level - planes[i].normal.dot(&to.coords);
            }
            // ones for the unused rows keep the matrix regular
            let gram = normals * normals.transpose()
                + Matrix3::from_fn(|r, c| {
                    if r == c && r >= chosen.len() {
                        1.0
                    } else {
                        0.0
                    }
                });
            let held_back = gram
                .determinant()
                .gt(&PARALLEL)
                .then(|| gram.try_inverse())
                .flatten()?
                * missing;
            let x = to + normals.transpose() * held_back;
            let clear = |&i: &usize| planes[i].normal.dot(&x.coords) >= planes[i].level - BROKEN;
            let pushes = held_back.iter().all(|h| *h >= 0.0);
            (pushes && few.iter().all(clear)).then(|| {
                (
                    x,
                    chosen.into_iter().zip(held_back.iter().copied()).collect(),
                )
            })
        })
}

/// The pushing planes; pieces of the surface that meet in one point count once.
fn contacts(planes: &[BallConstraint]) -> Vec<BallContact> {
    let hardest = planes.iter().map(|p| p.held_back).fold(0.0, f64::max);
    let mut contacts: Vec<BallContact> = Vec::new();
    for p in planes.iter().filter(|p| p.held_back > IDLE * hardest) {
        match contacts
            .iter_mut()
            .find(|c| c.normal.dot(&p.normal) > 1.0 - IDLE)
        {
            Some(same) => same.held_back += p.held_back,
            None => contacts.push(BallContact {
                point: p.point,
                normal: p.normal,
                held_back: p.held_back,
            }),
        }
    }
    contacts
}
