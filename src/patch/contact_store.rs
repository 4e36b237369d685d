//! What was touched, thinned to one mean contact for each small cell and facing.
//!
//! Nothing is ever integrated into a field: the field is evaluated anew from what is stored here.

use nalgebra::{Point3, Vector3};

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
}

/// Normals whose components differ by less than this share a mean.
const FACING: f64 = 0.25;

impl ContactStore {
    /// An empty store of cells of edge `cell` (m), for queries up to `reach` (m).
    pub fn new(cell: f64, reach: f64) -> Self {
        let (of_bin, nearby) = (Table::default(), Table::default());
        Self { cell, reach, of_bin, sums: Vec::new(), means: Vec::new(), nearby }
    }

    /// Adds a contact to the mean of its cell.
    pub fn add(&mut self, contact: &Contact) {
        let facing = [contact.normal.x, contact.normal.y, contact.normal.z].map(|x| (x / FACING).floor() as i8);
        let bin = Bin { cell: cell_of(&contact.point, self.cell), facing };
        let (index, is_new) = self.of_bin.insert_with(bin, || ());
        if is_new {
            self.sums.push(Sums { point: Vector3::zeros(), normal: Vector3::zeros(), weight: 0.0 });
            let Contact { point, normal, weight } = *contact;
            self.means.push(MeanContact { point, normal, weight, is_fan: false });
            let (at, _) = self.nearby.insert_with(cell_of(&point, self.reach), Vec::new);
            self.nearby.value_mut(at).push(index);
        }
        let (sums, mean) = (&mut self.sums[index as usize], &mut self.means[index as usize]);
        sums.point += contact.point.coords * contact.weight;
        sums.normal += contact.normal * contact.weight;
        sums.weight += contact.weight;
        mean.point = Point3::from(sums.point / sums.weight);
        mean.normal = sums.normal.try_normalize(0.0).unwrap_or(contact.normal);
        mean.weight = sums.weight;
    }

    /// Takes the means that `is_refuted` names out of all queries until it names them no more; returns how many.
    pub fn refute(&mut self, is_refuted: impl Fn(&MeanContact) -> bool) -> usize {
        let mut count = 0;
        for (mean, sums) in self.means.iter_mut().zip(&self.sums) {
            let refuted = is_refuted(mean);
            count += usize::from(refuted);
            mean.weight = if refuted { 0.0 } else { sums.weight };
        }
        count
    }

    /// Takes these means out of all queries until the next [`Self::refute`].
    pub(super) fn silence(&mut self, indices: &[u32]) {
        indices.iter().for_each(|&index| self.means[index as usize].weight = 0.0);
    }

    /// Finds the means around which normals within `width` (m) differ by more than the angle of `cosine`.
    pub fn mark_fans(&mut self, width: f64, cosine: f64) {
        for at in 0..self.means.len() {
            let MeanContact { point, normal, .. } = self.means[at];
            let mut is_fan = false;
            self.near(&point, width, |_, other| is_fan |= self.means[other as usize].normal.dot(&normal) < cosine);
            self.means[at].is_fan = is_fan;
        }
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
        assert_eq!((store.refute(|_| true), count(&store)), (1, 0));
        assert_eq!((store.refute(|_| false), count(&store)), (0, 1));
    }
}
