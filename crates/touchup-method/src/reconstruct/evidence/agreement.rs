//! Contacts with scan agreement, and the displacement of the scan to them.

use nalgebra::{Point3, Vector3};

use crate::reconstruct::evidence::contact_map::{ContactMap, MeanContact};

/// Maximum mismatch of agreement, in radii.
pub(in crate::reconstruct) const LARGEST_MISMATCH: f64 = 1.0 / 3.0;
/// Width of the weights, in radii.
const WIDTH: f64 = 1.0;
/// Contacts without agreement within this distance, in radii, replace the scan by the field.
const VETO: f64 = 1.0;
/// Share of the weight above which contacts without agreement replace the scan.
const REFUSING: f64 = 0.1;
/// Maximum height difference of scan and touched surface, in radii; beyond it the scan is another
/// surface, unless the ball lay across it.
const LARGEST_OFF: f64 = 0.1;
/// Maximum height difference at the edge of two touched surfaces, or of a deeper scan at a border.
const EDGE_OFF: f64 = 1.0 / 30.0;
/// Minimum cosine between normals of contacts on one smooth surface, engraved lines included (26°).
pub(in crate::reconstruct) const BENT: f64 = 0.9;
/// Maximum offset of the mean of contacts all around a point, in radii of the neighbourhood (of a
/// half disc: 0.42).
const RINGED: f64 = 0.35;
/// Distance from agreeing contacts, in radii, up to which the scan fully follows them.
const MOVES: f64 = 1.0;
/// Distance from agreeing contacts, in radii, from which on the scan stays.
pub(in crate::reconstruct) const RESTS: f64 = 2.0;

/// Contacts that agree with the moved scan.
#[derive(Clone, Debug)]
pub(crate) struct Agreement {
    /// mismatch by number of the mean contact, m, if it agrees
    pub mismatch: Vec<Option<f64>>,
    /// radius of the ball, m
    pub radius: f64,
}

impl Agreement {
    pub(crate) fn agreeing<'a>(
        &'a self,
        contacts: &'a ContactMap,
    ) -> impl Iterator<Item = (&'a MeanContact, f64)> {
        contacts
            .means()
            .iter()
            .zip(&self.mismatch)
            .filter_map(|(contact, mismatch)| Some((contact, (*mismatch)?)))
    }

    /// Displacement u(x), m, and its share s.
    pub(crate) fn displacement(
        &self,
        contacts: &ContactMap,
        x: &Point3<f64>,
    ) -> (Vector3<f64>, f64) {
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

    /// Whether the moved scan is the touched surface around its point `foot` (some contacts near it
    /// agree, and nearly all of the nearest), and whether these surround it on one surface.
    ///
    /// - `normal`: of the touched surface there.
    /// - returns: `None` if the scan is not the touched surface.
    pub(crate) fn around(
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

    /// Whether the moved scan may be the surface at a `part` of the touched one, `deeper` (m) than
    /// it.
    pub(crate) fn is_alike(&self, deeper: f64, part: TouchedPart) -> bool {
        let [highest, deepest] = match part {
            TouchedPart::Edge => [EDGE_OFF; 2],
            TouchedPart::Border => [LARGEST_OFF, EDGE_OFF],
            TouchedPart::Beyond => [LARGEST_MISMATCH, EDGE_OFF],
            TouchedPart::Middle => [LARGEST_OFF, LARGEST_MISMATCH],
        };
        (-highest..=deepest).contains(&(deeper / self.radius))
    }
}

/// Arrangement of the contacts around a point of the moved scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactsAround {
    /// on one smooth surface, all around
    Smooth,
    /// on surfaces that meet in an edge, or on one side alone
    BentOrOpen,
}

/// Part of a touched surface: determines how an agreeing scan may differ from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TouchedPart {
    /// contacts all around: the ball may have lain across a deeper scan
    Middle,
    /// it meets another touched surface: both are known up to there
    Edge,
    /// it ends here, or may, and a deeper scan may be a blurred edge
    Border,
    /// a border without a contact near enough: the moved scan may rise to its original height
    Beyond,
}
