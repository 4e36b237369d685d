//! Base scene of all jobs, and its changes by keys.

use serde_json::{Map, Value};

use super::sampling::KeySetting;
use crate::scene::{Scene, SceneError, yaml_error};

/// Sections unused by a refinement, and file names: they change no result.
const WITHOUT: [&str; 1] = ["robot"];
const WITHOUT_OF_SCAN: [&str; 2] = ["file", "unit"];

/// A scene as written.
#[derive(Clone, Debug)]
pub(super) struct BaseScene {
    written: Map<String, Value>,
    /// default scene with all usual parts
    usual: Value,
}

/// The scene of one job.
#[derive(Clone, Debug)]
pub(super) struct JobScene {
    pub scene: Scene,
    /// every active key with its value, in the units of the file: the full dependency of a result
    pub whole: Value,
}

/// Error of a scene with keys set.
#[derive(Debug)]
pub(super) struct KeyError {
    /// the wrong key, if there is one
    pub key: Option<String>,
    pub why: String,
}

fn parsed(yaml: &str) -> Result<Value, SceneError> {
    serde_saphyr::from_str(yaml).map_err(|error| yaml_error(&error))
}

impl BaseScene {
    /// - `yaml`: checked text of a scene; empty for the default.
    ///
    /// # Errors
    /// [`SceneError::Yaml`]
    pub fn of(yaml: &str) -> Result<Self, SceneError> {
        let mut written = match if yaml.trim().is_empty() {
            Value::Null
        } else {
            parsed(yaml)?
        } {
            Value::Object(written) => written,
            _ => Map::new(),
        };
        WITHOUT
            .iter()
            .for_each(|section| drop(written.remove(*section)));
        let usual = parsed(&Scene::template())?;
        Ok(Self { written, usual })
    }

    /// The scene with keys set.
    ///
    /// # Errors
    /// In the scene's own words; for a misspelt key with the intended one.
    pub fn with(&self, keys: &KeySetting) -> Result<JobScene, KeyError> {
        let mut written = self.written.clone();
        for (key, value) in keys {
            let wrong = |why: String| KeyError {
                key: Some(key.clone()),
                why,
            };
            set(&mut written, key, value).map_err(wrong)?;
        }
        let text = Value::Object(written.clone()).to_string();
        let scene =
            Scene::from_yaml(&text).and_then(|scene| scene.require_radius(&text).map(|()| scene));
        let scene = scene.map_err(|error| self.blamed(keys, error))?;
        let mut whole = self.usual.clone();
        lay_over(&mut whole, &Value::Object(written));
        if let Some(Value::Object(scan)) = whole.get_mut("scan") {
            WITHOUT_OF_SCAN
                .iter()
                .for_each(|key| drop(scan.remove(*key)));
        }
        Ok(JobScene {
            scene,
            whole: sorted(&whole),
        })
    }

    /// The error of a scene at the key that causes it.
    fn blamed(&self, keys: &KeySetting, error: SceneError) -> KeyError {
        if matches!(error, SceneError::NoRadius) {
            let why = "the radius of the ball is not known: name tip.radius_mm in the scene, or under keys".to_owned();
            return KeyError { key: None, why };
        }
        let alone = |key: &&String| {
            let mut written = self.written.clone();
            let is_set = set(&mut written, key, &keys[*key]).is_ok();
            is_set && Scene::from_yaml(&Value::Object(written).to_string()).is_err()
        };
        let key = keys.keys().find(alone).cloned();
        KeyError {
            key,
            why: without_place(&error.to_string()),
        }
    }
}

/// Removes line and column, useless in a generated text.
fn without_place(message: &str) -> String {
    let mut message = message.to_owned();
    if let Some(at) = message.find(" at line ") {
        let after = &message[at + " at line ".len()..];
        let place = |c: char| c.is_ascii_digit() || ", column".contains(c);
        let end = after.find(|c| !place(c)).unwrap_or(after.len());
        let rest = after[end..].to_owned();
        message.truncate(at);
        message += &rest;
    }
    message
}

