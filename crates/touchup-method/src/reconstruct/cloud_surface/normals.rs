//! Point normals: planes through the neighbours, oriented outward.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::clean::UsablePoints;
use super::summary::NormalSource;
use touchup_geometry::mesh::{PointTree, ScanStation, Workers, map_by};

/// Neighbours per plane fit: two rings about a point, enough that noise of one spacing tilts the
/// plane by only a tenth.
const PLANE: u32 = 24;
/// Neighbours along which orientation spreads.
const TURNED: usize = 8;
/// The neighbour whose distance measures the spacing.
const RING: usize = 6;
/// Distance of neighbour [`RING`] on an even surface, in spacings: the circle of that radius,
/// √(6/π), holds six points.
const RING_SPACINGS: f64 = 1.382;

/// Local geometry at a point, from its neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointNeighbourhood {
    /// unit, of either sign
    pub normal: Vector3<f64>,
    /// distance of neighbouring points, m
    pub spacing: f64,
    /// standard deviation of the neighbours from their plane, m
    pub noise: f64,
    /// the nearest other points
    pub nearest: [u32; TURNED],
}

impl PointNeighbourhood {
    /// Neighbourhoods of all points.
    ///
    /// - `positions`: more than [`PLANE`].
    pub(crate) fn of_all(
        positions: &[Point3<f64>],
        tree: &PointTree,
        workers: &dyn Workers,
    ) -> Vec<Self> {
        map_by(workers, positions.len(), |at| Self::of(at, positions, tree))
    }

    fn of(own: usize, positions: &[Point3<f64>], tree: &PointTree) -> Self {
        let p = &positions[own];
        let near: Vec<_> = tree.nearest(p, PLANE + 1, f64::INFINITY).collect();
        let ring = near
            .get(RING)
            .or(near.last())
            .map_or(0.0, |(_, distance)| *distance);
        let count = near.len() as f64;
        let offset = |at: usize| positions[at] - p;
        let mean = near.iter().map(|(at, _)| offset(*at)).sum::<Vector3<f64>>() / count;
        let covariance = near.iter().fold(Matrix3::zeros(), |sum, (at, _)| {
            let from_mean = offset(*at) - mean;
            sum + from_mean * from_mean.transpose()
        });
        // scaled, so that squares of the smallest lengths do not underflow
        let largest = covariance.amax().max(f64::MIN_POSITIVE);
        let planes = (covariance / largest).symmetric_eigen();
        let thinnest = planes.eigenvalues.imin();
        let normal = Unit::try_new(planes.eigenvectors.column(thinnest).into_owned(), 0.0);
        // the plane fit has three parameters
        let noise =
            (planes.eigenvalues[thinnest].max(0.0) * largest / (count - 3.0).max(1.0)).sqrt();
        let normal = normal.map_or(Vector3::z(), Unit::into_inner);
        let mut others = near.iter().map(|(at, _)| *at).filter(|at| *at != own);
        let nearest = std::array::from_fn(|_| others.next().unwrap_or(own) as u32);
        Self {
            normal,
            spacing: ring / RING_SPACINGS,
            noise,
            nearest,
        }
    }
}

/// Outward unit normal of each point, and the source of the orientation.
pub(super) fn oriented(
    points: &UsablePoints,
    near: &[PointNeighbourhood],
) -> (Vec<Vector3<f64>>, NormalSource) {
    let given: Vec<_> = points
        .normals
        .iter()
        .map_while(|n| n.try_normalize(0.0).filter(is_finite))
        .collect();
    if given.len() == points.positions.len() {
        return (given, NormalSource::File);
    }
    let mut normals: Vec<_> = near.iter().map(|near| near.normal).collect();
    let is_known = |station: &ScanStation| station.eye.is_some();
    let is_sure = points.stations.iter().all(|station| station.is_sure);
    if !is_sure {
        turn_along_tree(points, near, &mut normals);
    }
    let seen = share_seen(0..normals.len(), points, &normals);
    if !points.stations.iter().all(is_known) || !is_sure && seen < SEEN {
        return (normals, NormalSource::SpanningTree);
    }
    for (at, normal) in normals.iter_mut().enumerate() {
        if looks_away(at, points, normal) == Some(true) {
            normal.neg_mut();
        }
    }
    (normals, NormalSource::Scanner)
}

/// Minimum share of a surface that faces its own scanner: the rest are edges and noise. For a part
/// scanned from all sides and a wrong scanner position the share is half.
const SEEN: f64 = 0.9;

/// Whether a normal points away from the scanner; `None` for an unknown scanner position.
fn looks_away(at: usize, points: &UsablePoints, normal: &Vector3<f64>) -> Option<bool> {
    Some(normal.dot(&(points.eye(at)? - points.positions[at])) < 0.0)
}

/// Share of normals that face their scanner, among points with a known scanner position; 0.5
/// without any.
fn share_seen(
    piece: impl Iterator<Item = usize>,
    points: &UsablePoints,
    normals: &[Vector3<f64>],
) -> f64 {
    let [seen, known] = piece
        .filter_map(|at| looks_away(at, points, &normals[at]))
        .fold([0.0; 2], |[seen, known], is_away| {
            [seen + f64::from(!is_away), known + 1.0]
        });
    if known > 0.0 { seen / known } else { 0.5 }
}

fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

/// Orients neighbours consistently along a minimum spanning tree with cost 1 − |nᵢ·nⱼ| [Hoppe
/// 1992]; then each connected piece towards the scanner or, failing this, out of the piece.
fn turn_along_tree(
    points: &UsablePoints,
    near: &[PointNeighbourhood],
    normals: &mut [Vector3<f64>],
) {
    let mut pairs: Vec<(u32, [u32; 2])> = Vec::with_capacity(near.len() * TURNED);
    for (at, found) in (0u32..).zip(near) {
        for other in found.nearest {
            // mutual neighbours: once
            if at < other || !near[other as usize].nearest.contains(&at) {
                let cost =
                    (1.0 - normals[at as usize].dot(&normals[other as usize]).abs()).max(0.0);
                pairs.push(((cost * COST_STEPS) as u32, [at, other]));
            }
        }
    }
    pairs.sort_unstable();
    let mut sides = Sides::of(near.len());
    for (_, pair) in pairs {
        let [a, b] = pair.map(|at| normals[at as usize]);
        sides.join(pair, a.dot(&b) < 0.0);
    }
    let mut pieces = vec![Vec::new(); near.len()];
    for (at, normal) in normals.iter_mut().enumerate() {
        let (root, is_opposite) = sides.root(at as u32);
        if is_opposite {
            normal.neg_mut();
        }
        pieces[root as usize].push(at);
    }
    for piece in pieces.iter().filter(|piece| !piece.is_empty()) {
        if !looks_outside(piece, points, normals) {
            piece.iter().for_each(|&at| normals[at].neg_mut());
        }
    }
}

/// Costs as integers have the same order on every platform.
const COST_STEPS: f64 = 1e9;

/// Disjoint sets of points, with the orientation of each point relative to the root of its set
/// (true: opposite).
struct Sides(Vec<(u32, bool)>);

impl Sides {
    fn of(count: usize) -> Self {
        Self((0..count as u32).map(|at| (at, false)).collect())
    }

    /// Root of the set of `at`, and whether `at` is opposite to it; halves the path.
    fn root(&mut self, mut at: u32) -> (u32, bool) {
        let mut is_opposite = false;
        loop {
            let (above, against) = self.0[at as usize];
            if above == at {
                return (at, is_opposite);
            }
            let (next, against_next) = self.0[above as usize];
            self.0[at as usize] = (next, against ^ against_next);
            is_opposite ^= against ^ against_next;
            at = next;
        }
    }

    /// Joins two sets, unless they are one already.
    fn join(&mut self, pair: [u32; 2], is_opposite: bool) {
        let [(a, of_a), (b, of_b)] = pair.map(|at| self.root(at));
        if a != b {
            self.0[a.max(b) as usize] = (a.min(b), is_opposite ^ of_a ^ of_b);
        }
    }
}

/// Whether the normals of a piece point outside: for a closed piece out of it, regardless of any
/// stated scanner position; otherwise towards the scanner or, if the piece gives no consistent view
/// of it, out of the piece. The flux of the normals through a closed surface is thrice its volume.
fn looks_outside(piece: &[usize], points: &UsablePoints, normals: &[Vector3<f64>]) -> bool {
    let (positions, count) = (&points.positions, piece.len() as f64);
    let middle = piece
        .iter()
        .map(|&at| positions[at].coords)
        .sum::<Vector3<f64>>()
        / count;
    let [flux, reach] = piece.iter().fold([0.0; 2], |[flux, reach], &at| {
        let from_middle = positions[at].coords - middle;
        [
            flux + normals[at].dot(&from_middle),
            reach + from_middle.norm(),
        ]
    });
    let sum: Vector3<f64> = piece.iter().map(|&at| normals[at]).sum();
    let seen = share_seen(piece.iter().copied(), points, normals);
    let (has_flux, is_closed) = (flux.abs() > FLAT * reach, sum.norm() < CLOSED * count);
    let agrees = !(1.0 - SEEN..SEEN).contains(&seen);
    if has_flux && (is_closed || !agrees) {
        return flux > 0.0;
    }
    if seen != 0.5 {
        return seen > 0.5;
    }
    if has_flux {
        return flux > 0.0;
    }
    // up, as for a part on a table
    sum[sum.iamax()] >= 0.0
}

/// Maximum flux that noise causes in a flat piece, over the sum of the distances from its middle.
const FLAT: f64 = 0.02;
/// Maximum mean normal of a closed piece: uneven sampling of its sides leaves this share.
const CLOSED: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_follow_every_chain_of_pairs() {
        // 0 ≠ 1 ≠ 2 = 3, and 4 = 5; the last pair closes a circle and adds nothing
        let mut sides = Sides::of(6);
        for (pair, is_opposite) in [
            ([2, 3], false),
            ([0, 1], true),
            ([5, 4], false),
            ([2, 1], true),
            ([3, 0], true),
        ] {
            sides.join(pair, is_opposite);
        }
        let found: Vec<_> = (0..6).map(|at| sides.root(at)).collect();
        assert_eq!(
            found,
            [
                (0, false),
                (0, true),
                (0, false),
                (0, false),
                (4, false),
                (4, false)
            ]
        );
    }
}
