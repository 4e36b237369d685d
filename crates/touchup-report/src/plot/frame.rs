//! A rectangle with axes along its lower and left side.

use super::axis::{Extent, Tick};
use super::style::text_width;
use super::writer::Svg;

/// Width of every picture, pixels.
pub(super) const WIDTH: f64 = 900.0;
/// From the upper edge to what is drawn: the title is between.
pub(super) const TOP: f64 = 38.0;
/// A label closer than this to the one before it is left out, pixels.
const LEAST_GAP: f64 = 8.0;

/// Where values become pixels.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The pixel of a place along both axes, each 0 to 1.
    pub fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + x * self.width, self.bottom() - y * self.height]
    }

    /// Gridlines, their numbers, and the border.
    pub fn draw_grid(&self, svg: &mut Svg, x: &Extent, y: &Extent) {
        let (xs, ys) = (x.ticks(), y.ticks());
        let upward = xs
            .iter()
            .map(|tick| (tick, [[tick.at, 0.0], [tick.at, 1.0]]));
        for (tick, ends) in upward.chain(
            ys.iter()
                .map(|tick| (tick, [[0.0, tick.at], [1.0, tick.at]])),
        ) {
            let [from, to] = ends.map(|end| self.pixel(end));
            // a line without a number is fainter
            let colour = if tick.label.is_empty() {
                "#efefef"
            } else {
                "#d6d6d6"
            };
            svg.line(from, to, &format!("stroke=\"{colour}\""));
        }
        self.draw_x_labels(svg, &xs);
        self.draw_y_labels(svg, &ys);
        self.draw_border(svg);
    }

    pub fn draw_border(&self, svg: &mut Svg) {
        svg.rectangle(
            [self.left, self.top],
            [self.width, self.height],
            "fill=\"none\" stroke=\"#444\"",
            "",
        );
    }

    /// Numbers below the frame, as many as have room.
    pub fn draw_x_labels(&self, svg: &mut Svg, ticks: &[Tick]) {
        let mut free_from = f64::NEG_INFINITY;
        for tick in ticks.iter().filter(|tick| !tick.label.is_empty()) {
            let [x, y] = self.pixel([tick.at, 0.0]);
            let half = 0.5 * text_width(&tick.label, 12.0);
            if x - half < free_from {
                continue;
            }
            free_from = x + half + LEAST_GAP;
            svg.text([x, y + 17.0], "middle", "font-size=\"12\"", &tick.label);
        }
    }

    /// Numbers on the left of the frame.
    pub fn draw_y_labels(&self, svg: &mut Svg, ticks: &[Tick]) {
        for tick in ticks {
            let [x, y] = self.pixel([0.0, tick.at]);
            svg.text([x - 7.0, y + 4.0], "end", "font-size=\"12\"", &tick.label);
        }
    }

    /// Labels of the axes, below and on the left.
    pub fn name_axes(&self, svg: &mut Svg, x: &str, y: &str) {
        svg.text(
            [self.left + 0.5 * self.width, self.bottom() + 38.0],
            "middle",
            "",
            x,
        );
        svg.upward_text([self.left - 56.0, self.top + 0.5 * self.height], y);
    }
}
