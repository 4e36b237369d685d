//! Converts NumPy arrays to meshes, messages and touches, and back.

use std::borrow::Cow;

use nalgebra::{Isometry3, Point3, Quaternion, Vector3};
use numpy::ndarray::ArrayView2;
use numpy::{
    Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use touchup::cli::CliError;
use touchup_geometry::mesh::{TriMesh, VertexId};
use touchup_method::stylus::{
    Message, ProbedPoint, Sample, SampleError, StampedPose, StampedWrench, Wrench, WrenchFrame,
    measured_rotation,
};

use crate::failure::usage;

/// Vertices, V × 3, m, and faces, F × 3.
pub type MeshArrays<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray2<'py, u32>);
/// Stamps, N, ns; positions, N × 3, m; orientations, N × 4, x y z w.
pub type PoseArrays<'py> = (
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);
/// Stamps, M, ns; forces, M × 3, N; torques, M × 3, N·m.
pub type WrenchArrays<'py> = (
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);
/// Vertices and faces as vectors.
pub type MeshVecs = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// The rows of an array of `N` columns: borrowed if contiguous in memory, else a copy.
///
/// # Errors
/// For another shape.
pub fn rows<'a, const N: usize, T: Element + Copy + Default>(
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> Result<Cow<'a, [[T; N]]>, CliError> {
    let view: ArrayView2<'_, T> = array.as_array();
    if view.ncols() != N {
        let [rows, columns] = [view.nrows(), view.ncols()];
        return Err(usage(format!(
            "{name} is an array of shape ({rows}, {columns}); it must be (N, {N})"
        )));
    }
    if let Ok(numbers) = array.as_slice() {
        return Ok(Cow::Borrowed(numbers.as_chunks().0));
    }
    let row = |row: numpy::ndarray::ArrayView1<'_, T>| {
        let mut values = [T::default(); N];
        values
            .iter_mut()
            .zip(row)
            .for_each(|(to, from)| *to = *from);
        values
    };
    Ok(Cow::Owned(view.rows().into_iter().map(row).collect()))
}

/// Refuses arrays of one table with different lengths.
///
/// # Errors
/// For different lengths.
pub fn of_equal_length(first: (&str, usize), others: &[(&str, usize)]) -> Result<(), CliError> {
    match others.iter().find(|(_, length)| *length != first.1) {
        None => Ok(()),
        Some((name, length)) => Err(usage(format!(
            "{name} has {length} rows and {} has {}: they must have as many",
            first.0, first.1
        ))),
    }
}

/// Vertices and faces.
///
/// # Errors
/// For another shape.
pub fn mesh_vecs((vertices, faces): &MeshArrays<'_>, name: &str) -> Result<MeshVecs, CliError> {
    let vertices = rows::<3, f64>(vertices, &format!("vertices of {name}"))?;
    let faces = rows::<3, u32>(faces, &format!("faces of {name}"))?;
    Ok((
        vertices.iter().copied().map(Point3::from).collect(),
        faces.into_owned(),
    ))
}

/// A mesh without repair, so that vertices keep their numbers.
///
/// # Errors
/// Those of [`mesh_vecs`] and [`TriMesh::new`].
pub fn mesh_of(arrays: &MeshArrays<'_>, name: &str) -> Result<TriMesh, CliError> {
    let (vertices, faces) = mesh_vecs(arrays, name)?;
    let mesh = TriMesh::new(vertices, faces)?;
    if mesh.face_count() == 0 {
        return Err(touchup_geometry::mesh::MeshError::Empty.into());
    }
    Ok(mesh)
}

/// A mesh without removed elements, as in a file, with the slot of each vertex.
pub struct CompactMesh {
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// for each vertex its slot in the mesh
    slots: Vec<usize>,
}

