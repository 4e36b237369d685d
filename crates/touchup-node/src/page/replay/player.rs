//! Player of a session: reads it, starts a node for it, sends its messages, and ends both when no
//! page follows.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use tokio::sync::watch;

use super::recording::SessionRecording;
use crate::node::{Node, PreparedNode, ReplayedSession};
use crate::page::admission::entrance::Entrance;
use crate::page::annotations::Annotations;
use crate::page::board::Board;
use crate::page::calls::Calls;
use crate::page::page_port::PagePort;
use crate::page::replay_state::ReplayControl;
use crate::page::replay_state::ReplayNext;
use crate::page::reporting::report_work::Reports;
use crate::page::site::{ScanShown, Site};
use crate::ros::in_process::{self, OtherParticipants};
use crate::ros::inbox::{Inbox, inbox};
use crate::ros::parameters::CELL_FRAME;
use crate::ros::parameters::{ParameterValue, Parameters};
use crate::ros::port::{Arrival, ReplayStep, SamplePort};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{LiveMessage, Topics};
use touchup_io::session_folder::SessionFolder;
use touchup_method::stylus::Message;
use touchup_session::clock::Clock;
use touchup_session::replay::RecordedSurfaces;
use touchup_session::session::SessionRecord;

/// Maximum number of queued messages: pauses and jumps take effect after them.
const INBOX: usize = 256;
/// Reason of the end if the node is gone.
const ENDED: &str =
    "the replay ended by a fault of touchup: please report it with the session's folder";

/// Content of a replay once open, or the reason of its failure.
pub(super) type OpenedReplay = Option<Result<Arc<Site>, String>>;

/// Inputs of a replay.
pub(super) struct Player {
    pub folder: SessionFolder,
    /// parent of the session folders
    pub session_folder: PathBuf,
    pub entrance: Arc<Entrance>,
    pub control: Arc<ReplayControl>,
    pub opened: watch::Sender<OpenedReplay>,
}

/// A running replay.
struct ReplayStage {
    recording: SessionRecording,
    site: Arc<Site>,
    inbox: Inbox,
    stylus: OtherParticipants,
    node: Node,
}

/// The changes and known surfaces of a recorded session. For a running one: to be read after its
/// messages, so that no undo before one of them is missing.
fn replayed_session(
    folder: &SessionFolder,
    recording: PathBuf,
    topics: Topics,
) -> Result<ReplayedSession, String> {
    let changes = SessionRecord::strokes_of(folder.path()).map_err(|error| error.to_string())?;
    let known = RecordedSurfaces::beside(&recording).map_err(|error| error.to_string())?;
    Ok(ReplayedSession::new(recording, topics, known, changes))
}

impl Player {
    /// Plays until no page follows.
    pub fn run(self) {
        let Self {
            control, opened, ..
        } = &self;
        let ReplayStage {
            recording,
            site,
            inbox,
            stylus,
            node,
        } = match self.open() {
            Ok(stage) => stage,
            Err(why) => return drop(opened.send_replace(Some(Err(why)))),
        };
        opened.send_replace(Some(Ok(site)));
        if let Err(why) = play(&recording, control, &stylus) {
            control.fail(why);
        }
        inbox.put(Arrival::Shutdown);
        if let Err(error) = node.join() {
            tracing::warn!(%error, session = control.session(), "a replay ended by a fault");
        }
    }

