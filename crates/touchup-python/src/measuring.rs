//! Features of a mesh, its deviation from the true part, and its alignment with it.

use nalgebra::Isometry3;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;
use touchup::cli::{CliError, comparison_json};
use touchup_features::align::{
    FeaturesError, FeaturesParams, IcpParams, OrientedSample, PairsParams, PointPair, Surfaces,
    align_features, fit_pairs, icp,
};
use touchup_features::compare::{
    CompareParams, IndexedMesh, Regions, SupportRegion, UnlikeExtents, compare as compare_shapes,
    sample_surface, surface_area,
};
use touchup_features::features::detect;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_io::mesh_file::{MeshFile, MeshUnit, repaired};
use touchup_session::session::found;
use touchup_session::threads::Threads;

use crate::arrays::{
    MeshArrays, json as to_json, matrix, mesh_of, mesh_vecs, of_equal_length, rows, touches_of,
};
use crate::failure::{at_work, exception, usage};
use crate::scenes::shown;

/// Number of mesh points for one alignment.
const POINTS: f64 = 100_000.0;
/// Number of mesh points for each of many alignments.
const POINTS_EACH: f64 = 20_000.0;

/// Holes, slots, pockets, bosses, spheres, edges, corners and planes of a mesh, as JSON.
#[pyfunction]
#[pyo3(signature = (mesh, touches))]
pub fn features(
    py: Python<'_>,
    mesh: MeshArrays<'_>,
    touches: Option<&Bound<'_, PyDict>>,
) -> PyResult<String> {
    let (vertices, faces) = mesh_vecs(&mesh, "the mesh").map_err(|error| exception(py, error))?;
    let touches = touches
        .map(touches_of)
        .transpose()?
        .transpose()
        .map_err(|error| exception(py, error))?;
    at_work(py, || {
        // other programs give each triangle corners of its own, which makes every side an edge
        let MeshFile { mesh, .. } =
            repaired(&shown(None, "the mesh"), MeshUnit::Metre, vertices, faces)?;
        to_json(&found(&mesh, &touches.unwrap_or_default()).1)
    })
}

/// A mesh and the tree over its faces.
struct SearchableMesh {
    mesh: TriMesh,
    tree: FaceTree,
}

impl SearchableMesh {
    fn new(mesh: TriMesh) -> Self {
        Self {
            tree: FaceTree::new_by(&mesh, &Threads),
            mesh,
        }
    }

    fn shape(&self) -> IndexedMesh<'_> {
        IndexedMesh {
            mesh: &self.mesh,
            tree: &self.tree,
        }
    }
}

/// Deviation of a mesh from the true part: `report` as JSON in mm, and `deviation` (V,) of each
/// vertex, m, + outside.
#[pyfunction]
#[pyo3(signature = (mesh, support, truth, samples, seed, range_mm, tolerance_mm))]
#[expect(clippy::too_many_arguments, reason = "what the package passes on")]
pub fn compare<'py>(
    py: Python<'py>,
    mesh: MeshArrays<'_>,
    support: Option<PyReadonlyArray1<'_, u8>>,
    truth: MeshArrays<'_>,
    samples: usize,
    seed: u64,
    range_mm: Option<f64>,
    tolerance_mm: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let read = || {
        let (mesh, truth) = (mesh_of(&mesh, "the mesh")?, mesh_of(&truth, "the truth")?);
        let support = support.map(|support| support.as_array().to_vec());
        if let Some(support) = &support {
            of_equal_length(
                ("vertices", mesh.vertex_slots()),
                &[("support", support.len())],
            )?;
        }
        for (name, given) in [("range_mm", range_mm), ("tolerance_mm", tolerance_mm)] {
            if let Some(value) = given.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(usage(format!("{name} {value} must be a number above 0")));
            }
        }
        Ok((mesh, truth, support))
    };
    let (mesh, truth, support) = read().map_err(|error| exception(py, error))?;
    let (report, deviations) = at_work(py, || {
        UnlikeExtents::of(&mesh, &truth)
            .into_iter()
            .for_each(remark);
        let (mesh, truth) = (SearchableMesh::new(mesh), SearchableMesh::new(truth));
        let region = |number: &u8| match number {
            0 => SupportRegion::Untouched,
            1 => SupportRegion::Touched,
            _ => SupportRegion::Guessed,
        };
        let regions: Option<Vec<_>> = support.map(|support| support.iter().map(region).collect());
        let regions = regions.as_deref().map_or(Regions::Unknown, Regions::Own);
        let [range, tolerance] = [range_mm, tolerance_mm].map(|mm| mm.map(|mm| mm * 1e-3));
        let params = CompareParams {
            samples,
            seed,
            range,
            tolerance,
            ..CompareParams::default()
        };
        let compared = compare_shapes(mesh.shape(), truth.shape(), regions, &params, &Threads)?;
        Ok((
            comparison_json(&compared).to_string(),
            compared.vertex_deviations,
        ))
    })?;
    let into = PyDict::new(py);
    into.set_item("report", report)?;
    into.set_item("deviation", PyArray1::from_vec(py, deviations))?;
    Ok(into)
}

fn remark(unlike: UnlikeExtents) {
    match unlike {
        UnlikeExtents::Size(_) => tracing::warn!("{unlike}: are both in m, and of the same part?"),
        UnlikeExtents::Apart(_) => {
            tracing::warn!("{unlike}: are both in one frame? touchup.align finds the motion")
        }
    }
}

