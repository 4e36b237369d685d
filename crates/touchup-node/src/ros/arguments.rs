//! Start configuration of a ROS node: `--ros-args` and the environment.
//!
//! Of two values, from `-p` or from a file, the later one counts.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::ros::names::{GraphPlace, NameError, Remap, checked, matches};
use crate::ros::parameters::{ParameterError, ParameterValue, Parameters};
use touchup_io::text_file::read_text_up_to;
use touchup_session::scene::nearest;

mod yaml;

/// Configuration of a port, complete before its start.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeConfig {
    /// name and namespace
    pub place: GraphPlace,
    /// 0 to 232: nodes of other domains are invisible
    pub domain_id: u16,
    /// other computers are invisible
    pub localhost_only: bool,
    /// in their given order
    pub remaps: Vec<Remap>,
    /// all of them, checked
    pub parameters: Parameters,
    /// names in files that are no parameters of this node: they may be meant for another
    pub unused: Vec<String>,
}

/// Reason why the node does not start.
#[derive(Debug, Error)]
pub enum ArgumentError {
    /// an unknown argument
    #[error("--ros-args does not know \"{argument}\"{}", .near.map_or_else(String::new, |near| format!(": did you mean {near}?")))]
    Unknown {
        /// as given
        argument: String,
        /// a similar known argument, if any
        near: Option<&'static str>,
    },
    /// an argument without its value
    #[error("{argument} needs {needs} behind it")]
    Missing {
        /// as given
        argument: String,
        /// missing value
        needs: &'static str,
    },
    /// not of the form `NAME:=VALUE`, or an invalid environment variable
    #[error("{given}: it must be {form}")]
    Form {
        /// argument or variable, as given
        given: String,
        /// expected form
        form: &'static str,
    },
    /// not a ROS name
    #[error("--remap {text}: {source}")]
    Name {
        /// as given
        text: String,
        /// cause
        source: NameError,
    },
    /// an unknown parameter, or an invalid value
    #[error("{origin}: {source}")]
    Parameter {
        /// `-p` or the file
        origin: String,
        /// cause
        source: ParameterError,
    },
    /// an unreadable file
    #[error("cannot read the parameter file {}: {source}", .path.display())]
    Read {
        /// path of the file
        path: PathBuf,
        /// error of the system
        source: std::io::Error,
    },
    /// a file that is no parameter file
    #[error("{}: {reason}", .path.display())]
    File {
        /// path of the file
        path: PathBuf,
        /// cause, with line and column
        reason: String,
    },
}

const KNOWN: &[&str] = &[
    "-r",
    "--remap",
    "-p",
    "--param",
    "--params-file",
    "--log-level",
    "--log-config-file",
    "-e",
    "--enclave",
    "--enable-rosout-logs",
    "--disable-rosout-logs",
    "--enable-stdout-logs",
    "--disable-stdout-logs",
    "--enable-external-lib-logs",
    "--disable-external-lib-logs",
];

/// Levels of `--log-level`, and the corresponding levels here.
const LEVELS: &[(&str, &str)] = &[
    ("debug", "debug"),
    ("info", "info"),
    ("warn", "warn"),
    ("warning", "warn"),
    ("error", "error"),
    ("fatal", "error"),
    ("unset", "info"),
];

/// A value of a parameter and its origin.
struct Override {
    /// pattern of the node names
    nodes: String,
    name: String,
    value: ParameterValue,
    origin: String,
    is_file: bool,
}

/// Splits a command line: the other arguments, and those between `--ros-args` and `--` (or the
/// end).
pub fn split<T: AsRef<OsStr>>(arguments: impl IntoIterator<Item = T>) -> (Vec<T>, Vec<T>) {
    let (mut others, mut ros) = (Vec::new(), Vec::new());
    let mut is_ros = false;
    for argument in arguments {
        let begins = argument.as_ref() == "--ros-args";
        if begins || (is_ros && argument.as_ref() == "--") {
            is_ros = begins;
        } else {
            if is_ros { &mut ros } else { &mut others }.push(argument);
        }
    }
    (others, ros)
}

