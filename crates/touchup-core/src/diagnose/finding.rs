//! What is wrong with an input.

use std::fmt;

use serde::Serialize;

/// What would explain the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InputCause {
    /// Stamps of zero.
    ZeroStamps,
    /// Poses and wrenches are stamped by clocks that have nothing in common.
    TwoEpochs,
    /// Stamps of one stream that go back.
    StampsGoBack,
    /// Poses too far apart in time to interpolate between them.
    SlowPoses,
    /// The wrench is stamped later or earlier than the pose of the same instant.
    Delay,
    /// No sample came of the messages.
    NoSample,
    /// No force that stands out of the noise.
    NoContact,
    /// Poses, scan or radius in another unit of length.
    LengthUnit,
    /// Axes of the positions are swapped or mirrored.
    PositionAxes,
    /// The contacts are not on the scan.
    Frame,
    /// The ball's centre is another distance off the surface than its radius.
    Radius,
    /// The wrench is what the stylus does to the part.
    WrenchSign,
    /// The wrench is in other axes than those it was read in.
    WrenchFrame,
    /// The components of the orientation are in another order.
    QuaternionOrder,
    /// A force that is there while nothing is touched.
    Tare,
    /// Forces in another unit.
    ForceUnit,
    /// Contacts whose force is below the threshold of contact.
    LightTouch,
    /// Forces clipped at one value.
    Saturation,
}

/// A doubt about the input, what was measured, and what to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputFinding {
    /// what would explain it
    pub cause: InputCause,
    /// whether nothing but a mistake explains it; a result of such an input is not to be trusted
    pub is_sure: bool,
    /// with units
    pub measured: String,
    /// what to do
    pub remedy: &'static str,
}

impl InputFinding {
    pub(super) fn new(cause: InputCause, is_sure: bool, measured: String, remedy: &'static str) -> Self {
        Self { cause, is_sure, measured, remedy }
    }
}

impl fmt::Display for InputFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how_sure = if self.is_sure { "" } else { "perhaps: " };
        write!(f, "{how_sure}{}; {}", self.measured, self.remedy)
    }
}
