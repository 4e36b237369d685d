//! Haptic update: one sample of pose and force moves the mesh.
//!
//! [`Refiner::push`] does all of it: contact, closest face, face dynamics, deformation of the
//! region around it, update of the tree. [`RefineParams::robust`] suits real scans,
//! [`RefineParams::paper`] is the published rule.

mod carve;
mod collision;
mod deform;
mod dynamics;
mod fans;
mod followed;
mod guard;
mod params;
mod registration;
mod ring;
mod roi;
mod scratch_map;
mod stroke_undo;

use nalgebra::{Point3, Vector3};
use serde::Serialize;

pub use deform::{Footprint, RegionFit};
pub use dynamics::{
    ContactModel, DynamicsError, DynamicsParams, FaceDynamics, FaceState, LARGEST_SHARE,
    MotionDirection, RELATIVE_ERROR, SigmoidParams, StepRule, dormand_prince, turn,
};
pub use guard::GuardParams;
pub use params::{CarveParams, RefineParams, ScanParams, ScanRegion, TouchPoint, relaxing_alpha};
pub use registration::{Registrar, Registration, RegistrationError, RegistrationParams};
pub use roi::RoiSize;

use crate::reconstruct::{PatchDelta, Support};
use crate::stylus::{
    Ball, ContactEstimator, ContactSample, LONGEST_HOLD, NormalEstimate, Sample, SampleError,
    SettingError, TipBody, TipPlace, TouchState,
};
use deform::{DeformableMesh, HandleRegion};
use touchup_geometry::mesh::{
    BoxQuery, Changes, FaceHit, FaceId, MeshError, NearbyLeaves, TriMesh, VertexId,
};

/// Uncertainty of the measured normal of one sample, rad: a flat tip that may lie on its face does.
const FLUSH: f64 = 0.05;
/// Maximum number of faces to test against the inside of the tip: on a scan finer than a tenth of
/// the ball they are a sample.
const MOST_LOOKED_AT: usize = 128;

/// Reason for refusing a sample or a refiner. A refused sample does not change the mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// Not finite, absurd, or not in order of time.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A parameter of the dynamics outside its range, or a step that overflows.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// Nothing to refine.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A handle outside the mesh.
    #[error("the mesh has no face {face}; take a handle from `TriMesh::faces`")]
    NoSuchFace {
        /// its id
        face: u32,
    },
}

/// The four cases of haptic mismatch \[paper, Fig 5\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Case {
    /// 1: contact neither measured nor expected.
    Free,
    /// 2: contact expected but not measured; carves the mesh.
    MeshOnly,
    /// 3: contact measured but not expected; raises the mesh to the surface.
    SurfaceOnly,
    /// 4: both; moves and turns the mesh.
    Both,
}

/// Haptic mismatch at the touched face \[paper, Eq 1–5\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mismatch {
    /// the handle
    pub face: FaceId,
    /// h, signed distance of the ball's contact point from the face, m (Eq 1)
    pub distance: f64,
    /// F*, N, in O (Eq 2); zero outside of the mesh, instead of the pull of a spring
    pub expected_force_o: Vector3<f64>,
    /// ε_L = F − F*, N (Eq 4)
    pub linear: Vector3<f64>,
    /// ε_R = F* × F, N² (Eq 5)
    pub rotational: Vector3<f64>,
}

/// Effect of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// one of the four cases
    pub case: Case,
    /// at the face that the tip touches or has entered; `None` without a face in reach: F* is then
    /// zero, and ε_L the measured force
    pub mismatch: Option<Mismatch>,
    /// outcome of the deformation; `None` if there was nothing to move
    pub fit: Option<RegionFit>,
}

impl Update {
    const FREE: Self = Self {
        case: Case::Free,
        mismatch: None,
        fit: None,
    };
    /// Contact without a movable face.
    const BESIDE: Self = Self {
        case: Case::SurfaceOnly,
        mismatch: None,
        fit: None,
    };
}

