//! Static poses of a force sensor, as comma-separated values.
//!
//! `qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm`: orientation of the stylus in the frame of the poses, and the wrench
//! as measured. Each line is one pose at rest. How tables are written: [`super::table`].

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::table::{Row, TableError, read_table};
use touchup_core::stylus::Wrench;

const COLUMNS: [&str; 10] = ["qx", "qy", "qz", "qw", "fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"];
/// A quaternion may be off from 1 by this: components printed with three digits.
const UNIT_TOLERANCE: f64 = 1e-2;

/// Reads orientations and wrenches, N and N·m.
///
/// # Errors
/// [`TableError`], with the line.
pub fn read_static_poses(path: &Path) -> Result<Vec<(UnitQuaternion<f64>, Wrench)>, TableError> {
    let rows = read_table(path, &COLUMNS, &[])?;
    let line = |row: Row| pose(&row).map_err(|why| TableError::Line { path: path.to_owned(), line: row.line, why });
    rows.into_iter().map(line).collect()
}

fn pose(row: &Row) -> Result<(UnitQuaternion<f64>, Wrench), String> {
    let [x, y, z, w, fx, fy, fz, tx, ty, tz] = row.numbers[..] else { return Err("a column is missing".to_owned()) };
    let quaternion = Quaternion::new(w, x, y, z);
    if (quaternion.norm() - 1.0).abs() > UNIT_TOLERANCE {
        return Err(format!("qx, qy, qz, qw have length {:.3} and not 1: no orientation", quaternion.norm()));
    }
    let wrench = Wrench { force: Vector3::new(fx, fy, fz), torque: Vector3::new(tx, ty, tz) };
    Ok((UnitQuaternion::from_quaternion(quaternion), wrench))
}
