//! `touchup node`: the ROS 2 node, until a signal ends it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::common::begin::BeginError;
use super::common::path_parameter::path;
use super::common::signals::SignalledNode;
use super::common::told::{ToldBy, ToldNumbers};
use super::common::web::WebFlags;
use super::probing::arm::{connect_ur, ros2_control_arm};
use super::{
    CliError, Losses, by_reason, counted, print_report, print_result, require, require_positive,
};
use touchup_geometry::mesh::TriMesh;
use touchup_node::node::{
    ArmKind, ArmOfNode, INBOX, NodeEnd, NodeError, PreparedNode, SessionReport, mesh_unit,
};
use touchup_node::ros;
use touchup_node::ros::arguments::NodeConfig;
use touchup_node::ros::inbox::{Arrivals, Inbox, inbox};
use touchup_node::ros::parameters::ParameterValue;
use touchup_node::ros::port::Port;
use touchup_session::clock::Clock;
use touchup_session::live::Quantiles;
use touchup_session::scan::{Scan, read_scan};
use touchup_session::scene::Scene;
use touchup_session::session::ResultFiles;

#[derive(Debug, Args)]
pub(super) struct NodeArguments {
    /// Scene with the parts and their parameters, and the scan, unless -p scan:=FILE names it
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    /// Radius of the ball, mm; required if no scene has it
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    tip_radius_mm: Option<f64>,
    #[command(flatten)]
    web: WebFlags,
    /// Folder of the page: scans to choose from if none is named, uploaded scans and scene.yaml;
    /// default: the current folder
    #[arg(long, value_name = "FOLDER", requires = "web")]
    web_scans: Option<PathBuf>,
    /// Prints the report of the session as one JSON object
    #[arg(long)]
    json: bool,
}

/// - `ros`: arguments behind `--ros-args`.
pub(super) fn node(arguments: &NodeArguments, ros: &[String]) -> Result<Losses, CliError> {
    let mut config = NodeConfig::new(ros, |name| std::env::var(name).ok())?;
    arguments.set_scene(&mut config)?;
    if let Some(radius_mm) = arguments.tip_radius_mm {
        require_positive("--tip-radius-mm", radius_mm)?;
        config
            .parameters
            .set("tip_radius_mm", &ParameterValue::Double(radius_mm))
            .map_err(CliError::usage)?;
    }
    if !config.unused.is_empty() {
        tracing::warn!(
            "the parameter files name what this node does not have: {}",
            config.unused.join(", ")
        );
    }
    let signals = SignalledNode::listen().map_err(NodeError::NoThread)?;
    let mut begin = |config: &NodeConfig| arguments.begin(config, &signals);
    let (begun, opened) =
        arguments
            .web
            .begun(arguments.web_scans.as_deref(), &mut config, &mut begin)?;
    let ConnectedNode {
        ready,
        nominal,
        inbox,
        arrivals,
        port,
        arm,
    } = begun;
    let (port, _page) = arguments.web.serve(opened, nominal, &ready, inbox, port)?;
    let running = ready.start(port, arrivals, arm)?;
    let topics: Vec<_> = config
        .heard_topics()
        .into_iter()
        .filter_map(|name| config.resolve(name).ok())
        .collect();
    let own = config.parameters.has_arm().then(|| "its arm".to_owned());
    let heard: Vec<_> = own.into_iter().chain(topics).collect();
    print_result(&format!(
        "{} listens to {}; Ctrl-C saves and ends it",
        config.place.full_name(),
        heard.join(" and ")
    ))?;
    let end = running.join()?;
    print_report(arguments.json, &end.report, || end_text(&end))?;
    Ok(losses(&end.report))
}

/// Node with its network and its arm.
struct ConnectedNode {
    ready: PreparedNode,
    nominal: Option<TriMesh>,
    inbox: Inbox,
    arrivals: Arrivals,
    port: Arc<dyn Port>,
    arm: Option<ArmOfNode>,
}

/// Arm for the parameter `robot`, with its own node on the network.
///
/// - `inbox`: of the node, for the measurements of the arm.
fn arm_of(
    config: &NodeConfig,
    scene: &Scene,
    inbox: &Inbox,
) -> Result<Option<ArmOfNode>, CliError> {
    if !config.parameters.has_arm() {
        return Ok(None);
    }
    let robot = config.parameters.string("robot");
    let why = format!("robot:={robot} touches with a probe: say source:=probe as well");
    require(config.parameters.string("source") == "probe", why)?;
    if scene.probing().is_none() {
        return Err(NodeError::NoRobot.into());
    }
    let kind = match robot {
        "sim" => {
            let part = config.parameters.string("sim_part");
            require(
                !part.is_empty(),
                "robot:=sim needs the part that it touches: -p sim_part:=MESH",
            )?;
            let unit = mesh_unit(&config.parameters);
            let Scan { mesh, .. } = read_scan(Path::new(part), unit).map_err(CliError::truth)?;
            ArmKind::Sim(Box::new(mesh))
        }
        "ros2_control" => ArmKind::Real(ros2_control_arm(scene, &config.beside("_driver"))?),
        _ => ArmKind::Real(connect_ur(scene)?),
    };
    Ok(Some(ArmOfNode {
        kind,
        samples: Box::new(ros::ArmSamples {
            inbox: inbox.clone(),
            has_poses: config.parameters.pose_frames().is_none(),
            topics: ros::samples(&config.beside("_arm"))?,
        }),
    }))
}