/// Samples by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RefineCounts {
    /// accepted samples
    pub accepted: u64,
    /// number of contacts
    pub contacts: u64,
    /// updates of the mesh, by contact or by carving; a sample can bring both
    pub moved: u64,
    /// updates shortened or abandoned to keep the mesh sound
    pub cut_back: u64,
    /// neither in contact nor free: the end of a contact, or a touch too light for one
    pub light: u64,
    /// contacts beyond the reach of any face
    pub out_of_reach: u64,
    /// contacts outside the touchable region
    pub outside_region: u64,
    /// contacts with a force beyond the contact model; clamped if the model takes out the rigid
    /// offset
    pub clamped: u64,
}

/// Refines a mesh by touch, sample by sample.
///
/// # Example
/// ```
/// use nalgebra::{Isometry3, Point3, Vector3};
/// use touchup_geometry::mesh::TriMesh;
/// use touchup_method::{haptic::*, stylus::{Sample, TipParams, Wrench}};
///
/// let p = |x, y| Point3::new(x, y, 0.0);
/// let mesh = TriMesh::new(vec![p(0.0, 0.0), p(0.01, 0.0), p(0.0, 0.01)], vec![[0, 1, 2]])?;
/// let mut refiner = Refiner::new(mesh, RefineParams::robust(TipParams { radius: 1e-3, stiffness: Some(2e4) }))?;
/// // a ball of 1 mm touches 0.1 mm above the scan, pressed with 2 N
/// let wrench = Wrench { force: Vector3::new(0.0, 0.0, 2.0), torque: Vector3::zeros() };
/// for i in 0..1000 {
///     let pose_ot = Isometry3::translation(0.003, 0.003, 1.0e-3 + 0.1e-3 - 2.0 / 2e4);
///     refiner.push(&Sample { stamp_ns: i * 1_000_000, pose_ot, wrench })?;
/// }
/// assert!((refiner.mesh().position(touchup_geometry::mesh::VertexId(0)).z - 0.1e-3).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Refiner {
    params: RefineParams,
    contacts: ContactEstimator,
    dynamics: FaceDynamics,
    deformable: DeformableMesh,
    contact_region: HandleRegion,
    /// region of the face that the tip is likely to touch next
    next_region: HandleRegion,
    carve_region: HandleRegion,
    /// last face closest to the touching point
    nearest: Option<FaceId>,
    /// track of the touching point; `None` without contact, and if the point depends on the face
    track: Option<TouchTrack>,
    /// leaves around the touching point of the tip
    near_contact: NearbyLeaves,
    /// leaves around the middle of the tip
    near_tip: NearbyLeaves,
    body: TipBody,
    /// from the tip to the handle, unit, in O; unused for a ball
    axis: Vector3<f64>,
    /// faces near the tip
    near_faces: BoxQuery,
    /// faces inside the tip, with their depth, m
    inside_faces: Vec<(f64, FaceId)>,
    /// handle and n*(0), its normal on becoming the handle (Eq 6)
    begun: Option<(FaceId, Vector3<f64>)>,
    counts: RefineCounts,
}

/// Touching point of the tip from sample to sample, m, in O.
#[derive(Clone, Copy, Debug)]
struct TouchTrack {
    last: Point3<f64>,
    /// next point by extrapolation
    next: Point3<f64>,
}

/// Ball against the face it touches.
struct Pressing {
    handle: FaceId,
    /// the face before the update
    face: FaceState,
    /// measured outward normal of the surface, unit; the face's own in [`RefineParams::paper`]
    normal: Vector3<f64>,
    /// touching point of the reported ball, m, in O
    point: Point3<f64>,
    /// force on the stylus; only its part along `normal` if friction is known, N, in O
    force_o: Vector3<f64>,
}

