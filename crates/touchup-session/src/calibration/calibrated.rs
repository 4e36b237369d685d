//! Result of a calibration, and the scene that contains it.

use std::fmt::Display;
use std::time::SystemTime;

use chrono::{DateTime, NaiveDate, Utc};
use serde::{Deserialize, Serialize};

use crate::scene::{Scene, SceneError, Setting};

/// Calibrations that use a recording of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationKind {
    /// the centre of the ball in the tracked stylus
    Tip,
    /// weight and bias on the force sensor
    Payload,
    /// pose of the scan in the frame of the recorded poses
    Scan,
}

impl CalibrationKind {
    /// Its name in `touchup calibrate`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tip => "tip",
            Self::Payload => "payload",
            Self::Scan => "scan",
        }
    }
}

/// A printable result of a calibration that changes a scene.
pub trait CalibrationResult: Serialize + Display {
    /// The settings of a scene by the result, and one line on their source.
    fn settings(&self) -> (Vec<Setting>, String);
}

/// Result of a calibration, with doubts and losses.
#[derive(Clone, Debug)]
pub struct Calibration<F> {
    /// the result
    pub found: F,
    /// in words: doubts to check before use
    pub doubts: Vec<String>,
    /// in words: losses that a better recording would avoid
    pub losses: Vec<String>,
}

impl<F> Calibration<F> {
    /// The same calibration with its result mapped by `of`.
    pub fn map<G>(self, of: impl FnOnce(F) -> G) -> Calibration<G> {
        let Self {
            found,
            doubts,
            losses,
        } = self;
        Calibration {
            found: of(found),
            doubts,
            losses,
        }
    }
}

/// Separates a remark from its date.
const BEFORE_DATE: &str = "; ";

/// The text of a scene with a result set; a comment gives its source and the day, UTC.
///
/// - `yaml`: the earlier text.
///
/// # Errors
/// [`SceneError`] if the text is no scene, or the result cannot be set in it.
pub fn calibrated_scene(
    yaml: &str,
    found: &impl CalibrationResult,
    now: SystemTime,
) -> Result<String, SceneError> {
    let (settings, remark) = found.settings();
    let date = DateTime::<Utc>::from(now).date_naive();
    Scene::edited(yaml, &settings, &format!("{remark}{BEFORE_DATE}{date}"))
}

/// Day of a calibration in the text of a scene, UTC; `None` if the text gives none.
pub fn calibrated_on(yaml: &str, kind: CalibrationKind) -> Option<NaiveDate> {
    let key = match kind {
        CalibrationKind::Tip => "offset_mm",
        CalibrationKind::Payload => "mass_kg",
        CalibrationKind::Scan => "position_mm",
    };
    let remark = Scene::remark(yaml, key, &format!("{}:", kind.name()))?;
    remark.rsplit_once(BEFORE_DATE)?.1.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::fmt;
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    #[derive(Serialize)]
    struct LongStylus;

    impl Display for LongStylus {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("125 mm")
        }
    }

    impl CalibrationResult for LongStylus {
        fn settings(&self) -> (Vec<Setting>, String) {
            (
                vec![Setting::list("tip.offset_mm", &[0.0, 0.0, -125.0])],
                "tip: 7 poses".to_owned(),
            )
        }
    }

    #[test]
    fn the_day_of_a_calibration_is_read_from_its_comment_and_nothing_else_changes() {
        let yaml = "# bench 3\ntip:\n  radius_mm: 2.5  # the long one\n";
        // 2026-02-28, a minute before midnight, UTC
        let now = UNIX_EPOCH + Duration::from_secs(1_772_323_140);
        let made = calibrated_scene(yaml, &LongStylus, now).unwrap();
        assert!(made.starts_with(yaml), "{made}");
        assert!(
            made.ends_with(
                "  offset_mm: [0, 0, -125]  # touchup calibrate tip: 7 poses; 2026-02-28\n"
            ),
            "{made}"
        );
        assert_eq!(
            calibrated_on(&made, CalibrationKind::Tip),
            NaiveDate::from_ymd_opt(2026, 2, 28)
        );
        assert_eq!(calibrated_on(&made, CalibrationKind::Scan), None);
        // an older version writes no day, another's comment does not count, and the tip of an arm
        // is a different key
        let others = [
            ("; 2026-02-28", ""),
            ("touchup calibrate tip", "by hand"),
            ("offset_mm", "tip_position_mm"),
        ];
        for (ours, other) in others {
            assert_eq!(
                calibrated_on(&made.replace(ours, other), CalibrationKind::Tip),
                None,
                "{other}"
            );
        }
    }

    #[test]
    fn a_calibration_that_is_made_again_has_the_newer_day() {
        let day = |days: u64| UNIX_EPOCH + Duration::from_secs(days * 86_400);
        let first = calibrated_scene("tip:\n  radius_mm: 2.5\n", &LongStylus, day(0)).unwrap();
        let second = calibrated_scene(&first, &LongStylus, day(31)).unwrap();
        assert_eq!(
            calibrated_on(&second, CalibrationKind::Tip),
            NaiveDate::from_ymd_opt(1970, 2, 1)
        );
        assert_eq!(second.matches("touchup calibrate").count(), 1, "{second}");
    }
}
