//! What came of a job, in numbers: `summary.json` in its folder. No time, host or path is in it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::refinement::RefinementSummary;
use crate::reported;
use crate::session::Outcome;
use serde_json::Value;

reported! {
    /// The numbers of `touchup refine --json` that a recording and a scene determine.
    pub(super) struct JobSummary, pub fn of(
        refined: RefinementSummary,
        lost: &[String],
        feature_count: usize,
        plain: &dyn Fn(&str) -> String
    ) {
        /// wrenches of the recording: each could be a sample
        samples: u64 = refined.samples,
        /// accepted samples
        accepted: u64 = refined.accepted,
        /// refused samples by reason; `pose_…` are lost poses and not samples
        refused: BTreeMap<String, u64> = refined.refused,
        /// times that the stylus came into contact
        contacts: u64 = refined.contacts,
        /// updates made smaller because a face would have folded, before the first contact
        cut_back: u64 = refined.cut_back,
        /// coefficient of friction of the ball on the part; left out when it never slid far enough
        friction?: f64 = refined.friction.map(|found| found.mu),
        /// standard error of the friction
        friction_sigma?: f64 = refined.friction.map(|found| found.sigma),
        /// faces that are not where the scan had them
        moved_faces: u64 = refined.outcome.moved_faces,
        /// of the refined mesh
        vertices: usize = refined.outcome.counts[0],
        /// of the refined mesh
        faces: usize = refined.outcome.counts[1],
        /// of features.json
        features: usize = feature_count,
        /// numbers of the remeshed part, as in `patch` and `uncertainty` of `touchup refine --json`
        #[serde(flatten)]
        reconstruction: BTreeMap<String, Value> = reconstruction(&refined.outcome),
        /// doubts about the recording, the surest first, without paths
        findings: Vec<String> = refined.findings.iter().map(|finding| plain(&finding.to_string())).collect(),
        /// what a better recording would not lack, without paths
        losses: Vec<String> = lost.iter().map(|loss| plain(loss)).collect(),
    }
}

/// What depends on the machine, or is a list of its own.
const LEFT_OUT: [&str; 2] = ["build_s", "outliers"];

fn reconstruction(outcome: &Outcome) -> BTreeMap<String, Value> {
    fn of(part: &impl Serialize) -> Option<Value> {
        serde_json::to_value(part).ok()
    }
    let parts = [of(&outcome.patch), of(&outcome.uncertainty)];
    let numbers = parts.into_iter().flatten().filter_map(|part| {
        if let Value::Object(part) = part {
            Some(part)
        } else {
            None
        }
    });
    numbers
        .flatten()
        .filter(|(name, _)| !LEFT_OUT.contains(&&**name))
        .collect()
}
