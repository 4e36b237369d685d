//! The parameters of the node: one table with ranges.

use std::collections::BTreeMap;
use std::fmt;

use thiserror::Error;

use touchup_io::mesh_file::MeshUnit;
use touchup_io::recording::{LiveType, SampleKind};
use touchup_method::parameters::Value;
use touchup_session::scene::nearest;

/// Value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// on or off
    Bool(bool),
    /// a whole number
    Integer(i64),
    /// a number
    Double(f64),
    /// a word
    String(String),
}

impl ParameterValue {
    /// A value from YAML: `true`, `3`, `0.5`, `hole`, `"3"`.
    pub fn from_yaml(text: &str) -> Self {
        let text = text.trim();
        let quoted = |quote| text.len() >= 2 && text.starts_with(quote) && text.ends_with(quote);
        if quoted('"') || quoted('\'') {
            return Self::String(text[1..text.len() - 1].to_owned());
        }
        match text {
            "true" | "True" | "TRUE" => return Self::Bool(true),
            "false" | "False" | "FALSE" => return Self::Bool(false),
            ".inf" | "+.inf" => return Self::Double(f64::INFINITY),
            "-.inf" => return Self::Double(f64::NEG_INFINITY),
            ".nan" => return Self::Double(f64::NAN),
            _ => {}
        }
        if let Ok(whole) = text.parse() {
            return Self::Integer(whole);
        }
        let is_number = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        match text.parse() {
            Ok(number) if is_number => Self::Double(number),
            _ => Self::String(text.to_owned()),
        }
    }

    /// Its type name, as in `ros2 param describe`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Integer(_) => "integer",
            Self::Double(_) => "double",
            Self::String(_) => "string",
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(on) => on.fmt(f),
            Self::Integer(whole) => whole.fmt(f),
            Self::Double(number) => write!(f, "{number:?}"),
            Self::String(word) => word.fmt(f),
        }
    }
}

/// Type, range and default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterDomain {
    /// on or off
    Bool(bool),
    /// default, minimum and maximum; accepts whole numbers too
    Double(f64, f64, f64),
    /// any word
    String(&'static str),
    /// a message type with poses or wrenches; empty: the publisher's type
    SampleType(SampleKind),
    /// default, and allowed words
    OneOf(&'static str, &'static [&'static str]),
}

/// Time at which a parameter is settable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Settable {
    /// only at the start of the node
    AtStart,
    /// also in a running node
    Live,
    /// in a running node only to `false`, irrevocably
    OnlyToFalse,
}

/// Declaration of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterDescriptor {
    /// snake_case with the unit at its end
    pub name: &'static str,
    /// its type, default and range
    pub allowed: ParameterDomain,
    /// time at which it is settable
    pub settable: Settable,
    /// its effect
    pub description: &'static str,
}

/// The frame of poses without one.
pub const CELL_FRAME: &str = "cell";

/// Names of the kinds of features, by their number in messages.
pub const KIND_NAMES: [&str; 11] = [
    "unknown", "hole", "slot", "pocket", "boss", "edge", "corner", "plane", "cylinder", "notch",
    "sphere",
];

