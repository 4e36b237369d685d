//! Summary of a refinement, as every caller reports it.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use touchup_features::diagnose::InputFinding;
use touchup_geometry::numeric::counted;
use touchup_method::stylus::{FrictionCoefficient, MarkerCounts};

use super::{LiveSummary, ScanOffset, WrenchOffset};
use crate::live::Quantiles;
use crate::session::{Outcome, UncertaintySummary};

/// Numbers of a refinement; `push_ns` in ns.
#[derive(Debug, Serialize)]
pub struct RefinementSummary {
    /// wrenches of the recording, each a possible sample
    pub samples: u64,
    /// accepted samples
    pub accepted: u64,
    /// refused samples by reason; `pose_…` are lost poses and not samples
    pub refused: BTreeMap<String, u64>,
    /// number of times that the stylus came into contact
    pub contacts: u64,
    /// counts of the markers, if they give the pose
    #[serde(skip_serializing_if = "Option::is_none")]
    pub markers: Option<MarkerCounts>,
    /// clock offset of the wrench beyond the scene's, if the touches determine it and the scene has
    /// `clock`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench_offset: Option<WrenchOffset>,
    /// rigid offset of the scan from the part, on request
    #[serde(skip_serializing_if = "Option::is_none")]
    pub registration: Option<ScanOffset>,
    /// doubts about the recording, the surest first (`touchup doctor`)
    pub findings: Vec<InputFinding>,
    /// updates reduced because a face would fold; with a patch at the end only before the first
    /// contact
    pub cut_back: u64,
    /// friction of the ball on the part; `null` if it never slid far enough
    pub friction: Option<FrictionSummary>,
    /// processing time of one sample
    pub push_ns: Quantiles,
    /// lag of the patch behind the samples, in real time
    #[serde(skip_serializing_if = "Option::is_none")]
    pub live: Option<LiveSummary>,
    /// numbers of the mesh
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// Coefficient of kinetic friction and its standard error.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrictionSummary {
    /// coefficient
    pub mu: f64,
    /// standard error
    pub sigma: f64,
}

impl From<FrictionCoefficient> for FrictionSummary {
    fn from(FrictionCoefficient { mu, sigma, .. }: FrictionCoefficient) -> Self {
        Self { mu, sigma }
    }
}

impl RefinementSummary {
    /// The reconstructed or moved part and its uncertainty, in one sentence.
    pub fn verdict(&self) -> String {
        let faces = counted(self.outcome.moved_faces, "face", "faces");
        match (&self.outcome.patch, self.contacts) {
            (_, 0) if self.outcome.moved_faces > 0 => {
                format!("refined: contact was not told from free air, and {faces} moved")
            }
            (_, 0) => "unchanged: the stylus never came into contact with the scan".to_owned(),
            (Some(patch), _) => match &self.outcome.uncertainty {
                Some(uncertainty) => format!("refined: {patch}, {uncertainty}"),
                None => format!("refined: {patch}"),
            },
            (None, contacts) => {
                let times = counted(contacts, "time", "times");
                format!("refined: the stylus came into contact {times} and moved {faces}")
            }
        }
    }
}

/// One line per further result.
impl fmt::Display for RefinementSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let uncertainty = self.outcome.uncertainty.as_ref();
        let outlier = uncertainty.and_then(UncertaintySummary::last_outlier);
        let friction = self
            .friction
            .map(|FrictionSummary { mu, sigma }| format!("friction: {mu:.3} ± {sigma:.3}"));
        let markers = self.markers.map(|markers| {
            let MarkerCounts {
                held,
                coasting,
                lost,
                relabelled,
                rejected,
            } = markers;
            format!(
                "marker frames: {held} held the pose, {coasting} coasted, {lost} without a pose; markers: {relabelled} \
                 relabelled, {rejected} rejected"
            )
        });
        let clock = self.wrench_offset.map(|clock| format!("clock: {clock}"));
        let scan = self.registration.as_ref();
        let lines = [
            outlier,
            friction,
            markers,
            clock,
            scan.map(|scan| format!("scan: {scan}")),
            self.live.as_ref().map(LiveSummary::to_string),
        ];
        let lines: Vec<_> = lines.into_iter().flatten().collect();
        write!(f, "{}", lines.join("\n"))
    }
}
