//! The paper's sweep experiment (Sec 4.3, Fig 11) on `peaks`, and the robust mode where the paper's rule gives up.
//!
//! `TOUCHUP_FULL=1` runs all seeds and sweeps; `--nocapture` or `--show-output` shows the numbers.

use nalgebra::{Isometry3, Point2, Point3, Vector3};
use touchup::mesh::{FaceId, TriMesh};
use touchup::refine::{GuardParams, RefineCounts, RefineError, RefineParams, Refiner, TipParams};
use touchup::sim::coupled::GuidedStylus;
use touchup::sim::{
    Lines, Moment, PathParams, Peaks, Region, SensorParams, StylusParams, Surface, add_vertex_noise, raster, touch,
};
use touchup::touch::{Sample, Wrench};

#[path = "sweeps/measure.rs"]
mod measure;

use measure::{Errors, by_index, by_surface, fit_decay, qualities};

/// Time between two samples of the paper, ns and s.
const PERIOD_NS: i64 = 5_000_000;
const PERIOD: f64 = 5e-3;
/// Samples on each face: 20 s.
const SAMPLES_PER_FACE: usize = 4000;

/// A mean error that has grown to so many times its start does not come back.
const BLOWN_UP: f64 = 2.0;

/// Updates cut back, and all updates, since `before`.
fn since(before: &RefineCounts, refiner: &Refiner) -> (u64, u64) {
    let now = refiner.counts();
    (now.cut_back - before.cut_back, now.moved - before.moved)
}

fn full() -> bool {
    std::env::var_os("TOUCHUP_FULL").is_some()
}

/// The true mesh with 3 mm of noise on each coordinate, 2 mm too high.
fn noisy(truth: &TriMesh, seed: u64) -> TriMesh {
    let mut scan = truth.clone();
    add_vertex_noise(&mut scan, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), seed);
    scan
}

/// The paper's rule with a point for a tip, and a clock.
struct PaperRun {
    truth: TriMesh,
    refiner: Refiner,
    params: RefineParams,
    stamp_ns: i64,
}

impl PaperRun {
    fn new(edge: f64, guard: Option<GuardParams>, seed: u64) -> Self {
        let truth = Peaks::default().mesh(edge).unwrap();
        let params = RefineParams { guard, ..RefineParams::paper(TipParams { radius: 0.0, stiffness: None }) };
        let refiner = Refiner::new(noisy(&truth, seed), params).unwrap();
        Self { truth, refiner, params, stamp_ns: 0 }
    }

    /// Sets the stylus to each face in turn and lets both go where Eq 8–11 and Eq 6–7 take them. The true face feels as
    /// its plane does in the paper's contact model.
    ///
    /// Stops when the mean distance error is beyond `limit` (m).
    fn sweep(&mut self, limit: f64) -> Errors {
        let (model, stylus) = (self.params.dynamics.model, GuidedStylus::default());
        for (face, _) in self.truth.faces() {
            let (b, n) = (self.truth.barycentre(face), self.truth.normal(face));
            let force = |p: &Point3<f64>| model.force((p - b).dot(&n)) * n;
            let mut p = self.refiner.mesh().barycentre(face);
            for _ in 0..SAMPLES_PER_FACE {
                let mesh = self.refiner.mesh();
                let (b, n) = (mesh.barycentre(face), mesh.normal(face));
                let wrench = Wrench { force: force(&p), torque: Vector3::zeros() };
                self.stamp_ns += PERIOD_NS;
                let pose_ot = Isometry3::translation(p.x, p.y, p.z);
                self.refiner.push_on(face, &Sample { stamp_ns: self.stamp_ns, pose_ot, wrench }).unwrap();
                p = stylus.step(&p, &b, &n, force, PERIOD);
            }
            if self.errors().distance > limit {
                break;
            }
        }
        self.errors()
    }

    fn errors(&self) -> Errors {
        by_index(self.refiner.mesh(), &self.truth)
    }

    /// Errors after 0, 1, 2, … sweeps, as far as it does not blow up.
    fn sweeps(&mut self, count: usize) -> Vec<Errors> {
        let mut errors = vec![self.errors()];
        let limit = BLOWN_UP * errors[0].distance;
        println!("  sweep  0: {}", errors[0].row());
        for sweep in 1..=count {
            let before = *self.refiner.counts();
            errors.push(self.sweep(limit));
            let (cut, moved) = since(&before, &self.refiner);
            println!("  sweep {sweep:2}: {}, cut back {cut} of {moved}", errors[sweep].row());
            if errors[sweep].distance > limit {
                println!("  blew up");
                break;
            }
        }
        errors
    }
}