impl CompactMesh {
    /// Vertices in use by faces, and the faces, in their order.
    pub fn of(mesh: &TriMesh) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut numbers = vec![UNUSED; mesh.vertex_slots()];
        for vertex in mesh.faces().flat_map(|(_, corners)| corners) {
            numbers[vertex.0 as usize] = 0;
        }
        let slots: Vec<usize> = (0..numbers.len())
            .filter(|&slot| numbers[slot] != UNUSED)
            .collect();
        for (number, &slot) in (0..).zip(&slots) {
            numbers[slot] = number;
        }
        let vertices = slots
            .iter()
            .map(|&slot| mesh.position(VertexId(slot as u32)).coords.into())
            .collect();
        let faces = mesh
            .faces()
            .map(|(_, corners)| corners.map(|vertex| numbers[vertex.0 as usize]))
            .collect();
        Self {
            vertices,
            faces,
            slots,
        }
    }

    /// Values per vertex from values per slot; `None` for an empty slice.
    pub fn column<T: Copy>(&self, of_slots: &[T]) -> Option<Vec<T>> {
        (!of_slots.is_empty()).then(|| self.slots.iter().map(|&slot| of_slots[slot]).collect())
    }

    /// Writes `vertices` and `faces` into a dictionary.
    ///
    /// # Errors
    /// Those of Python.
    pub fn into_dict(self, into: &Bound<'_, PyDict>) -> PyResult<()> {
        into.set_item("vertices", matrix(into.py(), self.vertices)?)?;
        into.set_item("faces", matrix(into.py(), self.faces)?)
    }
}

/// An array of rows, which takes over their memory.
///
/// # Errors
/// Those of NumPy.
pub fn matrix<const N: usize, T: Element>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// A rigid motion of position and orientation; `None` for an invalid rotation.
#[inline]
pub fn pose(position: [f64; 3], [x, y, z, w]: [f64; 4]) -> Option<Isometry3<f64>> {
    let rotation = measured_rotation(Quaternion::new(w, x, y, z))?;
    Some(Isometry3::from_parts(
        Vector3::from(position).into(),
        rotation,
    ))
}

/// A sample from numbers.
///
/// # Errors
/// [`SampleError::NotARotation`], [`SampleError::NotFinite`] for the orientation.
#[inline]
pub fn sample(
    stamp_ns: i64,
    position: [f64; 3],
    xyzw: [f64; 4],
    [force, torque]: [[f64; 3]; 2],
) -> Result<Sample, SampleError> {
    let pose_ot = pose(position, xyzw).ok_or_else(|| no_rotation(stamp_ns, xyzw))?;
    Ok(Sample {
        stamp_ns,
        pose_ot,
        wrench: Wrench {
            force: force.into(),
            torque: torque.into(),
        },
    })
}

#[cold]
fn no_rotation(stamp_ns: i64, xyzw: [f64; 4]) -> SampleError {
    match xyzw.iter().map(|x| x * x).sum::<f64>().sqrt() {
        norm if norm.is_finite() => SampleError::NotARotation { norm, stamp_ns },
        _ => SampleError::NotFinite {
            what: "orientation",
            stamp_ns,
        },
    }
}

/// Poses and wrenches as messages, merged by their stamps.
///
/// # Errors
/// For another shape, and for an invalid rotation.
pub fn messages(
    poses: &PoseArrays<'_>,
    wrenches: &WrenchArrays<'_>,
) -> Result<Vec<Message>, CliError> {
    let positions = rows::<3, f64>(&poses.1, "position")?;
    let orientations = rows::<4, f64>(&poses.2, "orientation_xyzw")?;
    let (forces, torques) = (
        rows::<3, f64>(&wrenches.1, "force")?,
        rows::<3, f64>(&wrenches.2, "torque")?,
    );
    let given = [
        ("position", positions.len()),
        ("orientation_xyzw", orientations.len()),
    ];
    of_equal_length(("pose_stamp_ns", poses.0.len()), &given)?;
    of_equal_length(
        ("wrench_stamp_ns", wrenches.0.len()),
        &[("force", forces.len()), ("torque", torques.len())],
    )?;
    let mut all = Vec::with_capacity(positions.len() + forces.len());
    for ((&stamp_ns, position), xyzw) in poses
        .0
        .as_array()
        .iter()
        .zip(&*positions)
        .zip(&*orientations)
    {
        let pose_ot = pose(*position, *xyzw)
            .ok_or_else(|| recording_error(no_rotation(stamp_ns, *xyzw), "pose", all.len()))?;
        all.push(Message::Pose(StampedPose { stamp_ns, pose_ot }));
    }
    for ((&stamp_ns, force), torque) in wrenches.0.as_array().iter().zip(&*forces).zip(&*torques) {
        let wrench = Wrench {
            force: (*force).into(),
            torque: (*torque).into(),
        };
        all.push(Message::Wrench(StampedWrench { stamp_ns, wrench }));
    }
    // stable: a pose stays before a wrench of equal stamp
    all.sort_by_key(Message::stamp_ns);
    Ok(all)
}