impl Refiner {
    /// Builds tree and buffers, in O(F log F).
    ///
    /// # Errors
    /// [`RefineError::Setting`], [`RefineError::Dynamics`], [`MeshError::Empty`].
    pub fn new(mesh: TriMesh, params: RefineParams) -> Result<Self, RefineError> {
        if mesh.face_count() == 0 {
            return Err(MeshError::Empty.into());
        }
        params.check()?;
        let mut deformable = DeformableMesh::new(mesh, params.guard, params.region.as_ref());
        deformable.largest_move = (params.largest_move_edges * deformable.mean_edge)
            .max(params.largest_move_noises * params.scan_noise);
        Ok(Self {
            contacts: ContactEstimator::new(params.contact())?,
            dynamics: FaceDynamics::new(params.dynamics)?,
            contact_region: deformable.region(params.roi),
            next_region: deformable.region(params.roi),
            carve_region: deformable.region(RoiSize::Handle),
            nearest: None,
            track: None,
            near_contact: NearbyLeaves::default(),
            near_tip: NearbyLeaves::default(),
            deformable,
            body: TipBody::new(params.shape, params.tip.radius)?,
            axis: Vector3::z(),
            near_faces: BoxQuery::with_room(4 * MOST_LOOKED_AT),
            inside_faces: Vec::with_capacity(MOST_LOOKED_AT),
            begun: None,
            counts: RefineCounts::default(),
            params,
        })
    }

    /// Takes the next sample and moves the mesh accordingly.
    ///
    /// # Errors
    /// [`RefineError::Sample`] for a sample that is not finite, absurd or not after the last; the
    /// state then stays unchanged. [`RefineError::Dynamics`] for a step that overflows or is too
    /// stiff for its rule; the mesh then stays unchanged.
    pub fn push(&mut self, sample: &Sample) -> Result<Update, RefineError> {
        self.take(sample, None)
    }

    /// As [`Self::push`], but a contact acts on `handle` instead of the closest face: for a stylus
    /// that stays on one face after the other \[paper, Sec 4.3\].
    ///
    /// # Errors
    /// Errors of [`Self::push`], and [`RefineError::NoSuchFace`] with an unchanged state.
    pub fn push_on(&mut self, handle: FaceId, sample: &Sample) -> Result<Update, RefineError> {
        if !self.deformable.mesh.has_face(handle) {
            return Err(RefineError::NoSuchFace { face: handle.0 });
        }
        self.take(sample, Some(handle))
    }

    fn take(&mut self, sample: &Sample, handle: Option<FaceId>) -> Result<Update, RefineError> {
        let observed = self.contacts.observe(sample)?;
        let (
            state,
            &ContactSample {
                ball,
                dt,
                ball_contact,
                surface,
                ..
            },
        ) = (observed.ball_state(), observed);
        let dt = dt.min(LONGEST_HOLD);
        self.deformable.now_ns = sample.stamp_ns;
        if !self.body.is_ball() {
            self.axis = TipPlace::from(&sample.pose_ot).axis;
        }
        self.counts.contacts = self.contacts.contacts();
        // a sample outside the touchable region moves nothing
        let is_outside = self
            .params
            .region
            .is_some_and(|touched| !touched.region.contains(&ball.centre));
        let track = self.track.take();
        let update = match ball_contact {
            None => {
                self.begun = None;
                self.counts.light += u64::from(state == TouchState::Light);
                Update::FREE
            }
            Some(_) if is_outside => {
                self.counts.outside_region += 1;
                Update::BESIDE
            }
            Some(_) => {
                self.deformable.touch();
                match self.pressing(&ball, surface, handle, track) {
                    Some(pressing) => self.press(&pressing, dt)?,
                    None => {
                        self.counts.out_of_reach += 1;
                        Update::BESIDE
                    }
                }
            }
        };
        self.counts.accepted += 1;
        Ok(if is_outside {
            update
        } else {
            self.carve(&ball, state, dt, update)
        })
    }

