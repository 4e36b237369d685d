//! Growth of a push's time with the logarithm of the scan: t = a + b ln F.

use crate::convergence::{RegressionLine, straight_line};

/// The law, a least-squares fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogLaw {
    /// ns
    pub a_ns: f64,
    /// ns for e times the faces; not negative
    pub b_ns: f64,
}

impl LogLaw {
    /// Fits faces and times (ns); `None` for fewer than two sizes.
    ///
    /// A time that falls with the size counts as constant: noise is no law.
    pub fn fit(points: &[(usize, f64)]) -> Option<Self> {
        let logs: Vec<_> = points
            .iter()
            .map(|&(faces, time)| ((faces as f64).ln(), time))
            .collect();
        let RegressionLine { offset, slope, .. } = straight_line(&logs)?;
        if slope > 0.0 {
            return Some(Self {
                a_ns: offset,
                b_ns: slope,
            });
        }
        let mean = points.iter().map(|(_, time)| time).sum::<f64>() / points.len() as f64;
        Some(Self {
            a_ns: mean,
            b_ns: 0.0,
        })
    }

    /// Time at a number of faces, ns.
    pub fn at(&self, faces: usize) -> f64 {
        self.a_ns + self.b_ns * (faces as f64).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_is_found_again_and_a_fall_is_none() {
        // t = 100 + 10 ln F
        let points = [10_000, 30_000, 100_000]
            .map(|faces: usize| (faces, 100.0 + 10.0 * (faces as f64).ln()));
        let law = LogLaw::fit(&points).unwrap();
        assert!(
            (law.b_ns - 10.0).abs() < 1e-9
                && (law.at(1_000_000) - 238.155_105_579_642_7).abs() < 1e-8,
            "{law:?}"
        );
        let flat = LogLaw::fit(&[(10, 300.0), (1000, 100.0)]).unwrap();
        assert_eq!((flat.b_ns, flat.a_ns), (0.0, 200.0));
        assert_eq!(LogLaw::fit(&[(10, 300.0)]), None);
    }
}
