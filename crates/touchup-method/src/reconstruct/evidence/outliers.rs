//! Outliers: contacts that contradict earlier ones at their place; counted, and the latest kept for
//! inspection.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

/// Consecutive rejected contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// stamp of the first contact, ns
    pub stamp_ns: i64,
    /// point of the contact with the largest contradiction, m, in O
    pub point: Point3<f64>,
    /// unit normal of that contact, in O
    pub normal: Vector3<f64>,
    /// distance from the earlier surface, m; positive outside
    pub innovation: f64,
    /// distance from the earlier surface in standard deviations
    pub sigmas: f64,
    /// number of contacts
    pub contacts: u64,
}

/// Counts of rejected contacts, and the latest outliers.
#[derive(Clone, Debug, Default)]
pub struct Outliers {
    /// number of contacts
    pub contacts: u64,
    /// number of rejected contacts
    pub rejected: u64,
    /// number of places relocated by an agreeing second pass
    pub relocated: u64,
    last: VecDeque<Outlier>,
    last_ns: i64,
}

/// Number of outliers in memory.
const KEPT: usize = 64;

impl Outliers {
    /// The latest outliers, in order of time.
    pub fn last(&self) -> impl Iterator<Item = &Outlier> + '_ {
        self.last.iter()
    }

    /// Counts a contact; contacts within `pause_ns` of each other form one outlier.
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