fn spread(mesh: &TriMesh, count: f64, seed: u64) -> Vec<OrientedSample> {
    let samples = sample_surface(
        mesh,
        count / surface_area(mesh).max(f64::MIN_POSITIVE),
        seed,
    );
    samples
        .iter()
        .map(|sample| OrientedSample {
            point: sample.point,
            normal: mesh.normal(sample.face),
        })
        .collect()
}

/// The rigid motion of `source` onto `target`: by point to plane from nearly the right pose, or by
/// features from anywhere.
#[pyfunction]
#[pyo3(signature = (source, target, method, alternative, seed))]
pub fn align<'py>(
    py: Python<'py>,
    source: MeshArrays<'_>,
    target: MeshArrays<'_>,
    method: &str,
    alternative: Option<usize>,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let read = || {
        Ok((
            mesh_of(&source, "the source")?,
            mesh_of(&target, "the target")?,
        ))
    };
    let (source, target) = read().map_err(|error| exception(py, error))?;
    let (motion, report) = at_work(py, || {
        let unlike = UnlikeExtents::of(&source, &target)
            .filter(|unlike| matches!(unlike, UnlikeExtents::Size(_)));
        unlike.into_iter().for_each(remark);
        let target = SearchableMesh::new(target);
        match method {
            "icp" => {
                let points: Vec<_> = spread(&source, POINTS, seed)
                    .iter()
                    .map(|p| p.point)
                    .collect();
                let start = Isometry3::identity();
                let fit = icp(
                    &points,
                    &target.mesh,
                    &target.tree,
                    &start,
                    &IcpParams::default(),
                    &Threads,
                )?;
                let undetermined = fit.undetermined().count();
                Ok((
                    fit.source_to_target,
                    json!({
                        "method": "icp", "rms_mm": fit.rms * 1e3, "points": points.len(), "inliers": fit.inliers,
                        "rounds": fit.rounds, "undetermined": undetermined,
                    }),
                ))
            }
            "features" => by_features(&source, &target, alternative, seed),
            other => Err(usage(format!(
                "method {other:?} must be \"icp\" or \"features\""
            ))),
        }
    })?;
    let into = PyDict::new(py);
    into.set_item("matrix", homogeneous(py, &motion)?)?;
    into.set_item("report", report.to_string())?;
    Ok(into)
}

fn by_features(
    source: &TriMesh,
    target: &SearchableMesh,
    alternative: Option<usize>,
    seed: u64,
) -> Result<(Isometry3<f64>, serde_json::Value), CliError> {
    let own = detect(source, &[]).features;
    let theirs = detect(&target.mesh, &[]).features;
    let points = spread(source, POINTS_EACH, seed);
    let surfaces = Surfaces {
        points: &points,
        target: &target.mesh,
        tree: &target.tree,
    };
    let found = match align_features(&own, &theirs, Some(&surfaces), &FeaturesParams::default()) {
        Ok(only) => vec![only],
        Err(
            FeaturesError::Ambiguous { alternatives }
            | FeaturesError::FreeTurn { alternatives, .. },
        ) if alternative.is_some() => alternatives,
        Err(error) => return Err(error.into()),
    };
    let number = alternative.unwrap_or(1);
    let Some(chosen) = number.checked_sub(1).and_then(|at| found.get(at)) else {
        let count = found.len();
        return Err(usage(format!(
            "alternative {number} is not there: {count} found, counted from 1"
        )));
    };
    let report = json!({
        "method": "features",
        "rms_mm": chosen.icp.as_ref().map(|fit| fit.rms * 1e3),
        "explained_features": chosen.explained.len(),
        "mesh_features": own.len(),
        "truth_features": theirs.len(),
        "agreeing_share": chosen.agreeing,
        "undetermined": chosen.icp.as_ref().map_or(0, |fit| fit.undetermined().count()),
    });
    Ok((chosen.source_to_target, report))
}

fn homogeneous<'py>(
    py: Python<'py>,
    motion: &Isometry3<f64>,
) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
    // rows of the transpose are the stored columns
    let rows: [[f64; 4]; 4] = motion.to_homogeneous().transpose().into();
    matrix(py, rows.to_vec())
}

/// The rigid motion that fits pairs of points by least squares: `from`, N × 3, onto `to`, N × 3, m.
#[pyfunction]
pub fn align_pairs<'py>(
    py: Python<'py>,
    source: PyReadonlyArray2<'_, f64>,
    target: PyReadonlyArray2<'_, f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let read = || {
        let (from, to) = (
            rows::<3, f64>(&source, "source_points")?,
            rows::<3, f64>(&target, "target_points")?,
        );
        of_equal_length(
            ("source_points", from.len()),
            &[("target_points", to.len())],
        )?;
        let pair = |(from, to): (&[f64; 3], &[f64; 3])| PointPair {
            from: (*from).into(),
            to: (*to).into(),
            sigma: None,
        };
        Ok(from.iter().zip(&*to).map(pair).collect())
    };
    let pairs: Vec<PointPair> = read().map_err(|error| exception(py, error))?;
    let fit = at_work(py, || {
        fit_pairs(&pairs, &PairsParams::default()).map_err(|error| CliError {
            kind: "calibration",
            message: error.to_string(),
            hint: None,
            exit_code: 3,
        })
    })?;
    let into = PyDict::new(py);
    into.set_item("matrix", homogeneous(py, &fit.motion)?)?;
    let report = json!({ "method": "pairs", "rms_mm": fit.rms * 1e3, "undetermined": 0 });
    into.set_item("report", report.to_string())?;
    into.set_item(
        "residuals",
        matrix::<3, f64>(py, fit.residuals.iter().map(|of| (*of).into()).collect())?,
    )?;
    Ok(into)
}
