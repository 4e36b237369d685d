//! Coloured grids beside each other, with one bar of colours for all.

use super::super::figure::{Axis, Figure, Panel, Scale};
use super::super::number::{power_of_ten, three_digits};
use super::axis::Tick;
use super::frame::{Frame, TOP, WIDTH};
use super::style::text_width;
use super::writer::Svg;

/// Room for the numbers and the name of the axis on the left, between grids, for the bar on the
/// right, and below.
const LEFT: f64 = 82.0;
const GAP: f64 = 32.0;
const BAR: f64 = 110.0;
const BELOW: f64 = 46.0;
/// Above each grid: its name.
const NAME: f64 = 22.0;
/// Most grids beside each other.
const ACROSS: usize = 4;
/// Smallest and largest height of a grid.
const HEIGHTS: (f64, f64) = (150.0, 330.0);
/// From none to all: dark blue to light yellow, rising in brightness, so that it reads in grey too
/// (viridis).
const COLOURS: [[f64; 3]; 6] = [
    [68.0, 1.0, 84.0],
    [65.0, 68.0, 135.0],
    [42.0, 120.0, 142.0],
    [34.0, 168.0, 132.0],
    [122.0, 209.0, 81.0],
    [253.0, 231.0, 37.0],
];
/// No white hair between cells.
const CRISP: &str = "shape-rendering=\"crispEdges\"";
/// Where nothing was run.
const NOTHING: &str = "#e4e4e4";

/// Draws below the title, and returns its lower edge.
pub(super) fn draw(svg: &mut Svg, figure: &Figure, share_of: &str, panels: &[Panel]) -> f64 {
    // as many lines as it takes, evenly filled
    let lines = panels.len().div_ceil(ACROSS).max(1);
    let across = panels.len().div_ceil(lines).max(1);
    let width = (WIDTH - LEFT - BAR - (across - 1) as f64 * GAP) / across as f64;
    let height = width.clamp(HEIGHTS.0, HEIGHTS.1);
    let mut bottom = TOP;
    for (line, panels) in panels.chunks(across).enumerate() {
        let top = TOP + line as f64 * (NAME + height + BELOW) + NAME;
        for (column, panel) in panels.iter().enumerate() {
            let frame = Frame {
                left: LEFT + column as f64 * (width + GAP),
                top,
                width,
                height,
            };
            draw_panel(svg, &frame, figure, panel);
            if column == 0 {
                frame.draw_y_labels(svg, &labels(&panel.ys, &figure.y, height / 24.0));
                svg.upward_text([LEFT - 56.0, top + 0.5 * height], &figure.y.label);
            }
        }
        bottom = top + height + BELOW;
    }
    let bar = Frame {
        left: WIDTH - BAR + 24.0,
        top: TOP + NAME,
        width: 18.0,
        height,
    };
    let has_gaps = panels
        .iter()
        .any(|panel| panel.shares.iter().any(Option::is_none));
    draw_bar(svg, &bar, share_of, has_gaps);
    bottom
}

fn draw_panel(svg: &mut Svg, frame: &Frame, figure: &Figure, panel: &Panel) {
    let (columns, rows) = (panel.xs.len(), panel.ys.len());
    svg.text(
        [frame.left, frame.top - 7.0],
        "start",
        "font-size=\"12.5\" font-weight=\"600\"",
        &panel.name,
    );
    let size = [
        frame.width / columns.max(1) as f64,
        frame.height / rows.max(1) as f64,
    ];
    for (at, share) in panel.shares.iter().take(columns * rows).enumerate() {
        let (row, column) = (at / columns, at % columns);
        let corner = [
            frame.left + column as f64 * size[0],
            frame.bottom() - (row + 1) as f64 * size[1],
        ];
        let (x, y) = (three_digits(panel.xs[column]), three_digits(panel.ys[row]));
        let text = share.map_or("nothing was run".to_owned(), three_digits);
        let title = format!("{}: {x}; {}: {y}; {text}", figure.x.label, figure.y.label);
        let colour = share.map_or(NOTHING.to_owned(), colour);
        svg.rectangle(corner, size, &format!("fill=\"{colour}\" {CRISP}"), &title);
    }
    frame.draw_border(svg);
    frame.draw_x_labels(svg, &labels(&panel.xs, &figure.x, frame.width / 42.0));
    svg.text(
        [frame.left + 0.5 * frame.width, frame.bottom() + 35.0],
        "middle",
        "",
        &figure.x.label,
    );
}

/// Numbers at the middles of cells, at most about `most`; powers of ten first.
fn labels(values: &[f64], axis: &Axis, most: f64) -> Vec<Tick> {
    let is_power = |value: f64| {
        axis.scale == Scale::Log && (value.log10() - value.log10().round()).abs() < 1e-9
    };
    let by_powers = values.iter().filter(|value| is_power(**value)).count() > 2;
    let shown: Vec<_> = values
        .iter()
        .enumerate()
        .filter(|(_, value)| !by_powers || is_power(**value))
        .collect();
    let every = ((shown.len() as f64 / most.max(1.0)).ceil() as usize).max(1);
    let tick = |(at, value): (usize, &f64)| {
        let label = if by_powers {
            power_of_ten(value.log10().round() as i32)
        } else {
            three_digits(*value)
        };
        Tick {
            at: (at as f64 + 0.5) / values.len() as f64,
            label,
        }
    };
    shown.into_iter().step_by(every).map(tick).collect()
}

fn draw_bar(svg: &mut Svg, frame: &Frame, share_of: &str, has_gaps: bool) {
    const STEPS: usize = 50;
    for step in 0..STEPS {
        let share = (step as f64 + 0.5) / STEPS as f64;
        let height = frame.height / STEPS as f64;
        let corner = [frame.left, frame.bottom() - (step + 1) as f64 * height];
        svg.rectangle(
            corner,
            [frame.width, height],
            &format!("fill=\"{}\" {CRISP}", colour(share)),
            "",
        );
    }
    frame.draw_border(svg);
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let [x, y] = frame.pixel([1.0, share]);
        svg.text(
            [x + 5.0, y + 4.0],
            "start",
            "font-size=\"12\"",
            &format!("{} %", three_digits(100.0 * share)),
        );
    }
    let name = format!("share of {share_of}");
    if text_width(&name, 12.0) < BAR {
        svg.text(
            [WIDTH - 6.0, frame.top - 7.0],
            "end",
            "font-size=\"12\"",
            &name,
        );
    } else {
        svg.upward_text([frame.left - 6.0, frame.top + 0.5 * frame.height], &name);
    }
    if has_gaps {
        let [x, y] = [frame.left, frame.bottom() + 14.0];
        svg.rectangle(
            [x, y],
            [18.0, 12.0],
            &format!("fill=\"{NOTHING}\" stroke=\"#444\""),
            "",
        );
        svg.text([x + 23.0, y + 10.0], "start", "font-size=\"12\"", "not run");
    }
}

fn colour(share: f64) -> String {
    if !share.is_finite() {
        return NOTHING.to_owned();
    }
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (at as usize).min(COLOURS.len() - 2);
    let part = at - below as f64;
    let mixed = |i: usize| {
        (COLOURS[below][i] + part * (COLOURS[below + 1][i] - COLOURS[below][i])).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mixed(0), mixed(1), mixed(2))
}
