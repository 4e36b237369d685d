//! What was touched, thinned to one mean contact for each small cell and facing.
//!
//! Nothing is ever integrated into a field: the field is evaluated anew from what is stored here.

use nalgebra::{Point3, Vector3};

use super::history::History;
use super::lattice::Node;
use super::table::{Key, Table};
use super::touches::Contact;

/// The mean of the contacts in one cell that face alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanContact {
    /// m, in O
    pub point: Point3<f64>,
    /// unit, in O
    pub normal: Vector3<f64>,
    /// sum of the weights; 0 for one that was refuted
    pub weight: f64,
    /// normals close by differ much: the ball rolled over an edge here
    pub is_fan: bool,
}

/// A small cell and a range of normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bin {
    cell: Node,
    facing: [i8; 3],
}

impl Key for Bin {
    #[inline]
    fn bits(&self) -> u64 {
        let facing = self.facing.iter().fold(0u64, |bits, &x| bits << 4 | u64::from(x as u8 & 15));
        self.cell.bits() ^ facing << 48
    }
}

#[derive(Clone, Copy, Debug)]
struct Sums {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    weight: f64,
    /// whether it stands in [`ContactStore::changed`]
    is_noted: bool,
    /// the mean when it was last told
    told: (Point3<f64>, Vector3<f64>),
    /// the cell in [`ContactStore::nearby`]
    home: Node,
}

/// One mean with all that the store knows of it.
#[derive(Clone, Copy, Debug)]
struct Kept {
    bin: Bin,
    sums: Sums,
    mean: MeanContact,
}

/// Contacts, by place and facing.
#[derive(Clone, Debug)]
pub struct ContactStore {
    cell: f64,
    reach: f64,
    of_bin: Table<Bin, ()>,
    sums: Vec<Sums>,
    means: Vec<MeanContact>,
    nearby: Table<Node, Vec<u32>>,
    changed: Vec<u32>,
    history: History<u32, Option<Kept>>,
}

/// Normals whose components differ by less than this share a mean.
const FACING: f64 = 0.25;
/// Means kept for undoing: 60 MB at most.
const MOST_KEPT: usize = 200_000;
/// A mean is told again when it has shifted along its normal by more than this, in cells: 5 µm for a ball of 1.5 mm …
const SHIFT: f64 = 0.01;
/// … or turned by more than this, rad: 0.3°, which are 5 µm a millimetre away.
const TURN: f64 = 5e-3;

impl ContactStore {
    /// An empty store of cells of edge `cell` (m), for queries up to `reach` (m).
    pub fn new(cell: f64, reach: f64) -> Self {
        let (of_bin, nearby) = (Table::default(), Table::default());
        Self {
            cell,
            reach,
            of_bin,
            sums: Vec::new(),
            means: Vec::new(),
            nearby,
            changed: Vec::new(),
            history: History::new(MOST_KEPT),
        }
    }

