//! Edits settings in the text of a scene; comments, order and everything else stay as written.
//!
//! Only the lines of edited keys change. The edit verifies its result: the new text must parse to
//! exactly the earlier scene with the settings set, or the edit fails.

mod block;
mod flow;

use std::fmt;
use std::path::Path;

use touchup_method::parameters::{Unit, Value};

use super::{Scene, SceneError, yaml_error};

/// One key and its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// From the section down, e.g. `compensation.bias.force_n`.
    pub path: &'static str,
    /// As YAML on one line: a number, a word, or a list in brackets.
    pub value: String,
}

impl Setting {
    /// A number.
    pub fn number(path: &'static str, number: f64) -> Self {
        // YAML has .inf and .nan
        let written = number.to_string().to_lowercase();
        Self::word(path, written.replace("inf", ".inf").replace("nan", ".nan"))
    }

    /// A list of numbers in brackets.
    pub fn list(path: &'static str, values: &[f64]) -> Self {
        let values: Vec<_> = values.iter().map(f64::to_string).collect();
        Self::word(path, format!("[{}]", values.join(", ")))
    }

    /// One of the words of its key.
    pub fn word(path: &'static str, word: impl ToString) -> Self {
        Self {
            path,
            value: word.to_string(),
        }
    }

    /// The path of a file, in quotes.
    ///
    /// # Errors
    /// [`SceneError::CannotEdit`] for a name with bytes or characters that no line of text has.
    pub fn file(path: &'static str, file: &Path) -> Result<Self, SceneError> {
        match file.to_str() {
            Some(name) if !name.contains(char::is_control) => {
                Ok(Self::word(path, format!("'{}'", name.replace('\'', "''"))))
            }
            _ => Err(SceneError::CannotEdit {
                why: "the name of the file is not one line of text".to_owned(),
                settings: format!("{path}: {}", file.display()),
            }),
        }
    }
}

/// YAML on one line, with its sections in braces.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sections, key) = self.path.rsplit_once('.').unwrap_or(("", self.path));
        let sections: Vec<&str> = sections.split_terminator('.').collect();
        sections
            .iter()
            .try_for_each(|section| write!(f, "{section}: {{ "))?;
        write!(f, "{key}: {}{}", self.value, " }".repeat(sections.len()))
    }
}

impl Scene {
    /// Sets keys, unchecked ([`Self::validate`]); a part that is off gets its defaults.
    ///
    /// # Errors
    /// [`SceneError::Yaml`] for an unknown key, or a value of the wrong kind.
    pub fn set(&mut self, settings: &[Setting]) -> Result<(), SceneError> {
        for Setting { path, value } in settings {
            let keys: Vec<&str> = path.split('.').collect();
            serde_saphyr::with_deserializer_from_str(value, |written| {
                Value::set(self, &keys, written, Unit::ONE)
            })
            .map_err(|error| yaml_error(&error))?;
        }
        Ok(())
    }

    /// The text of a scene with `settings` in it.
    ///
    /// - `yaml`: the earlier text; empty for a new scene.
    /// - `remark`: comment after the first edited key, unless the user has one there; one line, or
    ///   empty for none.
    ///
    /// # Errors
    /// Those of [`Self::from_yaml`] and [`Self::set`]; [`SceneError::CannotEdit`] if the new text
    /// would not be the scene of the earlier one with `settings` set.
    pub fn edited(yaml: &str, settings: &[Setting], remark: &str) -> Result<String, SceneError> {
        let mut expected = Self::from_yaml(yaml)?;
        expected.set(settings)?;
        let listed: Vec<_> = settings
            .iter()
            .map(|Setting { path, value }| format!("{path}: {value}"))
            .collect();
        let refused = |why: String| SceneError::CannotEdit {
            why,
            settings: listed.join("; "),
        };
        let mut text = yaml.to_owned();
        for (i, Setting { path, value }) in settings.iter().enumerate() {
            let keys: Vec<&str> = path.split('.').collect();
            let remark = if i == 0 && !remark.is_empty() {
                format!("  {} {remark}", block::MARK)
            } else {
                String::new()
            };
            let new = match flow::start(&text) {
                Some(begin) => flow::set(&text, begin, &keys, value),
                None => block::set(&text, &keys, value, &remark),
            };
            text = new.ok_or_else(|| refused(format!("{path} is written in an unusual form")))?;
        }
        match Self::from_yaml(&text) {
            Ok(scene) if scene == expected => Ok(text),
            Ok(_) => Err(refused("another section would change".to_owned())),
            Err(error) => Err(refused(error.to_string())),
        }
    }

    /// The remark of [`Self::edited`] after a key in the text of a scene, without its beginning
    /// `first`; from the first section with such a remark.
    pub fn remark<'a>(yaml: &'a str, key: &str, first: &str) -> Option<&'a str> {
        let (key, begin) = (format!("{key}:"), format!("{} {first}", block::MARK));
        let mut of_key = yaml
            .lines()
            .filter(|line| line.trim_start().starts_with(&key));
        of_key
            .find_map(|line| line.split_once(&*begin))
            .map(|(_, rest)| rest.trim())
    }
}
