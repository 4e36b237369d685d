//! Converts sections of the YAML to the settings of the modules.

use std::collections::BTreeMap;
use std::time::SystemTime;

use nalgebra::Isometry3;

use super::sections::{NO_TURN, unit_quaternion};
use super::{
    CheckStanding, CompensationSection, GravityAxes, Mode, ModelName, PayloadSection,
    RefineSection, ScanToSpaceSection, Scene, TipSection,
};
use touchup_features::diagnose::InputMonitorParams;
use touchup_method::haptic::{ContactModel, RefineParams, RoiSize, relaxing_alpha};
use touchup_method::reconstruct::{PatchParams, PatcherParams, UncertaintyParams};
use touchup_method::stylus::{
    CompensatorParams, MarkerFilter, Placement, SensorBias, SettingError, SyncParams, TipBody,
    TipParams, TipShape, Wrench, WrenchFrame,
};
use touchup_probing::arm::{ArmGeometry, TouchParams};
use touchup_probing::execute::{ProbeParams, RobotCell, Tool};
use touchup_probing::plan::{PatternParams, sigma_of};
use touchup_sim::ArmParams;

impl Scene {
    /// Settings of the synchroniser; with `sync: off` only messages of equal stamp pair.
    pub fn sync_params(&self) -> SyncParams {
        self.sync.unwrap_or(SyncParams {
            reorder_ns: 0,
            largest_gap_ns: 0,
            ..SyncParams::default()
        })
    }

    /// Placement of recorded messages in the frames of the scene; `None` if none is necessary.
    pub fn placement(&self) -> Option<Placement> {
        let pose_wo = self.scan_to_space.as_ref().map(ScanToSpaceSection::pose_wo);
        let p_ht = self.tip.as_ref().and_then(|tip| tip.offset);
        let placement = Placement {
            pose_wo,
            p_ht,
            changes: self.changes.clone(),
        };
        (placement != Placement::default()).then_some(placement)
    }

    /// Whether the scene lets an arm move.
    pub fn allows_motion(&self) -> bool {
        self.robot.as_ref().is_some_and(|robot| robot.allow_motion)
    }

    /// Check of the arm and its doubts, as [`super::RobotSection::check_standing`]; `None`
    /// without `robot`.
    pub fn check_standing(&self, now: SystemTime) -> Option<CheckStanding> {
        let robot = self.robot.as_ref()?;
        Some(robot.check_standing(now))
    }

    /// The robot cell and its probing parameters; `None` without `robot`.
    pub fn probing(&self) -> Option<(RobotCell, ProbeParams)> {
        let (robot, ball) = (self.robot.as_ref()?, self.tip.as_ref()?.ball);
        let cell = RobotCell {
            geometry: match &robot.chain {
                Some(chain) => ArmGeometry::Chain(chain.clone()),
                None => robot.model.ur()?.into(),
            },
            pose_bo: self
                .scan_to_space
                .as_ref()
                .map_or_else(Isometry3::identity, ScanToSpaceSection::pose_wo),
            pose_ft: robot.pose_ft(),
            tool: Tool {
                ball_radius: ball.radius,
                ..robot.tool
            },
        };
        let touch = TouchParams {
            acceleration: robot.limits.acceleration,
            stiffness: ball.stiffness.unwrap_or(robot.touch.stiffness),
            ..robot.touch
        };
        let sigma = sigma_of(robot.tolerance, robot.confidence);
        let pattern = PatternParams {
            ball_radius: ball.radius,
            sigma,
            ..robot.checked_pattern()
        };
        Some((
            cell,
            ProbeParams {
                touch,
                pattern,
                goals: BTreeMap::new(),
                slides: false,
                limits: robot.limits.clone(),
            },
        ))
    }

    /// The filter that computes poses of markers, if there is one.
    ///
    /// # Errors
    /// [`SettingError`] for markers on one line, or closer together than the gate allows.
    pub fn marker_filter(&self) -> Result<Option<MarkerFilter>, SettingError> {
        let Some(markers) = &self.markers else {
            return Ok(None);
        };
        MarkerFilter::new(markers.body()?, markers.params).map(Some)
    }

    /// Settings of the compensator for a wrench in the axes of `wrench_frame`.
    pub fn compensator_params(&self, wrench_frame: WrenchFrame) -> CompensatorParams {
        let CompensationSection {
            payload,
            bias,
            mount,
        } = self.compensation.clone().unwrap_or_default();
        let rotation = unit_quaternion(mount.orientation_xyzw.unwrap_or(NO_TURN));
        let in_scan = |PayloadSection {
                           gravity_axes,
                           mut payload,
                       }| {
            if let (GravityAxes::Space, Some(space)) = (gravity_axes, &self.scan_to_space) {
                payload.gravity_o = space.pose_wo().rotation.inverse() * payload.gravity_o;
            }
            payload
        };
        CompensatorParams {
            wrench_frame,
            pose_ts: Isometry3::from_parts(mount.position.into(), rotation),
            payload: payload.map(in_scan),
            bias_s: bias.map(|SensorBias { force, torque }| Wrench { force, torque }),
        }
    }

    /// Settings of the input monitor for a wrench in the axes of `wrench_frame`.
    pub fn input_monitor_params(&self, wrench_frame: WrenchFrame) -> InputMonitorParams {
        let has_gate = self
            .refine
            .as_ref()
            .is_none_or(|refine| refine.mode == Mode::Robust);
        let calibration = self.uncertainty.unwrap_or_default().calibration;
        InputMonitorParams {
            compensator: self.compensator_params(wrench_frame),
            tip: self.tip_params(),
            stiffness_share: calibration.stiffness_share,
            place_sigma: calibration.place,
            shape: self.tip_shape(),
            scan_noise: self.scan_noise(),
            placement: self.placement().unwrap_or_default(),
            gate: has_gate.then(|| self.contact.unwrap_or_default()),
            sync: self.sync_params(),
        }
    }

