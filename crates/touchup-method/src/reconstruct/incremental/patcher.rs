//! Samples in, the scan with its touched part remeshed out.

use nalgebra::{Point3, Vector3};

use crate::parameters;
use crate::reconstruct::contour::coarsening::{CoarseBlocks, coarsen};
use crate::reconstruct::contour::patched::{Patch, PatchedMesh};
use crate::reconstruct::evidence::agreement::Agreement;
use crate::reconstruct::evidence::contact_map::{ContactMap, GateParams};
use crate::reconstruct::evidence::contact_uncertainty::UncertaintyParams;
use crate::reconstruct::evidence::free_space::FreeSpace;
use crate::reconstruct::evidence::kept_detail::KeptDetail;
use crate::reconstruct::evidence::outliers::Outliers;
use crate::reconstruct::evidence::piecewise::FieldScratch;
use crate::reconstruct::evidence::point_evidence::{Evidence, EvidenceParams};
use crate::reconstruct::evidence::probed_log::ProbedLog;
use crate::reconstruct::evidence::stroke_log::{StrokeLog, StrokeSpan};
use crate::reconstruct::evidence::touch_history::TouchHistory;
use crate::reconstruct::evidence::touches::{TipTouch, TouchFinder, TouchFinderParams};
use crate::reconstruct::evidence_changes::GridChanges;
use crate::reconstruct::field::grid::{nodes_around_contact, nodes_around_contacts};
use crate::reconstruct::field::uncertainty::vertex_sigma;
use crate::reconstruct::field::unreachable::mark_unreachable;
use crate::reconstruct::history::Direction;
use crate::reconstruct::incremental::delta::{PatchDelta, PatchVertex, PublishedPatch};
use crate::reconstruct::incremental::remesh::{Remesh, RenewedFaces};
use crate::reconstruct::lattice::{Lattice, VertexKey};
use crate::reconstruct::model::{KnownSurface, KnownSurfaceError, KnownSurfaces};
use crate::reconstruct::support::Support;
use crate::stylus::{ContactSample, ProbedPoint, SettingError, TipBody, TipShape};
use touchup_geometry::mesh::{FaceTree, MeshError, Region, TriMesh};

/// Settings of a [`Patcher`].
#[derive(Clone, Debug, PartialEq)]
pub struct PatcherParams {
    /// settings of the touch finder
    pub touches: TouchFinderParams,
    /// weights of the evidence
    pub evidence: EvidenceParams,
    /// whether free space is evidence: the swept volume holds no material. Else the scan stays
    /// except at touches
    pub free_space: bool,
    /// maximum distance of the new faces from the touched surface, m
    pub tolerance: f64,
    /// whether `tolerance` is the usual one, which grows if the lattice around all touches would
    /// not fit; else such a lattice is an error
    pub is_usual_tolerance: bool,
    /// the model of uncertainty; `None`: no uncertainty, and no rejection
    pub uncertainty: Option<UncertaintyParams>,
    /// region of the touches that count; `None`: anywhere on the scan
    pub region: Option<Region>,
}

parameters! {
    /// Resolution of the reconstructed surface.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PatchParams in "patch" {
        /// Largest distance of the new faces from the touched surface, on planes and in holes down
        /// to twice the width of the tip: a smaller one makes finer faces at edges and in holes,
        /// and takes longer. Left out: 1/64 of the radius of the tip.
        ///
        /// In m.
        tolerance: Option<f64> = None, "tolerance_mm" [MM, 1e-6, 100] like "0.02";
    }
}

impl PatcherParams {
    /// Settings for a ball of `radius` (m) at a stylus of `stiffness` (N/m), and a scan with points
    /// off by `noise` (m).
    pub fn new(radius: f64, stiffness: Option<f64>, noise: f64) -> Self {
        Self {
            touches: TouchFinderParams::new(radius, stiffness),
            evidence: EvidenceParams::new(radius, noise),
            free_space: true,
            tolerance: TOLERANCE * radius,
            is_usual_tolerance: false,
            uncertainty: Some(UncertaintyParams::new(noise)),
            region: None,
        }
    }

    /// Edge length of the lattice, m: on a cylinder of twice the tip's radius r, faces between
    /// points p apart are off by the sagitta p² / (8 · 2 r), which is the tolerance.
    pub fn pitch(&self) -> f64 {
        (16.0 * self.evidence.radius * self.tolerance).sqrt()
    }

