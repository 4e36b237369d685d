//! The touch history: contacts, and the space that the tip went through.

use nalgebra::Point3;

use crate::mesh::{FaceTree, TriMesh};
use crate::reconstruct::evidence::contact_map::{ContactMap, Verdict};
use crate::reconstruct::evidence::double_contact::{is_mixed, split};
use crate::reconstruct::evidence::free_space::FreeSpace;
use crate::reconstruct::evidence::probed_log::ProbedLog;
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::evidence::stroke_log::StrokeLog;
use crate::reconstruct::evidence::touches::TipTouch;
use crate::reconstruct::field::grid::GridChanges;
use crate::reconstruct::incremental::history::Direction;
use crate::reconstruct::table::CellTable;
use crate::stylus::{STROKE_PAUSE_NS, TipPlace, TouchState};

/// A contact that the ball went into by more than this is none, in radii: four times the noise of a
/// usual tracker.
const REFUTED_DEPTH: f64 = 0.133;
/// Where a contact is relocated, the ball has been nearer than this to the earlier surface, in
/// radii.
const FORGOTTEN: f64 = 1.1;
/// A contact farther outside of the scan than this belongs to something else, in radii; so does one
/// so far out of the box around it.
const OUTSIDE: f64 = 4.0;
/// Normals within this many radii …
const FAN_WIDTH: f64 = 0.4;
/// … that differ by more than 25° are those of an edge.
const FAN_COSINE: f64 = 0.906;
/// A mean moves within its cell; what depends on it is looked for this many times as far.
const MOVED: f64 = 2.0;

/// All contacts and the free space.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct TouchHistory {
    pub contacts: ContactMap,
    pub free_space: FreeSpace,
    pub probed: ProbedLog,
    pub stroke_log: StrokeLog,
    /// whether where the tip went counts; else `free_space` stays empty
    pub keeps_free_space: bool,
    /// size of the tip, m
    pub radius: f64,
    /// radius of the tip when it is a ball, m
    pub ball: Option<f64>,
    /// stamp of the last touch that counts, ns
    pub until_ns: i64,
    pub last_contact_ns: Option<i64>,
    /// the box around the scan in which contacts may be its own, once the scan is known
    pub bounds: Option<[Point3<f64>; 2]>,
}

impl TouchHistory {
    pub fn keep(&mut self, touch: &TipTouch) {
        self.note_until(touch.stamp_ns);
        self.stroke_log.note(touch.stamp_ns, touch.state);
        let place = TipPlace {
            centre: touch.centre,
            axis: touch.axis,
        };
        let is_between_strokes = self
            .last_contact_ns
            .is_none_or(|last| touch.stamp_ns.saturating_sub(last) > STROKE_PAUSE_NS);
        let Some(contact) = &touch.contact else {
            // a firm touch of which no contact is known belongs to the stroke that it is in
            if touch.state == TouchState::Free
                || touch.state == TouchState::Contact && !is_between_strokes
            {
                self.sweep(&place);
            }
            return;
        };
        if is_between_strokes {
            self.contacts.begin_stroke();
            self.free_space.begin_stroke();
            self.probed.begin_stroke();
        }
        self.stroke_log
            .note_contact(touch.stamp_ns, is_between_strokes);
        self.last_contact_ns = Some(touch.stamp_ns);
        let two = self
            .ball
            .and_then(|radius| split(&self.contacts, radius, &touch.centre, contact));
        let mut is_accepted = false;
        for contact in two
            .as_ref()
            .map_or(std::slice::from_ref(contact), |two| two)
        {
            // a wall that the ball would have to be nearer to is not touched: that is no outlier
            if two.is_some() && self.contacts.contradicts(contact) {
                continue;
            }
            let verdict = self.contacts.add(contact);
            self.probed.note(touch, contact, verdict);
            is_accepted |= verdict != Verdict::Rejected;
            if verdict == Verdict::Relocated {
                self.free_space
                    .forget(&contact.point, FORGOTTEN * self.radius);
            }
        }
        if is_accepted {
            self.sweep(&place);
        }
    }

