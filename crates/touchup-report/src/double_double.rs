//! Numbers of 32 digits as a sum of two doubles \[Dekker 1971\], with the operations of the closed
//! forms: an independent method for the same answer.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// high + low, |low| ≤ half a rounding of high
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Double2 {
    pub high: f64,
    pub low: f64,
}

/// ln 2
const LN_2: Double2 = Double2 {
    high: std::f64::consts::LN_2,
    low: 2.319_046_813_846_299_6e-17,
};
/// Halvings of the argument of the exponential series.
const HALVINGS: i32 = 9;
/// Terms of that series: (ln 2 / 1024)¹² / 12! is 2e-47.
const TERMS: u32 = 11;

/// The sum with its rounding error, for any order of size.
fn two_sum(a: f64, b: f64) -> Double2 {
    let high = a + b;
    let part = high - a;
    Double2 {
        high,
        low: (a - (high - part)) + (b - part),
    }
}

impl From<f64> for Double2 {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Double2 {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let sum = two_sum(high.high, high.low + low.high);
        two_sum(sum.high, sum.low + low.low)
    }
}

impl Neg for Double2 {
    type Output = Self;

    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Double2 {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double2 {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let low =
            self.high.mul_add(other.high, -high) + (self.high * other.low + self.low * other.high);
        two_sum(high, low)
    }
}

impl Div for Double2 {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let left = self - other * first.into();
        let second = left.high / other.high;
        let left = left - other * second.into();
        Self::from(first) + second.into() + (left.high / other.high).into()
    }
}

impl Double2 {
    /// The exponential; the argument is at most 700.
    pub fn exp(self) -> Self {
        let twos = (self.high / LN_2.high).round();
        let small = self - LN_2 * twos.into();
        let scale = 0.5f64.powi(HALVINGS);
        let x = Self {
            high: small.high * scale,
            low: small.low * scale,
        };
        // e^x − 1 by its series, then (e^x − 1) ← (e^x − 1)² + 2 (e^x − 1), which keeps its digits
        let mut sum = Self::from(0.0);
        for k in (1..=TERMS).rev() {
            sum = (sum + 1.0.into()) * x / f64::from(k).into();
        }
        for _ in 0..HALVINGS {
            sum = sum * sum + sum + sum;
        }
        let (half, rest) = (
            2f64.powi(twos as i32 / 2),
            2f64.powi(twos as i32 - twos as i32 / 2),
        );
        let result = sum + 1.0.into();
        Self {
            high: result.high * half * rest,
            low: result.low * half * rest,
        }
    }

    /// Natural logarithm of a positive number.
    pub fn ln(self) -> Self {
        let mut y = Self::from(self.high.ln());
        // Newton's method for e^y = x doubles the digits
        for _ in 0..2 {
            y = y + self * (-y).exp() - 1.0.into();
        }
        y
    }

    /// Square root of a nonnegative number.
    pub fn sqrt(self) -> Self {
        let root = self.high.sqrt();
        if root == 0.0 {
            return Self::from(0.0);
        }
        // one step of Newton's method doubles the digits
        let near = Self::from(root);
        near + Self::from((self - near * near).high / (2.0 * root))
    }

    /// The nearest double.
    pub fn value(self) -> f64 {
        self.high + self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Digits from tables: e, ln 10, and 1/3.
    #[test]
    fn thirty_digits_of_known_numbers() {
        let off =
            |value: Double2, high: f64, low: f64| (value - Double2 { high, low }).value().abs();
        // e = 2.71828182845904523536028747135266249…
        assert!(
            off(
                Double2::from(1.0).exp(),
                std::f64::consts::E,
                1.445_646_891_729_250_2e-16
            ) < 1e-30
        );
        // ln 10 = 2.30258509299404568401799145468436420…
        assert!(
            off(
                Double2::from(10.0).ln(),
                std::f64::consts::LN_10,
                -2.170_756_223_382_249e-16
            ) < 1e-30
        );
        let third = Double2::from(1.0) / 3.0.into();
        assert!((third * 3.0.into() - 1.0.into()).value().abs() < 1e-31);
        // √2 = 1.41421356237309504880168872420969807…
        assert!(
            off(
                Double2::from(2.0).sqrt(),
                std::f64::consts::SQRT_2,
                -9.667_293_313_452_913e-17
            ) < 1e-31
        );
    }

    #[test]
    fn the_logarithm_undoes_the_exponential() {
        for x in [-600.0, -37.5, -1.0, -1e-9, 1e-12, 0.3, 5.0, 88.8, 650.0] {
            let back = Double2::from(x).exp().ln();
            assert!(
                (back - x.into()).value().abs() < 1e-30 * x.abs().max(1.0),
                "{x}: {back:?}"
            );
        }
    }
}
