//! Samples in, the scan with its touched part meshed anew out.

use nalgebra::{Point3, Vector3};

use super::Region;
use super::contact_store::ContactStore;
use super::contour::{ContourParams, contour};
use super::crossing::crossing;
use super::cut::Cut;
use super::evidence::{Evidence, EvidenceParams, Source};
use super::field::FieldScratch;
use super::lattice::{Lattice, Node, VertexKey};
use super::restore::{Restored, node_at, restore};
use super::scan_value::ScanValue;
use super::splice::Patch;
use super::swept::SweptSpace;
use super::touches::{Touch, TouchFinder, TouchFinderParams};
use super::two_points;
use super::unreachable::mark_unreachable;
use crate::mesh::{FaceTree, MeshError, TriMesh};
use crate::touch::{Compensator, CompensatorParams, Sample, SettingError, TipBody, TipPlace, TipShape};

/// Settings of a [`Patcher`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatcherParams {
    /// weight, bias, frames
    pub compensator: CompensatorParams,
    /// how touches are found
    pub touches: TouchFinderParams,
    /// how far they are believed
    pub evidence: EvidenceParams,
    /// edge length of the lattice, m
    pub pitch: f64,
    /// a patch may have this many times the faces of the scan: where it would have more, the lattice is made coarser
    pub most_faces: f64,
}

impl PatcherParams {
    /// Settings that hold for a ball of `radius` (m) at a stylus of `stiffness` (N/m), and a scan whose points are off by
    /// `noise` (m).
    pub fn new(radius: f64, stiffness: Option<f64>, noise: f64) -> Self {
        Self {
            compensator: CompensatorParams::default(),
            touches: TouchFinderParams::new(radius, stiffness),
            evidence: EvidenceParams::new(radius, noise),
            pitch: radius / 2.0,
            most_faces: 10.0,
        }
    }

    /// Settings for a tip of `shape` whose ball, flat end or nose has `radius` (m), else as [`Self::new`]. How far evidence
    /// is believed goes by the size of what the tip can show.
    ///
    /// # Errors
    /// [`SettingError`] for sizes of which no tip can be made.
    pub fn for_tip(shape: TipShape, radius: f64, stiffness: Option<f64>, noise: f64) -> Result<Self, SettingError> {
        let mut params = Self::new(TipBody::new(shape, radius)?.scale(), stiffness, noise);
        (params.touches.shape, params.touches.radius) = (shape, radius);
        Ok(params)
    }

    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn check(&self) -> Result<(), SettingError> {
        for (name, value) in [
            ("tip radius (m)", self.evidence.radius),
            ("patch pitch (m)", self.pitch),
            ("patch budget (times the faces of the scan)", self.most_faces),
        ] {
            SettingError::check(name, value, value > 0.0, "more than 0")?;
        }
        Ok(())
    }
}

/// What a vertex rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// the scan
    Scan,
    /// touches
    Touched,
    /// what touches, free space and scan nearby suggest; nothing was felt here
    Guessed,
    /// as that, and nothing can be felt here: the ball does not go so far into an inner corner, or into what is narrower
    Unreachable,
}

/// A scan with its touched part meshed anew.
#[derive(Clone, Debug)]
pub struct Patched {
    /// vertices and faces that were not touched keep their ids
    pub mesh: TriMesh,
    /// what each vertex rests on, by id
    pub support: Vec<Support>,
    /// edge length of the lattice, m
    pub pitch: f64,
    /// faces of the scan that went
    pub removed_faces: usize,
    /// faces that came
    pub added_faces: usize,
    /// squares on which scan and patch could not be joined
    pub open_squares: usize,
}

/// Keeps what was touched and where the ball went, and makes the patch of it.
///
/// # Example
/// ```
/// use nalgebra::{Isometry3, Point3, Vector3};
/// use touchup::{mesh::{FaceTree, TriMesh}, patch::{Patcher, PatcherParams}, touch::{Sample, Wrench}};
///
/// // a scan of 20 mm that lies 0.4 mm too high
/// let p = |x: f64, y: f64| Point3::new(x * 1e-3, y * 1e-3, 0.4e-3);
/// let scan = TriMesh::new(vec![p(0., 0.), p(20., 0.), p(20., 20.), p(0., 20.)], vec![[0, 1, 2], [0, 2, 3]])?;
/// let mut patcher = Patcher::new(PatcherParams::new(1.5e-3, None, 0.3e-3))?;
/// // a ball slides over the real surface, z = 0, in lines 1 mm apart
/// for i in 0..8000_i64 {
///     let (line, along) = ((i / 800) as f64, (i % 800) as f64 * 0.0125e-3);
///     let x = if line % 2.0 == 0.0 { 5e-3 + along } else { 15e-3 - along };
///     let pose_ot = Isometry3::translation(x, 5e-3 + line * 1e-3, 1.5e-3);
///     let wrench = Wrench { force: Vector3::new(0.0, 0.0, 2.0), torque: Vector3::zeros() };
///     patcher.push(&Sample { stamp_ns: i * 1_000_000, pose_ot, wrench });
/// }
/// let mesh = patcher.patched(&scan, &FaceTree::new(&scan))?.mesh;
/// let tree = FaceTree::new(&mesh);
/// let found = tree.closest(&mesh, &Point3::new(10e-3, 10e-3, 0.0), 1e-3).ok_or("no face")?;
/// assert!(found.point.z.abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Patcher {
    params: PatcherParams,
    compensator: Compensator,
    finder: TouchFinder,
    contacts: ContactStore,
    swept: SweptSpace,
}

