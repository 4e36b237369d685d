//! Cost of one sample with everything on, and lag of the patch: samples come at 1 kHz in real time,
//! the patch has a thread of its own.
//!
//! A ball slides over a wavy plate in a raster, with contacts a little below the scan. One line for
//! each minute: times of [`Engine::answer`], including the wait for the follow-up of the sample
//! before, the age of the touches in the patch (in time of the samples), its late renewals, faces,
//! and memory of the process.
//!
//! `cargo bench --bench live [-- FACES [SECONDS [fast]]]`; `fast` does not wait for real time: each
//! push waits for the patch, and the bench does not time pushes.

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
use touchup::sim::wavy::{RADIUS, SIDE, STEP_NS, STIFFNESS, noisy_slide_on, wavy_plate};
use touchup::stylus::TipParams;

/// Width of the raster, m: passed over each 4.6 minutes.
const WIDTH: f64 = 40e-3;
/// Samples in one line of the table.
const MINUTE: usize = 60_000;

#[expect(clippy::too_many_lines)]
fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|argument| argument != "--bench")
        .collect();
    let number = |at: usize, default: usize| {
        arguments
            .get(at)
            .map_or(default, |x| x.parse().expect("a whole number"))
    };
    let (faces, seconds, is_fast) = (number(0, 1_000_000), number(1, 60), arguments.len() > 2);
    let mesh = wavy_plate(faces).expect("it can be counted");
    let tip = TipParams {
        radius: RADIUS,
        stiffness: Some(STIFFNESS),
    };
    // with the uncertainty of the patch
    let params = PatcherParams::new(RADIUS, Some(STIFFNESS), SCAN_NOISE);
    let scan = Arc::new((mesh.clone(), FaceTree::new(&mesh)));
    let pace = Pace {
        is_patient: is_fast,
        ..Pace::default()
    };
    let renewal = Renewal::Beside {
        scan,
        pace,
        room: 1 << 18,
        gate: Gate::default(),
    };
    let refine = RefineParams::robust(tip);
    let mut live = Engine::new(mesh.clone(), refine, Some(params), renewal)
        .expect("the settings are in range");
    println!(
        "{} faces, {:.0} MB; {seconds} s at 1 kHz",
        mesh.face_count(),
        resident()
    );
    let (mut times, mut ages, mut late, begun) = (Vec::new(), Vec::new(), 0, Instant::now());
    for i in 0..seconds * 1000 {
        let sample = noisy_slide_on(SIDE, i, WIDTH);
        let due = Duration::from_millis(if is_fast { 0 } else { i as u64 });
        // a busy wait slows the other thread down on a shared core
        let now = begun.elapsed();
        std::thread::sleep(due.saturating_sub(now));
        let waited = if is_fast {
            Duration::ZERO
        } else {
            now.saturating_sub(due)
        };
        let start = Instant::now();
        live.answer(&sample).expect("the sample is sound");
        times.push((waited + start.elapsed()).as_nanos() as u64);
        live.follow().expect("the thread of the patch goes on");
        if i > 1000 {
            ages.extend(
                live.patched_until_ns()
                    .map(|until_ns| (sample.stamp_ns - until_ns) as u64 / 1000),
            );
        }
        if (i + 1) % MINUTE == 0 || i + 1 == seconds * 1000 {
            times.sort_unstable();
            ages.sort_unstable();
            let [median, p99, p999] = [0.5, 0.99, 0.999].map(|share| percentile(&times, share));
            println!(
                "{:5.1} min: answer median {median:6.2} us p99 {p99:7.2} p99.9 {p999:7.1} max {:8.0}; patch behind {:4.1} ms, \
                 p99 {:4.1}; late {:4}; {} faces, {:.0} MB, {:.0} s",
                (i + 1) as f64 * STEP_NS as f64 * 1e-9 / 60.0,
                percentile(&times, 1.0),
                percentile(&ages, 0.5),
                percentile(&ages, 0.99),
                live.counts().late - late,
                live.refiner().mesh().face_count(),
                resident(),
                begun.elapsed().as_secs_f64(),
            );
            late = live.counts().late;
            times.clear();
            ages.clear();
        }
    }
}
