//! Curves and marks in one frame, with a legend beside or below it.

use super::super::figure::{Figure, LineStroke, Mark, Series};
use super::axis::Extent;
use super::frame::{Frame, TOP, WIDTH};
use super::style::{Look, Looks, text_width};
use super::writer::Svg;

/// Room on the left for the numbers and the name of the axis, pixels.
const LEFT: f64 = 82.0;
/// Height of the frame, pixels.
const HEIGHT: f64 = 400.0;
/// Below the frame: numbers and name of the axis.
const BELOW: f64 = 50.0;
/// A legend is beside the frame where its names are no longer.
const WIDEST_BESIDE: f64 = 230.0;
/// The sample of line and mark in front of a name.
const SAMPLE: f64 = 34.0;
/// From line to line of the legend.
const LINE: f64 = 21.0;

/// Draws below the title, and returns its lower edge.
pub(super) fn draw(svg: &mut Svg, figure: &Figure, series: &[Series], looks: &Looks) -> f64 {
    let name_width = series
        .iter()
        .map(|series| text_width(&series.name, 12.5))
        .fold(0.0, f64::max);
    let is_beside = name_width <= WIDEST_BESIDE && series.len() as f64 * LINE <= HEIGHT;
    let right = if is_beside {
        name_width + SAMPLE + 24.0
    } else {
        24.0
    };
    let frame = Frame {
        left: LEFT,
        top: TOP,
        width: WIDTH - LEFT - right,
        height: HEIGHT,
    };
    let marks = || series.iter().flat_map(|series| &series.marks);
    let x = Extent::around(figure.x.scale, marks().flat_map(|mark| mark.x.numbers()));
    let y = Extent::around(figure.y.scale, marks().flat_map(|mark| mark.y.numbers()));
    frame.draw_grid(svg, &x, &y);
    frame.name_axes(svg, &figure.x.label, &figure.y.label);
    let mut draw =
        |series: &Series| draw_series(svg, &frame, [&x, &y], looks.look(&series.name), series);
    let hidden: usize = series.iter().map(&mut draw).sum();
    frame.draw_border(svg);
    let below = frame.bottom() + BELOW;
    let columns = if is_beside {
        1
    } else {
        (((WIDTH - LEFT) / (name_width + SAMPLE + 20.0)) as usize).max(1)
    };
    let corner = if is_beside {
        [frame.right() + 14.0, TOP + 12.0]
    } else {
        [LEFT, below + 12.0]
    };
    draw_legend(svg, (series, looks), corner, columns);
    let bottom = if is_beside {
        below
    } else {
        below + series.len().div_ceil(columns) as f64 * LINE
    };
    if hidden == 0 {
        return bottom;
    }
    let note = format!(
        "{hidden} marks are not shown: they have no place on these axes (0, or not finite)"
    );
    svg.text(
        [LEFT, bottom + 14.0],
        "start",
        "font-size=\"11.5\" fill=\"#a33\"",
        &note,
    );
    bottom + 18.0
}

/// Returns how many marks have no place.
fn draw_series(
    svg: &mut Svg,
    frame: &Frame,
    extents: [&Extent; 2],
    look: Look,
    series: &Series,
) -> usize {
    let places: Vec<Option<[f64; 2]>> = series
        .marks
        .iter()
        .map(|mark| place(frame, extents, mark))
        .collect();
    if series.stroke != LineStroke::Marks {
        let style = if series.stroke == LineStroke::Dashed {
            look.dashed()
        } else {
            look.line()
        };
        // a mark without a place parts the line
        for stretch in places
            .split(Option::is_none)
            .filter(|stretch| stretch.len() > 1)
        {
            svg.polyline(
                &stretch.iter().flatten().copied().collect::<Vec<_>>(),
                &style,
            );
        }
    }
    if has_marks(series) {
        for (mark, place) in series.marks.iter().zip(&places) {
            let Some(place) = place else { continue };
            draw_bars(svg, frame, extents, look, mark, *place);
            look.mark(svg, *place);
        }
    }
    places.iter().filter(|place| place.is_none()).count()
}

fn has_marks(series: &Series) -> bool {
    matches!(series.stroke, LineStroke::Joined | LineStroke::Marks)
}

fn place(frame: &Frame, [x, y]: [&Extent; 2], mark: &Mark) -> Option<[f64; 2]> {
    Some(frame.pixel([x.place(mark.x.median)?, y.place(mark.y.median)?]))
}

/// From the 10th to the 90th percentile, where they are apart: a line with a short stroke across
/// each end.
fn draw_bars(
    svg: &mut Svg,
    frame: &Frame,
    [x, y]: [&Extent; 2],
    look: Look,
    mark: &Mark,
    place: [f64; 2],
) {
    let style = look.bar();
    for (axis, (extent, spread)) in [(x, mark.x), (y, mark.y)].into_iter().enumerate() {
        let Some(ends) = extent.place(spread.p10).zip(extent.place(spread.p90)) else {
            continue;
        };
        let (mut from, mut to, mut across) = (place, place, [3.0; 2]);
        (from[axis], to[axis], across[axis]) = (
            frame.pixel([ends.0; 2])[axis],
            frame.pixel([ends.1; 2])[axis],
            0.0,
        );
        if (from[axis] - to[axis]).abs() < 1.0 {
            continue;
        }
        svg.line(from, to, &style);
        for [x, y] in [from, to] {
            svg.line(
                [x - across[0], y - across[1]],
                [x + across[0], y + across[1]],
                &style,
            );
        }
    }
}

fn draw_legend(
    svg: &mut Svg,
    (series, looks): (&[Series], &Looks),
    corner: [f64; 2],
    columns: usize,
) {
    let width = (WIDTH - LEFT) / columns as f64;
    for (index, series) in series.iter().enumerate() {
        let look = looks.look(&series.name);
        let (column, line) = (index % columns, index / columns);
        let [x, y] = [
            corner[0] + column as f64 * width,
            corner[1] + line as f64 * LINE,
        ];
        let style = if series.stroke == LineStroke::Dashed {
            look.dashed()
        } else {
            look.line()
        };
        if series.stroke != LineStroke::Marks {
            svg.line([x, y], [x + SAMPLE - 8.0, y], &style);
        }
        if has_marks(series) {
            look.mark(svg, [x + 0.5 * (SAMPLE - 8.0), y]);
        }
        svg.text(
            [x + SAMPLE, y + 4.5],
            "start",
            "font-size=\"12.5\"",
            &series.name,
        );
    }
}
