//! `probed_touches.jsonl`: all that was seen of each touch of an arm, a line of JSON each.

use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;

use super::atomic::write_atomically;
use touchup_core::probing::arm::TouchOutcome;
use touchup_core::probing::execute::{Probed, ProbedTouch};

/// One line; lengths in mm of O, travel along the approach.
#[derive(Debug, Serialize)]
struct TouchLine<'a> {
    flag: u32,
    index: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    begun_ns: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ended_ns: Option<i64>,
    /// `clean`, `slip`, `edge`, `bounce`, `impact`, `miss`, `unclear`, or `held_back` where it was not made
    verdict: &'static str,
    accepted: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<&'a str>,
    from_mm: [f64; 3],
    approach: [f64; 3],
    search_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre_mm: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    deviation_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_mm_per_s: Option<f64>,
    tip_radius_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    largest_force_n: Option<f64>,
    /// seconds, travel in mm, force against the approach and across it in N; going in and coming out
    curve: Vec<[f64; 4]>,
}

impl<'a> TouchLine<'a> {
    fn of(flag: u32, index: usize, touch: &'a ProbedTouch, ball_radius: f64, offset_ns: i64) -> Self {
        let record = touch.record.as_ref();
        let (verdict, sigma) = record.map_or(("held_back", None), |record| match &record.outcome {
            TouchOutcome::Contact { onset, .. } => (onset.verdict.name(), Some(onset.sigma * 1e3)),
            TouchOutcome::Miss { .. } => ("miss", None),
            TouchOutcome::Unclear(_) => ("unclear", None),
        });
        let moment = |m: &touchup_core::probing::arm::TouchMoment| [m.t, m.travel * 1e3, m.force, m.lateral];
        Self {
            flag,
            index,
            begun_ns: record.map(|record| record.stamps_ns[0] + offset_ns),
            ended_ns: record.map(|record| record.stamps_ns[1] + offset_ns),
            verdict,
            accepted: touch.refused.is_none(),
            reason: touch.refused.as_deref(),
            from_mm: (touch.planned.from * 1e3).coords.into(),
            approach: touch.planned.direction.into_inner().into(),
            search_mm: touch.planned.search * 1e3,
            centre_mm: touch.centre.map(|centre| (centre * 1e3).coords.into()),
            sigma_mm: sigma,
            deviation_mm: touch.deviation.map(|deviation| deviation * 1e3),
            speed_mm_per_s: record.map(|record| record.speed * 1e3),
            tip_radius_mm: ball_radius * 1e3,
            largest_force_n: record.map(|record| record.peak_force),
            curve: record.map_or(Vec::new(), |record| record.curve.iter().map(moment).collect()),
        }
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
