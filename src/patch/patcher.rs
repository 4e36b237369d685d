//! Samples in, the scan with its touched part meshed anew out.

use nalgebra::{Point3, Vector3};

use super::Region;
use super::contact_store::ContactStore;
use super::contour::{ContourParams, contour};
use super::crossing::crossing;
use super::cut::Cut;
use super::evidence::{Evidence, EvidenceParams};
use super::field::FieldScratch;
use super::lattice::Lattice;
use super::restore::{Restored, restore};
use super::splice::Patch;
use super::swept::SweptSpace;
use super::touches::{Touch, TouchFinder, TouchFinderParams};
use crate::mesh::{FaceTree, MeshError, TriMesh};
use crate::touch::{Compensator, CompensatorParams, Sample, SettingError};

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
/// let mut patcher = Patcher::new(PatcherParams { most_faces: 1e4, ..PatcherParams::new(1.5e-3, None, 0.3e-3) })?;
/// // a ball slides over the real surface, z = 0, in lines 1 mm apart
/// for i in 0..8000_i64 {
///     let (line, along) = ((i / 800) as f64, (i % 800) as f64 * 0.0125e-3);
///     let x = if line % 2.0 == 0.0 { 5e-3 + along } else { 15e-3 - along };
///     let pose_ot = Isometry3::translation(x, 5e-3 + line * 1e-3, 1.5e-3);
///     let wrench = Wrench { force: Vector3::new(0.0, 0.0, 2.0), torque: Vector3::zeros() };
///     patcher.push(&Sample { stamp_ns: i * 1_000_000, pose_ot, wrench });
/// }
/// let mesh = patcher.mesh(&scan, &FaceTree::new(&scan))?;
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
/// Normals within this many radii …
const FAN_WIDTH: f64 = 0.4;
/// … that differ by more than 25° are those of an edge.
const FAN_COSINE: f64 = 0.906;
/// Rounds in which the region grows over squares where scan and patch cannot be joined.
const GROWTH: usize = 3;
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
            swept: SweptSpace::new(SWEPT_CELL * radius, 5.0 / 3.0 * radius),
            params,
        })
    }

    /// Takes the next sample, which is later than the one before. What it says counts once the smoothing window around it
    /// is complete.
    pub fn push(&mut self, sample: &Sample) {
        let tip = self.compensator.compensate(sample);
        let Self { finder, contacts, swept, .. } = self;
        finder.push(&tip, |touch| keep(contacts, swept, &touch));
    }

    /// The scan with its touched part meshed anew; vertices and faces that were not touched keep their ids.
    ///
    /// - `scan`: as it came, with the tree over its faces.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] when 32-bit ids do not suffice.
    pub fn mesh(&mut self, scan: &TriMesh, tree: &FaceTree) -> Result<TriMesh, MeshError> {
        self.patch(scan, tree).applied_to(scan)
    }

    /// The patch for all that was felt so far, within the budget.
    pub fn patch(&mut self, scan: &TriMesh, tree: &FaceTree) -> Patch {
        let Self { finder, contacts, swept, params, .. } = self;
        finder.flush(|touch| keep(contacts, swept, &touch));
        let radius = params.evidence.radius;
        let deepest = radius * (1.0 - REFUTED_DEPTH);
        contacts.refute(|mean| swept.nearest(&mean.point).is_some_and(|(distance, _)| distance < deepest));
        contacts.mark_fans(FAN_WIDTH * radius, FAN_COSINE);
        let evidence = Evidence { params: &params.evidence, contacts, swept, scan, tree };
        let budget = params.most_faces * scan.face_count() as f64;
        let mut pitch = params.pitch;
        let mut patch = patch_of(&evidence, pitch);
        for _ in 0..COARSER {
            let faces = (scan.face_count() + patch.faces.len() - patch.removed.len()) as f64;
            if faces <= budget {
                break;
            }
            // the number of faces falls with the square of the pitch
            pitch *= 1.02 * (faces / budget).sqrt();
            patch = patch_of(&evidence, pitch);
        }
        patch
    }
}

fn keep(contacts: &mut ContactStore, swept: &mut SweptSpace, touch: &Touch) {
    swept.add(&touch.centre);
    if let Some(contact) = &touch.contact {
        contacts.add(contact);
    }
}

fn patch_of(evidence: &Evidence<'_>, pitch: f64) -> Patch {
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
    patch
}

fn contoured(evidence: &Evidence<'_>, lattice: &Lattice, restored: &Restored, region: &Region) -> Patch {
    let cut = Cut::new(lattice, region, evidence.scan, evidence.tree);
    let mut scratch = FieldScratch::default();
    contour(lattice, region, &restored.values(), &cut, &ContourParams::default(), |edge| {
        crossing(restored, evidence, lattice, edge, &mut scratch)
    })
}
