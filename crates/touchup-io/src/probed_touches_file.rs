//! `probed_touches.jsonl`: all that was seen of each touch of an arm, a line of JSON each.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;

use super::atomic::write_atomically;
use touchup_core::probing::arm::{Onset, TouchMoment, TouchOutcome};
use touchup_core::probing::execute::{Probed, ProbedTouch};

reported! {
    /// One line; lengths in mm of O, travel along the approach.
    struct TouchLine, fn of(feature: u32, number: usize, touch: &ProbedTouch, ball_radius: f64, offset_ns: i64) {
        flag: u32 = feature,
        index: usize = number,
        begun_ns?: i64 = touch.record.as_ref().map(|record| record.stamps_ns[0] + offset_ns),
        ended_ns?: i64 = touch.record.as_ref().map(|record| record.stamps_ns[1] + offset_ns),
        /// `clean`, `slip`, `edge`, `bounce`, `impact`, `miss`, `unclear`, or `held_back` where it was not made
        verdict: &'static str = verdict(touch),
        accepted: bool = touch.refused.is_none(),
        reason?: String = touch.refused.clone(),
        from_mm: [f64; 3] = (touch.planned.from * 1e3).coords.into(),
        approach: [f64; 3] = touch.planned.direction.into_inner().into(),
        search_mm: f64 = touch.planned.search * 1e3,
        centre_mm?: [f64; 3] = touch.centre.map(|centre| (centre * 1e3).coords.into()),
        sigma_mm?: f64 = onset(touch).map(|onset| onset.sigma * 1e3),
        deviation_mm?: f64 = touch.deviation.map(|deviation| deviation * 1e3),
        speed_mm_per_s?: f64 = touch.record.as_ref().map(|record| record.speed * 1e3),
        tip_radius_mm: f64 = ball_radius * 1e3,
        largest_force_n?: f64 = touch.record.as_ref().map(|record| record.peak_force),
        /// seconds, travel in mm, force against the approach and across it in N; going in and coming out
        curve: Vec<[f64; 4]> = touch.record.iter().flat_map(|record| &record.curve).map(moment).collect(),
    }
}

fn moment(moment: &TouchMoment) -> [f64; 4] {
    [moment.t, moment.travel * 1e3, moment.force, moment.lateral]
}

fn onset(touch: &ProbedTouch) -> Option<&Onset> {
    if let TouchOutcome::Contact { onset, .. } = &touch.record.as_ref()?.outcome { Some(onset) } else { None }
}

fn verdict(touch: &ProbedTouch) -> &'static str {
    match touch.record.as_ref().map(|record| &record.outcome) {
        Some(TouchOutcome::Contact { onset, .. }) => onset.verdict.name(),
        Some(TouchOutcome::Miss { .. }) => "miss",
        Some(TouchOutcome::Unclear(_)) => "unclear",
        None => "held_back",
    }
}

/// Writes all touches of some features.
///
/// - `ball_radius`: of the tip, m.
///
/// # Errors
/// Of the file.
pub fn write_probed_touches(probed: &[Probed], ball_radius: f64, path: &Path) -> io::Result<()> {
    write_atomically(path, |out| probed.iter().try_for_each(|one| write_lines(one, ball_radius, 0, out)))
}

/// Writes the touches of one more feature behind those that are there.
///
/// - `offset_ns`: from the arm's clock to that of the file, ns.
///
/// # Errors
/// Of the file.
pub fn append_probed_touches(probed: &Probed, ball_radius: f64, offset_ns: i64, path: &Path) -> io::Result<()> {
    let mut lines = Vec::new();
    write_lines(probed, ball_radius, offset_ns, &mut lines)?;
    OpenOptions::new().create(true).append(true).open(path)?.write_all(&lines)
}

fn write_lines(probed: &Probed, ball_radius: f64, offset_ns: i64, out: &mut dyn Write) -> io::Result<()> {
    for (index, touch) in probed.touches.iter().enumerate() {
        serde_json::to_writer(&mut *out, &TouchLine::of(probed.flag, index, touch, ball_radius, offset_ns))?;
        writeln!(out)?;
    }
    Ok(())
}
