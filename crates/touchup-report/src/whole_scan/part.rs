//! The parts that are touched: a known surface, a bad scan of it, and the contacts.

use nalgebra::{Isometry3, Point2, Point3, Vector3};

use super::WholeScanError;
use crate::Effort;
use touchup_core::compare::TouchedRegion;
use touchup_core::haptic::TipParams;
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, ContactGateParams, Sample, SyncParams, Synchroniser,
};
use touchup_sim::{
    Lines, PathParams, Peaks, Plate, RasterRegion, ScannerParams, Stroke, StylusParams, Surface, add_vertex_noise,
    plan_demo, raster, scan, touch,
};

/// A scan, the true part, and the contacts on it, given by the caller; all in O.
#[derive(Clone, Debug)]
pub struct GivenPart {
    /// how the report calls it
    pub name: String,
    /// as it came
    pub scan: TriMesh,
    /// the true part
    pub truth: TriMesh,
    /// in order of time
    pub samples: Vec<Sample>,
    /// what touched
    pub tip: TipParams,
    /// weight, bias, frames of the samples
    pub compensator: CompensatorParams,
    /// standard deviation of the scan's vertices, m
    pub scan_noise: f64,
}

/// A measured contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeltContact {
    /// centre of a tip that does not bend, m: all that is known without a force
    pub reported: Point3<f64>,
    /// point of the ball under the force, m
    pub point: Point3<f64>,
}

/// A part with one scan of it or several, finer and coarser ones.
pub(super) struct Part {
    pub name: String,
    pub truth: TriMesh,
    pub tree: FaceTree,
    pub samples: Vec<Sample>,
    pub tip: TipParams,
    pub compensator: CompensatorParams,
    pub scan_noise: f64,
    /// the touched region of `truth`
    pub region: TouchedRegion,
    pub contacts: Vec<FeltContact>,
    /// the first is the one on which all methods are run
    pub scans: Vec<TriMesh>,
}

/// Seed of scans and paths.
const SEED: u64 = 1;
/// Edge length of the true mesh of `peaks`, m: its chords are within 5 µm of the surface.
const TRUE_EDGE: f64 = 0.25e-3;
/// Largest distance of the true plate's round walls from circles, m.
const CHORD_ERROR: f64 = 10e-6;
/// A contact is on the part when the ball's surface is within this distance of it, m.
const ON_PART: f64 = 1e-3;

/// Peaks and plate, and the part that was given.
pub(super) fn parts(
    effort: Effort,
    given: Option<&GivenPart>,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Part>, WholeScanError> {
    // what is given first: it may be refused
    let given = given.map(|given| Part::new(given.clone(), Vec::new())).transpose()?;
    progress("whole scan: touching peaks");
    let peaks = touched_peaks(effort)?;
    progress("whole scan: touching the plate");
    let plate = touched_plate(effort)?;
    Ok([peaks, plate].into_iter().chain(given).collect())
}

/// The samples that a hand-held stylus gives on a surface.
fn contacts_on(surface: &dyn Surface, path: &[Stroke]) -> Result<Vec<Sample>, WholeScanError> {
    let touch = touch(surface, path, &StylusParams::default(), SEED)?;
    let mut sync = Synchroniser::new(SyncParams::default())?;
    let mut samples = Vec::new();
    for message in &touch.messages {
        sync.push(*message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    Ok(samples)
}

fn usual_tip() -> TipParams {
    let StylusParams { radius, stiffness, .. } = StylusParams::default();
    TipParams { radius, stiffness: Some(stiffness) }
}

/// Peaks: vertices with the noise and the bias of the usual scanner, and a raster over it.
fn touched_peaks(effort: Effort) -> Result<Part, WholeScanError> {
    let (peaks, tip) = (Peaks::default(), usual_tip());
    let ScannerParams { noise, bias, .. } = ScannerParams::default();
    let scanned = |edge: f64| -> Result<TriMesh, WholeScanError> {
        let mut scan = peaks.mesh(edge)?;
        add_vertex_noise(&mut scan, noise, &Vector3::new(0.0, 0.0, bias), SEED);
        Ok(scan)
    };
    let (bounds, half) = (peaks.bounds(), effort.choose(10e-3, 22e-3));
    let region = RasterRegion {
        frame_ov: Isometry3::identity(),
        low: Point2::new(-half, -half),
        high: Point2::new(half, half),
        floor: bounds.min.z,
        clear: bounds.max.z + 2.0 * tip.radius,
    };
    let path = raster(&region, Lines::AlongX, &PathParams { pitch: 1e-3, ..PathParams::default() })?;
    let given = GivenPart {
        name: "peaks".to_owned(),
        scan: scanned(2.4e-3)?,
        truth: peaks.mesh(TRUE_EDGE)?,
        samples: contacts_on(&peaks, &path)?,
        tip,
        compensator: CompensatorParams::default(),
        scan_noise: noise,
    };
    let edges: &[f64] = effort.choose(&[4.8e-3, 1.2e-3], &[4.8e-3, 1.2e-3, 0.6e-3]);
    Part::new(given, edges.iter().map(|&edge| scanned(edge)).collect::<Result<_, _>>()?)
}

/// The plate of the demo, scanned and touched as there; a quick one in one raster over its features.
fn touched_plate(effort: Effort) -> Result<Part, WholeScanError> {
    let (plate, tip) = (Plate::default(), usual_tip());
    let scanned = |edge: f64| scan(&plate, &ScannerParams { edge, seed: SEED, ..ScannerParams::default() });
    let mut path = plan_demo(&plate, &PathParams::default())?;
    if effort.is_quick {
        // the first raster: there, over it, and away
        path.truncate(3);
    }
    let given = GivenPart {
        name: "plate".to_owned(),
        scan: scanned(ScannerParams::default().edge)?,
        truth: plate.mesh(CHORD_ERROR)?,
        samples: contacts_on(&plate, &path)?,
        tip,
        compensator: CompensatorParams::default(),
        scan_noise: ScannerParams::default().noise,
    };
    let edges: &[f64] = effort.choose(&[4.8e-3], &[4.8e-3, 1.2e-3]);
    Part::new(given, edges.iter().map(|&edge| scanned(edge)).collect::<Result<_, _>>()?)
}

impl Part {
    /// - `others`: scans beside the one that was given.
    fn new(given: GivenPart, others: Vec<TriMesh>) -> Result<Self, WholeScanError> {
        let GivenPart { name, scan, truth, samples, tip, compensator, scan_noise } = given;
        let tree = FaceTree::new(&truth);
        let gate = Some(ContactGateParams::default());
        let mut estimator =
            ContactEstimator::new(ContactEstimatorParams { compensator, bias: None, gate, tip, sliding: None })?;
        let (mut contacts, mut touched) = (Vec::new(), Vec::new());
        for sample in &samples {
            let Ok(sample) = estimator.observe(sample) else { continue };
            let (centre, Some(surface)) = (sample.centre, sample.surface) else { continue };
            let reported = Point3::from(sample.tip.pose_ot.translation.vector);
            contacts.push(FeltContact { reported, point: centre - tip.radius * surface.normal });
            touched.extend(tree.closest(&truth, &centre, tip.radius + ON_PART).map(|hit| hit.point));
        }
        let region = TouchedRegion::of(touched);
        if region.contacts().is_empty() {
            return Err(WholeScanError::NothingTouched { name, samples: samples.len() });
        }
        let scans = [scan].into_iter().chain(others).collect();
        Ok(Self { name, truth, tree, samples, tip, compensator, scan_noise, region, contacts, scans })
    }
}
