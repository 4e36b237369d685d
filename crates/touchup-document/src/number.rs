//! Readable numbers.

/// Superscript digits.
const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
/// Range of numbers in full digits; others are multiples of a power of ten.
const WRITTEN_OUT: std::ops::Range<f64> = 1e-4..1e6;

/// A number with three significant digits, without trailing zeros: 0.0123, 12300, 1.23·10⁻⁷.
pub fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return if value.is_nan() { "none" } else { "infinite" }.to_owned();
    }
    // round first: 999.7 has four digits before the point
    let rounded = format!("{value:.2e}");
    let (digits, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    // parsing drops trailing zeros
    let [rounded, digits] = [&rounded, digits].map(|text| text.parse().unwrap_or(value));
    if WRITTEN_OUT.contains(&rounded.abs()) {
        return rounded.to_string();
    }
    format!("{digits}·{}", power_of_ten(exponent.parse().unwrap_or(0)))
}

/// 10 with a raised exponent: 10⁻⁷.
pub fn power_of_ten(exponent: i32) -> String {
    let digits = exponent.unsigned_abs().to_string();
    let raised = digits
        .bytes()
        .map(|digit| RAISED[usize::from(digit - b'0')]);
    let sign = if exponent < 0 { "⁻" } else { "" };
    format!("10{sign}{}", raised.collect::<String>())
}

/// A number with this number of decimals and a true minus sign; none before a 0.
pub fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.trim_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text.replace('-', "−")
    }
}

/// A number with these decimals and a sign before any number.
pub fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "−")
}

/// Smallest and largest value; `None` without values.
pub fn range(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .map(|value| (value, value))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_and_no_more() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (12.0, "12"),
            (0.012345, "0.0123"),
            (-1.2355, "-1.24"),
            (999.7, "1000"),
            (99.96, "100"),
            (12345.0, "12300"),
            (999_400.0, "999000"),
            (999_600.0, "1·10⁶"),
            (5e6, "5·10⁶"),
            (1.234e-7, "1.23·10⁻⁷"),
            (-2.5e12, "-2.5·10¹²"),
            (0.000_1, "0.0001"),
            (f64::INFINITY, "infinite"),
            (f64::NAN, "none"),
        ] {
            assert_eq!(three_digits(value), text);
        }
    }
}
