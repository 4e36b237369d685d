//! Refinement sample by sample.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyDict, PyTuple};
use touchup::cli::CliError;
use touchup_method::haptic::{Case, Mismatch, RefineCounts};
use touchup_method::stylus::{Sample, SampleError};
use touchup_session::live::LiveError;
use touchup_session::refinement::{Refinement, reason_of_refusal};

use crate::arrays::{CompactMesh, MeshArrays, of_equal_length, rows, sample, wrench_frame};
use crate::failure::{at_work, exception, usage};
use crate::refining::{ScanSource, finish_refinement, refinement};
use crate::scenes::source;

/// Samples between two checks for an interrupt by the user; they fit the caches of a core.
const CHUNK: usize = 1024;
/// Case number of a refused sample.
const REFUSED: u8 = 255;

/// Effect of one sample.
#[pyclass(frozen, name = "Update", module = "touchup")]
pub struct PyUpdate {
    update: touchup_method::haptic::Update,
}

#[pymethods]
impl PyUpdate {
    /// "free", "mesh_only", "surface_only" or "both": whether contact is expected and measured
    #[getter]
    fn case(&self) -> &'static str {
        match self.update.case {
            Case::Free => "free",
            Case::MeshOnly => "mesh_only",
            Case::SurfaceOnly => "surface_only",
            Case::Both => "both",
        }
    }

    /// The touched face; None without a face within reach.
    #[getter]
    fn face(&self) -> Option<u32> {
        self.update.mismatch.map(|mismatch| mismatch.face.0)
    }

    /// Signed distance of the ball's contact point from that face, m.
    #[getter]
    fn distance(&self) -> Option<f64> {
        self.update.mismatch.map(|mismatch| mismatch.distance)
    }

    /// Force expected from the scan, N, in O.
    #[getter]
    fn expected_force(&self) -> Option<[f64; 3]> {
        self.vector(|mismatch| mismatch.expected_force_o)
    }

    /// Measured less expected force, N, in O.
    #[getter]
    fn mismatch(&self) -> Option<[f64; 3]> {
        self.vector(|mismatch| mismatch.linear)
    }

    /// Whether the mesh moved.
    #[getter]
    fn moved(&self) -> bool {
        self.update.fit.is_some()
    }

    fn __repr__(&self) -> String {
        let face = self
            .face()
            .map_or_else(|| "None".to_owned(), |face| face.to_string());
        format!(
            "Update(case={:?}, face={face}, moved={})",
            self.case(),
            if self.moved() { "True" } else { "False" }
        )
    }
}

impl PyUpdate {
    fn vector(&self, of: fn(&Mismatch) -> Vector3<f64>) -> Option<[f64; 3]> {
        self.update
            .mismatch
            .as_ref()
            .map(|mismatch| of(mismatch).into())
    }
}

/// `N` numbers of an array, a tuple or a list.
fn numbers<const N: usize>(given: &Bound<'_, PyAny>, name: &str) -> PyResult<[f64; N]> {
    if let Ok(array) = given.cast::<PyArray1<f64>>() {
        let mut values = [0.0; N];
        let is_whole = array.get_owned(N).is_none();
        let mut known = (0..N).map(|at| array.get_owned(at));
        if is_whole
            && values
                .iter_mut()
                .all(|to| known.next().flatten().map(|x| *to = x).is_some())
        {
            return Ok(values);
        }
    } else if let Ok(tuple) = given.cast::<PyTuple>()
        && tuple.len() == N
    {
        let mut values = [0.0; N];
        for (to, item) in values.iter_mut().zip(tuple.iter_borrowed()) {
            *to = item.extract()?;
        }
        return Ok(values);
    }
    let what = |_| exception(given.py(), usage(format!("{name} must be {N} numbers")));
    given.extract().map_err(what)
}

/// Samples as arrays: stamps N, ns; positions N × 3, m; orientations N × 4, x y z w; forces and
/// torques N × 3, N and N·m.
type SampleArrays<'py> = (
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);

/// Effects of many samples.
#[derive(Default)]
struct UpdateArrays {
    case: Vec<u8>,
    face: Vec<i64>,
    distance: Vec<f64>,
    refused: std::collections::BTreeMap<&'static str, u64>,
    first_refusal: Option<(usize, String)>,
}

impl UpdateArrays {
    fn with_capacity(count: usize) -> Self {
        let (case, face) = (Vec::with_capacity(count), Vec::with_capacity(count));
        Self {
            case,
            face,
            distance: Vec::with_capacity(count),
            ..Self::default()
        }
    }

    #[inline]
    fn push(&mut self, refinement: &mut Refinement, sample: &Result<Sample, SampleError>) {
        let updated = match sample {
            Ok(sample) => refinement.push(sample),
            Err(error) => Err(LiveError::Refine((*error).into())),
        };
        match updated {
            Ok(update) => {
                let mismatch = update.and_then(|update| update.mismatch);
                let case = update.map_or(Case::Free, |update| update.case);
                self.append(
                    case as u8,
                    mismatch.map(|mismatch| (i64::from(mismatch.face.0), mismatch.distance)),
                );
            }
            Err(error) => self.refuse(&error),
        }
    }

