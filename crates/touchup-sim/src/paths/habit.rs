//! Motion of a hand along its lines: sliding, scrubbing, or tapping.

use nalgebra::{Point3, Unit, Vector3};

use super::path::Stroke;

/// Manner of touching.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Habit {
    /// It slides from end to end.
    Slide,
    /// It rubs to and fro as it goes.
    Scrub,
    /// It lifts the tip between short contacts.
    Tap,
}

/// Forward length of a scrub along the line, m; it goes back by [`BACK`] of it.
const FORTH: f64 = 10e-3;
const BACK: f64 = 0.6;
/// Distance of two taps along a line, m.
const TAP_EVERY: f64 = 2.5e-3;
/// Height of the tip between two taps, m.
const LIFT: f64 = 2e-3;
/// Depth of a tap's target below the line, m: it makes the contact last.
const INTO: f64 = 0.5e-3;

impl Habit {
    /// The strokes of this hand: free moves stay, pressed lines change. A tap needs lines at the
    /// depth of the ball's contact, as in [`plan_mesh`](crate::plan_mesh).
    pub fn led(self, strokes: Vec<Stroke>) -> Vec<Stroke> {
        let pressed = |stroke: Stroke| match (self, stroke.press) {
            (Self::Slide, _) | (_, None) => vec![stroke],
            (Self::Scrub, Some(_)) => vec![Stroke {
                points: scrubbed(&stroke.points),
                ..stroke
            }],
            (Self::Tap, Some(press)) => vec![tapped(&stroke, &press)],
        };
        strokes.into_iter().flat_map(pressed).collect()
    }
}

/// Length of the line up to each of its points, m.
fn lengths(line: &[Point3<f64>]) -> Vec<f64> {
    let mut so_far = 0.0;
    let steps = line.windows(2).map(|ends| {
        so_far += (ends[1] - ends[0]).norm();
        so_far
    });
    [0.0].into_iter().take(line.len()).chain(steps).collect()
}

/// The point of the line at this length (m) of it.
fn at_length(line: &[Point3<f64>], lengths: &[f64], s: f64) -> Point3<f64> {
    let after = lengths
        .partition_point(|length| *length < s)
        .clamp(1, line.len() - 1);
    let piece = lengths[after] - lengths[after - 1];
    let share = if piece > 0.0 {
        ((s - lengths[after - 1]) / piece).clamp(0.0, 1.0)
    } else {
        0.0
    };
    line[after - 1] + (line[after] - line[after - 1]) * share
}

/// To and fro along a line, through each of its points on the way.
fn scrubbed(line: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let lengths = lengths(line);
    let Some(&whole) = lengths.last().filter(|_| line.len() > 1) else {
        return line.to_vec();
    };
    let mut points = vec![line[0]];
    let mut s = 0.0;
    while s < whole {
        let forth = (s + FORTH).min(whole);
        let back = if forth < whole {
            forth - BACK * FORTH
        } else {
            whole
        };
        let between = |low: f64, high: f64| {
            (0..line.len())
                .filter(|&i| low < lengths[i] && lengths[i] < high)
                .collect::<Vec<_>>()
        };
        points.extend(between(s, forth).into_iter().map(|i| line[i]));
        points.push(at_length(line, &lengths, forth));
        points.extend(between(back, forth).into_iter().rev().map(|i| line[i]));
        points.push(at_length(line, &lengths, back));
        s = back;
    }
    points
}

/// Short contacts along a line, with no pressing between them.
fn tapped(stroke: &Stroke, press: &Unit<Vector3<f64>>) -> Stroke {
    let line = &stroke.points;
    let lengths = lengths(line);
    let Some(&whole) = lengths.last().filter(|_| line.len() > 1) else {
        return stroke.clone();
    };
    let count = (whole / TAP_EVERY).ceil().max(1.0) as usize;
    let tap = |i: usize| {
        let p = at_length(line, &lengths, whole * i as f64 / count as f64);
        let above = p - press.into_inner() * LIFT;
        [above, p + press.into_inner() * INTO, above]
    };
    Stroke {
        points: (0..=count).flat_map(tap).collect(),
        press: None,
        ..*stroke
    }
}