/// All parameters of the node, those of docs/ros.md and the common one of all nodes.
pub const PARAMETERS: &[ParameterDescriptor] = {
    use ParameterDomain::{Bool, Double, OneOf, SampleType, String};
    const fn fixed(
        name: &'static str,
        allowed: ParameterDomain,
        description: &'static str,
    ) -> ParameterDescriptor {
        ParameterDescriptor {
            name,
            allowed,
            settable: Settable::AtStart,
            description,
        }
    }
    const fn live(
        name: &'static str,
        allowed: ParameterDomain,
        description: &'static str,
    ) -> ParameterDescriptor {
        ParameterDescriptor {
            name,
            allowed,
            settable: Settable::Live,
            description,
        }
    }
    &[
        fixed(
            "scene",
            String(""),
            "scene; empty: that of config/default.yaml",
        ),
        fixed(
            "scan",
            String(""),
            "mesh to refine; empty: the one that the scene names",
        ),
        fixed(
            "tip_radius_mm",
            Double(0.0, 0.0, 1_000.0),
            "radius of the ball; 0: the one that the scene names",
        ),
        fixed(
            "mesh_unit",
            OneOf("mm", MeshUnit::WORDS),
            "unit of the scan",
        ),
        fixed(
            "source",
            OneOf("stylus", &["stylus", "probe"]),
            "touching tool",
        ),
        fixed(
            "session_folder",
            String("sessions"),
            "parent folder of the session folders",
        ),
        fixed("object_frame", String("object"), "frame of the mesh"),
        fixed(
            "tool_frame",
            String(""),
            "tracked frame; empty: the name of source",
        ),
        fixed(
            "pose_type",
            SampleType(SampleKind::Pose),
            "type of the poses; empty: as published",
        ),
        fixed(
            "wrench_type",
            SampleType(SampleKind::Wrench),
            "type of the wrenches; empty: as published",
        ),
        fixed(
            "pose_frame",
            String(""),
            "frame of the pose in /tf, as tool0 or tool0 in base; empty: pose by a topic",
        ),
        live(
            "view_rate_hz",
            Double(20.0, 0.1, 100.0),
            "rate of tiles and tip markers",
        ),
        live(
            "features_rate_hz",
            Double(5.0, 0.1, 100.0),
            "rate of features while they change",
        ),
        live(
            "mismatch_rate_hz",
            Double(0.0, 0.0, 10_000.0),
            "largest rate of mismatch; 0: every sample",
        ),
        live(
            "colour_by",
            OneOf("touched", &["touched", "mismatch"]),
            "colours of the mesh",
        ),
        live(
            "stale_ms",
            Double(100.0, 1.0, 10_000.0),
            "time without a message until a stream is stale",
        ),
        live(
            "flag_kind",
            OneOf("hole", &KIND_NAMES),
            "kind of feature that a click flags",
        ),
        live(
            "flag_radius_mm",
            Double(5.0, 0.1, 1_000.0),
            "search radius around the click",
        ),
        fixed(
            "robot",
            OneOf("none", &["none", "sim", "ur", "ros2_control"]),
            "kind of arm",
        ),
        fixed("sim_part", String(""), "true part for a simulated arm"),
        ParameterDescriptor {
            name: "allow_motion",
            allowed: Bool(false),
            settable: Settable::OnlyToFalse,
            description: "permission for the arm to move",
        },
        fixed(
            "service_mapping",
            OneOf("enhanced", &["enhanced", "cyclone"]),
            "header of services, as in the RMW of the others (Fast DDS, Cyclone); not with r2r",
        ),
        fixed("use_sim_time", Bool(false), "time from the topic /clock"),
    ]
};

/// Reason why a parameter is not set. `ros2 param set` shows the text.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ParameterError {
    /// an unknown name
    #[error("there is no parameter \"{name}\"{}", did_you_mean(.near))]
    Unknown {
        /// as given
        name: String,
        /// a similar known name, if any
        near: Option<&'static str>,
    },
    /// a value of another type
    #[error("{name} is a {wanted}, \"{value}\" is a {given}")]
    Type {
        /// name of the parameter
        name: &'static str,
        /// its type
        wanted: &'static str,
        /// type of the value
        given: &'static str,
        /// as given
        value: ParameterValue,
    },
    /// a number outside its range
    #[error("{name} is {value:?}: it may be {from} to {to}")]
    Range {
        /// name of the parameter
        name: &'static str,
        /// as given
        value: f64,
        /// minimum
        from: f64,
        /// maximum
        to: f64,
    },
    /// a word not in the list
    #[error("{name} is \"{value}\": it may be {}", .words.join(", "))]
    Word {
        /// name of the parameter
        name: &'static str,
        /// as given
        value: String,
        /// allowed words
        words: &'static [&'static str],
    },
    /// an unsuitable message type
    #[error("{name} is {why}")]
    SampleType {
        /// name of the parameter
        name: &'static str,
        /// cause, and the readable types
        why: String,
    },
    /// settable only at the start of the node
    #[error("{name} cannot be set while the node runs: start it again with -p {name}:={value}")]
    NotLive {
        /// name of the parameter
        name: &'static str,
        /// as given
        value: ParameterValue,
    },
    /// an irrevocable false
    #[error(
        "{name} cannot be set to true while the node runs: start it again with -p {name}:=true, and with robot.{name}: true in the scene"
    )]
    OnlyToFalse {
        /// name of the parameter
        name: &'static str,
    },
}

fn did_you_mean(near: &Option<&'static str>) -> String {
    near.map_or_else(String::new, |near| format!(": did you mean \"{near}\"?"))
}

impl ParameterDescriptor {
    /// The default value.
    pub fn default_value(&self) -> ParameterValue {
        match self.allowed {
            ParameterDomain::Bool(on) => ParameterValue::Bool(on),
            ParameterDomain::Double(number, ..) => ParameterValue::Double(number),
            ParameterDomain::String(word) | ParameterDomain::OneOf(word, _) => {
                ParameterValue::String(word.to_owned())
            }
            ParameterDomain::SampleType(_) => ParameterValue::String(String::new()),
        }
    }

