//! Where the ball has been: no material can be there.

use nalgebra::{Point3, Vector3};

use super::contact_store::{around, cell_of};
use super::history::History;
use super::lattice::Node;
use super::table::Table;

/// Cosine of the widest angle between a way and what counts as straight ahead: 45°.
const STRAIGHT: f64 = 0.7;

/// The centres of one cube of the reach's size; `None` where there was none.
type Bin = Option<Vec<Point3<f64>>>;
type BinHistory = History<Node, Bin>;

/// Cubes kept for undoing: some tens of MB.
const MOST_KEPT: usize = 2000;

/// Centres of the ball, thinned to one for each small cell.
#[derive(Clone, Debug)]
pub struct SweptSpace {
    cell: f64,
    reach: f64,
    /// whether a centre of the cube is kept
    thinned: Table<Node, bool>,
    centres: Table<Node, Vec<Point3<f64>>>,
    changed: Vec<Point3<f64>>,
    history: BinHistory,
}

impl SweptSpace {
    /// Nothing swept yet: one centre is kept for each cube of edge `cell` (m), queries go up to `reach` (m).
    pub fn new(cell: f64, reach: f64) -> Self {
        Self {
            cell,
            reach,
            thinned: Table::default(),
            centres: Table::default(),
            changed: Vec::new(),
            history: History::new(MOST_KEPT),
        }
    }

    /// Takes a centre, m, in O.
    pub fn add(&mut self, centre: &Point3<f64>) {
        let (thinned, _) = self.thinned.insert_with(cell_of(centre, self.cell), || false);
        if !std::mem::replace(self.thinned.value_mut(thinned), true) {
            let bin = cell_of(centre, self.reach);
            self.note(bin);
            let (at, _) = self.centres.insert_with(bin, Vec::new);
            self.centres.value_mut(at).push(*centre);
            self.changed.push(*centre);
        }
    }

    /// Forgets the centres nearer to `p` than `distance` (m, up to the reach).
    pub fn forget(&mut self, p: &Point3<f64>, distance: f64) {
        for bin in around(cell_of(p, self.reach)) {
            if !self.centres.contains(&bin) {
                continue;
            }
            self.note(bin);
            let Self { centres, thinned, changed, cell, .. } = self;
            let Some(centres) = centres.get_mut(&bin) else { continue };
            centres.retain(|centre| {
                let stays = (centre - p).norm_squared() >= distance * distance;
                if !stays && let Some(is_kept) = thinned.get_mut(&cell_of(centre, *cell)) {
                    *is_kept = false;
                    changed.push(*centre);
                }
                stays
            });
        }
    }

    fn note(&mut self, bin: Node) {
        let Self { history, centres, .. } = self;
        history.note(bin, || centres.get(&bin).cloned());
    }

    /// The centres that came or went since this was last asked.
    pub fn take_changed(&mut self) -> Vec<Point3<f64>> {
        std::mem::take(&mut self.changed)
    }

    /// Begins a stroke, which can be undone.
    pub fn begin_stroke(&mut self) {
        self.history.begin();
    }

    /// How many strokes can be undone.
    pub fn strokes(&self) -> usize {
        self.history.len()
    }

    /// Takes back what came since the last stroke began. Returns whether there was one.
    pub fn undo(&mut self) -> bool {
        self.exchange(|history, swap| history.undo(swap))
    }

    /// Does again what was undone last. Returns whether there was anything.
    pub fn redo(&mut self) -> bool {
        self.exchange(|history, swap| history.redo(swap))
    }

    fn exchange(&mut self, act: impl FnOnce(&mut BinHistory, &mut dyn FnMut(Node, &mut Bin)) -> bool) -> bool {
        let mut history = std::mem::replace(&mut self.history, History::new(MOST_KEPT));
        let has_changed = act(&mut history, &mut |bin, past| self.swap(bin, past));
        self.history = history;
        self.changed.clear();
        has_changed
    }

    /// Exchanges the centres of a cube with those that were kept; cubes that came last go first.
    fn swap(&mut self, bin: Node, past: &mut Bin) {
        let there = match past.take() {
            None => self.centres.remove(&bin),
            Some(before) => match self.centres.get_mut(&bin) {
                Some(centres) => Some(std::mem::replace(centres, before)),
                None => {
                    self.centres.insert(bin, before);
                    None
                }
            },
        };
        self.mark(there.as_deref().unwrap_or_default(), false);
        *past = there;
        let now = self.centres.get(&bin).cloned().unwrap_or_default();
        self.mark(&now, true);
    }

    fn mark(&mut self, centres: &[Point3<f64>], is_kept: bool) {
        for centre in centres {
            self.thinned.insert(cell_of(centre, self.cell), is_kept);
        }
    }

    /// The centres that were kept.
    pub fn centres(&self) -> impl Iterator<Item = &Point3<f64>> + '_ {
        self.centres.iter().flat_map(|(_, centres)| centres)
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
    pub fn nearest(&self, x: &Point3<f64>) -> Option<(f64, Point3<f64>)> {
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
    fn the_nearest_centre_is_found_up_to_the_reach() {
        let mut swept = SweptSpace::new(0.1e-3, 2e-3);
        for i in 0..1000 {
            swept.add(&Point3::new(f64::from(i) * 1e-5, 0.0, 0.0));
        }
        assert_eq!(swept.centres().count(), 100, "one for each tenth of a millimetre");
        let (distance, centre) = swept.nearest(&Point3::new(5e-3, 1.2e-3, 0.0)).unwrap();
        assert!((distance - 1.2e-3).abs() < 1e-5 && (centre.x - 5e-3).abs() < 1e-4);
        assert_eq!(swept.nearest(&Point3::new(5e-3, 2.1e-3, 0.0)), None);
        // what is forgotten can be swept again
        swept.forget(&Point3::new(5e-3, 0.0, 0.0), 1.01e-3);
        let nearest = |swept: &SweptSpace| swept.nearest(&Point3::new(5e-3, 0.0, 0.0)).unwrap().0;
        assert!(nearest(&swept) > 1e-3 && swept.centres().count() < 82);
        swept.add(&Point3::new(5.01e-3, 0.0, 0.0));
        assert!(nearest(&swept) < 0.02e-3);
    }
}
