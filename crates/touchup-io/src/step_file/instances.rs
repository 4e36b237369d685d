//! Instances of a physical file (ISO 10303-21): each a line with its number, in the order of their
//! making.

use std::fmt::{self, Write as _};

use nalgebra::{Point3, Vector3};

/// Number of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct InstanceId(usize);

impl fmt::Display for InstanceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// The data section.
#[derive(Default)]
pub(super) struct Instances {
    /// one line for each instance
    pub(super) text: String,
    count: usize,
}

impl Instances {
    /// Adds an entity with its attributes, or several in parentheses.
    pub(super) fn add(&mut self, entity: &str) -> InstanceId {
        self.count += 1;
        let _ = writeln!(self.text, "#{}={entity};", self.count);
        InstanceId(self.count)
    }

    /// Adds a point, from m to mm.
    pub(super) fn point(&mut self, p: &Point3<f64>) -> InstanceId {
        let [x, y, z] = [p.x, p.y, p.z].map(millimetres);
        self.add(&format!("CARTESIAN_POINT('',({x},{y},{z}))"))
    }

    /// Adds a unit vector.
    pub(super) fn direction(&mut self, v: &Vector3<f64>) -> InstanceId {
        let [x, y, z] = [v.x, v.y, v.z].map(real);
        self.add(&format!("DIRECTION('',({x},{y},{z}))"))
    }
}

/// A list of instances.
pub(super) fn list(ids: &[InstanceId]) -> String {
    let ids: Vec<_> = ids.iter().map(InstanceId::to_string).collect();
    format!("({})", ids.join(","))
}

/// The shortest text that reads back as the same number; a real number has a decimal point.
pub(super) fn real(x: f64) -> String {
    // no sign of a zero
    let text = format!("{:?}", x + 0.0);
    match text.split_once('e') {
        Some((digits, exponent)) if digits.contains('.') => format!("{digits}E{exponent}"),
        Some((digits, exponent)) => format!("{digits}.E{exponent}"),
        None => text,
    }
}

/// A length, from m to mm.
pub(super) fn millimetres(x: f64) -> String {
    real(1e3 * x)
}

/// A string: ASCII as it is, `'` and `\` twice, others by their code points.
pub(super) fn string(text: &str) -> String {
    let mut quoted = String::from("'");
    for letter in text.chars() {
        match letter {
            '\'' => quoted += "''",
            '\\' => quoted += "\\\\",
            ' '..='~' => quoted.push(letter),
            '\0'..='\u{ffff}' => {
                let _ = write!(quoted, "\\X2\\{:04X}\\X0\\", letter as u32);
            }
            _ => {
                let _ = write!(quoted, "\\X4\\{:08X}\\X0\\", letter as u32);
            }
        }
    }
    quoted.push('\'');
    quoted
}

/// An enumerated truth value.
pub(super) fn logical(is: bool) -> &'static str {
    if is { ".T." } else { ".F." }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_reads_back_as_the_same_and_has_a_decimal_point() {
        let numbers = [
            0.0,
            -0.0,
            1.0,
            -12.5,
            0.1,
            1e-7,
            1.5e-7,
            1e300,
            5e-324,
            1e21,
            1.0 / 3.0,
            f64::MAX,
        ];
        for x in numbers {
            let text = real(x);
            let digits = text.split('E').next().unwrap();
            assert!(digits.contains('.'), "{text}");
            assert_eq!(text.parse::<f64>().unwrap(), x, "{text}");
        }
        assert_eq!(real(1e-7), "1.E-7");
        assert_eq!(real(-0.0), "0.0");
    }

    #[test]
    fn a_string_escapes_quotes_backslashes_and_letters_beyond_ascii() {
        assert_eq!(string("a'b\\c"), "'a''b\\\\c'");
        assert_eq!(string("Ø8\n"), "'\\X2\\00D8\\X0\\8\\X2\\000A\\X0\\'");
        assert_eq!(string("😀"), "'\\X4\\0001F600\\X0\\'");
    }
}
