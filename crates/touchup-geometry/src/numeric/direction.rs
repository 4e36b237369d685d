//! Length and direction of a vector with components of any size.

use nalgebra::Vector3;

/// Smaller squares have lost digits.
const SMALLEST_SQUARE: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// |v| and v/|v|, even if |v|² would underflow or overflow; the direction of a zero vector is zero.
///
/// If squares lose digits, the components are divided by the largest of them first. Finite for
/// every finite `v`, but for a length beyond the largest number.
#[inline]
pub fn length_and_direction(v: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let squared = v.norm_squared();
    if (SMALLEST_SQUARE..f64::MAX).contains(&squared) {
        let length = squared.sqrt();
        return (length, v / length);
    }
    scaled(v)
}

/// v/|v|; `None` if `v` is zero or not finite.
#[inline]
pub fn direction(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (length, direction) = length_and_direction(v);
    (length > 0.0).then_some(direction)
}

#[cold]
fn scaled(v: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let largest = v.amax();
    if largest == 0.0 || !v.iter().all(|x| x.is_finite()) {
        // every comparison with a NaN length fails
        return (
            if largest == 0.0 { 0.0 } else { f64::NAN },
            Vector3::zeros(),
        );
    }
    let scaled = v / largest;
    let length = scaled.norm();
    (largest * length, scaled / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (2, 3, 6) has the length 7, at every size that leaves its components their digits.
    #[test]
    fn a_direction_is_of_length_1_at_every_size() {
        let wanted = Vector3::new(2.0, 3.0, 6.0) / 7.0;
        for exponent in -1000..1000 {
            let size = 2.0f64.powi(exponent);
            let (length, found) = length_and_direction(&(Vector3::new(2.0, -3.0, 6.0) * size));
            assert!(
                (length / size - 7.0).abs() < 1e-14,
                "2^{exponent}: {length:e}"
            );
            assert!(
                (found - Vector3::new(wanted.x, -wanted.y, wanted.z)).amax() < 1e-15,
                "2^{exponent}: {found}"
            );
        }
    }

    #[test]
    fn denormal_and_zero_and_infinite_vectors_are_told_apart() {
        assert_eq!(
            direction(&Vector3::new(0.0, -5e-324, 0.0)),
            Some(-Vector3::y())
        );
        assert_eq!(
            direction(&Vector3::new(f64::MAX, 0.0, 0.0)),
            Some(Vector3::x())
        );
        for v in [
            Vector3::zeros(),
            Vector3::new(f64::INFINITY, 0.0, 0.0),
            Vector3::new(f64::NAN, 1.0, 0.0),
        ] {
            assert_eq!(direction(&v), None);
        }
    }
}
