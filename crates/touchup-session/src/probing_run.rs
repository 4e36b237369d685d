//! Probes flagged features with one arm, one after the other: for `touchup probe`, `demo --robot`
//! and the node.
//!
//! The arm, the mesh that it probes and the observer of its states and progress are passed in as an
//! [`Arm`] and a [`World`].

use touchup_probing::arm::{Arm, ArmState};
use touchup_probing::execute::{
    Flag, FlagResult, Plan, ProbeParams, Prober, References, RobotCell, WayOut, World, plan,
};
use touchup_probing::plan::ExploreError;

/// Cell of an arm, and the state of its probing between two features.
#[derive(Clone, Debug)]
pub struct ProbingRun {
    /// geometry of the arm, and the pose of the scan
    pub cell: RobotCell,
    /// contacts that the arm touches again after each feature
    references: References,
    /// path out of the feature at which the last probing stopped
    way_out: Option<WayOut>,
}

impl ProbingRun {
    /// Starts without any touch, with an arm in free air.
    pub fn new(cell: RobotCell) -> Self {
        Self {
            cell,
            references: References::default(),
            way_out: None,
        }
    }

    /// Plans the next feature; nothing moves.
    ///
    /// - `now`: state of the arm.
    ///
    /// # Errors
    /// [`ExploreError`] without a pattern for the flag.
    pub fn plan(
        &self,
        params: &ProbeParams,
        flag: &Flag,
        now: &ArmState,
        world: &dyn World,
    ) -> Result<Plan, ExploreError> {
        plan(&self.cell, params, world, flag, now, self.way_out.as_ref())
    }

    /// Probes the next feature. The arm first leaves the feature at which the last probing stopped,
    /// if it still stands there, and in the end touches contacts of earlier features again.
    pub fn probe(
        &mut self,
        params: &ProbeParams,
        flag: &Flag,
        arm: &mut dyn Arm,
        world: &mut dyn World,
    ) -> FlagResult {
        let mut prober = Prober::new(arm, &self.cell, params, world);
        prober.way_out = self.way_out.take();
        prober.references = std::mem::take(&mut self.references);
        let probed = prober.probe(flag);
        // a contact that moved the part invalidates earlier touches
        if !probed.ending.is_displaced() {
            self.references = std::mem::take(&mut prober.references);
        }
        self.way_out = prober.way_out;
        probed
    }
}
