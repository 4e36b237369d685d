//! What can be wrong with a scene.

use std::path::PathBuf;

use touchup_core::stylus::SettingError;
use touchup_io::file_error::FileError;

/// Why a scene is not usable.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// Not YAML, an unknown key, or a value of the wrong kind.
    #[error("{message}{hint}")]
    Yaml {
        /// with line and column
        message: String,
        /// the nearest known key, or nothing
        hint: String,
    },
    /// A value outside its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The description of the arm.
    #[error(transparent)]
    Urdf(#[from] touchup_io::urdf::UrdfError),
    /// The record of its check.
    #[error(transparent)]
    Check(#[from] super::CheckRecordError),
    /// No face of the scan is near the region that is touched.
    #[error(
        "no face of the scan is in or near scan.region_low_mm to scan.region_high_mm; is scan.unit right?"
    )]
    EmptyRegion,
    /// A key that another one needs is not there.
    #[error("{key} needs {needs}: name both or neither")]
    Incomplete {
        /// section, key and value
        key: &'static str,
        /// section and key
        needs: &'static str,
    },
    /// A part cannot be built without another one.
    #[error("{part} needs {needs}: name it, or say `{part}: off`")]
    Unmet {
        /// by its name
        part: &'static str,
        /// section, or section and key
        needs: &'static str,
    },
    /// Neither a flag nor the scene tells the radius of the ball.
    #[error(
        "the radius of the ball is not known: give --tip-radius-mm, or tip.radius_mm in the scene (`touchup init` writes one)"
    )]
    NoRadius,
    /// A file whose form cannot be edited without harm to the rest of it.
    #[error("the scene cannot be edited ({why}); put this in by hand: {settings}")]
    CannotEdit {
        /// what prevents it
        why: String,
        /// keys and values
        settings: String,
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

/// The parser's text for programmers.
const FOR_PROGRAMMERS: &str = ", set DuplicateKeyPolicy in Options if acceptable";

/// One line with the place, and the nearest known key where one is misspelt.
pub(crate) fn yaml_error(error: &serde_saphyr::Error) -> SceneError {
    let plain = error.without_snippet();
    let hint = match plain {
        serde_saphyr::Error::SerdeUnknownField {
            field, expected, ..
        } => nearest(field, expected)
            .map(|known| format!("; did you mean `{known}`?"))
            .unwrap_or_default(),
        _ => String::new(),
    };
    SceneError::Yaml {
        message: plain
            .to_string()
            .replace(FOR_PROGRAMMERS, "")
            .replace('\n', " "),
        hint,
    }
}

/// The known word that fewest insertions, deletions, replacements and swaps turn `word` into, when
/// that is at most half of it.
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    // such a name is no typing mistake, and the distance costs the product of both lengths
    const LONGEST: usize = 64;
    let edits = |key: &&str| strsim::osa_distance(word, key);
    let near = known
        .iter()
        .copied()
        .filter(|_| word.len() <= LONGEST)
        .min_by_key(edits)?;
    (2 * edits(&near) <= word.len()).then_some(near)
}
