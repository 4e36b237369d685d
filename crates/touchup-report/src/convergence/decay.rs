//! Two laws of error decay from sweep to sweep, fitted by least squares to the error's logarithm.

/// A least-squares line through points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegressionLine {
    /// y at x = 0
    pub offset: f64,
    /// y over x
    pub slope: f64,
    /// root mean square residual in y
    pub left: f64,
    /// coefficient of determination, 1 − Σ residual² / Σ (y − mean)²; `None` for constant y
    pub r_squared: Option<f64>,
}

/// The line through (x, y); `None` for fewer than two points, equal x, or non-finite values.
pub fn straight_line(points: &[(f64, f64)]) -> Option<RegressionLine> {
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| {
        (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2))
    });
    let slope = Some(xy / xx).filter(|slope| points.len() > 1 && slope.is_finite())?;
    let left: f64 = points
        .iter()
        .map(|p| (p.1 - y - slope * (p.0 - x)).powi(2))
        .sum();
    let there: f64 = points.iter().map(|p| (p.1 - y).powi(2)).sum();
    let r_squared = (there > 0.0).then(|| 1.0 - left / there);
    Some(RegressionLine {
        offset: y - slope * x,
        slope,
        left: (left / n).sqrt(),
        r_squared,
    })
}

/// Both laws of the same errors, each as a line through their logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decay {
    /// e ∝ exp(−rate · sweep) \[paper, Fig 11\], over the sweep: falls by the rate
    pub exponential: RegressionLine,
    /// e ∝ sweep^−exponent, over the logarithm of the sweep: falls by the exponent
    pub power: RegressionLine,
}

/// Fits both laws to the errors after sweep 1, 2, 3, …; `None` for fewer than two errors, or for an
/// error that is not above 0.
pub fn fit_decay(errors: &[f64]) -> Option<Decay> {
    let fit = |x: fn(f64) -> f64| {
        let points = errors
            .iter()
            .enumerate()
            .map(|(i, e)| (x(i as f64 + 1.0), e.ln()));
        straight_line(&points.collect::<Vec<_>>())
    };
    Some(Decay {
        exponential: fit(|sweep| sweep)?,
        power: fit(f64::ln)?,
    })
}

impl Decay {
    /// The error after `sweep` (1 or later) by the exponential and by the power law.
    pub fn at(&self, sweep: f64) -> [f64; 2] {
        let Self { exponential, power } = self;
        [
            exponential.offset.exp() * (exponential.slope * sweep).exp(),
            power.offset.exp() * sweep.powf(power.slope),
        ]
    }
}
