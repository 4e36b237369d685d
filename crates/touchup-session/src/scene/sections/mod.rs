//! The sections of the YAML, each with its units in the keys, its defaults and its ranges.

mod evidence;
mod robot;
mod stream;
mod tip;
mod update;

use serde::{Deserialize, Deserializer};

use super::SceneError;
pub use evidence::{CarveSection, PatchSection, SlidingSection, UncertaintySection};
pub use robot::RobotSection;
pub use stream::{
    BiasSection, BiasTrackingSection, ClockSection, CompensationSection, GravityAxes, MarkersSection, PayloadSection,
    ScanToSpaceSection, SyncSection,
};
pub use tip::{ContactSection, ScanSection, ShapeName, TipSection};
pub use update::{AlongName, GuardSection, Mode, ModelName, RefineSection, StepName};

/// A key that is there names its part, also without a value.
pub(super) fn named<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    Option::<T>::deserialize(deserializer).map(|part| Some(part.unwrap_or_default()))
}

fn in_range(key: &'static str, value: f64, low: f64, high: f64, allowed: &'static str) -> Result<(), SceneError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(SceneError::OutOfRange { key, value, allowed }) }
}
