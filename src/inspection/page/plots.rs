//! Small drawings of touches: how far each is off, and the force of an arm.

use std::fmt::Write;

use crate::inspection::evidence::TouchEvidence;
use crate::io::probed_touches_file::TouchLine;

/// Pixels of a drawing, and what its axes take.
const SIZE: [f64; 2] = [340.0, 130.0];
const LEFT: f64 = 42.0;
const BOTTOM: f64 = 30.0;
/// Most curves in one drawing.
const MOST_CURVES: usize = 24;

struct PlotAxes {
    x: [f64; 2],
    y: [f64; 2],
}

impl PlotAxes {
    fn x(&self, x: f64) -> f64 {
        LEFT + (x - self.x[0]) / (self.x[1] - self.x[0]) * (SIZE[0] - LEFT - 6.0)
    }

    fn y(&self, y: f64) -> f64 {
        6.0 + (self.y[1] - y) / (self.y[1] - self.y[0]) * (SIZE[1] - BOTTOM - 6.0)
    }

    fn begin(&self, label: &str) -> String {
        format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{label}\">",
            SIZE[0], SIZE[1]
        )
    }

    /// Lines and numbers of both axes.
    fn draw(&self, svg: &mut String, names: [&str; 2], digits: [usize; 2]) {
        let (left, right) = (LEFT, SIZE[0] - 6.0);
        for y in [self.y[0], (self.y[0] + self.y[1]) / 2.0, self.y[1]] {
            let at = self.y(y);
            let number = shown(y, digits[1]);
            let _ = write!(
                svg,
                "<path d=\"M{left} {at:.1} H{right}\" stroke=\"#c9ced8\" stroke-width=\".7\"/><text x=\"{:.1}\" y=\"{:.1}\" font-size=\"8.5\" text-anchor=\"end\" fill=\"#4a5160\">{number}</text>",
                left - 4.0,
                at + 3.0
            );
        }
        for (x, anchor) in [
            (self.x[0], "start"),
            ((self.x[0] + self.x[1]) / 2.0, "middle"),
            (self.x[1], "end"),
        ] {
            let number = shown(x, digits[0]);
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"8.5\" text-anchor=\"{anchor}\" fill=\"#4a5160\">{number}</text>",
                self.x(x),
                SIZE[1] - BOTTOM + 11.0
            );
        }
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" font-size=\"9\" text-anchor=\"middle\" fill=\"#1d2129\">{}</text>",
            (left + right) / 2.0,
            SIZE[1] - 5.0,
            names[0]
        );
        let middle = (SIZE[1] - BOTTOM) / 2.0;
        let _ = write!(
            svg,
            "<text x=\"9\" y=\"{middle:.1}\" font-size=\"9\" text-anchor=\"middle\" fill=\"#1d2129\" transform=\"rotate(-90 9 {middle:.1})\">{}</text>",
            names[1]
        );
    }
}

/// A number with the sign of mathematics, and none of 0.
fn shown(number: f64, digits: usize) -> String {
    let text = format!("{number:.digits$}");
    if text.trim_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text.replace('-', "−")
    }
}

/// How far the touches are off the ideal surface, µm.
pub(super) fn residual_plot(evidence: &TouchEvidence) -> String {
    let offs = evidence.drawn.iter().map(|[_, off]| off * 1e3);
    let most = offs
        .fold(2.0 * evidence.stated_mm * 1e3, |most, off| {
            most.max(off.abs())
        })
        .max(1.0);
    let step = 10f64.powf(most.log10().floor());
    let range = (most / step).ceil() * step;
    let [from, to] = evidence
        .drawn
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [x, _]| {
            [low.min(*x), high.max(*x)]
        });
    let is_angle = evidence.along.contains('°');
    let x = if is_angle {
        [-180.0, 180.0]
    } else {
        [from, if to > from { to } else { from + 1.0 }]
    };
    let axes = PlotAxes {
        x,
        y: [-range, range],
    };
    let mut svg = axes.begin("touches off the fitted surface");
    let band = (2.0 * evidence.stated_mm * 1e3).min(range);
    let _ = write!(
        svg,
        "<rect x=\"{LEFT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#e4ecf5\"/>",
        axes.y(band),
        SIZE[0] - LEFT - 6.0,
        axes.y(-band) - axes.y(band)
    );
    axes.draw(
        &mut svg,
        [evidence.along, "off, µm"],
        [0, usize::from(range < 2.0)],
    );
    for [along, off] in &evidence.drawn {
        let _ = write!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.3\" fill=\"#0a4f8c\" fill-opacity=\".75\"/>",
            axes.x(*along),
            axes.y(off * 1e3)
        );
    }
    svg + "</svg>"
}

/// Force against the approach over the travel, of touches that count; `None` where no curve is
/// there.
pub(super) fn force_plot(touches: &[&TouchLine]) -> Option<String> {
    let with_curve: Vec<_> = touches
        .iter()
        .filter(|touch| touch.accepted && touch.curve.len() > 1)
        .take(MOST_CURVES)
        .collect();
    // counted from where the force is largest: contact lies there for all
    let moved = |touch: &TouchLine| -> Vec<[f64; 2]> {
        let deepest = touch
            .curve
            .iter()
            .map(|[_, travel, ..]| *travel)
            .fold(f64::NEG_INFINITY, f64::max);
        touch
            .curve
            .iter()
            .map(|[_, travel, force, _]| [travel - deepest, *force])
            .collect()
    };
    let curves: Vec<_> = with_curve.iter().map(|touch| moved(touch)).collect();
    let all = || curves.iter().flatten();
    let most = all().map(|[_, force]| *force).fold(0.5, f64::max);
    let least = all().map(|[_, force]| *force).fold(0.0, f64::min);
    let from = all()
        .map(|[travel, _]| *travel)
        .fold(f64::INFINITY, f64::min);
    if !from.is_finite() {
        return None;
    }
    let axes = PlotAxes {
        x: [from.min(-0.1), 0.0],
        y: [least, most],
    };
    let mut svg = axes.begin("force over travel");
    axes.draw(
        &mut svg,
        ["travel from the deepest point, mm", "force, N"],
        [2, 1],
    );
    for curve in &curves {
        let points: String = curve
            .iter()
            .map(|[travel, force]| format!("{:.1},{:.1} ", axes.x(*travel), axes.y(*force)))
            .collect();
        let _ = write!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#0a4f8c\" stroke-opacity=\".45\" stroke-width=\".8\"/>",
            points.trim_end()
        );
    }
    Some(svg + "</svg>")
}
