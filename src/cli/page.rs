//! Recording on the operator page: a node without a network reads it like a stylus.

use std::path::Path;
use std::thread::{Builder, sleep};
use std::time::Duration;

use super::common::path_parameter::path;
use super::common::signals::SignalledNode;
use super::common::web::WebFlags;
use crate::cli::replay::play;
use crate::cli::{CliError, notify};
use touchup_io::mesh_file::MeshUnit;
use touchup_method::stylus::MarkerFilter;
use touchup_node::node::{INBOX, NodeEnd, NodeError, PreparedNode};
use touchup_node::ros::in_process;
use touchup_node::ros::inbox::inbox;
use touchup_node::ros::parameters::{ParameterValue, Parameters};
use touchup_session::clock::Clock;
use touchup_session::replay::Recording;

/// Polling period for an open page.
const LOOK: Duration = Duration::from_millis(100);

/// Plays a recording in real time once a page is open; the node runs on until a signal, for viewing
/// and saving the results. Returns the node's end.
pub(super) fn on_page(
    web: &WebFlags,
    parameters: Parameters,
    recording: Recording,
    markers: Option<MarkerFilter>,
) -> Result<NodeEnd, CliError> {
    let ready = PreparedNode::new(parameters)?;
    let clock = Clock::system();
    let (inbox, arrivals) = inbox(INBOX, &clock);
    SignalledNode::listen()
        .map_err(NodeError::NoThread)?
        .set(Some(inbox.clone()));
    let (port, touching) = in_process::start_unread(inbox.clone(), &clock);
    let (port, page) = web.serve(None, web.nominal(ready.mesh_unit())?, &ready, inbox, port)?;
    let running = ready.start(port, arrivals, None)?;
    notify("the touching begins when the page is open; Ctrl-C saves and ends it");
    let touch = move || {
        while page.as_ref().is_some_and(|page| !page.was_opened()) {
            sleep(LOOK);
        }
        match play(recording, markers, 1.0, "stylus", &touching) {
            Ok(_) => notify("the recording is at its end; Ctrl-C saves and ends the session"),
            Err(error) => notify(&error.message),
        }
        // keeps the page served until the program ends
        page
    };
    let touching = Builder::new()
        .name("touching".to_owned())
        .spawn(touch)
        .map_err(NodeError::NoThread)?;
    let end = running.join()?;
    drop(touching);
    Ok(end)
}

/// Parameters of a node on a scan.
///
/// - `sessions`: folder for sessions.
pub(super) fn parameters_of(
    scan: &Path,
    unit: MeshUnit,
    sessions: &Path,
) -> Result<Parameters, CliError> {
    let mut parameters = Parameters::default();
    let unit = ParameterValue::String(unit.name().to_owned());
    for (name, value) in [
        ("scan", path(scan)?),
        ("mesh_unit", unit),
        ("session_folder", path(sessions)?),
    ] {
        parameters.set(name, &value).map_err(CliError::usage)?;
    }
    Ok(parameters)
}
