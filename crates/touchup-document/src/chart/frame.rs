//! A rectangle with axes along its lower and left side.

use maud::{Markup, html};

use super::element::{label, points, px, text_width};
use super::extent::{AxisExtent, Tick};

/// Least gap between labels; a closer label is left out.
const LEAST_GAP: f64 = 8.0;

/// Size of a chart, in units such that numbers on an axis are 12 high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartSize {
    /// width of the whole picture
    pub width: f64,
    /// height of the frame
    pub height: f64,
    /// whether the chart has title and legend
    pub is_labelled: bool,
}

impl ChartSize {
    /// Width of a page.
    pub const PAGE: Self = Self {
        width: 900.0,
        height: 400.0,
        is_labelled: true,
    };
    /// A third of that height, for several charts beside each other.
    pub const SMALL: Self = Self {
        width: 480.0,
        height: 132.0,
        is_labelled: false,
    };
}

/// Rectangle of the plotted values.
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    /// A frame at its upper left corner.
    pub fn new([left, top]: [f64; 2], [width, height]: [f64; 2]) -> Self {
        Self {
            left,
            top,
            width,
            height,
        }
    }

    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Place of two axis fractions, each 0 to 1.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + x * self.width, self.bottom() - y * self.height]
    }

    /// Gridlines and their numbers.
    pub fn grid(&self, x: &AxisExtent, y: &AxisExtent) -> Markup {
        let (xs, ys) = (x.ticks(), y.ticks());
        let upward = xs
            .iter()
            .map(|tick| (tick, [[tick.at, 0.0], [tick.at, 1.0]]));
        let level = ys
            .iter()
            .map(|tick| (tick, [[0.0, tick.at], [1.0, tick.at]]));
        html! {
            @for (tick, ends) in upward.chain(level) {
                // lines without a number are fainter
                polyline points=(points(ends.map(|end| self.place(end))))
                    stroke=(if tick.label.is_empty() { "#efefef" } else { "#d6d6d6" }) {}
            }
            (self.x_labels(&xs))
            (self.y_labels(&ys))
        }
    }

    pub fn border(&self) -> Markup {
        let [x, y, width, height] = [self.left, self.top, self.width, self.height].map(px);
        html! { rect x=(x) y=(y) width=(width) height=(height) fill="none" stroke="#444" {} }
    }

    /// Numbers below the frame, as far as they fit.
    pub fn x_labels(&self, ticks: &[Tick]) -> Markup {
        let mut free_from = f64::NEG_INFINITY;
        let mut has_room = |tick: &&Tick| {
            let half = 0.5 * text_width(&tick.label, 12.0);
            let x = self.place([tick.at, 0.0])[0];
            let has_room = !tick.label.is_empty() && x - half >= free_from;
            if has_room {
                free_from = x + half + LEAST_GAP;
            }
            has_room
        };
        html! {
            @for tick in ticks.iter().filter(|tick| has_room(tick)) {
                (label([self.place([tick.at, 0.0])[0], self.bottom() + 17.0], "middle", 12.0, &tick.label))
            }
        }
    }

    /// Numbers on the left of the frame.
    pub fn y_labels(&self, ticks: &[Tick]) -> Markup {
        html! {
            @for tick in ticks.iter().filter(|tick| !tick.label.is_empty()) {
                (label([self.left - 7.0, self.place([0.0, tick.at])[1] + 4.0], "end", 12.0, &tick.label))
            }
        }
    }
}
