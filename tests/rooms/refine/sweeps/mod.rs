//! The paper's sweep experiment (Sec 4.3, Fig 11) on `peaks`, and the robust mode where the paper's rule gives up.
//!
//! `TOUCHUP_FULL=1` runs all seeds and sweeps; `--nocapture` or `--show-output` shows the numbers.

use nalgebra::{Isometry3, Vector3};
use touchup::mesh::{FaceId, TriMesh};
use touchup::refine::{GuardParams, RefineCounts, RefineError, Refiner};
use touchup::report::{BLOWN_UP, MeshErrors, PaperSweeps, RobustSweeps, fit_decay, noisy, raster_samples};
use touchup::sim::Peaks;
use touchup::touch::{Sample, Wrench};

mod qualities;

use qualities::qualities;

/// Time between two samples, ns.
const PERIOD_NS: i64 = 5_000_000;

/// Updates cut back, and all updates, since `before`.
fn since(before: &RefineCounts, refiner: &Refiner) -> (u64, u64) {
    let now = refiner.counts();
    (now.cut_back - before.cut_back, now.moved - before.moved)
}

fn full() -> bool {
    std::env::var_os("TOUCHUP_FULL").is_some()
}

/// Errors after 0, 1, 2, … sweeps, as far as it does not blow up.
fn sweeps(run: &mut PaperSweeps, count: usize) -> Vec<MeshErrors> {
    let mut errors = vec![run.errors()];
    println!("  sweep  0: {}", errors[0].row());
    for sweep in 1..=count {
        let before = *run.refiner.counts();
        errors.push(run.sweep(errors[0].distance_mm).unwrap());
        let (cut, moved) = since(&before, &run.refiner);
        println!("  sweep {sweep:2}: {}, cut back {cut} of {moved}", errors[sweep].row());
        if errors[sweep].distance_mm > BLOWN_UP * errors[0].distance_mm {
            println!("  blew up");
            break;
        }
    }
    errors
}

#[test]
fn the_published_rule_reproduces_the_papers_sweeps_where_it_does_not_blow_up() {
    let seeds = if full() { 1..=20 } else { 3..=5 };
    let (mut converged, tried) = (Vec::new(), seeds.clone().count());
    for seed in seeds {
        println!("paper mode, 10 mm edges, guard off, seed {seed}");
        let errors = sweeps(&mut PaperSweeps::new(10e-3, None, seed).unwrap(), 10);
        let distances: Vec<_> = errors.iter().map(|e| e.distance_mm).collect();
        if errors.len() == 11 && distances[10] < 0.5 * distances[0] {
            let decay = fit_decay(&distances[1..]).unwrap();
            println!("  power law {:.3?}\n  exponential {:.3?}", decay.power, decay.exponential);
            converged.push((seed, distances, decay));
        }
    }
    println!(
        "{} of {tried} scans converged; after 0, 1, 10 sweeps (paper and its second implementation: about",
        converged.len()
    );
    println!("2.4 -> 0.55 -> 0.09 mm):");
    for (seed, mm, decay) in &converged {
        println!("  seed {seed}: {:.2} -> {:.2} -> {:.3} mm", mm[0], mm[1], mm[10]);
        assert!(mm.windows(2).all(|pair| pair[1] < pair[0]), "the error falls with each sweep");
        // the paper's own scan goes to 0.23 and 0.038 of its start; others to less than half and a tenth
        assert!(mm[1] < 0.5 * mm[0] && mm[10] < 0.1 * mm[0], "{mm:?}");
        // METHOD 2.8 measured 0.6 to 0.9; which law fits better depends on the scan and is printed above
        assert!(decay.power.rate > 0.3 && decay.power.rate < 1.2, "{decay:?}");
    }
    // the scan whose start is the 2.4 mm of the paper
    let (_, mm, _) = converged.iter().find(|run| run.0 == 3).expect("seed 3 converges");
    assert!((mm[0] - 2.4).abs() < 0.1 && (mm[1] - 0.55).abs() < 0.3 && (mm[10] - 0.09).abs() < 0.03, "{mm:?}");
}

