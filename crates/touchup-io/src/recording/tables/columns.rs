//! Columns of a table for time, pose and wrench, and their units.
//!
//! A column's unit is in its header, as in `px_mm`, `px [mm]` or `px (mm)`; if the header has none,
//! the scene may name the column with it. Without names in the scene the usual ones apply, first
//! those of the RTDE logs of a UR, whose units are known.

use touchup_method::parameters;
use touchup_method::words;

use super::units::{Quantity, split_unit};

words! {
    /// Axes of the wrenches of a table.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum WrenchAxes {
        /// Axes of the positions: of the object, or of the base of an arm.
        #[default]
        Pose = "pose",
        /// Axes of the stylus, which the orientation turns.
        Tip = "tip",
    }
}

parameters! {
    /// `columns`
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct TableColumns in "columns" {
        /// Column of the time: s, ms, us or ns.
        time: Option<String> = None, "time" like "t_s";
        /// Position of the tip, three columns: m, mm, um or inch.
        position: Option<Vec<String>> = None, "position" like "[x_mm, y_mm, z_mm]";
        /// Orientation of the tip: a quaternion x, y, z, w, or a rotation vector of three columns
        /// in rad or deg. Left out and without a usual name in the table: none, which suffices for
        /// a ball with wrenches in the axes of the positions.
        orientation: Option<Vec<String>> = None, "orientation" like "[qx, qy, qz, qw]";
        /// Force of the part on the stylus, three columns: N or kN.
        force: Option<Vec<String>> = None, "force" like "[fx_n, fy_n, fz_n]";
        /// Torque of the part on the stylus, three columns: Nm or Nmm. Left out and without a usual
        /// name in the table: 0.
        torque: Option<Vec<String>> = None, "torque" like "[tx_nm, ty_nm, tz_nm]";
        /// Axes of force and torque: those of the positions (pose), or those of the tip, turned by
        /// the orientation (tip).
        wrench_axes: WrenchAxes = WrenchAxes::Pose, "wrench_axes";
    }
}

/// A column, and the factor from its numbers to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::recording) struct ScaledColumn {
    pub at: usize,
    pub factor: f64,
}

/// Representation of the orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::recording) enum OrientationColumns {
    /// x, y, z, w
    Quaternion([ScaledColumn; 4]),
    RotationVector([ScaledColumn; 3]),
    None,
}

/// The columns in use.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::recording) struct FoundColumns {
    pub time: ScaledColumn,
    pub position: [ScaledColumn; 3],
    pub orientation: OrientationColumns,
    pub force: [ScaledColumn; 3],
    pub torque: Option<[ScaledColumn; 3]>,
    pub wrench_axes: WrenchAxes,
}

/// Usual names, without unit and in lower case; the first complete group counts. Names of RTDE come
/// with their unit, `{}` for their number.
struct UsualNames {
    of_rtde: &'static str,
    rtde_unit: &'static str,
    first: usize,
    groups: &'static [&'static [&'static str]],
}

const TIME: UsualNames = UsualNames {
    of_rtde: "timestamp",
    rtde_unit: "s",
    first: 0,
    groups: &[&["t"], &["time"], &["timestamp"], &["stamp"]],
};
const POSITION: UsualNames = UsualNames {
    of_rtde: "actual_TCP_pose_",
    rtde_unit: "m",
    first: 0,
    groups: &[
        &["x", "y", "z"],
        &["px", "py", "pz"],
        &["position_x", "position_y", "position_z"],
    ],
};
const TURN: UsualNames = UsualNames {
    of_rtde: "actual_TCP_pose_",
    rtde_unit: "rad",
    first: 3,
    groups: &[&["rx", "ry", "rz"]],
};
const QUATERNION: UsualNames = UsualNames {
    of_rtde: "",
    rtde_unit: "",
    first: 0,
    groups: &[
        &["qx", "qy", "qz", "qw"],
        &[
            "orientation_x",
            "orientation_y",
            "orientation_z",
            "orientation_w",
        ],
    ],
};
const FORCE: UsualNames = UsualNames {
    of_rtde: "actual_TCP_force_",
    rtde_unit: "N",
    first: 0,
    groups: &[&["fx", "fy", "fz"], &["force_x", "force_y", "force_z"]],
};
const TORQUE: UsualNames = UsualNames {
    of_rtde: "actual_TCP_force_",
    rtde_unit: "Nm",
    first: 3,
    groups: &[
        &["tx", "ty", "tz"],
        &["mx", "my", "mz"],
        &["torque_x", "torque_y", "torque_z"],
    ],
};

impl TableColumns {
    /// The columns of a table with these names in its first line.
    ///
    /// # Errors
    /// Missing columns or units, in words.
    pub(in crate::recording) fn find(&self, header: &[String]) -> Result<FoundColumns, String> {
        let header = ColumnNames(header);
        let three = |key, named: &Option<Vec<String>>, quantity, usual| {
            header.find::<3>(key, named.as_deref(), quantity, usual)
        };
        let needed = |key: &'static str, found: Option<[ScaledColumn; 3]>| {
            found.ok_or_else(|| header.missing(key))
        };
        let orientation = match &self.orientation {
            Some(names) if names.len() != 4 => {
                let turn = three("orientation", &self.orientation, Quantity::Angle, &TURN)?;
                OrientationColumns::RotationVector(needed("orientation", turn)?)
            }
            named => match header.find::<4>(
                "orientation",
                named.as_deref(),
                Quantity::None,
                &QUATERNION,
            )? {
                Some(quaternion) => OrientationColumns::Quaternion(quaternion),
                None => three("orientation", &None, Quantity::Angle, &TURN)?
                    .map_or(OrientationColumns::None, OrientationColumns::RotationVector),
            },
        };
        if orientation == OrientationColumns::None && self.wrench_axes == WrenchAxes::Tip {
            return Err(format!(
                "wrench_axes: tip needs an orientation; {}",
                header.missing("orientation")
            ));
        }
        let time = header.find::<1>(
            "time",
            self.time.as_ref().map(std::slice::from_ref),
            Quantity::Time,
            &TIME,
        )?;
        Ok(FoundColumns {
            time: time.ok_or_else(|| header.missing("time"))?[0],
            position: needed(
                "position",
                three("position", &self.position, Quantity::Length, &POSITION)?,
            )?,
            orientation,
            force: needed(
                "force",
                three("force", &self.force, Quantity::Force, &FORCE)?,
            )?,
            torque: three("torque", &self.torque, Quantity::Torque, &TORQUE)?,
            wrench_axes: self.wrench_axes,
        })
    }
}

