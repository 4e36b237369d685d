//! Start configuration of the node: parameters, scene and scan.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::NodeError;
use super::shared::SharedNodeState;
use crate::ros::mesh_feed::MeshFeed;
use crate::ros::parameters::Parameters;
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::Topics;
use touchup_session::clock::Clock;
use touchup_session::refinement::RefinementInput;
use touchup_session::scan::read_scan;
use touchup_session::scene::{Scene, SceneError, Setting};

/// Constant data of a running node.
pub(crate) struct Setup {
    pub clock: Clock,
    pub shared: Arc<SharedNodeState>,
    /// scene and original scan
    pub input: RefinementInput,
    pub scan_path: PathBuf,
    pub mesh_unit: MeshUnit,
    pub scene_yaml: String,
    pub topics: Topics,
    pub source: &'static str,
    pub tool: String,
    /// frame whose transforms give the pose, and its base frame
    pub pose_frames: Option<[String; 2]>,
}

impl Setup {
    pub fn new(parameters: Parameters, clock: Clock) -> Result<Self, NodeError> {
        let scene_path = Path::new(parameters.string("scene"));
        let (scene, scene_yaml) =
            scene_of(scene_path, parameters.double("tip_radius_mm")).map_err(Box::new)?;
        let (scan_path, mesh_unit) = match parameters.string("scan") {
            "" => scene.scan_file(scene_path).ok_or(NodeError::NoScan)?,
            path => (PathBuf::from(path), mesh_unit(&parameters)),
        };
        let mesh = read_scan(&scan_path, mesh_unit).map_err(Box::new)?.mesh;
        if scene.region().is_some() && parameters.has_arm() {
            return Err(NodeError::RegionWithRobot);
        }
        let input = RefinementInput::new(scene, mesh).map_err(Box::new)?;
        let source = if parameters.string("source") == "probe" {
            "probe"
        } else {
            "stylus"
        };
        let tool = match parameters.string("tool_frame") {
            "" => parameters
                .pose_frames()
                .map_or(source, |[frame, _]| frame)
                .to_owned(),
            named => named.to_owned(),
        };
        let pose_frames = parameters
            .pose_frames()
            .map(|frames| frames.map(str::to_owned));
        let known = input
            .scene
            .patcher_params()
            .and_then(|params| params.uncertainty);
        let scan_sigma = known.map(|known| known.scan).filter(|sigma| *sigma > 0.0);
        let frame = parameters.string("object_frame");
        let feed = MeshFeed::new(clock.clone(), Arc::clone(&input.scan), frame, scan_sigma);
        Ok(Self {
            clock,
            shared: Arc::new(SharedNodeState::new(parameters, Arc::new(feed))),
            input,
            scan_path,
            mesh_unit,
            scene_yaml,
            topics: Topics {
                pose: format!("/{source}/pose"),
                wrench: format!("/{source}/wrench"),
                markers: None,
            },
            source,
            tool,
            pose_frames,
        })
    }
}

/// The scene and its text for the session, both with the given radius of the ball.
///
/// - `path`: empty for the default scene.
/// - `radius_mm`: the parameter; 0: the scene's radius.
fn scene_of(path: &Path, radius_mm: f64) -> Result<(Scene, String), SceneError> {
    let (mut scene, yaml) = match path.as_os_str().is_empty() {
        true => (Scene::default(), Scene::template_without_radius()),
        false => Scene::read_with_text(path)?,
    };
    if radius_mm > 0.0 {
        let settings = [Setting::number("tip.radius_mm", radius_mm)];
        scene.set(&settings)?;
        scene.validate()?;
        let yaml = Scene::edited(&yaml, &settings, "parameter tip_radius_mm")?;
        return Ok((scene, yaml));
    }
    scene.require_radius(&yaml)?;
    scene.validate()?;
    Ok((scene, yaml))
}

/// Unit of mesh files, from the parameter `mesh_unit`.
pub fn mesh_unit(parameters: &Parameters) -> MeshUnit {
    MeshUnit::of_name(parameters.string("mesh_unit")).unwrap_or_default()
}