#[test]
fn the_guard_lets_the_published_rule_starve_no_face() {
    let (seeds, counts) = if full() { (1..=5, [10, 3]) } else { (3..=3, [2, 1]) };
    for (edge, count) in [10e-3, 5e-3].into_iter().zip(counts) {
        for seed in seeds.clone() {
            for guard in [Some(GuardParams::default()), None] {
                let name = if guard.is_none() { "off" } else { "on" };
                println!("paper mode, {:.0} mm edges, guard {name}, seed {seed}", 1e3 * edge);
                let mut run = PaperSweeps::new(edge, guard, seed).unwrap();
                let before = qualities(run.refiner.mesh());
                sweeps(&mut run, count);
                if guard.is_some() {
                    assert_no_face_starved(&before, run.refiner.mesh());
                }
            }
        }
    }
}

/// No face has become worse than the guard's limit: 0.15, or nine tenths of what it came with.
#[track_caller]
fn assert_no_face_starved(before: &[f64], mesh: &TriMesh) {
    let limit = GuardParams::default().smallest_quality;
    for (face, (before, now)) in before.iter().zip(qualities(mesh)).enumerate() {
        // a rounding for each of the ten operations behind a quality, and for each of 10⁶ updates at most
        assert!(now >= limit.min(0.9 * before) * (1.0 - 1e-9), "face {face}: from {before} to {now}");
    }
}

#[test]
fn a_handle_that_is_the_closest_face_makes_no_difference_and_one_that_is_not_there_is_refused() {
    let mut chosen = PaperSweeps::new(10e-3, Some(GuardParams::default()), 1).unwrap().refiner;
    let mut sought = chosen.clone();
    let at = chosen.mesh().barycentre(FaceId(7));
    for i in 1..100 {
        let wrench = Wrench { force: Vector3::new(0.3, -0.2, 2.0), torque: Vector3::zeros() };
        let sample =
            Sample { stamp_ns: i * PERIOD_NS, pose_ot: Isometry3::from_parts(at.into(), Default::default()), wrench };
        let missing = RefineError::NoSuchFace { face: 50 };
        assert_eq!(chosen.push_on(FaceId(50), &sample), Err(missing));
        let update = sought.push(&sample).unwrap();
        assert_eq!(chosen.push_on(update.mismatch.unwrap().face, &sample), Ok(update));
    }
    assert_eq!((chosen.mesh().positions(), chosen.counts()), (sought.mesh().positions(), sought.counts()));
    assert!(chosen.counts().moved == 99);
}

/// Robust mode on one noisy scan with 5 mm edges.
fn check_robust(peaks: &Peaks, samples: &[Sample], seed: u64, sweeps: usize) {
    let scan = noisy(&peaks.mesh(5e-3).unwrap(), seed);
    let before = qualities(&scan);
    let mut run = RobustSweeps::new(peaks, scan, samples).unwrap();
    let start = run.errors();
    println!("  seed {seed}, sweep  0: {}", start.row());
    for sweep in 1..=sweeps {
        let counts = *run.refiner.counts();
        let now = run.sweep().unwrap();
        let (cut, moved) = since(&counts, &run.refiner);
        println!("  seed {seed}, sweep {sweep:2}: {}, cut back {cut} of {moved}", now.row());
        assert!(now.distance_mm <= start.distance_mm && now.normal_deg <= start.normal_deg);
        // flipped faces are printed: a scan this noisy brings some 40 of 200, and one more is no blow-up
        assert!(now.farthest_mm <= start.farthest_mm + STRAY_MM);
        assert_no_face_starved(&before, run.refiner.mesh());
    }
}

/// A vertex may come to be this much farther from the surface than the worst of the scan, mm: a sixth of its noise.
const STRAY_MM: f64 = 0.5;

#[test]
fn the_robust_mode_never_blows_up_with_noise_larger_than_half_an_edge() {
    let peaks = Peaks::default();
    println!("true mesh, 5 mm edges: {}", MeshErrors::by_surface(&peaks.mesh(5e-3).unwrap(), &peaks).row());
    let (frictions, sweeps): (&[f64], _) = if full() { (&[0.0, 0.15], 10) } else { (&[0.15], 3) };
    for &friction in frictions {
        let samples = raster_samples(&peaks, friction).unwrap();
        println!("robust mode, 5 mm edges, friction {friction}, {} samples a sweep", samples.len());
        (1..=5).for_each(|seed| check_robust(&peaks, &samples, seed, sweeps));
    }
}
