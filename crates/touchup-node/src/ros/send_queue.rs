//! Queue of outgoing messages, so that publishers and answers do not wait for the network.
//!
//! A port has two: one for small and urgent messages, including answers, one for the mesh, which
//! slow listeners may delay. Tiles of the mesh give way first: they go when nothing else waits.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

use crate::ros::locked;
use crate::ros::port::Publication;

/// Maximum number of waiting messages besides tiles: 0.4 s of mismatches at 10 kHz; a follower of
/// the mesh sees the gap.
const MOST: usize = 4096;
/// Maximum number of waiting tiles: those of 4 million faces, as at the end all of them wait here.
const MOST_TILES: usize = 8192;

/// Sends an answer.
pub(super) type AnswerSender = Box<dyn FnOnce() + Send>;

/// Outcome of sending a message.
pub(super) enum SendOutcome<M> {
    /// in flight
    Done,
    /// dropped and counted
    Refused,
    /// returned for later, as a listener is slow
    Later(M),
}

impl<M> SendOutcome<M> {
    /// Converts the message back to its publication.
    pub fn map<T>(self, publication: impl FnOnce(M) -> T) -> SendOutcome<T> {
        match self {
            Self::Done => SendOutcome::Done,
            Self::Refused => SendOutcome::Refused,
            Self::Later(message) => SendOutcome::Later(publication(message)),
        }
    }
}

enum OutgoingMessage {
    Answer(AnswerSender),
    Publication(Box<Publication>),
}

#[derive(Default)]
struct QueuedMessages {
    messages: VecDeque<OutgoingMessage>,
    tiles: VecDeque<Box<Publication>>,
    is_closed: bool,
}

impl QueuedMessages {
    fn next(&mut self) -> Option<OutgoingMessage> {
        self.messages
            .pop_front()
            .or_else(|| self.tiles.pop_front().map(OutgoingMessage::Publication))
    }

    fn put_back(&mut self, publication: Box<Publication>) {
        match *publication {
            Publication::Tile(_) => self.tiles.push_front(publication),
            _ => self
                .messages
                .push_front(OutgoingMessage::Publication(publication)),
        }
    }
}

/// Outgoing messages, sent by one thread.
#[derive(Default)]
pub(super) struct SendQueue {
    waiting: Mutex<QueuedMessages>,
    more: Condvar,
    /// tiles, others
    unsent: [AtomicU64; 2],
}

impl SendQueue {
    /// Puts a publication in.
    pub fn put(&self, publication: Publication) {
        self.put_in(OutgoingMessage::Publication(Box::new(publication)));
    }

    /// Puts an answer in.
    pub fn answer(&self, answer: AnswerSender) {
        self.put_in(OutgoingMessage::Answer(answer));
    }

    /// Number dropped for slow listeners, or refused by ROS: tiles, others.
    pub fn unsent(&self) -> [u64; 2] {
        self.unsent
            .each_ref()
            .map(|count| count.load(Ordering::Relaxed))
    }

    /// Number of waiting tiles.
    pub fn tiles_waiting(&self) -> usize {
        locked(&self.waiting).tiles.len()
    }

    /// Sends until it is closed and empty, or closed with a slow listener.
    pub fn send(&self, publish: impl Fn(Publication) -> SendOutcome<Publication>) {
        while let Some(message) = self.take() {
            let publication = match message {
                OutgoingMessage::Answer(send) => {
                    send();
                    continue;
                }
                OutgoingMessage::Publication(publication) => *publication,
            };
            let is_tile = matches!(publication, Publication::Tile(_));
            match publish(publication) {
                SendOutcome::Done => {}
                SendOutcome::Refused => self.lose(is_tile),
                SendOutcome::Later(publication) => {
                    let mut waiting = locked(&self.waiting);
                    waiting.put_back(Box::new(publication));
                    // a leaving port does not wait for slow listeners
                    if waiting.is_closed {
                        return;
                    }
                }
            }
        }
    }

    /// Has [`Self::send`] end once everything is sent.
    pub fn close(&self) {
        locked(&self.waiting).is_closed = true;
        self.more.notify_all();
    }

    fn lose(&self, is_tile: bool) {
        self.unsent[usize::from(!is_tile)].fetch_add(1, Ordering::Relaxed);
    }

    fn put_in(&self, message: OutgoingMessage) {
        let mut waiting = locked(&self.waiting);
        match message {
            OutgoingMessage::Publication(tile) if matches!(*tile, Publication::Tile(_)) => {
                waiting.tiles.push_back(tile);
                if waiting.tiles.len() > MOST_TILES {
                    waiting.tiles.pop_front();
                    self.lose(true);
                }
            }
            message if waiting.messages.len() < MOST => waiting.messages.push_back(message),
            _ => self.lose(false),
        }
        drop(waiting);
        self.more.notify_one();
    }