fn recording_error(error: SampleError, what: &str, row: usize) -> CliError {
    CliError {
        kind: "recording",
        message: format!("{what} {row}: {error}"),
        hint: None,
        exit_code: 3,
    }
}

/// Axes of the wrenches.
///
/// # Errors
/// For another word.
pub fn wrench_frame(name: &str) -> Result<WrenchFrame, CliError> {
    match name {
        "sensor" => Ok(WrenchFrame::Sensor),
        "object" => Ok(WrenchFrame::Object),
        other => Err(usage(format!(
            "wrench_frame {other:?} must be \"sensor\" or \"object\""
        ))),
    }
}

/// Messages as a dictionary of arrays.
///
/// # Errors
/// Those of NumPy.
pub fn messages_into(
    messages: &[Message],
    frame: WrenchFrame,
    into: &Bound<'_, PyDict>,
) -> PyResult<()> {
    let py = into.py();
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for message in messages {
        match message {
            Message::Pose(pose) => poses.push(pose),
            Message::Wrench(wrench) => wrenches.push(wrench),
        }
    }
    let place = |pose: &&StampedPose| -> [f64; 3] { pose.pose_ot.translation.vector.into() };
    let turn = |pose: &&StampedPose| -> [f64; 4] { pose.pose_ot.rotation.coords.into() };
    into.set_item(
        "pose_stamp_ns",
        PyArray1::from_iter(py, poses.iter().map(|pose| pose.stamp_ns)),
    )?;
    into.set_item(
        "position",
        matrix::<3, f64>(py, poses.iter().map(place).collect())?,
    )?;
    into.set_item(
        "orientation_xyzw",
        matrix::<4, f64>(py, poses.iter().map(turn).collect())?,
    )?;
    into.set_item(
        "wrench_stamp_ns",
        PyArray1::from_iter(py, wrenches.iter().map(|wrench| wrench.stamp_ns)),
    )?;
    for (name, vector) in [
        ("force", (|of| of.force) as fn(Wrench) -> Vector3<f64>),
        ("torque", |of| of.torque),
    ] {
        into.set_item(
            name,
            matrix::<3, f64>(
                py,
                wrenches.iter().map(|of| vector(of.wrench).into()).collect(),
            )?,
        )?;
    }
    into.set_item(
        "wrench_frame",
        if frame == WrenchFrame::Object {
            "object"
        } else {
            "sensor"
        },
    )
}

