//! Results of a probing, as messages.

use crate::node::feature_messages::{flagged, found};
use crate::ros::clock::time;
use crate::ros::convert::{point, pose, vector};
use crate::ros::messages::{Feature, Header, ProbeResponse, ProbeResult, ProbeTouch, Time};
use crate::ros::refusal::{NO_POINT, NO_VECTOR, not_probed};
use touchup_probing::arm::{
    ArmError, LimitError, OnsetVerdict, ProbeError, Safety, SlideEnding, StopRequest, TouchMoment,
    TouchOutcome, TouchRecord,
};
use touchup_probing::execute::{
    Ending, Flag, FlagResult, Plan, ProbedSlide, ProbedTouch, RobotCell,
};

/// Message if there is no flagged feature to probe.
pub const NOTHING_FLAGGED: &str = "nothing is flagged that was not probed already";

/// Result of a feature that was not begun.
pub fn refused(target: &Flag, code: u8, message: String) -> ProbeResult {
    ProbeResult {
        feature: flagged(target),
        ..not_probed(target.id, code, &message)
    }
}

/// Result of a dry run.
pub fn planned(target: &Flag, plan: &Plan) -> ProbeResult {
    let (code, message) = match plan.held_back.len() {
        0 => {
            let slides = if plan.slides.is_empty() {
                String::new()
            } else {
                format!(" and {} slides", plan.slides.len())
            };
            let beside = beside_the_part(plan.left_out.len());
            let touches = plan.touches.len();
            (
                ProbeResult::PLANNED,
                format!("{touches} touches{slides} planned{beside}; the path is published"),
            )
        }
        _ => {
            let held_back: Vec<String> = plan.held_back.iter().map(ToString::to_string).collect();
            (ProbeResult::OUT_OF_LIMITS, held_back.join("; "))
        }
    };
    refused(target, code, message)
}

/// Result of the measurement.
pub fn result_of(target: &Flag, probed: &FlagResult) -> ProbeResult {
    let feature = probed
        .found
        .as_ref()
        .and_then(|found| found.feature.as_ref());
    let unknown = refused(target, 0, String::new());
    ProbeResult {
        code: code_of(&probed.ending),
        message: probed.ending.to_string()
            + &beside_the_part(probed.left_out.len())
            + &slid(&probed.slides),
        feature: feature.map_or(unknown.feature.clone(), |feature| {
            let message = found(feature, target.id, Some(target.radius));
            match code_of(&probed.ending) {
                // broken off
                ProbeResult::CANCELLED.. => message,
                _ => Feature {
                    status: Feature::STATUS_PROBED,
                    ..message
                },
            }
        }),
        uncertainty: probed
            .found
            .as_ref()
            .and_then(|found| found.uncertainty)
            .unwrap_or(f64::NAN),
        duration: probed.seconds,
        max_force: probed.peak_force,
        touch_count: probed.touches.len() as u32,
        ..unknown
    }
}

/// Number of omitted positions, in words.
fn beside_the_part(count: usize) -> String {
    if count == 0 {
        String::new()
    } else {
        format!("; places left out, for the scan has no part there: {count}")
    }
}

/// Endings of the slides, as an addition to the ending of the probing.
fn slid(slides: &[ProbedSlide]) -> String {
    if slides.is_empty() {
        return String::new();
    }
    let arrived = |one: &&ProbedSlide| {
        one.record
            .as_ref()
            .is_some_and(|record| record.ending == SlideEnding::Arrived)
    };
    let arrived = slides.iter().filter(arrived).count();
    let others = slides
        .iter()
        .filter_map(|one| match (&one.record, &one.refused) {
            (Some(record), _) if record.ending == SlideEnding::Arrived => None,
            (Some(record), _) => Some(record.ending.to_string()),
            (None, why) => why.clone(),
        });
    let others: String = others.map(|why| format!("; one slide: {why}")).collect();
    format!("; {arrived} of {} slides arrived{others}", slides.len())
}

/// Maximum number of features in the result of a goal, so that it fits into one packet.
const MOST_NAMED: usize = 128;

