//! Real streams: a robot's ball sliding over phantoms under force control, with nothing known of
//! them.
//!
//! The reference is a quadratic surface through the ball's centres within 4 mm, of all passes but
//! the one in question: the centres lie on an offset of the surface, which has the same normals. No
//! force enters it but for its sign.

use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Vector3};
use touchup::reconstruct::{TipTouch, TouchFinder, TouchFinderParams};
use touchup::stylus::{
    BiasParams, CompensatorParams, ContactEstimator, ContactEstimatorParams, ContactGateParams,
    Sample, Tip, TipParams, Wrench, WrenchFrame,
};

use super::Errors;

/// m, from the authors of the recordings
const BALL: f64 = 3.15e-3;
/// Centres within this distance make the reference, m.
const NEAR: f64 = 4e-3;
/// Touches within this time belong to the same pass, ns: 12 mm at 4 mm/s.
const SAME_PASS_NS: i64 = 3_000_000_000;
/// Gap that separates two paths, ns.
const GAP_NS: i64 = 200_000_000;

/// Each recording, and the largest permitted share of the raw force's error after the correction.
///
/// More than half remains in zone2. A constant 0.10 N beside 0.21 N of contact explains it: a bias
/// of the sensor, which the stream never shows in free air. The mean force of passes to and fro,
/// which has no friction, is as wrong there (22°), and without that constant 5° remain of 20°.
const FILES: [(&str, f64); 6] = [
    ("KidneyZ1-21Oct.csv", 0.5),
    ("KidneyZ2-21Oct.csv", 0.5),
    ("KidneyZ3-21Oct.csv", 0.5),
    ("KidneyZ4-21Oct.csv", 0.5),
    ("zone1_adp_wrist_cdp.csv", 0.5),
    ("zone2_adp_wrist_cdp.csv", 0.75),
];

fn tips(path: &Path) -> Vec<Tip> {
    let text = fs::read_to_string(path).unwrap();
    let row =
        |line: &str| -> Vec<f64> { line.split(',').map(|cell| cell.parse().unwrap()).collect() };
    let mut tips: Vec<Tip> = Vec::new();
    for row in text.lines().skip(1).map(row) {
        // a new segment begins a new path
        let stamp_ns = (row[0] * 1e13) as i64 + (row[1] * 1e9) as i64;
        if tips.last().is_none_or(|last| last.stamp_ns < stamp_ns) {
            let pose_ot = Isometry3::translation(row[2] * 1e-3, row[3] * 1e-3, row[4] * 1e-3);
            let force_o = Vector3::new(row[5], row[6], row[7]);
            tips.push(Tip {
                stamp_ns,
                pose_ot,
                force_o,
                torque_o: Vector3::zeros(),
            });
        }
    }
    tips
}

/// Normal at `at` of the surface through the centres around it, on the side of `force`; `None` if
/// other passes are too few or all in line.
#[expect(clippy::too_many_lines)]
fn reference(touches: &[TipTouch], at: usize, force: &Vector3<f64>) -> Option<Vector3<f64>> {
    let here = touches[at];
    let near = |touch: &&TipTouch| {
        (touch.centre - here.centre).norm() < NEAR
            && (touch.stamp_ns - here.stamp_ns).abs() > SAME_PASS_NS
    };
    let arms: Vec<Vector3<f64>> = touches
        .iter()
        .filter(near)
        .map(|touch| touch.centre - here.centre)
        .collect();
    if arms.len() < 40 {
        return None;
    }
    let mean = arms.iter().sum::<Vector3<f64>>() / arms.len() as f64;
    let scatter = arms
        .iter()
        .map(|arm| (arm - mean) * (arm - mean).transpose())
        .sum::<Matrix3<f64>>();
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    if eigen.eigenvalues[order[1]] < 0.12 * eigen.eigenvalues[order[0]] {
        return None;
    }
    let [x, y, z] = order.map(|i| eigen.eigenvectors.column(i).into_owned());
    let z = z * z.dot(force).signum();
    let mut weights = vec![1.0; arms.len()];
    let mut slope = [0.0; 2];
    for _ in 0..3 {
        let terms = |i: usize| {
            let (a, b) = (arms[i].dot(&x) / NEAR, arms[i].dot(&y) / NEAR);
            [1.0, a, b, a * a, a * b, b * b]
        };
        let left = DMatrix::from_fn(arms.len(), 6, |row, column| {
            terms(row)[column] * weights[row]
        });
        let right = DVector::from_fn(arms.len(), |row, _| arms[row].dot(&z) / NEAR * weights[row]);
        let fit = (left.transpose() * &left)
            .cholesky()?
            .solve(&(left.transpose() * right));
        let residual = |i: usize| {
            (arms[i].dot(&z) / NEAR
                - terms(i)
                    .iter()
                    .zip(fit.iter())
                    .map(|(t, c)| t * c)
                    .sum::<f64>())
            .abs()
        };
        let mut residuals: Vec<f64> = (0..arms.len()).map(residual).collect();
        weights
            .iter_mut()
            .zip(&residuals)
            .for_each(|(weight, residual)| *weight = *residual);
        residuals.sort_unstable_by(f64::total_cmp);
        let usual = 3.0 * residuals[residuals.len() / 2] + 1e-9;
        weights
            .iter_mut()
            .for_each(|weight| *weight = 1.0 / (1.0 + (*weight / usual).powi(2)).sqrt());
        slope = [fit[1], fit[2]];
    }
    Some((z - x * slope[0] - y * slope[1]).normalize())
}