/// Sets a key by its path.
fn set(written: &mut Map<String, Value>, path: &str, value: &Value) -> Result<(), String> {
    let mut section = written;
    let mut keys: Vec<&str> = path.split('.').collect();
    if WITHOUT.contains(&keys[0]) {
        return Err(format!(
            "{} changes nothing of a refinement: take it out",
            keys[0]
        ));
    }
    let last = keys.pop().unwrap_or_default();
    for key in keys {
        let inner = section.entry(key).or_insert(Value::Null);
        if inner.is_null() {
            *inner = Value::Object(Map::new());
        }
        section = match inner {
            Value::Object(inner) => inner,
            other => {
                return Err(format!(
                    "the scene has {key}: {other}, which has no keys: take that out of it"
                ));
            }
        };
    }
    section.insert(last.to_owned(), value.clone());
    Ok(())
}

/// Overlays written values on the defaults.
fn lay_over(usual: &mut Value, written: &Value) {
    match (usual, written) {
        (Value::Object(usual), Value::Object(written)) => {
            for (key, value) in written {
                lay_over(usual.entry(key).or_insert(Value::Null), value);
            }
        }
        // a section without keys has its defaults
        (Value::Object(_), Value::Null) => {}
        (usual, Value::Bool(false)) => *usual = Value::from("off"),
        (usual, written) => *usual = written.clone(),
    }
}

/// The same value with sorted keys and one form per number.
pub(super) fn sorted(value: &Value) -> Value {
    match value {
        Value::Object(keys) => {
            let mut names: Vec<_> = keys.keys().collect();
            names.sort();
            Value::Object(
                names
                    .into_iter()
                    .map(|name| (name.clone(), sorted(&keys[name])))
                    .collect(),
            )
        }
        Value::Array(values) => values.iter().map(sorted).collect(),
        Value::Number(number) => number.as_f64().map_or_else(|| value.clone(), one_form),
        other => other.clone(),
    }
}

fn one_form(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        Value::from(x as i64)
    } else {
        Value::from(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(written: &str) -> KeySetting {
        serde_json::from_str(written).unwrap()
    }

    #[test]
    fn a_scene_that_names_a_default_is_the_scene_that_does_not() {
        let radius = keys(r#"{"tip.radius_mm": 1.5}"#);
        let none = BaseScene::of("").unwrap().with(&radius).unwrap();
        let named = "# a remark\nsync: { largest_gap_ms: 30.0 }\ntip:\n  radius_mm: 9\ncontact:\nrobot: off\n";
        let named = BaseScene::of(named).unwrap().with(&radius).unwrap();
        assert_eq!(none.whole, named.whole);
        assert_eq!(none.scene, named.scene);
        let other = BaseScene::of("sync: { largest_gap_ms: 31 }")
            .unwrap()
            .with(&radius)
            .unwrap();
        assert_ne!(none.whole, other.whole);
    }

    #[test]
    fn a_key_is_set_where_its_path_leads_and_off_is_off() {
        let base = BaseScene::of("tip: { radius_mm: 1.5 }").unwrap();
        let set = base
            .with(&keys(r#"{"contact.on_n": 0.7, "guard": "off"}"#))
            .unwrap();
        assert_eq!(set.scene.contact.unwrap().on, 0.7);
        assert!(set.scene.guard.is_none());
        assert_eq!(set.whole["guard"], "off");
    }

    #[test]
    fn a_misspelt_key_gets_the_error_of_the_scene_without_a_place() {
        let base = BaseScene::of("tip: { radius_mm: 1.5 }").unwrap();
        let wrong = base
            .with(&keys(
                r#"{"contact.on_n": 0.7, "tip.stifness_n_per_mm": 20}"#,
            ))
            .unwrap_err();
        assert_eq!(wrong.key.as_deref(), Some("tip.stifness_n_per_mm"));
        assert!(
            wrong.why.contains("did you mean `stiffness_n_per_mm`?"),
            "{}",
            wrong.why
        );
        assert!(!wrong.why.contains("line"), "{}", wrong.why);
        let range = base.with(&keys(r#"{"contact.on_n": -1}"#)).unwrap_err();
        assert!(
            range.key.as_deref() == Some("contact.on_n")
                && range.why.contains("contact.on_n is -1"),
            "{range:?}"
        );
        assert!(
            BaseScene::of("")
                .unwrap()
                .with(&KeySetting::new())
                .unwrap_err()
                .why
                .contains("tip.radius_mm")
        );
    }
}
