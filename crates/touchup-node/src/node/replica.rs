//! The replica of the mesh: plain arrays by id, written by one worker and read by all; and the
//! changes on their way to it.
//!
//! Two lists of changes circulate, each bounded. While both are on their way, changes stay in the
//! mesh's journal, whose size the mesh bounds: the view can be arbitrarily slow.

use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};

use nalgebra::Point3;

use super::variances::Variances;
use crate::ros::locked;
use touchup_geometry::mesh::{Changes, FaceId, MeshError, TriMesh, VertexId};
use touchup_method::reconstruct::Support;
use touchup_session::clock::{Clock, WorkGuard};
use touchup_session::live::{Engine, LiveError};

/// Maximum number of vertices, and of faces, per transfer: some 50 µs.
const AT_ONCE: usize = 1000;

/// Faces of a tile, by number: 1500 points are 60 kB with their colours, below the 64 kB of a
/// datagram.
pub const FACES_OF_A_TILE: u32 = 500;
/// Position of a vertex, m, in O, and its support.
pub type VertexPlace = (Point3<f64>, Support);

/// A list of changes.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    /// version of the mesh after these changes, if they complete it
    pub version: u64,
    /// whether they do: before that, ids may not fit each other
    pub is_complete: bool,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    /// position and support; `None`: removed
    pub vertices: Vec<(u32, Option<VertexPlace>)>,
    /// corners; `None`: removed
    pub faces: Vec<(u32, Option<[u32; 3]>)>,
    /// tiles to redraw
    pub tiles: Vec<u32>,
    taken: Changes,
}

impl Edits {
    /// Fills the list with changes.
    ///
    /// - `may_be_torn`: counts a state inside a change of the patch as complete.
    ///
    /// # Errors
    /// As [`Engine::take_changes`].
    pub fn fill(
        &mut self,
        engine: &mut Engine,
        scan: &TriMesh,
        version: u64,
        stamp_ns: i64,
        may_be_torn: bool,
    ) -> Result<(), LiveError> {
        let Self {
            vertices,
            faces,
            tiles,
            taken,
            ..
        } = self;
        vertices.clear();
        faces.clear();
        tiles.clear();
        taken.clear();
        let is_all = engine.take_changes(AT_ONCE, taken)?;
        let mesh = engine.mesh();
        let mut note = |face: FaceId| {
            let tile = face.0 / FACES_OF_A_TILE;
            // neighbours mostly share a tile: the list stays short
            if tiles.last() != Some(&tile) {
                tiles.push(tile);
            }
        };
        for &vertex in &taken.vertices {
            let place = mesh.has_vertex(vertex).then(|| {
                mesh.star(vertex).iter().for_each(|&face| note(face));
                (mesh.position(vertex), engine.support(scan, vertex))
            });
            vertices.push((vertex.0, place));
        }
        for &face in &taken.faces {
            note(face);
            let corners = mesh
                .has_face(face)
                .then(|| mesh.corners(face).map(|VertexId(corner)| corner));
            faces.push((face.0, corners));
        }
        self.is_complete = is_all && (may_be_torn || engine.is_whole());
        (self.version, self.stamp_ns) = (version, stamp_ns);
        Ok(())
    }

    /// Whether there are no changes.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty() && self.faces.is_empty()
    }
}

/// Corners of a missing face.
const NO_FACE: [u32; 3] = [u32::MAX; 3];

/// The mesh at one version.
#[derive(Clone, Debug, Default)]
pub struct MeshVersion {
    /// name of the session
    pub session: String,
    /// state of the mesh, as in `MeshPatch`
    pub version: u64,
    /// version of its shape: later ones only change variances
    pub shape_version: u64,
    /// stamp of the newest sample in it, ns
    pub stamp_ns: i64,
    positions: Vec<Point3<f64>>,
    support: Vec<Option<Support>>,
    /// along the normal, m²; NaN if unknown
    variance: Vec<f32>,
    /// number of faces at each vertex: unused vertices are not shown
    uses: Vec<u32>,
    corners: Vec<[u32; 3]>,
    /// numbers of used vertices and of faces
    pub counts: [u32; 2],
}

impl MeshVersion {
    /// The scan before any touch.
    pub fn of(scan: &TriMesh, session: &str) -> Self {
        let slots = scan.vertex_slots() as u32;
        let is_there = |vertex| scan.has_vertex(VertexId(vertex)).then_some(Support::Scan);
        let mut corners = vec![NO_FACE; scan.face_slots()];
        let mut uses = vec![0; scan.vertex_slots()];
        for (face, ours) in scan.faces() {
            corners[face.0 as usize] = ours.map(|v| v.0);
            ours.iter().for_each(|v| uses[v.0 as usize] += 1);
        }
        let used = uses.iter().filter(|uses| **uses > 0).count();
        Self {
            session: session.to_owned(),
            version: 1,
            shape_version: 1,
            stamp_ns: 0,
            positions: scan.positions().to_vec(),
            support: (0..slots).map(is_there).collect(),
            variance: vec![f32::NAN; scan.vertex_slots()],
            uses,
            corners,
            counts: [used as u32, scan.face_count() as u32],
        }
    }

