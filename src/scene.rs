//! The YAML that names the parts of a scene and their parameters, turned into the rooms' own settings.
//!
//! A part that is not named is not built: a scene that names only `refine` is the bare loop. A part that is named
//! without keys takes its defaults. `config/default.yaml` is [`Scene::default`] written out, with every key explained.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer};

use crate::touch::{CompensatorParams, ContactGateParams, Payload, SyncParams, WrenchFrame};

/// Why a scene is not usable.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read the scene {path}: {source}", path = path.display())]
    Read {
        /// which file
        path: PathBuf,
        /// what the system says
        source: std::io::Error,
    },
    /// Not YAML, an unknown key, or a value of the wrong kind.
    #[error("{message}{hint}")]
    Yaml {
        /// with line and column
        message: String,
        /// the nearest known key, or nothing
        hint: String,
    },
    /// A value outside its range.
    #[error("{key} is {value}; it must be {allowed}")]
    OutOfRange {
        /// section and key
        key: &'static str,
        /// as given, in the unit of the key
        value: f64,
        /// the range, in the same unit
        allowed: &'static str,
    },
    /// The error of one file.
    #[error("{path}: {error}", path = path.display())]
    In {
        /// which file
        path: PathBuf,
        /// what is wrong in it
        error: Box<SceneError>,
    },
}

/// The parts of a scene. `None`: not built.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Pairs poses with wrenches; without it only those of equal stamp pair.
    #[serde(default, deserialize_with = "named")]
    pub sync: Option<SyncSection>,
    /// Takes weight and bias off the wrench.
    #[serde(default, deserialize_with = "named")]
    pub compensation: Option<CompensationSection>,
    /// Tells contact from free motion; without it every sample counts as contact.
    #[serde(default, deserialize_with = "named")]
    pub contact: Option<ContactSection>,
    /// The ball that touches; without it a rigid point does.
    #[serde(default, deserialize_with = "named")]
    pub tip: Option<TipSection>,
    /// How good the scan is.
    #[serde(default, deserialize_with = "named")]
    pub scan: Option<ScanSection>,
}

/// `sync`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SyncSection {
    /// How far a message may lag behind the newest stamp of its stream, ms.
    pub reorder_ms: f64,
    /// Largest distance between the two poses around a wrench, ms.
    pub largest_gap_ms: f64,
    /// A stamp this far ahead is believed only when the next one agrees, s.
    pub largest_jump_s: f64,
    /// What the clock of the wrench reads beyond the clock of the pose, ms.
    pub wrench_offset_ms: f64,
    /// How many messages of each stream are held.
    pub capacity: usize,
}

impl Default for SyncSection {
    fn default() -> Self {
        let SyncParams { reorder_ns, largest_gap_ns, largest_jump_ns, wrench_offset_ns, capacity } =
            SyncParams::default();
        Self {
            reorder_ms: reorder_ns as f64 * 1e-6,
            largest_gap_ms: largest_gap_ns as f64 * 1e-6,
            largest_jump_s: largest_jump_ns as f64 * 1e-9,
            wrench_offset_ms: wrench_offset_ns as f64 * 1e-6,
            capacity,
        }
    }
}

/// `compensation`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CompensationSection {
    /// Origin of the sensor from the centre of the ball, in the axes of the tip, mm.
    pub sensor_position_mm: [f64; 3],
    /// Orientation of the sensor in the tip's frame, quaternion x, y, z, w; none: the same axes.
    pub sensor_orientation_xyzw: Option<[f64; 4]>,
    /// What hangs on the sensor.
    #[serde(deserialize_with = "named")]
    pub payload: Option<PayloadSection>,
    /// What the sensor reads when nothing touches and nothing hangs on it.
    #[serde(deserialize_with = "named")]
    pub bias: Option<BiasSection>,
}

/// `compensation.payload`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PayloadSection {
    /// kg
    pub mass_kg: f64,
    /// Centre of mass from the sensor's origin, in the axes of the sensor, mm.
    pub centre_mm: [f64; 3],
    /// Acceleration of gravity in the axes of the object, m/s².
    pub gravity_m_per_s2: [f64; 3],
}

impl Default for PayloadSection {
    fn default() -> Self {
        Self { mass_kg: 0.0, centre_mm: [0.0; 3], gravity_m_per_s2: [0.0, 0.0, -9.81] }
    }
}

/// `compensation.bias`
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BiasSection {
    /// In the axes of the sensor, N.
    pub force_n: [f64; 3],
    /// In the axes of the sensor, N·m.
    pub torque_nm: [f64; 3],
}

