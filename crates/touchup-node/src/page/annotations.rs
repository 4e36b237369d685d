//! Annotations of features by operators, in a file of the session: names, acceptance, and locked
//! values.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::ros::locked;
use crate::ros::messages::Feature;
use touchup_io::session_folder::{read_text, write_text_file};

/// Name of the annotation file in a session folder.
pub const ANNOTATIONS_FILE: &str = "annotations.json";
/// Maximum length of a name, characters.
const LONGEST_NAME: usize = 80;
/// Maximum number of annotated features.
const MOST_ANNOTATED: usize = 10_000;

/// Verdict of an operator on a feature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum OperatorVerdict {
    #[default]
    None,
    Accepted,
    Rejected,
}

/// Annotation of one feature.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Annotation {
    pub name: String,
    pub mark: OperatorVerdict,
    /// the feature at the time of its lock: the values that count from then on
    pub locked: Option<Value>,
}

/// The request of `~/annotate_feature`; a missing field keeps its value.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AnnotateRequest {
    pub id: u32,
    pub name: Option<String>,
    pub mark: Option<OperatorVerdict>,
    pub is_locked: Option<bool>,
}

/// The topic `annotations`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SessionAnnotations {
    pub session: String,
    /// by feature number
    pub features: BTreeMap<u32, Annotation>,
}

/// Annotations of the current session.
#[derive(Debug)]
pub(super) struct Annotations {
    folder: PathBuf,
    current: Mutex<SessionAnnotations>,
}

impl Annotations {
    /// - `folder`: parent of the session folders.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            current: Mutex::default(),
        }
    }

    fn file(&self, session: &str) -> PathBuf {
        self.folder.join(session).join(ANNOTATIONS_FILE)
    }

    /// Annotations of a session.
    pub fn of(&self, session: &str) -> SessionAnnotations {
        let mut current = locked(&self.current);
        if current.session != session {
            let text = read_text(&self.file(session)).unwrap_or_default();
            let features = serde_json::from_str::<SessionAnnotations>(&text)
                .unwrap_or_default()
                .features;
            *current = SessionAnnotations {
                session: session.to_owned(),
                features,
            };
        }
        current.clone()
    }

    /// Annotates a feature.
    ///
    /// - `feature`: its present state; `None`: no feature with this number.
    ///
    /// # Errors
    /// In words: a refused request, or a failed write.
    pub fn annotate(
        &self,
        session: &str,
        request: AnnotateRequest,
        feature: Option<Feature>,
    ) -> Result<(), String> {
        let AnnotateRequest {
            id,
            name,
            mark,
            is_locked,
        } = request;
        let feature = feature.ok_or_else(|| format!("there is no feature {id}"))?;
        let mut all = self.of(session);
        let annotation = all.features.entry(id).or_default();
        if let Some(name) = name {
            let name = name.trim();
            if name.chars().count() > LONGEST_NAME || name.chars().any(char::is_control) {
                return Err(format!(
                    "a name has up to {LONGEST_NAME} characters in one line"
                ));
            }
            name.clone_into(&mut annotation.name);
        }
        annotation.mark = mark.unwrap_or(annotation.mark);
        match is_locked {
            Some(true) if annotation.locked.is_none() => {
                annotation.locked = serde_json::to_value(feature).ok()
            }
            Some(false) => annotation.locked = None,
            _ => {}
        }
        if *annotation == Annotation::default() {
            all.features.remove(&id);
        }
        if all.features.len() > MOST_ANNOTATED {
            return Err(format!("{MOST_ANNOTATED} features are annotated already"));
        }
        let text = serde_json::to_string_pretty(&all).map_err(|error| error.to_string())?;
        let file = self.file(session);
        write_text_file(&file, &text)
            .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
        *locked(&self.current) = all;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hole(diameter: f64) -> Option<Feature> {
        Some(Feature {
            id: 7,
            diameter,
            ..Feature::default()
        })
    }

    fn request(text: &str) -> AnnotateRequest {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn what_is_said_of_a_feature_is_kept_with_its_session_and_found_again() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("one")).unwrap();
        let annotations = Annotations::new(folder.path());
        annotations
            .annotate(
                "one",
                request(r#"{"id": 7, "name": " bore A "}"#),
                hole(8.0),
            )
            .unwrap();
        annotations
            .annotate(
                "one",
                request(r#"{"id": 7, "mark": "accepted", "is_locked": true}"#),
                hole(8.0),
            )
            .unwrap();
        // a locked feature keeps its values
        annotations
            .annotate("one", request(r#"{"id": 7, "is_locked": true}"#), hole(9.0))
            .unwrap();
        let again = Annotations::new(folder.path()).of("one").features;
        let Annotation { name, mark, locked } = &again[&7];
        assert_eq!(
            (name.as_str(), *mark),
            ("bore A", OperatorVerdict::Accepted)
        );
        assert_eq!(locked.as_ref().unwrap()["diameter"], 8.0);
        assert!(
            annotations.of("two").features.is_empty(),
            "another session knows nothing of it"
        );
        let nothing = r#"{"id": 7, "name": "", "mark": "none", "is_locked": false}"#;
        annotations
            .annotate("one", request(nothing), hole(8.0))
            .unwrap();
        assert!(annotations.of("one").features.is_empty());
    }

    #[test]
    fn what_is_refused_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("one")).unwrap();
        let annotations = Annotations::new(folder.path());
        let long = format!(r#"{{"id": 7, "name": "{}"}}"#, "x".repeat(81));
        for (asked, feature, words) in [
            (
                r#"{"id": 7, "mark": "accepted"}"#,
                None,
                "there is no feature 7",
            ),
            (&long, hole(8.0), "up to 80 characters"),
            (r#"{"id": 7, "name": "a\nb"}"#, hole(8.0), "in one line"),
        ] {
            let why = annotations
                .annotate("one", request(asked), feature)
                .unwrap_err();
            assert!(why.contains(words), "{why}");
        }
        let why = annotations
            .annotate("missing", request(r#"{"id": 7, "name": "a"}"#), hole(8.0))
            .unwrap_err();
        assert!(why.contains("cannot write"), "{why}");
        assert!(
            annotations.of("one").features.is_empty()
                && annotations.of("missing").features.is_empty()
        );
        assert!(serde_json::from_str::<AnnotateRequest>(r#"{"id": 7, "lock": true}"#).is_err());
    }
}