    /// Applies changes; returns vertices that faces use from now on, or no longer.
    pub fn apply(&mut self, edits: &Edits) -> Vec<u32> {
        for &(vertex, place) in &edits.vertices {
            self.make_room(vertex);
            let at = vertex as usize;
            self.support[at] = place.map(|(_, support)| support);
            self.variance[at] = f32::NAN;
            if let Some((position, _)) = place {
                self.positions[at] = position;
            }
        }
        let mut turned = Vec::new();
        for &(face, corners) in &edits.faces {
            let at = face as usize;
            if at >= self.corners.len() {
                self.corners.resize(at + 1, NO_FACE);
            }
            let was = std::mem::replace(&mut self.corners[at], corners.unwrap_or(NO_FACE));
            let was = (was != NO_FACE).then_some(was);
            self.counts[1] =
                self.counts[1] + u32::from(corners.is_some()) - u32::from(was.is_some());
            for vertex in corners.into_iter().flatten() {
                self.make_room(vertex);
                let uses = &mut self.uses[vertex as usize];
                *uses += 1;
                if *uses == 1 {
                    self.counts[0] += 1;
                    turned.push(vertex);
                }
            }
            for vertex in was.into_iter().flatten() {
                let uses = &mut self.uses[vertex as usize];
                *uses -= 1;
                if *uses == 0 {
                    self.counts[0] -= 1;
                    turned.push(vertex);
                }
            }
        }
        if edits.is_complete {
            (self.version, self.shape_version, self.stamp_ns) =
                (edits.version, edits.version, edits.stamp_ns);
        }
        turned
    }

    /// Applies variances; returns the changed vertices.
    pub fn apply_variances(&mut self, variances: &Variances) -> Vec<u32> {
        self.version = variances.version;
        let known = variances
            .of
            .iter()
            .filter(|(vertex, _)| self.vertex(*vertex).is_some())
            .copied();
        let known: Vec<_> = known.collect();
        known
            .iter()
            .for_each(|&(vertex, variance)| self.variance[vertex as usize] = variance);
        known.into_iter().map(|(vertex, _)| vertex).collect()
    }

    fn make_room(&mut self, vertex: u32) {
        let slots = vertex as usize + 1;
        if slots > self.positions.len() {
            self.positions.resize(slots, Point3::origin());
            self.support.resize(slots, None);
            self.variance.resize(slots, f32::NAN);
            self.uses.resize(slots, 0);
        }
    }

    /// Largest number of a vertex and of a face, plus one.
    pub fn slots(&self) -> [u32; 2] {
        [self.positions.len() as u32, self.corners.len() as u32]
    }

    /// Position of a vertex, m, and its support; `None` for a missing or unused vertex.
    pub fn vertex(&self, vertex: u32) -> Option<(Point3<f64>, Support)> {
        let at = vertex as usize;
        let is_used = self.uses.get(at).is_some_and(|uses| *uses > 0);
        is_used.then_some((*self.positions.get(at)?, (*self.support.get(at)?)?))
    }

    /// Variance along the normal of a touched vertex, m²; NaN if unknown.
    pub fn variance(&self, vertex: u32) -> f32 {
        self.variance
            .get(vertex as usize)
            .copied()
            .unwrap_or(f32::NAN)
    }

    /// The vertices not supported by the scan: number, position, m, and support.
    pub fn touched(&self) -> impl Iterator<Item = (u32, Point3<f64>, Support)> + '_ {
        let all = (0..self.positions.len() as u32)
            .filter_map(|vertex| Some((vertex, self.vertex(vertex)?)));
        all.filter(|(_, (_, support))| *support != Support::Scan)
            .map(|(vertex, (place, support))| (vertex, place, support))
    }

    /// Corners of a face; `None` for a missing one.
    pub fn face(&self, face: u32) -> Option<[u32; 3]> {
        self.corners
            .get(face as usize)
            .copied()
            .filter(|corners| *corners != NO_FACE)
    }

    /// As a mesh of its own: vertices keep their numbers, faces their order.
    ///
    /// # Errors
    /// [`MeshError`] if faces name missing vertices.
    pub fn mesh(&self) -> Result<TriMesh, MeshError> {
        let faces = self
            .corners
            .iter()
            .copied()
            .filter(|corners| *corners != NO_FACE)
            .collect();
        TriMesh::new(self.positions.clone(), faces)
    }
}

