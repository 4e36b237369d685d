//! What came of a probing, as messages.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::probe::{Cell, Ending, Plan, ProbeParams, Probed, ProbedSlide, ProbedTouch};
use crate::robot::{ArmError, LimitError, ProbeError, Safety, SlideEnding, TouchOutcome, TouchRecord, Verdict};
use crate::ros::messages::{
    Feature, Point, Pose, ProbeResult, ProbeTouch, Quaternion, Vector3 as Vector3Msg, Wrench as WrenchMsg,
};
use crate::ros::node::convert::{NO_VECTOR, point, time, vector};
use crate::ros::node::feature_messages::{flagged, found, number_of};
use crate::ros::node::seeker::Target;

const NOWHERE: Point = Point { x: f64::NAN, y: f64::NAN, z: f64::NAN };

/// Not begun, and nothing is known of it.
pub fn not_probed(id: u32, code: u8, why: &str) -> ProbeResult {
    let nowhere = Point3::new(f64::NAN, f64::NAN, f64::NAN);
    ProbeResult {
        id,
        code,
        message: why.to_owned(),
        feature: flagged(id, Feature::KIND_UNKNOWN, &nowhere, f64::NAN),
        uncertainty: f64::NAN,
        ..ProbeResult::default()
    }
}

/// Not begun.
pub fn refused(target: &Target, code: u8, message: String) -> ProbeResult {
    let kind = target.kind.map_or(0, number_of);
    ProbeResult {
        id: target.id,
        code,
        message,
        feature: flagged(target.id, kind, &target.place, target.radius),
        uncertainty: f64::NAN,
        ..ProbeResult::default()
    }
}

/// A dry run.
pub fn planned(target: &Target, plan: &Plan) -> ProbeResult {
    let told = plan.held_back.iter().map(|(touch, why)| format!("touch {touch}: {why}"));
    let (code, message) = match plan.held_back.len() {
        0 => {
            let slides =
                if plan.slides.is_empty() { String::new() } else { format!(" and {} slides", plan.slides.len()) };
            (ProbeResult::PLANNED, format!("{} touches{slides} planned; the path is published", plan.wishes.len()))
        }
        _ => (ProbeResult::OUT_OF_LIMITS, told.collect::<Vec<_>>().join("; ")),
    };
    refused(target, code, message)
}

/// What was measured.
pub fn result_of(target: &Target, probed: &Probed, params: &ProbeParams, cell: &Cell, offset_ns: i64) -> ProbeResult {
    let feature = probed.found.as_ref().and_then(|found| found.feature.as_ref());
    let unknown = refused(target, 0, String::new());
    let touches = probed.touches.iter().enumerate();
    ProbeResult {
        code: code_of(&probed.ending),
        message: probed.ending.to_string() + &slid(&probed.slides),
        feature: feature.map_or(unknown.feature.clone(), |feature| {
            let message = found(feature, target.id, Some(target.radius));
            match code_of(&probed.ending) {
                // broken off
                ProbeResult::CANCELLED.. => message,
                _ => Feature { status: Feature::STATUS_PROBED, ..message },
            }
        }),
        uncertainty: probed.found.as_ref().and_then(|found| found.uncertainty).unwrap_or(f64::NAN),
        duration: probed.seconds,
        max_force: probed.peak_force,
        touches: touches.map(|(index, touch)| touch_of(index, touch, params, cell, offset_ns)).collect(),
        ..unknown
    }
}

/// How the slides ended, behind how the probing did.
fn slid(slides: &[ProbedSlide]) -> String {
    if slides.is_empty() {
        return String::new();
    }
    let arrived = |one: &&ProbedSlide| one.record.as_ref().is_some_and(|record| record.ending == SlideEnding::Arrived);
    let arrived = slides.iter().filter(arrived).count();
    let others = slides.iter().filter_map(|one| match (&one.record, &one.refused) {
        (Some(record), _) if record.ending == SlideEnding::Arrived => None,
        (Some(record), _) => Some(record.ending.to_string()),
        (None, why) => why.clone(),
    });
    let others: String = others.map(|why| format!("; one slide: {why}")).collect();
    format!("; {arrived} of {} slides arrived{others}", slides.len())
}

/// An answer above 64 kB goes out in fragments, of which readers with default buffers lose some: it is kept below this.
const MOST_BYTES: usize = 48_000;
/// A touch without its curve, and a feature without its points, in bytes, rounded up.
const TOUCH_BYTES: usize = 480;
const RESULT_BYTES: usize = 600;
/// A row of a curve, in bytes.
const ROW_BYTES: usize = 16;
const LEFT_OUT: &str = "; its touches are in probed_touches.jsonl of the session";

