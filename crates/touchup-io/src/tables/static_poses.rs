//! Static poses of a force sensor, as comma-separated values.
//!
//! `qx,qy,qz,qw,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm`: orientation of the stylus in the frame of the
//! poses, and the measured wrench. Each line is one pose at rest. Form of tables: [`super::table`].

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::table::{Row, TableError, WantedColumns, read_table};
use touchup_method::stylus::Wrench;

const COLUMNS: [&str; 10] = [
    "qx", "qy", "qz", "qw", "fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm",
];
/// Maximum deviation of a quaternion's length from 1: components printed with three digits.
const UNIT_TOLERANCE: f64 = 1e-2;

/// Reads orientations and wrenches, N and N·m.
///
/// # Errors
/// [`TableError`], with the line.
pub fn read_static_poses(path: &Path) -> Result<Vec<(UnitQuaternion<f64>, Wrench)>, TableError> {
    let columns = WantedColumns {
        needed: &COLUMNS,
        numbers: &[],
        texts: &[],
    };
    let rows = read_table(path, columns)?;
    let line = |row: Row| {
        pose(&row).map_err(|why| TableError::Line {
            path: path.to_owned(),
            line: row.line,
            why,
        })
    };
    rows.into_iter().map(line).collect()
}

fn pose(row: &Row) -> Result<(UnitQuaternion<f64>, Wrench), String> {
    let [x, y, z, w, fx, fy, fz, tx, ty, tz] = row.needed[..] else {
        return Err("a column is missing".to_owned());
    };
    let quaternion = Quaternion::new(w, x, y, z);
    if (quaternion.norm() - 1.0).abs() > UNIT_TOLERANCE {
        return Err(format!(
            "qx, qy, qz, qw have length {:.3} and not 1: no orientation",
            quaternion.norm()
        ));
    }
    let wrench = Wrench {
        force: Vector3::new(fx, fy, fz),
        torque: Vector3::new(tx, ty, tz),
    };
    Ok((UnitQuaternion::from_quaternion(quaternion), wrench))
}

/// A growing file of static poses during measurement; [`read_static_poses`] reads it.
#[derive(Debug)]
pub struct StaticPoseLog {
    path: PathBuf,
    file: File,
}

impl StaticPoseLog {
    /// Begins a file, in place of an older one.
    ///
    /// # Errors
    /// Any error of the file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = File::create(path)?;
        writeln!(file, "{}", COLUMNS.join(","))?;
        Ok(Self {
            path: path.to_owned(),
            file,
        })
    }

    /// Appends a pose, which is on the disk when this returns.
    ///
    /// # Errors
    /// Any error of the file.
    pub fn append(&mut self, rotation: &UnitQuaternion<f64>, wrench: &Wrench) -> io::Result<()> {
        writeln!(self.file, "{}", static_pose_line(rotation, wrench))?;
        self.file.sync_data()
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A static pose as a line of such a file, without its end.
pub fn static_pose_line(rotation: &UnitQuaternion<f64>, wrench: &Wrench) -> String {
    // x, y, z, w
    let numbers = rotation
        .coords
        .iter()
        .chain(&wrench.force)
        .chain(&wrench.torque);
    numbers.map(f64::to_string).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_appended_is_read_to_the_last_digit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("segments.csv");
        let pose = |angle: f64| {
            let force = Vector3::new(0.1 / 3.0, -11.476_543_21, angle);
            let wrench = Wrench {
                force,
                torque: force.cross(&Vector3::new(1e-3, 0.02, 0.3)),
            };
            (UnitQuaternion::from_euler_angles(angle, 0.3, -1.2), wrench)
        };
        let mut log = StaticPoseLog::create(&path).unwrap();
        assert_eq!(read_static_poses(&path).unwrap(), []);
        for angle in [0.1, 0.2] {
            let (rotation, wrench) = pose(angle);
            log.append(&rotation, &wrench).unwrap();
        }
        let read = read_static_poses(&path).unwrap();
        for ((rotation, wrench), expected) in read.iter().zip([0.1, 0.2].map(pose)) {
            // reading normalises its length to 1
            assert!(
                rotation.angle_to(&expected.0) < 1e-15 && *wrench == expected.1,
                "{rotation} {wrench:?}"
            );
        }
        assert_eq!(read.len(), 2);
    }
}
