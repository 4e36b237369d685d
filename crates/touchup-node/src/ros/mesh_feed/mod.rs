//! The feed of the mesh: one version for all followers, and a cursor for each of them.
//!
//! One writer applies the changes from the journal of the mesh, as blocks over the scan. Readers
//! hold a version that no longer changes; of what they still hold at the next change, the writer
//! copies the blocks that change.
//! Followers take messages with their missing vertices and faces at their own pace: a backlog is a
//! set of ids, bounded by the mesh, so a slow follower skips versions and delays nobody.

mod blocks;
mod cursor;
mod edits;
mod version;

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};

pub use self::cursor::MeshCursor;
pub use self::edits::{Edits, FACES_OF_A_TILE, VertexUncertainty};
pub use self::version::MeshVersion;
use crate::ros::locked;
use crate::ros::messages::MeshPatch;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_session::clock::{Clock, WorkGuard};

/// A state of the mesh: number of the session from 0 on, and version in it.
type Revision = (u64, u64);

/// The mesh, and the cursors of its followers.
#[derive(Debug)]
pub struct MeshFeed {
    clock: Clock,
    state: Mutex<FeedState>,
    /// last complete state on its way to the writer, or with it
    announced: Mutex<Revision>,
    version: AtomicU64,
    shape_version: AtomicU64,
    follower_count: AtomicUsize,
}

#[derive(Debug)]
struct FeedState {
    mesh: Arc<MeshVersion>,
    session: u64,
    /// a whole change is included: before that, ids may not fit each other
    is_complete: bool,
    is_closed: bool,
    /// readers waiting for this complete state or a later one
    waiting: Vec<(Revision, SyncSender<Snapshot>)>,
    /// by number of the follower
    cursors: BTreeMap<u64, MeshCursor>,
    /// number of followers up to now
    followers: u64,
}

impl MeshFeed {
    /// The scan before any touch, without a session yet.
    ///
    /// - `frame`: of its positions.
    /// - `scan_sigma`: standard deviation of the scan, m, if known.
    pub fn new(
        clock: Clock,
        scan: Arc<(TriMesh, FaceTree)>,
        frame: &str,
        scan_sigma: Option<f64>,
    ) -> Self {
        let scan_variance = scan_sigma.map_or(f32::NAN, |sigma| (sigma * sigma) as f32);
        let state = FeedState {
            mesh: Arc::new(MeshVersion::of(scan, frame, "", scan_variance)),
            session: 0,
            is_complete: true,
            is_closed: false,
            waiting: Vec::new(),
            cursors: BTreeMap::new(),
            followers: 0,
        };
        Self {
            clock,
            state: Mutex::new(state),
            announced: Mutex::new((0, 1)),
            version: AtomicU64::new(1),
            shape_version: AtomicU64::new(1),
            follower_count: AtomicUsize::new(0),
        }
    }

    /// Names the first session.
    pub fn name_session(&self, name: &str) {
        name.clone_into(&mut Arc::make_mut(&mut locked(&self.state).mesh).session);
    }

    /// Announces changes up to this version on their way to the writer: later readers get it or a
    /// newer one.
    pub fn announce(&self, version: u64) {
        locked(&self.announced).1 = version;
    }

    /// Announces another session on its way to the writer.
    pub fn announce_session(&self) {
        let mut announced = locked(&self.announced);
        *announced = (announced.0 + 1, 1);
    }

    /// Applies changes.
    pub fn apply(&self, edits: &Edits) {
        let mut state = locked(&self.state);
        let changed = Arc::make_mut(&mut state.mesh).apply(edits);
        for cursor in state.cursors.values_mut() {
            cursor.note(&changed, &edits.faces);
        }
        state.is_complete = edits.is_complete;
        self.answer(&mut state);
    }

    /// Applies the uncertainty of vertices, as the next version if variances change.
    pub fn apply_uncertainty(&self, version: u64, uncertainty: VertexUncertainty) {
        let mut state = locked(&self.state);
        let changed = Arc::make_mut(&mut state.mesh).apply_uncertainty(version, uncertainty);
        for cursor in state.cursors.values_mut() {
            cursor.note(&changed, &[]);
        }
        self.answer(&mut state);
    }

