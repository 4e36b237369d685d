//! Units in the header of a table.

/// Physical quantity of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::recording) enum Quantity {
    Time,
    Length,
    Angle,
    Force,
    Torque,
    /// a number without a unit
    None,
}

impl Quantity {
    /// Units by their names in a header, in lower case, and their factors to SI; the first is the
    /// usual one.
    fn known(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Time => &[
                ("s", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("µs", 1e-6),
                ("ns", 1e-9),
                ("sec", 1.0),
            ],
            Self::Length => &[
                ("mm", 1e-3),
                ("m", 1.0),
                ("um", 1e-6),
                ("µm", 1e-6),
                ("inch", 0.0254),
                ("in", 0.0254),
            ],
            Self::Angle => &[("rad", 1.0), ("deg", std::f64::consts::PI / 180.0)],
            Self::Force => &[("n", 1.0), ("kn", 1e3)],
            Self::Torque => &[("nm", 1.0), ("n·m", 1.0), ("n*m", 1.0), ("nmm", 1e-3)],
            Self::None => &[],
        }
    }

    /// Factor of a unit to SI.
    pub fn factor(self, unit: &str) -> Option<f64> {
        let unit = unit.trim().to_lowercase();
        self.known()
            .iter()
            .find(|(name, _)| *name == unit)
            .map(|(_, factor)| *factor)
    }

    /// The known ones, in words.
    pub fn units(self) -> &'static str {
        match self {
            Self::Time => "s, ms, us or ns",
            Self::Length => "m, mm, um or inch",
            Self::Angle => "rad or deg",
            Self::Force => "N or kN",
            Self::Torque => "Nm or Nmm",
            Self::None => "none",
        }
    }

    /// The usual one.
    pub fn example(self) -> &'static str {
        self.known().first().map_or("", |(name, _)| name)
    }
}

/// A name without its unit, and the unit's factor to SI; `None` without a known unit.
pub(in crate::recording) fn split_unit(name: &str, quantity: Quantity) -> (&str, Option<f64>) {
    let name = name.trim();
    if quantity == Quantity::None {
        return (name, Some(1.0));
    }
    let in_brackets = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| {
            let (plain, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
            Some((plain.trim_end(), quantity.factor(unit)))
        });
    let behind_a_line = || {
        let (plain, unit) = name.rsplit_once('_')?;
        quantity.factor(unit).map(|factor| (plain, Some(factor)))
    };
    in_brackets.or_else(behind_a_line).unwrap_or((name, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_in_brackets_and_behind_a_line() {
        for (name, quantity, plain, factor) in [
            ("px_mm", Quantity::Length, "px", Some(1e-3)),
            ("px [mm]", Quantity::Length, "px", Some(1e-3)),
            ("Fx (N)", Quantity::Force, "Fx", Some(1.0)),
            ("tx_Nm", Quantity::Torque, "tx", Some(1.0)),
            ("t_ns", Quantity::Time, "t", Some(1e-9)),
            (
                "actual_TCP_pose_0",
                Quantity::Length,
                "actual_TCP_pose_0",
                None,
            ),
            ("px [furlong]", Quantity::Length, "px", None),
            ("x", Quantity::Length, "x", None),
            ("qx", Quantity::None, "qx", Some(1.0)),
        ] {
            assert_eq!(split_unit(name, quantity), (plain, factor), "{name}");
        }
    }
}
