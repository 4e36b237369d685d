//! `touchup node --web` without a scan: setup on the page, until a node is ready to start.

use std::path::Path;
use std::sync::Arc;

use super::begin::BeginError;
use super::path_parameter::path;
use crate::cli::{CliError, notify};
use touchup_io::mesh_file::MeshFileError;
use touchup_io::recording::Topics;
use touchup_node::node::NodeError;
use touchup_node::page::{NodeSetup, SetupParams, SetupStep, WebServer};
use touchup_node::ros::arguments::NodeConfig;
use touchup_node::ros::parameters::{ParameterValue, Parameters};
use touchup_session::scan::ScanError;

/// Serves the setup.
///
/// - `scans`: folder of the scans.
///
/// # Errors
/// An unusable folder or scene.
pub(in crate::cli) fn set_up(
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

/// Waits for a node set up on the page to begin; returns the result of `begin`, with its
/// configuration in `config`. The page shows faults of the selection, the network and the arm.
///
/// # Errors
/// A path that cannot be a parameter.
pub(in crate::cli) fn set_up_on_page<B>(
    setup: &NodeSetup,
    config: &mut NodeConfig,
    begin: &mut dyn FnMut(&NodeConfig) -> Result<B, BeginError>,
) -> Result<B, CliError> {
    notify("no scan is named: choose one on the page; Ctrl-C ends the program");
    loop {
        let scene = setup.wait();
        // the scene has all settings of the page, even the radius
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

/// Step on the page at which the user can mend an error.
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