    /// Switches to another session, which begins with the scan. Followers get its whole state.
    pub fn begin_session(&self, name: &str) {
        let mesh = self.now().0.of_session(name);
        let mut state = locked(&self.state);
        for cursor in state.cursors.values_mut() {
            *cursor = MeshCursor::default();
        }
        state.mesh = Arc::new(mesh);
        (state.session, state.is_complete) = (state.session + 1, true);
        self.answer(&mut state);
    }

    /// Ends the changes: readers no longer wait.
    pub fn close(&self) {
        let mut state = locked(&self.state);
        state.is_closed = true;
        state.waiting.clear();
    }

    /// The current version.
    pub fn version(&self) -> u64 {
        self.version.load(Ordering::Relaxed)
    }

    /// The version of the current shape: later ones only change variances.
    pub fn shape_version(&self) -> u64 {
        self.shape_version.load(Ordering::Relaxed)
    }

    /// Number of followers.
    pub fn follower_count(&self) -> usize {
        self.follower_count.load(Ordering::Relaxed)
    }

    /// The current state, and whether it is complete.
    pub fn now(&self) -> (Arc<MeshVersion>, bool) {
        let state = locked(&self.state);
        (Arc::clone(&state.mesh), state.is_complete)
    }

    /// Name of the session.
    pub fn session(&self) -> String {
        locked(&self.state).mesh.session.clone()
    }

    /// The state once it is complete and includes all announced changes: mostly at once. No result
    /// after [`Self::close`].
    pub fn complete(&self) -> Receiver<Snapshot> {
        let wanted = *locked(&self.announced);
        let (reply, snapshot) = sync_channel(1);
        let mut state = locked(&self.state);
        state.waiting.push((wanted, reply));
        self.answer(&mut state);
        if state.is_closed {
            state.waiting.clear();
        }
        snapshot
    }

    /// A new follower without any data.
    pub fn follow(self: &Arc<Self>) -> MeshFollower {
        self.follow_by(|_| MeshCursor::default())
    }

    /// A new follower that has the current state.
    pub fn follow_from_now(self: &Arc<Self>) -> MeshFollower {
        self.follow_by(MeshCursor::at)
    }

    fn follow_by(self: &Arc<Self>, cursor: fn(&MeshVersion) -> MeshCursor) -> MeshFollower {
        let mut state = locked(&self.state);
        state.followers += 1;
        let (number, cursor) = (state.followers, cursor(&state.mesh));
        state.cursors.insert(number, cursor);
        self.follower_count
            .store(state.cursors.len(), Ordering::Relaxed);
        MeshFollower {
            feed: Arc::clone(self),
            number,
        }
    }

    fn answer(&self, state: &mut FeedState) {
        self.version.store(state.mesh.version, Ordering::Relaxed);
        self.shape_version
            .store(state.mesh.shape_version, Ordering::Relaxed);
        if !state.is_complete {
            return;
        }
        let (revision, mesh) = ((state.session, state.mesh.version), &state.mesh);
        state.waiting.retain(|(wanted, reply)| {
            let is_there = *wanted <= revision;
            if is_there {
                // the receiver may be gone
                drop(reply.try_send(Snapshot {
                    mesh: Arc::clone(mesh),
                    _working: self.clock.begin_work(),
                }));
            }
            !is_there
        });
    }
}

/// One follower of the feed; it leaves on drop.
#[derive(Debug)]
pub struct MeshFollower {
    feed: Arc<MeshFeed>,
    number: u64,
}

impl MeshFollower {
    /// The next message to the follower, as [`MeshCursor::next_part`]; none while the mesh is
    /// incomplete.
    pub fn next_part(&self, most: usize) -> Option<MeshPatch> {
        let FeedState {
            mesh,
            is_complete: true,
            cursors,
            ..
        } = &mut *locked(&self.feed.state)
        else {
            return None;
        };
        let cursor = cursors.get_mut(&self.number)?;
        cursor.next_part(mesh, mesh.version, most)
    }

