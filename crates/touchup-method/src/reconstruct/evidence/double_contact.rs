//! Double contact: a ball that touches two surfaces at once, as in an inner corner or a slot no
//! wider than itself.
//!
//! The force is then the sum of two, and lies anywhere between their normals: as one normal it
//! would invent a surface that bridges the corner. If both surfaces are known from contacts nearby,
//! and the ball lies on both, the touch is two contacts. On a convex edge the ball is nearer to the
//! planes on either side than its radius, so an edge does not pass for a corner.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::reconstruct::evidence::contact_map::ContactMap;
use crate::reconstruct::evidence::touches::SurfaceContact;
use touchup_geometry::numeric::direction;

/// Tolerance on the distance of the ball's centre from a surface that it lies on, as a share of its
/// radius: four times the noise of a usual tracker, and less than the offset at 20° beside an edge.
const ON_SURFACE: f64 = 0.05;
/// Maximum distance of supporting contacts from the ball's foot on their plane, in radii.
const NEARBY: f64 = 1.0;
/// Maximum distance of supporting contacts from the apparent contact point, in radii: a new contact
/// affects means up to there.
const ASKED: f64 = 2.0;
/// Contacts that face within 20° of each other belong to one surface.
const ALIKE: f64 = 0.94;
/// Surfaces at less than 45° to each other are a single curved one: beside an edge the ball may lie
/// on both to within the noise.
const DISTINCT: f64 = 0.707;
/// Minimum share of the force on a surface relative to the other: 6°; below it is not pressed.
const PRESSED: f64 = 0.1;
/// Sine of the maximum angle between the force and the plane of both normals: 20°, the uncertainty
/// from friction.
const OFF_PLANE: f64 = 0.34;
/// Minimum weight of a known surface, in sliding contacts.
const LEAST_WEIGHT: f64 = 2.0;
/// Maximum sum of both forces, in measured forces: a corner of 75° or wider, and no wedge.
const MOST_FORCE: f64 = 1.6;
/// Minimum standard deviation of the ball centres on both surfaces, across the corner, in radii:
/// the centres of a ball that bridges the corner lie on one line, to within the noise.
const SPREAD: f64 = 0.03;
/// Minimum standard deviation of the ball centres on one surface that suffices alone, in radii.
const WIDE_SPREAD: f64 = 0.05;
/// Maximum number of surfaces considered.
const MOST: usize = 8;

/// A surface under the ball.
#[derive(Clone, Copy, Debug, Default)]
struct TouchedWall {
    /// Σ W n, weighted towards the nearest
    normal: Vector3<f64>,
    /// unit
    facing: Vector3<f64>,
    weight: f64,
    /// number of means
    count: f64,
    /// Σ d and Σ d dᵀ, d: offset of the centre of a ball that touched it from the centre of the
    /// ball, m and m²
    offset: Vector3<f64>,
    spread: Matrix3<f64>,
}

impl TouchedWall {
    /// Standard deviation of the ball centres on this surface, across the corner with another, m.
    fn width(&self, other: &Self) -> f64 {
        // two surfaces that face the same way form no corner, and have no width
        let across =
            direction(&self.facing.cross(&self.facing.cross(&other.facing))).unwrap_or_default();
        let mean = across.dot(&self.offset) / self.count;
        (across.dot(&(self.spread * across)) / self.count - mean * mean)
            .max(0.0)
            .sqrt()
    }
}

/// The two contacts of a ball of `radius` (m) with its centre at `centre` (m, in O), of which the
/// force along `normal` is the resultant; `None` if it touches one surface, or the two are not
/// known.
pub(in crate::reconstruct) fn double_contact(
    contacts: &ContactMap,
    radius: f64,
    centre: &Point3<f64>,
    normal: &Vector3<f64>,
) -> Option<[Vector3<f64>; 2]> {
    let (walls, count) = walls(contacts, radius, centre, &(centre - normal * radius));
    let known = || {
        walls[..count]
            .iter()
            .filter(|wall| wall.weight >= LEAST_WEIGHT)
    };
    let pairs = known()
        .enumerate()
        .flat_map(|(at, a)| known().skip(at + 1).map(move |b| [a, b]));
    // two bridges of one corner are no walls of another
    let between = pairs.filter(|[a, b]| {
        let is_corner =
            a.facing.dot(&b.facing) < DISTINCT && is_between(normal, &a.facing, &b.facing);
        is_corner && is_wide([a.width(b), b.width(a)], radius)
    });
    between
        .map(|[a, b]| [a.facing, b.facing])
        .min_by(|[a, b], [c, d]| a.dot(b).total_cmp(&c.dot(d)))
}

