//! Contact map: one mean contact for each voxel and range of normals.
//!
//! The map integrates nothing into a field: the field is evaluated anew from these contacts.
//!
//! Contacts are independent from one pass to the next, not from sample to sample:
//! [`ContactStatistics`] counts the passes. With a gate, the map rejects a contact that contradicts
//! the mean of its place (or, for the first contact, of a neighbouring place) by more than the
//! uncertainty of both. A second pass that agrees with it relocates the mean; a pass that confirms
//! the mean forgets it.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_statistics::ContactStatistics;
use crate::reconstruct::evidence::outliers::{Outlier, Outliers};
use crate::reconstruct::evidence::touches::SurfaceContact;
use crate::reconstruct::history::{Direction, History};
use crate::reconstruct::lattice::LatticeNode;
use crate::reconstruct::table::CellTable;
use touchup_geometry::numeric::{direction, voxel_neighbourhood, voxel_of};

/// The mean of the contacts in one cell that face alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanContact {
    /// m, in O
    pub point: Point3<f64>,
    /// unit, in O
    pub normal: Vector3<f64>,
    /// sum of the weights; 0 if refuted
    pub weight: f64,
    /// normals close by differ much: the ball rolled over an edge here
    pub is_fan: bool,
}

/// Outcome of adding a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactVerdict {
    /// part of the mean of its place
    Taken,
    /// in contradiction to its place, rejected
    Rejected,
    /// second contradicting pass: the place has moved to it
    Relocated,
}

/// Outlier gate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GateParams {
    /// standard deviations beyond which a contact contradicts
    pub sigmas: f64,
    /// contacts of one place within this time share their noise, ns: the longest smoothing window
    pub window_ns: i64,
}

/// A small cell and a range of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    cell: LatticeNode,
    facing: [i8; 3],
}

/// A mean that a contact contradicts.
#[derive(Clone, Copy, Debug)]
struct Rival {
    index: u32,
    /// m
    innovation: f64,
    sigmas: f64,
}

/// State of a mean beside the data for queries.
#[derive(Clone, Debug)]
struct MeanState {
    bin: Bin,
    /// the cell in [`ContactMap::nearby`]
    home: LatticeNode,
    sums: ContactStatistics,
    /// contacts rejected here
    rejected: Option<Box<RejectedContacts>>,
    is_refuted: bool,
    /// whether it mixes two contacts
    is_mixed: bool,
    /// point and normal at the last report
    reported: (Point3<f64>, Vector3<f64>),
}

impl MeanState {
    /// Weight in queries.
    fn weight(&self) -> f64 {
        if self.is_refuted || self.is_mixed {
            0.0
        } else {
            self.sums.weight
        }
    }
}

/// A mean before a stroke; `None` if it is new.
type EarlierMean = Option<(MeanState, MeanContact)>;

/// Contacts that contradict a mean and agree with each other.
#[derive(Clone, Debug, Default)]
struct RejectedContacts {
    sums: ContactStatistics,
    last_ns: i64,
}

/// Contacts, by place and facing.
#[derive(Clone, Debug)]
pub struct ContactMap {
    cell: f64,
    reach: f64,
    gate: Option<GateParams>,
    /// the means of each cell
    of_cell: CellTable<LatticeNode, Vec<u32>>,
    kept: Vec<MeanState>,
    means: Vec<MeanContact>,
    nearby: CellTable<LatticeNode, Vec<u32>>,
    /// rejected contacts
    pub(in crate::reconstruct) outliers: Outliers,
    /// mean of the last contact, and its stamp, ns
    last: Option<(u32, i64)>,
    /// means that are new or moved since the last report
    changed: CellTable<u32, ()>,
    history: History<u32, EarlierMean>,
}

/// Range of normal components that share a mean.
const FACING: f64 = 0.25;
/// Shift along its normal that reports a mean again, in cells: 5 µm for a ball of 1.5 mm.
const SHIFT: f64 = 0.01;
/// Turn that reports a mean again, rad: 0.3°, which are 5 µm a millimetre away.
const TURN: f64 = 5e-3;
/// Maximum number of means for undo: 100 MB.
const MOST_KEPT: usize = 200_000;
/// Minimum weight of a mean to contradict; a sliding contact has weight 1.
const LEAST_EVIDENCE: f64 = 3.0;
/// Normals within 25° belong to one surface.
const ALIKE: f64 = 0.906;
/// Cells above and below a contact without another surface that faces alike: the ball would not
/// have fitted in.
const DEPTH: i32 = 3;
/// Distance of a surface from the chord between two of its points, as a share of a cell.
const ROUGHNESS: f64 = 0.02;
/// Maximum distance at which the previous contact predicts the next, in cells.
const PREDICTION_REACH: f64 = 3.0;
/// Windows without a contact that separate two passes.
const PAUSE: i64 = 2;

