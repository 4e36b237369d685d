//! Numbers of a job: `summary.json` in its folder, without time, host or path.

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
        /// wrenches of the recording, each a possible sample
        samples: u64 = refined.samples,
        /// accepted samples
        accepted: u64 = refined.accepted,
        /// refused samples by reason; `pose_…` are lost poses and not samples
        refused: BTreeMap<String, u64> = refined.refused,
        /// number of times that the stylus came into contact
        contacts: u64 = refined.contacts,
        /// updates reduced because a face would fold, before the first contact
        cut_back: u64 = refined.cut_back,
        /// coefficient of friction of the ball on the part; absent if it never slid far enough
        friction?: f64 = refined.friction.map(|found| found.mu),
        /// standard error of the friction
        friction_sigma?: f64 = refined.friction.map(|found| found.sigma),
        /// faces off their position in the scan
        moved_faces: u64 = refined.outcome.moved_faces,
        /// number in the refined mesh
        vertices: usize = refined.outcome.counts[0],
        /// number in the refined mesh
        faces: usize = refined.outcome.counts[1],
        /// number in features.json
        features: usize = feature_count,
        /// numbers of the remeshed part, as in `patch` and `uncertainty` of `touchup refine --json`
        #[serde(flatten)]
        reconstruction: BTreeMap<String, Value> = reconstruction(&refined.outcome),
        /// doubts about the recording, the surest first, without paths
        findings: Vec<String> = refined.findings.iter().map(|finding| plain(&finding.to_string())).collect(),
        /// losses that a better recording would avoid, without paths
        losses: Vec<String> = lost.iter().map(|loss| plain(loss)).collect(),
    }
}

/// Machine-dependent keys, and lists.
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