    /// The longest smoothing window: contacts within it share their noise, ns.
    fn window_ns(&self) -> i64 {
        2 * self.touches.half_window_ns
    }

    /// Radius of a ball tip, m.
    fn ball(&self) -> Option<f64> {
        (self.touches.shape == TipShape::Ball).then_some(self.touches.radius)
    }

    /// Gate of rejection.
    fn gate(&self) -> Option<GateParams> {
        self.uncertainty.map(|known| GateParams {
            sigmas: known.gate_sigmas,
            window_ns: self.window_ns(),
        })
    }

    /// Prior uncertainty of the scan; a scan free of noise gets none, as it is no better than
    /// touches that contradict it.
    fn scan_prior(&self) -> Option<UncertaintyParams> {
        self.uncertainty.filter(|known| known.scan > 0.0)
    }

    /// Settings for a tip of `shape` with a ball, flat end or nose of `radius` (m), else as
    /// [`Self::new`]. The range of evidence depends on the resolution of the tip.
    ///
    /// # Errors
    /// [`SettingError`] for impossible sizes of a tip.
    pub fn for_tip(
        shape: TipShape,
        radius: f64,
        stiffness: Option<f64>,
        noise: f64,
    ) -> Result<Self, SettingError> {
        let mut params = Self::new(TipBody::new(shape, radius)?.scale(), stiffness, noise);
        (params.touches.shape, params.touches.radius) = (shape, radius);
        Ok(params)
    }

    /// Refuses a lattice too fine to fit even around one contact, before building anything.
    fn check_cost(&self) -> Result<(), SettingError> {
        let around = format!("one contact of a tip of {} mm", self.evidence.radius * 1e3);
        self.check_nodes(
            nodes_around_contact(self.evidence.radius, self.pitch()),
            MOST_NODES,
            &around,
        )
    }

    /// Refuses a lattice of more than `most` nodes.
    ///
    /// - `around`: contents of the lattice, for the message.
    fn check_nodes(&self, nodes: f64, most: f64, around: &str) -> Result<(), SettingError> {
        let why = format!(
            "{:.2e} or more: the lattice around {around} would have {nodes:.1e} nodes and take {:.1} GB; a larger \
             patch.tolerance_mm takes less",
            self.fitting_tolerance(nodes, most) * 1e3,
            nodes * NODE_BYTES * 1e-9,
        );
        SettingError::check(
            "patch.tolerance_mm",
            self.tolerance * 1e3,
            nodes <= most,
            &why,
        )
    }

    /// The tolerance of a lattice of `most` nodes instead of `nodes`: the edges of its cells scale
    /// with its root.
    fn fitting_tolerance(&self, nodes: f64, most: f64) -> f64 {
        self.tolerance * (nodes / most).cbrt().powi(2)
    }

    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub(crate) fn check(&self) -> Result<(), SettingError> {
        let radius = self.evidence.radius;
        let is_tip = radius >= SMALLEST_TIP;
        SettingError::check(
            "tip.radius_mm",
            radius * 1e3,
            is_tip,
            "0.01 or more where there is a patch",
        )?;
        PatchParams {
            tolerance: Some(self.tolerance),
        }
        .check()?;
        self.check_cost()?;
        let noise = self.uncertainty.map_or(0.0, |known| known.scan);
        SettingError::check("scan.noise_mm", noise * 1e3, noise >= 0.0, "0 to 1000 mm")?;
        self.uncertainty
            .iter()
            .try_for_each(UncertaintyParams::check)
    }
}

