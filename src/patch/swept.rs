//! Where the tip has been: no material can be there.

use nalgebra::{Point3, Vector3};

use super::contact_store::{around, cell_of};
use super::lattice::Node;
use super::table::{Key, Table};
use crate::touch::{TipBody, TipPlace};

/// Cosine of the widest angle between a way and what counts as straight ahead: 45°.
const STRAIGHT: f64 = 0.7;

/// A tip that leans by more than this, as the difference of a component of its axis, is kept beside one in the same cell:
/// 2°, which moves a shaft of two radii by a fourteenth of a radius.
const LEAN: f64 = 0.035;
/// A body that is no ball is told apart from free space up to this share of its scale around it.
const AROUND: f64 = 2.0 / 3.0;

/// A small cell and a range of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Posture {
    cell: Node,
    lean: [i8; 3],
}

impl Key for Posture {
    #[inline]
    fn bits(&self) -> u64 {
        let lean = self.lean.iter().fold(0u64, |bits, &x| bits << 6 | u64::from(x as u8 & 63));
        self.cell.bits() ^ lean << 40
    }
}

/// Places of the tip, thinned to one for each small cell.
#[derive(Clone, Debug)]
pub struct SweptSpace {
    cell: f64,
    reach: f64,
    thinned: Table<Posture, ()>,
    centres: Table<Node, Vec<Point3<f64>>>,
    body: Option<SweptBody>,
}

/// A tip that is no ball.
#[derive(Clone, Debug)]
struct SweptBody {
    tip: TipBody,
    /// by the middles of the balls that hold the tip there, in cells as large as its scale
    places: Table<Node, Vec<TipPlace>>,
}

impl SweptSpace {
    /// Nothing swept yet: one centre is kept for each cube of edge `cell` (m), queries go up to `reach` (m).
    pub fn new(cell: f64, reach: f64) -> Self {
        Self { cell, reach, thinned: Table::default(), centres: Table::default(), body: None }
    }

    /// Nothing swept yet by a tip of any shape, of which one place is kept for each cube of edge `cell` (m).
    pub fn of_tip(tip: TipBody, cell: f64, reach: f64) -> Self {
        if tip.is_ball() {
            return Self::new(cell, reach);
        }
        Self { body: Some(SweptBody { tip, places: Table::default() }), ..Self::new(cell, reach) }
    }

    /// Takes a centre of a ball, m, in O.
    pub fn add(&mut self, centre: &Point3<f64>) {
        self.add_place(&TipPlace { centre: *centre, axis: Vector3::z() });
    }

    /// Takes a place of the tip.
    pub fn add_place(&mut self, TipPlace { centre, axis }: &TipPlace) {
        let lean = if self.body.is_some() { [axis.x, axis.y, axis.z] } else { [0.0; 3] };
        let posture = Posture { cell: cell_of(centre, self.cell), lean: lean.map(|x| (x / LEAN).floor() as i8) };
        let (_, is_new) = self.thinned.insert_with(posture, || ());
        if is_new {
            let (at, _) = self.centres.insert_with(cell_of(centre, self.reach), Vec::new);
            self.centres.value_mut(at).push(*centre);
            if let Some(SweptBody { tip, places }) = &mut self.body {
                let middle = centre + axis * tip.bound().0;
                let (at, _) = places.insert_with(cell_of(&middle, tip.scale()), Vec::new);
                places.value_mut(at).push(TipPlace { centre: *centre, axis: *axis });
            }
        }
    }

    /// The centres that were kept.
    pub fn centres(&self) -> impl Iterator<Item = &Point3<f64>> + '_ {
        self.centres.iter().flat_map(|(_, centres)| centres)
    }

    /// Radius of the balls of [`Self::cover`], m; of a tip that is a ball its `radius`.
    pub fn cover_radius(&self, radius: f64) -> f64 {
        self.body.as_ref().map_or(radius, |body| body.tip.cover().1)
    }

    /// Calls `each` with the middles of balls that together cover what was swept, m.
    pub fn cover(&self, mut each: impl FnMut(&Point3<f64>)) {
        let Some(body) = &self.body else { return self.centres().for_each(each) };
        let (heights, _) = body.tip.cover();
        for TipPlace { centre, axis } in body.places.iter().flat_map(|(_, places)| places) {
            heights.iter().for_each(|&height| each(&(centre + axis * height)));
        }
    }

    /// Whether the way of the ball ended at `centre`, going in `direction` (unit): within `width` (m) all of it is behind.
    pub fn is_end(&self, centre: &Point3<f64>, direction: &Vector3<f64>, width: f64) -> bool {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0f64);
        for bin in around(cell_of(centre, self.reach)) {
            for other in self.centres.get(&bin).into_iter().flatten() {
                if (other - centre).norm_squared() < width * width {
                    sum += other - centre;
                    count += 1.0;
                }
            }
        }
        // on a straight way the mean is half the width behind
        let behind = -sum.dot(direction) / count.max(1.0);
        behind > STRAIGHT * sum.norm() / count.max(1.0) && behind > width / 4.0
    }

    /// Distance from `x` to the nearest centre, m, and that centre; `None` beyond the reach.
    ///
    /// Of a tip that is no ball it is the signed distance from its body plus its scale: like a ball of that radius.
    pub fn nearest(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
        if let Some(body) = &self.body {
            return body.nearest(x);
        }
        let mut best = (self.reach * self.reach, None);
        for bin in around(cell_of(x, self.reach)) {
            for centre in self.centres.get(&bin).into_iter().flatten() {
                let distance_squared = (centre - x).norm_squared();
                if distance_squared < best.0 {
                    best = (distance_squared, Some(*centre));
                }
            }
        }
        best.1.map(|centre| (best.0.sqrt(), centre))
    }
}