    #[inline]
    fn append(&mut self, case: u8, touched: Option<(i64, f64)>) {
        let (face, distance) = touched.unwrap_or((-1, f64::NAN));
        self.case.push(case);
        self.face.push(face);
        self.distance.push(distance);
    }

    #[cold]
    fn refuse(&mut self, error: &LiveError) {
        *self.refused.entry(reason_of_refusal(error)).or_default() += 1;
        self.first_refusal
            .get_or_insert_with(|| (self.case.len(), error.to_string()));
        self.append(REFUSED, None);
    }
}

/// Refines a scan sample by sample.
#[pyclass(frozen, subclass, name = "Refiner", module = "touchup._touchup")]
pub struct PyRefiner {
    state: Mutex<RefinerState>,
}

/// State of a refiner.
enum RefinerState {
    Open(Box<Refinement>),
    /// final counts of the samples
    Finished(RefineCounts),
}

impl RefinerState {
    fn open(&mut self) -> Option<&mut Refinement> {
        if let Self::Open(refinement) = self {
            Some(refinement)
        } else {
            None
        }
    }

    fn counts(&self) -> RefineCounts {
        match self {
            Self::Open(refinement) => *refinement.counts(),
            Self::Finished(counts) => *counts,
        }
    }
}

impl PyRefiner {
    /// Locks the state. Another thread may hold it at work, without need of the interpreter.
    fn locked(&self, py: Python<'_>) -> MutexGuard<'_, RefinerState> {
        match self.state.try_lock() {
            Ok(guard) => guard,
            Err(_) => self
                .state
                .lock_py_attached(py)
                .unwrap_or_else(PoisonError::into_inner),
        }
    }

    fn in_use<T>(
        &self,
        py: Python<'_>,
        with: impl FnOnce(&mut Refinement) -> PyResult<T>,
    ) -> PyResult<T> {
        match self.locked(py).open() {
            Some(refinement) => with(refinement),
            None => Err(exception(py, finished())),
        }
    }
}

#[cold]
fn finished() -> CliError {
    usage("the refiner is finished: make another one for more samples".to_owned())
}

/// The rows of the arrays of samples, of equal length.
struct SampleRows<'a> {
    stamp_ns: Cow<'a, [i64]>,
    position: Cow<'a, [[f64; 3]]>,
    orientation: Cow<'a, [[f64; 4]]>,
    force: Cow<'a, [[f64; 3]]>,
    torque: Cow<'a, [[f64; 3]]>,
}

impl<'a> SampleRows<'a> {
    fn of(
        (stamps, position, orientation, force, torque): &'a SampleArrays<'_>,
    ) -> Result<Self, CliError> {
        let stamp_ns = stamps
            .as_slice()
            .map_or_else(|_| Cow::Owned(stamps.as_array().to_vec()), Cow::Borrowed);
        let orientation = rows(orientation, "orientation_xyzw")?;
        let (position, force, torque) = (
            rows(position, "position")?,
            rows(force, "force")?,
            rows(torque, "torque")?,
        );
        let lengths = [
            ("position", position.len()),
            ("orientation_xyzw", orientation.len()),
            ("force", force.len()),
            ("torque", torque.len()),
        ];
        of_equal_length(("stamp_ns", stamp_ns.len()), &lengths)?;
        Ok(Self {
            stamp_ns,
            position,
            orientation,
            force,
            torque,
        })
    }

    /// The samples of some rows; errors for invalid ones.
    fn part(
        &self,
        rows: Range<usize>,
    ) -> impl ExactSizeIterator<Item = Result<Sample, SampleError>> {
        let (position, orientation) = (
            &self.position[rows.clone()],
            &self.orientation[rows.clone()],
        );
        let (force, torque) = (&self.force[rows.clone()], &self.torque[rows.clone()]);
        self.stamp_ns[rows]
            .iter()
            .zip(position)
            .zip(orientation)
            .zip(force)
            .zip(torque)
            .map(|((((stamp_ns, position), xyzw), force), torque)| {
                sample(*stamp_ns, *position, *xyzw, [*force, *torque])
            })
    }

    fn len(&self) -> usize {
        self.stamp_ns.len()
    }
}

#[pymethods]
impl PyRefiner {
    #[new]
    #[pyo3(signature = (scene_text, scene_path, scan, scan_file, frame))]
    fn new(
        py: Python<'_>,
        scene_text: Option<String>,
        scene_path: Option<std::path::PathBuf>,
        scan: Option<MeshArrays<'_>>,
        scan_file: Option<(std::path::PathBuf, String)>,
        frame: &str,
    ) -> PyResult<Self> {
        let read = || {
            Ok((
                ScanSource::of(scan, scan_file)?,
                source(scene_text, scene_path)?,
                wrench_frame(frame)?,
            ))
        };
        let (scan, scene, frame) = read().map_err(|error| exception(py, error))?;
        let refinement = at_work(py, || refinement(scan, &scene, frame))?;
        Ok(Self {
            state: Mutex::new(RefinerState::Open(refinement.into())),
        })
    }