/// A state of the mesh: number of the session from 0 on, and version in it.
type Revision = (u64, u64);

/// The mesh as sent up to now. The publishing worker writes it; that worker, the feature worker,
/// the arm and saves read it.
///
/// Readers hold a state that no longer changes. The writer copies it only if a reader still holds
/// it at the next change.
#[derive(Debug)]
pub struct MeshReplica {
    clock: Clock,
    state: Mutex<ReplicaState>,
    /// last complete state on its way to the writer, or with it
    announced: Mutex<Revision>,
    version: AtomicU64,
    shape_version: AtomicU64,
}

#[derive(Debug)]
struct ReplicaState {
    mesh: Arc<MeshVersion>,
    session: u64,
    /// a whole change is included: before that, ids may not fit each other
    is_complete: bool,
    is_closed: bool,
    /// readers waiting for this complete state or a later one
    waiting: Vec<(Revision, SyncSender<Snapshot>)>,
}

impl MeshReplica {
    /// The scan before any touch, without a session yet.
    pub fn new(clock: Clock, scan: &TriMesh) -> Self {
        let mesh = Arc::new(MeshVersion::of(scan, ""));
        let state = ReplicaState {
            mesh,
            session: 0,
            is_complete: true,
            is_closed: false,
            waiting: Vec::new(),
        };
        Self {
            clock,
            state: Mutex::new(state),
            announced: Mutex::new((0, 1)),
            version: AtomicU64::new(1),
            shape_version: AtomicU64::new(1),
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

    /// Applies changes; as [`MeshVersion::apply`].
    pub fn apply(&self, edits: &Edits) -> Vec<u32> {
        let mut state = locked(&self.state);
        let turned = Arc::make_mut(&mut state.mesh).apply(edits);
        state.is_complete = edits.is_complete;
        self.answer(&mut state);
        turned
    }

    /// Applies variances; as [`MeshVersion::apply_variances`].
    pub fn apply_variances(&self, variances: &Variances) -> Vec<u32> {
        let mut state = locked(&self.state);
        let changed = Arc::make_mut(&mut state.mesh).apply_variances(variances);
        self.answer(&mut state);
        changed
    }

    /// Switches to another session.
    pub fn begin_session(&self, mesh: MeshVersion) {
        let mut state = locked(&self.state);
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

    /// The current state, and whether it is complete: for the writer.
    pub fn now(&self) -> (Arc<MeshVersion>, bool) {
        let state = locked(&self.state);
        (Arc::clone(&state.mesh), state.is_complete)
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

    fn answer(&self, state: &mut ReplicaState) {
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
    use super::*;

    /// A strip of triangles between two rows of `columns` vertices.
    fn strip(columns: u32) -> TriMesh {
        let at = |i: u32| Point3::new(f64::from(i / 2), f64::from(i % 2), 0.0);
        let faces = (0..2 * columns - 2).map(|i| {
            if i % 2 == 0 {
                [i, i + 2, i + 1]
            } else {
                [i, i + 1, i + 2]
            }
        });
        TriMesh::new((0..2 * columns).map(at).collect(), faces.collect()).unwrap()
    }

    fn edits(vertices: &[(u32, Option<VertexPlace>)], faces: &[(u32, Option<[u32; 3]>)]) -> Edits {
        let mut edits = Edits::default();
        edits.vertices.extend(vertices);
        edits.faces.extend(faces);
        edits
    }

    #[test]
    fn every_change_of_the_mesh_is_in_it() {
        let scan = strip(1000);
        let mut replica = MeshVersion::of(&scan, "some");
        let moved = |i: u32, step: u32| {
            Point3::new(f64::from(i), f64::from(step), f64::from(i * step) * 0.1)
        };
        for step in 1..=3 {
            let place = |i: u32| Some((moved(i, step), Support::Touched));
            let vertices: Vec<_> = (0..2000).map(|i| (i, place(i))).collect();
            let mut edits = edits(&vertices, &[]);
            (edits.version, edits.is_complete) = (u64::from(step), step == 3);
            replica.apply(&edits);
            assert!(
                (0..2000).all(|i| replica.vertex(i) == place(i)),
                "step {step}"
            );
            // an incomplete state is no version
            assert_eq!(replica.version, if step == 3 { 3 } else { 1 });
        }
        let faces: Vec<_> = scan
            .faces()
            .map(|(_, corners)| corners.map(|v| v.0))
            .collect();
        assert!((0..1998).all(|face| replica.face(face) == Some(faces[face as usize])));
        assert_eq!(
            (replica.counts, replica.slots()),
            ([2000, 1998], [2000, 1998])
        );
        // the first vertex goes with its face, and a new one has a far larger number
        let new = (Point3::new(7.0, 8.0, 9.0), Support::Scan);
        replica.apply(&edits(
            &[(0, None), (2500, Some(new))],
            &[(0, None), (2100, Some([1, 2, 2500]))],
        ));
        assert_eq!(
            (
                replica.vertex(0),
                replica.vertex(2400),
                replica.vertex(2500)
            ),
            (None, None, Some(new))
        );
        assert_eq!(
            (replica.face(0), replica.face(2050), replica.face(2100)),
            (None, None, Some([1, 2, 2500]))
        );
        assert_eq!(
            (replica.counts, replica.slots()),
            ([2000, 1998], [2501, 2101])
        );
    }

    fn version(version: u64, is_complete: bool) -> Edits {
        let mut edits = Edits::default();
        (edits.version, edits.is_complete) = (version, is_complete);
        edits
    }

    #[test]
    fn who_reads_waits_for_what_was_announced_and_for_a_complete_state() {
        let replica = MeshReplica::new(Clock::system(), &strip(10));
        let read = |readers: &[Receiver<Snapshot>]| -> Vec<Option<u64>> {
            readers
                .iter()
                .map(|reader| reader.try_recv().ok().map(|snapshot| snapshot.version))
                .collect()
        };
        assert_eq!(read(&[replica.complete()]), [Some(1)]);
        replica.announce(2);
        let mut readers = vec![replica.complete()];
        replica.announce(3);
        readers.push(replica.complete());
        assert_eq!(read(&readers), [None, None]);
        replica.apply(&version(2, true));
        assert_eq!(read(&readers), [Some(2), None]);
        replica.apply(&version(3, false));
        assert_eq!((read(&readers), replica.version()), (vec![None, None], 2));
        replica.apply(&version(3, true));
        assert_eq!(
            (read(&readers), replica.version()),
            (vec![None, Some(3)], 3)
        );
        // a session starts its own versions
        replica.announce_session();
        let of_the_next = [replica.complete()];
        assert_eq!(read(&of_the_next), [None]);
        replica.begin_session(MeshVersion::of(&strip(10), "next"));
        assert_eq!((read(&of_the_next), replica.version()), (vec![Some(1)], 1));
    }

    #[test]
    fn a_variance_is_of_the_next_version_and_goes_when_its_vertex_moves() {
        let replica = MeshReplica::new(Clock::system(), &strip(10));
        let touched = |x: f64| Some((Point3::new(x, 8.0, 9.0), Support::Touched));
        let mut moved = version(2, true);
        moved
            .vertices
            .extend([(0, touched(1.0)), (1, touched(2.0)), (500, touched(3.0))]);
        replica.apply(&moved);
        let numbers: Vec<u32> = replica
            .now()
            .0
            .touched()
            .map(|(vertex, ..)| vertex)
            .collect();
        assert_eq!(numbers, [0, 1], "no face uses the last");
        replica.announce(3);
        let waiting = replica.complete();
        let changed = replica.apply_variances(&Variances {
            version: 3,
            of: vec![(0, 1e-10), (1, 4e-10), (500, 1e-10)],
        });
        assert_eq!(
            (changed, waiting.try_recv().unwrap().version),
            (vec![0, 1], 3)
        );
        assert_eq!((replica.version(), replica.shape_version()), (3, 2));
        let mut again = version(4, true);
        again.vertices.push((1, touched(2.5)));
        replica.apply(&again);
        let (mesh, _) = replica.now();
        assert_eq!(
            (
                mesh.variance(0),
                mesh.variance(1).is_nan(),
                mesh.variance(7).is_nan()
            ),
            (1e-10, true, true)
        );
        assert_eq!(replica.shape_version(), 4);
    }

    #[test]
    fn what_somebody_reads_stays_as_it_was() {
        let replica = MeshReplica::new(Clock::system(), &strip(10));
        let before = replica.complete().recv().unwrap();
        let mut moved = version(2, true);
        moved
            .vertices
            .push((0, Some((Point3::new(7.0, 8.0, 9.0), Support::Touched))));
        replica.apply(&moved);
        let after = replica.complete().recv().unwrap();
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
        let replica = MeshReplica::new(Clock::system(), &strip(10));
        replica.announce(2);
        let waiting = replica.complete();
        replica.close();
        assert!(waiting.recv().is_err() && replica.complete().recv().is_err());
        replica.announce(1);
        assert!(
            replica.complete().recv().is_ok(),
            "what is there can be read"
        );
    }
}