    /// The parts of the whole state that the follower has, which must be the current one.
    pub fn whole(&self, most: usize) -> impl Iterator<Item = MeshPatch> + Send + 'static + use<> {
        let state = locked(&self.feed.state);
        let mesh = Arc::clone(&state.mesh);
        let version = state
            .cursors
            .get(&self.number)
            .map_or(mesh.version, MeshCursor::version);
        let mut cursor = MeshCursor::default();
        std::iter::from_fn(move || cursor.next_part(&mesh, version, most))
    }
}

impl Drop for MeshFollower {
    fn drop(&mut self) {
        let cursors = &mut locked(&self.feed.state).cursors;
        cursors.remove(&self.number);
        self.feed
            .follower_count
            .store(cursors.len(), Ordering::Relaxed);
    }
}

/// A state of the mesh that no longer changes. A manual clock waits for its receiver.
#[derive(Debug)]
pub struct Snapshot {
    mesh: Arc<MeshVersion>,
    _working: WorkGuard,
}

impl Deref for Snapshot {
    type Target = MeshVersion;

    fn deref(&self) -> &MeshVersion {
        &self.mesh
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::cursor::tests::PatchReader;
    use super::version::tests::{scan, strip};
    use super::*;
    use touchup_method::reconstruct::Support;

    fn feed() -> Arc<MeshFeed> {
        let feed = MeshFeed::new(Clock::system(), scan(strip(10)), "object", None);
        Arc::new(feed)
    }

    fn version(version: u64, is_complete: bool) -> Edits {
        let mut edits = Edits::default();
        (edits.version, edits.is_complete) = (version, is_complete);
        edits
    }

    #[test]
    fn who_reads_waits_for_what_was_announced_and_for_a_complete_state() {
        let feed = feed();
        let read = |readers: &[Receiver<Snapshot>]| -> Vec<Option<u64>> {
            readers
                .iter()
                .map(|reader| reader.try_recv().ok().map(|snapshot| snapshot.version))
                .collect()
        };
        assert_eq!(read(&[feed.complete()]), [Some(1)]);
        feed.announce(2);
        let mut readers = vec![feed.complete()];
        feed.announce(3);
        readers.push(feed.complete());
        assert_eq!(read(&readers), [None, None]);
        feed.apply(&version(2, true));
        assert_eq!(read(&readers), [Some(2), None]);
        feed.apply(&version(3, false));
        assert_eq!((read(&readers), feed.version()), (vec![None, None], 2));
        feed.apply(&version(3, true));
        assert_eq!((read(&readers), feed.version()), (vec![None, Some(3)], 3));
        // a session starts its own versions
        feed.announce_session();
        let of_the_next = [feed.complete()];
        assert_eq!(read(&of_the_next), [None]);
        feed.begin_session("next");
        assert_eq!((read(&of_the_next), feed.version()), (vec![Some(1)], 1));
    }

    #[test]
    fn a_variance_is_of_the_next_version_and_goes_when_its_vertex_moves() {
        let feed = feed();
        let touched = |x: f64| Some((Point3::new(x, 8.0, 9.0), Support::Touched));
        let mut moved = version(2, true);
        moved
            .vertices
            .extend([(0, touched(1.0)), (1, touched(2.0)), (500, touched(3.0))]);
        feed.apply(&moved);
        let numbers: Vec<u32> = feed.now().0.touched().map(|(vertex, _)| vertex).collect();
        assert_eq!(numbers, [0, 1], "no face uses the last");
        feed.announce(3);
        let waiting = feed.complete();
        let follower = feed.follow_from_now();
        let known = |outliers: &[u32]| VertexUncertainty {
            variances: vec![(0, 1e-10), (1, 4e-10), (500, 1e-10)],
            outliers: outliers.to_vec(),
        };
        feed.apply_uncertainty(3, known(&[1]));
        let sent = follower.next_part(1000).unwrap();
        assert_eq!(
            (sent.vertices, waiting.try_recv().unwrap().version),
            (vec![0, 1], 3)
        );
        assert_eq!((feed.version(), feed.shape_version()), (3, 2));
        assert_eq!(*feed.now().0.outliers, [1]);
        let mut again = version(4, true);
        again.vertices.push((1, touched(2.5)));
        feed.apply(&again);
        let (mesh, _) = feed.now();
        assert_eq!(
            (
                mesh.variance(0),
                mesh.variance(1).is_nan(),
                mesh.variance(7).is_nan()
            ),
            (1e-10, true, true)
        );
        assert_eq!(feed.shape_version(), 4);
    }

    #[test]
    fn what_somebody_reads_stays_as_it_was() {
        let feed = feed();
        let before = feed.complete().recv().unwrap();
        let mut moved = version(2, true);
        moved
            .vertices
            .push((0, Some((Point3::new(7.0, 8.0, 9.0), Support::Touched))));
        feed.apply(&moved);
        let after = feed.complete().recv().unwrap();
        assert_eq!(
            (before.version, before.vertex(0)),
            (1, Some((Point3::origin(), Support::Scan)))
        );
        assert_eq!(
            (after.version, after.vertex(0)),
            (2, Some((Point3::new(7.0, 8.0, 9.0), Support::Touched)))
        );
    }

    #[test]
    fn nobody_waits_for_what_no_longer_comes() {
        let feed = feed();
        feed.announce(2);
        let waiting = feed.complete();
        feed.close();
        assert!(waiting.recv().is_err() && feed.complete().recv().is_err());
        feed.announce(1);
        assert!(feed.complete().recv().is_ok(), "what is there can be read");
    }

    fn moved(version: u64, vertex: u32) -> Edits {
        let mut edits = self::version(version, true);
        let place = Point3::new(5.0, 5.0, 5.0);
        edits
            .vertices
            .push((vertex, Some((place, Support::Touched))));
        edits
    }

    /// Takes all of a follower's messages; returns their number.
    fn catch_up(follower: &MeshFollower, reader: &mut PatchReader) -> usize {
        std::iter::from_fn(|| follower.next_part(1000))
            .inspect(|patch| reader.take(patch))
            .count()
    }

    #[test]
    fn a_follower_has_one_version_and_nothing_of_an_incomplete_one() {
        let (feed, mut reader) = (feed(), PatchReader::default());
        let follower = feed.follow();
        assert_eq!(catch_up(&follower, &mut reader), 1);
        let mut part = moved(2, 0);
        part.is_complete = false;
        feed.apply(&part);
        assert_eq!(catch_up(&follower, &mut reader), 0);
        feed.apply(&moved(2, 1));
        assert_eq!(catch_up(&follower, &mut reader), 1);
        assert_eq!(
            (reader.vertices[&0], reader.vertices[&1]),
            ([5.0; 3], [5.0; 3])
        );
        assert_eq!((reader.version, feed.shape_version()), (2, 2));
    }

    #[test]
    fn another_session_comes_as_its_whole_state() {
        let (feed, mut reader) = (feed(), PatchReader::default());
        let follower = feed.follow();
        catch_up(&follower, &mut reader);
        feed.apply(&moved(2, 0));
        feed.begin_session("next");
        assert_eq!(
            (catch_up(&follower, &mut reader), feed.session()),
            (1, "next".to_owned())
        );
        assert_eq!((reader.session.as_str(), reader.version), ("next", 1));
        assert_eq!(reader.vertices[&0], [0.0; 3]);
    }

    #[test]
    fn the_whole_state_is_that_of_the_followers_and_changes_no_other() {
        let (feed, [mut first, mut second]) = (feed(), [(); 2].map(|()| PatchReader::default()));
        let [one, other] = [(); 2].map(|()| feed.follow());
        assert_eq!(catch_up(&one, &mut first), 1);
        feed.apply(&moved(2, 0));
        assert_eq!(catch_up(&one, &mut first), 1);
        let whole = one.whole(7);
        feed.apply(&moved(3, 1));
        whole.for_each(|patch| second.take(&patch));
        assert_eq!(first, second);
        for (follower, reader) in [(&one, &mut first), (&other, &mut second)] {
            assert_eq!(catch_up(follower, reader), 1);
        }
        assert_eq!((first.version, &first), (3, &second));
    }

    #[test]
    fn a_follower_that_left_is_noted_no_more() {
        let feed = feed();
        let followers = [feed.follow(), feed.follow_from_now()];
        assert_eq!(feed.follower_count(), 2);
        drop(followers);
        assert_eq!(feed.follower_count(), 0);
        assert!(locked(&feed.state).cursors.is_empty());
    }
}
