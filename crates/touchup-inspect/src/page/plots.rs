//! Charts of touches: their residuals, and the force of an arm.

use maud::Markup;
use touchup_document::figure::{Axis, Figure, LineStroke, Mark, Series, Spread};
use touchup_document::number::range;
use touchup_document::{ChartSize, Looks};

use crate::evidence::TouchEvidence;
use touchup_io::probed_touches_file::TouchLine;

/// Most curves in one chart.
const MOST_CURVES: usize = 24;

fn chart(title: &str, [x, y]: [Axis; 2], series: impl IntoIterator<Item = Series>) -> Markup {
    let figure = Figure::curves("touches", series).title(title).axes(x, y);
    figure.svg(&Looks::default(), ChartSize::SMALL, "")
}

/// Distance of the touches from the ideal surface, µm.
pub(super) fn residual_plot(evidence: &TouchEvidence) -> Markup {
    let offs = evidence.drawn.iter().map(|[_, off]| (off * 1e3).abs());
    let most = offs.fold(2e3 * evidence.stated_mm, f64::max).max(1.0);
    let step = 10f64.powf(most.log10().floor());
    let reach = (most / step).ceil() * step;
    let (from, to) = range(evidence.drawn.iter().map(|[along, _]| *along)).unwrap_or_default();
    let ends = match evidence.along.contains('°') {
        true => [-180.0, 180.0],
        false if to > from => [from, to],
        false => [from, from + 1.0],
    };
    let stated = (2e3 * evidence.stated_mm).min(reach);
    let stated = Spread::from([0.0, -stated, stated]);
    let touches = evidence.drawn.iter();
    let touches = touches.map(|[along, off]| Mark::at(*along, off * 1e3));
    let stated = ends.map(|x| Mark::at(x, stated));
    let axes = [
        Axis::linear(evidence.along, "along").within(ends),
        Axis::linear("off, µm", "off_um").within([-reach, reach]),
    ];
    let series = [
        Series::new("stated", LineStroke::Band, stated),
        Series::new("touches", LineStroke::Dots, touches),
    ];
    chart("touches off the fitted surface", axes, series)
}

/// Force along the approach against travel, for accepted touches; `None` without a curve.
pub(super) fn force_plot(touches: &[&TouchLine]) -> Option<Markup> {
    let is_drawn = |touch: &&&TouchLine| touch.accepted && touch.curve.len() > 1;
    // zero at the deepest travel: all touches are in contact there
    let curve = |touch: &&TouchLine| {
        let travels = touch.curve.iter().map(|[_, travel, ..]| *travel);
        let deepest = travels.fold(f64::NEG_INFINITY, f64::max);
        let marks = touch.curve.iter();
        let marks = marks.map(|[_, travel, force, _]| Mark::at(travel - deepest, *force));
        Series::new("force", LineStroke::Course, marks)
    };
    let drawn = touches.iter().filter(is_drawn).take(MOST_CURVES);
    let curves: Vec<_> = drawn.map(curve).collect();
    let marks = || curves.iter().flat_map(|curve| &curve.marks);
    let (from, _) = range(marks().map(|mark| mark.x.median))?;
    let (least, most) = range(marks().map(|mark| mark.y.median).chain([0.0, 0.5]))?;
    let axes = [
        Axis::linear("travel from the deepest point, mm", "travel_mm")
            .within([from.min(-0.1), 0.0]),
        Axis::linear("force, N", "force_n").within([least, most]),
    ];
    Some(chart("force over travel", axes, curves))
}
