//! What waits to be sent, so that nobody who publishes or answers waits for the network.
//!
//! Tiles of the mesh give way first: they go when nothing else waits, and of several states of one tile the newest alone.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::ros::messages::Marker;
use crate::ros::port::Publication;

/// Messages that wait at most, beside tiles: 0.4 s of mismatches at 10 kHz; a follower of the mesh sees the gap.
const MOST: usize = 4096;
/// Tiles that wait at most, each once: more than the depth of the topic.
const MOST_TILES: usize = 8192;

/// Sends an answer.
pub(super) type Answer = Box<dyn FnOnce() + Send>;

enum Message {
    Answer(Answer),
    Publication(Box<Publication>),
}

#[derive(Default)]
struct Waiting {
    messages: VecDeque<Message>,
    tiles: BTreeMap<(String, i32), Marker>,
    order: VecDeque<(String, i32)>,
    is_closed: bool,
}

impl Waiting {
    fn next(&mut self) -> Option<Message> {
        if let Some(message) = self.messages.pop_front() {
            return Some(message);
        }
        let tile = self.tiles.remove(&self.order.pop_front()?)?;
        Some(Message::Publication(Box::new(Publication::Tile(tile))))
    }
}

/// Messages on their way, which one thread sends.
#[derive(Default)]
pub(super) struct Outbox {
    waiting: Mutex<Waiting>,
    more: Condvar,
    unsent_tiles: AtomicU64,
    unsent_others: AtomicU64,
}

impl Outbox {
    /// Puts a publication in.
    pub(super) fn put(&self, publication: Publication) {
        match publication {
            Publication::Tile(tile) => self.put_tile(tile),
            other => self.put_message(Message::Publication(Box::new(other))),
        }
    }

    /// Puts an answer in.
    pub(super) fn answer(&self, answer: Answer) {
        self.put_message(Message::Answer(answer));
    }

    /// Not sent because nobody took them fast enough, or because ROS refused them: tiles, others.
    pub(super) fn unsent(&self) -> [u64; 2] {
        [&self.unsent_tiles, &self.unsent_others].map(|count| count.load(Ordering::Relaxed))
    }

