//! A recording on the operator's page: a node without a network takes it as it would take a stylus.

use std::thread::{Builder, sleep};
use std::time::Duration;

use super::replay::play;
use super::signals::{SignalKind, on_each_signal};
use super::web::WebFlags;
use super::{CliError, Losses, notify, print_result};
use crate::clock::Clock;
use crate::replay::Recording;
use crate::ros::in_process;
use crate::ros::inbox::inbox;
use crate::ros::node::{INBOX, NodeEnd, NodeError, Prepared};
use crate::ros::parameters::Parameters;
use crate::ros::port::Arrival;

/// Period of the look for a page.
const LOOK: Duration = Duration::from_millis(100);

/// Plays a recording in real time as soon as a page is open; the node goes on until a signal ends it, so that what was found can be
/// looked at and saved.
pub(super) fn on_page(web: &WebFlags, parameters: Parameters, recording: Recording) -> Result<Losses, CliError> {
    let ready = Prepared::new(parameters)?;
    let clock = Clock::system();
    let (inbox, arrivals) = inbox(INBOX, &clock);
    let ending = inbox.clone();
    let signals = [SignalKind::interrupt(), SignalKind::terminate()];
    let on_signal = move |count| {
        if count > 1 {
            std::process::exit(1);
        }
        notify("ends and saves; a second signal ends it at once");
        // a node that has ended already needs none
        ending.put(Arrival::Shutdown);
    };
    on_each_signal(&signals, on_signal).map_err(NodeError::NoThread)?;
    let (port, touching) = in_process::start_unread(inbox.clone(), &clock);
    let (port, page) = web.serve(&ready, inbox, port)?;
    let running = ready.start(port, arrivals, None)?;
    notify("the touching begins when the page is open; Ctrl-C saves and ends it");
    let touch = move || {
        while page.as_ref().is_some_and(|page| !page.was_opened()) {
            sleep(LOOK);
        }
        match play(recording, None, 1.0, "stylus", &touching) {
            Ok(_) => notify("the recording is at its end; Ctrl-C saves and ends the session"),
            Err(error) => notify(&error.message),
        }
        // it is served until the program ends
        page
    };
    let touching = Builder::new().name("touching".to_owned()).spawn(touch).map_err(NodeError::NoThread)?;
    let NodeEnd { folder, report } = running.join()?;
    drop(touching);
    print_result(&format!("{report}\nwrote {}", folder.join("refined.ply").display()))?;
    Ok(Losses::new())
}