    /// The value to store in a running node. Setting the current value again is allowed.
    ///
    /// # Errors
    /// As [`Self::check`]; [`ParameterError::NotLive`], [`ParameterError::OnlyToFalse`].
    pub fn change(
        &self,
        now: &ParameterValue,
        to: &ParameterValue,
    ) -> Result<ParameterValue, ParameterError> {
        let (name, to) = (self.name, self.check(to)?);
        match self.settable {
            _ if to == *now => Ok(to),
            Settable::Live => Ok(to),
            Settable::AtStart => Err(ParameterError::NotLive { name, value: to }),
            Settable::OnlyToFalse if to == ParameterValue::Bool(false) => Ok(to),
            Settable::OnlyToFalse => Err(ParameterError::OnlyToFalse { name }),
        }
    }

    /// The value to store.
    ///
    /// # Errors
    /// [`ParameterError::Type`], [`ParameterError::Range`] (NaN too) or [`ParameterError::Word`].
    pub fn check(&self, value: &ParameterValue) -> Result<ParameterValue, ParameterError> {
        let name = self.name;
        match (self.allowed, value) {
            (ParameterDomain::Double(_, from, to), ParameterValue::Double(number)) => {
                within(name, *number, from, to)
            }
            // exact up to 2^53, far beyond every range
            (ParameterDomain::Double(_, from, to), ParameterValue::Integer(whole)) => {
                within(name, *whole as f64, from, to)
            }
            (ParameterDomain::OneOf(_, words), ParameterValue::String(word))
                if !words.contains(&word.as_str()) =>
            {
                Err(ParameterError::Word {
                    name,
                    value: word.clone(),
                    words,
                })
            }
            (ParameterDomain::SampleType(kind), ParameterValue::String(type_name)) => {
                let known = LiveType::of(kind, type_name);
                known
                    .map(|_| value.clone())
                    .map_err(|why| ParameterError::SampleType { name, why })
            }
            (ParameterDomain::Bool(_), ParameterValue::Bool(_))
            | (
                ParameterDomain::String(_) | ParameterDomain::OneOf(..),
                ParameterValue::String(_),
            ) => Ok(value.clone()),
            _ => {
                let (wanted, given) = (self.default_value().type_name(), value.type_name());
                Err(ParameterError::Type {
                    name,
                    wanted,
                    given,
                    value: value.clone(),
                })
            }
        }
    }
}

fn within(
    name: &'static str,
    value: f64,
    from: f64,
    to: f64,
) -> Result<ParameterValue, ParameterError> {
    if (from..=to).contains(&value) {
        return Ok(ParameterValue::Double(value));
    }
    Err(ParameterError::Range {
        name,
        value,
        from,
        to,
    })
}

/// Declaration of the parameter with this name.
///
/// # Errors
/// [`ParameterError::Unknown`], with a similar name if any.
pub fn descriptor(name: &str) -> Result<&'static ParameterDescriptor, ParameterError> {
    PARAMETERS
        .iter()
        .find(|declared| declared.name == name)
        .ok_or_else(|| {
            let near = nearest(
                name,
                &PARAMETERS
                    .iter()
                    .map(|declared| declared.name)
                    .collect::<Vec<_>>(),
            );
            ParameterError::Unknown {
                name: name.to_owned(),
                near,
            }
        })
}

/// Values of all parameters, each allowed by its descriptor.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters(BTreeMap<&'static str, ParameterValue>);

impl Default for Parameters {
    fn default() -> Self {
        Self(
            PARAMETERS
                .iter()
                .map(|declared| (declared.name, declared.default_value()))
                .collect(),
        )
    }
}

impl Parameters {
    /// Sets a parameter before the start of the node.
    ///
    /// # Errors
    /// [`ParameterError`]; changes nothing then.
    pub fn set(&mut self, name: &str, value: &ParameterValue) -> Result<(), ParameterError> {
        let declared = descriptor(name)?;
        self.0.insert(declared.name, declared.check(value)?);
        Ok(())
    }

    /// Sets a parameter of a running node, as [`ParameterDescriptor::change`] allows.
    ///
    /// # Errors
    /// [`ParameterError`]; changes nothing then.
    pub fn set_live(&mut self, name: &str, value: &ParameterValue) -> Result<(), ParameterError> {
        let declared = descriptor(name)?;
        let now = self
            .0
            .entry(declared.name)
            .or_insert_with(|| declared.default_value());
        *now = declared.change(now, value)?;
        Ok(())
    }

    /// Value of a parameter.
    pub fn value(&self, name: &str) -> Option<&ParameterValue> {
        self.0.get(name)
    }

    /// Value of a text parameter; empty for any other name.
    pub fn string(&self, name: &str) -> &str {
        if let Some(ParameterValue::String(word)) = self.0.get(name) {
            word
        } else {
            ""
        }
    }