impl NodeArguments {
    /// Fallible steps before the node exists, so that an operator can mend a failure and begin
    /// anew.
    fn begin(
        &self,
        config: &NodeConfig,
        signals: &SignalledNode,
    ) -> Result<ConnectedNode, BeginError> {
        let ready = PreparedNode::new(config.parameters.clone())?;
        let (inbox, arrivals) = inbox(INBOX, &Clock::system());
        signals.set(Some(inbox.clone()));
        let begun = self.around(config, ready, inbox, arrivals);
        // without a node a signal ends the program at once
        Ok(begun.inspect_err(|_| signals.set(None))?)
    }

    /// Network and arm of a prepared node.
    fn around(
        &self,
        config: &NodeConfig,
        ready: PreparedNode,
        inbox: Inbox,
        arrivals: Arrivals,
    ) -> Result<ConnectedNode, CliError> {
        let (scan, faces) = ready.scan();
        print_result(&format!(
            "scan: {} with {faces} faces; session: {}",
            scan.display(),
            ready.folder().display()
        ))?;
        print_result(&self.told(config, &ready).to_string())?;
        print_result(&ready.cost(config.parameters.has_arm()).to_string())?;
        let nominal = self.web.nominal(ready.mesh_unit())?;
        let port = ros::start(config, inbox.clone())?;
        let arm = arm_of(config, ready.scene(), &inbox)?;
        Ok(ConnectedNode {
            ready,
            nominal,
            inbox,
            arrivals,
            port,
            arm,
        })
    }

    /// Settings that determine the mesh, and their sources.
    fn told(&self, config: &NodeConfig, ready: &PreparedNode) -> ToldNumbers {
        let is_set = config.parameters.double("tip_radius_mm") > 0.0;
        let by_flag = self.tip_radius_mm.filter(|_| is_set);
        let radius_by = by_flag
            .map(|_| ToldBy::Flag)
            .or(is_set.then_some(ToldBy::Parameter));
        // without a scene the defaults have no source
        let yaml = if config.parameters.string("scene").is_empty() {
            ""
        } else {
            ready.scene_yaml()
        };
        ToldNumbers::of(ready.scene(), yaml, [radius_by, None, None])
    }

    /// Sets the scene of the flag, in place of a parameter file's scene for every node.
    fn set_scene(&self, config: &mut NodeConfig) -> Result<(), CliError> {
        let Some(scene) = &self.scene else {
            return Ok(());
        };
        config
            .parameters
            .set("scene", &path(scene)?)
            .map_err(CliError::usage)
    }
}

fn losses(report: &SessionReport) -> Losses {
    let ([wrenches, poses], [samples, others]) = (report.lost, report.dropped);
    let lost = [
        (wrenches, ["wrench", "wrenches"], "lost in transport"),
        (poses, ["pose", "poses"], "lost in transport"),
        (
            samples,
            ["wrench or pose", "wrenches and poses"],
            "dropped: the computer is too slow",
        ),
        (others, ["other message", "other messages"], "dropped"),
        (
            report.unrecorded,
            ["message", "messages"],
            "not in the session's recording",
        ),
    ];
    let lost = lost.into_iter().filter(|(count, ..)| *count > 0);
    lost.map(|(count, [one, many], how)| format!("{} {how}", counted(count, one, many)))
        .collect()
}

/// The end of a node as text: the report of its session, and the file of the mesh.
pub(super) fn end_text(NodeEnd { folder, report }: &NodeEnd) -> String {
    format!(
        "{}\nwrote {}",
        report_text(report),
        folder.join(ResultFiles::MESH).display()
    )
}

/// The report of a session as text.
fn report_text(report: &SessionReport) -> String {
    let wrenches = counted(report.lost[0], "wrench", "wrenches");
    let poses = counted(report.lost[1], "pose", "poses");
    let [poses_stale, wrenches_stale] = report.gaps.map(|gaps| counted(gaps, "time", "times"));
    let us = |ns: u64| ns as f64 * 1e-3;
    let line = |times: Quantiles| {
        let [median, p99, p999, max] = [times.median, times.p99, times.p999, times.max].map(us);
        format!("median {median:.1} us, p99 {p99:.1} us, p99.9 {p999:.1} us, max {max:.1} us")
    };
    let mut lines = vec![
        format!(
            "samples: {} accepted; refused: {}",
            report.accepted,
            by_reason(&report.refused)
        ),
        format!(
            "lost in transport: {wrenches}, {poses}; streams stale: {wrenches_stale} wrenches, {poses_stale} poses"
        ),
        format!(
            "contacts: {}; updates cut back: {}",
            report.contacts, report.cut_back
        ),
        format!("push: {}", line(report.push_ns)),
        format!("arrival to mesh: {}", line(report.latency_ns)),
    ];
    let patch = report
        .result
        .as_ref()
        .and_then(|result| result.patch.as_ref());
    lines.extend(patch.map(ToString::to_string));
    lines.join("\n")
}
