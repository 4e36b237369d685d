//! Method that finds the drawing frame on the part.

use std::fmt;
use std::str::FromStr;

/// Basis of the motion from measured features to the drawing frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AlignmentMethod {
    /// Least squares over all common features.
    BestFit,
    /// Datums in their order, each by the name of a characteristic of its feature.
    Datums(Vec<String>),
}

const FORMS: &str = "best-fit, or datums=NAME,NAME,NAME with names of characteristics: primary, secondary, tertiary";

impl FromStr for AlignmentMethod {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "best-fit" {
            return Ok(Self::BestFit);
        }
        let names = text
            .strip_prefix("datums=")
            .ok_or_else(|| format!("take {FORMS}"))?;
        let names: Vec<_> = names
            .split(',')
            .map(|name| name.trim().to_owned())
            .collect();
        match names.iter().any(String::is_empty) {
            true => Err(format!("a datum has no name: take {FORMS}")),
            false => Ok(Self::Datums(names)),
        }
    }
}

impl fmt::Display for AlignmentMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BestFit => f.write_str("best-fit"),
            Self::Datums(names) => write!(f, "datums={}", names.join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_is_read_as_it_is_written() {
        for text in ["best-fit", "datums=top flatness,bore", "datums=A"] {
            assert_eq!(text.parse::<AlignmentMethod>().unwrap().to_string(), text);
        }
        for (text, words) in [
            ("icp", "take best-fit"),
            ("datums=", "no name"),
            ("datums=A,,B", "no name"),
        ] {
            let why = text.parse::<AlignmentMethod>().unwrap_err();
            assert!(why.contains(words), "{why}");
        }
    }
}
