//! Assumptions about an input.

use touchup_method::stylus::{
    CompensatorParams, ContactGateParams, Placement, SyncParams, TipParams, TipShape,
};

/// Assumptions about the input.
#[derive(Clone, Debug)]
pub struct InputMonitorParams {
    /// weight, constant bias, frames
    pub compensator: CompensatorParams,
    /// size and stiffness of the tip
    pub tip: TipParams,
    /// standard uncertainty of the stiffness, as a share
    pub stiffness_share: f64,
    /// standard uncertainty of the place of the ball along each axis, m
    pub place_sigma: f64,
    /// shape of the tip; the radius check needs a ball
    pub shape: TipShape,
    /// standard deviation of the scan, m; 0: not known
    pub scan_noise: f64,
    /// placement of the recorded poses
    pub placement: Placement,
    /// thresholds of contact; `None`: every sample is contact
    pub gate: Option<ContactGateParams>,
    /// pairing of poses and wrenches
    pub sync: SyncParams,
}
