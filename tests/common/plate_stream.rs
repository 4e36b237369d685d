//! The demo plate scanned and touched: the samples that a program gets.

use touchup::mesh::TriMesh;
use touchup::sim::{PathParams, Plate, ScannerParams, StylusParams, Touch, plan_demo, scan, touch};
use touchup::touch::{Sample, SyncParams, Synchroniser};

/// A scan of the demo plate and what was felt on the plate.
pub struct PlateStream {
    pub scan: TriMesh,
    /// standard deviation of the scan, m
    pub noise: f64,
    pub samples: Vec<Sample>,
}

/// With what the simulator knows of it.
pub fn plate_stream(stylus: &StylusParams, seed: u64) -> (PlateStream, Touch) {
    let plate = Plate::default();
    let scanner = ScannerParams { seed, ..ScannerParams::default() };
    let hand = PathParams { radius: stylus.radius, ..PathParams::default() };
    let scan = scan(&plate, &scanner).unwrap();
    let touch = touch(&plate, &plan_demo(&plate, &hand).unwrap(), stylus, seed).unwrap();
    let mut samples = Vec::new();
    let mut sync = Synchroniser::new(SyncParams::default()).unwrap();
    for message in &touch.messages {
        sync.push(*message);
        samples.extend(std::iter::from_fn(|| sync.next_sample()));
    }
    sync.finish();
    samples.extend(std::iter::from_fn(|| sync.next_sample()));
    (PlateStream { scan, noise: scanner.noise, samples }, touch)
}
