//! Errors of a scene.

use std::path::PathBuf;

use touchup_io::file_error::FileError;
use touchup_method::stylus::SettingError;

/// Error of an unusable scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file is unreadable.
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
    /// Error of the arm's description.
    #[error(transparent)]
    Urdf(#[from] touchup_io::urdf::UrdfError),
    /// Error of the arm's check record.
    #[error(transparent)]
    Check(#[from] super::CheckRecordError),
    /// No face of the scan is near the touched region.
    #[error(
        "no face of the scan is in or near scan.region_low_mm to scan.region_high_mm; is scan.unit right?"
    )]
    EmptyRegion,
    /// A key needs another key, which is missing.
    #[error("{key} needs {needs}: name both or neither")]
    Incomplete {
        /// section, key and value
        key: &'static str,
        /// section and key
        needs: &'static str,
    },
    /// A part needs another part, which is missing.
    #[error("{part} needs {needs}: name it, or say `{part}: off`")]
    Unmet {
        /// name of the part
        part: &'static str,
        /// section, or section and key
        needs: &'static str,
    },
    /// Neither a flag nor the scene gives the radius of the ball.
    #[error(
        "the radius of the ball is not known: give --tip-radius-mm, or tip.radius_mm in the scene (`touchup init` writes one)"
    )]
    NoRadius,
    /// The form of the file does not allow an edit without harm to the rest.
    #[error("the scene cannot be edited ({why}); put this in by hand: {settings}")]
    CannotEdit {
        /// reason
        why: String,
        /// keys and values
        settings: String,
    },
    /// The error of one file.
    #[error("{path}: {error}", path = path.display())]
    In {
        /// the file
        path: PathBuf,
        /// its error
        error: Box<SceneError>,
    },
}

/// The parser's text for programmers.
const FOR_PROGRAMMERS: &str = ", set DuplicateKeyPolicy in Options if acceptable";

/// One line with the position, and the nearest known key for a misspelt one.
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

/// The known word with the fewest insertions, deletions, replacements and swaps from `word`, if
/// they are at most half its length.
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    // a longer name is no typing mistake, and the distance costs the product of both lengths
    const LONGEST: usize = 64;
    let edits = |key: &&str| strsim::osa_distance(word, key);
    let near = known
        .iter()
        .copied()
        .filter(|_| word.len() <= LONGEST)
        .min_by_key(edits)?;
    (2 * edits(&near) <= word.len()).then_some(near)
}