/// Result of a goal, from the features begun.
pub fn response_of(results: &[ProbeResult], header: Header) -> ProbeResponse {
    let (code, message) = match results.iter().max_by_key(|one| one.code) {
        Some(worst) => (worst.code, worst.message.clone()),
        None => (ProbeResult::NO_SUCH_FEATURE, NOTHING_FLAGGED.to_owned()),
    };
    let named = &results[results.len().saturating_sub(MOST_NAMED)..];
    let (ids, codes) = named.iter().map(|one| (one.id, one.code)).unzip();
    ProbeResponse {
        header,
        code,
        message,
        ids,
        codes,
    }
}

/// Result of all flagged features, in words: each of a few, else the number and the worst.
pub fn summary_of(results: &[ProbeResult]) -> String {
    const FEW: usize = 4;
    let line = |one: &ProbeResult| format!("{}: {}", one.id, one.message);
    match results.iter().max_by_key(|one| one.code) {
        None => NOTHING_FLAGGED.to_owned(),
        Some(_) if results.len() <= FEW => results.iter().map(line).collect::<Vec<_>>().join("; "),
        Some(worst) => {
            let done = results
                .iter()
                .filter(|one| one.code < ProbeResult::CANCELLED)
                .count();
            let count = results.len();
            format!(
                "{done} of {count} done, each is on probe_results; the worst: {}",
                line(worst)
            )
        }
    }
}

/// Results of the touches of a feature, one message each.
///
/// - `radius`: of the tip, m.
pub fn touches_of(
    target: &Flag,
    probed: &FlagResult,
    radius: f64,
    cell: &RobotCell,
    offset_ns: i64,
    frame: &str,
) -> Vec<ProbeTouch> {
    let made = probed.touches.iter().zip(0..).map(|(touch, index)| {
        let (stamp, made) = touch_of(touch, radius, cell, offset_ns);
        let header = Header {
            stamp,
            frame_id: frame.to_owned(),
        };
        ProbeTouch {
            header,
            id: target.id,
            index,
            ..downsampled(made)
        }
    });
    made.collect()
}

/// Maximum number of rows of a curve, 16 bytes each: a message above 64 kB goes out in fragments,
/// and readers with default buffers lose some.
const MOST_ROWS: usize = 2000;

/// Thins longer curves evenly, keeping first and last row.
fn downsampled(mut touch: ProbeTouch) -> ProbeTouch {
    let thin = |row: &mut Vec<f32>| {
        if row.len() > MOST_ROWS {
            let last = row.len() - 1;
            *row = (0..MOST_ROWS)
                .map(|i| row[i * last / (MOST_ROWS - 1)])
                .collect();
        }
    };
    let ProbeTouch {
        curve_time,
        curve_travel,
        curve_force,
        curve_lateral_force,
        ..
    } = &mut touch;
    [curve_time, curve_travel, curve_force, curve_lateral_force]
        .into_iter()
        .for_each(thin);
    touch
}

fn code_of(ending: &Ending) -> u8 {
    match ending {
        Ending::ToleranceReached | Ending::Decided => ProbeResult::TOLERANCE_REACHED,
        // limited by the touches; the message has the reason
        Ending::TouchesSpent
        | Ending::CalibrationLimits { .. }
        | Ending::Undecided { .. }
        | Ending::Undecidable { .. } => ProbeResult::TOUCHES_SPENT,
        Ending::TimeSpent => ProbeResult::TIME_SPENT,
        Ending::NothingFound(_) => ProbeResult::NOTHING_FOUND,
        Ending::Cancelled(request) => cancelled(*request),
        Ending::OutOfLimits(_) => ProbeResult::OUT_OF_LIMITS,
        Ending::NoClearPath(_) => ProbeResult::NO_CLEAR_PATH,
        Ending::Stopped(error) => stopped(error),
    }
}

fn cancelled(request: StopRequest) -> u8 {
    match request {
        StopRequest::Retract => ProbeResult::CANCELLED,
        StopRequest::Stay => ProbeResult::STOPPED_IN_PLACE,
    }
}