/// Keeps touches and swept volume, and makes the patch of them.
///
/// # Example
/// ```
/// use nalgebra::{Isometry3, Point3, Vector3};
/// use touchup_geometry::mesh::{FaceTree, TriMesh};
/// use touchup_method::{reconstruct::{Patcher, PatcherParams}, stylus::*};
///
/// // a scan of 20 mm that lies 0.4 mm too high
/// let p = |x: f64, y: f64| Point3::new(x * 1e-3, y * 1e-3, 0.4e-3);
/// let scan = TriMesh::new(vec![p(0., 0.), p(20., 0.), p(20., 20.), p(0., 20.)], vec![[0, 1, 2], [0, 2, 3]])?;
/// let mut patcher = Patcher::new(PatcherParams::new(1.5e-3, None, 0.3e-3))?;
/// let mut contacts = ContactEstimator::new(ContactEstimatorParams::new(TipParams { radius: 1.5e-3, stiffness: None }))?;
/// // a ball slides over the real surface, z = 0, in lines 1 mm apart
/// for i in 0..8000_i64 {
///     let (line, along) = ((i / 800) as f64, (i % 800) as f64 * 0.0125e-3);
///     let x = if line % 2.0 == 0.0 { 5e-3 + along } else { 15e-3 - along };
///     let pose_ot = Isometry3::translation(x, 5e-3 + line * 1e-3, 1.5e-3);
///     let wrench = Wrench { force: Vector3::new(0.0, 0.0, 2.0), torque: Vector3::zeros() };
///     patcher.push(contacts.observe(&Sample { stamp_ns: i * 1_000_000, pose_ot, wrench })?);
/// }
/// patcher.flush();
/// let mesh = patcher.patched(&scan, &FaceTree::new(&scan))?.mesh;
/// let tree = FaceTree::new(&mesh);
/// let found = tree.closest(&mesh, &Point3::new(10e-3, 10e-3, 0.0), 1e-3).ok_or("no face")?;
/// assert!(found.point.z.abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Patcher {
    params: PatcherParams,
    finder: TouchFinder,
    history: TouchHistory,
    live: Option<LivePatch>,
    /// whether the scan has no rim; `None` before the first scan
    is_closed: Option<bool>,
}

/// The patch of a following mesh.
#[derive(Clone, Debug, Default)]
struct LivePatch {
    remesh: Remesh,
    published: PublishedPatch,
    /// changes of the evidence since
    changes: GridChanges,
    /// changes applied only nearby
    late: GridChanges,
    /// renewals since the last full application
    since_late: u32,
    /// strokes were undone: a full remesh is due
    is_outdated: bool,
}

/// Number of renewals after which changes apply in full; sooner when idle.
const LATE_EVERY: u32 = 4;

impl LivePatch {
    /// Changes to apply nearby, and changes to apply in full.
    fn take_changes(&mut self) -> (GridChanges, GridChanges) {
        let changes = std::mem::take(&mut self.changes);
        self.late.extend(&changes);
        if changes.is_empty() {
            (changes, self.take_late())
        } else {
            (changes, GridChanges::default())
        }
    }

    /// Changes applied only nearby.
    fn take_late(&mut self) -> GridChanges {
        self.since_late = 0;
        std::mem::take(&mut self.late)
    }
}

/// The usual tolerance, in radii: a lattice of half the radius.
const TOLERANCE: f64 = 1.0 / 64.0;
/// Minimum radius of a tip for a patch, m: a fifth of the finest stylus on sale.
const SMALLEST_TIP: f64 = 1e-5;
/// Maximum number of nodes around one contact: a ball of 1.5 mm on a lattice of 0.042 mm.
const MOST_NODES: f64 = 4e6;
/// Maximum number of nodes around all contacts: 3.2 GB.
const MOST_NODES_IN_ALL: f64 = 8e6;
/// Memory of a node while making the field around it, bytes: its state, the scan's distance, its
/// numbers, half-full tables.
const NODE_BYTES: f64 = 400.0;
/// Edge of the cells of one mean contact, in radii.
const CONTACT_CELL: f64 = 1.0 / 3.0;
/// Edge of the cells of one centre, in radii.
const SWEPT_CELL: f64 = 0.1;
/// Offset of the lattice planes, in pitches, off the coordinates that a person would choose.
const ORIGIN: [f64; 3] = [0.164_607_9, 0.312_756_1, 0.460_895_1];

