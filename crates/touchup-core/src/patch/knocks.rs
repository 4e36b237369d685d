//! What contradicted the place it was felt at: counted, and the last of it kept for inspection.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

/// Contacts one after the other that were held apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knock {
    /// when it began, ns
    pub stamp_ns: i64,
    /// where the contact was that contradicted most, m, in O
    pub point: Point3<f64>,
    /// … and its unit normal, in O
    pub normal: Vector3<f64>,
    /// how far it was off, m; positive outside
    pub innovation: f64,
    /// how many standard deviations that was
    pub sigmas: f64,
    /// how many contacts
    pub contacts: u64,
}

/// All that was held apart.
#[derive(Clone, Debug, Default)]
pub struct Knocks {
    /// how many contacts were held apart
    pub held_apart: u64,
    /// how many places moved because a second pass said the same
    pub insisted: u64,
    last: VecDeque<Knock>,
    last_ns: i64,
}

/// So many are kept.
const KEPT: usize = 64;

impl Knocks {
    /// The last ones, in order of time.
    pub fn last(&self) -> impl Iterator<Item = &Knock> + '_ {
        self.last.iter()
    }

    /// Counts a contact; those within `pause_ns` are one knock.
    pub(super) fn note(&mut self, knock: Knock, pause_ns: i64) {
        self.held_apart += 1;
        let goes_on = knock.stamp_ns.saturating_sub(self.last_ns) <= pause_ns;
        self.last_ns = knock.stamp_ns;
        match self.last.back_mut().filter(|_| goes_on) {
            Some(last) => {
                let (stamp_ns, contacts) = (last.stamp_ns, last.contacts + 1);
                let most = if knock.sigmas > last.sigmas { knock } else { *last };
                *last = Knock { stamp_ns, contacts, ..most };
            }
            None => {
                if self.last.len() == KEPT {
                    self.last.pop_front();
                }
                self.last.push_back(knock);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_in_a_row_are_one_knock_and_the_last_ones_are_kept() {
        let mut knocks = Knocks::default();
        for i in 0..100 {
            for (after_ns, sigmas) in [(0, 5.0), (10, 9.0), (20, 6.0)] {
                let (point, normal) = (Point3::origin(), Vector3::z());
                let stamp_ns = 1000 * (i + 1) + after_ns;
                knocks.note(Knock { stamp_ns, point, normal, innovation: 1e-4, sigmas, contacts: 1 }, 64);
            }
        }
        assert_eq!((knocks.held_apart, knocks.last().count()), (300, KEPT));
        let (first, last) = (knocks.last().next().unwrap(), knocks.last().last().unwrap());
        assert_eq!((first.stamp_ns, last.stamp_ns, last.contacts, last.sigmas), (37_000, 100_000, 3, 9.0));
    }
}
