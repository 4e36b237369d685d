//! Settings of a [`super::Refiner`], and two presets.

use super::guard::GuardParams;
use super::{ContactModel, DynamicsParams, MotionDirection, RoiSize, StepRule};
use crate::parameters;
use crate::stylus::{
    BiasParams, CompensatorParams, ContactEstimatorParams, ContactGateParams, SettingError,
    SlidingParams, TipBody, TipParams, TipShape,
};
use touchup_geometry::mesh::Region;

parameters! {
    /// Quality of a scan.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ScanParams in "scan" {
        /// Standard deviation of the scan from the true surface.
        ///
        /// In m. A consumer depth camera at half a metre.
        noise: f64 = 0.6, "noise_mm" [MM, 0, 1000];
    }
}

/// Touching point of the ball, and touched face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchPoint {
    /// The face with the closest barycentre \[paper, Eq 12\], at the point under its normal; the
    /// force gives only the magnitude \[paper\].
    FaceNormal,
    /// The point that the measured force points away from, at the face with the least true distance
    /// to it.
    MeasuredNormal,
}

parameters! {
    /// Carving: removes surface that the ball passes through without a force (case 2).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CarveParams in "carve" {
        /// Share of the depth removed per second.
        ///
        /// In 1/s. The swept volume is certainly free, and soon cleared.
        rate: f64 = 300.0, "rate_per_s" [PER_S, 0, 1e6];
        /// Depth that carving leaves alone: the noise of the tracking.
        ///
        /// In m.
        tolerance: f64 = 0.05, "tolerance_mm" [MM, 0, 1000];
        /// Depth that carving leaves alone during contact, because it may be the measured surface.
        ///
        /// In m.
        contact_tolerance: f64 = 0.2, "contact_tolerance_mm" [MM, 0, 1000];
    }
}

/// Part of a scan in a refiner, and its touchable region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanRegion {
    /// a contact whose ball is centred outside moves nothing
    pub region: Region,
    /// distance from the region beyond which vertices stay, m
    pub margin: f64,
    /// mean edge of the whole scan, m
    pub mean_edge: f64,
}

/// All settings of a [`super::Refiner`]; `None` disables a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineParams {
    /// Weight, bias, frames.
    pub compensator: CompensatorParams,
    /// Slow drift of the sensor, followed in free air; `None`: no drift \[paper\].
    pub bias: Option<BiasParams>,
    /// `None`: every sample is contact \[paper\].
    pub gate: Option<ContactGateParams>,
    /// Size and stiffness of the tip.
    pub tip: TipParams,
    /// Tip shape: a ball in both presets.
    pub shape: TipShape,
    /// Smoothing and friction; `None`: the raw sample, with the force as the normal.
    pub sliding: Option<SlidingParams>,
    /// Touching point of the ball, and choice of the handle.
    pub touch_point: TouchPoint,
    /// Eq 1–7.
    pub dynamics: DynamicsParams,
    /// Rate at which a touched face turns to the measured normal, 1/s: tan(θ/2) falls as e^(−rate
    /// t), which is Eq 7 with both forces at unit size (on a rigid part F* is F). `None`: Eq 7 as
    /// printed, in `dynamics`.
    pub turning: Option<f64>,
    /// Carving by free motion; `None` leaves it to the dynamics \[paper\].
    pub carve: Option<CarveParams>,
    /// Size of the region that follows the handle.
    pub roi: RoiSize,
    /// Limits of an update; `None`: no limits \[paper\], which on a noisy scan ends in a blow-up.
    pub guard: Option<GuardParams>,
    /// Smallest cosine between a face and the measured normal: below it the face is another
    /// surface. Default 0.2: 78°.
    pub smallest_contact_cosine: f64,
    /// Longest step of a vertex in one update, in mean edges. Default 1/25, far below any feature
    /// the mesh can show.
    pub longest_step_edges: f64,
    /// Maximum distance of a vertex from its scanned position, in mean edges: beyond it a triangle
    /// is too stretched to show anything. Default 2.6.
    pub largest_move_edges: f64,
    /// [`Self::largest_move_edges`] in scan noises; the larger limit holds. Default 5.
    pub largest_move_noises: f64,
    /// Standard deviation of the scan's vertices, m.
    pub scan_noise: f64,
    /// `None`: the mesh is the whole scan, touchable anywhere.
    pub region: Option<ScanRegion>,
    /// Edge length that the haptic update needs, m: a scan with much shorter edges is simplified to
    /// it, so that the cost of a touch follows from the tip and not from the scan. Default 0.6 of
    /// the radius of the tip. `None`: every face of the scan \[paper\].
    pub working_edge: Option<f64>,
}

/// Relaxation of a touched face in [`RefineParams::robust`], 1/s: within 40 ms, twenty poses at 500
/// Hz, which averages their noise, while a hand at 25 mm/s stays on a face of 2.4 mm for 100 ms.
const RELAXATION: f64 = 25.0;
/// Contact force at which [`relaxing_alpha`] holds, N.
const USUAL_FORCE: f64 = 2.5;
/// Working edge of the haptic update, in radii of the tip. With 0.6 a dense scan 0.3 mm too high
/// ends 0.014 mm off the part (`cargo test -p touchup-tests --test rooms haptic::dense --
/// --nocapture`); with 0.5, and more vertices in a region, it ended 0.038 mm off.
const WORKING_EDGE: f64 = 0.6;
/// Smallest mean edge of a scan that stays as it is, as a share of the working edge: simplification
/// would save hardly any faces.
const COARSE_ENOUGH: f64 = 0.6;
/// Turning of a touched face in [`RefineParams::robust`], 1/s: about as fast as its motion.
const TURNING: f64 = 30.0;