/// Edge of the cells of one mean contact, in radii.
const CONTACT_CELL: f64 = 1.0 / 3.0;
/// Edge of the cells of one centre, in radii.
const SWEPT_CELL: f64 = 0.1;
/// A contact that the ball went into by more than this is none, in radii: four times the noise of a usual tracker.
const REFUTED_DEPTH: f64 = 0.133;
/// A contact farther outside of the scan than this belongs to something else, in radii.
const OUTSIDE: f64 = 4.0;
/// Normals within this many radii …
const FAN_WIDTH: f64 = 0.4;
/// … that differ by more than 25° are those of an edge.
const FAN_COSINE: f64 = 0.906;
/// Rounds in which the region grows over squares where scan and patch cannot be joined.
const GROWTH: usize = 3;
/// A budget below this many faces is none: a box has twelve.
const LEAST_BUDGET: f64 = 5000.0;
/// Rounds in which the lattice is made coarser to keep the budget.
const COARSER: usize = 3;
/// Places the planes of the lattice, in pitches, where no coordinate that a person chose falls on them.
const ORIGIN: [f64; 3] = [0.164_607_9, 0.312_756_1, 0.460_895_1];

impl Patcher {
    /// A patcher that has felt nothing yet.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn new(params: PatcherParams) -> Result<Self, SettingError> {
        params.check()?;
        let radius = params.evidence.radius;
        Ok(Self {
            compensator: Compensator::new(params.compensator)?,
            finder: TouchFinder::new(params.touches)?,
            contacts: ContactStore::new(CONTACT_CELL * radius, params.evidence.field.reach),
            swept: SweptSpace::of_tip(
                TipBody::new(params.touches.shape, params.touches.radius)?,
                SWEPT_CELL * radius,
                5.0 / 3.0 * radius,
            ),
            params,
        })
    }

    /// The settings.
    pub fn params(&self) -> &PatcherParams {
        &self.params
    }

    /// Takes the next sample, which is later than the one before. What it says counts once the smoothing window around it
    /// is complete.
    pub fn push(&mut self, sample: &Sample) {
        let tip = self.compensator.compensate(sample);
        let ball = self.ball();
        let Self { finder, contacts, swept, .. } = self;
        finder.push(&tip, |touch| keep(contacts, swept, ball, &touch));
    }

    /// What was touched, as it was kept.
    pub fn contacts(&self) -> &ContactStore {
        &self.contacts
    }

    /// Radius of the tip when it is a ball, m.
    fn ball(&self) -> Option<f64> {
        let touches = &self.params.touches;
        (touches.shape == TipShape::Ball).then_some(touches.radius)
    }

    /// The scan with its touched part meshed anew; vertices and faces that were not touched keep their ids.
    ///
    /// - `scan`: as it came, with the tree over its faces.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice.
    pub fn patched(&mut self, scan: &TriMesh, tree: &FaceTree) -> Result<Patched, MeshError> {
        let Made { pitch, restored, patch } = self.make(scan, tree);
        let (mesh, ids) = patch.applied_to(scan)?;
        let mut support = vec![Support::Scan; mesh.vertex_slots()];
        for ((key, _), id) in patch.vertices.iter().zip(ids) {
            if let Some(id) = id {
                support[id.0 as usize] = support_of(&key, &restored);
            }
        }
        if let Some(radius) = self.ball() {
            mark_unreachable(&mesh, &mut support, &self.swept, radius)?;
        }
        Ok(Patched {
            mesh,
            support,
            pitch,
            removed_faces: patch.removed.len(),
            added_faces: patch.faces.len(),
            open_squares: patch.open.len(),
        })
    }

    /// The patch for all that was felt so far, within the budget.
    fn make(&mut self, scan: &TriMesh, tree: &FaceTree) -> Made {
        let ball = self.ball();
        let Self { finder, contacts, swept, params, .. } = self;
        finder.flush(|touch| keep(contacts, swept, ball, &touch));
        let radius = params.evidence.radius;
        let deepest = radius * (1.0 - REFUTED_DEPTH);
        let bounds = bounds_of(scan, OUTSIDE * radius);
        contacts.refute(|mean| {
            swept.nearest(&mean.point).is_some_and(|(distance, _)| distance < deepest)
                || is_elsewhere(&mean.point, scan, tree, &bounds, OUTSIDE * radius)
        });
        if let Some(radius) = ball {
            two_points::drop_mixed(contacts, radius);
        }
        contacts.mark_fans(FAN_WIDTH * radius, FAN_COSINE);
        let evidence = Evidence { params: &params.evidence, contacts, swept, scan, tree };
        let budget = (params.most_faces * scan.face_count() as f64).max(LEAST_BUDGET);
        let mut made = Made::of(&evidence, params.pitch);
        for _ in 0..COARSER {
            let faces = (scan.face_count() + made.patch.faces.len() - made.patch.removed.len()) as f64;
            if faces <= budget {
                break;
            }
            // the number of faces falls with the square of the pitch
            made = Made::of(&evidence, made.pitch * 1.02 * (faces / budget).sqrt());
        }
        made
    }
}