    /// Adds a contact to the mean of its cell.
    pub fn add(&mut self, contact: &Contact) {
        let facing = [contact.normal.x, contact.normal.y, contact.normal.z].map(|x| (x / FACING).floor() as i8);
        let bin = Bin { cell: cell_of(&contact.point, self.cell), facing };
        let (index, is_new) = self.of_bin.insert_with(bin, || ());
        if is_new {
            let Contact { point, normal, weight } = *contact;
            let (zero, told) = (Vector3::zeros(), (point, normal));
            let home = cell_of(&point, self.reach);
            self.sums.push(Sums { point: zero, normal: zero, weight: 0.0, is_noted: true, told, home });
            self.changed.push(index);
            self.means.push(MeanContact { point, normal, weight, is_fan: false });
            let (at, _) = self.nearby.insert_with(home, Vec::new);
            self.nearby.value_mut(at).push(index);
        }
        let kept = || Kept { bin, sums: self.sums[index as usize], mean: self.means[index as usize] };
        self.history.note(index, || (!is_new).then(kept));
        let (sums, mean) = (&mut self.sums[index as usize], &mut self.means[index as usize]);
        sums.point += contact.point.coords * contact.weight;
        sums.normal += contact.normal * contact.weight;
        sums.weight += contact.weight;
        mean.point = Point3::from(sums.point / sums.weight);
        mean.normal = sums.normal.try_normalize(0.0).unwrap_or(contact.normal);
        if is_new || mean.weight > 0.0 {
            mean.weight = sums.weight;
        }
        let (point, normal) = &sums.told;
        let is_shifted = (mean.point - point).dot(normal).abs() > SHIFT * self.cell
            || (mean.normal - normal).norm_squared() > TURN * TURN;
        if is_shifted && !std::mem::replace(&mut sums.is_noted, true) {
            self.changed.push(index);
        }
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

    fn exchange(
        &mut self,
        act: impl FnOnce(&mut History<u32, Option<Kept>>, &mut dyn FnMut(u32, &mut Option<Kept>)) -> bool,
    ) -> bool {
        let mut history = std::mem::replace(&mut self.history, History::new(MOST_KEPT));
        let has_changed = act(&mut history, &mut |at, kept| self.swap(at, kept));
        self.history = history;
        self.note_all();
        has_changed
    }

    /// Exchanges a mean with what was kept of it; those that came last go first.
    fn swap(&mut self, at: u32, kept: &mut Option<Kept>) {
        let here = self.means.get(at as usize).map(|mean| Kept {
            bin: self.of_bin.entry(at).0,
            sums: self.sums[at as usize],
            mean: *mean,
        });
        match std::mem::replace(kept, here) {
            Some(Kept { bin, sums, mean }) if here.is_none() => {
                self.of_bin.insert_with(bin, || ());
                self.sums.push(sums);
                self.means.push(mean);
                let (home, _) = self.nearby.insert_with(sums.home, Vec::new);
                self.nearby.value_mut(home).push(at);
            }
            Some(Kept { sums, mean, .. }) => (self.sums[at as usize], self.means[at as usize]) = (sums, mean),
            None => {
                let Some(Kept { bin, sums, .. }) = here else { return };
                self.of_bin.remove(&bin);
                self.sums.pop();
                self.means.pop();
                if let Some(home) = self.nearby.get_mut(&sums.home) {
                    home.pop();
                }
            }
        }
    }

    /// The numbers of the means that came since this was last asked, or are clearly elsewhere than when they were last
    /// told, each once.
    pub fn take_changed(&mut self) -> Vec<u32> {
        let changed = std::mem::take(&mut self.changed);
        for &at in &changed {
            let (sums, mean) = (&mut self.sums[at as usize], &self.means[at as usize]);
            (sums.is_noted, sums.told) = (false, (mean.point, mean.normal));
        }
        changed
    }

    /// Lets [`Self::take_changed`] tell all means.
    pub fn note_all(&mut self) {
        self.changed = (0..self.means.len() as u32).collect();
        self.sums.iter_mut().for_each(|sums| sums.is_noted = true);
    }

    /// Takes a mean out of all queries, or back in; returns whether that is new.
    pub fn refute(&mut self, at: u32, is_refuted: bool) -> bool {
        let mean = &mut self.means[at as usize];
        let before = std::mem::replace(&mut mean.weight, if is_refuted { 0.0 } else { self.sums[at as usize].weight });
        (before == 0.0) != is_refuted
    }

    /// Finds whether normals within `width` (m) of a mean differ by more than the angle of `cosine`; returns whether that
    /// is new.
    pub fn mark_fan(&mut self, at: u32, width: f64, cosine: f64) -> bool {
        let MeanContact { point, normal, is_fan: before, .. } = self.means[at as usize];
        let mut is_fan = false;
        self.near(&point, width, |_, other| is_fan |= self.means[other as usize].normal.dot(&normal) < cosine);
        self.means[at as usize].is_fan = is_fan;
        is_fan != before
    }

    /// All means, in the order in which their cells were first touched.
    pub fn means(&self) -> &[MeanContact] {
        &self.means
    }

    /// Calls `each` with the squared distance (m²) and the number of every mean nearer to `x` than `reach` (m), which is
    /// cut off at that of the store.
    #[inline]
    pub fn near(&self, x: &Point3<f64>, reach: f64, mut each: impl FnMut(f64, u32)) {
        let limit = reach.min(self.reach).powi(2);
        for bin in around(cell_of(x, self.reach)) {
            for &index in self.nearby.get(&bin).into_iter().flatten() {
                let mean = &self.means[index as usize];
                let distance_squared = (mean.point - x).norm_squared();
                if distance_squared < limit && mean.weight > 0.0 {
                    each(distance_squared, index);
                }
            }
        }
    }
}

/// The cube of edge `size` (m) that holds `p`.
pub(super) fn cell_of(p: &Point3<f64>, size: f64) -> Node {
    [p.x, p.y, p.z].map(|x| (x / size).floor() as i32)
}

/// A cube and the 26 around it.
pub(super) fn around(cell: Node) -> impl Iterator<Item = Node> {
    (0..27).map(move |i| [0, 1, 2].map(|axis| cell[axis].saturating_add(i / [9, 3, 1][axis] % 3 - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(x: f64, normal: Vector3<f64>, weight: f64) -> Contact {
        Contact { point: Point3::new(x, 0.1e-3, 0.1e-3), normal, weight }
    }

    #[test]
    fn contacts_of_one_cell_are_averaged_by_weight_unless_they_face_apart() {
        let mut store = ContactStore::new(0.5e-3, 3e-3);
        store.add(&contact(0.1e-3, Vector3::z(), 1.0));
        store.add(&contact(0.4e-3, Vector3::z(), 3.0));
        store.add(&contact(0.2e-3, Vector3::x(), 1.0));
        assert_eq!(store.means().len(), 2);
        assert!((store.means()[0].point.x - 0.325e-3).abs() < 1e-18);
        assert_eq!((store.means()[0].weight, store.means()[1].normal), (4.0, Vector3::x()));
    }

    #[test]
    fn near_finds_what_a_walk_over_all_finds() {
        let mut store = ContactStore::new(0.5e-3, 3e-3);
        let scattered = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 20) / 4096.0 * 10e-3 - 5e-3;
        for i in 0..900 {
            let point = Point3::new(scattered(3 * i), scattered(3 * i + 1), scattered(3 * i + 2));
            store.add(&Contact { point, normal: Vector3::z(), weight: 1.0 });
        }
        for i in 0..50 {
            let x = Point3::new(scattered(7 * i), scattered(5 * i + 1), scattered(11 * i));
            let mut found = Vec::new();
            store.near(&x, 2e-3, |_, index| found.push(index));
            found.sort_unstable();
            let within = |mean: &MeanContact| (mean.point - x).norm() < 2e-3;
            let all: Vec<u32> = (0..).zip(store.means()).filter(|(_, mean)| within(mean)).map(|(at, _)| at).collect();
            assert_eq!(found, all);
        }
    }

    #[test]
    fn a_refuted_contact_is_silent_until_it_is_not_refuted_any_more() {
        let mut store = ContactStore::new(0.5e-3, 3e-3);
        store.add(&contact(0.0, Vector3::z(), 1.0));
        let count = |store: &ContactStore| {
            let mut count = 0;
            store.near(&Point3::origin(), 1e-3, |_, _| count += 1);
            count
        };
        assert_eq!((store.refute(0, true), store.refute(0, true), count(&store)), (true, false, 0));
        assert_eq!((store.refute(0, false), store.refute(0, false), count(&store)), (true, false, 1));
    }

    #[test]
    fn clear_changes_are_told_once() {
        let mut store = ContactStore::new(0.5e-3, 3e-3);
        for x in [0.6e-3, 0.1e-3, 0.2e-3, 0.7e-3] {
            store.add(&contact(x, Vector3::z(), 1.0));
        }
        assert_eq!((store.take_changed(), store.take_changed()), (vec![0, 1], vec![]));
        store.add(&contact(0.3e-3, Vector3::z(), 1.0));
        assert!(store.take_changed().is_empty(), "it went along the surface");
        store.add(&Contact { point: Point3::new(0.3e-3, 0.1e-3, 0.2e-3), normal: Vector3::z(), weight: 1.0 });
        assert_eq!(store.take_changed(), [1], "it rose by 20 µm");
    }
}
