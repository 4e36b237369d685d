//! Touched parts: a known surface, a bad scan of it, and the contacts.

use nalgebra::{Point3, Vector3};

use super::touched_error::TouchedError;
use crate::Effort;
use crate::convergence::region_over;
use crate::error::{MeasureError, MeasureResult};
use touchup_features::compare::{CompareError, TouchedRegion};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, ContactGateParams, Sample,
    SyncParams, Synchroniser, TipParams,
};
use touchup_sim::{
    PathParams, Peaks, Plate, RasterDirection, ScannerParams, SimError, Stroke, StylusParams,
    Surface, add_vertex_noise, plan_demo, raster, scan, touch,
};

/// A caller's scan, true part, and contacts; all in O.
#[derive(Clone, Debug)]
pub struct GivenPart {
    /// name in the report
    pub name: String,
    /// the unrefined scan
    pub scan: TriMesh,
    /// the true part
    pub truth: TriMesh,
    /// in order of time
    pub samples: Vec<Sample>,
    /// tip of the probe
    pub tip: TipParams,
    /// weight, bias, frames of the samples
    pub compensator: CompensatorParams,
    /// standard deviation of the scan's vertices, m
    pub scan_noise: f64,
}

/// A measured contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeltContact {
    /// centre of a rigid tip, m: the only knowledge without a force
    pub reported: Point3<f64>,
    /// point of the ball under the force, m
    pub point: Point3<f64>,
}

/// A part with one or more scans of different density.
pub(super) struct Part {
    pub given: GivenPart,
    /// tree of the true part
    tree: FaceTree,
    /// touched region of the true part
    region: TouchedRegion,
    pub contacts: Vec<FeltContact>,
    /// scans beside the given one
    others: Vec<TriMesh>,
}

/// Seed of scans and paths.
const SEED: u64 = 1;
/// Edge length of the true mesh of `peaks`, m: its chords are within 5 µm of the surface.
const TRUE_EDGE: f64 = 0.25e-3;
/// Largest distance of the true plate's round walls from circles, m.
const CHORD_ERROR: f64 = 10e-6;
/// A contact is on the part when the ball's surface is within this distance of it, m.
const ON_PART: f64 = 1e-3;

/// Peaks and plate, and the given part.
pub(super) fn parts(
    effort: Effort,
    given: Option<&GivenPart>,
    progress: &mut dyn FnMut(&str),
) -> MeasureResult<Vec<Part>> {
    // the given part first: it may be refused
    let given = given
        .map(|given| Part::new(given.clone(), Vec::new()))
        .transpose()?;
    progress("whole scan: touching peaks");
    let peaks = touched_peaks(effort)?;
    progress("whole scan: touching the plate");
    let plate = touched_plate(effort)?;
    Ok([peaks, plate].into_iter().chain(given).collect())
}

/// A simulated part, touched by a hand-held stylus.
///
/// - `scans`: the first is the one for all methods.
fn simulated(
    name: &str,
    (surface, truth): (&dyn Surface, TriMesh),
    path: &[Stroke],
    mut scans: Vec<TriMesh>,
) -> MeasureResult<Part> {
    let params = StylusParams::default();
    let touch = touch(surface, path, &params, SEED)?;
    let mut sync = Synchroniser::new(SyncParams::default())?;
    let mut samples = Vec::new();
    for message in &touch.messages {
        sync.push(*message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    let given = GivenPart {
        name: name.to_owned(),
        scan: scans.remove(0),
        truth,
        samples,
        tip: TipParams {
            radius: params.radius,
            stiffness: Some(params.stiffness),
        },
        compensator: CompensatorParams::default(),
        scan_noise: ScannerParams::default().noise,
    };
    Part::new(given, scans)
}

/// Peaks: vertices with the noise and the bias of the usual scanner, and a raster over it.
fn touched_peaks(effort: Effort) -> MeasureResult<Part> {
    let peaks = Peaks::default();
    let ScannerParams { noise, bias, .. } = ScannerParams::default();
    let scanned = |&edge: &f64| -> Result<TriMesh, SimError> {
        let mut scan = peaks.mesh(edge)?;
        add_vertex_noise(&mut scan, noise, &Vector3::new(0.0, 0.0, bias), SEED);
        Ok(scan)
    };
    let edges = [2.4e-3, 4.8e-3, 1.2e-3, 0.6e-3];
    let region = region_over(
        &peaks,
        effort.choose(10e-3, 22e-3),
        StylusParams::default().radius,
    );
    let path = raster(
        &region,
        RasterDirection::AlongX,
        &PathParams {
            pitch: 1e-3,
            ..PathParams::default()
        },
    )?;
    let scans = edges[..effort.choose(3, 4)]
        .iter()
        .map(scanned)
        .collect::<Result<_, _>>()?;
    simulated("peaks", (&peaks, peaks.mesh(TRUE_EDGE)?), &path, scans)
}

/// The demo's plate with its scan and touches; a quick one in one raster over its features.
fn touched_plate(effort: Effort) -> MeasureResult<Part> {
    let (plate, usual) = (Plate::default(), ScannerParams::default());
    let mut path = plan_demo(&plate, &PathParams::default())?;
    if effort.is_quick {
        // the first raster: approach, raster, retreat
        path.truncate(3);
    }
    let edges = [usual.edge, 4.8e-3, 1.2e-3];
    let scanned = |&edge: &f64| {
        scan(
            &plate,
            &ScannerParams {
                edge,
                seed: SEED,
                ..usual
            },
        )
    };
    let scans = edges[..effort.choose(2, 3)]
        .iter()
        .map(scanned)
        .collect::<Result<_, _>>()?;
    simulated("plate", (&plate, plate.mesh(CHORD_ERROR)?), &path, scans)
}

impl Part {
    /// - `others`: scans beside the given one.
    fn new(given: GivenPart, others: Vec<TriMesh>) -> MeasureResult<Self> {
        let GivenPart {
            truth,
            tip,
            compensator,
            ..
        } = &given;
        let tree = FaceTree::new(truth);
        let (compensator, gate, tip) = (*compensator, Some(ContactGateParams::default()), *tip);
        let params = ContactEstimatorParams {
            compensator,
            bias: None,
            gate,
            tip,
            sliding: None,
        };
        let mut estimator = ContactEstimator::new(params)?;
        let (mut contacts, mut touched) = (Vec::new(), Vec::new());
        for sample in &given.samples {
            let Ok(sample) = estimator.observe(sample) else {
                continue;
            };
            let (centre, Some(surface)) = (sample.centre, sample.surface) else {
                continue;
            };
            let reported = Point3::from(sample.tip.pose_ot.translation.vector);
            contacts.push(FeltContact {
                reported,
                point: centre - tip.radius * surface.normal,
            });
            touched.extend(
                tree.closest(truth, &centre, tip.radius + ON_PART)
                    .map(|hit| hit.point),
            );
        }
        let region = TouchedRegion::of(touched);
        if region.contacts().is_empty() {
            return Err(MeasureError::NothingTouched {
                samples: given.samples.len(),
                name: given.name,
            });
        }
        Ok(Self {
            given,
            tree,
            region,
            contacts,
            others,
        })
    }

    /// The scans; the first is the one for all methods.
    pub fn scans(&self) -> impl Iterator<Item = &TriMesh> {
        std::iter::once(&self.given.scan).chain(&self.others)
    }

    /// Error of a mesh against the touched region of the true part.
    pub fn error_of(&self, mesh: &TriMesh) -> Result<TouchedError, CompareError> {
        TouchedError::of(mesh, &self.given.truth, &self.tree, &self.region)
    }
}
