//! The record of `touchup check`, and its doubts at the time of probing.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use chrono::{DateTime, SecondsFormat, Utc};
use serde::{Deserialize, Serialize};
use touchup_io::session_folder::read_text;

/// Version of the file format.
const VERSION: u32 = 1;
/// Maximum temperature difference at which a check counts, K.
const LARGEST_TEMPERATURE_CHANGE: f64 = 5.0;
/// Maximum difference between the clocks of two machines, days.
const CLOCKS: f64 = 1.0;
const DAY_S: f64 = 86_400.0;

/// The stored findings of a check of an arm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckRecord {
    /// version of the file
    pub version: u32,
    /// time of the check
    #[serde(with = "rfc3339")]
    pub date: DateTime<Utc>,
    /// `robot.model`, with the file name of a URDF
    pub robot_model: String,
    /// temperature of the cell, °C, if given
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<f64>,
    /// whether all gates passed
    pub passed: bool,
    /// failed gates, in words
    #[serde(default)]
    pub failures: Vec<String>,
    /// further doubts, in words
    #[serde(default)]
    pub warnings: Vec<String>,
    /// standard deviation of one touch
    pub repeatability_mm: f64,
    /// degrees of freedom of `repeatability_mm`
    pub repeatability_degrees_of_freedom: usize,
    /// standard deviation of a position along each axis, per metre from `registered_at_mm`
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth_mm_per_m: Option<f64>,
    /// effective radius of the ball
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_radius_mm: Option<f64>,
    /// standard uncertainty of the radius
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_radius_sigma_mm: Option<f64>,
}

/// A date in RFC 3339, in seconds.
mod rfc3339 {
    use chrono::{DateTime, SecondsFormat, Utc};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub fn serialize<S: Serializer>(
        date: &DateTime<Utc>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&date.to_rfc3339_opts(SecondsFormat::Secs, true))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<DateTime<Utc>, D::Error> {
        let text = String::deserialize(deserializer)?;
        let date = DateTime::parse_from_rfc3339(&text);
        date.map(Into::into)
            .map_err(|error| D::Error::custom(format_args!("its date is {text:?}: {error}")))
    }
}

/// Error of a check record.
#[derive(Debug, thiserror::Error)]
pub enum CheckRecordError {
    /// The file is unreadable.
    #[error("cannot read the record of the check {path}: {source}", path = path.display())]
    Read {
        /// the file
        path: PathBuf,
        /// error of the system
        source: io::Error,
    },
    /// The file is no check record.
    #[error(
        "{path} is no record of `touchup check`: {why}; write a new one (robot.check of the scene names it; take that key out, or the \
         file away, to check by this scene)", path = path.display()
    )]
    Damaged {
        /// the file
        path: PathBuf,
        /// in words
        why: String,
    },
}

impl CheckRecord {
    /// A record with date and arm only; the check fills in the rest.
    pub fn new(now: SystemTime, robot_model: &str, temperature_c: Option<f64>) -> Self {
        Self {
            version: VERSION,
            date: DateTime::<Utc>::from(now),
            robot_model: robot_model.to_owned(),
            temperature_c,
            passed: false,
            failures: Vec::new(),
            warnings: Vec::new(),
            repeatability_mm: 0.0,
            repeatability_degrees_of_freedom: 0,
            growth_mm_per_m: None,
            tip_radius_mm: None,
            tip_radius_sigma_mm: None,
        }
    }

    /// Reads a record; `None` if there is no such file.
    ///
    /// # Errors
    /// [`CheckRecordError`]
    pub fn read(path: &Path) -> Result<Option<Self>, CheckRecordError> {
        let text = read_text(path).map_err(|source| CheckRecordError::Read {
            path: path.to_owned(),
            source,
        })?;
        if text.is_empty() && !path.exists() {
            return Ok(None);
        }
        Self::parse(&text)
            .map(Some)
            .map_err(|why| CheckRecordError::Damaged {
                path: path.to_owned(),
                why,
            })
    }

    fn parse(text: &str) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct RecordVersion {
            version: u32,
        }
        let RecordVersion { version } =
            serde_json::from_str(text).map_err(|error| error.to_string())?;
        if version != VERSION {
            return Err(format!(
                "it has version {version}, this touchup reads version {VERSION}"
            ));
        }
        let record: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let numbers = [
            (
                "repeatability_mm",
                Some(record.repeatability_mm),
                [0.0, 10.0],
            ),
            ("growth_mm_per_m", record.growth_mm_per_m, [0.0, 100.0]),
            ("tip_radius_mm", record.tip_radius_mm, [0.0, 100.0]),
            (
                "tip_radius_sigma_mm",
                record.tip_radius_sigma_mm,
                [0.0, 10.0],
            ),
            ("temperature_c", record.temperature_c, [-100.0, 200.0]),
        ];
        for (key, value, [low, high]) in numbers {
            if let Some(value) = value.filter(|value| !(low..=high).contains(value)) {
                return Err(format!(
                    "its {key} is {value}, which must be {low} to {high}"
                ));
            }
        }
        Ok(record)
    }

    /// Whether its numbers belong to this model of an arm.
    pub(super) fn is_of(&self, robot_model: &str) -> bool {
        self.robot_model == robot_model
    }
}

