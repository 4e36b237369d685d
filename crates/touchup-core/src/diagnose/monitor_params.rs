//! What an input is taken for.

use crate::stylus::{
    CompensatorParams, ContactGateParams, Placement, SyncParams, TipParams, TipShape,
};

/// What the input is taken for.
#[derive(Clone, Copy, Debug)]
pub struct InputMonitorParams {
    /// weight, constant bias, frames
    pub compensator: CompensatorParams,
    /// size and stiffness of the tip
    pub tip: TipParams,
    /// of any other than a ball the radius is not checked
    pub shape: TipShape,
    /// standard deviation of the scan, m; 0: not known
    pub scan_noise: f64,
    /// how the recorded poses were placed
    pub placement: Placement,
    /// thresholds of contact; `None`: every sample is contact
    pub gate: Option<ContactGateParams>,
    /// of the pairing
    pub sync: SyncParams,
}
