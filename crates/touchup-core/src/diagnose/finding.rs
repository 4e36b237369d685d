//! What is wrong with an input.

use std::fmt;

use serde::Serialize;

use crate::names;

names! {
    /// What would explain the recording, in the order in which it is to be mended: each may be what
    /// the later ones come of.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum InputCause {
        /// Stamps of zero.
        ZeroStamps = "zero_stamps",
        /// Poses and wrenches are stamped by clocks that have nothing in common.
        TwoEpochs = "two_epochs",
        /// Stamps in another unit of time.
        TimeUnit = "time_unit",
        /// Stamps of one stream that go back.
        StampsGoBack = "stamps_go_back",
        /// Poses too far apart in time to interpolate between them.
        SlowPoses = "slow_poses",
        /// No sample came of the messages.
        NoSample = "no_sample",
        /// No force that stands out of the noise.
        NoContact = "no_contact",
        /// So few places were touched that they fit almost anywhere.
        FewContacts = "few_contacts",
        /// Forces in another unit.
        ForceUnit = "force_unit",
        /// Contacts whose force is below the threshold of contact.
        LightTouch = "light_touch",
        /// Forces in steps wider than what decides about contact.
        ForceSteps = "force_steps",
        /// Poses, scan or radius in another unit of length.
        LengthUnit = "length_unit",
        /// Axes of the positions are swapped or mirrored.
        PositionAxes = "position_axes",
        /// The components of the orientation are in another order.
        QuaternionOrder = "quaternion_order",
        /// The scan has its outside within.
        InsideOut = "inside_out",
        /// The wrench is what the stylus does to the part.
        WrenchSign = "wrench_sign",
        /// The wrench is in other axes than those it was read in.
        WrenchFrame = "wrench_frame",
        /// The wrench is stamped later or earlier than the pose of the same instant.
        Delay = "delay",
        /// The contacts are not on the scan.
        Frame = "frame",
        /// The ball's centre is another distance off the surface than its radius.
        Radius = "radius",
        /// The stylus bends more, or less, than its stiffness says.
        Stiffness = "stiffness",
        /// Forces clipped at one value.
        Saturation = "saturation",
        /// A force that is there while nothing is touched.
        Tare = "tare",
    }
}

impl InputCause {
    /// Whether it is read off how the contacts lie on the scan: no certainty where the scan lacks
    /// what was touched.
    pub fn is_read_off_the_scan(self) -> bool {
        match self {
            Self::LengthUnit
            | Self::PositionAxes
            | Self::Frame
            | Self::Radius
            | Self::Stiffness
            | Self::InsideOut
            | Self::WrenchSign
            | Self::WrenchFrame
            | Self::QuaternionOrder => true,
            Self::ZeroStamps
            | Self::TwoEpochs
            | Self::TimeUnit
            | Self::StampsGoBack
            | Self::SlowPoses
            | Self::Delay
            | Self::NoSample
            | Self::NoContact
            | Self::FewContacts
            | Self::Tare
            | Self::ForceUnit
            | Self::LightTouch
            | Self::ForceSteps
            | Self::Saturation => false,
        }
    }
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
    pub(super) fn new(
        cause: InputCause,
        is_sure: bool,
        measured: String,
        remedy: &'static str,
    ) -> Self {
        Self {
            cause,
            is_sure,
            measured,
            remedy,
        }
    }
}

impl fmt::Display for InputFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how_sure = if self.is_sure { "" } else { "perhaps: " };
        write!(f, "{how_sure}{}; {}", self.measured, self.remedy)
    }
}
