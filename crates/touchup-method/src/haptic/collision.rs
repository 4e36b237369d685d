//! Self-collision: an exact test of each pair of faces that could meet, with none until it could
//! meet again.

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::triangle::{Extent, are_apart, extent, meet};
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId, triangle};
use touchup_geometry::numeric::{direction, length_and_direction};

type TrianglePoints = [Point3<f64>; 3];

/// Share of the altitude up to which the bound on a turning normal in [`margin_at_corner`] holds.
const SMALL_TURN: f64 = 0.1;

/// Room for pairs per face.
const PAIRS_PER_FACE: usize = 16;

/// Two faces that share no edge.
#[derive(Clone, Copy, Debug)]
struct FacePair {
    faces: [FaceId; 2],
    /// index of the common corner in either face
    common: Option<[u8; 2]>,
    /// motion of the vertices before which the pair cannot meet, m
    safe_until: f64,
}

/// All pairs of a region that could meet.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    list: Vec<FacePair>,
    /// motion of the fastest vertex since the start of the list, m
    travel: f64,
}

impl Pairs {
    /// Forgets all pairs.
    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.travel = 0.0;
    }

    /// Finds the pairs of `face` and each of `others` that are within `margin` (m) and `is_wanted`,
    /// unless they share an edge: neighbours fold, they do not pierce.
    ///
    /// - `is_smooth`: whether two faces in a fan around this vertex cannot meet.
    pub(crate) fn add_near(
        &mut self,
        mesh: &TriMesh,
        face: FaceId,
        others: &[(FaceId, Extent)],
        margin: f64,
        is_wanted: impl Fn(FaceId) -> bool,
        is_smooth: impl Fn(VertexId) -> bool,
    ) {
        let (here, corners) = (extent(&mesh.triangle(face)), mesh.corners(face));
        for &(other, there) in others {
            if are_apart(&here, &there, margin) || !is_wanted(other) {
                continue;
            }
            let others = mesh.corners(other);
            let mut shared = (0..3).filter_map(|i| {
                let at = others.iter().position(|other| *other == corners[i])?;
                Some([i as u8, at as u8])
            });
            let common = shared.next();
            let is_in_fan = common.is_some_and(|[at, _]| is_smooth(corners[at as usize]));
            if shared.next().is_none() && !is_in_fan {
                self.list.push(FacePair {
                    faces: [face, other],
                    common,
                    safe_until: 0.0,
                });
            }
        }
    }

    /// Makes room for the pairs of `faces` moving faces: a dozen neighbours over a corner each, and
    /// some more.
    pub(crate) fn reserve(&mut self, faces: usize) {
        self.list.reserve(PAIRS_PER_FACE * faces);
    }

    /// Whether no pair has begun to meet by an update whose largest step is `displacement` (m).
    ///
    /// - `gap`: distance below which faces meet, m.
    /// - `before`: position of a vertex before the update, m; a pair that met then may go on.
    pub(crate) fn are_clear(
        &mut self,
        mesh: &TriMesh,
        gap: f64,
        displacement: f64,
        before: impl Fn(VertexId) -> Point3<f64>,
    ) -> bool {
        let travel = self.travel;
        self.list.iter_mut().all(|pair| {
            if travel + displacement <= pair.safe_until {
                return true;
            }
            let [t, u] = pair.faces.map(|face| mesh.triangle(face));
            if meet(&t, &u, pair.common, gap) {
                let [t, u] = pair.faces.map(|face| mesh.corners(face).map(&before));
                return meet(&t, &u, pair.common, gap);
            }
            // after a withdrawn update the pair is `displacement` away from the tested state
            pair.safe_until = travel + margin(&t, &u, pair.common, gap) - displacement;
            true
        })
    }

    /// Finds the motion before which each pair that does not meet now cannot meet: until then no
    /// update needs to test it.
    ///
    /// - `gap`: as in [`Self::are_clear`].
    pub(crate) fn measure(&mut self, mesh: &TriMesh, gap: f64) {
        let travel = self.travel;
        for pair in &mut self.list {
            let [t, u] = pair.faces.map(|face| mesh.triangle(face));
            if !meet(&t, &u, pair.common, gap) {
                pair.safe_until = travel + margin(&t, &u, pair.common, gap);
            }
        }
    }

    /// Takes an update whose largest step is `displacement` (m).
    pub(crate) fn accept(&mut self, displacement: f64) {
        self.travel += displacement;
    }
}

