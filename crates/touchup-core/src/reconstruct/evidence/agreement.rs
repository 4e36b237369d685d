//! The contacts that a scan agrees with, and where they move it.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_map::{ContactMap, MeanContact};

/// Mismatches beyond this are no agreement, in radii.
pub(in crate::reconstruct) const LARGEST_MISMATCH: f64 = 1.0 / 3.0;
/// Width of the weights, in radii.
const WIDTH: f64 = 0.5;
/// Contacts without agreement take the scan from the field within this, in radii.
const VETO: f64 = 1.0;
/// What is farther off the moved scan than this, in radii, is another surface, unless the ball lay across it.
const LARGEST_OFF: f64 = 0.1;
/// So far from contacts that agree, in radii, the scan moves along with them …
const MOVES: f64 = 1.0;
/// … and from here on not at all.
pub(in crate::reconstruct) const RESTS: f64 = 2.0;

/// Which contacts the moved scan agrees with.
#[derive(Clone, Debug)]
pub(crate) struct Agreement {
    /// by number of the mean contact: its mismatch, m, where it agrees
    pub mismatch: Vec<Option<f64>>,
    /// of the ball, m
    pub radius: f64,
}

impl Agreement {
    pub fn agreeing<'a>(&'a self, contacts: &'a ContactMap) -> impl Iterator<Item = (&'a MeanContact, f64)> {
        contacts.means().iter().zip(&self.mismatch).filter_map(|(contact, mismatch)| Some((contact, (*mismatch)?)))
    }

    /// u(x), m, and s.
    pub fn displacement(&self, contacts: &ContactMap, x: &Point3<f64>) -> (Vector3<f64>, f64) {
        let of = |index: u32| self.mismatch[index as usize];
        let mut nearest = f64::INFINITY;
        contacts.near(x, RESTS * self.radius, |distance_squared, index| {
            nearest = if of(index).is_some() { nearest.min(distance_squared) } else { nearest };
        });
        if !nearest.is_finite() {
            return (Vector3::zeros(), 0.0);
        }
        let width = (WIDTH * self.radius).powi(2).max(0.5 * nearest);
        let (mut sum, mut weights) = (Vector3::zeros(), 0.0);
        contacts.near(x, RESTS * self.radius, |distance_squared, index| {
            if let Some(mismatch) = of(index) {
                let contact = &contacts.means()[index as usize];
                let weight = contact.weight * (-(distance_squared - nearest) / width).exp();
                sum += contact.normal * (weight * mismatch);
                weights += weight;
            }
        });
        let share = ((RESTS - nearest.sqrt() / self.radius) / (RESTS - MOVES)).clamp(0.0, 1.0);
        (sum * (share * share * (3.0 - 2.0 * share) / weights), share)
    }

    /// Whether the moved scan is what was touched around its point `foot`: some contacts near it agree, and all that are nearest do.
    pub fn holds(&self, contacts: &ContactMap, foot: &Point3<f64>) -> bool {
        let (mut is_known, mut is_refused) = (false, false);
        contacts.near(foot, RESTS * self.radius, |distance_squared, index| {
            let agrees = self.mismatch[index as usize].is_some();
            is_known |= agrees;
            is_refused |= !agrees && distance_squared < (VETO * self.radius).powi(2);
        });
        is_known && !is_refused
    }

    /// Whether the moved scan may be the surface where it is `deeper` (m) than the touched one.
    ///
    /// - `is_felt`: a contact is so near that its surface is felt here; farther away the moved scan may rise to where it was.
    /// - `ends`: what was touched ends here, or may, so that a scan that is deeper may be a blurred edge; else the ball may have lain
    ///   across it.
    pub fn is_alike(&self, deeper: f64, is_felt: bool, ends: bool) -> bool {
        let highest = if is_felt { LARGEST_OFF } else { LARGEST_MISMATCH };
        let deepest = if ends { LARGEST_OFF } else { LARGEST_MISMATCH };
        (-highest..=deepest).contains(&(deeper / self.radius))
    }
}
