//! Outliers: contacts that contradicted earlier ones at their place; counted, and the last of them
//! kept for inspection.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

/// Contacts one after the other that were rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
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

/// All that was rejected.
#[derive(Clone, Debug, Default)]
pub struct Outliers {
    /// how many contacts were judged
    pub contacts: u64,
    /// how many of them were rejected
    pub rejected: u64,
    /// how many places moved because a second pass agreed
    pub relocated: u64,
    last: VecDeque<Outlier>,
    last_ns: i64,
}

/// So many are kept.
const KEPT: usize = 64;

impl Outliers {
    /// The last ones, in order of time.
    pub fn last(&self) -> impl Iterator<Item = &Outlier> + '_ {
        self.last.iter()
    }

    /// Counts a contact; those within `pause_ns` are one outlier.
    pub(in crate::reconstruct) fn note(&mut self, outlier: Outlier, pause_ns: i64) {
        self.rejected += 1;
        let goes_on = outlier.stamp_ns.saturating_sub(self.last_ns) <= pause_ns;
        self.last_ns = outlier.stamp_ns;
        match self.last.back_mut().filter(|_| goes_on) {
            Some(last) => {
                let (stamp_ns, contacts) = (last.stamp_ns, last.contacts + 1);
                let most = if outlier.sigmas > last.sigmas {
                    outlier
                } else {
                    *last
                };
                *last = Outlier {
                    stamp_ns,
                    contacts,
                    ..most
                };
            }
            None => {
                if self.last.len() == KEPT {
                    self.last.pop_front();
                }
                self.last.push_back(outlier);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_in_a_row_are_one_outlier_and_the_last_ones_are_kept() {
        let mut outliers = Outliers::default();
        for i in 0..100 {
            for (after_ns, sigmas) in [(0, 5.0), (10, 9.0), (20, 6.0)] {
                let (point, normal) = (Point3::origin(), Vector3::z());
                let stamp_ns = 1000 * (i + 1) + after_ns;
                outliers.note(
                    Outlier {
                        stamp_ns,
                        point,
                        normal,
                        innovation: 1e-4,
                        sigmas,
                        contacts: 1,
                    },
                    64,
                );
            }
        }
        assert_eq!((outliers.rejected, outliers.last().count()), (300, KEPT));
        let (first, last) = (
            outliers.last().next().unwrap(),
            outliers.last().last().unwrap(),
        );
        assert_eq!(
            (first.stamp_ns, last.stamp_ns, last.contacts, last.sigmas),
            (37_000, 100_000, 3, 9.0)
        );
    }
}
