//! Findings about an input: cause, evidence, remedy.

use std::fmt;

use serde::Serialize;

use super::correction::InputCorrection;
use touchup_method::names;

names! {
    /// Cause of a faulty recording, in order of repair: each may itself cause the later ones.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum InputCause {
        /// All stamps are zero.
        ZeroStamps = "zero_stamps",
        /// Unrelated clocks stamp poses and wrenches.
        TwoEpochs = "two_epochs",
        /// Stamps in another unit of time.
        TimeUnit = "time_unit",
        /// Stamps of one stream go back.
        StampsGoBack = "stamps_go_back",
        /// Poses too far apart in time for interpolation.
        SlowPoses = "slow_poses",
        /// Poses that are repeated while the stylus moves on.
        PoseHeld = "pose_held",
        /// The messages yield no sample.
        NoSample = "no_sample",
        /// No force above the noise.
        NoContact = "no_contact",
        /// Too few touched places: they fit almost anywhere.
        FewContacts = "few_contacts",
        /// Forces in another unit.
        ForceUnit = "force_unit",
        /// Contact forces below the contact threshold.
        LightTouch = "light_touch",
        /// Force steps too coarse for the contact decision.
        ForceSteps = "force_steps",
        /// Poses, scan or radius in another unit of length.
        LengthUnit = "length_unit",
        /// Position axes swapped or mirrored.
        PositionAxes = "position_axes",
        /// Quaternion components in another order.
        QuaternionOrder = "quaternion_order",
        /// Scan faces inside out.
        InsideOut = "inside_out",
        /// Reversed wrench: the stylus acts on the part.
        WrenchSign = "wrench_sign",
        /// Wrench in axes other than those assumed.
        WrenchFrame = "wrench_frame",
        /// Axes of the sensor with other gains, or that read into each other.
        ForceGains = "force_gains",
        /// Wrench stamps later or earlier than the pose of the same instant.
        Delay = "delay",
        /// Contacts off the scan.
        Frame = "frame",
        /// Distance from ball centre to surface differs from the tip radius.
        Radius = "radius",
        /// The ball is at another place of the stylus.
        TipOffset = "tip_offset",
        /// The part moved, or the frame of the poses did, while it was touched.
        PartMoved = "part_moved",
        /// The ball changed its place on the stylus.
        TipBent = "tip_bent",
        /// The stylus bends more or less than before.
        StiffnessChanged = "stiffness_changed",
        /// The stylus bends more or less than its stiffness predicts.
        Stiffness = "stiffness",
        /// Forces clipped at one value.
        Saturation = "saturation",
        /// Nonzero force in free motion.
        Tare = "tare",
    }
}

impl InputCause {
    /// Whether the contacts' fit to the scan shows it: uncertain if the scan lacks touched surface.
    pub fn is_read_off_the_scan(self) -> bool {
        match self {
            Self::LengthUnit
            | Self::PositionAxes
            | Self::Frame
            | Self::Radius
            | Self::InsideOut
            | Self::WrenchSign
            | Self::WrenchFrame
            | Self::QuaternionOrder => true,
            Self::Stiffness
            | Self::ForceGains
            | Self::TipOffset
            | Self::PartMoved
            | Self::TipBent
            | Self::StiffnessChanged
            | Self::ZeroStamps
            | Self::TwoEpochs
            | Self::TimeUnit
            | Self::StampsGoBack
            | Self::SlowPoses
            | Self::PoseHeld
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

/// A doubt about the input, with its measurement and remedy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputFinding {
    /// cause
    pub cause: InputCause,
    /// only a mistake explains it; results of such an input are not trustworthy
    pub is_sure: bool,
    /// measurement, with units
    pub measured: String,
    /// numbers that it is about
    pub numbers: Vec<FoundNumber>,
    /// remedy
    pub remedy: &'static str,
    /// what takes it off; `None`: no setting does
    #[serde(skip)]
    pub correction: Option<InputCorrection>,
}

/// A number of a finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundNumber {
    /// with its unit
    pub name: &'static str,
    /// in that unit
    pub value: f64,
    /// standard uncertainty
    pub sigma: f64,
}

impl FoundNumber {
    pub(super) fn new(name: &'static str, value: f64, sigma: f64) -> Self {
        Self { name, value, sigma }
    }
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
            numbers: Vec::new(),
            remedy,
            correction: None,
        }
    }

    /// Whether something changed while the session lasted.
    pub(super) fn is_of_change(&self) -> bool {
        matches!(
            self.cause,
            InputCause::PartMoved | InputCause::TipBent | InputCause::StiffnessChanged
        )
    }

    /// Whether the directions of forces show it.
    pub(super) fn is_of_sensor(&self) -> bool {
        matches!(
            self.cause,
            InputCause::WrenchFrame | InputCause::ForceGains | InputCause::Tare
        )
    }

    pub(super) fn corrected_by(self, correction: Option<InputCorrection>) -> Self {
        Self { correction, ..self }
    }

    pub(super) fn with(self, numbers: Vec<FoundNumber>) -> Self {
        Self { numbers, ..self }
    }
}

impl fmt::Display for InputFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how_sure = if self.is_sure { "" } else { "perhaps: " };
        write!(f, "{how_sure}{}; {}", self.measured, self.remedy)?;
        if self.is_sure && self.correction.is_some() {
            write!(f, ", or take it off by touchup refine --accept")?;
        }
        Ok(())
    }
}
