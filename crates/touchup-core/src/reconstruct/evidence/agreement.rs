//! The contacts that a scan agrees with, and where they move it.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_map::{ContactMap, MeanContact};

/// Mismatches beyond this are no agreement, in radii.
pub(in crate::reconstruct) const LARGEST_MISMATCH: f64 = 1.0 / 3.0;
/// Width of the weights, in radii.
const WIDTH: f64 = 1.0;
/// Contacts without agreement take the scan from the field within this, in radii.
const VETO: f64 = 1.0;
/// … where they have more than this share of the weight.
const REFUSING: f64 = 0.1;
/// What is farther off the moved scan than this, in radii, is another surface, unless the ball lay
/// across it.
const LARGEST_OFF: f64 = 0.1;
/// … and where two touched surfaces meet, or one ends, and the scan is deeper, this.
const EDGE_OFF: f64 = 1.0 / 30.0;
/// Contacts face alike on one smooth surface, its engraved lines among them: cosine of the widest
/// angle (26°).
pub(in crate::reconstruct) const BENT: f64 = 0.9;
/// They are all around where their mean is no farther off than this, in radii of the neighbourhood
/// (of a half disc: 0.42).
const RINGED: f64 = 0.35;
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
    pub fn agreeing<'a>(
        &'a self,
        contacts: &'a ContactMap,
    ) -> impl Iterator<Item = (&'a MeanContact, f64)> {
        contacts
            .means()
            .iter()
            .zip(&self.mismatch)
            .filter_map(|(contact, mismatch)| Some((contact, (*mismatch)?)))
    }

    /// u(x), m, and s.
    pub fn displacement(&self, contacts: &ContactMap, x: &Point3<f64>) -> (Vector3<f64>, f64) {
        let of = |index: u32| self.mismatch[index as usize];
        let mut nearest = f64::INFINITY;
        contacts.near(x, RESTS * self.radius, |distance_squared, index| {
            nearest = if of(index).is_some() {
                nearest.min(distance_squared)
            } else {
                nearest
            };
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

    /// Whether the moved scan is what was touched around its point `foot`: some contacts near it
    /// agree, and nearly all that are nearest do; and whether these are on one surface that goes on
    /// all around.
    ///
    /// - `normal`: of what was touched there.
    /// - returns: `None` where it is not.
    pub fn around(
        &self,
        contacts: &ContactMap,
        foot: &Point3<f64>,
        normal: &Vector3<f64>,
    ) -> Option<ContactsAround> {
        let (mut is_known, mut is_bent) = (false, false);
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        let (mut refusing, mut weights) = (0.0, 0.0);
        contacts.near(foot, RESTS * self.radius, |distance_squared, index| {
            let agrees = self.mismatch[index as usize].is_some();
            is_known |= agrees;
            if distance_squared < (VETO * self.radius).powi(2) {
                let contact = &contacts.means()[index as usize];
                refusing += if agrees { 0.0 } else { contact.weight };
                weights += contact.weight;
                is_bent |= contact.normal.dot(normal) < BENT;
                sum += contact.point - foot;
                count += 1.0;
            }
        });
        let is_ringed = count > 0.0 && sum.norm() < RINGED * self.radius * count;
        let surroundings = if is_ringed && !is_bent {
            ContactsAround::Smooth
        } else {
            ContactsAround::BentOrOpen
        };
        (is_known && refusing <= REFUSING * weights).then_some(surroundings)
    }

    /// Whether the moved scan may be the surface where it is `deeper` (m) than the touched one, of
    /// which that is the `part`.
    pub fn is_alike(&self, deeper: f64, part: TouchedPart) -> bool {
        let [highest, deepest] = match part {
            TouchedPart::Edge => [EDGE_OFF; 2],
            TouchedPart::Border => [LARGEST_OFF, EDGE_OFF],
            TouchedPart::Beyond => [LARGEST_MISMATCH, EDGE_OFF],
            TouchedPart::Middle => [LARGEST_OFF, LARGEST_MISMATCH],
        };
        (-highest..=deepest).contains(&(deeper / self.radius))
    }
}

/// What the contacts around a point of the moved scan are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactsAround {
    /// on one smooth surface, all around
    Smooth,
    /// on surfaces that meet in an edge, or on one side alone
    BentOrOpen,
}

/// Where on a touched surface a point is: what a scan may be there that agrees with the contacts
/// around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TouchedPart {
    /// felt all around: where the scan is deeper, the ball may have lain across it
    Middle,
    /// it meets another touched surface: both are known up to there
    Edge,
    /// it ends here, or may, and a scan that is deeper may be a blurred edge
    Border,
    /// … and no contact is so near that its surface is felt: the moved scan may rise to where it
    /// was
    Beyond,
}
