//! Curves and marks in one frame, with a legend beside or below it.

use maud::{Markup, html};

use super::element::{label, points, px, text_width, upward_label};
use super::extent::AxisExtent;
use super::frame::{ChartSize, Frame};
use super::looks::Looks;
use crate::figure::{Figure, LineStroke, Mark, Series};

/// Widest lines of a legend beside the frame.
const WIDEST_BESIDE: f64 = 230.0 + SAMPLE;
/// Width of the line and mark sample in front of a name.
const SAMPLE: f64 = 34.0;
/// Line spacing of the legend.
const LINE: f64 = 21.0;

/// Layout of a figure.
struct Layout {
    frame: Frame,
    /// middle of the first sample line of the legend
    legend: [f64; 2],
    /// columns of the legend
    columns: usize,
    /// lower edge
    bottom: f64,
}

impl Layout {
    fn of(series: &[Series], y: &AxisExtent, size: ChartSize) -> Self {
        let ticks = y.ticks();
        let number = widest(ticks.iter().map(|tick| tick.label.as_str()), 12.0);
        let name = widest(series.iter().map(|one| one.name.as_str()), 12.5) + SAMPLE;
        let fits_beside = name <= WIDEST_BESIDE && series.len() as f64 * LINE <= size.height;
        let ([left, top], right, below) = match size.is_labelled {
            true if fits_beside => ([82.0, 38.0], name + 24.0, 50.0),
            true => ([82.0, 38.0], 24.0, 50.0),
            false => ([number + 28.0, 8.0], 14.0, 42.0),
        };
        let frame = Frame::new([left, top], [size.width - left - right, size.height]);
        let bottom = frame.bottom() + below;
        if fits_beside || !size.is_labelled {
            let legend = [frame.right() + 14.0, top + 12.0];
            return Self {
                frame,
                legend,
                columns: 1,
                bottom,
            };
        }
        let columns = (((size.width - left) / (name + 20.0)) as usize).max(1);
        let legend = [left, bottom + 12.0];
        let bottom = bottom + series.len().div_ceil(columns) as f64 * LINE;
        Self {
            frame,
            legend,
            columns,
            bottom,
        }
    }
}

fn widest<'a>(texts: impl Iterator<Item = &'a str>, letters: f64) -> f64 {
    texts
        .map(|text| text_width(text, letters))
        .fold(0.0, f64::max)
}

/// The drawing, and its lower edge.
pub(super) fn draw(
    figure: &Figure,
    series: &[Series],
    looks: &Looks,
    size: ChartSize,
) -> (Markup, f64) {
    let marks = || series.iter().flat_map(|series| &series.marks);
    let x = AxisExtent::around(&figure.x, marks().flat_map(|mark| mark.x.numbers()));
    let y = AxisExtent::around(&figure.y, marks().flat_map(|mark| mark.y.numbers()));
    let Layout {
        frame,
        legend: corner,
        columns,
        bottom,
    } = Layout::of(series, &y, size);
    let (name_left, name_below) = if size.is_labelled {
        (56.0, 38.0)
    } else {
        (frame.left - 13.0, 36.0)
    };
    let [middle, centre] = frame.place([0.5, 0.5]);
    let hidden = marks()
        .filter(|mark| place(&frame, [&x, &y], mark).is_none())
        .count();
    let is_band = |one: &&Series| one.stroke == LineStroke::Band;
    let drawing = html! {
        @for one in series.iter().filter(is_band) { (band(&frame, [&x, &y], one)) }
        (frame.grid(&x, &y))
        (label([middle, frame.bottom() + name_below], "middle", 13.0, &figure.x.label))
        (upward_label([frame.left - name_left, centre], &figure.y.label))
        @for one in series { (draw_series(&frame, [&x, &y], looks, one)) }
        (frame.border())
        @if size.is_labelled { (legend(series, looks, corner, (size.width - frame.left, columns))) }
        @if hidden > 0 {
            text x=(px(frame.left)) y=(px(bottom + 14.0)) font-size="11.5" fill="#a33" {
                (hidden) " marks are not shown: they have no place on these axes (0, or not finite)"
            }
        }
    };
    (drawing, if hidden > 0 { bottom + 18.0 } else { bottom })
}