/// Motion of the vertices before which two faces cannot meet, m; 0 without a simple bound.
fn margin(t: &TrianglePoints, u: &TrianglePoints, common: Option<[u8; 2]>, gap: f64) -> f64 {
    match common.map(|pair| pair.map(usize::from)) {
        Some([i, j]) => margin_at_corner(t, i, u, j)
            .max(margin_at_corner(u, j, t, i))
            .max(margin_between_arms(t, i, u, j)),
        None => {
            let (a, b) = (extent(t), extent(u));
            let boxes = (0..3)
                .map(|i| (a.0[i] - b.1[i]).max(b.0[i] - a.1[i]))
                .fold(f64::NEG_INFINITY, f64::max);
            let widest = boxes
                .max(height_above(t, u))
                .max(height_above(u, t))
                .max(beside(t, u))
                .max(beside(u, t));
            // both faces may come closer
            (0.5 * (widest - gap)).max(0.0)
        }
    }
}

/// Distance of all of `u` beyond an edge of `t`, along its plane and across that edge, m; negative
/// if not all of `u` is beyond.
fn beside(t: &TrianglePoints, u: &TrianglePoints) -> f64 {
    let normal = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let beyond = |i: usize| {
        let (start, end) = (t[i], t[(i + 1) % 3]);
        let across = direction(&(end - start).cross(&normal))?;
        Some(
            u.iter()
                .map(|p| across.dot(&(p - start)))
                .fold(f64::INFINITY, f64::min),
        )
    };
    (0..3).filter_map(beyond).fold(f64::NEG_INFINITY, f64::max)
}

/// Motion of the vertices before which two faces with a common corner, `i` of `t` and `j` of `u`,
/// cannot meet beside it, m: a plane through the corner has one face on either side. Tries the
/// planes halfway between an edge of one and an edge of the other.
///
/// The height of a point above a plane through the corner, of fixed direction, changes by no more
/// than 2 m when both move by m.
fn margin_between_arms(t: &TrianglePoints, i: usize, u: &TrianglePoints, j: usize) -> f64 {
    let arms_of = |triangle: &TrianglePoints, at: usize| {
        [1, 2].map(|next| triangle[(at + next) % 3] - triangle[at])
    };
    let (here, there) = (arms_of(t, i), arms_of(u, j));
    let [Some(a), Some(b), Some(c), Some(d)] =
        [here[0], here[1], there[0], there[1]].map(|arm| direction(&arm))
    else {
        return 0.0;
    };
    let height = |across: Vector3<f64>| {
        let across = direction(&across)?;
        let heights = here
            .iter()
            .map(|arm| across.dot(arm))
            .chain(there.iter().map(|arm| -across.dot(arm)));
        Some(heights.fold(f64::INFINITY, f64::min))
    };
    let widest = [a - c, a - d, b - c, b - d]
        .into_iter()
        .filter_map(height)
        .fold(0.0, f64::max);
    0.5 * widest
}

/// Distance of all of `u` on one side of the plane of `t`, m; negative if it is on both.
fn height_above(t: &TrianglePoints, u: &TrianglePoints) -> f64 {
    let Some(normal) = direction(&(t[1] - t[0]).cross(&(t[2] - t[0]))) else {
        return f64::NEG_INFINITY;
    };
    let heights = u.map(|p| normal.dot(&(p - t[0])));
    let (low, high) = heights
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &h| {
            (a.min(h), b.max(h))
        });
    low.max(-high)
}

