//! Inner corners of two touched surfaces, out of reach of the ball.
//!
//! A ball that touches one surface at c has its centre at c + r n, and there is room for it before
//! the other one, with value f and normal m: f(c) + r n·m ≥ r. Contacts of a hollow that bends from
//! one surface to the other do not keep this distance; contacts beside an inner corner do, and the
//! last of them have no more. Between these both surfaces go straight on to their intersection:
//! nothing else is measurable there, and scans are least accurate in corners.

use crate::reconstruct::evidence::contact_map::ContactMap;
use crate::reconstruct::evidence::piecewise::{FieldParams, FieldScratch, Piece};

/// Cosine of 60°: surfaces at less than that to each other let the ball in as far as the last
/// contacts reach anyway, and at more than 120° they belong to a slot and meet nowhere near.
const STEEP_COSINE: f64 = 0.5;
/// Maximum distance of contacts of both surfaces from the point, in radii: for a corner of 90° the
/// last contacts are one away from it on either side, and the passes of a hand leave gaps.
const TOUCHED_WITHIN: f64 = 1.6;
/// Range beyond the nearest contact that marks the end of a surface, in radii.
const BESIDE: f64 = 0.3;
/// Minimum room, as a share of the room of a ball in the corner: the rest is for noise, and for
/// walls that bend along the corner.
const LEAST_ROOM: f64 = 0.8;
/// Maximum room, as a share of the room of a ball in the corner: beyond it the corner may be as
/// round as the ball or more.
const MOST_ROOM: f64 = 1.3;

/// Whether the surface that decides at the point last evaluated meets another one there in an inner
/// corner out of reach of a ball of `radius` (m).
pub(in crate::reconstruct) fn is_inner_corner(
    contacts: &ContactMap,
    params: &FieldParams,
    radius: f64,
    scratch: &FieldScratch,
) -> bool {
    let is_known = |piece: &Piece| {
        piece.flat_weight >= params.least_weight
            && piece.nearest_squared < (TOUCHED_WITHIN * radius).powi(2)
    };
    let Some(one) = scratch
        .pieces
        .get(scratch.decides as usize)
        .filter(|one| is_known(one))
    else {
        return false;
    };
    (0..).zip(&scratch.pieces).any(|(at, other)| {
        let cosine = one.facing.dot(&other.facing);
        at != scratch.decides
            && is_known(other)
            && cosine.abs() < STEEP_COSINE
            && other.value() >= one.value()
            && is_beside(contacts, radius, scratch, scratch.decides, other)
            && is_beside(contacts, radius, scratch, at, one)
    })
}

/// Whether a ball that touches the piece `at` at its end near the point has room before `other`,
/// and no more than a ball in the corner.
fn is_beside(
    contacts: &ContactMap,
    radius: f64,
    scratch: &FieldScratch,
    at: u32,
    other: &Piece,
) -> bool {
    let piece = &scratch.pieces[at as usize];
    let limit = piece.nearest_squared.sqrt() + BESIDE * radius;
    let members = scratch.near.iter().filter(|member| member.piece == at);
    let points = members.map(|member| contacts.means()[member.index as usize].point);
    let beside = points.filter(|point| (point - scratch.at).norm_squared() < limit * limit);
    let rooms = beside.map(|point| other.facing.dot(&(point.coords - other.point)));
    let room = rooms.fold(f64::INFINITY, f64::min);
    let of_ball = radius * (1.0 - piece.facing.dot(&other.facing));
    (LEAST_ROOM * of_ball..=MOST_ROOM * of_ball).contains(&room)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::reconstruct::{ContactSigma, SurfaceContact};

    const RADIUS: f64 = 1.5e-3;

    /// Contacts every 0.5 mm along y at these places in x and z (mm) with these normals.
    fn store_of(line: &[([f64; 2], [f64; 2])]) -> ContactMap {
        let mut store = ContactMap::new(RADIUS / 3.0, 2.0 * RADIUS, None);
        for (([x, z], normal), j) in line
            .iter()
            .flat_map(|place| (-8..=8).map(move |j| (place, f64::from(j))))
        {
            let (point, normal) = (
                Point3::new(*x, 0.5 * j, *z) * 1e-3,
                Vector3::new(normal[0], 0.0, normal[1]),
            );
            store.add(&SurfaceContact {
                point,
                normal,
                weight: 5.0,
                stamp_ns: 0,
                sigma: ContactSigma::default(),
            });
        }
        store
    }

    /// Contacts of the floor z = 0 and of the wall x = 0, from this distance from the corner on,
    /// mm.
    fn corner(from: f64) -> ContactMap {
        let from_corner = (0..6).map(|i| from + 0.5 * f64::from(i));
        let both = from_corner.flat_map(|a| [([a, 0.0], [0.0, 1.0]), ([0.0, a], [1.0, 0.0])]);
        store_of(&both.collect::<Vec<_>>())
    }

    /// Whether a place in x and z (mm) is in an inner corner, and the value of the field (mm)
    /// there.
    fn found(store: &ContactMap, x: f64, z: f64) -> (bool, f64) {
        let (params, mut scratch) = (FieldParams::for_ball(RADIUS), FieldScratch::default());
        let value = params
            .at(store, &(Point3::new(x, 0.1, z) * 1e-3), &mut scratch)
            .unwrap()
            .value;
        (
            is_inner_corner(store, &params, RADIUS, &scratch),
            value * 1e3,
        )
    }

    #[test]
    fn both_sides_go_on_to_where_they_meet() {
        let corner = corner(1.5);
        for (x, z, value) in [
            (0.2, 0.3, 0.2),
            (0.3, 0.1, 0.1),
            (-0.2, 0.3, -0.2),
            (0.4, -0.3, -0.3),
        ] {
            let (is_corner, found) = found(&corner, x, z);
            assert!(
                is_corner && (found - value).abs() < 1e-9,
                "{x} {z}: {found}"
            );
        }
        // far along the floor, with the wall out of reach
        assert!(!found(&corner, 3.5, 0.1).0);
    }

    #[test]
    fn where_the_ball_has_more_room_the_corner_may_be_round() {
        assert!(!found(&corner(2.2), 0.8, 0.8).0);
    }

    #[test]
    fn a_hollow_is_no_corner() {
        // a groove of radius 2.5 mm around y, touched from wall to wall and evaluated from within
        // the material
        let groove = (0..=18).map(|i| f64::from(i) * 10f64.to_radians());
        let places: Vec<_> = groove
            .map(|a| ([-2.5 * a.cos(), -2.5 * a.sin()], [a.cos(), a.sin()]))
            .collect();
        let store = store_of(&places);
        for degrees in [0.0f64, 20.0, 45.0, 70.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            for radius in [2.2, 2.5, 3.0, 3.6] {
                assert!(
                    !found(&store, -radius * cos, -radius * sin).0,
                    "{degrees} {radius}"
                );
            }
        }
    }
}
