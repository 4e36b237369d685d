//! Scene and scan of an arm, read and checked before motion.

use std::path::Path;
use std::time::SystemTime;

use nalgebra::{Isometry3, Point3};
use tracing::info;

use crate::cli::common::arm_errors::ArmErrorsName;
use crate::cli::common::told::{ToldFlags, ToldNumbers};
use crate::cli::{CliError, require};
use touchup_features::calibrate::{ReferenceSphere, beside_spheres};
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::MeshUnit;
use touchup_probing::execute::{ProbeParams, RobotCell, StaticWorld};
use touchup_session::scan::{Scan, read_scan};
use touchup_session::scene::{CheckStanding, Scene, simulated_arm};
use touchup_sim::ArmParams;

/// Refuses an impossible cell temperature in `--temperature-c`.
pub(in crate::cli) fn check_temperature(temperature_c: f64) -> Result<(), CliError> {
    let is_allowed = (-50.0..=100.0).contains(&temperature_c);
    require(
        is_allowed,
        format_args!("--temperature-c {temperature_c} must be -50 to 100"),
    )
}

/// Cell, parameters, scene and scan of a probing.
pub(in crate::cli) struct ProbingSetup {
    pub cell: RobotCell,
    pub params: ProbeParams,
    pub scene: Scene,
    /// Settings of tip and scan, with their sources.
    pub told: ToldNumbers,
    pub(super) mesh: TriMesh,
    /// Spheres beside the part.
    pub spheres: Vec<ReferenceSphere>,
    /// Current validity of the arm's check.
    pub check: CheckStanding,
}

const NO_ROBOT: &str = "the scene names no `robot`, so the pose of the arm's base and its allowed volume are unknown: add \
                        `robot:` to it (config/probe.yaml is an example)";

const NO_MOTION: &str = "the scene does not allow the arm to move: look at plan.png first, then put `allow_motion: true` under `robot`";

impl ProbingSetup {
    /// Reads scene and scan; the scene has the tip radius.
    pub fn read(scene: &Path, scan: &Path, unit: MeshUnit) -> Result<Self, CliError> {
        let (scene, told) = ToldFlags::default().scene(Some(scene))?;
        let (cell, params) = scene.probing().ok_or_else(|| CliError::usage(NO_ROBOT))?;
        let Scan { mesh, repair, .. } = read_scan(scan, unit)?;
        info!(%repair, "scan");
        let check = scene.check_standing(SystemTime::now());
        let check = check.ok_or_else(|| CliError::usage(NO_ROBOT))?;
        Ok(Self {
            cell,
            params,
            scene,
            told,
            mesh,
            spheres: Vec::new(),
            check,
        })
    }

    /// The same with spheres beside the part.
    pub fn beside(self, spheres: &[ReferenceSphere]) -> Self {
        Self {
            spheres: spheres.to_vec(),
            ..self
        }
    }

    /// Sets the temperature of the cell, °C.
    ///
    /// # Errors
    /// [`CliError::usage`] for an impossible temperature.
    pub fn at_temperature(&mut self, temperature_c: f64) -> Result<(), CliError> {
        check_temperature(temperature_c)?;
        self.scene
            .robot
            .iter_mut()
            .for_each(|robot| robot.temperature_c = Some(temperature_c));
        let check = self.scene.check_standing(SystemTime::now());
        self.check = check.unwrap_or_else(|| self.check.clone());
        Ok(())
    }

    /// Simulated arm of this cell.
    pub fn simulated_arm(&self, seed: u64, errors: ArmErrorsName) -> ArmParams {
        let errors = errors.drawn(self.params.pattern.shared.registered_at.into(), seed);
        ArmParams {
            seed,
            errors,
            ..simulated_arm(&self.cell, &self.params)
        }
    }

    /// Mesh of the part, and the spheres beside it.
    pub fn with_spheres(&self, part: &TriMesh) -> Result<TriMesh, CliError> {
        Ok(beside_spheres(part, &self.spheres)?)
    }

    /// Start of a plan without an arm: pose of the tip in B, and centre of the ball in O.
    ///
    /// - `place`: ball centre in O, m; `None`: above the scan, like a simulated arm above its part.
    pub fn start(&self, place: Option<Point3<f64>>) -> (Isometry3<f64>, Point3<f64>) {
        let above = self.cell.above(&self.mesh);
        match place {
            Some(place) => (self.cell.pose(&above.rotation, &place), place),
            None => (above, self.cell.place(&above)),
        }
    }

    /// Scan and spheres beside it, unchanged during probing.
    pub fn static_world(&self) -> Result<StaticWorld, CliError> {
        Ok(StaticWorld::new(self.with_spheres(&self.mesh)?))
    }

    /// Target half width of the scene, mm.
    pub fn tolerance_mm(&self) -> f64 {
        self.scene
            .robot
            .as_ref()
            .map_or(f64::NAN, |robot| robot.tolerance * 1e3)
    }

    /// Refuses to move unless the scene allows it.
    ///
    /// # Errors
    /// [`CliError::usage`]
    pub fn may_move(&self) -> Result<(), CliError> {
        require(self.scene.allows_motion(), NO_MOTION)
    }
}