    /// Sends until it is closed and empty.
    pub(super) fn send(&self, publish: impl Fn(Publication) -> r2r::Result<()>) {
        while let Some(message) = self.take() {
            match message {
                Message::Answer(send) => send(),
                Message::Publication(publication) => {
                    let count = self.count_of(&publication);
                    if let Err(error) = publish(*publication) {
                        tracing::warn!(%error, "a message is not sent");
                        count.fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
        }
    }

    /// Has [`Self::send`] end when all is sent.
    pub(super) fn close(&self) {
        self.waiting().is_closed = true;
        self.more.notify_all();
    }

    fn count_of(&self, publication: &Publication) -> &AtomicU64 {
        if matches!(publication, Publication::Tile(_)) { &self.unsent_tiles } else { &self.unsent_others }
    }

    fn put_message(&self, message: Message) {
        let mut waiting = self.waiting();
        if waiting.messages.len() < MOST {
            waiting.messages.push_back(message);
        } else {
            self.unsent_others.fetch_add(1, Ordering::Relaxed);
        }
        drop(waiting);
        self.more.notify_one();
    }

    fn put_tile(&self, tile: Marker) {
        let mut waiting = self.waiting();
        if tile.action == Marker::DELETEALL {
            waiting.tiles.clear();
            waiting.order.clear();
        }
        let key = (tile.ns.clone(), tile.id);
        if waiting.tiles.insert(key.clone(), tile).is_none() {
            waiting.order.push_back(key);
        }
        if waiting.order.len() > MOST_TILES
            && let Some(oldest) = waiting.order.pop_front()
        {
            waiting.tiles.remove(&oldest);
            self.unsent_tiles.fetch_add(1, Ordering::Relaxed);
        }
        drop(waiting);
        self.more.notify_one();
    }

    fn take(&self) -> Option<Message> {
        let mut waiting = self.waiting();
        loop {
            if let Some(message) = waiting.next() {
                return Some(message);
            }
            if waiting.is_closed {
                return None;
            }
            waiting = self.more.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // nothing of ours panics while it holds it
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, mpsc};

    use super::*;
    use crate::ros::messages::{HapticMismatch, MeshPatch};

    fn tile(id: i32, action: i32, x: f64) -> Publication {
        let mut marker = Marker { id, action, ..Marker::default() };
        marker.pose.position.x = x;
        Publication::Tile(marker)
    }

    fn patch(version: u64) -> Publication {
        Publication::MeshPatch(MeshPatch { version, ..MeshPatch::default() })
    }

    fn name(publication: &Publication) -> String {
        match publication {
            Publication::Tile(tile) if tile.action == Marker::DELETEALL => "all go".to_owned(),
            Publication::Tile(tile) => format!("tile {} at {}", tile.id, tile.pose.position.x),
            Publication::MeshPatch(patch) => format!("patch {}", patch.version),
            Publication::Mismatch(mismatch) => format!("mismatch {}", mismatch.face),
            other => panic!("{other:?}"),
        }
    }

    /// What goes out, in its order.
    fn sent(outbox: &Outbox) -> Vec<String> {
        let sent = Mutex::new(Vec::new());
        outbox.close();
        outbox.send(|publication| {
            sent.lock().unwrap().push(name(&publication));
            Ok(())
        });
        sent.into_inner().unwrap()
    }

    #[test]
    fn tiles_wait_for_the_others_and_only_their_newest_state_goes() {
        let outbox = Outbox::default();
        for publication in [tile(7, 0, 1.0), tile(3, 0, 2.0), tile(7, 0, 3.0), patch(1), patch(2)] {
            outbox.put(publication);
        }
        assert_eq!(sent(&outbox), ["patch 1", "patch 2", "tile 7 at 3", "tile 3 at 2"]);
    }

    #[test]
    fn deleting_all_makes_what_waits_needless() {
        let outbox = Outbox::default();
        for publication in [tile(1, Marker::ADD, 1.0), tile(0, Marker::DELETEALL, 0.0), tile(2, Marker::ADD, 2.0)] {
            outbox.put(publication);
        }
        assert_eq!(sent(&outbox), ["all go", "tile 2 at 2"]);
    }

    #[test]
    fn what_there_is_no_room_for_is_counted() {
        let outbox = Outbox::default();
        (0..MOST as u32 + 3).for_each(|face| {
            outbox.put(Publication::Mismatch(HapticMismatch { face, ..HapticMismatch::default() }));
        });
        (0..MOST_TILES as i32 + 2).for_each(|id| outbox.put(tile(id, Marker::ADD, 0.0)));
        assert_eq!(outbox.unsent(), [2, 3]);
        let sent = sent(&outbox);
        assert_eq!(
            (sent.len(), sent[0].as_str(), sent[MOST].as_str()),
            (MOST + MOST_TILES, "mismatch 0", "tile 2 at 0")
        );
    }

    #[test]
    fn what_ros_refuses_is_counted_and_the_rest_goes() {
        let outbox = Outbox::default();
        [patch(1), patch(2), tile(1, Marker::ADD, 0.0)].into_iter().for_each(|publication| outbox.put(publication));
        outbox.close();
        outbox.send(|publication| match publication {
            Publication::MeshPatch(patch) if patch.version == 2 => Ok(()),
            _ => Err(r2r::Error::RCL_RET_PUBLISHER_INVALID),
        });
        assert_eq!(outbox.unsent(), [1, 1]);
    }

    #[test]
    fn the_thread_that_sends_waits_for_more_and_ends_when_it_is_closed() {
        let outbox = Arc::new(Outbox::default());
        let (told, heard) = mpsc::channel();
        let sending = std::thread::spawn({
            let outbox = outbox.clone();
            move || outbox.send(|_| Ok(()))
        });
        for number in [1, 2] {
            let told = told.clone();
            outbox.answer(Box::new(move || told.send(number).unwrap()));
            assert_eq!(heard.recv(), Ok(number));
        }
        outbox.close();
        sending.join().unwrap();
    }
}
