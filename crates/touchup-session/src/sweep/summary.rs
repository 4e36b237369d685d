//! What came of a job, in numbers: `summary.json` in its folder. No time, host or path is in it.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::refinement::RefinedScan;
use crate::reported;
use crate::session::Outcome;
use serde_json::Value;

reported! {
    /// The numbers of `touchup refine --json` that a recording and a scene determine.
    pub(super) struct JobSummary, pub fn of(refined: &RefinedJob, outcome: &Outcome, features: usize) {
        /// wrenches of the recording: each could be a sample
        samples: u64 = refined.samples,
        /// those that the refiner took
        accepted: u64 = refined.accepted,
        /// those that it refused, by reason; `pose_…` are lost poses and not samples
        refused: BTreeMap<String, u64> = refined.refused.clone(),
        /// times that the stylus came into contact
        contacts: u64 = refined.contacts,
        /// updates made smaller because a face would have folded
        cut_back: u64 = refined.cut_back,
        /// coefficient of friction of the ball on the part, and its standard error; left out when
        /// it never slid far enough
        friction?: f64 = refined.friction.map(|[mu, _]| mu),
        /// … its standard error
        friction_sigma?: f64 = refined.friction.map(|[_, sigma]| sigma),
        /// faces that are not where the scan had them
        moved_faces: u64 = outcome.moved_faces,
        /// of the refined mesh
        vertices: usize = outcome.counts[0],
        /// of the refined mesh
        faces: usize = outcome.counts[1],
        /// of features.json
        features: usize = features,
        /// what was remeshed, and how well it is known, as in `patch` and `uncertainty` of `touchup
        /// refine --json`
        #[serde(flatten)]
        reconstruction: BTreeMap<String, Value> = reconstruction(outcome),
        /// what is doubtful about the recording, the surest first
        findings: Vec<String> = refined.findings.clone(),
        /// what a better recording would not lack
        losses: Vec<String> = refined.losses.clone(),
    }
}

/// What is reported of a refinement, apart from its mesh.
pub(super) struct RefinedJob {
    samples: u64,
    accepted: u64,
    refused: BTreeMap<String, u64>,
    contacts: u64,
    cut_back: u64,
    friction: Option<[f64; 2]>,
    findings: Vec<String>,
    losses: Vec<String>,
}

impl RefinedJob {
    /// - `plain`: takes paths out of a message.
    pub fn of(refined: &RefinedScan, plain: impl Fn(&str) -> String) -> Self {
        let RefinedScan {
            finished,
            replayed,
            accepted,
            refused,
            findings,
        } = refined;
        Self {
            samples: replayed.wrenches,
            accepted: *accepted,
            refused: refused.clone(),
            contacts: finished.counts.contacts,
            cut_back: finished.counts.cut_back,
            friction: finished.friction.map(|found| [found.mu, found.sigma]),
            findings: findings
                .iter()
                .map(|finding| plain(&finding.to_string()))
                .collect(),
            losses: replayed.losses.iter().map(|loss| plain(loss)).collect(),
        }
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
