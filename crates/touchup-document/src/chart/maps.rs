//! Coloured grids beside each other, with one colour bar.

use maud::{Markup, html};

use super::element::{label, px, text_width, upward_label};
use super::extent::Tick;
use super::frame::Frame;
use crate::figure::{Axis, Figure, Panel, Scale};
use crate::number::{power_of_ten, three_digits};

/// Room on the left for numbers and axis name, between grids, on the right for the bar, and below.
const LEFT: f64 = 82.0;
const GAP: f64 = 32.0;
const BAR: f64 = 110.0;
const BELOW: f64 = 46.0;
/// Upper edge of the first grid, and the room above each grid for its name.
const TOP: f64 = 60.0;
const NAME: f64 = 22.0;
/// Most grids beside each other.
const ACROSS: usize = 4;
/// Steps of the colour bar.
const STEPS: usize = 50;
/// From 0 to 1: dark blue to light yellow, of rising brightness, so that it reads in grey too
/// (viridis).
const COLOURS: [[f64; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];
/// A cell without runs.
const NOTHING: &str = "#e4e4e4";

/// The drawing, and its lower edge.
pub(super) fn draw(figure: &Figure, share_of: &str, panels: &[Panel], page: f64) -> (Markup, f64) {
    // fewest rows, evenly filled
    let lines = panels.len().div_ceil(ACROSS).max(1);
    let across = panels.len().div_ceil(lines).max(1);
    let width = (page - LEFT - BAR - (across - 1) as f64 * GAP) / across as f64;
    let height = width.clamp(150.0, 330.0);
    let top = |line: usize| TOP + line as f64 * (NAME + height + BELOW);
    let size = [width, height];
    let left = |column: usize| LEFT + column as f64 * (width + GAP);
    let frame = |at: usize| Frame::new([left(at % across), top(at / across)], size);
    let bar_frame = Frame::new([page - BAR + 24.0, TOP], [18.0, height]);
    let has_gaps = panels.iter().any(|panel| panel.shares.contains(&None));
    let drawing = html! {
        @for (at, panel) in panels.iter().enumerate() {
            (draw_panel(&frame(at), figure, panel))
            @if at % across == 0 {
                (frame(at).y_labels(&labels(&panel.ys, &figure.y, height / 24.0)))
                (upward_label([LEFT - 56.0, frame(at).top + 0.5 * height], &figure.y.label))
            }
        }
        (bar(&bar_frame, &format!("share of {share_of}"), has_gaps))
    };
    let bottom = if panels.is_empty() {
        TOP - NAME
    } else {
        top(lines - 1) + height + BELOW
    };
    (drawing, bottom)
}

/// A rectangle from its upper left corner, without a white hairline around it, with `title` as its
/// tooltip.
fn cell(corner: [f64; 2], size: [f64; 2], colour: &str, title: &str) -> Markup {
    let ([x, y], [width, height]) = (corner.map(px), size.map(px));
    html! {
        rect x=(x) y=(y) width=(width) height=(height) fill=(colour) shape-rendering="crispEdges" {
            @if !title.is_empty() { title { (title) } }
        }
    }
}

fn draw_panel(frame: &Frame, figure: &Figure, panel: &Panel) -> Markup {
    let (columns, rows) = (panel.xs.len(), panel.ys.len());
    let size = [
        frame.width / columns.max(1) as f64,
        frame.height / rows.max(1) as f64,
    ];
    let cells = panel
        .shares
        .iter()
        .take(columns * rows)
        .enumerate()
        .map(|(at, share)| {
            let (row, column) = (at / columns, at % columns);
            let [x, y] = [panel.xs[column], panel.ys[row]].map(three_digits);
            let text = share.map_or("nothing was run".to_owned(), three_digits);
            let title = format!("{}: {x}; {}: {y}; {text}", figure.x.label, figure.y.label);
            let corner = frame.place([
                column as f64 / columns as f64,
                (row + 1) as f64 / rows as f64,
            ]);
            cell(
                corner,
                size,
                &share.map_or(NOTHING.to_owned(), colour),
                &title,
            )
        });
    let [x, y] = [frame.left, frame.top - 7.0].map(px);
    html! {
        text x=(x) y=(y) font-size="12.5" font-weight="600" { (panel.name) }
        @for cell in cells { (cell) }
        (frame.border())
        (frame.x_labels(&labels(&panel.xs, &figure.x, frame.width / 42.0)))
        (label([frame.left + 0.5 * frame.width, frame.bottom() + 35.0], "middle", 13.0, &figure.x.label))
    }
}

/// Numbers at the middles of cells, about `most` at most; powers of ten first.
fn labels(values: &[f64], axis: &Axis, most: f64) -> Vec<Tick> {
    let is_power = |value: f64| {
        axis.scale == Scale::Log && (value.log10() - value.log10().round()).abs() < 1e-9
    };
    let by_powers = values.iter().filter(|value| is_power(**value)).count() > 2;
    let shown = values
        .iter()
        .enumerate()
        .filter(|(_, value)| !by_powers || is_power(**value));
    let shown: Vec<_> = shown.collect();
    let every = ((shown.len() as f64 / most.max(1.0)).ceil() as usize).max(1);
    let tick = |(at, value): (usize, &f64)| Tick {
        at: (at as f64 + 0.5) / values.len() as f64,
        label: if by_powers {
            power_of_ten(value.log10().round() as i32)
        } else {
            three_digits(*value)
        },
    };
    shown.into_iter().step_by(every).map(tick).collect()
}

fn bar(frame: &Frame, name: &str, has_gaps: bool) -> Markup {
    let share = |step: usize| step as f64 / STEPS as f64;
    let step = [frame.width, frame.height / STEPS as f64];
    html! {
        @for at in 0..STEPS {
            (cell(frame.place([0.0, share(at + 1)]), step, &colour(share(at) + 0.5 / STEPS as f64), ""))
        }
        (frame.border())
        @for percent in [0, 25, 50, 75, 100] {
            @let [x, y] = frame.place([1.0, f64::from(percent) / 100.0]);
            (label([x + 5.0, y + 4.0], "start", 12.0, &format!("{percent} %")))
        }
        @if text_width(name, 12.0) < BAR {
            (label([frame.left + BAR - 30.0, frame.top - 7.0], "end", 12.0, name))
        } @else {
            (upward_label([frame.left - 6.0, frame.top + 0.5 * frame.height], name))
        }
        @if has_gaps {
            (cell([frame.left, frame.bottom() + 14.0], [18.0, 12.0], NOTHING, ""))
            (label([frame.left + 23.0, frame.bottom() + 24.0], "start", 12.0, "not run"))
        }
    }
}

fn colour(share: f64) -> String {
    if !share.is_finite() {
        return NOTHING.to_owned();
    }
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (at as usize).min(COLOURS.len() - 2);
    let mix = |i: usize| {
        let [from, to] = [COLOURS[below][i], COLOURS[below + 1][i]];
        (from + (at - below as f64) * (to - from)).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2))
}