    /// Whether the node has an arm.
    pub fn has_arm(&self) -> bool {
        self.string("robot") != "none"
    }

    /// The frame whose transforms give the pose, and its base frame: `tool0 in base`, or `tool0`,
    /// meaning in the cell.
    pub fn pose_frames(&self) -> Option<[&str; 2]> {
        let named = self.string("pose_frame").trim();
        let [frame, base] = named
            .split_once(" in ")
            .map_or([named, CELL_FRAME], |(frame, base)| [frame, base]);
        (!named.is_empty()).then(|| [frame.trim(), base.trim()])
    }

    /// Value of a number parameter; NaN for any other name.
    pub fn double(&self, name: &str) -> f64 {
        if let Some(ParameterValue::Double(number)) = self.0.get(name) {
            *number
        } else {
            f64::NAN
        }
    }

    /// Value of a switch parameter; off for any other name.
    pub fn bool(&self, name: &str) -> bool {
        self.0.get(name) == Some(&ParameterValue::Bool(true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yaml_scalars_have_the_type_that_ros_gives_them() {
        let cases = [
            ("true", ParameterValue::Bool(true)),
            ("3", ParameterValue::Integer(3)),
            ("-3", ParameterValue::Integer(-3)),
            ("3.0", ParameterValue::Double(3.0)),
            ("1e-3", ParameterValue::Double(0.001)),
            (".5", ParameterValue::Double(0.5)),
            ("inch", ParameterValue::String("inch".into())),
            ("infinity", ParameterValue::String("infinity".into())),
            ("\"3\"", ParameterValue::String("3".into())),
            ("'", ParameterValue::String("'".into())),
            ("", ParameterValue::String(String::new())),
        ];
        for (text, value) in cases {
            assert_eq!(ParameterValue::from_yaml(text), value, "{text}");
        }
    }

    #[test]
    fn a_refused_value_says_why_and_changes_nothing() {
        let mut parameters = Parameters::default();
        let cases = [
            (
                "view_rate_hz",
                ParameterValue::Double(0.05),
                "view_rate_hz is 0.05: it may be 0.1 to 100",
            ),
            (
                "view_rate_hz",
                ParameterValue::Double(f64::NAN),
                "view_rate_hz is NaN: it may be 0.1 to 100",
            ),
            (
                "view_rate_hz",
                ParameterValue::Bool(true),
                "view_rate_hz is a double, \"true\" is a bool",
            ),
            (
                "flag_kind",
                ParameterValue::String("holes".into()),
                "flag_kind is \"holes\": it may be unknown, hole, ",
            ),
            (
                "view_rate",
                ParameterValue::Double(1.0),
                "there is no parameter \"view_rate\": did you mean \"view_rate_hz\"?",
            ),
            (
                "xyz",
                ParameterValue::Double(1.0),
                "there is no parameter \"xyz\"",
            ),
            (
                "robot",
                ParameterValue::String("sim".into()),
                "robot cannot be set while the node runs: start it again with -p robot:=sim",
            ),
        ];
        for (name, value, reason) in cases {
            let error = parameters.set_live(name, &value).unwrap_err().to_string();
            assert!(error.starts_with(reason), "{error}");
        }
        assert_eq!(parameters, Parameters::default());
    }

    #[test]
    fn motion_that_was_taken_away_is_allowed_again_only_by_a_start() {
        let mut parameters = Parameters::default();
        let [yes, no] = [true, false].map(ParameterValue::Bool);
        parameters.set("allow_motion", &yes).unwrap();
        parameters.set_live("allow_motion", &yes).unwrap();
        parameters.set_live("allow_motion", &no).unwrap();
        let why = parameters
            .set_live("allow_motion", &yes)
            .unwrap_err()
            .to_string();
        assert!(
            why.contains("start it again with -p allow_motion:=true") && why.contains("scene"),
            "{why}"
        );
        assert!(!parameters.bool("allow_motion"));
    }

    #[test]
    fn a_whole_number_sets_a_double() {
        let mut parameters = Parameters::default();
        parameters
            .set_live("stale_ms", &ParameterValue::Integer(250))
            .unwrap();
        assert_eq!(parameters.double("stale_ms"), 250.0);
    }

    #[test]
    fn what_is_set_already_may_be_set_again() {
        let mut parameters = Parameters::default();
        parameters
            .set("robot", &ParameterValue::String("sim".into()))
            .unwrap();
        parameters
            .set_live("robot", &ParameterValue::String("sim".into()))
            .unwrap();
        assert_eq!(parameters.string("robot"), "sim");
    }
}