    /// Cases 3 and 4, and without a gate also 1 and 2: moves the touched face.
    fn press(&mut self, pressing: &Pressing, dt: f64) -> Result<Update, RefineError> {
        let mismatch = self.mismatch(pressing);
        // without a gate, contact takes more force than expected at the face itself
        let is_felt = self.params.gate.is_some()
            || pressing.force_o.norm() > self.params.dynamics.model.force(0.0).max(0.0);
        let case = match (mismatch.distance < 0.0, is_felt) {
            (true, true) => Case::Both,
            (false, true) => Case::SurfaceOnly,
            (true, false) => Case::MeshOnly,
            (false, false) => Case::Free,
        };
        let untouched = Ok(Update {
            case,
            mismatch: Some(mismatch),
            fit: None,
        });
        let face = &pressing.face;
        // a face without area has no normal; a face turned away from the measured normal is another
        // surface
        let is_apart = face.n == Vector3::zeros()
            || face.n.dot(&pressing.normal) < self.params.smallest_contact_cosine;
        if is_apart || self.deformable.is_stiff(pressing.handle) {
            return untouched;
        }
        self.counts.clamped += u64::from(
            self.params
                .dynamics
                .model
                .clamps(pressing.force_o.dot(&face.n)),
        );
        let initial = self
            .begun
            .filter(|(handle, _)| *handle == pressing.handle)
            .map_or(face.n, |(_, n)| n);
        self.begun = Some((pressing.handle, initial));
        let mut next =
            self.dynamics
                .step_from(&initial, face, &pressing.point, &pressing.force_o, dt)?;
        if let Some(turning) = self.params.turning {
            next.n = turn(&face.n, &pressing.normal, turning * dt);
        }
        self.deformable
            .note_normal(pressing.handle, &pressing.normal);
        let steps = self.rigid_steps(pressing, &next);
        self.take_region(pressing.handle);
        let fit = self
            .deformable
            .deform(&mut self.contact_region, pressing.handle, &steps);
        self.count(fit);
        Ok(Update {
            case,
            mismatch: Some(mismatch),
            fit: Some(fit),
        })
    }

    /// Ball against `handle`, else against the face that it touches; `None` beyond the reach.
    fn pressing(
        &mut self,
        ball: &Ball,
        surface: Option<NormalEstimate>,
        handle: Option<FaceId>,
        track: Option<TouchTrack>,
    ) -> Option<Pressing> {
        let (normal, reach) = (
            surface.map(|known| known.normal).unwrap_or_default(),
            self.reach(),
        );
        // the spring expects the deflection F/k of the tip, a rigid contact does not
        let centre = if self.params.dynamics.take_out_rigid_offset {
            ball.centre
        } else {
            ball.reported
        };
        let seek = match self.params.touch_point {
            TouchPoint::MeasuredNormal => self.touching_point(centre, &normal),
            TouchPoint::FaceNormal => centre,
        };
        let hit = match self.params.touch_point {
            _ if handle.is_some() => None,
            TouchPoint::MeasuredNormal => {
                let step = track.map_or_else(Vector3::zeros, |track| seek - track.last);
                self.track = Some(TouchTrack {
                    last: seek,
                    next: seek + step,
                });
                self.touched_face(&seek)
            }
            TouchPoint::FaceNormal => {
                self.deformable
                    .tree
                    .closest_barycentre(&self.deformable.mesh, &seek, reach)
            }
        };
        let handle = handle.or(hit.map(|hit| hit.face))?;
        let mesh = &self.deformable.mesh;
        let face = FaceState {
            b: mesh.barycentre(handle),
            n: mesh.normal(handle),
        };
        Some(match self.params.touch_point {
            TouchPoint::MeasuredNormal => Pressing {
                handle,
                face,
                normal,
                point: seek,
                force_o: normal * ball.force_o.dot(&normal),
            },
            TouchPoint::FaceNormal => {
                let point = self.touching_point(centre, &face.n);
                Pressing {
                    handle,
                    face,
                    normal: face.n,
                    point,
                    force_o: ball.force_o,
                }
            }
        })
    }

    /// Maximum distance of a face from the touching point, m.
    fn reach(&self) -> f64 {
        self.deformable.largest_move + self.params.tip.radius
    }

    /// Face closest to the touching point.
    fn touched_face(&mut self, point: &Point3<f64>) -> Option<FaceHit> {
        let hit =
            self.deformable
                .closest(point, self.nearest, self.reach(), &mut self.near_contact);
        self.nearest = hit.map(|hit| hit.face).or(self.nearest);
        hit
    }

    /// Makes the prepared region the region of the contact, if it belongs to this handle.
    fn take_region(&mut self, handle: FaceId) {
        if self.contact_region.roi.handle != Some(handle)
            && self.deformable.is_prepared(&self.next_region, handle)
        {
            std::mem::swap(&mut self.contact_region, &mut self.next_region);
            self.next_region.roi.handle = None;
        }
    }