    /// What was touched up to this stamp is known, ns; never less than before.
    pub fn note_until(&mut self, stamp_ns: i64) {
        self.until_ns = self.until_ns.max(stamp_ns);
    }

    fn sweep(&mut self, place: &TipPlace) {
        if self.keeps_free_space {
            self.free_space.add_place(place);
        }
    }

    /// How many strokes can be undone.
    pub fn strokes(&self) -> usize {
        self.contacts.strokes().min(self.free_space.strokes())
    }

    /// Takes the last stroke back, or does the one again that was undone last; returns whether
    /// there was one.
    pub fn exchange(&mut self, direction: Direction) -> bool {
        self.last_contact_ns = None;
        let is_possible = direction == Direction::Redo || self.strokes() > 0;
        let has_changed =
            is_possible && self.contacts.exchange(direction) && self.free_space.exchange(direction);
        if has_changed {
            self.probed.exchange(direction);
            self.stroke_log.exchange(direction);
        }
        has_changed
    }

    /// Decides which contacts count and which are those of an edge, where there is new evidence;
    /// returns where that is.
    pub fn update(&mut self, scan: &TriMesh, tree: &FaceTree) -> GridChanges {
        let Self {
            contacts,
            free_space,
            radius,
            ..
        } = self;
        let (deepest, outside) = (*radius * (1.0 - REFUTED_DEPTH), OUTSIDE * *radius);
        let bounds = self.bounds.get_or_insert_with(|| {
            let [lo, hi] = scan.bounds();
            [lo.map(|x| x - outside), hi.map(|x| x + outside)]
        });
        let mut changed = contacts.take_changed();
        let centres = free_space.take_changed();
        let mut doubtful = changed.clone();
        for centre in &centres {
            contacts.near(centre, deepest, |_, at| doubtful.insert(at, ()));
        }
        for (at, ()) in doubtful.iter() {
            let point = contacts.means()[at as usize].point;
            let is_refuted = free_space
                .nearest(&point)
                .is_some_and(|(distance, _)| distance < deepest)
                || is_elsewhere(&point, scan, tree, bounds, outside);
            if contacts.refute(at, is_refuted) {
                changed.insert(at, ());
            }
        }
        if let Some(radius) = self.ball {
            for (at, ()) in beside(contacts, &changed, f64::INFINITY).iter() {
                let is_mixed = is_mixed(contacts, radius, at);
                if contacts.mark_mixed(at, is_mixed) {
                    changed.insert(at, ());
                }
            }
        }
        for (at, ()) in beside(contacts, &changed, MOVED * FAN_WIDTH * *radius).iter() {
            if contacts.mark_fan(at, FAN_WIDTH * *radius, FAN_COSINE) {
                changed.insert(at, ());
            }
        }
        GridChanges {
            means: changed
                .iter()
                .map(|(at, ())| contacts.means()[at as usize].point)
                .collect(),
            centres,
        }
    }
}

/// These means and those within `reach` (m) of them, cut off at the reach of the store.
fn beside(contacts: &ContactMap, means: &CellTable<u32, ()>, reach: f64) -> CellTable<u32, ()> {
    let mut beside = means.clone();
    for (at, ()) in means.iter() {
        contacts.near_known(&contacts.means()[at as usize].point, reach, |_, other| {
            beside.insert(other, ())
        });
    }
    beside
}

/// Whether a contact is so far outside that the part of the scan cannot have been touched there.
/// Beyond an open rim the scan has no outside: there it may be on what was not scanned, below a
/// scan without sides or in a hole of it, but not beyond the box around it.
fn is_elsewhere(
    p: &Point3<f64>,
    scan: &TriMesh,
    tree: &FaceTree,
    bounds: &[Point3<f64>; 2],
    reach: f64,
) -> bool {
    let is_within = bounds[0].inf(p) == bounds[0] && bounds[1].sup(p) == bounds[1];
    ScanDistance::at(scan, tree, p).is_none_or(|scan| {
        if scan.is_on_rim {
            !is_within
        } else {
            scan.value > reach
        }
    })
}
