//! Known calibration behind the uncertainties, and its age.

use std::path::Path;
use std::time::SystemTime;

use chrono::{DateTime, Utc};
use touchup_geometry::numeric::{counted, median};

use super::InspectionError;
use super::source::InspectionSource;
use touchup_method::stylus::ProbedPoint;
use touchup_session::scene::Scene;

/// One line of the table: name, value, and source or age.
pub(super) struct CalibrationLine {
    pub what: &'static str,
    pub value: String,
    pub state: String,
}

const NOT_STATED: &str = "not stated";

/// State of the calibration, from scene and touches.
pub(super) fn calibration_of(
    source: &InspectionSource,
) -> Result<Vec<CalibrationLine>, InspectionError> {
    let scene = source
        .scene
        .as_deref()
        .map(|path| Ok::<_, InspectionError>((path, Scene::read_with_text(path)?)))
        .transpose()?;
    let mut lines = of_touches(&source.touches);
    match &scene {
        Some((path, (scene, yaml))) => lines.extend(of_scene(path, scene, yaml)),
        None => {
            let why = "no scene was given (--scene): when tip, force sensor and place of the scan were calibrated is not stated";
            lines.push(line("scene", NOT_STATED, why));
        }
    }
    Ok(lines)
}

fn line(what: &'static str, value: impl Into<String>, state: impl Into<String>) -> CalibrationLine {
    CalibrationLine {
        what,
        value: value.into(),
        state: state.into(),
    }
}

fn of_touches(touches: &[ProbedPoint]) -> Vec<CalibrationLine> {
    if touches.is_empty() {
        return vec![line(
            "touches",
            NOT_STATED,
            "no file of touches was given (--touches)",
        )];
    }
    let median_mm = |number: fn(&ProbedPoint) -> f64| {
        let mut all: Vec<f64> = touches.iter().map(number).collect();
        median(&mut all).unwrap_or_default() * 1e3
    };
    // 0: the file does not state it
    let mm = |number: f64| {
        if number > 0.0 {
            format!("{number:.4} mm")
        } else {
            NOT_STATED.to_owned()
        }
    };
    let median = "median over the touches; date of the calibration not stated";
    vec![
        line(
            "radius of the ball",
            mm(median_mm(|touch| touch.radius)),
            "as told when it was measured",
        ),
        line(
            "noise of one touch, u",
            mm(median_mm(|touch| touch.sigma)),
            "median over the touches",
        ),
        line(
            "left by radius and stiffness, u",
            mm(median_mm(|touch| touch.calibration)),
            median,
        ),
        line(
            "place of the scan, u",
            mm(median_mm(|touch| touch.place)),
            median,
        ),
    ]
}

fn of_scene(path: &Path, scene: &Scene, yaml: &str) -> Vec<CalibrationLine> {
    let named = |section: &str, key: &str| Scene::names(yaml, section, key);
    let in_scene = |is_named: bool| {
        if is_named {
            "named in the scene; date not stated"
        } else {
            "not named in the scene"
        }
    };
    let tip = scene.tip.as_ref();
    let radius = tip.map_or(NOT_STATED.to_owned(), |tip| {
        format!("{:.4} mm", tip.ball.radius * 1e3)
    });
    let stiffness = tip
        .and_then(|tip| tip.ball.stiffness)
        .map_or("rigid".to_owned(), |k| format!("{:.3} N/mm", k * 1e-3));
    let yes = |is_there: bool| if is_there { "applied" } else { NOT_STATED };
    let mut lines = vec![
        line(
            "scene: radius of the ball",
            radius,
            in_scene(named("tip", "radius_mm")),
        ),
        line(
            "scene: centre of the ball",
            yes(named("tip", "offset_mm")),
            in_scene(named("tip", "offset_mm")),
        ),
        line(
            "scene: stiffness of the stylus",
            stiffness,
            in_scene(named("tip", "stiffness_n_per_mm")),
        ),
        line(
            "scene: weight and bias of the sensor",
            yes(scene.compensation.is_some()),
            in_scene(scene.compensation.is_some()),
        ),
        line(
            "scene: place of the scan",
            yes(scene.scan_to_space.is_some()),
            in_scene(scene.scan_to_space.is_some()),
        ),
        line("scene file", "last changed", changed(path)),
    ];
    lines.extend(arm_check(scene));
    lines
}

/// Check of the arm; `None` without an arm.
fn arm_check(scene: &Scene) -> Option<CalibrationLine> {
    let robot = scene.robot.as_ref()?;
    let (found, date) = match &robot.check_record {
        Some(check) => {
            let verdict = if check.passed { "passed" } else { "failed" };
            let found = format!("{verdict}, repeatability {:.4} mm", check.repeatability_mm);
            (found, age(check.date))
        }
        None => (
            NOT_STATED.to_owned(),
            "the scene names no record (robot.check)".to_owned(),
        ),
    };
    Some(line("check of the arm", found, date))
}

fn changed(path: &Path) -> String {
    Path::metadata(path)
        .and_then(|data| data.modified())
        .map_or_else(|_| NOT_STATED.to_owned(), |at| age(at.into()))
}

/// A date and its age.
fn age(at: DateTime<Utc>) -> String {
    let days = DateTime::<Utc>::from(SystemTime::now())
        .signed_duration_since(at)
        .num_days();
    format!(
        "{}, {} before this inspection",
        at.format("%Y-%m-%d"),
        counted(days.max(0) as usize, "day", "days")
    )
}