    /// Takes the next sample and moves the mesh.
    ///
    /// - `stamp_ns`: ns, later than the sample before. `position`: (3,) m, centre of the ball in
    ///   the frame of the scan.
    /// - `orientation_xyzw`: (4,) unit quaternion of the tip. `force`: (3,) N. `torque`: (3,) N·m,
    ///   zeros by default.
    ///
    /// Each may be an array, a tuple or a list. Raises `TouchupError` for a sample that is not
    /// finite, absurd or not in order of time; it changes nothing.
    #[pyo3(signature = (stamp_ns, position, orientation_xyzw, force, torque = None))]
    fn push(
        &self,
        py: Python<'_>,
        stamp_ns: i64,
        position: &Bound<'_, PyAny>,
        orientation_xyzw: &Bound<'_, PyAny>,
        force: &Bound<'_, PyAny>,
        torque: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Option<PyUpdate>> {
        let torque = torque.map_or(Ok([0.0; 3]), |torque| numbers(torque, "torque"))?;
        let (position, force) = (numbers(position, "position")?, numbers(force, "force")?);
        let turn = numbers(orientation_xyzw, "orientation_xyzw")?;
        let sample = match sample(stamp_ns, position, turn, [force, torque]) {
            Ok(sample) => sample,
            Err(error) => return Err(exception(py, LiveError::Refine(error.into()).into())),
        };
        self.in_use(py, |refinement| match refinement.push(&sample) {
            Ok(update) => Ok(update.map(|update| PyUpdate { update })),
            Err(error) => Err(exception(py, error.into())),
        })
    }

    /// Takes many samples in order; counts refused ones, which change nothing.
    fn _push_many<'py>(
        &self,
        py: Python<'py>,
        samples: SampleArrays<'_>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rows = SampleRows::of(&samples).map_err(|error| exception(py, error))?;
        let mut pushed = UpdateArrays::with_capacity(rows.len());
        let mut chunk = Vec::with_capacity(CHUNK.min(rows.len()));
        for begin in (0..rows.len()).step_by(CHUNK) {
            py.check_signals()?;
            // with the interpreter held, so that none of its threads writes to the arrays
            chunk.clear();
            chunk.extend(rows.part(begin..rows.len().min(begin + CHUNK)));
            let (state, pushed, chunk) = (&self.state, &mut pushed, &chunk);
            let is_open = py.detach(move || {
                let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
                let Some(refinement) = state.open() else {
                    return false;
                };
                chunk
                    .iter()
                    .for_each(|sample| pushed.push(refinement, sample));
                true
            });
            if !is_open {
                return Err(exception(py, finished()));
            }
        }
        let into = PyDict::new(py);
        into.set_item("case", PyArray1::from_vec(py, pushed.case))?;
        into.set_item("face", PyArray1::from_vec(py, pushed.face))?;
        into.set_item("distance", PyArray1::from_vec(py, pushed.distance))?;
        into.set_item("refused", pushed.refused)?;
        into.set_item("first_refusal", pushed.first_refusal)?;
        Ok(into)
    }

    /// Pushes samples in a Rust loop, for comparison in benches; returns the number of accepted ones.
    fn _push_in_rust(&self, py: Python<'_>, samples: SampleArrays<'_>) -> PyResult<usize> {
        let rows = SampleRows::of(&samples).map_err(|error| exception(py, error))?;
        self.in_use(py, |refinement| {
            let pushed = rows.part(0..rows.len()).filter(|sample| {
                let Ok(sample) = sample else { return false };
                std::hint::black_box(refinement.push(std::hint::black_box(sample))).is_ok()
            });
            Ok(pushed.count())
        })
    }

    /// The current mesh.
    fn _mesh<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let compact = self.in_use(py, |refinement| Ok(CompactMesh::of(refinement.mesh())))?;
        let into = PyDict::new(py);
        compact.into_dict(&into)?;
        Ok(into)
    }

    /// Counts of all samples, by name; also after the end.
    fn _counts(&self, py: Python<'_>) -> PyResult<String> {
        crate::arrays::json(&self.locked(py).counts()).map_err(|error| exception(py, error))
    }

    /// Reconstructs the touched surface; the refiner then takes no more samples.
    fn _finish<'py>(&self, py: Python<'py>, force: bool) -> PyResult<Bound<'py, PyDict>> {
        let refinement = {
            let mut state = self.locked(py);
            let counts = state.counts();
            match std::mem::replace(&mut *state, RefinerState::Finished(counts)) {
                RefinerState::Open(refinement) => *refinement,
                RefinerState::Finished(_) => return Err(exception(py, finished())),
            }
        };
        at_work(py, || finish_refinement(refinement, force))?.into_dict(py)
    }
}
