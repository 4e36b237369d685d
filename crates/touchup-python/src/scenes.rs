//! Declared keys of the scene, and scenes from the caller.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use serde_json::{Value, json};
use touchup::cli::CliError;
use touchup_method::parameters::{Parameter, Section};
use touchup_session::scene::{Scene, SceneError};

use crate::arrays;
use crate::failure::{at_work, exception};

/// A scene from the caller: the path of a file, or a text.
#[derive(Clone, Debug)]
pub enum SceneSource {
    /// content of a file
    Text(String),
    /// path; files that the scene names are relative to its folder
    File(PathBuf),
}

impl SceneSource {
    /// The scene and its text.
    ///
    /// # Errors
    /// Those of the command line.
    pub fn parsed(&self) -> Result<(Scene, String), CliError> {
        match self {
            Self::Text(text) => Ok((Scene::from_yaml(text)?, text.clone())),
            Self::File(path) => Ok(Scene::read_with_text(path)?),
        }
    }

    /// The checked scene.
    ///
    /// # Errors
    /// Those of [`Self::parsed`], and an unknown radius of the ball.
    pub fn read(&self) -> Result<Scene, CliError> {
        let (scene, text) = self.parsed()?;
        scene.require_radius(&text).map_err(|error| match error {
            SceneError::NoRadius => CliError {
                kind: "usage",
                message:
                    "the radius of the ball is not known: give tip.radius_mm in the scene, as \
                          scene={\"tip\": {\"radius_mm\": 1.5}}"
                        .to_owned(),
                hint: None,
                exit_code: 2,
            },
            error => error.into(),
        })?;
        Ok(scene)
    }
}

/// Every key of the scene as JSON: section, key, unit, range, words, an example of its value,
/// summary, and inner keys.
#[pyfunction]
pub fn scene_parameters(py: Python<'_>) -> PyResult<String> {
    let all: Vec<Value> = Scene::parameters().iter().map(declared).collect();
    arrays::json(&all).map_err(|error| exception(py, error))
}

fn declared(parameter: &Parameter) -> Value {
    let value = |yaml: &str| serde_saphyr::from_str::<Value>(yaml).unwrap_or(Value::Null);
    json!({
        "name": parameter.name(),
        "key": parameter.key,
        "unit": parameter.unit.symbol,
        "range": parameter.range,
        "words": parameter.words,
        "default": parameter.default.as_deref().map(value),
        "example": value(parameter.example),
        "summary": parameter.summary(),
        "is_section": parameter.is_section,
        "is_list": parameter.is_list,
        "inner": parameter.inner.iter().map(declared).collect::<Vec<_>>(),
    })
}

/// The default scene as JSON, without inactive keys.
#[pyfunction]
pub fn default_scene(py: Python<'_>) -> PyResult<String> {
    at_work(py, || {
        let scene: Value = serde_saphyr::from_str(&Scene::template()).map_err(|error| {
            crate::failure::usage(format!("the template of the scene cannot be read: {error}"))
        })?;
        arrays::json(&scene)
    })
}

/// Refuses an invalid scene.
#[pyfunction]
#[pyo3(signature = (text, path))]
pub fn check_scene(py: Python<'_>, text: Option<String>, path: Option<PathBuf>) -> PyResult<()> {
    at_work(py, || source(text, path)?.read().map(drop))
}

/// The scene from the caller's arguments.
///
/// # Errors
/// For both or neither.
pub fn source(text: Option<String>, path: Option<PathBuf>) -> Result<SceneSource, CliError> {
    match (text, path) {
        (Some(text), None) => Ok(SceneSource::Text(text)),
        (None, Some(path)) => Ok(SceneSource::File(path)),
        _ => Err(crate::failure::usage(
            "a scene is a dictionary, or the path of a file".to_owned(),
        )),
    }
}

/// A path for messages, or its placeholder.
pub fn shown(path: Option<&Path>, otherwise: &str) -> PathBuf {
    path.map_or_else(|| PathBuf::from(otherwise), Path::to_path_buf)
}