/// `contact`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactSection {
    /// A force above this begins a contact, N.
    pub on_n: f64,
    /// A force below this ends it, N.
    pub off_n: f64,
}

impl Default for ContactSection {
    fn default() -> Self {
        let ContactGateParams { on, off } = ContactGateParams::default();
        Self { on_n: on, off_n: off }
    }
}

/// `tip`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TipSection {
    /// Radius of the ball, mm.
    pub radius_mm: f64,
    /// Stiffness of stylus and holder at the ball, N/mm; none: rigid.
    pub stiffness_n_per_mm: Option<f64>,
}

impl Default for TipSection {
    /// A 3 mm ruby ball on a usual stylus.
    fn default() -> Self {
        Self { radius_mm: 1.5, stiffness_n_per_mm: Some(20.0) }
    }
}

/// `scan`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScanSection {
    /// Standard deviation of the scan from the true surface, mm.
    pub noise_mm: f64,
}

impl Default for ScanSection {
    /// A consumer depth camera at half a metre.
    fn default() -> Self {
        Self { noise_mm: 0.6 }
    }
}

impl Default for Scene {
    /// All but compensation, which depends on the sensor.
    fn default() -> Self {
        Self {
            sync: Some(SyncSection::default()),
            compensation: None,
            contact: Some(ContactSection::default()),
            tip: Some(TipSection::default()),
            scan: Some(ScanSection::default()),
        }
    }
}

impl Scene {
    /// Reads and checks a scene.
    ///
    /// # Errors
    /// [`SceneError`], with the path.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let yaml =
            std::fs::read_to_string(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        Self::from_yaml(&yaml).map_err(|error| SceneError::In { path: path.to_owned(), error: Box::new(error) })
    }

    /// Parses and checks a scene.
    ///
    /// # Errors
    /// [`SceneError::Yaml`], [`SceneError::OutOfRange`].
    ///
    /// # Example
    /// ```
    /// let scene = touchup::scene::Scene::from_yaml("contact: { on_n: 0.5 }")?;
    /// assert_eq!(scene.contact_params().unwrap().on, 0.5);
    /// assert!(scene.sync.is_none());
    /// # Ok::<(), touchup::scene::SceneError>(())
    /// ```
    pub fn from_yaml(yaml: &str) -> Result<Self, SceneError> {
        let scene: Self = serde_saphyr::from_str(yaml).map_err(|error| yaml_error(&error))?;
        scene.check()?;
        Ok(scene)
    }

    /// Checks every range; to be called again after a flag changed a value.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`].
    pub fn check(&self) -> Result<(), SceneError> {
        if let Some(sync) = &self.sync {
            sync.check()?;
        }
        if let Some(compensation) = &self.compensation {
            compensation.check()?;
        }
        if let Some(ContactSection { on_n, off_n }) = self.contact {
            in_range("contact.off_n", off_n, 0.0, 1e3, "0 to 1000 N")?;
            in_range("contact.on_n", on_n, off_n, 1e3, "contact.off_n to 1000 N")?;
        }
        if let Some(TipSection { radius_mm, stiffness_n_per_mm }) = self.tip {
            in_range("tip.radius_mm", radius_mm, 0.0, 1e3, "0 to 1000 mm")?;
            let stiffness = stiffness_n_per_mm.unwrap_or(1.0);
            in_range("tip.stiffness_n_per_mm", stiffness, 1e-3, 1e9, "0.001 to 1e9 N/mm; leave it out for rigid")?;
        }
        if let Some(ScanSection { noise_mm }) = self.scan {
            in_range("scan.noise_mm", noise_mm, 0.0, 1e3, "0 to 1000 mm")?;
        }
        Ok(())
    }

    /// Settings of the synchroniser; without `sync` only messages of equal stamp pair.
    pub fn sync_params(&self) -> SyncParams {
        let Some(sync) = &self.sync else {
            return SyncParams { reorder_ns: 0, largest_gap_ns: 0, ..SyncParams::default() };
        };
        SyncParams {
            reorder_ns: nanoseconds(sync.reorder_ms, 1e6),
            largest_gap_ns: nanoseconds(sync.largest_gap_ms, 1e6),
            largest_jump_ns: nanoseconds(sync.largest_jump_s, 1e9),
            wrench_offset_ns: nanoseconds(sync.wrench_offset_ms, 1e6),
            capacity: sync.capacity,
        }
    }