fn place(frame: &Frame, [x, y]: [&AxisExtent; 2], mark: &Mark) -> Option<[f64; 2]> {
    Some(frame.place([x.place(mark.x.median)?, y.place(mark.y.median)?]))
}

fn draw_series(frame: &Frame, extents: [&AxisExtent; 2], looks: &Looks, series: &Series) -> Markup {
    let look = looks.look(&series.name);
    let places = series.marks.iter().map(|mark| place(frame, extents, mark));
    let places: Vec<Option<[f64; 2]>> = places.collect();
    // a mark without a place splits the line
    let stretches = places
        .split(Option::is_none)
        .filter(|stretch| stretch.len() > 1);
    let has_bars = matches!(series.stroke, LineStroke::Joined | LineStroke::Marks);
    html! {
        @for stretch in stretches {
            (look.line(series.stroke, &points(stretch.iter().flatten().copied())))
        }
        @for (mark, place) in series.marks.iter().zip(&places) {
            @if let Some(place) = place {
                @for bar in bars(frame, extents, mark, *place).iter().filter(|_| has_bars) {
                    path d=(bar) fill="none" stroke=(look.colour()) stroke-opacity="0.7" {}
                }
                (look.mark(series.stroke, *place))
            }
        }
    }
}

/// Bars from the 10th to the 90th percentile of both values, if the two differ: a line with a short
/// stroke across each end.
fn bars(
    frame: &Frame,
    [x, y]: [&AxisExtent; 2],
    mark: &Mark,
    [left, top]: [f64; 2],
) -> Vec<String> {
    let ends = |extent: &AxisExtent, axis: usize, [_, p10, p90]: [f64; 3]| {
        let ends = [extent.place(p10)?, extent.place(p90)?].map(|end| frame.place([end; 2])[axis]);
        ((ends[0] - ends[1]).abs() >= 1.0).then(|| ends.map(px))
    };
    let level = ends(x, 0, mark.x.numbers()).map(|[from, to]| {
        let (y, above) = (px(top), px(top - 3.0));
        format!("M{from} {y}H{to}M{from} {above}v6M{to} {above}v6")
    });
    let upward = ends(y, 1, mark.y.numbers()).map(|[from, to]| {
        let (x, before) = (px(left), px(left - 3.0));
        format!("M{x} {from}V{to}M{before} {from}h6M{before} {to}h6")
    });
    level.into_iter().chain(upward).collect()
}

fn band(frame: &Frame, [x, y]: [&AxisExtent; 2], series: &Series) -> Markup {
    let edge = |upward: fn(&Mark) -> f64| {
        let at =
            move |mark: &Mark| Some(frame.place([x.place(mark.x.median)?, y.place(upward(mark))?]));
        series.marks.iter().filter_map(at)
    };
    let lower: Vec<_> = edge(|mark| mark.y.p10).collect();
    let outline = edge(|mark| mark.y.p90).chain(lower.into_iter().rev());
    html! { polygon points=(points(outline)) fill="#e4ecf5" {} }
}

fn legend(
    series: &[Series],
    looks: &Looks,
    [left, top]: [f64; 2],
    (width, columns): (f64, usize),
) -> Markup {
    let lines = series.iter().enumerate().map(|(at, series)| {
        let x = left + (at % columns) as f64 * width / columns as f64;
        (x, top + (at / columns) as f64 * LINE, series)
    });
    html! {
        @for (x, y, series) in lines {
            (looks.look(&series.name).line(series.stroke, &points([[x, y], [x + SAMPLE - 8.0, y]])))
            (looks.look(&series.name).mark(series.stroke, [x + 0.5 * (SAMPLE - 8.0), y]))
            (label([x + SAMPLE, y + 4.5], "start", 12.5, &series.name))
        }
    }
}