/// Thins out the curves of an answer, and leaves touches out where that is not enough: all of it is in the file of the session.
pub fn fit(results: &mut [ProbeResult]) {
    let bytes_of = |one: &ProbeResult| {
        RESULT_BYTES
            + one.message.len()
            + 24 * one.feature.points.len()
            + one.touches.iter().map(|t| TOUCH_BYTES + t.reason.len()).sum::<usize>()
    };
    let mut bytes: usize = results.iter().map(bytes_of).sum();
    for one in results.iter_mut().filter(|one| !one.touches.is_empty()) {
        if bytes <= MOST_BYTES {
            break;
        }
        bytes -= bytes_of(one);
        one.touches.clear();
        one.message += LEFT_OUT;
        bytes += bytes_of(one);
    }
    let touches = results.iter().map(|one| one.touches.len()).sum::<usize>().max(1);
    let rows = MOST_BYTES.saturating_sub(bytes) / ROW_BYTES / touches;
    let thin = |row: &mut Vec<f32>| {
        if row.len() > rows {
            let last = row.len() - 1;
            *row = (0..rows).map(|i| row[i * last / (rows - 1).max(1)]).collect();
        }
    };
    for touch in results.iter_mut().flat_map(|one| &mut one.touches) {
        let ProbeTouch { curve_time, curve_travel, curve_force, curve_lateral_force, .. } = touch;
        [curve_time, curve_travel, curve_force, curve_lateral_force].into_iter().for_each(thin);
    }
}

fn code_of(ending: &Ending) -> u8 {
    match ending {
        Ending::ToleranceReached => ProbeResult::TOLERANCE_REACHED,
        Ending::TouchesSpent => ProbeResult::TOUCHES_SPENT,
        Ending::TimeSpent => ProbeResult::TIME_SPENT,
        Ending::NothingFound(_) => ProbeResult::NOTHING_FOUND,
        Ending::Cancelled => ProbeResult::CANCELLED,
        Ending::OutOfLimits(_) => ProbeResult::OUT_OF_LIMITS,
        Ending::NoClearPath(_) => ProbeResult::NO_CLEAR_PATH,
        Ending::Stopped(error) => stopped(error),
    }
}

fn stopped(error: &ProbeError) -> u8 {
    match error {
        ProbeError::Arm { error, .. } => match error {
            ArmError::Lost { .. } | ArmError::Dropped { .. } | ArmError::ProgramEnded => ProbeResult::LINK_LOST,
            ArmError::Stale => ProbeResult::DATA_LOST,
            ArmError::Stopped { safety: Safety::OperatorStop } => ProbeResult::OPERATOR_STOP,
            ArmError::Stopped { .. } => ProbeResult::PROTECTIVE_STOP,
            ArmError::Client { .. } => ProbeResult::DRIVER_LOST,
            ArmError::Refused { .. } => ProbeResult::FAULT,
        },
        ProbeError::Limit { error: LimitError::Force { .. }, .. } => ProbeResult::FORCE_OVER_LIMIT,
        ProbeError::Limit { .. } => ProbeResult::LIMIT_OVERRUN,
        ProbeError::InTheWay { is_link: true, .. } => ProbeResult::UNEXPECTED_CONTACT,
        ProbeError::InTheWay { .. } => ProbeResult::EARLY_CONTACT,
        ProbeError::LowRate { .. } => ProbeResult::DATA_LOST,
        ProbeError::TooLong { .. } => ProbeResult::FAULT,
        ProbeError::Cancelled { .. } => ProbeResult::CANCELLED,
    }
}

fn touch_of(index: usize, touch: &ProbedTouch, params: &ProbeParams, cell: &Cell, offset_ns: i64) -> ProbeTouch {
    let radius = params.pattern.ball_radius;
    let way = touch.wish.direction.into_inner();
    let base = ProbeTouch {
        index: index as u32,
        verdict: ProbeTouch::HELD_BACK,
        accepted: touch.refused.is_none(),
        reason: touch.refused.clone().unwrap_or_default(),
        contact: NOWHERE,
        contact_std: f64::NAN,
        normal: NO_VECTOR,
        approach: vector(&way),
        deviation: touch.deviation.unwrap_or(f64::NAN),
        tip_radius: radius,
        ..ProbeTouch::default()
    };
    let Some(record) = &touch.record else { return base };
    let pose_ot = cell.pose_bo.inverse() * record.target.standoff_bt;
    let with = curve_of(base, record);
    let with = ProbeTouch { verdict: verdict_of(&record.outcome), ..with };
    match (&record.outcome, touch.centre) {
        (TouchOutcome::Contact { onset, force_b, .. }, Some(centre)) => {
            // the part pushes along its normal, but for friction
            let normal = (cell.pose_bo.rotation.inverse() * force_b).try_normalize(0.0).unwrap_or(-way);
            let measured_ns = record.curve_ns + (onset_at(record, onset.travel) * 1e9) as i64;
            ProbeTouch {
                stamp: time(measured_ns + offset_ns),
                pose: pose_at(&centre, &pose_ot),
                contact: point(&(centre - normal * radius)),
                contact_std: onset.sigma,
                normal: vector(&normal),
                ..with
            }
        }
        (TouchOutcome::Miss { travel }, _) => {
            let end = touch.wish.from + way * *travel;
            ProbeTouch { stamp: time(record.stamps_ns[1] + offset_ns), pose: pose_at(&end, &pose_ot), ..with }
        }
        _ => ProbeTouch {
            stamp: time(record.stamps_ns[1] + offset_ns),
            pose: pose_at(&touch.wish.from, &pose_ot),
            ..with
        },
    }
}