#[test]
fn the_published_rule_reproduces_the_papers_sweeps_where_it_does_not_blow_up() {
    let seeds = if full() { 1..=20 } else { 3..=5 };
    let (mut converged, tried) = (Vec::new(), seeds.clone().count());
    for seed in seeds {
        println!("paper mode, 10 mm edges, guard off, seed {seed}");
        let errors = PaperRun::new(10e-3, None, seed).sweeps(10);
        let distances: Vec<_> = errors.iter().map(|e| 1e3 * e.distance).collect();
        if errors.len() == 11 && distances[10] < 0.5 * distances[0] {
            let decay = fit_decay(&distances[1..]);
            println!("  (exponent, rms of ln): power law {:.3?}, exponential {:.3?}", decay.power, decay.exponential);
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
        assert!(decay.power.0 > 0.3 && decay.power.0 < 1.2, "{decay:?}");
    }
    // the scan whose start is the 2.4 mm of the paper
    let (_, mm, _) = converged.iter().find(|run| run.0 == 3).expect("seed 3 converges");
    assert!((mm[0] - 2.4).abs() < 0.1 && (mm[1] - 0.55).abs() < 0.3 && (mm[10] - 0.09).abs() < 0.03, "{mm:?}");
}

#[test]
fn the_guard_lets_the_published_rule_starve_no_face() {
    let (seeds, sweeps) = if full() { (1..=5, [10, 3]) } else { (3..=3, [2, 1]) };
    for (edge, sweeps) in [10e-3, 5e-3].into_iter().zip(sweeps) {
        for seed in seeds.clone() {
            for guard in [Some(GuardParams::default()), None] {
                let name = if guard.is_none() { "off" } else { "on" };
                println!("paper mode, {:.0} mm edges, guard {name}, seed {seed}", 1e3 * edge);
                let mut run = PaperRun::new(edge, guard, seed);
                let before = qualities(run.refiner.mesh());
                run.sweeps(sweeps);
                if guard.is_some() {
                    assert_no_face_starved(&before, run.refiner.mesh());
                }
            }
        }
    }
}

/// No face has become worse than the guard's limit, other than those that came so.
#[track_caller]
fn assert_no_face_starved(before: &[f64], mesh: &TriMesh) {
    let limit = GuardParams::default().smallest_quality;
    for (face, (before, now)) in before.iter().zip(qualities(mesh)).enumerate() {
        // a rounding for each of the ten operations behind a quality, and for each of 10⁶ updates at most
        assert!(now >= before.min(limit) * (1.0 - 1e-9), "face {face}: from {before} to {now}");
    }
}

const RADIUS: f64 = 1.5e-3;
const STIFFNESS: f64 = 20e3;

/// One raster of a ball over the whole square: what a perfect sensor reports every millisecond.
fn raster_samples(peaks: &Peaks, friction: f64) -> Vec<Sample> {
    let (bounds, half) = (peaks.bounds(), 0.5 * 50e-3);
    let region = Region {
        frame_ov: Isometry3::identity(),
        low: Point2::new(-half, -half),
        high: Point2::new(half, half),
        floor: bounds.min.z,
        clear: bounds.max.z + 2.0 * RADIUS,
    };
    let path = raster(&region, Lines::AlongX, &PathParams { radius: RADIUS, ..PathParams::default() });
    let stylus = StylusParams {
        radius: RADIUS,
        stiffness: STIFFNESS,
        friction,
        force_variation: 0.0,
        tilt: 0.0,
        stray: 0.0,
        sensor: SensorParams::ideal(),
        ..StylusParams::default()
    };
    let moments = touch(peaks, &path.unwrap(), &stylus, 1).unwrap().moments;
    let sample = |(i, moment): (usize, &Moment)| {
        let mut pose_ot = moment.pose_ot;
        pose_ot.translation.vector -= moment.force_o / STIFFNESS;
        let force = moment.pose_ot.rotation.inverse() * moment.force_o;
        Sample { stamp_ns: (i as i64 + 1) * 1_000_000, pose_ot, wrench: Wrench { force, torque: Vector3::zeros() } }
    };
    moments.iter().enumerate().map(sample).collect()
}

/// A sweep of the robust mode.
struct Raster<'a> {
    peaks: &'a Peaks,
    samples: &'a [Sample],
    refiner: Refiner,
    last_ns: i64,
}

impl Raster<'_> {
    fn sweep(&mut self) -> Errors {
        let start_ns = self.last_ns;
        for sample in self.samples {
            self.last_ns = start_ns + sample.stamp_ns;
            self.refiner.push(&Sample { stamp_ns: self.last_ns, ..*sample }).unwrap();
        }
        by_surface(self.refiner.mesh(), self.peaks)
    }
}

#[test]
fn a_handle_that_is_the_closest_face_makes_no_difference_and_one_that_is_not_there_is_refused() {
    let mut chosen = PaperRun::new(10e-3, Some(GuardParams::default()), 1).refiner;
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
    let tip = TipParams { radius: RADIUS, stiffness: Some(STIFFNESS) };
    let params = RefineParams { scan_noise: 3e-3, ..RefineParams::robust(tip) };
    let scan = noisy(&peaks.mesh(5e-3).unwrap(), seed);
    let (start, before) = (by_surface(&scan, peaks), qualities(&scan));
    println!("  seed {seed}, sweep  0: {}", start.row());
    let mut run = Raster { peaks, samples, refiner: Refiner::new(scan, params).unwrap(), last_ns: 0 };
    for sweep in 1..=sweeps {
        let counts = *run.refiner.counts();
        let now = run.sweep();
        let (cut, moved) = since(&counts, &run.refiner);
        println!("  seed {seed}, sweep {sweep:2}: {}, cut back {cut} of {moved}", now.row());
        assert!(now.distance <= start.distance && now.normal <= start.normal);
        // flipped faces are printed: a scan this noisy brings some 40 of 200, and one more is no blow-up
        assert!(now.farthest <= start.farthest + STRAY);
        assert_no_face_starved(&before, run.refiner.mesh());
    }
}

/// A vertex may come to be this much farther from the surface than the worst of the scan, m: a sixth of its noise.
const STRAY: f64 = 0.5e-3;

#[test]
fn the_robust_mode_never_blows_up_with_noise_larger_than_half_an_edge() {
    let peaks = Peaks::default();
    println!("true mesh, 5 mm edges: {}", by_surface(&peaks.mesh(5e-3).unwrap(), &peaks).row());
    let (frictions, sweeps): (&[f64], _) = if full() { (&[0.0, 0.15], 10) } else { (&[0.15], 3) };
    for &friction in frictions {
        let samples = raster_samples(&peaks, friction);
        println!("robust mode, 5 mm edges, friction {friction}, {} samples a sweep", samples.len());
        (1..=5).for_each(|seed| check_robust(&peaks, &samples, seed, sweeps));
    }
}