/// Motion of the vertices before which the edge of `u` across its corner `j`, the same as corner
/// `i` of `t`, cannot reach the plane of `t`, m.
///
/// The height of a point at distance r from the corner changes by no more than 2 m + r |Δn| when
/// all vertices move by m, and |Δn| ≤ 3 m / altitude for small m.
fn margin_at_corner(t: &TrianglePoints, i: usize, u: &TrianglePoints, j: usize) -> f64 {
    let double = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let (area, normal) = length_and_direction(&double);
    if area == 0.0 {
        return 0.0;
    }
    let altitude = (triangle::shape_quality(t, area) * area).sqrt();
    let arms = [u[(j + 1) % 3] - t[i], u[(j + 2) % 3] - t[i]];
    let [a, b] = arms.map(|arm| normal.dot(&arm));
    if a * b <= 0.0 {
        return 0.0;
    }
    let reach = arms[0].norm().max(arms[1].norm());
    if altitude == 0.0 {
        return 0.0;
    }
    (a.abs().min(b.abs()) / (2.0 + 4.0 * reach / altitude)).min(SMALL_TURN * altitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn a_pair_is_safe_for_half_its_distance_and_no_longer() {
        let t = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0)];
        let u = t.map(|p| p + Vector3::new(0.1, 0.1, 0.3));
        assert!((margin(&t, &u, None, 0.1) - 0.1).abs() < 1e-15);
        let through = [at(0.2, 0.2, -1.0), at(0.3, 0.2, 1.0), at(0.2, 0.3, 1.0)];
        assert!(meet(&t, &through, None, 0.0));
        assert_eq!(margin(&t, &through, None, 0.0), 0.0);
    }

    /// A small generator of its own, from −0.5 to 0.5.
    fn random() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        }
    }

    /// 2,000 pairs without a common corner, nearly in one plane or anywhere, moved by the margin in
    /// random directions.
    #[test]
    fn no_motion_within_the_margin_makes_faces_meet() {
        let (mut next, mut tried) = (random(), 0);
        while tried < 2_000 {
            let height = if tried % 2 == 0 { 0.01 } else { 1.0 };
            let mut point = || at(next(), next(), height * next());
            let (t, u) = ([point(), point(), point()], [point(), point(), point()]);
            let margin = margin(&t, &u, None, 0.0);
            if meet(&t, &u, None, 0.0) || margin == 0.0 {
                continue;
            }
            tried += 1;
            let mut step = || Vector3::new(next(), next(), next()).normalize() * margin;
            let [t, u] = [t, u].map(|face| face.map(|corner| corner + step()));
            assert!(!meet(&t, &u, None, 0.0), "{t:?} {u:?}");
        }
    }

    #[test]
    fn faces_beside_each_other_in_a_plane_can_move_by_a_share_of_what_is_between_them() {
        let corner = at(0.0, 0.0, 0.0);
        let [x, up, y, left] = [
            at(1.0, 0.0, 0.0),
            at(1.0, 1.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(-1.0, 1.0, 0.0),
        ];
        // 45° between the nearest edges of a fan, and a plane halfway
        let between = margin(&[corner, x, up], &[corner, y, left], Some([0, 0]), 0.0);
        assert!(
            (between - 0.5 * std::f64::consts::FRAC_PI_8.sin()).abs() < 1e-15,
            "{between}"
        );
        // across the diagonal, where boxes and planes of the faces overlap
        let beyond = [at(1.0, 0.2, 0.0), at(1.0, 1.0, 0.0), at(0.2, 1.0, 0.0)];
        let across = margin(&[corner, x, y], &beyond, None, 0.0);
        assert!(
            (across - 0.5 * 0.2 * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-15,
            "{across}"
        );
    }

    /// 2,000 pairs with a common corner, moved by the margin in random directions.
    #[test]
    fn no_motion_within_the_margin_makes_faces_at_a_corner_meet() {
        let (mut next, mut tried) = (random(), 0);
        while tried < 2_000 {
            let mut point = || at(next(), next(), next());
            let corner = point();
            let (t, u) = ([corner, point(), point()], [point(), corner, point()]);
            let margin = margin(&t, &u, Some([0, 1]), 0.0);
            if meet(&t, &u, Some([0, 1]), 0.0) || margin == 0.0 {
                continue;
            }
            tried += 1;
            let mut step = || Vector3::new(next(), next(), next()).normalize() * margin;
            let moved = corner + step();
            let (t, u) = (
                [moved, t[1] + step(), t[2] + step()],
                [u[0] + step(), moved, u[2] + step()],
            );
            assert!(!meet(&t, &u, Some([0, 1]), 0.0), "{t:?} {u:?}");
        }
    }
}