    /// Reads the session, and starts its node.
    fn open(&self) -> Result<ReplayStage, String> {
        let Self {
            folder, control, ..
        } = self;
        let record = SessionRecord::open(folder.path()).map_err(|error| error.to_string())?;
        let SessionRecord {
            scan,
            mesh_unit,
            scene,
            recording,
            topics,
            ..
        } = record;
        let source = if topics.pose.starts_with("/probe/") {
            "probe"
        } else {
            "stylus"
        };
        let read = SessionRecording::read(recording.clone(), topics.clone(), source, || {
            !control.is_closed()
        });
        let readable =
            read.map_err(|error| format!("the recording cannot be replayed: {error}"))?;
        let replayed = replayed_session(folder, recording, topics)?;
        let text = |text: &str| ParameterValue::String(text.to_owned());
        let mut parameters = Parameters::default();
        for (name, value) in [
            ("scene", path(&scene)?),
            ("scan", path(&scan)?),
            ("mesh_unit", text(mesh_unit.name())),
            ("source", text(source)),
        ] {
            let set = parameters.set(name, &value);
            set.map_err(|error| error.to_string())?;
        }
        let ready = PreparedNode::replayed(parameters, folder.clone(), replayed)
            .map_err(|error| error.to_string())?;
        let clock = Clock::system();
        let (inbox, arrivals) = inbox(INBOX, &clock);
        let (network, stylus) = in_process::start_unread(inbox.clone(), &clock);
        let site = self.site(&ready, &inbox, &scan, mesh_unit)?;
        let port = Arc::new(PagePort {
            network,
            site: Arc::clone(&site),
        });
        let node = ready
            .start(port, arrivals, None)
            .map_err(|error| error.to_string())?;
        control.begin(readable.end_ns, readable.damage.clone());
        Ok(ReplayStage {
            recording: readable,
            site,
            inbox,
            stylus,
            node,
        })
    }

    /// The content of the page.
    fn site(
        &self,
        ready: &PreparedNode,
        inbox: &Inbox,
        scan: &Path,
        mesh_unit: MeshUnit,
    ) -> Result<Arc<Site>, String> {
        let file = scan
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        Ok(Arc::new(Site {
            board: Board::default(),
            mesh: ready.mesh_feed(),
            calls: Calls::new(inbox).map_err(|error| error.to_string())?,
            inbox: inbox.clone(),
            entrance: Arc::clone(&self.entrance),
            // none are read: a replay detects features anew, perhaps with other numbers
            annotations: Annotations::new(&self.session_folder),
            nominal: None,
            reports: Reports::new(None, mesh_unit),
            scan: ScanShown {
                file,
                faces: ready.scan().1,
                is_size_confirmed: true,
            },
            session_folder: self.session_folder.clone(),
            pages: AtomicUsize::new(0),
            replay: Some(Arc::clone(&self.control)),
        }))
    }
}

/// A path as a parameter of a node.
fn path(path: &Path) -> Result<ParameterValue, String> {
    let text = path
        .to_str()
        .ok_or_else(|| format!("{}: parameters of ROS are UTF-8, rename it", path.display()))?;
    Ok(ParameterValue::String(text.to_owned()))
}

/// Plays from the beginning, and again on request, until no page follows.
fn play(
    recording: &SessionRecording,
    control: &ReplayControl,
    stylus: &OtherParticipants,
) -> Result<(), String> {
    while play_once(recording, control, stylus)? == ReplayNext::Again {
        step(ReplayStep::Again, stylus)?;
    }
    Ok(())
}

fn play_once(
    recording: &SessionRecording,
    control: &ReplayControl,
    stylus: &OtherParticipants,
) -> Result<ReplayNext, String> {
    for timed in recording.messages().map_err(|error| error.to_string())? {
        let (at_ns, message) = timed.map_err(|error| error.to_string())?;
        match control.wait_for(at_ns) {
            ReplayNext::Go => {}
            next => return Ok(next),
        }
        let frame = match &message {
            Message::Wrench(_) => recording.wrench_frame.clone(),
            Message::Pose(_) => CELL_FRAME.to_owned(),
        };
        if !stylus.publish(LiveMessage { frame, message }) {
            return Err(ENDED.to_owned());
        }
    }
    step(ReplayStep::End, stylus)?;
    Ok(control.wait_at_end())
}

fn step(step: ReplayStep, stylus: &OtherParticipants) -> Result<(), String> {
    stylus
        .ask(|reply| Arrival::Replay(step, reply))
        .recv()
        .map_err(|_| ENDED.to_owned())?
}
