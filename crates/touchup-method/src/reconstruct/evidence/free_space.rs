//! Free space: the swept volume of the tip, which holds no material.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::voxel_set::{VoxelElement, VoxelSet};
use crate::reconstruct::history::Direction;
use crate::reconstruct::lattice::{CellBox, LatticeNode};
use crate::reconstruct::table::Key;
use crate::stylus::{TipBody, TipPlace};
use touchup_geometry::numeric::{voxel_neighbourhood, voxel_of};

/// Cosine of the maximum angle between a path and straight ahead: 45°.
const STRAIGHT: f64 = 0.7;
/// Lean, as the difference of a component of its axis, that separates two tips in the same cell:
/// 2°, which moves a shaft of two radii by a fourteenth of a radius.
const LEAN: f64 = 0.035;
/// Range of free space around a body that is no ball, as a share of its scale.
const AROUND: f64 = 2.0 / 3.0;

/// Places of the tip, one per voxel.
#[derive(Clone, Debug)]
pub(crate) struct FreeSpace {
    reach: f64,
    centres: VoxelSet<Point3<f64>>,
    body: Option<SweptVolume>,
    changed: Vec<Point3<f64>>,
}

/// A tip that is no ball.
#[derive(Clone, Debug)]
struct SweptVolume {
    tip: TipBody,
    /// by the middles of the tip's bounding balls, in cells as large as its scale
    places: VoxelSet<TipPlace>,
}

/// A small cell and a range of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reconstruct) struct Posture {
    cell: LatticeNode,
    lean: [i8; 3],
}

impl Key for Posture {
    #[inline]
    fn bits(&self) -> u64 {
        let lean = self
            .lean
            .iter()
            .fold(0u64, |bits, &x| bits << 6 | u64::from(x as u8 & 63));
        self.cell.bits() ^ lean << 40
    }
}

impl VoxelElement for Point3<f64> {
    type Key = LatticeNode;
    fn key(&self, cell: f64) -> LatticeNode {
        voxel_of(self, cell)
    }
}

impl VoxelElement for TipPlace {
    type Key = Posture;
    fn key(&self, cell: f64) -> Posture {
        let lean = [self.axis.x, self.axis.y, self.axis.z].map(|x| (x / LEAN).floor() as i8);
        Posture {
            cell: voxel_of(&self.centre, cell),
            lean,
        }
    }
}

impl FreeSpace {
    /// Empty, with one place for each cube of edge `cell` (m); queries of a ball go up to `reach`
    /// (m).
    pub(crate) fn new(tip: TipBody, cell: f64, reach: f64) -> Self {
        let body = (!tip.is_ball()).then(|| SweptVolume {
            tip,
            places: VoxelSet::new(cell),
        });
        Self {
            reach,
            centres: VoxelSet::new(cell),
            body,
            changed: Vec::new(),
        }
    }

    /// Whether the tip is a ball.
    pub(crate) fn is_of_ball(&self) -> bool {
        self.body.is_none()
    }

    /// Adds a place of the tip.
    pub(crate) fn add_place(&mut self, place: &TipPlace) {
        let centre = &place.centre;
        let is_new = self.centres.add(voxel_of(centre, self.reach), *centre);
        match &mut self.body {
            None => self.changed.extend(is_new.then_some(*centre)),
            Some(body) => {
                if body.places.add(body.bin(place), *place) {
                    body.cover(place, |middle| self.changed.push(*middle));
                }
            }
        }
    }

    /// Forgets places of the tip with its middle nearer to `p` than `distance` (m, up to the
    /// reach); for a tip that is no ball, with its surface as near as that of a ball of its scale.
    pub(crate) fn forget(&mut self, p: &Point3<f64>, distance: f64) {
        let Self {
            reach,
            centres,
            body,
            changed,
        } = self;
        for bin in voxel_neighbourhood(voxel_of(p, *reach)) {
            let stays = |centre: &Point3<f64>| (centre - p).norm_squared() >= distance * distance;
            centres.retain(bin, stays, |centre| changed.push(*centre));
        }
        let Some(SweptVolume { tip, places }) = body else {
            return;
        };
        for bin in bins_around(p, tip.scale(), tip.bound().1 + distance).iter() {
            let stays = |place: &TipPlace| tip.signed_distance(place, p) + tip.scale() >= distance;
            places.retain(bin, stays, |place| changed.push(place.centre));
        }
    }

    /// Middles of balls that cover the places added or removed since the last call.
    pub(crate) fn take_changed(&mut self) -> Vec<Point3<f64>> {
        std::mem::take(&mut self.changed)
    }

    /// Begins an undoable stroke.
    pub(crate) fn begin_stroke(&mut self) {
        self.centres.begin_stroke();
        self.body
            .iter_mut()
            .for_each(|body| body.places.begin_stroke());
    }