/// Whether the ball centres on two surfaces spread so wide (m) that neither is a bridge over their
/// corner.
fn is_wide([a, b]: [f64; 2], radius: f64) -> bool {
    a.min(b) > SPREAD * radius || a.max(b) > WIDE_SPREAD * radius
}

/// Splits a double contact into two with half of its weight each; `None` for a single contact.
pub(in crate::reconstruct) fn split(
    contacts: &ContactMap,
    radius: f64,
    centre: &Point3<f64>,
    contact: &SurfaceContact,
) -> Option<[SurfaceContact; 2]> {
    let normals = double_contact(contacts, radius, centre, &contact.normal)?;
    Some(normals.map(|normal| SurfaceContact {
        point: centre - normal * radius,
        normal,
        weight: contact.weight / 2.0,
        ..*contact
    }))
}

/// Whether a mean is an earlier single contact now known to be two.
pub(in crate::reconstruct) fn is_mixed(contacts: &ContactMap, radius: f64, at: u32) -> bool {
    let mean = &contacts.means()[at as usize];
    double_contact(
        contacts,
        radius,
        &(mean.point + mean.normal * radius),
        &mean.normal,
    )
    .is_some()
}

/// The surfaces under a ball, and their number.
///
/// - `point`: the apparent contact point, m; means farther than two radii from there do not
///   count.
fn walls(
    contacts: &ContactMap,
    radius: f64,
    centre: &Point3<f64>,
    point: &Point3<f64>,
) -> ([TouchedWall; MOST], usize) {
    let mut walls = [TouchedWall::default(); MOST];
    let mut count = 0;
    let reach = radius * (1.0 + ON_SURFACE).hypot(NEARBY);
    contacts.near_known(centre, reach, |distance_squared, index| {
        let mean = &contacts.means()[index as usize];
        let weight = contacts.sums(index).weight;
        let height = mean.normal.dot(&(centre - mean.point));
        let aside_squared = distance_squared - height * height;
        let is_on = (height - radius).abs() <= ON_SURFACE * radius
            && aside_squared <= (NEARBY * radius).powi(2);
        if weight == 0.0 || !is_on || (mean.point - point).norm_squared() > (ASKED * radius).powi(2)
        {
            return;
        }
        let cosines = walls[..count]
            .iter()
            .map(|wall| wall.facing.dot(&mean.normal))
            .enumerate();
        let known = cosines
            .filter(|(_, cosine)| *cosine > ALIKE)
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let at = known.map_or(count, |(at, _)| at);
        if at < MOST {
            count = count.max(at + 1);
            let wall = &mut walls[at];
            // walls bend: the nearest mean has their normal here
            let nearness = 1.0 - aside_squared / (NEARBY * radius).powi(2);
            wall.normal += mean.normal * (weight * nearness * nearness);
            wall.facing = direction(&wall.normal).unwrap_or(mean.normal);
            wall.weight += weight;
            let from_ball = mean.point + mean.normal * radius - centre;
            wall.count += 1.0;
            wall.offset += from_ball;
            wall.spread += from_ball * from_ball.transpose();
        }
    });
    (walls, count)
}

