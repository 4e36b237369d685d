//! The touch history: contacts, and the swept volume of the tip.

use nalgebra::Point3;

use crate::reconstruct::evidence::contact_map::{ContactMap, ContactVerdict};
use crate::reconstruct::evidence::double_contact::{is_mixed, split};
use crate::reconstruct::evidence::free_space::FreeSpace;
use crate::reconstruct::evidence::probed_log::ProbedLog;
use crate::reconstruct::evidence::scan_distance::ScanDistance;
use crate::reconstruct::evidence::stroke_log::StrokeLog;
use crate::reconstruct::evidence::touches::TipTouch;
use crate::reconstruct::evidence_changes::GridChanges;
use crate::reconstruct::history::Direction;
use crate::reconstruct::model::KnownSurfaces;
use crate::reconstruct::table::CellTable;
use crate::stylus::{STROKE_PAUSE_NS, TipPlace, TouchState};
use touchup_geometry::mesh::{FaceTree, TriMesh};

/// Maximum depth of the ball in a contact, in radii: a deeper one refutes it; four times the noise
/// of a usual tracker.
const REFUTED_DEPTH: f64 = 0.133;
/// Distance from a relocated contact within which places of the ball, on the earlier surface, are
/// forgotten, in radii.
const FORGOTTEN: f64 = 1.1;
/// Maximum distance of a contact outside of the scan, or outside of the box around it, in radii:
/// farther contacts belong to something else.
const OUTSIDE: f64 = 4.0;
/// Range of the normals compared for an edge, in radii.
const FAN_WIDTH: f64 = 0.4;
/// Cosine of the angle between normals, 25°, above which they belong to an edge.
const FAN_COSINE: f64 = 0.906;
/// Largest distance of a contact from the mean of its cell, in radii: the diagonal of a cell of a
/// third of the radius.
const CELL_DIAGONAL: f64 = 0.578;
/// Cosine of the maximum angle between a contact and the known surface that explains it.
const ALIKE: f64 = 0.6;
/// Range of the search for dependants of a moved mean, in fan widths: a mean moves within its cell.
const MOVED: f64 = 2.0;

/// All contacts and the free space.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct TouchHistory {
    pub contacts: ContactMap,
    pub free_space: FreeSpace,
    pub probed: ProbedLog,
    pub stroke_log: StrokeLog,
    pub known: KnownSurfaces,
    /// whether free space counts as evidence; else `free_space` stays empty
    pub keeps_free_space: bool,
    /// size of the tip, m
    pub radius: f64,
    /// radius of a ball tip, m
    pub ball: Option<f64>,
    /// stamp of the last touch that counts, ns
    pub until_ns: i64,
    pub last_contact_ns: Option<i64>,
    /// the box around the scan in which contacts may be its own, once the scan is known
    pub bounds: Option<[Point3<f64>; 2]>,
}

impl TouchHistory {
    pub(crate) fn keep(&mut self, touch: &TipTouch) {
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
            // a firm touch without a known contact belongs to its stroke
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
            // the ball cannot be on a wall that it would have to be nearer to: no outlier
            if two.is_some() && self.contacts.contradicts(contact) {
                continue;
            }
            let verdict = self.contacts.add(contact);
            self.probed.note(touch, contact, verdict);
            is_accepted |= verdict != ContactVerdict::Rejected;
            if verdict == ContactVerdict::Relocated {
                self.free_space
                    .forget(&contact.point, FORGOTTEN * self.radius);
            }
        }
        if is_accepted {
            self.sweep(&place);
        }
    }

    /// Extends the time up to which touches are known, ns; never backwards.
    pub(crate) fn note_until(&mut self, stamp_ns: i64) {
        self.until_ns = self.until_ns.max(stamp_ns);
    }

    fn sweep(&mut self, place: &TipPlace) {
        if self.keeps_free_space {
            self.free_space.add_place(place);
        }
    }

    /// Number of undoable strokes.
    pub(crate) fn strokes(&self) -> usize {
        self.contacts.strokes().min(self.free_space.strokes())
    }

    /// Undoes the last stroke, or redoes the last undone one; returns whether there was one.
    pub(crate) fn exchange(&mut self, direction: Direction) -> bool {
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

    /// Decides near new evidence which contacts count and which belong to an edge; returns the
    /// places.
    pub(crate) fn update(&mut self, scan: &TriMesh, tree: &FaceTree) -> GridChanges {
        let Self {
            contacts,
            free_space,
            known,
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
        let mut means: Vec<_> = changed
            .iter()
            .map(|(at, ())| contacts.means()[at as usize].point)
            .collect();
        let beside = CELL_DIAGONAL * *radius;
        means.extend(known.update(|place, normal| {
            let mut is_touched = false;
            contacts.near_known(place, beside, |_, at| {
                let facing = contacts.means()[at as usize].normal;
                is_touched |= normal.is_none_or(|normal| facing.dot(normal) > ALIKE);
            });
            is_touched
        }));
        GridChanges { means, centres }
    }
}

/// These means and all within `reach` (m) of them, at most the reach of the map.
fn beside(contacts: &ContactMap, means: &CellTable<u32, ()>, reach: f64) -> CellTable<u32, ()> {
    let mut beside = means.clone();
    for (at, ()) in means.iter() {
        contacts.near_known(&contacts.means()[at as usize].point, reach, |_, other| {
            beside.insert(other, ())
        });
    }
    beside
}

/// Whether a contact is too far outside the scan to be on its part. Beyond an open rim the scan has
/// no outside: a contact there may be on surface that was not scanned, below a scan without sides
/// or in a hole of it, but not beyond the box around it.
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
