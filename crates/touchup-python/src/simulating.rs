//! Scan and touches of a known part.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use touchup::cli::{
    CliError, OffFactor, ScannerKind, Side, Simulation, SimulationSettings, world_named,
};
use touchup_method::stylus::WrenchFrame;

use crate::arrays::{CompactMesh, MeshArrays, mesh_of, messages_into};
use crate::failure::{at_work, exception, usage};

/// Scans and touches a part like `touchup simulate`.
///
/// Returns `scan` with its `vertices` (V, 3) m and `faces` (F, 3), the arrays of `recording`, and
/// `scene`, a text, if there is a world.
#[pyfunction]
#[pyo3(signature = (truth, seed, world, told_off, tip_radius_mm, stiffness_n_per_mm, friction, scan_edge_mm, scan_noise_mm, scanner, sides))]
#[expect(clippy::too_many_arguments, reason = "what the package passes on")]
pub fn simulate<'py>(
    py: Python<'py>,
    truth: MeshArrays<'_>,
    seed: u64,
    world: Option<String>,
    told_off: Vec<String>,
    tip_radius_mm: Option<f64>,
    stiffness_n_per_mm: Option<f64>,
    friction: Option<f64>,
    scan_edge_mm: Option<f64>,
    scan_noise_mm: Option<f64>,
    scanner: Option<String>,
    sides: Vec<String>,
) -> PyResult<Bound<'py, PyDict>> {
    let truth = mesh_of(&truth, "the truth").map_err(|error| exception(py, error))?;
    let Simulation { scan, touch, scene } = at_work(py, || {
        let settings = SimulationSettings {
            seed,
            world: world
                .as_deref()
                .map(world_named)
                .transpose()
                .map_err(usage)?,
            told_off: told_off
                .iter()
                .map(|text| text.parse::<OffFactor>().map_err(usage))
                .collect::<Result<_, _>>()?,
            tip_radius_mm,
            stiffness_n_per_mm,
            friction,
            scan_edge_mm,
            scan_noise_mm,
            scanner: scanner.as_deref().map(scanner_named).transpose()?,
            sides: sides
                .iter()
                .map(|text| text.parse::<Side>().map_err(usage))
                .collect::<Result<_, _>>()?,
        };
        settings.simulated(&truth)
    })?;
    let [into, of_scan, recording] = [(); 3].map(|()| PyDict::new(py));
    CompactMesh::of(&scan).into_dict(&of_scan)?;
    messages_into(&touch.messages, WrenchFrame::Sensor, &recording)?;
    into.set_item("scan", of_scan)?;
    into.set_item("recording", recording)?;
    into.set_item("scene", scene)?;
    Ok(into)
}

fn scanner_named(name: &str) -> Result<ScannerKind, CliError> {
    ScannerKind::of_name(name)
        .ok_or_else(|| usage(format!("scanner {name:?} must be \"cheap\" or \"good\"")))
}
