//! `touchup node --web` without a scan: the setup on the page, until a node is ready to start.

use std::path::Path;
use std::sync::Arc;

use super::begin::BeginError;
use super::path_parameter::path;
use super::{CliError, notify};
use crate::io::mesh_file::MeshFileError;
use crate::io::recording::Topics;
use crate::ros::arguments::NodeConfig;
use crate::ros::node::NodeError;
use crate::ros::parameters::{ParameterValue, Parameters};
use crate::ros::web::{NodeSetup, SetupParams, SetupStep, WebServer};
use crate::scan::ScanError;

/// Serves the setup.
///
/// - `scans`: folder in which scans lie.
///
/// # Errors
/// The folder or the scene cannot be used.
pub(super) fn set_up(
    server: &WebServer,
    scans: &Path,
    parameters: &Parameters,
) -> Result<Arc<NodeSetup>, CliError> {
    let scene = Some(parameters.string("scene"))
        .filter(|scene| !scene.is_empty())
        .map(Into::into);
    let radius_mm = Some(parameters.double("tip_radius_mm")).filter(|mm| *mm > 0.0);
    let source = parameters.string("source");
    let (pose, wrench) = (format!("/{source}/pose"), format!("/{source}/wrench"));
    let topics = Topics {
        pose,
        wrench,
        markers: None,
    };
    Ok(server.set_up(SetupParams {
        folder: scans.to_owned(),
        scene,
        radius_mm,
        topics,
    })?)
}

/// Waits until a node has begun that was set up on the page: what `begin` makes of it, and in
/// `config` what that was made of. Whatever is wrong with what is chosen, with the network or with
/// the arm is shown on the page.
///
/// # Errors
/// A path that is no parameter.
pub(super) fn set_up_on_page<B>(
    setup: &NodeSetup,
    config: &mut NodeConfig,
    begin: &mut dyn FnMut(&NodeConfig) -> Result<B, BeginError>,
) -> Result<B, CliError> {
    notify("no scan is named: choose one on the page; Ctrl-C ends the program");
    loop {
        let scene = setup.wait();
        // what was said on the page is in the scene, also the radius
        for (name, value) in [
            ("scene", path(&scene)?),
            ("tip_radius_mm", ParameterValue::Double(0.0)),
        ] {
            config
                .parameters
                .set(name, &value)
                .map_err(CliError::usage)?;
        }
        match begin(config) {
            Ok(begun) => return Ok(begun),
            Err(error) => {
                let step = step_of(&error);
                let why = CliError::from(error).message;
                notify(&format!("the node does not start: {why}"));
                setup.refuse(step, why);
            }
        }
    }
}

/// Where on the page an error can be mended.
fn step_of(error: &BeginError) -> SetupStep {
    let BeginError::Node(error) = error else {
        return SetupStep::Start;
    };
    match error {
        NodeError::Scan(scan) => match **scan {
            ScanError::File(
                MeshFileError::Implausible { .. } | MeshFileError::UnitOfE57 { .. },
            ) => SetupStep::Unit,
            _ => SetupStep::Scan,
        },
        NodeError::Refine(_) => SetupStep::Scan,
        NodeError::Scene(_) | NodeError::Setting(_) => SetupStep::Tip,
        _ => SetupStep::Start,
    }
}
