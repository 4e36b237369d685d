//! From sections to the settings of the rooms: units into SI, once.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use super::{
    AlongName, CarveSection, GravityAxes, GuardSection, Mode, ModelName, PayloadSection, RefineSection, Scene,
    SlidingSection, StepName, TipSection, UncertaintySection,
};
use touchup_core::explore::{PatternParams, sigma_of};
use touchup_core::patch::{CalibrationParams, PatcherParams, UncertaintyParams};
use touchup_core::probe::{Cell, ProbeParams, Tool};
use touchup_core::refine::{
    Along, CarveParams, ContactModel, GuardParams, RefineParams, RoiSize, SlidingParams, StepRule, TipParams,
    relaxing_alpha,
};
use touchup_core::robot::{Limits, OnsetParams, TouchParams, UrGeometry};
use touchup_core::touch::{
    BiasParams, ClockParams, CompensatorParams, ContactGateParams, MarkerBody, MarkerFilter, MarkerParams, Payload,
    Placement, SettingError, SpringParams, SyncParams, TipBody, TipShape, Wrench, WrenchFrame,
};
use touchup_sim::ArmParams;

impl Scene {
    /// Settings of the synchroniser; without `sync` only messages of equal stamp pair.
    pub fn sync_params(&self) -> SyncParams {
        let Some(sync) = &self.sync else {
            return SyncParams { reorder_ns: 0, largest_gap_ns: 0, ..SyncParams::default() };
        };
        SyncParams {
            reorder_ns: nanoseconds(sync.reorder_ms, 1e6),
            largest_gap_ns: nanoseconds(sync.largest_gap_ms, 1e6),
            largest_jump_ns: nanoseconds(sync.largest_jump_s, 1e9),
            wrench_offset_ns: nanoseconds(sync.wrench_offset_ms, 1e6),
            capacity: sync.capacity,
        }
    }

    /// Where recorded messages belong; `None` when they are as the rooms take them.
    pub fn placement(&self) -> Option<Placement> {
        let pose_wo = self.scan_to_space.as_ref().map(|space| {
            Isometry3::from_parts(metres(space.position_mm).into(), unit_quaternion(space.orientation_xyzw))
        });
        let p_ht = self.tip.as_ref().and_then(|tip| tip.offset_mm).map(metres);
        (pose_wo.is_some() || p_ht.is_some()).then_some(Placement { pose_wo, p_ht })
    }

    /// The robot cell, and how is probed in it; `None` without `robot`.
    pub fn probing(&self) -> Option<(Cell, ProbeParams)> {
        let (robot, tip) = (self.robot.as_ref()?, self.tip.as_ref()?);
        let ball_radius = tip.radius_mm / 1e3;
        let stiffness = tip.stiffness_n_per_mm.map_or(TouchParams::default().stiffness, |k| k * 1e3);
        let tool = Tool {
            ball_radius,
            shaft_radius: robot.shaft_radius_mm / 1e3,
            shaft_length: robot.shaft_length_mm / 1e3,
            margin: robot.margin_mm / 1e3,
        };
        let pose_bo = self.placement().and_then(|placement| placement.pose_wo).unwrap_or_else(Isometry3::identity);
        let cell = Cell {
            geometry: UrGeometry::of(&robot.model)?,
            pose_bo,
            pose_ft: Isometry3::from_parts(
                metres(robot.tip_position_mm).into(),
                unit_quaternion(robot.tip_orientation_xyzw),
            ),
            tool,
        };
        let limits = Limits {
            lowest: metres(robot.workspace_low_mm).into(),
            highest: metres(robot.workspace_high_mm).into(),
            force: robot.largest_force_n,
            speed: robot.largest_mm_per_s / 1e3,
            acceleration: robot.acceleration_mm_per_s2 / 1e3,
            search: robot.search_mm / 1e3,
            time: robot.time_s,
            dexterity: robot.least_dexterity,
        };
        let touch = TouchParams {
            force: robot.touch_force_n,
            trigger: robot.trigger_n,
            link_speed: robot.link_mm_per_s / 1e3,
            search_speed: robot.search_mm_per_s / 1e3,
            measure_speed: robot.measure_mm_per_s / 1e3,
            slide_speed: robot.slide_mm_per_s / 1e3,
            acceleration: robot.acceleration_mm_per_s2 / 1e3,
            stiffness,
            latency: robot.latency_ms / 1e3,
            onset: OnsetParams { force_noise: robot.force_noise_n, ..OnsetParams::default() },
            ..TouchParams::default()
        };
        let pattern = PatternParams {
            ball_radius,
            clearance: robot.clearance_mm / 1e3,
            depth: robot.depth_mm / 1e3,
            sigma: sigma_of(robot.tolerance_mm / 1e3, robot.confidence),
            budget: robot.touches,
            touch_sigma: robot.touch_sigma_mm / 1e3,
            ..PatternParams::default()
        };
        Some((cell, ProbeParams { touch, pattern, slides: false, limits }))
    }

