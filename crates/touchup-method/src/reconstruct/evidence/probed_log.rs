//! The touches for feature measurement, downsampled in time.

use nalgebra::Point3;

use crate::reconstruct::evidence::contact_map::ContactVerdict;
use crate::reconstruct::evidence::touches::{SurfaceContact, TipTouch};
use crate::reconstruct::history::Direction;
use crate::reconstruct::lattice::LatticeNode;
use crate::reconstruct::table::CellTable;
use crate::stylus::ProbedPoint;
use touchup_geometry::numeric::voxel_of;

/// Touches in order of time. Their surface bounds their number: beyond it, each cell with many
/// loses every second touch.
#[derive(Clone, Debug)]
pub(crate) struct ProbedLog {
    /// radius of a ball tip, m
    ball: Option<f64>,
    points: Vec<ProbedPoint>,
    /// number of touches in each cell
    of_cell: CellTable<LatticeNode, usize>,
    undone: Vec<ProbedPoint>,
    /// number of strokes begun and not undone
    strokes: u32,
    spacing_ns: i64,
}

/// Minimum time between touches: closer ones are redundant, as their smoothing window is eight
/// times as long.
const SPACING_NS: i64 = 4_000_000;
/// Number of touches always in memory: four minutes, 10 MB.
const ALWAYS_KEPT: usize = 1 << 16;
/// Further touches for each cell of the surface: at 0.1 mm distance they would be one for each
/// place.
const OF_A_CELL: usize = 64;
/// Edge of a cell, m.
const CELL: f64 = 1e-3;
/// Maximum number of touches, for a part of any size.
const MOST_POINTS: usize = 1 << 20;

fn cell_of(point: &Point3<f64>) -> LatticeNode {
    voxel_of(point, CELL)
}

impl ProbedLog {
    /// An empty log.
    ///
    /// - `ball`: radius of a ball tip, m.
    pub(crate) fn new(ball: Option<f64>) -> Self {
        Self {
            ball,
            points: Vec::new(),
            of_cell: CellTable::default(),
            undone: Vec::new(),
            strokes: 0,
            spacing_ns: SPACING_NS,
        }
    }

    /// All touches, in order of time.
    pub(crate) fn points(&self) -> &[ProbedPoint] {
        &self.points
    }

    /// Later touches belong to a new stroke.
    pub(in crate::reconstruct) fn begin_stroke(&mut self) {
        self.undone.clear();
        self.strokes += 1;
    }

    /// Adds a contact, possibly one of two of its touch, unless the last touch is too recent.
    pub(in crate::reconstruct) fn note(
        &mut self,
        touch: &TipTouch,
        contact: &SurfaceContact,
        verdict: ContactVerdict,
    ) {
        let is_of_last = self
            .points
            .last()
            .is_some_and(|last| last.stamp_ns == touch.stamp_ns);
        let is_due = self
            .points
            .last()
            .is_none_or(|last| touch.stamp_ns.saturating_sub(last.stamp_ns) >= self.spacing_ns);
        if !is_due && !is_of_last {
            return;
        }
        if self.points.len() >= MOST_POINTS {
            self.spacing_ns *= 2;
            self.thin(0);
        } else if self.points.len() >= ALWAYS_KEPT + OF_A_CELL * self.of_cell.len() {
            self.thin(OF_A_CELL / 2);
        }
        *self.of_cell.get_or_default(cell_of(&contact.point)) += 1;
        self.points.push(ProbedPoint {
            stamp_ns: touch.stamp_ns,
            stroke: self.strokes.saturating_sub(1),
            centre: if self.ball.is_some() {
                touch.centre
            } else {
                contact.point
            },
            radius: self.ball.unwrap_or(0.0),
            point: contact.point,
            normal: contact.normal,
            sigma: contact.sigma.noise,
            calibration: contact.sigma.calibration,
            place: contact.sigma.place,
            weight: contact.weight,
            is_rejected: verdict == ContactVerdict::Rejected,
        });
    }

    /// Drops every second touch of each cell with more than `few`.
    fn thin(&mut self, few: usize) {
        let (of_cell, mut seen) = (&self.of_cell, CellTable::<LatticeNode, usize>::default());
        self.points.retain(|touch| {
            let cell = cell_of(&touch.point);
            let at = seen.get_or_default(cell);
            *at += 1;
            *at % 2 == 0 || of_cell.get(&cell).is_none_or(|count| *count <= few)
        });
        self.count_cells();
    }

    fn count_cells(&mut self) {
        self.of_cell = CellTable::default();
        self.points
            .iter()
            .for_each(|touch| *self.of_cell.get_or_default(cell_of(&touch.point)) += 1);
    }