    /// The ball; a rigid point for `tip: off`.
    pub fn tip_params(&self) -> TipParams {
        self.tip.as_ref().map_or(
            TipParams {
                radius: 0.0,
                stiffness: None,
            },
            |tip| tip.ball,
        )
    }

    /// The shape of the tip.
    pub fn tip_shape(&self) -> TipShape {
        self.tip
            .as_ref()
            .map_or(TipShape::Ball, TipSection::tip_shape)
    }

    /// Standard deviation of the scan, m; 0 for `scan: off`.
    fn scan_noise(&self) -> f64 {
        self.scan.as_ref().map_or(0.0, |scan| scan.quality.noise)
    }

    /// Settings of the refiner for a wrench in the axes of `wrench_frame`; `None` without `refine`.
    pub fn refine_params(&self, wrench_frame: WrenchFrame) -> Option<RefineParams> {
        let section = self.refine.as_ref()?;
        let mut params = match section.mode {
            Mode::Paper => RefineParams::paper(self.tip_params()),
            Mode::Robust => RefineParams {
                bias: self.bias_tracking,
                guard: self.guard,
                gate: self.contact,
                sliding: self.sliding,
                carve: self.carve,
                ..RefineParams::robust(self.tip_params())
            },
        };
        params.shape = self.tip_shape();
        if params.shape != TipShape::Ball {
            params.set_scale(
                TipBody::new(params.shape, params.tip.radius).map_or(0.0, |tip| tip.scale()),
            );
        }
        params.compensator = self.compensator_params(wrench_frame);
        params.scan_noise = self.scan_noise();
        section.override_mut(&mut params);
        Some(params)
    }

    /// Whether the scene reconstructs the touched surface; the published rule only moves triangles.
    pub(super) fn has_patch(&self) -> bool {
        self.patch.is_some()
            && self
                .refine
                .as_ref()
                .is_none_or(|refine| refine.mode == Mode::Robust)
    }

    /// Settings of the patcher; `None` without `patch` or `contact`, and in paper mode.
    pub fn patcher_params(&self) -> Option<PatcherParams> {
        let PatchParams { tolerance } = self
            .patch
            .filter(|_| self.has_patch() && self.contact.is_some())?;
        let (shape, TipParams { radius, stiffness }, noise) =
            (self.tip_shape(), self.tip_params(), self.scan_noise());
        // the patcher refuses an impossible tip
        let mut params = PatcherParams::for_tip(shape, radius, stiffness, noise)
            .unwrap_or_else(|_| PatcherParams::new(radius, stiffness, noise));
        params.touches.shape = shape;
        params.touches.cone_cosine = self.sliding.map(|sliding| sliding.cone_cosine);
        params.touches.changes.clone_from(&self.changes);
        params.free_space = self.carve.is_some();
        if let Some(sync) = &self.sync {
            params.touches.largest_gap_ns = sync.largest_gap_ns;
        }
        params.tolerance = tolerance.unwrap_or(params.tolerance);
        params.is_usual_tolerance = tolerance.is_none();
        params.uncertainty = self.uncertainty.map(|known| UncertaintyParams {
            scan: noise,
            ..known
        });
        Some(params)
    }
}

impl RefineSection {
    /// Overrides the settings of the mode by those of the scene.
    fn override_mut(&self, params: &mut RefineParams) {
        let dynamics = &mut params.dynamics;
        dynamics.model = match (self.contact_model, dynamics.model, params.tip.stiffness) {
            (Some(ModelName::Spring), _, Some(stiffness_n_per_m)) => {
                ContactModel::Spring { stiffness_n_per_m }
            }
            (Some(ModelName::Sigmoid), ..) | (None, ContactModel::Sigmoid(_), _) => {
                ContactModel::Sigmoid(self.sigmoid)
            }
            (_, as_is, _) => as_is,
        };
        let is_sigmoid = matches!(dynamics.model, ContactModel::Sigmoid(_));
        dynamics.take_out_rigid_offset = is_sigmoid && self.mode == Mode::Robust;
        let alpha = match self.mode {
            Mode::Paper => dynamics.alpha_m_per_n_s,
            Mode::Robust => relaxing_alpha(&dynamics.model),
        };
        dynamics.alpha_m_per_n_s = self.alpha.unwrap_or(alpha);
        dynamics.beta_per_n2_s = self.beta.unwrap_or(dynamics.beta_per_n2_s);
        params.turning = match (self.turning, self.beta) {
            (Some(turning), _) => Some(turning),
            (None, Some(_)) => None,
            (None, None) => params.turning,
        };
        dynamics.rule = self.step.unwrap_or(dynamics.rule);
        dynamics.along = self.along.unwrap_or(dynamics.along);
        params.roi = self.roi.map_or(params.roi, RoiSize::Radius);
    }
}

/// A simulated arm of a cell; other settings are those of [`ArmParams::default`].
pub fn simulated_arm(cell: &RobotCell, params: &ProbeParams) -> ArmParams {
    ArmParams {
        geometry: cell.geometry.clone(),
        pose_bo: cell.pose_bo,
        pose_ft: cell.pose_ft,
        radius: cell.tool.ball_radius,
        stiffness: params.touch.stiffness,
        force_noise: params.touch.onset.force_noise,
        ..ArmParams::default()
    }
}