/// Name of an array, and its value for a touch.
type TouchColumn<T> = (&'static str, fn(&ProbedPoint) -> T);

/// Touches as a dictionary of arrays, with the columns of [`touches_of`].
///
/// # Errors
/// Those of NumPy.
pub fn touches_array<'py>(
    py: Python<'py>,
    touches: &[ProbedPoint],
) -> PyResult<Bound<'py, PyDict>> {
    let into = PyDict::new(py);
    into.set_item(
        "stamp_ns",
        PyArray1::from_iter(py, touches.iter().map(|touch| touch.stamp_ns)),
    )?;
    into.set_item(
        "stroke",
        PyArray1::from_iter(py, touches.iter().map(|touch| touch.stroke)),
    )?;
    let triples: [TouchColumn<[f64; 3]>; 3] = [
        ("centre", |touch| touch.centre.coords.into()),
        ("point", |touch| touch.point.coords.into()),
        ("normal", |touch| touch.normal.into()),
    ];
    for (name, triple) in triples {
        into.set_item(name, matrix(py, touches.iter().map(triple).collect())?)?;
    }
    let numbers: [TouchColumn<f64>; 5] = [
        ("radius", |touch| touch.radius),
        ("sigma", |touch| touch.sigma),
        ("calibration_sigma", |touch| touch.calibration),
        ("place_sigma", |touch| touch.place),
        ("weight", |touch| touch.weight),
    ];
    for (name, number) in numbers {
        into.set_item(name, PyArray1::from_iter(py, touches.iter().map(number)))?;
    }
    into.set_item(
        "is_rejected",
        PyArray1::from_iter(py, touches.iter().map(|touch| touch.is_rejected)),
    )?;
    Ok(into)
}

/// Touches from a dictionary of arrays, as of [`touches_array`].
///
/// # Errors
/// For a missing array, or another type or shape.
pub fn touches_of(from: &Bound<'_, PyDict>) -> PyResult<Result<Vec<ProbedPoint>, CliError>> {
    let item = |name: &str| {
        from.get_item(name)?
            .ok_or_else(|| pyo3::exceptions::PyKeyError::new_err(name.to_owned()))
    };
    let stamps: PyReadonlyArray1<'_, i64> = item("stamp_ns")?.extract()?;
    let strokes: PyReadonlyArray1<'_, u32> = item("stroke")?.extract()?;
    let rejected: PyReadonlyArray1<'_, bool> = item("is_rejected")?.extract()?;
    let [centre, point, normal] = ["centre", "point", "normal"].map(|name| {
        let array: PyReadonlyArray2<'_, f64> = item(name)?.extract()?;
        Ok::<_, PyErr>(rows::<3, f64>(&array, name).map(Cow::into_owned))
    });
    let (centre, point, normal) = match (centre?, point?, normal?) {
        (Ok(centre), Ok(point), Ok(normal)) => (centre, point, normal),
        (Err(error), ..) | (_, Err(error), _) | (.., Err(error)) => return Ok(Err(error)),
    };
    let column = |name: &str| {
        let array: PyReadonlyArray1<'_, f64> = item(name)?.extract()?;
        Ok::<Vec<f64>, PyErr>(array.as_array().to_vec())
    };
    let [radius, sigma, calibration, place, weight] = [
        column("radius")?,
        column("sigma")?,
        column("calibration_sigma")?,
        column("place_sigma")?,
        column("weight")?,
    ];
    let lengths = [
        ("stroke", strokes.len()),
        ("is_rejected", rejected.len()),
        ("centre", centre.len()),
        ("point", point.len()),
        ("normal", normal.len()),
        ("radius", radius.len()),
        ("sigma", sigma.len()),
        ("calibration_sigma", calibration.len()),
        ("place_sigma", place.len()),
        ("weight", weight.len()),
    ];
    if let Err(error) = of_equal_length(("stamp_ns", stamps.len()), &lengths) {
        return Ok(Err(error));
    }
    let (stamps, strokes, rejected) = (stamps.as_array(), strokes.as_array(), rejected.as_array());
    let touch = |at: usize| ProbedPoint {
        stamp_ns: stamps[at],
        stroke: strokes[at],
        centre: centre[at].into(),
        radius: radius[at],
        point: point[at].into(),
        normal: normal[at].into(),
        sigma: sigma[at],
        calibration: calibration[at],
        place: place[at],
        weight: weight[at],
        is_rejected: rejected[at],
    };
    Ok(Ok((0..stamps.len()).map(touch).collect()))
}

/// A value as JSON text, for the package.
pub fn json(value: &impl serde::Serialize) -> Result<String, CliError> {
    // a report holds only finite numbers and names
    serde_json::to_string(value)
        .map_err(|error| usage(format!("the report cannot be written: {error}")))
}