fn verdict_of(outcome: &TouchOutcome) -> u8 {
    match outcome {
        TouchOutcome::Contact { onset, .. } => match onset.verdict {
            Verdict::Clean => ProbeTouch::CLEAN,
            Verdict::Slip => ProbeTouch::SLIP,
            Verdict::Edge => ProbeTouch::EDGE,
            Verdict::Bounce => ProbeTouch::BOUNCE,
            Verdict::Knock => ProbeTouch::KNOCK,
        },
        TouchOutcome::Miss { .. } => ProbeTouch::MISS,
        TouchOutcome::Unclear(_) => ProbeTouch::UNCLEAR,
    }
}

fn pose_at(place: &Point3<f64>, pose_ot: &Isometry3<f64>) -> Pose {
    let q = pose_ot.rotation;
    Pose { position: point(place), orientation: Quaternion { x: q.i, y: q.j, z: q.k, w: q.w } }
}

/// When a travel is reached first, s from the beginning of the curve.
fn onset_at(record: &TouchRecord, travel: f64) -> f64 {
    record.curve.iter().find(|m| m.travel >= travel).map_or(0.0, |m| m.t)
}

fn curve_of(touch: ProbeTouch, record: &TouchRecord) -> ProbeTouch {
    let onset =
        if let TouchOutcome::Contact { onset, .. } = &record.outcome { onset_at(record, onset.travel) } else { 0.0 };
    let row = |value: fn(&crate::robot::TouchMoment) -> f64| record.curve.iter().map(|m| value(m) as f32).collect();
    // its size is known, and that the part pushes back
    let most = Vector3::from([touch.approach.x, touch.approach.y, touch.approach.z]) * -record.peak_force;
    ProbeTouch {
        speed: record.speed,
        peak_wrench: WrenchMsg { force: vector(&most), torque: Vector3Msg::default() },
        curve_time: record.curve.iter().map(|m| (m.t - onset) as f32).collect(),
        curve_travel: row(|m| m.travel),
        curve_force: row(|m| m.force),
        curve_lateral_force: row(|m| m.lateral),
        ..touch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(touches: usize, rows: usize) -> ProbeResult {
        let curve: Vec<f32> = (0..rows).map(|i| i as f32).collect();
        let touch = ProbeTouch {
            curve_time: curve.clone(),
            curve_travel: curve.clone(),
            curve_force: curve.clone(),
            curve_lateral_force: curve,
            reason: "far".repeat(30),
            ..ProbeTouch::default()
        };
        ProbeResult {
            touches: vec![touch; touches],
            message: "known as well as was asked".to_owned(),
            ..ProbeResult::default()
        }
    }

    fn bytes(results: &[ProbeResult]) -> usize {
        cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&results.to_vec()).unwrap().len()
    }

    #[test]
    fn an_answer_fits_into_a_datagram_whatever_was_touched() {
        for (features, touches, rows) in [(1, 15, 900), (1, 60, 2000), (5, 15, 900), (20, 20, 500), (20, 40, 0)] {
            let mut results = vec![result(touches, rows); features];
            fit(&mut results);
            assert!(bytes(&results) < 60_000, "{features} {touches} {rows}: {} bytes", bytes(&results));
            let told = results.iter().filter(|one| !one.touches.is_empty()).count();
            assert!(told > 0, "{features} {touches} {rows}");
            assert!(results.iter().all(|one| one.touches.is_empty() == one.message.contains("probed_touches.jsonl")));
        }
        // who was not begun has none to be left out
        let mut results = [result(0, 0), result(60, 0), result(60, 0)];
        fit(&mut results);
        assert_eq!(results[0], result(0, 0));
        assert!(results[1].touches.is_empty() && results[2].touches.len() == 60 && bytes(&results) < 60_000);
    }

    #[test]
    fn a_thinned_curve_keeps_its_ends_and_a_short_one_all() {
        let mut results = [result(15, 900)];
        fit(&mut results);
        for touch in &results[0].touches {
            assert!(touch.curve_time.len() > 100 && touch.curve_time.is_sorted());
            assert_eq!((touch.curve_time[0], touch.curve_time.last()), (0.0, Some(&899.0)));
            assert_eq!(touch.curve_time, touch.curve_lateral_force);
        }
        let mut short = [result(3, 20)];
        fit(&mut short);
        assert_eq!(short[0], result(3, 20));
    }
}