/// Doubt about the check of an arm, for the user.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckDoubt {
    /// The scene names no record.
    #[error(
        "none: robot.check of the scene names no record of `touchup check`, so the uncertainties are what the scene tells"
    )]
    NotNamed,
    /// The file is missing.
    #[error("none: {} is not there; `touchup check --out` writes it", .0.display())]
    Missing(
        /// the file
        PathBuf,
    ),
    /// The check failed.
    #[error("failed: {0}")]
    Failed(
        /// the gates, in words
        String,
    ),
    /// The check is too old.
    #[error("too old: {days:.0} days, robot.check_days is {most}")]
    Old {
        /// age of the check
        days: f64,
        /// maximum age in the scene
        most: f64,
    },
    /// The date of the check is in the future.
    #[error("dated {days:.0} days from now: set the clock of this machine")]
    InFuture {
        /// days from now
        days: f64,
    },
    /// The check belongs to another arm; its numbers do not count.
    #[error("of another arm: {checked}, this one is {model}, so its numbers are not used")]
    OtherModel {
        /// model in the record
        checked: String,
        /// model in the scene
        model: String,
    },
    /// The temperature differs.
    #[error("made at {checked_c:.1} °C, it is {now_c:.1} °C now")]
    OtherTemperature {
        /// temperature of the check
        checked_c: f64,
        /// now
        now_c: f64,
    },
    /// A finding besides the gates.
    #[error("{0}")]
    Warned(
        /// in words
        String,
    ),
}

/// The check record that the scene names, and the doubts about it.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckStanding {
    /// `None` without a record
    pub record: Option<CheckRecord>,
    /// age at the time of the results, days
    pub age_days: Option<f64>,
    /// empty if the check is reliable
    pub doubts: Vec<CheckDoubt>,
}

impl CheckStanding {
    /// - `file`: named in the scene, `record`: its content; `most_days`: maximum age;
    ///   `temperature_c`: present temperature of the cell.
    pub(super) fn of(
        (file, record): (Option<&Path>, Option<&CheckRecord>),
        robot_model: &str,
        now: SystemTime,
        most_days: f64,
        temperature_c: Option<f64>,
    ) -> Self {
        let Some(record) = record else {
            let doubt = file.map_or(CheckDoubt::NotNamed, |file| {
                CheckDoubt::Missing(file.to_owned())
            });
            return Self {
                record: None,
                age_days: None,
                doubts: vec![doubt],
            };
        };
        let days = (DateTime::<Utc>::from(now) - record.date).num_seconds() as f64 / DAY_S;
        let temperatures = record.temperature_c.zip(temperature_c);
        let doubts = [
            (!record.passed).then(|| CheckDoubt::Failed(record.failures.join("; "))),
            (days > most_days).then_some(CheckDoubt::Old {
                days,
                most: most_days,
            }),
            (days < -CLOCKS).then_some(CheckDoubt::InFuture { days: -days }),
            (!record.is_of(robot_model)).then(|| CheckDoubt::OtherModel {
                checked: record.robot_model.clone(),
                model: robot_model.to_owned(),
            }),
            temperatures
                .filter(|(checked_c, now_c)| (checked_c - now_c).abs() > LARGEST_TEMPERATURE_CHANGE)
                .map(|(checked_c, now_c)| CheckDoubt::OtherTemperature { checked_c, now_c }),
        ];
        let warned = record.warnings.iter().cloned().map(CheckDoubt::Warned);
        let doubts = doubts.into_iter().flatten().chain(warned).collect();
        Self {
            record: Some(record.clone()),
            age_days: Some(days),
            doubts,
        }
    }

    /// The doubts in words.
    pub fn doubts(&self) -> Vec<String> {
        self.doubts.iter().map(ToString::to_string).collect()
    }
}

