//! Units of mesh files, which carry none: the user names it, and implausible sizes are refused.

use std::fmt;

use nalgebra::Vector3;
use serde::Serialize;

use touchup_method::words;

/// Smallest diagonal of the bounding box: smaller parts offer nothing to a ball tip of about a
/// millimetre.
pub const SMALLEST_M: f64 = 1e-3;

/// Largest diagonal of the bounding box: beyond the reach of any arm, while a car body or an
/// aircraft panel is below.
pub const LARGEST_M: f64 = 20.0;

words! {
    /// The unit of a mesh file's coordinates; the commonest first, in the order of suggestion.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize)]
    pub enum MeshUnit {
        /// 1 m
        #[value(name = "m")]
        Metre = "m",
        /// 0.001 m
        #[default]
        #[value(name = "mm")]
        Millimetre = "mm",
        /// 0.0254 m
        #[value(name = "inch")]
        Inch = "inch",
    }
}

impl MeshUnit {
    /// Length of the unit, m.
    pub const fn metres(self) -> f64 {
        self.metres_and_plural().0
    }

    const fn metres_and_plural(self) -> (f64, &'static str) {
        match self {
            Self::Metre => (1.0, "metres"),
            Self::Millimetre => (1e-3, "millimetres"),
            Self::Inch => (0.0254, "inches"),
        }
    }
}

/// An implausible size of a workpiece, in its stated unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplausibleSize {
    /// sides of the bounding box, in `unit`
    pub sides: Vector3<f64>,
    /// the unit named by the user
    pub unit: MeshUnit,
    /// a unit that makes the size plausible
    pub suggestion: Option<MeshUnit>,
}

impl ImplausibleSize {
    /// Refuses a box whose diagonal lies outside [`SMALLEST_M`] to [`LARGEST_M`].
    ///
    /// - `sides_m`: sides of the bounding box, m.
    pub(super) fn check(sides_m: Vector3<f64>, unit: MeshUnit) -> Result<(), Self> {
        let plausible = |diagonal_m: f64| (SMALLEST_M..=LARGEST_M).contains(&diagonal_m);
        if plausible(sides_m.norm()) {
            return Ok(());
        }
        let sides = sides_m / unit.metres();
        let suggestion = MeshUnit::ALL
            .into_iter()
            .find(|u| plausible(sides.norm() * u.metres()));
        Err(Self {
            sides,
            unit,
            suggestion,
        })
    }
}

impl fmt::Display for ImplausibleSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            sides,
            unit,
            suggestion,
        } = self;
        let small = sides.norm() * unit.metres() < SMALLEST_M;
        let [x, y, z] = [sides.x, sides.y, sides.z].map(three_digits);
        write!(
            f,
            "{x} x {y} x {z} {unit} is too {} for a work-piece: ",
            if small { "small" } else { "large" }
        )?;
        match suggestion {
            Some(other) => {
                write!(
                    f,
                    "the file is probably in {}, try --mesh-unit {other}",
                    other.metres_and_plural().1
                )
            }
            None => write!(
                f,
                "it fits in no unit (diagonal from {SMALLEST_M} to {LARGEST_M} m): scale the file"
            ),
        }
    }
}

/// The number with three significant digits, in its shortest form.
fn three_digits(x: f64) -> String {
    format!("{x:.2e}")
        .parse::<f64>()
        .map_or_else(|_| x.to_string(), |rounded| format!("{rounded:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_implausible_size_is_refused_with_a_suggestion() {
        // the block of 5 x 2.5 x 1.375 inch, named in each wrong unit
        let block = Vector3::new(5.0, 2.5, 1.375);
        let refusal = |sides: Vector3<f64>, unit: MeshUnit| {
            ImplausibleSize::check(sides * unit.metres(), unit).map_err(|e| e.to_string())
        };
        assert_eq!(refusal(block, MeshUnit::Inch), Ok(()));
        assert_eq!(
            refusal(block, MeshUnit::Millimetre),
            Ok(()),
            "small, but not beyond belief"
        );
        assert_eq!(
            refusal(block * 0.0254, MeshUnit::Millimetre).unwrap_err(),
            "0.127 x 0.0635 x 0.0349 mm is too small for a work-piece: the file is probably in metres, try --mesh-unit m"
        );
        assert_eq!(
            refusal(block * 25.4, MeshUnit::Metre).unwrap_err(),
            "127.0 x 63.5 x 34.9 m is too large for a work-piece: the file is probably in millimetres, try --mesh-unit mm"
        );
        assert_eq!(
            refusal(block * 1e9, MeshUnit::Metre).unwrap_err(),
            "5000000000.0 x 2500000000.0 x 1380000000.0 m is too large for a work-piece: \
             it fits in no unit (diagonal from 0.001 to 20 m): scale the file"
        );
    }
}