/// Value of α, m/(N·s), by which a face relaxes within 40 ms at the usual force of a hand: rate
/// over −df/dh.
pub fn relaxing_alpha(model: &ContactModel) -> f64 {
    let slope = match *model {
        ContactModel::Spring { stiffness_n_per_m } => stiffness_n_per_m,
        // f (1 − f/f_max) / h_min; at more than half of f_max the slope falls again
        ContactModel::Sigmoid(curve) => {
            let share = (USUAL_FORCE / curve.f_max).min(0.5);
            curve.f_max * share * (1.0 - share) / curve.h_min
        }
    };
    RELAXATION / slope
}

/// Working edge for a tip of this size, m; a point needs every face.
fn working_edge(scale: f64) -> Option<f64> {
    Some(WORKING_EDGE * scale).filter(|edge| *edge > 0.0)
}

impl RefineParams {
    /// Preset for real scans: contact gate, friction, motion along the force, carving by free
    /// motion.
    ///
    /// With a known stiffness the contact model is the linear spring of the real tip, which has no
    /// bias; without one it is the paper's sigmoid with the rigid-contact offset taken out.
    pub fn robust(tip: TipParams) -> Self {
        let model = match tip.stiffness {
            Some(stiffness_n_per_m) => ContactModel::Spring { stiffness_n_per_m },
            None => DynamicsParams::default().model,
        };
        Self {
            compensator: CompensatorParams::default(),
            bias: None,
            gate: Some(ContactGateParams::default()),
            tip,
            shape: TipShape::Ball,
            sliding: Some(SlidingParams::default()),
            touch_point: TouchPoint::MeasuredNormal,
            dynamics: DynamicsParams {
                model,
                alpha_m_per_n_s: relaxing_alpha(&model),
                beta_per_n2_s: 0.0,
                rule: StepRule::Lie,
                along: MotionDirection::Force,
                take_out_rigid_offset: tip.stiffness.is_none(),
            },
            turning: Some(TURNING),
            carve: Some(CarveParams::default()),
            roi: RoiSize::Radius(tip.radius),
            guard: Some(GuardParams::default()),
            smallest_contact_cosine: 0.2,
            longest_step_edges: 0.04,
            largest_move_edges: 2.6,
            largest_move_noises: 5.0,
            scan_noise: ScanParams::default().noise,
            region: None,
            working_edge: working_edge(tip.radius),
        }
    }

    /// The published rule, taken literally: Eq 6 and 7 solved together, Eq 12 and a one-ring
    /// region; no gate, no correction, no guard, no limit.
    pub fn paper(tip: TipParams) -> Self {
        Self {
            gate: None,
            sliding: None,
            touch_point: TouchPoint::FaceNormal,
            dynamics: DynamicsParams {
                along: MotionDirection::InitialNormal,
                rule: StepRule::Bounded,
                take_out_rigid_offset: false,
                ..DynamicsParams::default()
            },
            turning: None,
            carve: None,
            guard: None,
            roi: RoiSize::OneRing,
            working_edge: None,
            smallest_contact_cosine: -1.0,
            longest_step_edges: f64::MAX,
            largest_move_edges: f64::MAX,
            ..Self::robust(tip)
        }
    }

    /// Adapts the settings to a tip whose size, m, differs from the radius of its ball.
    pub fn set_scale(&mut self, scale: f64) {
        self.roi = RoiSize::Radius(scale);
        self.working_edge = self.working_edge.and(working_edge(scale));
    }

    /// Edge length to which to simplify a scan of this mean edge (m) for the haptic update; `None`
    /// if the scan is coarse enough.
    pub fn simplified_edge(&self, mean_edge: f64) -> Option<f64> {
        self.working_edge
            .filter(|edge| mean_edge < COARSE_ENOUGH * edge)
    }

    /// Settings of the contact estimator.
    pub fn contact(&self) -> ContactEstimatorParams {
        let &Self {
            compensator,
            bias,
            gate,
            tip,
            sliding,
            ..
        } = self;
        ContactEstimatorParams {
            compensator,
            bias,
            gate,
            tip,
            sliding,
        }
    }

    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub(crate) fn check(&self) -> Result<(), SettingError> {
        TipBody::new(self.shape, self.tip.radius)?;
        self.tip.check()?;
        ScanParams {
            noise: self.scan_noise,
        }
        .check()?;
        self.carve.iter().try_for_each(CarveParams::check)?;
        self.sliding.iter().try_for_each(SlidingParams::check)?;
        self.guard.iter().try_for_each(GuardParams::check)?;
        let roi = if let RoiSize::Radius(radius) = self.roi {
            radius
        } else {
            0.0
        };
        let cosine = self.smallest_contact_cosine;
        SettingError::check(
            "smallest contact cosine",
            cosine,
            cosine.abs() <= 1.0,
            "-1 to 1",
        )?;
        let not_negative = |name, x| SettingError::check(name, x, x >= 0.0, "finite and 0 or more");
        not_negative("turning (1/s)", self.turning.unwrap_or(0.0))?;
        not_negative("region of interest (m)", roi)?;
        not_negative("largest move (noises)", self.largest_move_noises)?;
        let positive = |name, x| SettingError::check(name, x, x > 0.0, "finite and more than 0");
        positive("working edge (m)", self.working_edge.unwrap_or(1.0))?;
        positive("longest step (edges)", self.longest_step_edges)?;
        positive("largest move (edges)", self.largest_move_edges)
    }
}