impl NodeConfig {
    /// The configuration of the node `touchup` from arguments and environment.
    ///
    /// - `ros`: second result of [`split`].
    /// - `variable`: a variable of the environment.
    ///
    /// # Errors
    /// [`ArgumentError`]: the first fault.
    pub fn new(
        ros: &[String],
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, ArgumentError> {
        Self::named("touchup", ros, variable)
    }

    /// The configuration of a node with another default name.
    ///
    /// # Errors
    /// [`ArgumentError`]: the first fault.
    pub fn named(
        name: &str,
        ros: &[String],
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, ArgumentError> {
        let mut config = Self {
            place: GraphPlace {
                namespace: String::new(),
                node: name.to_owned(),
            },
            domain_id: domain_id(variable("ROS_DOMAIN_ID"))?,
            localhost_only: localhost_only(&variable)?,
            remaps: Vec::new(),
            parameters: Parameters::default(),
            unused: Vec::new(),
        };
        let mut overrides = Vec::new();
        let mut rest = ros.iter();
        while let Some(argument) = rest.next() {
            let mut next = |needs| {
                rest.next().ok_or_else(|| ArgumentError::Missing {
                    argument: argument.clone(),
                    needs,
                })
            };
            match argument.as_str() {
                "-r" | "--remap" => config.remap(next("FROM:=TO")?)?,
                "-p" | "--param" => overrides.push(parameter(next("NAME:=VALUE")?)?),
                "--params-file" => overrides.extend(from_file(Path::new(next("a file")?))?),
                // logging has already begun: only checks the level
                "--log-level" => drop(log_level(next("a level")?)?),
                "-e" | "--enclave" | "--log-config-file" => {
                    next("a name")?;
                }
                known if KNOWN.contains(&known) => {}
                _ => {
                    let long: Vec<_> = KNOWN
                        .iter()
                        .copied()
                        .filter(|known| known.len() > 2)
                        .collect();
                    let near = nearest(argument, &long);
                    return Err(ArgumentError::Unknown {
                        argument: argument.clone(),
                        near,
                    });
                }
            }
        }
        config.check_rules()?;
        config.set(overrides)?;
        Ok(config)
    }

    /// The absolute, remapped form of a name.
    ///
    /// # Errors
    /// [`NameError`] for an invalid name.
    pub fn resolve(&self, name: &str) -> Result<String, NameError> {
        self.place.resolve(name, &self.remaps)
    }

    /// The configuration of a second node of this program, with an ending on its name.
    pub fn beside(&self, ending: &str) -> Self {
        let mut config = self.clone();
        config.place.node.push_str(ending);
        config
    }

    /// Topics of wrenches and poses, not yet remapped.
    pub fn sample_topics(&self) -> [&'static str; 2] {
        match self.parameters.string("source") {
            "probe" => ["probe/wrench", "probe/pose"],
            _ => ["stylus/wrench", "stylus/pose"],
        }
    }

    /// Topics of wrenches and poses that the node hears, not yet remapped: as
    /// [`Self::sample_topics`] without an arm, or transforms for the poses.
    pub fn heard_topics(&self) -> Vec<&'static str> {
        let [wrench, pose] = self.sample_topics();
        match (self.parameters.has_arm(), self.parameters.pose_frames()) {
            (false, None) => vec![wrench, pose],
            (false, Some(_)) => vec![wrench, "/tf"],
            (true, None) => vec![],
            (true, Some(_)) => vec!["/tf"],
        }
    }

    fn remap(&mut self, text: &str) -> Result<(), ArgumentError> {
        let form = "FROM:=TO, as in stylus/wrench:=/ft_sensor/wrench";
        let malformed = || ArgumentError::Form {
            given: format!("--remap {text}"),
            form,
        };
        let (from, to) = text.split_once(":=").ok_or_else(malformed)?;
        // NODE:FROM applies only to the node of that name
        let (node, from) = from
            .split_once(':')
            .map_or((None, from), |(node, from)| (Some(node), from));
        if from.is_empty() || to.is_empty() || from.contains(':') {
            return Err(malformed());
        }
        if node.is_some_and(|node| node != self.place.node) {
            return Ok(());
        }
        let of_text = |source| ArgumentError::Name {
            text: text.to_owned(),
            source,
        };
        match from {
            "__node" | "__name" => {
                checked(format!("/{to}")).map_err(of_text)?;
                if to.contains('/') {
                    return Err(malformed());
                }
                self.place.node = to.to_owned();
            }
            "__ns" => {
                let whole = if to.starts_with('/') {
                    to.to_owned()
                } else {
                    format!("/{to}")
                };
                self.place.namespace = if whole == "/" {
                    String::new()
                } else {
                    checked(whole).map_err(of_text)?
                };
            }
            _ => self.remaps.push(Remap {
                from: from.to_owned(),
                to: to.to_owned(),
            }),
        }
        Ok(())
    }

    /// Checks the rules, after all arguments have determined name and namespace.
    fn check_rules(&self) -> Result<(), ArgumentError> {
        for rule in &self.remaps {
            for name in [&rule.from, &rule.to] {
                let text = format!("{}:={}", rule.from, rule.to);
                self.place
                    .expand(name)
                    .map_err(|source| ArgumentError::Name { text, source })?;
            }
        }
        Ok(())
    }

    fn set(&mut self, overrides: Vec<Override>) -> Result<(), ArgumentError> {
        let full_name = self.place.full_name();
        let is_mine =
            |given: &Override| matches(&given.nodes, &full_name) || given.nodes == self.place.node;
        for given in overrides.into_iter().filter(is_mine) {
            match self.parameters.set(&given.name, &given.value) {
                Err(ParameterError::Unknown { name, .. }) if given.is_file => {
                    self.unused.push(name)
                }
                other => other.map_err(|source| ArgumentError::Parameter {
                    origin: given.origin,
                    source,
                })?,
            }
        }
        Ok(())
    }
}

fn parameter(text: &str) -> Result<Override, ArgumentError> {
    let form = "NAME:=VALUE, as in scan:=part.ply";
    let malformed = || ArgumentError::Form {
        given: format!("-p {text}"),
        form,
    };
    let (name, value) = text.split_once(":=").ok_or_else(malformed)?;
    let (nodes, name) = name.split_once(':').unwrap_or(("/**", name));
    if name.is_empty() {
        return Err(malformed());
    }
    let value = ParameterValue::from_yaml(value);
    Ok(Override {
        nodes: nodes.into(),
        name: name.into(),
        value,
        origin: format!("-p {text}"),
        is_file: false,
    })
}

/// Maximum size of a parameter file, bytes.
const LARGEST_FILE: u64 = 1 << 20;

fn from_file(path: &Path) -> Result<Vec<Override>, ArgumentError> {
    let text = read_text_up_to(path, LARGEST_FILE).map_err(|source| ArgumentError::Read {
        path: path.to_owned(),
        source,
    })?;
    let entries = yaml::entries(&text).map_err(|reason| ArgumentError::File {
        path: path.to_owned(),
        reason,
    })?;
    let origin = path.display().to_string();
    let given = |(nodes, name, value)| Override {
        nodes,
        name,
        value,
        origin: origin.clone(),
        is_file: true,
    };
    Ok(entries.into_iter().map(given).collect())
}

/// Converts a value of `--log-level` to debug, info, warn or error.
///
/// # Errors
/// [`ArgumentError::Form`] for a level unknown to ROS.
pub fn log_level(text: &str) -> Result<&'static str, ArgumentError> {
    let word = text
        .rsplit_once(":=")
        .map_or(text, |(_, level)| level)
        .to_lowercase();
    let level = LEVELS
        .iter()
        .find(|(name, _)| *name == word)
        .map(|(_, level)| *level);
    let form = "debug, info, warn, error or fatal";
    level.ok_or_else(|| ArgumentError::Form {
        given: format!("--log-level {text}"),
        form,
    })
}

/// Highest domain whose ports lie below 65535.
const LAST_DOMAIN: u16 = 232;

fn domain_id(value: Option<String>) -> Result<u16, ArgumentError> {
    let Some(value) = value.filter(|value| !value.is_empty()) else {
        return Ok(0);
    };
    let malformed = || ArgumentError::Form {
        given: format!("ROS_DOMAIN_ID={value}"),
        form: "0 to 232",
    };
    value
        .parse()
        .ok()
        .filter(|id| *id <= LAST_DOMAIN)
        .ok_or_else(malformed)
}

fn localhost_only(variable: &impl Fn(&str) -> Option<String>) -> Result<bool, ArgumentError> {
    if variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value == "1") {
        return Ok(true);
    }
    let value = variable("ROS_AUTOMATIC_DISCOVERY_RANGE").unwrap_or_default();
    match value.as_str() {
        "LOCALHOST" => Ok(true),
        "" | "SUBNET" | "SYSTEM_DEFAULT" => Ok(false),
        _ => Err(ArgumentError::Form {
            given: format!("ROS_AUTOMATIC_DISCOVERY_RANGE={value}"),
            form: "LOCALHOST or SUBNET (OFF is not to be had: the node would find nobody)",
        }),
    }
}
