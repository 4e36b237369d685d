//! Targets that take any bytes, their seeds, and shared parts: bytes as a file, numbers of any
//! size, small parts, invariants of a mesh.
//!
//! The tests run each target on its seeds; `fuzz/run` lets libFuzzer change them, guided by
//! coverage.

pub mod seeds;
pub mod targets;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use arbitrary::{Result, Unstructured};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use touchup_geometry::mesh::{TriMesh, is_place, repair};
use touchup_io::recording::{Record, RecordingLayout, RecordingReader};
use touchup_method::stylus::{Message, Sample, TipParams, Wrench};

/// The ball of the targets: radius in m, stiffness in N/m.
pub const BALL: TipParams = TipParams {
    radius: 1.5e-3,
    stiffness: Some(20e3),
};

/// Ends of the range of floats, of their squares and of their products.
const ENDS: [f64; 14] = [
    0.0,
    5e-324,
    f64::MIN_POSITIVE,
    1e-200,
    1e-162,
    1e-154,
    1e-81,
    f64::EPSILON,
    1.0,
    1e9,
    1e154,
    f64::MAX,
    f64::INFINITY,
    f64::NAN,
];

/// A path of this process in the folder for temporary files, which `fuzz/run` puts into memory.
pub fn place(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("{}-{name}", std::process::id()))
}

/// A file of that name with these bytes.
///
/// # Panics
/// If it cannot write the file.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = place(name);
    fs::write(&path, bytes).expect("the folder for temporary files takes a file");
    path
}

/// A number of the usual size, now and then any float.
///
/// # Errors
/// At the end of the bytes.
pub fn number(bytes: &mut Unstructured, usual: f64) -> Result<f64> {
    Ok(match bytes.arbitrary::<u8>()? {
        tag @ 0..=27 => ENDS[usize::from(tag) % ENDS.len()] * if tag < 14 { 1.0 } else { -1.0 },
        28..=31 => f64::from_bits(bytes.arbitrary()?),
        32..=47 => usual * 10f64.powi(-i32::from(bytes.arbitrary::<u8>()?)),
        _ => f64::from(bytes.arbitrary::<i16>()?) / f64::from(i16::MAX) * usual,
    })
}

/// Three of them.
///
/// # Errors
/// At the end of the bytes.
pub fn vector(bytes: &mut Unstructured, usual: f64) -> Result<Vector3<f64>> {
    Ok(Vector3::new(
        number(bytes, usual)?,
        number(bytes, usual)?,
        number(bytes, usual)?,
    ))
}

/// An orientation: mostly none, else four numbers, which need not have length 1.
///
/// # Errors
/// At the end of the bytes.
pub fn rotation(bytes: &mut Unstructured) -> Result<UnitQuaternion<f64>> {
    Ok(match bytes.arbitrary::<u8>()? {
        0..=199 => UnitQuaternion::identity(),
        200..=239 => UnitQuaternion::new(vector(bytes, 3.0)?),
        _ => {
            let v = vector(bytes, 1.0)?;
            UnitQuaternion::new_unchecked(Quaternion::new(number(bytes, 1.0)?, v.x, v.y, v.z))
        }
    })
}

/// The sample after `stamp_ns`: near `near`, within about `usual` m, without force or with any.
///
/// # Errors
/// At the end of the bytes.
pub fn sample(
    bytes: &mut Unstructured,
    stamp_ns: &mut i64,
    near: Point3<f64>,
    usual: f64,
) -> Result<Sample> {
    let step = match bytes.arbitrary::<u8>()? {
        0 => bytes.arbitrary()?,
        1 => 0,
        milliseconds => i64::from(milliseconds) * 1_000_000,
    };
    *stamp_ns = stamp_ns.saturating_add(step);
    let centre = near + vector(bytes, usual)?;
    let force = if bytes.arbitrary()? {
        vector(bytes, 5.0)?
    } else {
        Vector3::zeros()
    };
    let torque = if bytes.ratio(1, 8)? {
        vector(bytes, 0.1)?
    } else {
        Vector3::zeros()
    };
    let pose_ot = Isometry3::from_parts(Translation3::from(centre), rotation(bytes)?);
    Ok(Sample {
        stamp_ns: *stamp_ns,
        pose_ot,
        wrench: Wrench { force, torque },
    })
}

/// A closed box, each of its sides with `cells` × `cells` squares.
///
/// # Panics
/// For no cells.
pub fn closed_box(half: [f64; 3], cells: u32) -> TriMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let first = positions.len() as u32;
            let along = |k: u32| 2.0 * f64::from(k) / f64::from(cells) - 1.0;
            for (i, j) in (0..=cells).flat_map(|i| (0..=cells).map(move |j| (i, j))) {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, along(i), along(j));
                positions.push(Point3::from([0, 1, 2].map(|k| p[k] * half[k])));
            }
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let a = first + i * (cells + 1) + j;
                let [b, c, d] = [a + cells + 1, a + cells + 2, a + 1];
                let [b, d] = if side > 0.0 { [b, d] } else { [d, b] };
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    repair(positions, faces).expect("a box has faces").0
}

/// Edges that do not have one face on either side.
pub fn open_edges(mesh: &TriMesh) -> usize {
    let mut uses: HashMap<[u32; 2], i64> = HashMap::new();
    for (_, [a, b, c]) in mesh.faces() {
        for [from, to] in [[a.0, b.0], [b.0, c.0], [c.0, a.0]] {
            *uses.entry([from.min(to), from.max(to)]).or_default() +=
                if from < to { 1 } else { -1 };
        }
    }
    uses.values().filter(|&&balance| balance != 0).count()
}

/// # Panics
/// If a vertex of the mesh is not finite.
pub fn assert_is_somewhere(mesh: &TriMesh) {
    let nowhere = mesh.positions().iter().position(|p| !is_place(p));
    assert_eq!(
        nowhere,
        None,
        "a vertex is nowhere: {:?}",
        nowhere.map(|at| mesh.positions()[at])
    );
}

/// Reads a recording to its end: its description and each message.
pub fn read_all(path: &Path, layout: impl Into<RecordingLayout>) {
    let Ok(mut reader) = RecordingReader::open(path, layout) else {
        return;
    };
    while let Some(record) = reader.next_record() {
        if let Ok(Record::Message(Message::Pose(pose))) = record {
            assert!(
                (pose.pose_ot.rotation.norm() - 1.0).abs() < 1e-6,
                "{pose:?}"
            );
        }
    }
    assert!(
        reader
            .bad_messages()
            .values()
            .all(|bad| bad.poses + bad.wrenches > 0)
    );
}
