//! What goes out waits here until a thread of ours has written it. When the room is not enough, the view gives way first.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use ros2_client::{Publisher, WriteError};

use super::Shared;
use super::topics::{MeshWriters, UrgentWriters};
use crate::ros::messages::{Marker, MeshPatch, Message};
use crate::ros::port::Publication;

/// Urgent messages that wait at most: 0.4 s of mismatches at 10 kHz.
const MOST_URGENT: usize = 4096;
/// Changes of the mesh that wait at most; a follower sees the gap and asks for the whole.
const MOST_PATCHES: usize = 4096;
/// Tiles that wait at most, each once: more than the depth of the topic.
const MOST_TILES: usize = 8192;

/// Answers a call.
pub(super) type Answer = Box<dyn FnOnce() + Send>;

enum Urgent {
    Publication(Box<Publication>),
    Answer(Answer),
}

/// Of two waiting tiles with the same number the later one is enough.
type TileKey = (String, i32);

#[derive(Default)]
struct Mesh {
    patches: VecDeque<MeshPatch>,
    tiles: BTreeMap<TileKey, Marker>,
    order: VecDeque<TileKey>,
}

enum MeshMessage {
    Patch(MeshPatch),
    Tile(Marker),
}

/// A queue that one thread waits for.
#[derive(Default)]
struct Waiting<T> {
    inner: Mutex<(T, bool)>,
    more: Condvar,
}

