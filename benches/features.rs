//! Time to find the features of a scan of 1M vertices, and to update known features with new
//! touches.

#[path = "../tests/common/plate_stream.rs"]
mod plate_stream;
#[path = "../tests/common/subdivided.rs"]
mod subdivided;

use divan::{Bencher, black_box};
use plate_stream::{contacts_of, plate_stream};
use subdivided::subdivided;
use touchup::features::{Tracker, detect};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{Patcher, PatcherParams, UncertaintyParams};
use touchup::sim::{Plate, ScannerParams, StylusParams, Surface, scan};
use touchup::stylus::ProbedPoint;

fn main() {
    divan::main();
}

/// Divisions of each face into four: 72,000 and 1,150,000 vertices.
const DIVISIONS: [u32; 2] = [1, 3];

/// The demo's plate by a good scanner: 5 µm of noise, edges rounded by 20 µm.
fn fine_scan(divisions: u32) -> TriMesh {
    let params = ScannerParams {
        edge: 620e-6,
        noise: 5e-6,
        bias: 0.0,
        rounding: 20e-6,
        closes_holes_below: 0.0,
        rigid_shift: 0.0,
        rigid_turn: 0.0,
        ..ScannerParams::default()
    };
    let plate = Plate::default();
    let coarse = scan(&plate, &params).expect("the plate can be scanned");
    (0..divisions).fold(coarse, |mesh, _| {
        subdivided(&mesh, |p| plate.closest(&p).point)
    })
}

#[divan::bench(args = DIVISIONS, sample_count = 5)]
fn found(bencher: Bencher, divisions: u32) {
    let mesh = fine_scan(divisions);
    let features = detect(&mesh, &[]).features;
    println!(
        "{} vertices, {} features",
        mesh.vertex_count(),
        features.len()
    );
    bencher.bench_local(|| detect(black_box(&mesh), &[]));
}

/// The demo's plate after all touches, and the touches.
fn touched_plate() -> (TriMesh, Vec<ProbedPoint>) {
    let stylus = StylusParams::default();
    let (stream, _) = plate_stream(&stylus, 1);
    let mut params = PatcherParams::new(stylus.radius, Some(stylus.stiffness), stream.noise);
    params.uncertainty = Some(UncertaintyParams::new(stream.noise));
    let mut patcher = Patcher::new(params).expect("the settings are sound");
    let contacts = contacts_of(stylus.radius, Some(stylus.stiffness), &stream.samples);
    contacts.iter().for_each(|contact| patcher.push(contact));
    patcher.flush();
    let patched = patcher
        .patched(&stream.scan, &FaceTree::new(&stream.scan))
        .expect("the plate can be meshed");
    (patched.mesh, patcher.probed().to_vec())
}

/// Touches of 20 ms that fall on a feature, with all earlier ones known.
#[divan::bench(sample_count = 200)]
fn followed(bencher: Bencher) {
    let (mesh, touches) = touched_plate();
    let mut known = Tracker::default();
    known.renew(&mesh, &touches[..touches.len() - 2000]);
    // the first news that change a feature
    let is_news = |count: &usize| !known.clone().update(&touches[..*count]).is_empty();
    let until = (touches.len() - 2000..touches.len())
        .find(is_news)
        .expect("the demo ends with runs along walls");
    bencher
        .with_inputs(|| known.clone())
        .bench_local_refs(|tracker| tracker.update(black_box(&touches[..until + 5])));
}
