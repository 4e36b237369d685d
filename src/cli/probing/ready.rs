//! Scene and scan of an arm, read and checked before anything moves.

use std::path::Path;

use nalgebra::{Isometry3, Point3};
use tracing::info;

use crate::cli::{CliError, require};
use crate::io::mesh_file::{MeshFile, MeshUnit, read_mesh};
use crate::mesh::TriMesh;
use crate::probing::execute::{Cell, ProbeParams, StaticWorld};
use crate::scene::{Scene, simulated_arm};
use crate::sim::ArmParams;

/// A prepared probing.
pub(in crate::cli) struct Ready {
    pub cell: Cell,
    pub params: ProbeParams,
    pub scene: Scene,
    pub(super) mesh: TriMesh,
}

const NO_ROBOT: &str = "the scene names no `robot`, so the pose of the arm's base and its allowed volume are unknown: add \
                        `robot:` to it (config/probe.yaml is an example)";

const NO_MOTION: &str =
    "the scene does not allow the arm to move: look at plan.png first, then put `allow_motion: true` under `robot`";

impl Ready {
    /// Reads scene and scan.
    pub fn read(scene: &Path, scan: &Path, unit: MeshUnit) -> Result<Self, CliError> {
        let scene = Scene::read(scene)?;
        let (cell, params) = scene.probing().ok_or_else(|| CliError::usage(NO_ROBOT))?;
        let MeshFile { mesh, repair } = read_mesh(scan, unit)?;
        info!(%repair, "scan");
        Ok(Self { cell, params, scene, mesh })
    }

    /// A simulated arm of this cell.
    pub fn simulated_arm(&self, seed: u64) -> ArmParams {
        ArmParams { seed, ..simulated_arm(&self.cell, &self.params) }
    }

    /// Where a plan without an arm begins: the pose of the tip in B, and the centre of the ball in O.
    ///
    /// - `place`: of the ball in O, m; `None`: above the scan, as a simulated arm begins above its part.
    pub fn start(&self, place: Option<Point3<f64>>) -> (Isometry3<f64>, Point3<f64>) {
        let above = self.cell.above(&self.mesh);
        match place {
            Some(place) => (self.cell.pose(&above.rotation, &place), place),
            None => (above, self.cell.place(&above)),
        }
    }

    /// The scan, unchanged during probing.
    pub fn static_world(&self) -> StaticWorld {
        StaticWorld::new(self.mesh.clone())
    }

    /// Target half width of the scene, mm.
    pub fn tolerance_mm(&self) -> f64 {
        self.scene.robot.as_ref().map_or(f64::NAN, |robot| robot.tolerance * 1e3)
    }

    /// Whether the scene allows motion.
    pub fn is_motion_allowed(&self) -> bool {
        self.scene.robot.as_ref().is_some_and(|robot| robot.allow_motion)
    }

    /// Refuses to move where the scene does not allow it.
    ///
    /// # Errors
    /// [`CliError::usage`]
    pub fn may_move(&self) -> Result<(), CliError> {
        require(self.is_motion_allowed(), NO_MOTION)
    }
}