impl Patcher {
    /// A patcher without touches.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn new(params: PatcherParams) -> Result<Self, SettingError> {
        params.check()?;
        let radius = params.evidence.radius;
        let calibration = params.uncertainty.map(|known| known.calibration);
        let body = TipBody::new(params.touches.shape, params.touches.radius)?;
        Ok(Self {
            finder: TouchFinder::new(TouchFinderParams {
                calibration,
                ..params.touches.clone()
            })?,
            history: TouchHistory {
                contacts: ContactMap::new(
                    CONTACT_CELL * radius,
                    params.evidence.field.reach,
                    params.gate(),
                ),
                free_space: FreeSpace::new(body, SWEPT_CELL * radius, 5.0 / 3.0 * radius),
                probed: ProbedLog::new(params.ball()),
                stroke_log: StrokeLog::default(),
                known: KnownSurfaces::new(radius),
                keeps_free_space: params.free_space,
                radius,
                ball: params.ball(),
                until_ns: i64::MIN,
                last_contact_ns: None,
                bounds: None,
            },
            live: None,
            is_closed: None,
            params,
        })
    }

    /// Rejected contacts, in contradiction to earlier contacts at their place.
    pub fn outliers(&self) -> &Outliers {
        &self.history.contacts.outliers
    }

    /// A copy of the touch history, without the state of a following mesh; usable with another scan
    /// of the part.
    pub fn copy(&self) -> Self {
        let Self {
            params,
            finder,
            history,
            ..
        } = self;
        let history = TouchHistory {
            bounds: None,
            ..history.clone()
        };
        Self {
            params: params.clone(),
            finder: finder.clone(),
            history,
            live: None,
            is_closed: None,
        }
    }

    /// The settings.
    pub fn params(&self) -> &PatcherParams {
        &self.params
    }

    /// Adds the next sample, later than the one before. It counts once the smoothing window around
    /// it is complete.
    pub fn push(&mut self, sample: &ContactSample) {
        self.finder.push(sample, |touch| {
            keep(&mut self.history, &self.params, &touch)
        });
    }

    /// Takes a surface for known: as long as there are all of the contacts that it explains, the
    /// patch follows it between them. It goes with their undo, and comes back with their redo.
    ///
    /// # Errors
    /// [`KnownSurfaceError`]
    pub fn know(&mut self, surface: KnownSurface) -> Result<(), KnownSurfaceError> {
        self.history.known.add(surface)
    }

    /// All surfaces taken for known, whether their contacts are there or not.
    pub fn known(&self) -> &KnownSurfaces {
        &self.history.known
    }

    /// Refuses reconstruction on a lattice that would not fit, before making any of it; with the
    /// usual tolerance the lattice becomes coarser instead.
    ///
    /// # Errors
    /// [`SettingError`] of `patch.tolerance_mm`, with nodes and memory.
    pub fn check_extent(&self) -> Result<(), SettingError> {
        if self.params.is_usual_tolerance {
            return Ok(());
        }
        self.params
            .check_nodes(self.nodes(), MOST_NODES_IN_ALL, "all that was touched")
    }

    /// Maximum distance of the new faces from the touched surface, m: the usual tolerance, or a
    /// larger one that fits the lattice around all contacts.
    pub fn tolerance(&self) -> f64 {
        let params = &self.params;
        match params.is_usual_tolerance {
            true => params
                .fitting_tolerance(self.nodes(), MOST_NODES_IN_ALL)
                .max(params.tolerance),
            false => params.tolerance,
        }
    }

    /// Approximate number of nodes of the lattice around all contacts.
    fn nodes(&self) -> f64 {
        let TouchHistory {
            contacts, known, ..
        } = &self.history;
        let means = contacts.means().iter().map(|mean| mean.point);
        nodes_around_contacts(
            means.chain(known.all_places()),
            self.params.evidence.radius,
            self.params.pitch(),
        )
    }

    /// All touches, in order of time.
    pub fn probed(&self) -> &[ProbedPoint] {
        self.history.probed.points()
    }

    /// All mean contacts.
    pub fn contacts(&self) -> &ContactMap {
        &self.history.contacts
    }

    /// Adds the samples still in the smoothing window: the stream has ended or pauses.
    pub fn flush(&mut self) {
        self.finder
            .flush(|touch| keep(&mut self.history, &self.params, &touch));
    }

    /// Number of undoable strokes. A stroke is the touches without a pause of a tenth of a second,
    /// and the path of the ball after them.
    pub fn strokes(&self) -> usize {
        self.history.strokes()
    }

    /// The samples of a stroke that counts.
    ///
    /// - `number`: as in [`ProbedPoint::stroke`].
    pub fn stroke(&self, number: u32) -> Option<StrokeSpan> {
        self.history.stroke_log.span(number as usize)
    }

    /// The samples of the last stroke that counts.
    pub fn last_stroke(&self) -> Option<StrokeSpan> {
        let log = &self.history.stroke_log;
        log.span(log.count().checked_sub(1)?)
    }

    /// Undoes the last stroke, up to the last sample: the remaining evidence is bit by bit the same
    /// as before it. Returns whether there was one. Estimates of friction and bias stay.
    pub fn undo(&mut self) -> bool {
        self.flush();
        self.exchange(Direction::Undo)
    }

    /// Redoes the last undone stroke, bit by bit, unless there was a touch since. Returns whether
    /// there was one. First adds the samples in the smoothing window, as [`Self::undo`].
    pub fn redo(&mut self) -> bool {
        self.flush();
        self.exchange(Direction::Redo)
    }

    /// Replaces another patcher of the same scan that a mesh follows: the next change leads from
    /// that mesh to this patcher's evidence.
    ///
    /// - `until_ns`: stamp of the last sample of either: the mesh's content up to there goes.
    pub fn take_over(&mut self, before: Self, until_ns: i64) {
        let Self {
            live,
            is_closed,
            history: TouchHistory { bounds, known, .. },
            ..
        } = before;
        self.history.known.add_all(known);
        self.live = live.map(|live| LivePatch {
            remesh: live.remesh,
            published: live.published,
            is_outdated: true,
            ..LivePatch::default()
        });
        (self.is_closed, self.history.bounds) = (is_closed, bounds);
        self.history.note_until(until_ns);
    }

    /// Exchanges a stroke and, if there was one, schedules a full remesh; returns whether there
    /// was.
    fn exchange(&mut self, direction: Direction) -> bool {
        let has_changed = self.history.exchange(direction);
        if let Some(live) = &mut self.live {
            live.is_outdated |= has_changed;
        }
        has_changed
    }

    /// The scan with its touched part remeshed from all evidence; untouched vertices and faces keep
    /// their ids. The usual tolerance grows here if the lattice would not fit.
    ///
    /// - `scan`: the original, with the tree over its faces.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice.
    pub fn patched(&mut self, scan: &TriMesh, tree: &FaceTree) -> Result<PatchedMesh, MeshError> {
        let fitting = self.tolerance();
        let usual = std::mem::replace(&mut self.params.tolerance, fitting);
        let patched = self.patched_within_tolerance(scan, tree);
        self.params.tolerance = usual;
        patched.map(|patched| PatchedMesh {
            is_coarser: patched.tolerance > usual,
            ..patched
        })
    }

    fn patched_within_tolerance(
        &mut self,
        scan: &TriMesh,
        tree: &FaceTree,
    ) -> Result<PatchedMesh, MeshError> {
        self.history.contacts.note_all();
        self.update(scan, tree);
        let kept = KeptDetail::of(&self.evidence(scan, tree, None));
        let (remesh, RenewedFaces { mut patch, .. }) = self.remeshed(scan, tree, kept.as_ref());
        let (known, _) = self.coarsen(&mut patch, &remesh, kept.as_ref(), (scan, tree));
        let (base, moved) = kept.map_or_else(
            || (scan.clone(), Vec::new()),
            |kept| (kept.scan, kept.moved),
        );
        let (mesh, ids) = patch.applied_to(base)?;
        let mut support = vec![Support::Scan; mesh.vertex_slots()];
        moved
            .iter()
            .for_each(|&(vertex, known)| support[vertex.0 as usize] = known);
        for (known, id) in known.into_iter().zip(ids) {
            if let Some(id) = id {
                support[id.0 as usize] = known;
            }
        }
        if let Some(radius) = self.params.ball() {
            mark_unreachable(&mesh, &mut support, &self.history.free_space, radius)?;
        }
        let places = mesh
            .positions()
            .iter()
            .copied()
            .zip(support.iter().copied());
        let sigma = self.sigma(scan, tree, places);
        Ok(PatchedMesh {
            mesh,
            support,
            sigma,
            tolerance: self.params.tolerance,
            is_coarser: false,
            removed_faces: patch.removed.len(),
            added_faces: patch.faces.len(),
            moved_vertices: moved.len(),
            open_squares: patch.open.len(),
        })
    }

    /// Standard deviation along the normal at places of the patch, m, from all touches; empty if
    /// the settings ask for none.
    ///
    /// - `scan`, `tree`: as in [`Self::patched`].
    /// - `places`: vertices of the patch, m, in O, and their support.
    pub fn sigma_at(
        &mut self,
        scan: &TriMesh,
        tree: &FaceTree,
        places: &[(Point3<f64>, Support)],
    ) -> Vec<f64> {
        self.history.contacts.note_all();
        self.update(scan, tree);
        self.sigma(scan, tree, places.iter().copied())
    }

    /// Standard deviation at each place, if the settings ask for it.
    fn sigma(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
        places: impl Iterator<Item = (Point3<f64>, Support)>,
    ) -> Vec<f64> {
        let Some(uncertainty) = &self.params.uncertainty else {
            return Vec::new();
        };
        let evidence = Evidence {
            prior: None,
            ..self.evidence(scan, tree, None)
        };
        let (window_ns, mut scratch) = (self.params.window_ns(), FieldScratch::default());
        let mut of = |(p, support)| {
            vertex_sigma(
                &evidence,
                &p,
                support,
                uncertainty.scan,
                window_ns,
                &mut scratch,
            )
        };
        places.map(&mut of).collect()
    }

    /// Changes of the patch since the last call. The time depends on the extent of the remesh near
    /// the changes. The faces are those of the lattice: [`Self::settled`] merges them to fewer, and
    /// they return at later changes.
    ///
    /// [`Self::patched`] can differ from the sum of these by some thousandths of an edge of the
    /// lattice, and by more away from touches.
    ///
    /// - `scan`, `tree`: as in [`Self::patched`], the same each time.
    pub fn renewed(&mut self, scan: &TriMesh, tree: &FaceTree) -> PatchDelta {
        self.update(scan, tree);
        let mut live = self.live.take().unwrap_or_else(|| LivePatch {
            remesh: Remesh::new(lattice_of(self.params.pitch())),
            changes: self.all_changes(),
            ..LivePatch::default()
        });
        let (changes, late) = live.take_changes();
        let delta = if live.is_outdated {
            let (remesh, renewed) = self.remeshed(scan, tree, None);
            (live.remesh, live.is_outdated) = (remesh, false);
            live.published
                .take_all(renewed, CoarseBlocks::default(), &live.remesh, scan)
        } else {
            let evidence = self.evidence(scan, tree, None);
            let renewed = live
                .remesh
                .renew(&evidence, &changes, &late, live.published.coarse());
            live.published.take(&renewed, &live.remesh, scan)
        };
        self.live = Some(live);
        PatchDelta {
            until_ns: self.history.until_ns,
            ..delta
        }
    }

    /// Each fourth call, updates the field at distances at which changes count less, beyond
    /// [`Self::renewed`]; call it after passing on the result of that. The faces follow with the
    /// next call.
    ///
    /// - `scan`, `tree`: as in [`Self::renewed`].
    pub fn renew_far(&mut self, scan: &TriMesh, tree: &FaceTree) {
        let Some(mut live) = self.live.take() else {
            return;
        };
        live.since_late += 1;
        if live.since_late >= LATE_EVERY && !live.is_outdated {
            let late = live.take_late();
            live.remesh
                .renew_far(&self.evidence(scan, tree, None), &late);
        }
        self.live = Some(live);
    }

    /// As [`Self::renewed`], for a pause of the stream: the sum of all changes is then bit by bit
    /// the result of [`Self::patched`] from all touches, the smoothing window included. Does not
    /// affect later results.
    ///
    /// Takes the time of a whole reconstruction.
    pub fn settled(&mut self, scan: &TriMesh, tree: &FaceTree) -> PatchDelta {
        let all = self.flushed(scan, tree);
        let ((remesh, mut renewed), until_ns) =
            (all.remeshed(scan, tree, None), all.history.until_ns);
        let (_, coarse) = self.coarsen(&mut renewed.patch, &remesh, None, (scan, tree));
        let mut live = self.live.take().unwrap_or_default();
        (live.remesh, live.is_outdated) = (remesh, false);
        let delta = live.published.take_all(renewed, coarse, &live.remesh, scan);
        self.live = Some(live);
        PatchDelta { until_ns, ..delta }
    }

    /// The result of [`Self::patched`] from all touches, the smoothing window included, as a change
    /// of the scan. Independent of the mesh that follows [`Self::renewed`], which may be of another
    /// scan of the part.
    ///
    /// Takes the time of a whole reconstruction.
    ///
    /// - `scan`: with the tree over its faces.
    pub fn patch_of_all(&self, scan: &TriMesh, tree: &FaceTree) -> PatchDelta {
        let all = self.flushed(scan, tree);
        let kept = KeptDetail::of(&all.evidence(scan, tree, None));
        let (remesh, mut renewed) = all.remeshed(scan, tree, kept.as_ref());
        let (_, coarse) = self.coarsen(&mut renewed.patch, &remesh, kept.as_ref(), (scan, tree));
        let base = kept.as_ref().map_or(scan, |kept| &kept.scan);
        let mut delta = PublishedPatch::default().take_all(renewed, coarse, &remesh, base);
        for vertex in &mut delta.vertices {
            let of_moved = kept.as_ref().and_then(|kept| kept.support(&vertex.key));
            vertex.support = of_moved.unwrap_or(vertex.support);
        }
        let moved = kept.iter().flat_map(|kept| &kept.moved);
        delta.vertices.extend(moved.map(|&(vertex, support)| {
            let key = VertexKey::Scan(vertex);
            PatchVertex {
                key,
                position: base.position(vertex),
                support,
            }
        }));
        PatchDelta {
            until_ns: all.history.until_ns,
            ..delta
        }
    }

    /// A copy with all touches, the smoothing window included.
    fn flushed(&self, scan: &TriMesh, tree: &FaceTree) -> Self {
        let mut all = self.copy();
        all.flush();
        all.history.contacts.note_all();
        all.update(scan, tree);
        all
    }

    fn update(&mut self, scan: &TriMesh, tree: &FaceTree) {
        self.is_closed.get_or_insert_with(|| scan.is_closed());
        let changes = self.history.update(scan, tree);
        if let Some(live) = &mut self.live {
            live.changes.extend(&changes);
        }
    }

    fn all_changes(&self) -> GridChanges {
        let means = self
            .history
            .contacts
            .means()
            .iter()
            .map(|mean| mean.point)
            .chain(self.history.known.places())
            .collect();
        let mut centres = Vec::new();
        self.history
            .free_space
            .cover(|centre| centres.push(*centre));
        GridChanges { means, centres }
    }

    fn evidence<'a>(
        &'a self,
        scan: &'a TriMesh,
        tree: &'a FaceTree,
        agreement: Option<&'a Agreement>,
    ) -> Evidence<'a> {
        let Self {
            history:
                TouchHistory {
                    contacts,
                    free_space,
                    known,
                    ..
                },
            params,
            ..
        } = self;
        Evidence {
            params: &params.evidence,
            contacts,
            free_space,
            known,
            scan,
            tree,
            prior: params.scan_prior(),
            agreement,
            is_closed: self.is_closed == Some(true),
        }
    }

    /// The patch of everything, with the faces of the lattice.
    ///
    /// - `kept`: replaces the scan if its detail stays.
    fn remeshed(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
        kept: Option<&KeptDetail>,
    ) -> (Remesh, RenewedFaces) {
        let evidence = match kept {
            None => self.evidence(scan, tree, None),
            Some(KeptDetail {
                scan,
                tree,
                agreement,
                ..
            }) => self.evidence(scan, tree, Some(agreement)),
        };
        let mut remesh = Remesh::new(lattice_of(self.params.pitch()));
        let renewed = remesh.renew(
            &evidence,
            &self.all_changes(),
            &GridChanges::default(),
            &CoarseBlocks::default(),
        );
        (remesh, renewed)
    }

    /// Merges faces of a patch within the tolerance; returns the support of its vertices, and the
    /// blocks with merged faces.
    ///
    /// - `remesh`, `kept`: sources of the patch.
    fn coarsen(
        &self,
        patch: &mut Patch,
        remesh: &Remesh,
        kept: Option<&KeptDetail>,
        scan: (&TriMesh, &FaceTree),
    ) -> (Vec<Support>, CoarseBlocks) {
        let of_moved = |key: &VertexKey| kept.and_then(|kept| kept.support(key));
        let support = patch
            .vertices
            .iter()
            .map(|(key, _)| of_moved(&key).unwrap_or_else(|| remesh.support(&key)));
        let support: Vec<Support> = support.collect();
        let scan = kept.map_or(scan, |kept| (&kept.scan, &kept.tree));
        let coarse = coarsen(
            patch,
            &support,
            &remesh.grid.lattice,
            scan,
            self.params.tolerance,
        );
        (support, coarse)
    }
}

/// Keeps touches inside the region only.
fn keep(history: &mut TouchHistory, params: &PatcherParams, touch: &TipTouch) {
    if params
        .region
        .is_none_or(|region| region.contains(&touch.centre))
    {
        history.keep(touch);
    } else {
        history.note_until(touch.stamp_ns);
    }
}

fn lattice_of(pitch: f64) -> Lattice {
    Lattice {
        origin: Point3::from(Vector3::from(ORIGIN) * pitch),
        pitch,
    }
}