    /// Undoes the last stroke, or redoes the last undone one.
    pub(in crate::reconstruct) fn exchange(&mut self, direction: Direction) {
        match direction {
            Direction::Undo => {
                self.strokes = self.strokes.saturating_sub(1);
                let first = self
                    .points
                    .partition_point(|point| point.stroke < self.strokes);
                self.undone.extend(self.points.drain(first..).rev());
            }
            Direction::Redo => {
                self.strokes += 1;
                while self
                    .undone
                    .last()
                    .is_some_and(|next| next.stroke < self.strokes)
                {
                    self.points.extend(self.undone.pop());
                }
            }
        }
        self.count_cells();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::ContactSigma;
    use crate::stylus::TouchState;
    use nalgebra::{Point3, Vector3};

    fn noted(log: &mut ProbedLog, ms: i64) {
        let (point, normal) = (Point3::new(ms as f64, 0.0, 0.0), Vector3::z());
        let stamp_ns = ms * 1_000_000;
        let contact = SurfaceContact {
            point,
            normal,
            weight: 1.0,
            stamp_ns,
            sigma: ContactSigma::default(),
        };
        let touch = TipTouch {
            stamp_ns,
            centre: point + normal * 1.5e-3,
            axis: normal,
            contact: Some(contact),
            state: TouchState::Contact,
        };
        log.note(&touch, &contact, ContactVerdict::Taken);
    }

    #[test]
    fn strokes_are_undone_and_done_again_in_order() {
        let mut log = ProbedLog::new(Some(1.5e-3));
        for start in [0, 1000, 2000] {
            log.begin_stroke();
            (0..5).for_each(|i| noted(&mut log, start + 4 * i));
        }
        let all = log.points().to_vec();
        assert_eq!(all.len(), 15);
        log.exchange(Direction::Undo);
        log.exchange(Direction::Undo);
        assert_eq!(log.points(), &all[..5]);
        log.exchange(Direction::Redo);
        assert_eq!(log.points(), &all[..10]);
        log.exchange(Direction::Redo);
        assert_eq!(log.points(), &all[..]);
        log.exchange(Direction::Undo);
        log.begin_stroke();
        noted(&mut log, 5000);
        log.exchange(Direction::Redo);
        assert_eq!(
            log.points().len(),
            11,
            "what was undone is gone once something else was touched"
        );
    }

    /// An hour without a pause over 6 mm x 6 mm, 30 mm/s: the log stays within the bound of its
    /// cells, and every cell keeps many of its touches.
    #[test]
    fn an_hour_on_a_small_part_keeps_what_its_surface_bounds() {
        let mut log = ProbedLog::new(Some(1.5e-3));
        log.begin_stroke();
        let normal = Vector3::z();
        // back and forth between 0.5 and 6.5 of a cell, at speeds that share no period
        let swings = |t: f64, speed: f64| {
            0.5 * CELL + 6.0 * CELL * (1.0 - ((t * speed).rem_euclid(2.0) - 1.0).abs())
        };
        let mut most = 0;
        for at in 0..900_000i64 {
            let stamp_ns = at * SPACING_NS;
            let t = stamp_ns as f64 * 1e-9;
            let point = Point3::new(swings(t, 5.0), swings(t, 0.377), 0.5 * CELL);
            let contact = SurfaceContact {
                point,
                normal,
                weight: 1.0,
                stamp_ns,
                sigma: ContactSigma::default(),
            };
            let centre = point + normal * 1.5e-3;
            let touch = TipTouch {
                stamp_ns,
                centre,
                axis: normal,
                contact: Some(contact),
                state: TouchState::Contact,
            };
            log.note(&touch, &contact, ContactVerdict::Taken);
            most = most.max(log.points().len());
        }
        assert_eq!(log.of_cell.len(), 49);
        assert!(
            most <= ALWAYS_KEPT + 49 * OF_A_CELL && most > ALWAYS_KEPT,
            "{most}"
        );
        assert!(log.points.is_sorted_by_key(|touch| touch.stamp_ns));
        let fewest = log.of_cell.iter().map(|(_, count)| *count).min();
        assert!(fewest >= Some(OF_A_CELL / 4), "{fewest:?}");
    }

    #[test]
    fn touches_that_say_the_same_are_left_out() {
        let mut log = ProbedLog::new(None);
        log.begin_stroke();
        (0..100).for_each(|ms| noted(&mut log, ms));
        assert_eq!(log.points().len(), 25);
    }
}