    /// Settings of the compensator for a wrench that arrives in the axes of `wrench_frame`.
    pub fn compensator_params(&self, wrench_frame: WrenchFrame) -> CompensatorParams {
        let Some(compensation) = &self.compensation else {
            return CompensatorParams { wrench_frame, ..CompensatorParams::default() };
        };
        let [x, y, z, w] = compensation.sensor_orientation_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        CompensatorParams {
            wrench_frame,
            pose_ts: Isometry3::from_parts(metres(compensation.sensor_position_mm).into(), rotation),
            payload: compensation.payload.as_ref().map(|payload| Payload {
                mass: payload.mass_kg,
                p_sc: metres(payload.centre_mm),
                gravity_o: payload.gravity_m_per_s2.into(),
            }),
            bias_s: compensation
                .bias
                .as_ref()
                .map(|bias| crate::touch::Wrench { force: bias.force_n.into(), torque: bias.torque_nm.into() }),
        }
    }

    /// Thresholds of the contact gate, if there is one.
    pub fn contact_params(&self) -> Option<ContactGateParams> {
        self.contact.as_ref().map(|contact| ContactGateParams { on: contact.on_n, off: contact.off_n })
    }
}

impl SyncSection {
    fn check(&self) -> Result<(), SceneError> {
        in_range("sync.reorder_ms", self.reorder_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_gap_ms", self.largest_gap_ms, 0.0, 6e4, "0 to 60000 ms")?;
        in_range("sync.largest_jump_s", self.largest_jump_s, 0.0, 1e6, "0 to 1e6 s")?;
        in_range("sync.wrench_offset_ms", self.wrench_offset_ms, -6e4, 6e4, "-60000 to 60000 ms")?;
        in_range("sync.capacity", self.capacity as f64, 2.0, 1e6, "2 to 1000000 messages")
    }
}

impl CompensationSection {
    fn check(&self) -> Result<(), SceneError> {
        let all = |key, values: &[f64], largest: f64, allowed| {
            values.iter().try_for_each(|&value| in_range(key, value, -largest, largest, allowed))
        };
        all("compensation.sensor_position_mm", &self.sensor_position_mm, 1e5, "-100000 to 100000 mm")?;
        if let Some(xyzw) = self.sensor_orientation_xyzw {
            let norm = xyzw.iter().map(|c| c * c).sum::<f64>().sqrt();
            let allowed = "a quaternion of length 1 within 0.001 (this is its length)";
            in_range("compensation.sensor_orientation_xyzw", norm, 0.999, 1.001, allowed)?;
        }
        if let Some(payload) = &self.payload {
            in_range("compensation.payload.mass_kg", payload.mass_kg, 0.0, 1e3, "0 to 1000 kg")?;
            all("compensation.payload.centre_mm", &payload.centre_mm, 1e4, "-10000 to 10000 mm")?;
            all("compensation.payload.gravity_m_per_s2", &payload.gravity_m_per_s2, 100.0, "-100 to 100 m/s²")?;
        }
        if let Some(bias) = &self.bias {
            all("compensation.bias.force_n", &bias.force_n, 1e4, "-10000 to 10000 N")?;
            all("compensation.bias.torque_nm", &bias.torque_nm, 1e4, "-10000 to 10000 N·m")?;
        }
        Ok(())
    }
}

/// A key that is there names its part, also without a value.
fn named<'de, D: Deserializer<'de>, T: Deserialize<'de> + Default>(deserializer: D) -> Result<Option<T>, D::Error> {
    Option::<T>::deserialize(deserializer).map(|part| Some(part.unwrap_or_default()))
}

fn in_range(key: &'static str, value: f64, low: f64, high: f64, allowed: &'static str) -> Result<(), SceneError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(SceneError::OutOfRange { key, value, allowed }) }
}

/// `value` in units of `unit_ns`; checked before, so that it fits.
fn nanoseconds(value: f64, unit_ns: f64) -> i64 {
    (value * unit_ns).round() as i64
}

fn metres(mm: [f64; 3]) -> Vector3<f64> {
    Vector3::from(mm) * 1e-3
}

/// One line with the place, and the nearest known key where one is misspelt.
fn yaml_error(error: &serde_saphyr::Error) -> SceneError {
    let plain = error.without_snippet();
    let hint = match plain {
        serde_saphyr::Error::SerdeUnknownField { field, expected, .. } => {
            nearest(field, expected).map(|known| format!("; did you mean `{known}`?")).unwrap_or_default()
        }
        _ => String::new(),
    };
    SceneError::Yaml { message: plain.to_string().replace('\n', " "), hint }
}

/// The known key that fewest edits turn `word` into, when that is less than half of it.
fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let edits = |key: &&&str| edit_distance(word, key);
    known.iter().min_by_key(edits).copied().filter(|key| 2 * edit_distance(word, key) < word.len())
}

/// Insertions, deletions and replacements that turn `a` into `b`.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, &y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
