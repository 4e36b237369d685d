//! The running replays: few at a time, each until its last page leaves.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::sync::{Semaphore, watch};
use tokio::time::timeout;

use super::player::{OpenedReplay, Player};
use crate::page::admission::entrance::Entrance;
use crate::page::background;
use crate::page::replay_state::ReplayControl;
use crate::ros::locked;
use touchup_io::session_folder::SessionFolder;
use touchup_session::clock::Clock;

/// Maximum number of replays: each has scan, mesh and touches in memory.
const MOST_REPLAYS: usize = 2;
/// Time-out for the end of a replay without pages.
const GONE_WITHIN: Duration = Duration::from_secs(30);
const BUSY: &str = "two sessions are being replayed already: close the pages of one of them";

/// A replay, until its last page leaves.
pub(super) struct Replay {
    pub control: Arc<ReplayControl>,
    pub opened: watch::Receiver<OpenedReplay>,
}

impl Drop for Replay {
    fn drop(&mut self) {
        self.control.close();
    }
}

/// The running replays.
#[derive(Debug)]
pub(in crate::page) struct Replays {
    entrance: Arc<Entrance>,
    session_folder: PathBuf,
    runtime: Handle,
    /// by session
    running: Mutex<BTreeMap<String, Weak<Replay>>>,
    /// places in memory, also of ending replays
    places: Arc<Semaphore>,
}

impl Replays {
    /// No replay yet.
    ///
    /// - `session_folder`: parent of the session folders.
    pub fn new(entrance: &Arc<Entrance>, session_folder: &Path, runtime: &Handle) -> Arc<Self> {
        Arc::new(Self {
            entrance: Arc::clone(entrance),
            session_folder: session_folder.to_owned(),
            runtime: runtime.clone(),
            running: Mutex::default(),
            places: Arc::new(Semaphore::new(MOST_REPLAYS)),
        })
    }

    /// The replay of a session: the running one, or a new one.
    ///
    /// # Errors
    /// In words: no such session, or too many replays.
    pub(super) fn join(&self, session: &str) -> Result<Arc<Replay>, String> {
        let mut running = locked(&self.running);
        running.retain(|_, replay| replay.strong_count() > 0);
        if let Some(replay) = running.get(session).and_then(Weak::upgrade) {
            return Ok(replay);
        }
        if running.len() >= MOST_REPLAYS {
            return Err(BUSY.to_owned());
        }
        let folder = SessionFolder::open(&self.session_folder, session)
            .map_err(|error| error.to_string())?;
        let replay = self.begin(folder);
        running.insert(session.to_owned(), Arc::downgrade(&replay));
        Ok(replay)
    }

    fn begin(&self, folder: SessionFolder) -> Arc<Replay> {
        let control = Arc::new(ReplayControl::new(folder.name(), Clock::system()));
        let (to, opened) = watch::channel(None);
        let player = Player {
            folder,
            session_folder: self.session_folder.clone(),
            entrance: Arc::clone(&self.entrance),
            control: Arc::clone(&control),
            opened: to,
        };
        let places = Arc::clone(&self.places);
        self.runtime.spawn(async move {
            // an ending replay still has its memory
            let Ok(Ok(place)) = timeout(GONE_WITHIN, places.acquire_owned()).await else {
                return drop(player.opened.send_replace(Some(Err(BUSY.to_owned()))));
            };
            let play = move || {
                player.run();
                drop(place);
            };
            if let Err(error) = background::begin("replay", play) {
                // waiting pages see the closed channel
                tracing::warn!(%error, "there is no thread for a replay");
            }
        });
        Arc::new(Replay { control, opened })
    }
}