/// The names of the columns.
struct ColumnNames<'a>(&'a [String]);

impl ColumnNames<'_> {
    fn list(&self) -> String {
        self.0.join(", ")
    }

    fn missing(&self, key: &str) -> String {
        format!(
            "no columns are known to be the {key}; name them by `columns: {{ {key}: … }}` in the scene. It has: {}",
            self.list()
        )
    }

    /// `None`: not named, and no usual name is there.
    fn find<const N: usize>(
        &self,
        key: &str,
        named: Option<&[String]>,
        quantity: Quantity,
        usual: &UsualNames,
    ) -> Result<Option<[ScaledColumn; N]>, String> {
        if let Some(names) = named {
            let names: &[String; N] = names.try_into().map_err(|_| {
                format!("columns.{key} names {} columns, it takes {N}", names.len())
            })?;
            let mut columns = [ScaledColumn { at: 0, factor: 1.0 }; N];
            for (column, name) in columns.iter_mut().zip(names) {
                *column = self.named(key, name, quantity)?;
            }
            return Ok(Some(columns));
        }
        if let Some(columns) = self.of_rtde(quantity, usual) {
            return Ok(Some(columns));
        }
        for group in usual.groups {
            let at = |name: &&str| {
                self.only(key, |there| {
                    split_unit(there, quantity).0.eq_ignore_ascii_case(name)
                })
            };
            let Some(places) = group
                .iter()
                .map(at)
                .collect::<Result<Option<Vec<_>>, _>>()?
            else {
                continue;
            };
            let mut columns = [ScaledColumn { at: 0, factor: 1.0 }; N];
            for (column, at) in columns.iter_mut().zip(places) {
                let factor = split_unit(&self.0[at], quantity)
                    .1
                    .map_or_else(|| self.no_unit(&self.0[at], quantity), Ok)?;
                *column = ScaledColumn { at, factor };
            }
            return Ok(Some(columns));
        }
        Ok(None)
    }

    fn of_rtde<const N: usize>(
        &self,
        quantity: Quantity,
        usual: &UsualNames,
    ) -> Option<[ScaledColumn; N]> {
        if !self.0.iter().any(|name| name == "actual_TCP_pose_0") || usual.of_rtde.is_empty() {
            return None;
        }
        let mut columns = [ScaledColumn {
            at: 0,
            factor: quantity.factor(usual.rtde_unit)?,
        }; N];
        for (number, column) in columns.iter_mut().enumerate() {
            let name = if N == 1 {
                usual.of_rtde.to_owned()
            } else {
                format!("{}{}", usual.of_rtde, usual.first + number)
            };
            column.at = self.0.iter().position(|there| *there == name)?;
        }
        Some(columns)
    }

    /// The place of the only matching column; `None` if there is none.
    fn only(&self, key: &str, is_meant: impl Fn(&String) -> bool) -> Result<Option<usize>, String> {
        let mut meant = (0..self.0.len()).filter(|&at| is_meant(&self.0[at]));
        match (meant.next(), meant.next()) {
            (Some(one), Some(other)) => Err(format!(
                "columns {:?} and {:?} could both be meant by the {key}: take one out, or name the right one by `columns: {{ {key}: … }}` \
                 in the scene",
                self.0[one], self.0[other]
            )),
            (at, _) => Ok(at),
        }
    }

    /// A column by its name in the scene, which may have the unit that the header lacks.
    fn named(&self, key: &str, name: &str, quantity: Quantity) -> Result<ScaledColumn, String> {
        let (plain, told) = split_unit(name, quantity);
        let is_meant = |there: &String| split_unit(there, quantity).0 == plain;
        let exact = self.only(key, |there| there == name)?;
        let at = exact.map_or_else(|| self.only(key, is_meant), |at| Ok(Some(at)))?;
        let at = at.ok_or_else(|| {
            format!(
                "no column {name:?}, which columns.{key} of the scene names. It has: {}",
                self.list()
            )
        })?;
        match (split_unit(&self.0[at], quantity).1, told) {
            (Some(there), Some(told)) if there != told => Err(format!(
                "column {:?} has another unit than {name:?}, as columns.{key} of the scene names it",
                self.0[at]
            )),
            (there, told) => {
                let factor = there
                    .or(told)
                    .map_or_else(|| self.no_unit(&self.0[at], quantity), Ok)?;
                Ok(ScaledColumn { at, factor })
            }
        }
    }

    fn no_unit(&self, name: &str, quantity: Quantity) -> Result<f64, String> {
        let units = quantity.units();
        let example = quantity.example();
        Err(format!(
            "column {name:?} has no unit ({units}); write it into the header as \"{name} [{example}]\", or name the column so under \
             `columns:` in the scene"
        ))
    }
}
