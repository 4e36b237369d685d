//! Reports of `refine`: the uncertainty of the mesh, and contacts rejected as outliers.

use std::fmt;

use crate::reported;
use touchup_geometry::numeric::{counted, median};
use touchup_method::reconstruct::{Outlier, Outliers, PatchedMesh, Support};

reported! {
    /// Uncertainty in the output of `--json`.
    pub struct UncertaintySummary, pub fn of(patched: &PatchedMesh, found: &Outliers) {
        /// median standard deviation of the touched vertices
        touched_sigma_mm: f64 = touched_sigma_mm(patched),
        /// contacts of the reconstruction, counted or rejected
        judged: u64 = found.contacts,
        /// rejected contacts, which contradict their place
        rejected: u64 = found.rejected,
        /// places moved by a second pass that confirms the contradiction
        relocated: u64 = found.relocated,
        /// the last rejected contacts, in order of time
        outliers: Vec<OutlierSummary> =
            found.last().skip(found.last().count().saturating_sub(MOST_LISTED)).map(OutlierSummary::of).collect(),
    }
}

fn touched_sigma_mm(patched: &PatchedMesh) -> f64 {
    let known = patched.sigma.iter().zip(&patched.support);
    let mut touched: Vec<f64> = known
        .filter(|(_, support)| **support == Support::Touched)
        .map(|(sigma, _)| sigma * 1e3)
        .collect();
    median(&mut touched).unwrap_or_default()
}

reported! {
    /// A run of successive rejected contacts.
    struct OutlierSummary, fn of(outlier: &Outlier) {
        /// stamp of the first contact
        stamp_s: f64 = outlier.stamp_ns as f64 * 1e-9,
        /// position of the most contradictory contact
        point_mm: [f64; 3] = (outlier.point.coords * 1e3).into(),
        /// normal of that contact
        normal: [f64; 3] = outlier.normal.into(),
        /// distance of that contact from its place
        off_mm: f64 = outlier.innovation * 1e3,
        /// distance in standard deviations
        sigmas: f64 = outlier.sigmas,
        contacts: u64 = outlier.contacts,
    }
}

/// Number of listed outliers.
const MOST_LISTED: usize = 8;
/// Share of rejected contacts worth a report; in sound recordings it is below 0.002.
const WORTH_A_WORD: f64 = 0.1;
/// Share of rejected contacts above which the right ones are unknown.
const MOST_REJECTED: f64 = 0.4;

impl UncertaintySummary {
    fn is_rejected(&self, share: f64) -> bool {
        self.rejected as f64 > share * self.judged as f64
    }

    /// Whether contradictory contacts make the result worthless.
    pub fn is_contradictory(&self) -> bool {
        self.is_rejected(MOST_REJECTED)
    }

    /// Loss of contacts, if their share is worth a report.
    pub fn loss(&self) -> Option<String> {
        self.is_rejected(WORTH_A_WORD).then(|| self.contradiction())
    }

    /// Number of rejected contacts, and a remedy.
    pub fn contradiction(&self) -> String {
        let Self {
            rejected, judged, ..
        } = self;
        let percent = 100.0 * *rejected as f64 / *judged as f64;
        let [rejected, judged] = [*rejected, *judged].map(in_thousands);
        format!(
            "{percent:.0} % of the contacts contradicted others and did not count ({rejected} of {judged}): are the axes of the wrench, its \
             clock and the radius right, and did the part stay in place?"
        )
    }

    /// Place and distance of the last outlier.
    pub fn last_outlier(&self) -> Option<String> {
        let OutlierSummary {
            point_mm: [x, y, z],
            off_mm,
            sigmas,
            ..
        } = self.outliers.last()?;
        Some(format!(
            "last outlier: at ({x:.1}, {y:.1}, {z:.1}) mm, {off_mm:+.3} mm or {sigmas:.0} standard deviations off"
        ))
    }
}

/// 13547 as `13,547`.
fn in_thousands(count: u64) -> String {
    let digits = count.to_string();
    let groups = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(String::from_utf8_lossy);
    groups.collect::<Vec<_>>().join(",")
}

impl fmt::Display for UncertaintySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            touched_sigma_mm,
            rejected,
            relocated,
            judged,
            ..
        } = self;
        let (judged, places) = (
            in_thousands(*judged),
            counted(*relocated, "place", "places"),
        );
        write!(
            f,
            "± {touched_sigma_mm:.3} mm where touched (median standard deviation); {rejected} of {judged} contacts rejected as outliers, \
             {places} moved by a second pass"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{UncertaintySummary, in_thousands};

    #[test]
    fn many_rejected_contacts_are_a_loss_and_more_of_them_a_contradiction() {
        let of = |rejected, judged| UncertaintySummary {
            touched_sigma_mm: 0.01,
            judged,
            rejected,
            relocated: 0,
            outliers: Vec::new(),
        };
        for sound in [of(0, 0), of(40, 52_970), of(1, 10)] {
            assert_eq!((sound.loss(), sound.is_contradictory()), (None, false));
        }
        let lost = of(3_000, 12_000);
        assert!(lost.loss().unwrap().starts_with(
            "25 % of the contacts contradicted others and did not count (3,000 of 12,000)"
        ));
        assert!(!lost.is_contradictory() && of(4_801, 12_000).is_contradictory());
    }

    #[test]
    fn counts_are_grouped_by_three_digits_from_the_right() {
        let counts = [0, 7, 999, 1000, 13_547, 1_000_000].map(in_thousands);
        assert_eq!(counts, ["0", "7", "999", "1,000", "13,547", "1,000,000"]);
    }
}