impl<T> Waiting<T> {
    fn lock(&self) -> MutexGuard<'_, (T, bool)> {
        // no code of ours panics while it holds it
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut T)) {
        change(&mut self.lock().0);
        self.more.notify_one();
    }

    /// The next that `take` finds; `None` when it is closed and nothing is left.
    fn next<N>(&self, take: impl Fn(&mut T) -> Option<N>) -> Option<N> {
        let mut inner = self.lock();
        loop {
            if let Some(next) = take(&mut inner.0) {
                return Some(next);
            }
            if inner.1 {
                return None;
            }
            inner = self.more.wait(inner).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn close(&self) {
        self.lock().1 = true;
        self.more.notify_all();
    }

    fn is_closed(&self) -> bool {
        self.lock().1
    }
}

/// All that waits to be sent.
#[derive(Default)]
pub(super) struct Outgoing {
    urgent: Waiting<VecDeque<Urgent>>,
    mesh: Waiting<Mesh>,
    unsent_tiles: AtomicU64,
    unsent_others: AtomicU64,
}

impl Outgoing {
    pub fn publish(&self, publication: Publication) {
        match publication {
            Publication::Tile(tile) => self.mesh.change(|mesh| self.add_tile(mesh, tile)),
            Publication::MeshPatch(patch) => self.mesh.change(|mesh| {
                if mesh.patches.len() < MOST_PATCHES {
                    mesh.patches.push_back(patch);
                } else {
                    count(&self.unsent_others);
                }
            }),
            other => self.push(Urgent::Publication(Box::new(other))),
        }
    }

    pub fn answer(&self, answer: Answer) {
        self.push(Urgent::Answer(answer));
    }

    pub fn close(&self) {
        self.urgent.close();
        self.mesh.close();
    }

    /// Tiles, others.
    pub fn unsent(&self) -> [u64; 2] {
        [self.unsent_tiles.load(Ordering::Relaxed), self.unsent_others.load(Ordering::Relaxed)]
    }

    fn push(&self, urgent: Urgent) {
        self.urgent.change(|queue| {
            if queue.len() < MOST_URGENT {
                queue.push_back(urgent);
            } else {
                count(&self.unsent_others);
            }
        });
    }

    fn add_tile(&self, mesh: &mut Mesh, tile: Marker) {
        if tile.action == Marker::DELETEALL {
            mesh.tiles.clear();
            mesh.order.clear();
        }
        let key = (tile.ns.clone(), tile.id);
        if mesh.tiles.insert(key.clone(), tile).is_none() {
            mesh.order.push_back(key);
        }
        if mesh.order.len() > MOST_TILES
            && let Some(oldest) = mesh.order.pop_front()
        {
            mesh.tiles.remove(&oldest);
            count(&self.unsent_tiles);
        }
    }

    /// Sends until it is closed and empty.
    pub fn send_urgent(&self, writers: &UrgentWriters) {
        while let Some(next) = self.urgent.next(VecDeque::pop_front) {
            match next {
                Urgent::Answer(answer) => answer(),
                Urgent::Publication(publication) => self.write_urgent(writers, *publication),
            }
        }
    }

    fn write_urgent(&self, writers: &UrgentWriters, publication: Publication) {
        let is_lost = match publication {
            Publication::Features(message) => self.write(&writers.features, message).is_some(),
            Publication::FeatureMarkers(message) => self.write(&writers.feature_markers, message).is_some(),
            Publication::Tip(message) => self.write(&writers.tip, message).is_some(),
            Publication::Path(message) => self.write(&writers.path, message).is_some(),
            Publication::Mismatch(message) => self.write(&writers.mismatch, message).is_some(),
            Publication::Diagnostics(message) => self.write(&writers.diagnostics, message).is_some(),
            // they have a queue of their own
            Publication::Tile(_) | Publication::MeshPatch(_) => false,
        };
        if is_lost {
            count(&self.unsent_others);
        }
    }

    /// Sends until it is closed; changes of the mesh before tiles.
    pub fn send_mesh(&self, writers: &MeshWriters) {
        let next = |mesh: &mut Mesh| match mesh.patches.pop_front() {
            Some(patch) => Some(MeshMessage::Patch(patch)),
            None => mesh.tiles.remove(&mesh.order.pop_front()?).map(MeshMessage::Tile),
        };
        while let Some(message) = self.mesh.next(next) {
            let back = match message {
                MeshMessage::Patch(patch) => self.write(&writers.patches, patch).map(MeshMessage::Patch),
                MeshMessage::Tile(tile) => self.write(&writers.tiles, tile).map(MeshMessage::Tile),
            };
            match back {
                // who leaves does not wait for who listens slowly
                Some(_) if self.mesh.is_closed() => return,
                Some(message) => self.put_back(message),
                None => {}
            }
        }
    }

    /// Somebody listens too slowly: it is tried again, unless there is a newer one.
    fn put_back(&self, message: MeshMessage) {
        self.mesh.change(|mesh| match message {
            MeshMessage::Patch(patch) => mesh.patches.push_front(patch),
            MeshMessage::Tile(tile) => {
                let key = (tile.ns.clone(), tile.id);
                if !mesh.tiles.contains_key(&key) {
                    mesh.order.push_front(key.clone());
                    mesh.tiles.insert(key, tile);
                }
            }
        });
    }

    /// What there was no room for comes back.
    fn write<M: Message>(&self, publisher: &Publisher<M>, message: M) -> Option<M> {
        match publisher.publish(message) {
            Ok(()) => None,
            Err(WriteError::WouldBlock { data }) => Some(data),
            Err(error) => {
                tracing::warn!(topic_type = M::TYPE_NAME, %error, "a message is not sent");
                count(&self.unsent_others);
                None
            }
        }
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// A thread that sends.
pub(super) fn spawn(
    name: &str,
    shared: &Arc<Shared>,
    send: impl FnOnce(&Shared) + Send + 'static,
) -> std::io::Result<JoinHandle<()>> {
    let shared = shared.clone();
    Builder::new().name(name.to_owned()).spawn(move || send(&shared))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(id: i32, action: i32) -> Marker {
        Marker { ns: "mesh".into(), id, action, ..Marker::default() }
    }

    fn waiting(outgoing: &Outgoing) -> Vec<i32> {
        outgoing.mesh.lock().0.order.iter().map(|(_, id)| *id).collect()
    }

    #[test]
    fn a_newer_tile_takes_the_place_of_one_that_waits() {
        let outgoing = Outgoing::default();
        for (id, action) in [(1, Marker::ADD), (2, Marker::ADD), (1, Marker::DELETE)] {
            outgoing.publish(Publication::Tile(tile(id, action)));
        }
        assert_eq!(waiting(&outgoing), [1, 2]);
        assert_eq!(outgoing.mesh.lock().0.tiles[&("mesh".to_owned(), 1)].action, Marker::DELETE);
    }

    #[test]
    fn deleting_all_makes_what_waits_needless() {
        let outgoing = Outgoing::default();
        (0..9).for_each(|id| outgoing.publish(Publication::Tile(tile(id, Marker::ADD))));
        outgoing.publish(Publication::Tile(tile(0, Marker::DELETEALL)));
        outgoing.publish(Publication::Tile(tile(5, Marker::ADD)));
        assert_eq!(waiting(&outgoing), [0, 5]);
    }

    #[test]
    fn full_queues_drop_and_count() {
        let outgoing = Outgoing::default();
        (0..MOST_TILES as i32 + 3).for_each(|id| outgoing.publish(Publication::Tile(tile(id, Marker::ADD))));
        (0..MOST_PATCHES + 2).for_each(|_| outgoing.publish(Publication::MeshPatch(MeshPatch::default())));
        (0..MOST_URGENT + 5).for_each(|_| outgoing.publish(Publication::Mismatch(Default::default())));
        assert_eq!(outgoing.unsent(), [3, 7]);
        assert_eq!(waiting(&outgoing)[0], 3, "the oldest went");
    }
}