    /// Number of undoable strokes.
    pub(crate) fn strokes(&self) -> usize {
        self.body
            .as_ref()
            .map_or(usize::MAX, |body| body.places.strokes())
            .min(self.centres.strokes())
    }

    /// Undoes the last stroke, or redoes the last undone one; returns whether there was one.
    pub(crate) fn exchange(&mut self, direction: Direction) -> bool {
        self.changed.clear();
        if let Some(body) = &mut self.body {
            body.places.exchange(direction);
        }
        self.centres.exchange(direction)
    }

    /// Centres of the tip in memory.
    pub(crate) fn centres(&self) -> impl Iterator<Item = &Point3<f64>> + '_ {
        self.centres.iter()
    }

    /// Radius of the balls of [`Self::cover`], m; `radius` for a ball tip.
    pub(crate) fn cover_radius(&self, radius: f64) -> f64 {
        self.body.as_ref().map_or(radius, |body| body.tip.cover().1)
    }

    /// Calls `each` with the middles of balls that together cover the swept volume, m.
    pub(crate) fn cover(&self, mut each: impl FnMut(&Point3<f64>)) {
        match &self.body {
            None => self.centres().for_each(each),
            Some(body) => body
                .places
                .iter()
                .for_each(|place| body.cover(place, &mut each)),
        }
    }

    /// Whether the path of the ball ended at `centre`, going in `direction` (unit): within `width`
    /// (m) all of it is behind.
    pub(crate) fn is_end(
        &self,
        centre: &Point3<f64>,
        direction: &Vector3<f64>,
        width: f64,
    ) -> bool {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0f64);
        for other in self
            .around(centre)
            .filter(|other| (*other - centre).norm_squared() < width * width)
        {
            sum += other - centre;
            count += 1.0;
        }
        // on a straight path the mean is half the width behind
        let behind = -sum.dot(direction) / count.max(1.0);
        behind > STRAIGHT * sum.norm() / count.max(1.0) && behind > width / 4.0
    }

    /// Distance from `x` to the nearest centre, m, and that centre; `None` beyond the reach.
    ///
    /// For a tip that is no ball, the signed distance from its body plus its scale: like a ball of
    /// that radius.
    pub(crate) fn nearest(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
        if let Some(body) = &self.body {
            return body.nearest(x);
        }
        let all = self
            .around(x)
            .map(|centre| ((centre - x).norm_squared(), *centre));
        let near = all.filter(|(distance_squared, _)| *distance_squared < self.reach * self.reach);
        let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(distance_squared, centre)| (distance_squared.sqrt(), centre))
    }

    /// Centres possibly within the reach of a point.
    fn around(&self, x: &Point3<f64>) -> impl Iterator<Item = &Point3<f64>> + '_ {
        voxel_neighbourhood(voxel_of(x, self.reach)).flat_map(|bin| self.centres.get(&bin))
    }
}

impl SweptVolume {
    /// The cell of a place.
    fn bin(&self, place: &TipPlace) -> LatticeNode {
        voxel_of(
            &(place.centre + place.axis * self.tip.bound().0),
            self.tip.scale(),
        )
    }

    /// Calls `each` with the middles of balls that cover the tip at a place.
    fn cover(&self, TipPlace { centre, axis }: &TipPlace, mut each: impl FnMut(&Point3<f64>)) {
        let (heights, _) = self.tip.cover();
        heights
            .iter()
            .for_each(|&height| each(&(centre + axis * height)));
    }

    /// As [`FreeSpace::nearest`].
    fn nearest(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
        let (middle, bound) = self.tip.bound();
        let size = self.tip.scale();
        let mut best = (AROUND * size, None);
        for cell in bins_around(x, size, bound + best.0).iter() {
            let limit = |distance: f64| (bound + distance).max(0.0).powi(2);
            if cell_distance_squared(&cell, size, x) >= limit(best.0) {
                continue;
            }
            for place in self.places.get(&cell) {
                if (x - (place.centre + place.axis * middle)).norm_squared() < limit(best.0) {
                    let distance = self.tip.signed_distance(place, x);
                    if distance < best.0 {
                        best = (distance, Some(place.centre));
                    }
                }
            }
        }
        best.1.map(|centre| (best.0 + size, centre))
    }
}

/// The cells of edge `size` nearer to `x` than `reach` (m), and some more.
fn bins_around(x: &Point3<f64>, size: f64, reach: f64) -> CellBox {
    let (home, steps) = (voxel_of(x, size), (reach / size).ceil() as i32);
    CellBox { lo: home, hi: home }.widened(steps, steps)
}