impl fmt::Display for CheckStanding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "check of the arm: ")?;
        if let Some(CheckRecord {
            date,
            repeatability_mm,
            growth_mm_per_m,
            ..
        }) = &self.record
        {
            write!(
                f,
                "{}, repeatability {repeatability_mm:.3} mm",
                date.to_rfc3339_opts(SecondsFormat::Secs, true)
            )?;
            growth_mm_per_m
                .iter()
                .try_for_each(|growth| write!(f, ", growth {growth:.3} mm/m"))?;
            let doubts = if self.doubts.is_empty() { "" } else { "; " };
            write!(f, "{doubts}")?;
        }
        write!(f, "{}", self.doubts().join("; "))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const DAY: Duration = Duration::from_secs(86_400);

    /// 2026-03-01T00:00:00Z, computed by hand: 20 454 days after 1970-01-01 (56 years of 365 days,
    /// 14 leap days, 31 + 28).
    fn made() -> SystemTime {
        SystemTime::UNIX_EPOCH + DAY * (56 * 365 + 14 + 31 + 28)
    }

    fn record() -> CheckRecord {
        CheckRecord {
            passed: true,
            repeatability_mm: 0.031,
            growth_mm_per_m: Some(0.2),
            ..CheckRecord::new(made(), "ur5e", Some(20.0))
        }
    }

    fn standing(record: &CheckRecord, days: u32, temperature_c: Option<f64>) -> CheckStanding {
        CheckStanding::of(
            (None, Some(record)),
            "ur5e",
            made() + DAY * days,
            30.0,
            temperature_c,
        )
    }

    #[test]
    fn what_casts_doubt_on_a_check_is_said() {
        let good = standing(&record(), 30, Some(25.0));
        assert!(good.doubts.is_empty() && good.age_days == Some(30.0));
        let words =
            "check of the arm: 2026-03-01T00:00:00Z, repeatability 0.031 mm, growth 0.200 mm/m";
        assert_eq!(good.to_string(), words);
        let old = standing(&record(), 31, None);
        assert_eq!(
            old.doubts,
            [CheckDoubt::Old {
                days: 31.0,
                most: 30.0
            }]
        );
        assert_eq!(
            old.to_string(),
            format!("{words}; too old: 31 days, robot.check_days is 30")
        );
        let warm = standing(&record(), 1, Some(25.1));
        assert_eq!(
            warm.doubts,
            [CheckDoubt::OtherTemperature {
                checked_c: 20.0,
                now_c: 25.1
            }]
        );
        let failed = CheckRecord {
            passed: false,
            failures: vec!["a".into(), "b".into()],
            ..record()
        };
        assert_eq!(standing(&failed, 1, None).doubts(), ["failed: a; b"]);
        let other = CheckStanding::of((None, Some(&record())), "ur10e", made(), 30.0, None);
        assert_eq!(
            other.doubts(),
            ["of another arm: ur5e, this one is ur10e, so its numbers are not used"]
        );
        let early = CheckStanding::of(
            (None, Some(&record())),
            "ur5e",
            made() - DAY * 2,
            30.0,
            None,
        );
        assert_eq!(early.doubts, [CheckDoubt::InFuture { days: 2.0 }]);
        let missing = CheckStanding::of(
            (Some(Path::new("no.json")), None),
            "ur5e",
            made(),
            30.0,
            None,
        );
        assert_eq!(
            missing.to_string(),
            "check of the arm: none: no.json is not there; `touchup check --out` writes it"
        );
        assert_eq!(
            CheckStanding::of((None, None), "ur5e", made(), 30.0, None).doubts,
            [CheckDoubt::NotNamed]
        );
    }

    #[test]
    fn a_record_is_read_as_it_was_written_and_others_are_refused() {
        let text = serde_json::to_string(&record()).unwrap();
        assert_eq!(CheckRecord::parse(&text), Ok(record()));
        for (change, why) in [
            (
                text.replace("\"version\":1", "\"version\":2"),
                "it has version 2, this touchup reads version 1",
            ),
            (
                text.replace("0.031", "-0.031"),
                "its repeatability_mm is -0.031, which must be 0 to 10",
            ),
            (text.replace("0.2", "1e300"), "its growth_mm_per_m is"),
            (
                text.replace("2026-03-01", "yesterday"),
                "its date is \"yesterday",
            ),
            (
                text.replace("\"passed\":true,", ""),
                "missing field `passed`",
            ),
            (text[..40].to_owned(), "EOF"),
            (String::new(), "EOF"),
            ("[".repeat(100_000), "invalid type"),
        ] {
            let refused = CheckRecord::parse(&change).unwrap_err();
            println!("{refused}");
            assert!(refused.contains(why), "{refused}");
        }
        let folder = tempfile::tempdir().unwrap();
        assert!(
            CheckRecord::read(&folder.path().join("no.json"))
                .unwrap()
                .is_none()
        );
        let file = folder.path().join("check.json");
        std::fs::write(&file, b"\xff\xfe").unwrap();
        assert!(matches!(
            CheckRecord::read(&file),
            Err(CheckRecordError::Read { .. })
        ));
        std::fs::write(&file, "").unwrap();
        let refused = CheckRecord::read(&file).unwrap_err().to_string();
        assert!(
            refused.contains("check.json is no record of `touchup check`"),
            "{refused}"
        );
    }
}