    /// Settings of the estimate of the clock, if there is one.
    pub fn clock_params(&self) -> Option<ClockParams> {
        let gate = self.contact_params().unwrap_or_default();
        self.clock.as_ref().map(|_| ClockParams { stiffness: self.tip_params().stiffness, gate })
    }

    /// The filter that makes poses of markers, if there is one.
    ///
    /// # Errors
    /// [`SettingError`] for markers on one line, or closer together than the gate allows.
    pub fn marker_filter(&self) -> Result<Option<MarkerFilter>, SettingError> {
        let Some(markers) = &self.markers else { return Ok(None) };
        let body = MarkerBody::new(markers.positions_mm.iter().map(|&mm| metres(mm).into()).collect())?;
        let params = MarkerParams {
            spring: SpringParams { frequency: markers.spring_hz, damping: markers.damping },
            noise: markers.noise_mm / 1e3,
            gate: markers.gate_mm / 1e3,
            coast_ns: nanoseconds(markers.coast_ms, 1e6),
            period_ns: nanoseconds(markers.period_ms, 1e6),
            reorder_ns: nanoseconds(markers.reorder_ms, 1e6),
        };
        MarkerFilter::new(body, params).map(Some)
    }

    /// Settings of the compensator for a wrench that arrives in the axes of `wrench_frame`.
    pub fn compensator_params(&self, wrench_frame: WrenchFrame) -> CompensatorParams {
        let Some(compensation) = &self.compensation else {
            return CompensatorParams { wrench_frame, ..CompensatorParams::default() };
        };
        let rotation = unit_quaternion(compensation.sensor_orientation_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        let space = self.scan_to_space.as_ref().map(|space| unit_quaternion(space.orientation_xyzw));
        let gravity_o = |payload: &PayloadSection| match (payload.gravity_axes, space) {
            (GravityAxes::Space, Some(r_wo)) => r_wo.inverse() * Vector3::from(payload.gravity_m_per_s2),
            _ => payload.gravity_m_per_s2.into(),
        };
        CompensatorParams {
            wrench_frame,
            pose_ts: Isometry3::from_parts(metres(compensation.sensor_position_mm).into(), rotation),
            payload: compensation.payload.as_ref().map(|payload| Payload {
                mass: payload.mass_kg,
                p_sc: metres(payload.centre_mm),
                gravity_o: gravity_o(payload),
            }),
            bias_s: compensation
                .bias
                .as_ref()
                .map(|bias| Wrench { force: bias.force_n.into(), torque: bias.torque_nm.into() }),
        }
    }

    /// Settings of the bias tracker, if there is one.
    pub fn bias_params(&self) -> Option<BiasParams> {
        self.bias_tracking.as_ref().map(|tracking| BiasParams {
            free: tracking.free_n,
            settle_ns: nanoseconds(tracking.settle_ms, 1e6),
            time: tracking.time_s,
        })
    }

    /// Thresholds of the contact gate, if there is one.
    pub fn contact_params(&self) -> Option<ContactGateParams> {
        self.contact.as_ref().map(|contact| ContactGateParams { on: contact.on_n, off: contact.off_n })
    }

    /// The ball; a point that does not give way when the scene names none.
    pub fn tip_params(&self) -> TipParams {
        let tip = self.tip.as_ref();
        TipParams {
            radius: tip.map_or(0.0, |tip| tip.radius_mm / 1e3),
            stiffness: tip.and_then(|tip| tip.stiffness_n_per_mm).map(|stiffness| stiffness * 1e3),
        }
    }

    /// Which tip touches.
    pub fn tip_shape(&self) -> TipShape {
        self.tip.as_ref().map_or(TipShape::Ball, TipSection::tip_shape)
    }

    /// Settings of the refiner for a wrench that arrives in the axes of `wrench_frame`; `None` without `refine`.
    pub fn refine_params(&self, wrench_frame: WrenchFrame) -> Option<RefineParams> {
        let section = self.refine.as_ref()?;
        let mut params = match section.mode {
            Mode::Paper => RefineParams::paper(self.tip_params()),
            Mode::Robust => RefineParams {
                bias: self.bias_params(),
                gate: self.contact_params(),
                sliding: self.sliding.as_ref().map(SlidingSection::params),
                carve: self.carve.as_ref().map(CarveSection::params),
                ..RefineParams::robust(self.tip_params())
            },
        };
        params.shape = self.tip_shape();
        if params.shape != TipShape::Ball {
            params.roi = RoiSize::Radius(TipBody::new(params.shape, params.tip.radius).map_or(0.0, |tip| tip.scale()));
        }
        params.guard = self.guard.as_ref().map(GuardSection::params);
        params.compensator = self.compensator_params(wrench_frame);
        params.scan_noise = self.scan.as_ref().map_or(0.0, |scan| scan.noise_mm / 1e3);
        section.override_mut(&mut params);
        Some(params)
    }

    /// Settings of the patcher for a wrench that arrives in the axes of `wrench_frame`; `None` without `patch`, and in the
    /// mode of the paper.
    pub fn patcher_params(&self, wrench_frame: WrenchFrame) -> Option<PatcherParams> {
        let section = self.patch.as_ref()?;
        if self.refine.as_ref().is_some_and(|refine| refine.mode == Mode::Paper) {
            return None;
        }
        let (tip, noise) = (self.tip_params(), self.scan.as_ref().map_or(0.0, |scan| scan.noise_mm / 1e3));
        let (shape, plain) = (self.tip_shape(), PatcherParams::new(tip.radius, tip.stiffness, noise));
        // a tip that cannot be is refused by the patcher
        let mut params = PatcherParams::for_tip(shape, tip.radius, tip.stiffness, noise).unwrap_or(plain);
        params.touches.shape = shape;
        params.compensator = self.compensator_params(wrench_frame);
        params.touches.gate = self.contact_params()?;
        params.touches.cone_cosine = self.sliding.as_ref().map(|sliding| sliding.cone_cosine);
        params.free_space = self.carve.is_some();
        if let Some(sync) = &self.sync {
            params.touches.largest_gap_ns = nanoseconds(sync.largest_gap_ms, 1e6);
        }
        params.pitch = section.pitch_mm.map_or(params.pitch, |pitch_mm| pitch_mm / 1e3);
        params.most_faces = section.most_faces;
        params.uncertainty = self.uncertainty.as_ref().map(|known| known.params(noise));
        Some(params)
    }
}

impl SlidingSection {
    fn params(&self) -> SlidingParams {
        SlidingParams {
            smoothing: self.smoothing_ms / 1e3,
            velocity_smoothing: self.velocity_smoothing_ms / 1e3,
            slowest: self.slowest_mm_per_s / 1e3,
            cone_cosine: self.cone_cosine,
        }
    }
}

impl UncertaintySection {
    /// - `scan`: standard deviation of the scan, m.
    fn params(&self, scan: f64) -> UncertaintyParams {
        let calibration =
            CalibrationParams { position: self.calibration_mm / 1e3, stiffness_share: self.stiffness_percent / 100.0 };
        UncertaintyParams { scan, calibration, gate_sigmas: self.gate_sigmas }
    }
}

impl CarveSection {
    fn params(&self) -> CarveParams {
        CarveParams {
            rate: self.rate_per_s,
            tolerance: self.tolerance_mm / 1e3,
            contact_tolerance: self.contact_tolerance_mm / 1e3,
        }
    }
}

impl GuardSection {
    fn params(&self) -> GuardParams {
        GuardParams {
            smallest_quality: self.smallest_quality,
            smallest_turn_cosine: self.smallest_turn_cosine,
            smallest_evidence_cosine: self.smallest_evidence_cosine,
            smallest_fold_cosine: self.smallest_fold_cosine,
            gap_share: self.gap_edges,
        }
    }
}

impl RefineSection {
    /// What the scene says itself, over what the mode has.
    fn override_mut(&self, params: &mut RefineParams) {
        let dynamics = &mut params.dynamics;
        let sigmoid = ContactModel::Sigmoid { f_max_n: self.f_max_n, h_min_m: self.h_min_mm / 1e3, delta: self.delta };
        dynamics.model = match (self.contact_model, dynamics.model, params.tip.stiffness) {
            (Some(ModelName::Spring), _, Some(stiffness_n_per_m)) => ContactModel::Spring { stiffness_n_per_m },
            (Some(ModelName::Sigmoid), ..) | (None, ContactModel::Sigmoid { .. }, _) => sigmoid,
            (_, as_is, _) => as_is,
        };
        let is_sigmoid = matches!(dynamics.model, ContactModel::Sigmoid { .. });
        dynamics.take_out_rigid_offset = is_sigmoid && self.mode == Mode::Robust;
        let alpha = match self.mode {
            Mode::Paper => dynamics.alpha_m_per_n_s,
            Mode::Robust => relaxing_alpha(&dynamics.model),
        };
        dynamics.alpha_m_per_n_s = self.alpha_m_per_n_s.unwrap_or(alpha);
        dynamics.beta_per_n2_s = self.beta_per_n2_s.unwrap_or(dynamics.beta_per_n2_s);
        params.turning = match (self.turning_per_s, self.beta_per_n2_s) {
            (Some(turning), _) => Some(turning),
            (None, Some(_)) => None,
            (None, None) => params.turning,
        };
        dynamics.rule = match self.step {
            Some(StepName::Lie) => StepRule::Lie,
            Some(StepName::Corrected) => StepRule::DriftCorrected,
            Some(StepName::Dp5) => StepRule::DormandPrince,
            None => dynamics.rule,
        };
        dynamics.along = match self.along {
            Some(AlongName::Normal0) => Along::InitialNormal,
            Some(AlongName::Force) => Along::Force,
            None => dynamics.along,
        };
        params.roi = self.roi_mm.map_or(params.roi, |radius_mm| RoiSize::Radius(radius_mm / 1e3));
    }
}

/// `value` in units of `unit_ns`; checked before, so that it fits.
fn nanoseconds(value: f64, unit_ns: f64) -> i64 {
    (value * unit_ns).round() as i64
}

fn unit_quaternion([x, y, z, w]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn metres(mm: [f64; 3]) -> Vector3<f64> {
    Vector3::from(mm) / 1e3
}

/// A simulated arm of a cell; all that a scene does not name is as in [`ArmParams::default`].
pub fn simulated_arm(cell: &Cell, params: &ProbeParams) -> ArmParams {
    ArmParams {
        geometry: cell.geometry,
        pose_bo: cell.pose_bo,
        pose_ft: cell.pose_ft,
        radius: cell.tool.ball_radius,
        stiffness: params.touch.stiffness,
        force_noise: params.touch.onset.force_noise,
        ..ArmParams::default()
    }
}
