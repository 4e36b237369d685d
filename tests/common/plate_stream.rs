//! The demo plate scanned and touched: the samples that a program gets.

use std::collections::BTreeMap;
use std::sync::Mutex;

use nalgebra::Isometry3;
use touchup::mesh::TriMesh;
use touchup::sim::{
    PathParams, Plate, RasterDirection, RasterRegion, ScannerParams, Stroke, StylusParams, Surface,
    Touch, plan_demo, raster, scan, touch,
};
use touchup::stylus::{
    ContactEstimator, ContactEstimatorParams, ContactSample, Sample, SyncParams, Synchroniser,
    TipParams, TipShape,
};

/// A scan of the demo plate and the contacts on the plate.
pub struct PlateStream {
    pub scan: TriMesh,
    /// standard deviation of the scan, m
    pub noise: f64,
    pub samples: Vec<Sample>,
}

/// A ball or a flat end goes over the plate as in the demo; a cone, which would get stuck in holes,
/// over it in two rasters that let it sink into them a little.
fn path(stylus: &StylusParams) -> Vec<Stroke> {
    let plate = Plate::default();
    let hand = PathParams {
        radius: stylus.radius,
        ..PathParams::default()
    };
    if !matches!(stylus.shape, TipShape::Cone { .. }) {
        return plan_demo(&plate, &hand).unwrap();
    }
    let (low, high, frame_ov) = (
        [0.009, 0.008].into(),
        [0.065, 0.042].into(),
        Isometry3::identity(),
    );
    let region = RasterRegion {
        frame_ov,
        low,
        high,
        floor: 8e-3,
        clear: 20e-3,
    };
    let hand = PathParams {
        pitch: 1e-3,
        ..hand
    };
    [RasterDirection::AlongX, RasterDirection::AlongY]
        .iter()
        .flat_map(|lines| raster(&region, *lines, &hand).unwrap())
        .collect()
}

/// The contact state of each sample, for a tip of this radius (m) and stiffness (N/m).
pub fn contacts_of(radius: f64, stiffness: Option<f64>, samples: &[Sample]) -> Vec<ContactSample> {
    let params = ContactEstimatorParams::new(TipParams { radius, stiffness });
    let mut estimator = ContactEstimator::new(params).unwrap();
    samples
        .iter()
        .map(|sample| *estimator.observe(sample).unwrap())
        .collect()
}

/// The plate as the scanner of the demo sees it, computed once for each seed.
pub fn plate_scan(seed: u64) -> TriMesh {
    static SCANS: Mutex<BTreeMap<u64, TriMesh>> = Mutex::new(BTreeMap::new());
    let scanned = || {
        scan(
            &Plate::default(),
            &ScannerParams {
                seed,
                ..ScannerParams::default()
            },
        )
        .unwrap()
    };
    SCANS
        .lock()
        .unwrap()
        .entry(seed)
        .or_insert_with(scanned)
        .clone()
}

/// With the simulator's ground truth.
pub fn plate_stream(stylus: &StylusParams, seed: u64) -> (PlateStream, Touch) {
    stream_of(&Plate::default(), stylus, seed)
}

/// The plate as scanned, and a part that is almost the plate as touched.
pub fn stream_of(part: &dyn Surface, stylus: &StylusParams, seed: u64) -> (PlateStream, Touch) {
    let touch = touch(part, &path(stylus), stylus, seed).unwrap();
    let mut samples = Vec::new();
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    for message in &touch.messages {
        sync.push(*message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    (
        PlateStream {
            scan: plate_scan(seed),
            noise: ScannerParams::default().noise,
            samples,
        },
        touch,
    )
}
