//! What can be wrong with a scene.

use std::path::PathBuf;

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
    /// No face of the scan is near the region that is touched.
    #[error("no face of the scan is in or near scan.region_low_mm to scan.region_high_mm; is scan.unit right?")]
    EmptyRegion,
    /// A name that means nothing.
    #[error("{key} is {value}; it must be {allowed}")]
    NoSuch {
        /// section and key
        key: &'static str,
        /// as given
        value: String,
        /// the names
        allowed: &'static str,
    },
    /// A key that another one needs is not there.
    #[error("{key} needs {needs}: name both or neither")]
    Incomplete {
        /// section, key and value
        key: &'static str,
        /// section and key
        needs: &'static str,
    },
    /// A file that is written in a way that cannot be edited without harm to the rest of it.
    #[error("the scene cannot be edited ({why}); put this in by hand: {settings}")]
    CannotEdit {
        /// what stands in the way
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

/// What the parser adds for those who program with it.
const FOR_PROGRAMMERS: &str = ", set DuplicateKeyPolicy in Options if acceptable";

/// One line with the place, and the nearest known key where one is misspelt.
pub(super) fn yaml_error(error: &serde_saphyr::Error) -> SceneError {
    let plain = error.without_snippet();
    let hint = match plain {
        serde_saphyr::Error::SerdeUnknownField { field, expected, .. } => {
            nearest(field, expected).map(|known| format!("; did you mean `{known}`?")).unwrap_or_default()
        }
        _ => String::new(),
    };
    SceneError::Yaml { message: plain.to_string().replace(FOR_PROGRAMMERS, "").replace('\n', " "), hint }
}

/// The known key that fewest edits turn `word` into, when that is no more than half of it.
fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let edits = |key: &&&str| edit_distance(word, key);
    known.iter().min_by_key(edits).copied().filter(|key| 2 * edit_distance(word, key) <= word.len())
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
