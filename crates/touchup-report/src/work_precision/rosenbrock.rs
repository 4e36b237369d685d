//! RODAS, an implicit stiff solver: a Rosenbrock method of order 4(3) with six stages, stiffly
//! accurate and L-stable \[Hairer Wanner 1996, IV.7\]. One Jacobian and one factorisation a step,
//! and no iteration.

use nalgebra::{Matrix4, Vector4};

use super::problem::State;

/// Coefficients for the form without products of matrix and stage: for the arguments, for the
/// right-hand sides, and γ.
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [
        0.946_678_528_081_582_6,
        0.255_701_169_898_328_4,
        0.0,
        0.0,
        0.0,
    ],
    [
        3.314_825_187_068_521,
        2.896_124_015_972_201,
        0.998_641_913_997_781_7,
        0.0,
        0.0,
    ],
    [
        1.221_224_509_226_641,
        6.019_134_481_288_629,
        12.537_083_329_320_87,
        -0.687_886_036_105_895,
        0.0,
    ],
    [
        1.221_224_509_226_641,
        6.019_134_481_288_629,
        12.537_083_329_320_87,
        -0.687_886_036_105_895,
        1.0,
    ],
];
const C: [[f64; 5]; 6] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [
        -2.430_093_356_833_875,
        -0.206_359_915_709_191_5,
        0.0,
        0.0,
        0.0,
    ],
    [
        -0.107_352_905_815_137_5,
        -9.594_562_251_023_355,
        -20.470_286_148_096_16,
        0.0,
        0.0,
    ],
    [
        7.496_443_313_967_647,
        -10.246_804_314_643_52,
        -33.999_903_528_199_05,
        11.708_908_932_061_6,
        0.0,
    ],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];
const GAMMA: f64 = 0.25;
/// Most steps, accepted or not.
const MAX_STEPS: usize = 20_000;
/// A step may shrink to a fifth and grow sixfold; aim below the tolerance.
const CHANGE: (f64, f64) = (0.2, 6.0);
const SAFETY: f64 = 0.9;

/// Integrates dy/dt = `rate`(y), which does not depend on time, from 0 to `end`; `scale` and
/// `relative` as in [`touchup_method::haptic::dormand_prince`]. `None`: it gave
/// up.
pub fn integrate(
    start: State,
    end: f64,
    scale: State,
    relative: f64,
    mut rate: impl FnMut(&State) -> State,
    mut jacobian: impl FnMut(&State) -> Matrix4<f64>,
) -> Option<State> {
    let (mut y, mut time, mut dt) = (Vector4::from(start), 0.0, end);
    let mut slope = Vector4::from(rate(&start));
    let mut matrix = jacobian(&start);
    for _ in 0..MAX_STEPS {
        let is_last = dt >= end - time;
        let step = if is_last { end - time } else { dt };
        let (next, error) = stages(&y, step, &slope, &matrix, &mut rate)?;
        let error = (0..4)
            .map(|i| (error[i] / scale[i].max(y[i].abs()).max(next[i].abs())).abs())
            .fold(0.0, f64::max);
        let error = if next.iter().all(|x| x.is_finite()) {
            error / relative
        } else {
            f64::INFINITY
        };
        if error <= 1.0 {
            if is_last {
                return Some(next.into());
            }
            (y, time) = (next, time + step);
            slope = Vector4::from(rate(&y.into()));
            matrix = jacobian(&y.into());
        }
        dt = step * (SAFETY * error.powf(-0.25)).clamp(CHANGE.0, CHANGE.1);
    }
    None
}

/// The result of order 4, and its difference from order 3.
fn stages(
    y: &Vector4<f64>,
    dt: f64,
    slope: &Vector4<f64>,
    jacobian: &Matrix4<f64>,
    rate: &mut impl FnMut(&State) -> State,
) -> Option<(Vector4<f64>, Vector4<f64>)> {
    let factors = (Matrix4::identity() / (GAMMA * dt) - jacobian).lu();
    let mut k = [Vector4::zeros(); 6];
    let mut argument = *y;
    for stage in 0..6 {
        argument = *y;
        let mut side = Vector4::zeros();
        for before in 0..stage {
            argument += A[stage][before] * k[before];
            side += C[stage][before] / dt * k[before];
        }
        side += if stage == 0 {
            *slope
        } else {
            Vector4::from(rate(&argument.into()))
        };
        k[stage] = factors.solve(&side)?;
    }
    Some((argument + k[5], k[5]))
}
