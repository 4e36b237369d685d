//! No sample costs an allocation once the refiner is warm: counted by the allocator itself.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use nalgebra::{Isometry3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::TriMesh;
use touchup::refine::{GuardParams, RefineParams, Refiner, RoiSize, TipParams};
use touchup::touch::{Sample, Wrench};

#[path = "common/mod.rs"]
mod common;
use common::{grid, within};

/// Counts the requests of each thread.
struct Counter;

thread_local! {
    static REQUESTS: Cell<u64> = const { Cell::new(0) };
}

fn note() {
    let _ = REQUESTS.try_with(|requests| requests.set(requests.get() + 1));
}

// SAFETY: hands every call to the system's allocator unchanged
unsafe impl GlobalAlloc for Counter {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        unsafe { System.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static COUNTER: Counter = Counter;

/// Samples of the path, at 1 kHz.
const PATH: i64 = 2_000;
/// Times that the path is gone again.
const ROUNDS: i64 = 5;
const TIP: TipParams = TipParams { radius: 1.5e-3, stiffness: Some(20e3) };

/// A figure of eight on the true plane z = 0, pressed with 2 N for four fifths of the way and lifted off for the rest;
/// the scan lies up to 0.3 mm off.
fn sample(tick: i64) -> Sample {
    let turn = std::f64::consts::TAU * tick as f64 / PATH as f64;
    let force = if tick % PATH < PATH * 4 / 5 { 2.0 } else { 0.0 };
    let height = TIP.radius - force / 20e3 + if force > 0.0 { 0.0 } else { -0.1e-3 };
    let pose_ot = Isometry3::translation(8e-3 * turn.sin(), 6e-3 * (2.0 * turn).sin(), height);
    let wrench = Wrench { force: Vector3::z() * force, torque: Vector3::zeros() };
    Sample { stamp_ns: tick * 1_000_000, pose_ot, wrench }
}

fn scan() -> TriMesh {
    let mut rng = Pcg64::seed_from_u64(1);
    grid(40, 1e-3, |_, _| within(&mut rng, -0.3e-3, 0.3e-3))
}

/// Allocations of `ROUNDS` times the path after one to warm up.
fn allocations(params: RefineParams) -> u64 {
    let mut refiner = Refiner::new(scan(), params).unwrap();
    (0..PATH).for_each(|tick| {
        refiner.push(&sample(tick)).unwrap();
    });
    let moved = refiner.counts().moved;
    let before = REQUESTS.get();
    for tick in PATH..PATH * (1 + ROUNDS) {
        refiner.push(&sample(tick)).unwrap();
    }
    let requests = REQUESTS.get() - before;
    let moved = refiner.counts().moved - moved;
    assert!(moved > 7_000, "the samples move the mesh: {moved}");
    requests
}

#[test]
fn the_counter_counts() {
    let before = REQUESTS.get();
    let list = std::hint::black_box(vec![1u8; 100]);
    assert_eq!((REQUESTS.get() - before, list.len()), (1, 100));
}

#[test]
fn no_sample_allocates_once_warm() {
    let paper =
        RefineParams { largest_move_edges: 2.6, guard: Some(GuardParams::default()), ..RefineParams::paper(TIP) };
    for (mode, params) in [("robust", RefineParams::robust(TIP)), ("paper", paper)] {
        for roi in [RoiSize::OneRing, RoiSize::Radius(1.5e-3), RoiSize::Radius(4e-3)] {
            assert_eq!(allocations(RefineParams { roi, ..params }), 0, "{mode} {roi:?}");
        }
    }
}
