//! A characteristic drawn: tolerance zone, acceptance zone, measured value with its expanded
//! uncertainty.

use std::fmt::Write;

use crate::features::InspectedQuantity;
use crate::io::inspection_file::CharacteristicRecord;

/// Pixels.
const SIZE: [f64; 2] = [150.0, 22.0];

/// The drawing as SVG; nothing without a limit.
#[expect(clippy::too_many_lines)]
pub(super) fn tolerance_bar(one: &CharacteristicRecord) -> String {
    let number = |name: &str| one.number(name);
    let (lower, upper) = (number("lower_limit"), number("upper_limit"));
    let actual = number("actual");
    let spread = number("expanded_uncertainty").unwrap_or(0.0);
    // of a single limit the zone is drawn as wide as the value is away from it
    let reach = actual.zip(lower.or(upper)).map_or(1.0, |(y, limit)| {
        (y - limit).abs().max(2.0 * spread).max(1e-6) * 1.6
    });
    let (low, high) = match (lower, upper) {
        (Some(lower), Some(upper)) => (lower, upper),
        (Some(lower), None) => (lower, lower + reach),
        (None, Some(upper)) => (upper - reach, upper),
        (None, None) => return String::new(),
    };
    let low = if InspectedQuantity::of_name(&one.quantity).is_some_and(InspectedQuantity::is_zone) {
        0.0
    } else {
        low
    };
    let margin = (high - low) * 0.35;
    let [width, height] = SIZE;
    let x = |value: f64| {
        ((value - low + margin) / (high - low + 2.0 * margin) * width).clamp(2.0, width - 2.0)
    };
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"value in its tolerance\">"
    );
    let mut rect = |from: f64, to: f64, top: f64, tall: f64, fill: &str| {
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"{tall}\" fill=\"{fill}\"/>",
            from,
            (to - from).max(0.0)
        );
    };
    rect(2.0, width - 2.0, 10.0, 2.0, "#c9ced8");
    rect(x(low), x(high), 6.0, 10.0, "#d8dde6");
    let accepted = (number("acceptance_lower"), number("acceptance_upper"));
    if accepted != (None, None) {
        rect(
            x(accepted.0.unwrap_or(low)),
            x(accepted.1.unwrap_or(high)),
            6.0,
            10.0,
            "#7fb9ac",
        );
    }
    for limit in [lower, upper].into_iter().flatten() {
        rect(x(limit) - 0.75, x(limit) + 0.75, 2.0, 18.0, "#1d2129");
    }
    if let Some(y) = actual {
        let (from, to) = (
            x(y - spread),
            if one.is_at_least {
                width - 2.0
            } else {
                x(y + spread)
            },
        );
        rect(from, to, 10.25, 1.5, "#1d2129");
        let inside = (low - margin..=high + margin).contains(&y);
        let _ = if inside {
            write!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"11\" r=\"3.2\" fill=\"#1d2129\"/>",
                x(y)
            )
        } else {
            let (at, turn) = if y > high {
                (width - 2.0, -7.0)
            } else {
                (2.0, 7.0)
            };
            write!(
                svg,
                "<path d=\"M{at} 11 l{turn} -5 v10 z\" fill=\"#b94a00\"/>"
            )
        };
    }
    svg + "</svg>"
}