    /// Prepares the closest face and its region for the next sample, if the tip goes on as before,
    /// so that the sample does not wait for them. Call it between samples; it changes no result.
    pub fn look_ahead(&mut self) {
        let Some(TouchTrack { next, .. }) = self.track else {
            return;
        };
        let Some(FaceHit { face, .. }) = self.touched_face(&next) else {
            return;
        };
        if self.deformable.is_stiff(face) {
            return;
        }
        if self.contact_region.roi.handle == Some(face) {
            self.deformable.prepare(&mut self.contact_region, face);
        } else if !self.deformable.is_prepared(&self.next_region, face) {
            // the extent of a region depends on the time of its construction
            self.next_region.roi.handle = None;
            self.deformable.prepare(&mut self.next_region, face);
        }
    }

    /// Touching point of the tip on a surface of this outward normal, m, in O.
    fn touching_point(&self, centre: Point3<f64>, normal: &Vector3<f64>) -> Point3<f64> {
        let place = TipPlace {
            centre,
            axis: self.axis,
        };
        match self.body.touched(&place, normal, FLUSH) {
            Some(touched) => touched.point,
            None => self.body.support(&place, &-normal),
        }
    }

    fn mismatch(&self, pressing: &Pressing) -> Mismatch {
        let Pressing {
            handle,
            face: FaceState { b, n },
            point,
            force_o,
            ..
        } = pressing;
        let distance = (point - b).dot(n);
        let expected = n * self.params.dynamics.model.force(distance).max(0.0);
        Mismatch {
            face: *handle,
            distance,
            expected_force_o: expected,
            linear: force_o - expected,
            rotational: expected.cross(force_o),
        }
    }

    /// Case 1 or 2, without contact, at a face that the tip is at or in.
    fn mismatch_in_free_motion(&self, ball: &Ball, handle: FaceId) -> Mismatch {
        let mesh = &self.deformable.mesh;
        let face = FaceState {
            b: mesh.barycentre(handle),
            n: mesh.normal(handle),
        };
        let point = self.touching_point(ball.centre, &face.n);
        self.mismatch(&Pressing {
            handle,
            face,
            normal: face.n,
            point,
            force_o: ball.force_o,
        })
    }

    /// Rigid motion of the handle to its next state, as steps of its corners, m.
    ///
    /// With [`MotionDirection::Force`] a corner moves along `normal` only: the sideways part of the turn
    /// would make the triangles creep.
    fn rigid_steps(
        &self,
        Pressing {
            handle,
            face,
            normal,
            ..
        }: &Pressing,
        next: &FaceState,
    ) -> [Vector3<f64>; 3] {
        // the smallest rotation from n to n′: x + v × x + v × (v × x) / (1 + n·n′), v = n × n′
        let axis = face.n.cross(&next.n);
        let bend = 1.0 / (1.0 + face.n.dot(&next.n)).max(f64::EPSILON);
        let longest = self.params.longest_step_edges * self.deformable.mean_edge;
        let along = self.params.dynamics.along == MotionDirection::Force;
        let steps = self.deformable.mesh.triangle(*handle).map(|corner| {
            let arm = corner - face.b;
            let across = axis.cross(&arm);
            let step = across + axis.cross(&across) * bend + (next.b - face.b);
            if along {
                normal * step.dot(normal)
            } else {
                step
            }
        });
        // one share for all corners: shortened each by itself they would turn the face
        let farthest = steps.iter().map(Vector3::norm).fold(0.0, f64::max);
        if farthest > longest {
            steps.map(|step| step * (longest / farthest))
        } else {
            steps
        }
    }

    /// Keeps an undo history of strokes from here on; strokes of a followed patch belong to the
    /// patch ([`crate::reconstruct::Patcher::undo`]).
    pub fn keep_strokes(&mut self) {
        self.deformable.keep_strokes();
    }

    /// Undoes the last stroke, bit for bit: the touches without a pause of a tenth of a second, and
    /// all motion by the tip after them. Returns whether there was a stroke: the history holds at
    /// most 64. Estimates of friction and bias stay.
    pub fn undo(&mut self) -> bool {
        self.change_strokes(true)
    }

    /// Redoes the last undone stroke, bit for bit, unless there was a touch since. Returns whether
    /// there was one.
    pub fn redo(&mut self) -> bool {
        self.change_strokes(false)
    }