fn stopped(error: &ProbeError) -> u8 {
    match error {
        ProbeError::Arm { error, .. } => match error {
            ArmError::Lost { .. }
            | ArmError::Dropped { .. }
            | ArmError::TopicSilent { .. }
            | ArmError::ProgramEnded => ProbeResult::LINK_LOST,
            // most often a door
            ArmError::ProgramPaused => ProbeResult::OPERATOR_STOP,
            ArmError::Stale
            | ArmError::WentBack { .. }
            | ArmError::JumpedAhead { .. }
            | ArmError::Behind { .. }
            | ArmError::Late { .. }
            | ArmError::Unreadable { .. } => ProbeResult::DATA_LOST,
            ArmError::Stopped {
                safety: Safety::OperatorStop,
            } => ProbeResult::OPERATOR_STOP,
            ArmError::Stopped { .. } => ProbeResult::PROTECTIVE_STOP,
            ArmError::Client { .. }
            | ArmError::Disobeys { .. }
            | ArmError::ProgramHangs { .. }
            | ArmError::Ignores { .. }
            | ArmError::GoesOn { .. } => ProbeResult::DRIVER_LOST,
            ArmError::Refused { .. } => ProbeResult::FAULT,
        },
        ProbeError::Limit {
            error: LimitError::Force { .. },
            ..
        } => ProbeResult::FORCE_OVER_LIMIT,
        ProbeError::Limit { .. } => ProbeResult::LIMIT_OVERRUN,
        ProbeError::LowRate { .. } | ProbeError::Senseless { .. } => ProbeResult::DATA_LOST,
        ProbeError::Obstacle { .. } | ProbeError::Loaded { .. } | ProbeError::Unsteady { .. } => {
            ProbeResult::UNEXPECTED_CONTACT
        }
        ProbeError::TooLong { .. }
        | ProbeError::Pulls { .. }
        | ProbeError::Noisy { .. }
        | ProbeError::Drifts { .. }
        | ProbeError::Displaced { .. } => ProbeResult::FAULT,
        ProbeError::Cancelled { request, .. } => cancelled(*request),
    }
}

/// The touch, and the stamp for its header.
fn touch_of(
    touch: &ProbedTouch,
    radius: f64,
    cell: &RobotCell,
    offset_ns: i64,
) -> (Time, ProbeTouch) {
    let approach = touch.planned.direction.into_inner();
    let mut made = ProbeTouch {
        verdict: ProbeTouch::HELD_BACK,
        accepted: touch.refused.is_none(),
        reason: touch.refused.clone().unwrap_or_default(),
        contact: NO_POINT,
        contact_std: f64::NAN,
        normal: NO_VECTOR,
        approach: vector(&approach),
        deviation: touch.deviation.unwrap_or(f64::NAN),
        tip_radius: radius,
        ..ProbeTouch::default()
    };
    let Some(record) = &touch.record else {
        return (Time::default(), made);
    };
    let (mut at, mut stamp_ns, mut onset_s) = (touch.planned.from, record.stamps_ns[1], 0.0);
    match &record.outcome {
        TouchOutcome::Contact { onset, force_b, .. } => {
            onset_s = onset_at(record, onset.travel);
            if let Some(centre) = touch.centre {
                // the part pushes along its normal, except for friction
                let normal = (cell.pose_bo.rotation.inverse() * force_b)
                    .try_normalize(0.0)
                    .unwrap_or(-approach);
                made.contact = point(&(centre - normal * radius));
                made.contact_std = onset.sigma;
                made.normal = vector(&normal);
                (at, stamp_ns) = (centre, record.curve_ns + (onset_s * 1e9) as i64);
            }
        }
        TouchOutcome::Miss { travel } => at += approach * *travel,
        TouchOutcome::Unclear(_) => {}
    }
    made.verdict = verdict_of(&record.outcome);
    made.pose = pose(
        &at,
        &(cell.pose_bo.inverse() * record.target.standoff_bt).rotation,
    );
    made.speed = record.speed;
    // only its size is known, and that the part pushes back
    made.peak_wrench.force = vector(&(approach * -record.peak_force));
    let row =
        |value: fn(&TouchMoment) -> f64| record.curve.iter().map(|m| value(m) as f32).collect();
    made.curve_time = record
        .curve
        .iter()
        .map(|m| (m.t - onset_s) as f32)
        .collect();
    made.curve_travel = row(|m| m.travel);
    made.curve_force = row(|m| m.force);
    made.curve_lateral_force = row(|m| m.lateral);
    (time(stamp_ns + offset_ns), made)
}

