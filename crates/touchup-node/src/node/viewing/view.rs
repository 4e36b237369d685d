//! The view thread: it writes the feed of the mesh, and sends tiles, changes and tip markers at its
//! own pace.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::Duration;

use super::tiles::{ColourBy, Tiles};
use super::tip;
use crate::node::channels::{LastTip, ViewInput};
use crate::node::shared::SharedNodeState;
use crate::ros::mesh_feed::{Edits, MeshFollower};
use crate::ros::messages::MeshPatch;
use crate::ros::port::{Port, Publication, TILES_KEPT};
use touchup_session::clock::Clock;

/// Maximum number of tiles waiting in the port: tiles waiting here are drawn at the time of
/// sending, changed ones first.
const TILES_AHEAD: usize = 32;
/// Maximum number of vertices and faces of one message: 37 kB.
const OF_A_PART: usize = 1000;
/// Maximum number of parts of the whole state per period: 2.4 MB.
const PARTS_AT_ONCE: usize = 64;
/// Period while there is more to send.
const CATCH_UP: Duration = Duration::from_millis(10);

/// State of the view thread.
pub struct ViewWorker {
    clock: Clock,
    port: Arc<dyn Port>,
    shared: Arc<SharedNodeState>,
    /// returns change lists for filling
    spare: SyncSender<Box<Edits>>,
    tiles: Tiles,
    /// followers on the topic
    followers: MeshFollower,
    colour_by: ColourBy,
    whole: Option<Box<dyn Iterator<Item = MeshPatch> + Send>>,
    asked_whole: bool,
    tip: Option<LastTip>,
}

impl ViewWorker {
    /// Before the first publication.
    pub fn new(
        clock: Clock,
        port: Arc<dyn Port>,
        shared: Arc<SharedNodeState>,
        spare: SyncSender<Box<Edits>>,
    ) -> Self {
        Self {
            clock,
            tiles: Tiles::all_of(&shared.mesh.now().0),
            followers: shared.mesh.follow_from_now(),
            colour_by: colour_by(&shared),
            whole: None,
            asked_whole: false,
            tip: None,
            port,
            shared,
            spare,
        }
    }

    /// Runs until all senders are gone, then publishes the rest.
    pub fn run(mut self, inputs: &Receiver<ViewInput>) {
        let mut due = self.clock.now();
        loop {
            match self
                .clock
                .recv_timeout(inputs, due.saturating_duration_since(self.clock.now()))
            {
                Ok(input) => self.take(input),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if self.clock.now() >= due {
                // ids fit each other only after a complete change
                let period =
                    Duration::from_secs_f64(1.0 / self.shared.parameters().double("view_rate_hz"));
                due = self.clock.now()
                    + if self.tick(false) {
                        period.min(CATCH_UP)
                    } else {
                        period
                    };
            }
        }
        self.tick(true);
        // nobody moves the tip any more
        self.port
            .publish(Publication::Tip(tip::no_markers(&self.shared.frame)));
        self.shared.mesh.close();
    }

    fn take(&mut self, input: ViewInput) {
        match input {
            ViewInput::Edits(edits) => {
                self.shared.mesh.apply(&edits);
                edits.tiles.iter().for_each(|&tile| self.tiles.note(tile));
                edits
                    .faces
                    .iter()
                    .for_each(|(face, _)| self.tiles.forget_mismatch(*face));
                // the channel has room for all lists
                let _ = self.spare.try_send(edits);
            }
            ViewInput::Uncertainty(version, uncertainty) => {
                self.shared.mesh.apply_uncertainty(version, uncertainty);
            }
            ViewInput::Session(name) => {
                self.shared.mesh.begin_session(&name);
                self.tiles.restart(&self.shared.mesh.now().0);
                self.followers = self.shared.mesh.follow_from_now();
                // followers would see the new session only at the next change, so the whole state
                // goes out
                (self.whole, self.asked_whole) = (None, true);
            }
            ViewInput::Mismatch(face, distance) => {
                self.tiles
                    .note_mismatch(face, distance, &self.shared.mesh.now().0);
            }
            ViewInput::Tip(tip) => self.tip = Some(tip),
            ViewInput::Resync => self.asked_whole = true,
        }
    }

    /// Sends due publications; returns whether there is more.
    ///
    /// - `is_last`: passes all tiles to the port.
    fn tick(&mut self, is_last: bool) -> bool {
        if let Some(tip) = self.tip.take() {
            let (features, next) = &*self.shared.features();
            let markers = tip::markers(&tip, features, next, &self.shared.frame);
            self.port.publish(Publication::Tip(markers));
        }
        let (mesh, is_complete) = self.shared.mesh.now();
        if !is_complete {
            return true;
        }
        while let Some(part) = self.followers.next_part(OF_A_PART) {
            self.port.publish(Publication::MeshPatch(part));
        }
        if self.whole.is_none() && std::mem::take(&mut self.asked_whole) {
            // the next change starts from the state sent last
            self.whole = Some(Box::new(self.followers.whole(OF_A_PART)));
        }
        if let Some(whole) = &mut self.whole {
            let parts = whole.by_ref().take(PARTS_AT_ONCE);
            if parts
                .map(|part| self.port.publish(Publication::MeshPatch(part)))
                .count()
                < PARTS_AT_ONCE
            {
                self.whole = None;
            }
        }
        if self.shared.has_new_viewer.swap(false, Ordering::Relaxed) {
            self.tiles.renew_older_than(TILES_KEPT as u64);
        }
        let by = colour_by(&self.shared);
        if std::mem::replace(&mut self.colour_by, by) != by {
            self.tiles.renew(&mesh);
        }
        let now = self.clock.now();
        self.tiles.renew_settled(now);
        let Self { tiles, port, .. } = self;
        // tiles wait until there is a viewer
        let is_seen = self.shared.viewers.load(Ordering::Relaxed) > 0;
        let most = match (is_last, is_seen) {
            (_, false) => 0,
            (true, true) => usize::MAX,
            (false, true) => TILES_AHEAD.saturating_sub(port.tiles_waiting()),
        };
        tiles.take(most, now, &mesh, by, |tile| {
            port.publish(Publication::Tile(tile))
        });
        let waiting = if is_seen { self.tiles.waiting() } else { 0 };
        self.shared.tiles_waiting.store(waiting, Ordering::Relaxed);
        waiting > 0 || self.whole.is_some() || self.asked_whole
    }
}

/// Colouring by the parameter of this name.
pub(in crate::node) fn colour_by(shared: &SharedNodeState) -> ColourBy {
    match shared.parameters().string("colour_by") {
        "mismatch" => ColourBy::Mismatch,
        _ => ColourBy::Touched,
    }
}
