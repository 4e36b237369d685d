//! What a ROS node is started with: `--ros-args` and the environment.
//!
//! The later of two values counts, be it from `-p` or from a file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::names::{GraphPlace, NameError, Remap, checked, matches};
use super::parameters::{ParameterError, ParameterValue, Parameters};
use crate::io::parameters_file;
use crate::scene::nearest;

mod yaml;

/// Everything that a port needs to know before it starts.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeConfig {
    /// name and namespace
    pub place: GraphPlace,
    /// 0 to 232: nodes of other domains are not seen
    pub domain_id: u16,
    /// other computers are not seen
    pub localhost_only: bool,
    /// in the order in which they were given
    pub remaps: Vec<Remap>,
    /// all of them, checked
    pub parameters: Parameters,
    /// parameters in files that this node does not have: they may be meant for another
    pub unused: Vec<String>,
}

/// Why the node does not start.
#[derive(Debug, Error)]
pub enum ArgumentError {
    /// none of the arguments that a node takes
    #[error("--ros-args does not know \"{argument}\"{}", .near.map_or_else(String::new, |near| format!(": did you mean {near}?")))]
    Unknown {
        /// as given
        argument: String,
        /// the one that is meant, when one is near
        near: Option<&'static str>,
    },
    /// nothing follows an argument that needs something
    #[error("{argument} needs {needs} behind it")]
    Missing {
        /// as given
        argument: String,
        /// what
        needs: &'static str,
    },
    /// not of the form `NAME:=VALUE`, or a variable of the environment that means nothing
    #[error("{given}: it must be {form}")]
    Form {
        /// which argument or variable, as given
        given: String,
        /// how it looks
        form: &'static str,
    },
    /// no name of ROS
    #[error("--remap {text}: {source}")]
    Name {
        /// as given
        text: String,
        /// what is wrong
        source: NameError,
    },
    /// a parameter that does not exist, or that may not have this value
    #[error("{origin}: {source}")]
    Parameter {
        /// `-p` or the file
        origin: String,
        /// what is wrong
        source: ParameterError,
    },
    /// the file cannot be read
    #[error("cannot read the parameter file {}: {source}", .path.display())]
    Read {
        /// which file
        path: PathBuf,
        /// what the system says
        source: std::io::Error,
    },
    /// the file is no parameter file
    #[error("{}: {reason}", .path.display())]
    File {
        /// which file
        path: PathBuf,
        /// with line and column
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

/// The levels that `--log-level` knows, and what each is here.
const LEVELS: &[(&str, &str)] = &[
    ("debug", "debug"),
    ("info", "info"),
    ("warn", "warn"),
    ("warning", "warn"),
    ("error", "error"),
    ("fatal", "error"),
    ("unset", "info"),
];

/// What a parameter is set to, and by whom.
struct Override {
    /// pattern of the nodes that it is for
    nodes: String,
    name: String,
    value: ParameterValue,
    origin: String,
    is_file: bool,
}

/// Takes what stands between `--ros-args` and `--` (or the end) out of a command line: what
/// remains, what was taken.
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
    /// The configuration that the arguments and the environment give to the node `touchup`.
    ///
    /// - `ros`: what [`split`] took out.
    /// - `variable`: a variable of the environment.
    ///
    /// # Errors
    /// [`ArgumentError`]: the first thing that is wrong.
    pub fn new(
        ros: &[String],
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, ArgumentError> {
        Self::named("touchup", ros, variable)
    }

    /// The same for a node that has another name unless the arguments give it one.
    ///
    /// # Errors
    /// [`ArgumentError`]: the first thing that is wrong.
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
                // logging has begun by then: it is only checked here
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
    /// [`NameError`] when it is none.
    pub fn resolve(&self, name: &str) -> Result<String, NameError> {
        self.place.resolve(name, &self.remaps)
    }

    /// The same for a second node of this program, whose name goes on so.
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

    /// Where wrenches and poses come from, not yet remapped: as [`Self::sample_topics`], or
    /// transforms.
    pub fn heard_topics(&self) -> [&'static str; 2] {
        let [wrench, pose] = self.sample_topics();
        [
            wrench,
            if self.parameters.pose_frames().is_none() {
                pose
            } else {
                "/tf"
            },
        ]
    }

    fn remap(&mut self, text: &str) -> Result<(), ArgumentError> {
        let form = "FROM:=TO, as in stylus/wrench:=/ft_sensor/wrench";
        let malformed = || ArgumentError::Form {
            given: format!("--remap {text}"),
            form,
        };
        let (from, to) = text.split_once(":=").ok_or_else(malformed)?;
        // NODE:FROM is for the node of that name alone
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

    /// Name and namespace are known only when all arguments are read.
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

fn from_file(path: &Path) -> Result<Vec<Override>, ArgumentError> {
    let text = parameters_file::read(path).map_err(|source| ArgumentError::Read {
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

/// What the value of `--log-level` means here: debug, info, warn or error.
///
/// # Errors
/// [`ArgumentError::Form`] for a level that ROS does not have.
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

/// Beyond that the ports of a domain lie over 65535.
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
