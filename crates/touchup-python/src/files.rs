//! Meshes, recordings and touches in files.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use touchup::cli::CliError;
use touchup_io::mesh_file::{MeshUnit, VertexColumn, read_vertex_columns, write_mesh_with};
use touchup_io::recording::{Record, StampSource, Topics};
use touchup_method::stylus::{Message, WrenchFrame};

use touchup_session::replay::{RecordedAs, Recording};
use touchup_session::scan::{Scan, read_scan};

use crate::arrays::{
    CompactMesh, MeshArrays, PoseArrays, WrenchArrays, mesh_of, messages, messages_into,
    of_equal_length, touches_array, touches_of, wrench_frame,
};
use crate::failure::{at_work, exception, usage, warn};
use crate::scenes::source;

/// The unit of a mesh file.
///
/// # Errors
/// For another word.
pub fn unit_of(name: &str) -> Result<MeshUnit, CliError> {
    MeshUnit::of_name(name)
        .ok_or_else(|| usage(format!("unit {name:?} must be \"mm\", \"m\" or \"inch\"")))
}

/// Location of poses and wrenches in a recording, from JSON.
///
/// # Errors
/// For an unknown name.
pub fn recorded_as(json: &str) -> Result<(RecordedAs, StampSource), CliError> {
    let recorded: RecordedAs =
        serde_json::from_str(json).map_err(|error| usage(error.to_string()))?;
    let stamps = recorded.checked_stamps().map_err(usage)?;
    Ok((recorded, stamps))
}

/// Reads a mesh, or a point cloud as one, and repairs it.
///
/// Returns `vertices` (V, 3) m, `faces` (F, 3), `sigma` (V,) m and `support` (V,) if the file has
/// them, and the repairs.
#[pyfunction]
pub fn read_mesh<'py>(py: Python<'py>, path: PathBuf, unit: &str) -> PyResult<Bound<'py, PyDict>> {
    let (mesh, repair, columns) = at_work(py, || {
        let unit = unit_of(unit)?;
        let Scan { mesh, repair, .. } = read_scan(&path, unit)?;
        let columns = read_vertex_columns(&path, unit, &mesh, ["sigma_mm", "support"])?;
        Ok((mesh, repair.to_string(), columns))
    })?;
    let compact = CompactMesh::of(&mesh);
    let [sigma, support] = columns;
    let into = PyDict::new(py);
    let sigma = sigma.map(|mm| {
        mm.iter()
            .map(|mm| f64::from(*mm) * 1e-3)
            .collect::<Vec<f64>>()
    });
    let support = support.map(|numbers| {
        numbers
            .iter()
            .map(|number| *number as u8)
            .collect::<Vec<u8>>()
    });
    set_columns(&into, &compact, sigma.as_deref(), support.as_deref())?;
    compact.into_dict(&into)?;
    into.set_item("repair", repair)?;
    Ok(into)
}

/// Puts the uncertainty and support of each vertex into a dictionary.
///
/// # Errors
/// Those of NumPy.
pub fn set_columns(
    into: &Bound<'_, PyDict>,
    compact: &CompactMesh,
    sigma: Option<&[f64]>,
    support: Option<&[u8]>,
) -> PyResult<()> {
    let py = into.py();
    let sigma = sigma
        .and_then(|of_slots| compact.column(of_slots))
        .map(|of| PyArray1::from_vec(py, of));
    let support = support
        .and_then(|of_slots| compact.column(of_slots))
        .map(|of| PyArray1::from_vec(py, of));
    into.set_item("sigma", sigma)?;
    into.set_item("support", support)
}

