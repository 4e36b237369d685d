//! General tolerances of a drawing, for dimensions without their own.

use touchup_method::names;

names! {
    /// A class of ISO 2768-1:1989 for linear dimensions without broken edges (its table 1).
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum GeneralTolerance {
        /// f
        Fine = "iso2768-f",
        /// m
        Medium = "iso2768-m",
        /// c
        Coarse = "iso2768-c",
        /// v
        VeryCoarse = "iso2768-v",
    }
}

/// Lower end of the first range, mm: below it the drawing has to state a tolerance.
const LEAST_MM: f64 = 0.5;
/// Upper ends of the ranges, mm, inclusive, and the deviations ± mm of f, m, c and v; NaN if the
/// standard has none.
const LINEAR_MM: [(f64, [f64; 4]); 8] = [
    (3.0, [0.05, 0.1, 0.2, f64::NAN]),
    (6.0, [0.05, 0.1, 0.3, 0.5]),
    (30.0, [0.1, 0.2, 0.5, 1.0]),
    (120.0, [0.15, 0.3, 0.8, 1.5]),
    (400.0, [0.2, 0.5, 1.2, 2.5]),
    (1000.0, [0.3, 0.8, 2.0, 4.0]),
    (2000.0, [0.5, 1.2, 3.0, 6.0]),
    (4000.0, [f64::NAN, 2.0, 4.0, 8.0]),
];

impl GeneralTolerance {
    /// Permissible deviation ± of a linear dimension, mm; `None` if the class has none for that
    /// size.
    pub fn linear_mm(self, nominal_mm: f64) -> Option<f64> {
        let class = Self::ALL.iter().position(|class| *class == self)?;
        let range = LINEAR_MM
            .iter()
            .find(|(end, _)| nominal_mm <= *end)
            .filter(|_| nominal_mm >= LEAST_MM);
        range
            .map(|(_, deviations)| deviations[class])
            .filter(|deviation| deviation.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows and ends of ranges as in the table.
    #[test]
    fn ranges_end_where_the_table_says() {
        use GeneralTolerance::{Coarse, Fine, Medium, VeryCoarse};
        let table = [
            (Medium, 0.5, Some(0.1)),
            (Medium, 0.49, None),
            (Medium, 3.0, Some(0.1)),
            (Coarse, 3.0, Some(0.2)),
            (Coarse, 3.01, Some(0.3)),
            (Medium, 6.0, Some(0.1)),
            (Medium, 6.01, Some(0.2)),
            (Fine, 30.0, Some(0.1)),
            (Fine, 31.0, Some(0.15)),
            (Medium, 400.0, Some(0.5)),
            (VeryCoarse, 2.0, None),
            (VeryCoarse, 4000.0, Some(8.0)),
            (Fine, 2000.5, None),
            (Coarse, 4000.1, None),
        ];
        for (class, nominal_mm, expected) in table {
            assert_eq!(
                class.linear_mm(nominal_mm),
                expected,
                "{class} of {nominal_mm} mm"
            );
        }
    }
}