/// Whether a direction is a sum of two others, each with a clear share.
fn is_between(normal: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    let cosine = a.dot(b);
    let squared_sine = 1.0 - cosine * cosine;
    // opposite walls determine no plane: anything but the walls themselves is between
    if squared_sine < OFF_PLANE * OFF_PLANE {
        return false;
    }
    let (along_a, along_b) = (normal.dot(a), normal.dot(b));
    let [share_a, share_b] = [
        (along_a - cosine * along_b) / squared_sine,
        (along_b - cosine * along_a) / squared_sine,
    ];
    let off = normal - a * share_a - b * share_b;
    let is_shared = share_a > PRESSED * share_b && share_b > PRESSED * share_a;
    is_shared && share_a + share_b < MOST_FORCE && off.norm() < OFF_PLANE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::ContactSigma;

    const RADIUS: f64 = 1.5e-3;

    fn contact(point: Point3<f64>, normal: Vector3<f64>, weight: f64) -> SurfaceContact {
        SurfaceContact {
            point,
            normal,
            weight,
            stamp_ns: 0,
            sigma: ContactSigma::default(),
        }
    }

    /// Contacts every 0.4 mm on the floor z = 0 and on the wall x = 0, as far as a ball in the
    /// corner reaches.
    fn corner(open: bool) -> ContactMap {
        let mut store = ContactMap::new(0.5e-3, 3e-3, None);
        for i in 0..8 {
            for j in -5..=5 {
                let (a, y) = (RADIUS + f64::from(i) * 0.4e-3, f64::from(j) * 0.4e-3);
                for _ in 0..3 {
                    store.add(&contact(Point3::new(a, y, 0.0), Vector3::z(), 1.0));
                    // the wall goes up from an inner corner, down from an outer edge
                    let (point, normal) = if open {
                        (Point3::new(0.0, y, a), Vector3::x())
                    } else {
                        (Point3::new(0.0, y, -a), -Vector3::x())
                    };
                    store.add(&contact(point, normal, 1.0));
                }
            }
        }
        store
    }

    #[test]
    fn a_ball_in_an_inner_corner_touches_twice_wherever_between_the_force_points() {
        let (store, centre) = (corner(true), Point3::new(RADIUS, 0.1e-3, RADIUS));
        for degrees in [10.0f64, 30.0, 45.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let contact = contact(centre, Vector3::new(sin, 0.0, cos), 1.0);
            let [a, b] = split(&store, RADIUS, &centre, &contact).unwrap();
            for (found, wanted) in [(a, Vector3::z()), (b, Vector3::x())] {
                assert!(found.normal.angle(&wanted) < 1e-9 && found.weight == 0.5);
                assert!((found.point - (centre - wanted * RADIUS)).norm() < 1e-12);
            }
        }
        // the floor alone is pressed, or the ball is 0.2 mm from the wall
        assert_eq!(
            double_contact(
                &store,
                RADIUS,
                &centre,
                &Vector3::new(0.05, 0.0, 1.0).normalize()
            ),
            None
        );
        let beside = centre + Vector3::x() * 0.2e-3;
        assert_eq!(
            double_contact(
                &store,
                RADIUS,
                &beside,
                &Vector3::new(1.0, 0.0, 1.0).normalize()
            ),
            None
        );
    }

    #[test]
    fn a_ball_on_an_outer_edge_touches_once() {
        let store = corner(false);
        for degrees in [5.0f64, 25.0, 45.0, 85.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let normal = Vector3::new(-sin, 0.0, cos);
            assert_eq!(
                double_contact(
                    &store,
                    RADIUS,
                    &(Point3::origin() + normal * RADIUS),
                    &normal
                ),
                None
            );
        }
    }

    #[test]
    fn what_was_taken_for_one_contact_is_dropped_once_both_walls_are_known() {
        let mut store = corner(true);
        let normal = Vector3::new(1.0, 0.0, 1.0).normalize();
        let point = Point3::new(RADIUS, 0.0, RADIUS) - normal * RADIUS;
        store.add(&contact(point, normal, 5.0));
        for at in 0..store.means().len() as u32 {
            let is_mixed = is_mixed(&store, RADIUS, at);
            assert_eq!(store.mark_mixed(at, is_mixed), is_mixed);
        }
        let dropped: Vec<_> = store
            .means()
            .iter()
            .filter(|mean| mean.weight == 0.0)
            .collect();
        assert!(dropped.len() == 1 && (dropped[0].point - point).norm() < 1e-15);
    }
}