impl ContactMap {
    /// An empty map with cells of edge `cell` (m), for queries up to `reach` (m).
    ///
    /// - `gate`: criterion for rejection; `None`: never.
    pub(crate) fn new(cell: f64, reach: f64, gate: Option<GateParams>) -> Self {
        Self {
            cell,
            reach,
            gate,
            of_cell: CellTable::default(),
            kept: Vec::new(),
            means: Vec::new(),
            nearby: CellTable::default(),
            outliers: Outliers::default(),
            last: None,
            changed: CellTable::default(),
            history: History::new(MOST_KEPT),
        }
    }

    /// Adds a contact to the mean of its cell, unless it contradicts its place.
    pub(crate) fn add(&mut self, contact: &SurfaceContact) -> ContactVerdict {
        self.outliers.contacts += 1;
        let bin = self.bin_of(contact);
        let own = self.find(&bin);
        if let Some(gate) = self.gate
            && let Some(rival) = self.rival(contact, bin.cell, own, &gate)
        {
            return self.contest(&rival, contact, &bin, &gate);
        }
        let index = self.place(own, &bin, contact);
        let MeanState { sums, rejected, .. } = &mut self.kept[index as usize];
        sums.add(contact);
        if let Some(gate) = self.gate
            && sums
                .passes
                .note(contact.stamp_ns, contact.weight, gate.window_ns)
        {
            // the pass confirms the mean: the rejected contacts were outliers
            *rejected = None;
        }
        self.renew(index, contact);
        if self.kept[index as usize].sums.weight >= LEAST_EVIDENCE {
            self.last = Some((index, contact.stamp_ns));
        }
        ContactVerdict::Taken
    }

    /// Whether a contact contradicts its place, and would be rejected.
    pub(in crate::reconstruct) fn contradicts(&self, contact: &SurfaceContact) -> bool {
        let bin = self.bin_of(contact);
        self.gate.is_some_and(|gate| {
            self.rival(contact, bin.cell, self.find(&bin), &gate)
                .is_some()
        })
    }

    fn bin_of(&self, contact: &SurfaceContact) -> Bin {
        let facing = [contact.normal.x, contact.normal.y, contact.normal.z]
            .map(|x| (x / FACING).floor() as i8);
        Bin {
            cell: voxel_of(&contact.point, self.cell),
            facing,
        }
    }