impl SweptBody {
    /// As [`SweptSpace::nearest`].
    fn nearest(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
        let (middle, bound) = self.tip.bound();
        let size = self.tip.scale();
        let mut best = (AROUND * size, None);
        let (home, steps) = (cell_of(x, size), ((bound + best.0) / size).ceil() as i32);
        for cell in (-steps..=steps)
            .flat_map(|i| (-steps..=steps).flat_map(move |j| (-steps..=steps).map(move |k| [i, j, k])))
            .map(|step| [0, 1, 2].map(|i| home[i].saturating_add(step[i])))
        {
            let limit = |distance: f64| (bound + distance).max(0.0).powi(2);
            if cell_distance_squared(&cell, size, x) >= limit(best.0) {
                continue;
            }
            for place in self.places.get(&cell).into_iter().flatten() {
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

/// Squared distance of a point from a cell of edge `size`, m².
fn cell_distance_squared(cell: &Node, size: f64, x: &Point3<f64>) -> f64 {
    (0..3).map(|i| (f64::from(cell[i]) * size - x[i]).max(x[i] - f64::from(cell[i] + 1) * size).max(0.0).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_ends_where_all_of_it_is_behind() {
        let mut swept = SweptSpace::new(0.1e-3, 2e-3);
        for i in 0..=100 {
            swept.add(&Point3::new(0.0, 0.0, f64::from(i) * -1e-4));
        }
        let [top, middle, bottom] = [0.0, -5e-3, -1e-2].map(|z| Point3::new(0.0, 0.0, z));
        assert!(swept.is_end(&bottom, &-Vector3::z(), 1e-3) && swept.is_end(&top, &Vector3::z(), 1e-3));
        assert!(!swept.is_end(&bottom, &Vector3::z(), 1e-3) && !swept.is_end(&bottom, &Vector3::x(), 1e-3));
        assert!(!swept.is_end(&middle, &-Vector3::z(), 1e-3) && !swept.is_end(&middle, &Vector3::x(), 1e-3));
    }

    #[test]
    fn a_flat_end_sweeps_its_whole_width_and_a_cone_its_flank() {
        use crate::touch::TipShape;
        let shapes = [
            (TipShape::Flat { edge_radius: 0.0, length: 4e-3 }, 2e-3, 2e-3, 0.0),
            (
                TipShape::Cone { half_angle: 0.5, length: 4e-3 },
                0.3e-3,
                0.5f64.tan() * 2e-3 + 0.3e-3 / 0.5f64.cos(),
                -0.3e-3,
            ),
        ];
        for (shape, radius, wide, low) in shapes {
            let tip = TipBody::new(shape, radius).unwrap();
            let mut swept = SweptSpace::of_tip(tip, 0.1e-3, 1.0);
            // along x, upright: 2 mm above its origin the tip is `wide` to either side
            for i in 0..=100 {
                let centre = Point3::new(f64::from(i) * 1e-4, 0.0, 0.0);
                swept.add_place(&TipPlace { centre, axis: Vector3::z() });
            }
            let depth = |y: f64, z: f64| swept.nearest(&Point3::new(5e-3, y, z)).map(|found| tip.scale() - found.0);
            assert!(depth(wide - 0.05e-3, 2e-3).unwrap() > 0.0 && depth(wide + 0.05e-3, 2e-3).unwrap() < 0.0);
            assert!(depth(0.0, low - 0.05e-3).unwrap() < 0.0);
            assert_eq!(depth(0.0, low - 2e-3), None, "far below");
            let (mut covered, mut farthest) = (0, 0.0f64);
            swept.cover(|middle| {
                covered += 1;
                farthest = farthest.max(middle.y.abs());
            });
            assert!(covered >= 101 && farthest == 0.0 && swept.cover_radius(0.0) >= wide);
        }
    }

    #[test]
    fn the_nearest_centre_is_found_up_to_the_reach() {
        let mut swept = SweptSpace::new(0.1e-3, 2e-3);
        for i in 0..1000 {
            swept.add(&Point3::new(f64::from(i) * 1e-5, 0.0, 0.0));
        }
        assert_eq!(swept.centres().count(), 100, "one for each tenth of a millimetre");
        let (distance, centre) = swept.nearest(&Point3::new(5e-3, 1.2e-3, 0.0)).unwrap();
        assert!((distance - 1.2e-3).abs() < 1e-5 && (centre.x - 5e-3).abs() < 1e-4);
        assert_eq!(swept.nearest(&Point3::new(5e-3, 2.1e-3, 0.0)), None);
    }
}