    fn take(&self) -> Option<OutgoingMessage> {
        let is_idle = |waiting: &mut QueuedMessages| {
            waiting.messages.is_empty() && waiting.tiles.is_empty() && !waiting.is_closed
        };
        let waiting = self.more.wait_while(locked(&self.waiting), is_idle);
        waiting.unwrap_or_else(PoisonError::into_inner).next()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, mpsc};

    use super::*;
    use crate::ros::messages::{HapticMismatch, Marker, MeshPatch};

    fn tile(id: i32, x: f64) -> Publication {
        let mut marker = Marker {
            id,
            ..Marker::default()
        };
        marker.pose.position.x = x;
        Publication::Tile(marker)
    }

    fn patch(version: u64) -> Publication {
        Publication::MeshPatch(MeshPatch {
            version,
            ..MeshPatch::default()
        })
    }

    fn name(publication: &Publication) -> String {
        match publication {
            Publication::Tile(tile) => format!("tile {} at {}", tile.id, tile.pose.position.x),
            Publication::MeshPatch(patch) => format!("patch {}", patch.version),
            Publication::Mismatch(mismatch) => format!("mismatch {}", mismatch.face),
            other => panic!("{other:?}"),
        }
    }

    /// Sent publications in order.
    fn sent(queue: &SendQueue) -> Vec<String> {
        let sent = Mutex::new(Vec::new());
        queue.close();
        queue.send(|publication| {
            sent.lock().unwrap().push(name(&publication));
            SendOutcome::Done
        });
        sent.into_inner().unwrap()
    }

    #[test]
    fn tiles_wait_for_the_others() {
        let queue = SendQueue::default();
        for publication in [tile(7, 1.0), tile(3, 2.0), patch(1), tile(7, 3.0), patch(2)] {
            queue.put(publication);
        }
        assert_eq!(queue.tiles_waiting(), 3);
        assert_eq!(
            sent(&queue),
            [
                "patch 1",
                "patch 2",
                "tile 7 at 1",
                "tile 3 at 2",
                "tile 7 at 3"
            ]
        );
    }

    #[test]
    fn what_is_to_be_sent_later_goes_before_what_came_after_it() {
        let queue = SendQueue::default();
        [patch(1), patch(2), tile(1, 0.0), tile(2, 0.0)]
            .into_iter()
            .for_each(|publication| queue.put(publication));
        let tried = Mutex::new(Vec::new());
        let reaches_the_end = |publication: &Publication| matches!(publication, Publication::Tile(tile) if tile.id == 2);
        queue.send(|publication| {
            let mut tried = tried.lock().unwrap();
            tried.push(name(&publication));
            if reaches_the_end(&publication) {
                queue.close();
            }
            // every second attempt succeeds
            if tried.len() % 2 == 1 {
                SendOutcome::Later(publication)
            } else {
                SendOutcome::Done
            }
        });
        let tried = tried.into_inner().unwrap();
        let both = |name: &'static str| [name, name];
        let expected = [both("patch 1"), both("patch 2"), both("tile 1 at 0")].concat();
        assert_eq!(tried[..6], expected);
        assert_eq!(
            tried[6..],
            ["tile 2 at 0"],
            "it was closed, and somebody listens too slowly"
        );
        assert_eq!(queue.unsent(), [0, 0]);
    }

    #[test]
    fn what_there_is_no_room_for_is_counted() {
        let queue = SendQueue::default();
        (0..MOST as u32 + 3).for_each(|face| {
            queue.put(Publication::Mismatch(HapticMismatch {
                face,
                ..HapticMismatch::default()
            }));
        });
        (0..MOST_TILES as i32 + 2).for_each(|id| queue.put(tile(id, 0.0)));
        assert_eq!(queue.unsent(), [2, 3]);
        let sent = sent(&queue);
        assert_eq!(
            (sent.len(), sent[0].as_str(), sent[MOST].as_str()),
            (MOST + MOST_TILES, "mismatch 0", "tile 2 at 0")
        );
    }

    #[test]
    fn what_ros_refuses_is_counted_and_the_rest_goes() {
        let queue = SendQueue::default();
        [patch(1), patch(2), tile(1, 0.0)]
            .into_iter()
            .for_each(|publication| queue.put(publication));
        queue.close();
        queue.send(|publication| match publication {
            Publication::MeshPatch(patch) if patch.version == 2 => SendOutcome::Done,
            _ => SendOutcome::Refused,
        });
        assert_eq!(queue.unsent(), [1, 1]);
    }

    #[test]
    fn the_thread_that_sends_waits_for_more_and_ends_when_it_is_closed() {
        let queue = Arc::new(SendQueue::default());
        let (sent, heard) = mpsc::channel();
        let sending = std::thread::spawn({
            let queue = queue.clone();
            move || queue.send(|_| SendOutcome::Done)
        });
        for number in [1, 2] {
            let sent = sent.clone();
            queue.answer(Box::new(move || sent.send(number).unwrap()));
            assert_eq!(heard.recv(), Ok(number));
        }
        queue.close();
        sending.join().unwrap();
    }
}