    fn change_strokes(&mut self, is_undo: bool) -> bool {
        let has_changed = self.deformable.change_strokes(is_undo);
        if has_changed {
            self.forget_regions();
        }
        has_changed
    }

    /// Prepares to follow a patch, with room for `faces` new faces: more fit as well, after a
    /// pause.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] if memory is short.
    pub fn expect_patch(&mut self, faces: usize) -> Result<(), RefineError> {
        Ok(self.deformable.expect_patch(faces)?)
    }

    /// Begins to take up the changes of the patch of this scan, step by step, so that no sample
    /// waits long: call [`Self::go_on_following`] with the same delta until it is done. Vertices
    /// moved here up to the patch's last touch return to their place in scan and patch; the touched
    /// surface is in the patch now, which alone moves it from then on. Does nothing before
    /// [`Self::expect_patch`].
    pub fn begin_to_follow(&mut self, delta: &PatchDelta) {
        if self.deformable.begin_delta(delta) {
            self.forget_regions();
        }
    }

    /// Takes up to `most` more parts of the change of the patch, as
    /// [`crate::reconstruct::Splice::go_on`]; returns whether it is complete. Until then the mesh
    /// has gaps and overlaps between old faces and new ones.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] if 32-bit ids do not suffice, [`MeshError::NotFinite`]; the mesh is
    /// then inconsistent.
    pub fn go_on_following(
        &mut self,
        delta: &PatchDelta,
        most: usize,
    ) -> Result<bool, RefineError> {
        if !delta.is_empty() {
            self.forget_regions();
        }
        Ok(self.deformable.go_on(delta, most)?)
    }

    /// Forgets all regions after a change of the faces.
    fn forget_regions(&mut self) {
        for region in [
            &mut self.contact_region,
            &mut self.next_region,
            &mut self.carve_region,
        ] {
            region.roi.handle = None;
        }
        self.nearest = None;
        self.begun = None;
    }

    fn count(&mut self, fit: RegionFit) {
        self.counts.moved += 1;
        self.counts.cut_back += u64::from(fit == RegionFit::CutBack);
    }

    /// The current mesh.
    pub fn mesh(&self) -> &TriMesh {
        &self.deformable.mesh
    }

    /// Records changes of the mesh from here on, for [`Self::take_changes`].
    pub fn watch(&mut self) {
        self.deformable.mesh.watch();
    }

    /// Changes of the mesh since the last call, as [`TriMesh::take_changes`].
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> bool {
        self.deformable.mesh.take_changes(most, into)
    }

    /// Support of a vertex in the followed patch; `None` without a patch.
    pub fn support(&self, vertex: VertexId) -> Option<Support> {
        self.deformable
            .patch
            .as_ref()
            .map(|patch| patch.support(vertex))
    }

    /// Current memory of mesh and tree.
    pub fn footprint(&self) -> Footprint {
        self.deformable.footprint()
    }

    /// Closest face of the current mesh, by true surface distance, nearer than `reach` (m).
    pub fn closest_face(&self, p: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.deformable
            .tree
            .closest(&self.deformable.mesh, p, reach)
    }

    /// Samples by outcome.
    pub fn counts(&self) -> &RefineCounts {
        &self.counts
    }

    /// A new contact estimator with the settings of this refiner.
    ///
    /// # Errors
    /// [`RefineError::Setting`].
    pub fn fresh_contacts(&self) -> Result<ContactEstimator, RefineError> {
        Ok(ContactEstimator::new(self.params.contact())?)
    }

    /// Estimator of contact, after the latest sample.
    pub fn contacts(&self) -> &ContactEstimator {
        &self.contacts
    }

    /// Lets another estimator decide about contacts from here on, as if from the first sample on.
    /// The mesh stays.
    pub fn set_contacts(&mut self, contacts: ContactEstimator) {
        self.counts.contacts = contacts.contacts();
        self.contacts = contacts;
        (self.begun, self.track) = (None, None);
    }

    /// Vertices moved by the last contact.
    pub fn moved_vertices(&self) -> &[VertexId] {
        &self.contact_region.roi.vertices
    }
}