/// Writes a mesh as PLY, STL or OBJ; PLY also has `sigma_mm` and `support`.
#[pyfunction]
#[pyo3(signature = (path, unit, mesh, sigma, support))]
pub fn write_mesh(
    py: Python<'_>,
    path: PathBuf,
    unit: &str,
    mesh: MeshArrays<'_>,
    sigma: Option<PyReadonlyArray1<'_, f64>>,
    support: Option<PyReadonlyArray1<'_, u8>>,
) -> PyResult<()> {
    let (sigma, support) = (
        sigma.map(|of| of.as_array().to_vec()),
        support.map(|of| of.as_array().to_vec()),
    );
    let mesh = mesh_of(&mesh, "the mesh").map_err(|error| exception(py, error))?;
    at_work(py, || {
        let mut columns = Vec::new();
        if let Some(support) = support {
            of_equal_length(
                ("vertices", mesh.vertex_slots()),
                &[("support", support.len())],
            )?;
            let touched = support
                .iter()
                .map(|number| [0.0, 1.0, 0.5, 0.5][usize::from(*number).min(3)]);
            columns.push(VertexColumn {
                name: "touched",
                values: touched.collect::<Vec<f32>>().into(),
            });
            let numbers = support
                .iter()
                .map(|number| f32::from(*number))
                .collect::<Vec<_>>();
            columns.push(VertexColumn {
                name: "support",
                values: numbers.into(),
            });
        }
        if let Some(sigma) = sigma {
            of_equal_length(("vertices", mesh.vertex_slots()), &[("sigma", sigma.len())])?;
            let in_mm = sigma
                .iter()
                .map(|sigma| (sigma * 1e3) as f32)
                .collect::<Vec<_>>();
            columns.push(VertexColumn {
                name: "sigma_mm",
                values: in_mm.into(),
            });
        }
        write_mesh_with(&path, &mesh, &columns, None, unit_of(unit)?).map_err(CliError::not_written)
    })
}

/// Reads a recording of any kind: poses, N, and wrenches, M, as arrays.
#[pyfunction]
pub fn read_recording<'py>(
    py: Python<'py>,
    scene_text: Option<String>,
    scene_path: Option<PathBuf>,
    path: PathBuf,
    recorded: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let scene = source(scene_text, scene_path).map_err(|error| exception(py, error))?;
    let (all, frame, losses) = at_work(py, || {
        let (recorded, stamps) = recorded_as(recorded)?;
        let mut recording = Recording::open(&path, recorded.layout(&scene.parsed()?.0), stamps)?;
        let (mut all, mut losses): (Vec<Message>, Vec<String>) = Default::default();
        while let Some(message) = recording.next_message() {
            match message {
                Ok(message) => all.push(message),
                Err(damage) if all.is_empty() => return Err(damage.into()),
                Err(damage) => losses.push(damage.to_string()),
            }
        }
        all.sort_by_key(Message::stamp_ns);
        Ok((all, recording.wrench_frame, losses))
    })?;
    warn(py, &losses)?;
    let into = PyDict::new(py);
    messages_into(&all, frame, &into)?;
    Ok(into)
}

/// Writes poses and wrenches as MCAP, on the default topics of the command line.
#[pyfunction]
pub fn write_recording(
    py: Python<'_>,
    path: PathBuf,
    poses: PoseArrays<'_>,
    wrenches: WrenchArrays<'_>,
    frame: &str,
) -> PyResult<()> {
    let read = || Ok((messages(&poses, &wrenches)?, wrench_frame(frame)?));
    let (all, frame) = read().map_err(|error| exception(py, error))?;
    at_work(py, || {
        let of_wrench = if frame == WrenchFrame::Object {
            "object"
        } else {
            "stylus"
        };
        let records = all.into_iter().map(Record::Message);
        touchup_io::recording::write_recording(
            &path,
            &Topics::default(),
            "object",
            of_wrench,
            records,
        )
        .map_err(CliError::not_written)
    })
}

/// Reads touches written by `refine --touches-out`.
#[pyfunction]
pub fn read_touches<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let touches = at_work(py, || Ok(touchup_io::touches_file::read_touches(&path)?))?;
    touches_array(py, &touches)
}

/// Writes touches like `refine --touches-out`: Parquet for a name in `.parquet`, else CSV.
#[pyfunction]
pub fn write_touches(py: Python<'_>, path: PathBuf, touches: &Bound<'_, PyDict>) -> PyResult<()> {
    let touches = touches_of(touches)?.map_err(|error| exception(py, error))?;
    at_work(py, || {
        Ok(touchup_io::result_table::write_touches_as_named(
            &path, &touches,
        )?)
    })
}