#[test]
#[expect(clippy::too_many_lines)]
fn on_real_streams_at_most_half_of_the_raw_forces_error_is_left() {
    let Some(folder) = crate::shared::shared("force/vu_dvrk_exploration") else {
        return;
    };
    for (name, largest_share) in FILES {
        let tips = tips(&folder.join(name));
        let params = TouchFinderParams {
            // 66 Hz, 4 mm/s
            half_window_ns: 200_000_000,
            largest_gap_ns: GAP_NS,
            cone_cosine: Some(0.82),
            ..TouchFinderParams::new(BALL, None)
        };
        let gate = ContactGateParams {
            on: 0.1,
            off: 0.05,
            free: 0.04,
        };
        let mut contacts = ContactEstimator::new(ContactEstimatorParams {
            compensator: CompensatorParams {
                wrench_frame: WrenchFrame::Object,
                ..CompensatorParams::default()
            },
            bias: Some(BiasParams::default()),
            gate: Some(gate),
            ..ContactEstimatorParams::new(TipParams {
                radius: BALL,
                stiffness: None,
            })
        })
        .unwrap();
        let sample_of = |&Tip {
                             stamp_ns,
                             pose_ot,
                             force_o,
                             torque_o,
                         }: &Tip| Sample {
            stamp_ns,
            pose_ot,
            wrench: Wrench {
                force: force_o,
                torque: torque_o,
            },
        };
        let mut finder = TouchFinder::new(params).unwrap();
        let mut touches = Vec::new();
        for tip in &tips {
            finder.push(contacts.observe(&sample_of(tip)).unwrap(), |touch| {
                touches.push(touch)
            });
        }
        finder.flush(|touch| touches.push(touch));
        assert_eq!(touches.len(), tips.len());
        let (mut raw, mut corrected) = (Errors::default(), Errors::default());
        for at in (7..tips.len() - 7).step_by(10) {
            let span = &touches[at - 7..=at + 7];
            let seconds = (span[14].stamp_ns - span[0].stamp_ns) as f64 * 1e-9;
            let halves = [
                span[7].centre - span[0].centre,
                span[14].centre - span[7].centre,
            ];
            // slides, and does not turn round here
            let slides = (span[14].centre - span[0].centre).norm() > 2e-3 * seconds
                && halves[0].dot(&halves[1]) > 0.0;
            let Some(contact) = touches[at].contact.filter(|_| slides && seconds < 0.5) else {
                continue;
            };
            let force = tips[at - 7..=at + 7]
                .iter()
                .map(|tip| tip.force_o)
                .sum::<Vector3<f64>>();
            if let Some(normal) = reference(&touches, at, &force) {
                raw.note(&force, &normal);
                corrected.note(&contact.normal, &normal);
            }
        }
        let count = raw.0.len();
        let ([raw, _], [corrected, worse]) = (raw.figures(), corrected.figures());
        let friction = finder.friction().unwrap();
        println!(
            "{name}: {count} places, raw {raw:.2}, corrected {corrected:.2} (p90 {worse:.2}) degrees, left {:.2}; friction {:.3} ± \
             {:.3}, spread {:.3}",
            corrected / raw,
            friction.mu,
            friction.sigma,
            friction.spread
        );
        assert!(count > 300, "{name}: {count}");
        assert!(
            corrected < largest_share * raw,
            "{name}: {corrected} of {raw}"
        );
    }
}