/// - `ball`: radius of the tip when it is one, m.
fn keep(contacts: &mut ContactStore, swept: &mut SweptSpace, ball: Option<f64>, touch: &Touch) {
    swept.add_place(&TipPlace { centre: touch.centre, axis: touch.axis });
    let Some(contact) = &touch.contact else { return };
    match ball.and_then(|radius| two_points::split(contacts, radius, &touch.centre, contact)) {
        Some(two) => two.iter().for_each(|contact| contacts.add(contact)),
        None => contacts.add(contact),
    }
}

/// The box around the scan, wider by `margin` (m).
fn bounds_of(scan: &TriMesh, margin: f64) -> [Point3<f64>; 2] {
    let empty = [Point3::from(Vector3::repeat(f64::INFINITY)), Point3::from(Vector3::repeat(f64::NEG_INFINITY))];
    let [lo, hi] = scan.positions().iter().fold(empty, |[lo, hi], p| [lo.inf(p), hi.sup(p)]);
    [lo - Vector3::repeat(margin), hi + Vector3::repeat(margin)]
}

/// Whether a contact is so far outside that the part of the scan cannot have been touched there.
fn is_elsewhere(p: &Point3<f64>, scan: &TriMesh, tree: &FaceTree, bounds: &[Point3<f64>; 2], reach: f64) -> bool {
    let is_within = bounds[0].inf(p) == bounds[0] && bounds[1].sup(p) == bounds[1];
    !is_within || ScanValue::at(scan, tree, p).is_none_or(|scan| scan.value > reach)
}

/// A patch with the field that it shows.
struct Made {
    pitch: f64,
    restored: Restored,
    patch: Patch,
}

impl Made {
    fn of(evidence: &Evidence<'_>, pitch: f64) -> Self {
        let lattice = Lattice { origin: Point3::from(Vector3::from(ORIGIN) * pitch), pitch };
        let restored = restore(evidence, &lattice);
        let mut region = restored.region();
        let mut patch = contoured(evidence, &lattice, &restored, &region);
        for _ in 0..GROWTH {
            let before = region.len();
            for open in patch.open.iter().filter(|open| open.is_scanned && restored.can_take(open.beyond)) {
                region.insert_with(open.beyond, || ());
            }
            if region.len() == before {
                break;
            }
            patch = contoured(evidence, &lattice, &restored, &region);
        }
        Self { pitch, restored, patch }
    }
}

/// A vertex is touched when most of the corners of its cell are near the surface that was; those on the scan are its own.
fn support_of(key: &VertexKey, restored: &Restored) -> Support {
    let is_touched = |node: &Node| restored.nodes.get(node).is_some_and(|state| state.source == Source::Touch);
    let touched = match *key {
        VertexKey::Scan(_) | VertexKey::Trace { .. } | VertexKey::Pierce(..) => return Support::Scan,
        VertexKey::Cell(cell, _) => (0..8).filter(|&corner| is_touched(&node_at(cell, corner))).count() >= 4,
        VertexKey::Square(square, _) => square.corners().iter().filter(|node| is_touched(node)).count() >= 2,
        VertexKey::Edge(edge) => is_touched(&edge.node) || is_touched(&edge.end()),
    };
    if touched { Support::Touched } else { Support::Guessed }
}

fn contoured(evidence: &Evidence<'_>, lattice: &Lattice, restored: &Restored, region: &Region) -> Patch {
    let cut = Cut::new(lattice, region, evidence.scan, evidence.tree);
    let mut scratch = FieldScratch::default();
    contour(lattice, region, &restored.values(), &cut, &ContourParams::default(), |edge| {
        crossing(restored, evidence, lattice, edge, &mut scratch)
    })
}