fn verdict_of(outcome: &TouchOutcome) -> u8 {
    match outcome {
        TouchOutcome::Contact { onset, .. } => match onset.verdict {
            OnsetVerdict::Clean => ProbeTouch::CLEAN,
            OnsetVerdict::Slip => ProbeTouch::SLIP,
            OnsetVerdict::Edge => ProbeTouch::EDGE,
            OnsetVerdict::Bounce => ProbeTouch::BOUNCE,
            OnsetVerdict::Impact => ProbeTouch::IMPACT,
        },
        TouchOutcome::Miss { .. } => ProbeTouch::MISS,
        TouchOutcome::Unclear(_) => ProbeTouch::UNCLEAR,
    }
}

/// First time at which a travel is reached, s from the start of the curve.
fn onset_at(record: &TouchRecord, travel: f64) -> f64 {
    record
        .curve
        .iter()
        .find(|m| m.travel >= travel)
        .map_or(0.0, |m| m.t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    use touchup_probing::execute::{HeldBack, PlannedMotion};

    fn touch(rows: usize) -> ProbeTouch {
        let curve: Vec<f32> = (0..rows).map(|i| i as f32).collect();
        ProbeTouch {
            curve_time: curve.clone(),
            curve_travel: curve.clone(),
            curve_force: curve.clone(),
            curve_lateral_force: curve,
            reason: "far".repeat(30),
            ..ProbeTouch::default()
        }
    }

    #[test]
    fn a_touch_fits_into_a_datagram_and_a_thinned_curve_keeps_its_ends() {
        let long = downsampled(touch(60_000));
        assert!(
            cdr_encoding::to_vec::<_, byteorder::LittleEndian>(&long)
                .unwrap()
                .len()
                < 48_000
        );
        assert!(long.curve_time.len() == MOST_ROWS && long.curve_time.is_sorted());
        assert_eq!(
            (long.curve_time[0], long.curve_time.last()),
            (0.0, Some(&59_999.0))
        );
        assert_eq!(long.curve_time, long.curve_lateral_force);
        assert_eq!(downsampled(touch(20)), touch(20));
    }

    #[test]
    fn what_cannot_be_made_is_named_a_touch_or_a_slide() {
        let held_back = [
            (PlannedMotion::Touch(2), "too far"),
            (PlannedMotion::Slide(0), "too low"),
        ];
        let held_back = held_back
            .map(|(what, why)| HeldBack {
                what,
                why: why.to_owned(),
            })
            .to_vec();
        let target = Flag {
            id: 7,
            kind: None,
            place: Point3::origin(),
            radius: 3e-3,
        };
        let result = planned(
            &target,
            &Plan {
                held_back,
                ..Plan::default()
            },
        );
        assert_eq!(result.code, ProbeResult::OUT_OF_LIMITS);
        assert_eq!(result.message, "touch 2: too far; slide 0: too low");
    }

    #[test]
    fn a_goal_ends_as_the_worst_of_its_features_and_names_the_last() {
        let result = |id: u32| ProbeResult {
            id,
            code: if id == 7 {
                ProbeResult::BAD_REQUEST
            } else {
                ProbeResult::TOLERANCE_REACHED
            },
            message: format!("message {id}"),
            ..ProbeResult::default()
        };
        let results: Vec<_> = (0..200).map(result).collect();
        let response = response_of(&results, Header::default());
        assert_eq!(
            (response.code, response.message.as_str()),
            (ProbeResult::BAD_REQUEST, "message 7")
        );
        assert_eq!(
            (response.ids, response.codes.len()),
            ((72..200).collect(), 128)
        );
        let few = response_of(&results[6..8], Header::default());
        assert_eq!(
            (few.ids, few.codes),
            (
                vec![6, 7],
                vec![ProbeResult::TOLERANCE_REACHED, ProbeResult::BAD_REQUEST]
            )
        );
        assert_eq!(
            response_of(&[], Header::default()).code,
            ProbeResult::NO_SUCH_FEATURE
        );

        assert_eq!(summary_of(&results[6..8]), "6: message 6; 7: message 7");
        assert_eq!(
            summary_of(&results),
            "199 of 200 done, each is on probe_results; the worst: 7: message 7"
        );
        assert_eq!(summary_of(&[]), NOTHING_FLAGGED);
    }
}
