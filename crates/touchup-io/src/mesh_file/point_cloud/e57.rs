//! E57 of laser scanners, read by the crate of that name.

use std::io::Cursor;

use e57::{CartesianCoordinate, E57Reader};
use nalgebra::{Point3, Vector3};

use super::super::defect::{Defect, Syntax};
use crate::file_error::FilePlace;
use touchup_geometry::mesh::{PointCloud, ScanStation};

/// Whether the file begins like E57.
pub(in crate::mesh_file) fn is_e57(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ASTM-E57")
}

/// Reads the points of all scans in the frame of the file, each scan by its pose, with coordinates
/// times `scale`. Invalid points come out as NaN.
pub(in crate::mesh_file) fn read(bytes: &[u8], scale: f64) -> Result<PointCloud, Syntax> {
    let foreign = |offset: u64| {
        move |why: e57::Error| Syntax {
            place: FilePlace::Byte(offset),
            defect: defect(&why),
        }
    };
    let mut reader = E57Reader::new(Cursor::new(bytes)).map_err(foreign(0))?;
    let mut cloud = PointCloud::default();
    for scan in reader.pointclouds() {
        check_count(scan.records, scan.file_offset, bytes.len())?;
        let first = cloud.positions.len();
        let mut points = reader
            .pointcloud_simple(&scan)
            .map_err(foreign(scan.file_offset))?;
        points.intensity_to_color(false);
        for point in points {
            let position = match point.map_err(foreign(scan.file_offset))?.cartesian {
                CartesianCoordinate::Valid { x, y, z } => Point3::new(x, y, z) * scale,
                _ => Point3::from(Vector3::repeat(f64::NAN)),
            };
            cloud.positions.push(position);
        }
        let origin = scan.transform.as_ref().map(|pose| &pose.translation);
        let eye = origin.map(|at| Point3::new(at.x, at.y, at.z) * scale);
        cloud.stations.push(ScanStation {
            points: cloud.positions.len() - first,
            eye,
            is_sure: eye.is_some() && scan.has_row_column(),
        });
    }
    match cloud.positions.is_empty() {
        true => Err(Syntax {
            place: FilePlace::Byte(0),
            defect: Defect::NoPoints,
        }),
        false => Ok(cloud),
    }
}

/// Refuses more points than there are bits: real scanners take at least some bytes for each.
fn check_count(records: u64, offset: u64, len: usize) -> Result<(), Syntax> {
    let needed = u128::from(records).div_ceil(8);
    if needed <= len as u128 {
        return Ok(());
    }
    let defect = Defect::Length {
        what: "points".into(),
        count: records,
        needed,
        left: len,
    };
    Err(Syntax {
        place: FilePlace::Byte(offset),
        defect,
    })
}

/// The error and its sources, on one line.
fn defect(error: &e57::Error) -> Defect {
    let mut reason = error.to_string();
    let mut next = std::error::Error::source(error);
    while let Some(source) = next {
        reason = format!("{reason}: {source}");
        next = source.source();
    }
    Defect::E57 {
        reason: reason.split_whitespace().collect::<Vec<_>>().join(" "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};

    fn file(poses: &[Option<[f64; 3]>]) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
        for pose in poses {
            let records = vec![
                Record::CARTESIAN_X_F64,
                Record::CARTESIAN_Y_F64,
                Record::CARTESIAN_Z_F64,
            ];
            let mut scan = writer.add_pointcloud("scan", records).unwrap();
            if let Some([x, y, z]) = *pose {
                // a quarter of a turn about z
                let half = 0.5f64.sqrt();
                let rotation = Quaternion {
                    w: half,
                    x: 0.0,
                    y: 0.0,
                    z: half,
                };
                scan.set_transform(Some(Transform {
                    rotation,
                    translation: Translation { x, y, z },
                }));
            }
            for i in 0..3 {
                scan.add_point([f64::from(i), 0.0, 1.0].map(RecordValue::Double).to_vec())
                    .unwrap();
            }
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn the_scans_of_a_file_come_together_by_their_poses() {
        let cloud = read(&file(&[None, Some([10.0, 0.0, 0.5])]), 2.0).unwrap();
        let expected = [
            [0., 0., 2.],
            [2., 0., 2.],
            [4., 0., 2.],
            [20., 0., 3.],
            [20., 2., 3.],
            [20., 4., 3.],
        ];
        for (found, expected) in cloud.positions.iter().zip(expected) {
            assert!((found - Point3::from(expected)).norm() < 1e-12, "{found}");
        }
        let [first, second] = cloud.stations[..] else {
            panic!("{cloud:?}")
        };
        assert_eq!((first.points, first.eye, second.points), (3, None, 3));
        assert_eq!(
            (second.eye, second.is_sure),
            (Some(Point3::new(20.0, 0.0, 1.0)), false)
        );
    }

    #[test]
    fn a_damaged_file_is_refused_in_one_line() {
        let whole = file(&[None]);
        let message = |bytes: &[u8]| {
            let Syntax { place, defect } = read(bytes, 1.0).unwrap_err();
            format!("{place}: {defect}")
        };
        let mut damaged = whole.clone();
        damaged[100] ^= 1;
        for bytes in [&whole[..60], &whole[..1024], &damaged, &file(&[])] {
            let message = message(bytes);
            assert!(
                message.contains("export it again") && !message.contains('\n'),
                "{message}"
            );
        }
    }
}
