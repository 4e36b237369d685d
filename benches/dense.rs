//! Cost of one sample on scans of any density: [`Engine::answer`] and [`Engine::follow`] for edges
//! from a thirtieth of the tip's radius to twice that, and from 10 thousand to 5 million faces.
//!
//! A ball slides over a wavy plate in a raster at 1 kHz, with contacts a little below the scan. One
//! line for each density and size: time to begin, time from a sample to its answer and until the
//! engine awaits the next one, the largest number of vertices that a sample moves, memory of the
//! process. By default the bench replays a recording as fast as it reads samples, with the patch
//! made at the end; with `live` it runs in real time with the patch on a thread of its own, and
//! prints the age of the touches in the patch and the number of late renewals. A due sample waits
//! until the engine has followed the sample before; the wait counts as its time.
//!
//! `cargo bench --bench dense [-- live] [SECONDS [FACES…]]`

mod memory;
mod sliding;

use std::sync::Arc;
use std::time::{Duration, Instant};

use memory::resident;
use sliding::{SCAN_NOISE, percentile};
use touchup::haptic::RefineParams;
use touchup::live::{Engine, Gate, Pace, Renewal};
use touchup::mesh::FaceTree;
use touchup::reconstruct::PatcherParams;
use touchup::sim::wavy::{RADIUS, STIFFNESS, noisy_slide_on, plate};
use touchup::stylus::TipParams;

/// Edge lengths, in radii of the tip.
const EDGES: [f64; 6] = [1.0 / 30.0, 0.1, 0.25, 0.5, 1.0, 2.0];
/// Smallest side of a plate, m: a raster on it turns after three radii.
const SMALLEST_SIDE: f64 = 5.0 * RADIUS;

/// Median, 99 % and 99.9 % of times in ns, as text in us; sorts them.
fn shown(times: &mut [u64]) -> String {
    times.sort_unstable();
    let [median, p99, p999, longest] =
        [0.5, 0.99, 0.999, 1.0].map(|share| percentile(times, share));
    format!("median {median:6.2} us p99 {p99:7.2} p99.9 {p999:7.1} max {longest:8.0}")
}

#[expect(clippy::too_many_lines)]
fn measure(faces: usize, edge: f64, seconds: usize, is_live: bool) {
    let side = edge * (faces as f64 / 2.0).sqrt();
    if side < SMALLEST_SIDE {
        return;
    }
    let mesh = plate(faces, side).expect("it can be counted");
    let tip = TipParams {
        radius: RADIUS,
        stiffness: Some(STIFFNESS),
    };
    let params = PatcherParams::new(RADIUS, Some(STIFFNESS), SCAN_NOISE);
    let renewal = if is_live {
        let scan = Arc::new((mesh.clone(), FaceTree::new(&mesh)));
        Renewal::Beside {
            scan,
            pace: Pace::default(),
            room: 1 << 18,
            gate: Gate::default(),
        }
    } else {
        Renewal::AtEnd
    };
    let start = Instant::now();
    let engine = Engine::new(mesh, RefineParams::robust(tip), Some(params), renewal);
    let mut engine = engine.expect("the settings are in range");
    let build_ms = start.elapsed().as_secs_f64() * 1e3;
    let (mut answers, mut followed, mut ages, mut moved) = (Vec::new(), Vec::new(), Vec::new(), 0);
    let begun = Instant::now();
    for i in 0..seconds * 1000 {
        let sample = noisy_slide_on(side, i, 0.8 * side);
        let mut waited = Duration::ZERO;
        if is_live {
            let (due, now) = (Duration::from_millis(i as u64), begun.elapsed());
            waited = now.saturating_sub(due);
            // a busy wait slows the other thread down on a shared core
            std::thread::sleep(due.saturating_sub(now));
        }
        let start = Instant::now();
        engine.answer(&sample).expect("the sample is sound");
        let answered = waited + start.elapsed();
        engine.follow().expect("the thread of the patch goes on");
        let done = waited + start.elapsed();
        if i > 1000 {
            answers.push(answered.as_nanos() as u64);
            followed.push(done.as_nanos() as u64);
            moved += engine.refiner().moved_vertices().len();
            ages.extend(
                engine
                    .patched_until_ns()
                    .map(|until_ns| (sample.stamp_ns - until_ns) as u64 / 1000),
            );
        }
    }
    ages.sort_unstable();
    print!(
        "edge {:6.3} mm {faces:>8} faces: begun in {build_ms:5.0} ms; answer {}; followed {}; {:6.1} vertices; {:.0} MB",
        edge * 1e3,
        shown(&mut answers),
        shown(&mut followed),
        moved as f64 / answers.len() as f64,
        resident(),
    );
    if is_live {
        let ([median, p99], counts) = (
            [0.5, 0.99].map(|share| percentile(&ages, share)),
            engine.counts(),
        );
        print!(
            "; patch behind {median:5.1} ms, p99 {p99:6.1}; late {} of {}",
            counts.late, counts.renewals
        );
    }
    println!();
}

fn main() {
    let numbers: Vec<usize> = std::env::args()
        .filter_map(|word| word.parse().ok())
        .collect();
    let is_live = std::env::args().any(|word| word == "live");
    let seconds = numbers
        .first()
        .copied()
        .unwrap_or(if is_live { 10 } else { 100 });
    let sizes = if numbers.len() > 1 {
        numbers[1..].to_vec()
    } else {
        vec![10_000, 200_000, 1_000_000, 5_000_000]
    };
    for faces in sizes {
        for share in EDGES {
            measure(faces, share * RADIUS, seconds, is_live);
        }
    }
}
