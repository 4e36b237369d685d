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