    /// The means of a cell, latest first.
    fn in_cell(&self, cell: LatticeNode) -> impl Iterator<Item = u32> + '_ {
        self.of_cell
            .get(&cell)
            .into_iter()
            .flat_map(|means| means.iter().rev().copied())
    }

    fn find(&self, bin: &Bin) -> Option<u32> {
        self.in_cell(bin.cell)
            .find(|&index| self.kept[index as usize].bin == *bin)
    }

    /// The mean that a contact contradicts: of its own cell; for the first contacts there, the
    /// nearest mean around that faces alike; without any, the previous mean on its path.
    fn rival(
        &self,
        contact: &SurfaceContact,
        cell: LatticeNode,
        own: Option<u32>,
        gate: &GateParams,
    ) -> Option<Rival> {
        let nearest = |found: &mut dyn Iterator<Item = u32>| {
            let distance =
                |index: u32| (self.means[index as usize].point - contact.point).norm_squared();
            let nearer = |a: &u32, b: &u32| distance(*a).total_cmp(&distance(*b)).then(a.cmp(b));
            found
                .filter(|&index| self.faces_alike(index, contact))
                .min_by(nearer)
        };
        let here = own.filter(|&index| self.faces_alike(index, contact));
        let index = match here.or_else(|| nearest(&mut self.in_cell(cell))) {
            None => {
                nearest(&mut self.around(contact, cell)).or_else(|| self.before(contact, gate))?
            }
            Some(index) => index,
        };
        let (innovation, sigmas) = self.innovation(index, contact);
        (sigmas > gate.sigmas).then_some(Rival {
            index,
            innovation,
            sigmas,
        })
    }

    /// Whether a mean belongs to the surface of a contact.
    fn faces_alike(&self, index: u32, contact: &SurfaceContact) -> bool {
        let (kept, mean) = (&self.kept[index as usize], &self.means[index as usize]);
        kept.sums.weight >= LEAST_EVIDENCE && mean.normal.dot(&contact.normal) > ALIKE
    }

    /// The means in the cells around a contact, and above and below it.
    fn around(
        &self,
        contact: &SurfaceContact,
        cell: LatticeNode,
    ) -> impl Iterator<Item = u32> + '_ {
        let (point, step) = (contact.point, contact.normal * self.cell);
        let deep = (2..=DEPTH).flat_map(|k| [-k, k]);
        let deep = deep.map(move |k| voxel_of(&(point + step * f64::from(k)), self.cell));
        voxel_neighbourhood(cell)
            .chain(deep)
            .flat_map(|cell| self.in_cell(cell))
    }

    /// Mean of the previous contact, while near in time and place.
    fn before(&self, contact: &SurfaceContact, gate: &GateParams) -> Option<u32> {
        let (index, last_ns) = self.last?;
        let is_recent = contact.stamp_ns.saturating_sub(last_ns) <= gate.window_ns;
        let distance = (self.means[index as usize].point - contact.point).norm();
        (is_recent && distance < PREDICTION_REACH * self.cell && self.faces_alike(index, contact))
            .then_some(index)
    }

    fn innovation(&self, index: u32, contact: &SurfaceContact) -> (f64, f64) {
        self.kept[index as usize]
            .sums
            .innovation(contact, ROUGHNESS * self.cell)
    }

    /// Rejects a contact, or, in a second pass, lets it replace the mean that it contradicts.
    fn contest(
        &mut self,
        rival: &Rival,
        contact: &SurfaceContact,
        bin: &Bin,
        gate: &GateParams,
    ) -> ContactVerdict {
        let roughness = ROUGHNESS * self.cell;
        self.note_mean(rival.index);
        let rejected = self.kept[rival.index as usize]
            .rejected
            .get_or_insert_default();
        let RejectedContacts { sums, last_ns } = &mut **rejected;
        let agrees = sums.weight > 0.0 && sums.innovation(contact, roughness).1 <= gate.sigmas;
        let is_second =
            agrees && contact.stamp_ns.saturating_sub(*last_ns) > PAUSE * gate.window_ns;
        if !agrees {
            *sums = ContactStatistics::default();
        }
        sums.add(contact);
        sums.passes
            .note(contact.stamp_ns, contact.weight, gate.window_ns);
        *last_ns = contact.stamp_ns;
        if is_second {
            let sums = std::mem::take(sums);
            self.move_to(rival.index, sums, contact, bin, gate.sigmas);
            return ContactVerdict::Relocated;
        }
        let SurfaceContact {
            stamp_ns,
            point,
            normal,
            ..
        } = *contact;
        let Rival {
            innovation, sigmas, ..
        } = *rival;
        self.outliers.note(
            Outlier {
                stamp_ns,
                point,
                normal,
                innovation,
                sigmas,
                contacts: 1,
            },
            gate.window_ns,
        );
        ContactVerdict::Rejected
    }

    /// Empties the means that a contact contradicts and puts the rejected contacts in the contact's
    /// cell.
    fn move_to(
        &mut self,
        rival: u32,
        sums: ContactStatistics,
        contact: &SurfaceContact,
        bin: &Bin,
        sigmas: f64,
    ) {
        self.outliers.relocated += 1;
        let contradicts = |&index: &u32| {
            let is_alike = self.kept[index as usize].sums.weight > 0.0
                && self.means[index as usize].normal.dot(&contact.normal) > ALIKE;
            index == rival || is_alike && self.innovation(index, contact).1 > sigmas
        };
        let old: Vec<u32> = self
            .around(contact, bin.cell)
            .chain([rival])
            .filter(contradicts)
            .collect();
        for index in old {
            self.note_mean(index);
            self.changed.insert(index, ());
            self.kept[index as usize].sums = ContactStatistics::default();
            self.means[index as usize].weight = 0.0;
        }
        let index = self.place(self.find(bin), bin, contact);
        self.kept[index as usize].sums = sums;
        self.renew(index, contact);
        self.changed.insert(index, ());
    }

    /// The mean of a bin, about to change: `own`, or a new one if `None`.
    fn place(&mut self, own: Option<u32>, bin: &Bin, contact: &SurfaceContact) -> u32 {
        if let Some(index) = own {
            self.note_mean(index);
            return index;
        }
        let SurfaceContact {
            point,
            normal,
            weight,
            ..
        } = *contact;
        let index = self.means.len() as u32;
        self.history.note(index, || None);
        let kept = MeanState {
            bin: *bin,
            home: voxel_of(&point, self.reach),
            sums: ContactStatistics::default(),
            rejected: None,
            is_refuted: false,
            is_mixed: false,
            reported: (point, normal),
        };
        self.push(
            kept,
            MeanContact {
                point,
                normal,
                weight,
                is_fan: false,
            },
        );
        self.changed.insert(index, ());
        index
    }

    fn note_mean(&mut self, index: u32) {
        self.history.note(index, || {
            Some((
                self.kept[index as usize].clone(),
                self.means[index as usize],
            ))
        });
    }

    /// Adds a mean.
    fn push(&mut self, kept: MeanState, mean: MeanContact) {
        let index = self.means.len() as u32;
        self.of_cell.get_or_default(kept.bin.cell).push(index);
        self.nearby.get_or_default(kept.home).push(index);
        self.kept.push(kept);
        self.means.push(mean);
    }

    /// Removes the latest mean.
    fn pop(&mut self) -> Option<(MeanState, MeanContact)> {
        let (kept, mean) = (self.kept.pop()?, self.means.pop()?);
        self.of_cell.get_or_default(kept.bin.cell).pop();
        self.nearby.get_or_default(kept.home).pop();
        Some((kept, mean))
    }

    /// Updates a mean from its sums; a refuted mean keeps weight 0.
    fn renew(&mut self, index: u32, contact: &SurfaceContact) {
        let (kept, mean) = (&self.kept[index as usize], &mut self.means[index as usize]);
        let (point, normal) = &kept.reported;
        mean.point = kept.sums.point();
        mean.normal = direction(&kept.sums.normal).unwrap_or(contact.normal);
        let before = std::mem::replace(&mut mean.weight, kept.weight());
        let is_back = before == 0.0 && mean.weight > 0.0;
        let is_shifted = is_back
            || (mean.point - point).dot(normal).abs() > SHIFT * self.cell
            || (mean.normal - normal).norm_squared() > TURN * TURN;
        if is_shifted {
            self.changed.insert(index, ());
        }
    }

    /// Begins an undoable stroke.
    pub(crate) fn begin_stroke(&mut self) {
        self.history.begin();
    }

    /// Number of undoable strokes.
    pub(crate) fn strokes(&self) -> usize {
        self.history.len()
    }

    /// Undoes the last stroke, or redoes the last undone one. Returns whether there was one.
    pub(in crate::reconstruct) fn exchange(&mut self, direction: Direction) -> bool {
        let mut history = std::mem::replace(&mut self.history, History::new(MOST_KEPT));
        let has_changed = history.exchange(direction, |key, past| self.swap(key, past));
        self.history = history;
        self.last = None;
        self.note_all();
        has_changed
    }

    /// Exchanges a mean with its kept state; the last insertion first.
    fn swap(&mut self, index: u32, past: &mut EarlierMean) {
        let at = index as usize;
        match past.take() {
            None => *past = self.pop(),
            Some((state, mean)) if at == self.means.len() => self.push(state, mean),
            Some((state, mean)) => {
                let there = (&mut self.kept[at], &mut self.means[at]);
                *past = Some((
                    std::mem::replace(there.0, state),
                    std::mem::replace(there.1, mean),
                ));
            }
        }
    }

    /// Numbers of the means that are new or clearly moved since the last call, each once.
    pub(crate) fn take_changed(&mut self) -> CellTable<u32, ()> {
        let changed = std::mem::take(&mut self.changed);
        for (at, ()) in changed.iter() {
            let mean = &self.means[at as usize];
            self.kept[at as usize].reported = (mean.point, mean.normal);
        }
        changed
    }

    /// Makes [`Self::take_changed`] report all means.
    pub(crate) fn note_all(&mut self) {
        self.changed = (0..self.means.len() as u32).collect();
    }

    /// Sums of a mean, whether it counts in queries or not.
    pub(in crate::reconstruct) fn sums(&self, index: u32) -> &ContactStatistics {
        &self.kept[index as usize].sums
    }

    /// Variance of a mean along its normal by noise and calibration, m²: noise averages out by the
    /// number of passes.
    pub(in crate::reconstruct) fn variance(&self, index: u32) -> f64 {
        self.noise_variance(index) + self.sums(index).sigma().systematic().powi(2)
    }

    /// Variance of a mean along its normal by noise alone, m².
    pub(in crate::reconstruct) fn noise_variance(&self, index: u32) -> f64 {
        let sums = self.sums(index);
        sums.sigma().noise.powi(2) / f64::from(sums.passes.count.max(1))
    }

    /// Excludes a mean from all queries, or includes it again; returns whether that is new.
    pub(crate) fn refute(&mut self, at: u32, is_refuted: bool) -> bool {
        self.kept[at as usize].is_refuted = is_refuted;
        self.reweigh(at)
    }

    /// Excludes a mean of two mixed contacts from all queries, or includes it again; returns
    /// whether that is new.
    pub(in crate::reconstruct) fn mark_mixed(&mut self, at: u32, is_mixed: bool) -> bool {
        self.kept[at as usize].is_mixed = is_mixed;
        self.reweigh(at)
    }

    /// Updates the query weight of a mean from its state; returns whether the mean enters or leaves
    /// queries.
    fn reweigh(&mut self, at: u32) -> bool {
        let mean = &mut self.means[at as usize];
        let before = std::mem::replace(&mut mean.weight, self.kept[at as usize].weight());
        (before == 0.0) != (mean.weight == 0.0)
    }

    /// Marks a mean as a fan if normals within `width` (m) differ by more than the angle of
    /// `cosine`; returns whether that is new.
    pub(crate) fn mark_fan(&mut self, at: u32, width: f64, cosine: f64) -> bool {
        let MeanContact {
            point,
            normal,
            is_fan: before,
            ..
        } = self.means[at as usize];
        let mut is_fan = false;
        self.near(&point, width, |_, other| {
            is_fan |= self.means[other as usize].normal.dot(&normal) < cosine
        });
        self.means[at as usize].is_fan = is_fan;
        is_fan != before
    }

    /// All means, in the order of the first contact in their cells.
    pub fn means(&self) -> &[MeanContact] {
        &self.means
    }

    /// Calls `each` with the squared distance (m²) and the number of every mean nearer to `x` than
    /// `reach` (m), at most that of the map.
    #[inline]
    pub(crate) fn near(&self, x: &Point3<f64>, reach: f64, mut each: impl FnMut(f64, u32)) {
        self.near_known(x, reach, |distance_squared, index| {
            if self.means[index as usize].weight > 0.0 {
                each(distance_squared, index);
            }
        });
    }

    /// As [`Self::near`], but includes excluded means.
    #[inline]
    pub(in crate::reconstruct) fn near_known(
        &self,
        x: &Point3<f64>,
        reach: f64,
        mut each: impl FnMut(f64, u32),
    ) {
        let limit = reach.min(self.reach).powi(2);
        for bin in voxel_neighbourhood(voxel_of(x, self.reach)) {
            for &index in self.nearby.get(&bin).into_iter().flatten() {
                let mean = &self.means[index as usize];
                let distance_squared = (mean.point - x).norm_squared();
                if distance_squared < limit {
                    each(distance_squared, index);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::ContactSigma;

    fn contact(x: f64, normal: Vector3<f64>, weight: f64) -> SurfaceContact {
        SurfaceContact {
            point: Point3::new(x, 0.1e-3, 0.1e-3),
            normal,
            weight,
            stamp_ns: 0,
            sigma: ContactSigma::default(),
        }
    }

    #[test]
    fn contacts_of_one_cell_are_averaged_by_weight_unless_they_face_apart() {
        let mut store = ContactMap::new(0.5e-3, 3e-3, None);
        store.add(&contact(0.1e-3, Vector3::z(), 1.0));
        store.add(&contact(0.4e-3, Vector3::z(), 3.0));
        store.add(&contact(0.2e-3, Vector3::x(), 1.0));
        assert_eq!(store.means().len(), 2);
        assert!((store.means()[0].point.x - 0.325e-3).abs() < 1e-18);
        assert_eq!(
            (store.means()[0].weight, store.means()[1].normal),
            (4.0, Vector3::x())
        );
    }

    #[test]
    fn near_finds_what_a_walk_over_all_finds() {
        let mut store = ContactMap::new(0.5e-3, 3e-3, None);
        let scattered =
            |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 20) / 4096.0 * 10e-3 - 5e-3;
        for i in 0..900 {
            let point = Point3::new(scattered(3 * i), scattered(3 * i + 1), scattered(3 * i + 2));
            store.add(&SurfaceContact {
                point,
                normal: Vector3::z(),
                weight: 1.0,
                stamp_ns: 0,
                sigma: ContactSigma::default(),
            });
        }
        for i in 0..50 {
            let x = Point3::new(scattered(7 * i), scattered(5 * i + 1), scattered(11 * i));
            let mut found = Vec::new();
            store.near(&x, 2e-3, |_, index| found.push(index));
            found.sort_unstable();
            let within = |mean: &MeanContact| (mean.point - x).norm() < 2e-3;
            let all: Vec<u32> = (0..)
                .zip(store.means())
                .filter(|(_, mean)| within(mean))
                .map(|(at, _)| at)
                .collect();
            assert_eq!(found, all);
        }
    }

    #[test]
    fn a_refuted_contact_is_silent_until_it_is_not_refuted_any_more() {
        let mut store = ContactMap::new(0.5e-3, 3e-3, None);
        store.add(&contact(0.0, Vector3::z(), 1.0));
        let count = |store: &ContactMap| {
            let mut count = 0;
            store.near(&Point3::origin(), 1e-3, |_, _| count += 1);
            count
        };
        assert_eq!(
            (store.refute(0, true), store.refute(0, true), count(&store)),
            (true, false, 0)
        );
        assert_eq!(
            (
                store.refute(0, false),
                store.refute(0, false),
                count(&store)
            ),
            (true, false, 1)
        );
    }

    #[test]
    fn clear_changes_are_reported_once() {
        let mut store = ContactMap::new(0.5e-3, 3e-3, None);
        for x in [0.6e-3, 0.1e-3, 0.2e-3, 0.7e-3] {
            store.add(&contact(x, Vector3::z(), 1.0));
        }
        let changed = |store: &mut ContactMap| {
            store
                .take_changed()
                .iter()
                .map(|(at, ())| at)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            (changed(&mut store), changed(&mut store)),
            (vec![0, 1], vec![])
        );
        store.add(&contact(0.3e-3, Vector3::z(), 1.0));
        assert!(changed(&mut store).is_empty(), "it went along the surface");
        store.add(&SurfaceContact {
            point: Point3::new(0.3e-3, 0.1e-3, 0.2e-3),
            ..contact(0.0, Vector3::z(), 1.0)
        });
        assert_eq!(changed(&mut store), [1], "it rose by 20 µm");
    }

    /// A pass of eight contacts at height `z` (m) from `stamp_ns` on; verdict on the last contact.
    fn pass(store: &mut ContactMap, z: f64, stamp_ns: i64) -> ContactVerdict {
        let sigma = ContactSigma {
            noise: 10e-6,
            ..ContactSigma::default()
        };
        let at = |i: i64| Point3::new(0.1e-3 + 0.03e-3 * i as f64, 0.1e-3, 0.1e-3 + z);
        let contact = |i: i64| SurfaceContact {
            point: at(i),
            normal: Vector3::z(),
            weight: 1.0,
            stamp_ns: stamp_ns + i * 1_000_000,
            sigma,
        };
        (0..8).map(|i| store.add(&contact(i))).last().unwrap()
    }

    #[test]
    fn what_contradicts_is_rejected_until_a_second_pass_agrees() {
        let gate = GateParams {
            sigmas: 4.0,
            window_ns: 64_000_000,
        };
        let second = 1_000_000_000;
        // within the cell, and in the cell above
        for moved in [0.2e-3, 0.45e-3] {
            let mut store = ContactMap::new(0.5e-3, 3e-3, Some(gate));
            let near = |store: &ContactMap| {
                let mut heights = Vec::new();
                store.near(&Point3::new(0.2e-3, 0.1e-3, 0.3e-3), 1e-3, |_, index| {
                    heights.push((store.means()[index as usize].point.z * 1e6).round());
                });
                heights
            };
            assert_eq!(pass(&mut store, 0.0, second), ContactVerdict::Taken);
            assert_eq!(pass(&mut store, 0.01e-3, 2 * second), ContactVerdict::Taken);
            assert_eq!(near(&store), [105.0], "what agrees is averaged");
            assert_eq!(
                pass(&mut store, moved, 3 * second),
                ContactVerdict::Rejected
            );
            assert_eq!((near(&store), store.outliers.rejected), (vec![105.0], 8));
            // after a pass that confirms the mean, the next contradiction is the first again
            assert_eq!(pass(&mut store, 0.0, 4 * second), ContactVerdict::Taken);
            assert_eq!(
                pass(&mut store, moved, 5 * second),
                ContactVerdict::Rejected
            );
            pass(&mut store, moved, 6 * second);
            assert_eq!(store.outliers.relocated, 1);
            assert_eq!(near(&store), [((100e-6 + moved) * 1e6).round()]);
        }
    }
}