/// Squared distance of a point from a cell of edge `size`, m².
fn cell_distance_squared(cell: &LatticeNode, size: f64, x: &Point3<f64>) -> f64 {
    (0..3)
        .map(|i| {
            (f64::from(cell[i]) * size - x[i])
                .max(x[i] - f64::from(cell[i] + 1) * size)
                .max(0.0)
                .powi(2)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stylus::TipShape;

    fn upright(centre: Point3<f64>) -> TipPlace {
        TipPlace {
            centre,
            axis: Vector3::z(),
        }
    }

    #[test]
    fn a_path_ends_where_all_of_it_is_behind() {
        let mut free_space =
            FreeSpace::new(TipBody::new(TipShape::Ball, 1e-3).unwrap(), 0.1e-3, 2e-3);
        for i in 0..=100 {
            free_space.add_place(&upright(Point3::new(0.0, 0.0, f64::from(i) * -1e-4)));
        }
        let [top, middle, bottom] = [0.0, -5e-3, -1e-2].map(|z| Point3::new(0.0, 0.0, z));
        assert!(
            free_space.is_end(&bottom, &-Vector3::z(), 1e-3)
                && free_space.is_end(&top, &Vector3::z(), 1e-3)
        );
        assert!(
            !free_space.is_end(&bottom, &Vector3::z(), 1e-3)
                && !free_space.is_end(&bottom, &Vector3::x(), 1e-3)
        );
        assert!(
            !free_space.is_end(&middle, &-Vector3::z(), 1e-3)
                && !free_space.is_end(&middle, &Vector3::x(), 1e-3)
        );
    }

    #[test]
    fn a_flat_end_sweeps_its_whole_width_and_a_cone_its_flank() {
        let shapes = [
            (
                TipShape::Flat {
                    edge_radius: 0.0,
                    length: 4e-3,
                },
                2e-3,
                2e-3,
                0.0,
            ),
            (
                TipShape::Cone {
                    half_angle: 0.5,
                    length: 4e-3,
                },
                0.3e-3,
                0.5f64.tan() * 2e-3 + 0.3e-3 / 0.5f64.cos(),
                -0.3e-3,
            ),
        ];
        for (shape, radius, wide, low) in shapes {
            let tip = TipBody::new(shape, radius).unwrap();
            let mut free_space = FreeSpace::new(tip, 0.1e-3, 1.0);
            // along x, upright: 2 mm above its origin the tip is `wide` to either side
            for i in 0..=100 {
                let centre = Point3::new(f64::from(i) * 1e-4, 0.0, 0.0);
                free_space.add_place(&TipPlace {
                    centre,
                    axis: Vector3::z(),
                });
            }
            let depth = |y: f64, z: f64| {
                free_space
                    .nearest(&Point3::new(5e-3, y, z))
                    .map(|found| tip.scale() - found.0)
            };
            assert!(
                depth(wide - 0.05e-3, 2e-3).unwrap() > 0.0
                    && depth(wide + 0.05e-3, 2e-3).unwrap() < 0.0
            );
            assert!(depth(0.0, low - 0.05e-3).unwrap() < 0.0);
            assert_eq!(depth(0.0, low - 2e-3), None, "far below");
            let (mut covered, mut farthest) = (0, 0.0f64);
            free_space.cover(|middle| {
                covered += 1;
                farthest = farthest.max(middle.y.abs());
            });
            assert!(covered >= 101 && farthest == 0.0 && free_space.cover_radius(0.0) >= wide);
        }
    }

    #[test]
    fn the_nearest_centre_is_found_up_to_the_reach() {
        let mut free_space =
            FreeSpace::new(TipBody::new(TipShape::Ball, 1e-3).unwrap(), 0.1e-3, 2e-3);
        for i in 0..1000 {
            free_space.add_place(&upright(Point3::new(f64::from(i) * 1e-5, 0.0, 0.0)));
        }
        assert_eq!(
            free_space.centres().count(),
            100,
            "one for each tenth of a millimetre"
        );
        let (distance, centre) = free_space.nearest(&Point3::new(5e-3, 1.2e-3, 0.0)).unwrap();
        assert!((distance - 1.2e-3).abs() < 1e-5 && (centre.x - 5e-3).abs() < 1e-4);
        assert_eq!(free_space.nearest(&Point3::new(5e-3, 2.1e-3, 0.0)), None);
        // forgotten space can be swept again
        free_space.forget(&Point3::new(5e-3, 0.0, 0.0), 1.01e-3);
        let nearest =
            |free_space: &FreeSpace| free_space.nearest(&Point3::new(5e-3, 0.0, 0.0)).unwrap().0;
        assert!(nearest(&free_space) > 1e-3 && free_space.centres().count() < 82);
        free_space.add_place(&upright(Point3::new(5.01e-3, 0.0, 0.0)));
        assert!(nearest(&free_space) < 0.02e-3);
    }
}
