//! Figures as SVG, on white, 900 pixels wide.

mod axis;
mod curves;
mod frame;
mod maps;
mod style;
mod writer;

use frame::WIDTH;
pub(super) use style::Looks;
use style::text_width;
use writer::Svg;
pub(super) use writer::escaped;

use super::figure::{Drawing, Figure};

/// Size of the letters that say where it was measured.
const SMALL: f64 = 10.5;
/// The figure as a picture of its own. `provenance`, in small letters below it: where and by what
/// it was measured.
///
/// - `looks`: of its series.
pub(super) fn svg(figure: &Figure, looks: &Looks, provenance: &str) -> String {
    let mut svg = Svg::default();
    svg.text(
        [14.0, 22.0],
        "start",
        "font-size=\"15\" font-weight=\"600\"",
        &figure.title,
    );
    let bottom = match &figure.drawing {
        Drawing::Curves(series) => curves::draw(&mut svg, figure, series, looks),
        Drawing::Maps { share_of, panels } => maps::draw(&mut svg, figure, share_of, panels),
    };
    let mut y = bottom + 20.0;
    for line in lines_of(provenance, SMALL, WIDTH - 28.0) {
        svg.text(
            [14.0, y],
            "start",
            &format!("font-size=\"{SMALL}\" fill=\"#666\""),
            &line,
        );
        y += 14.0;
    }
    svg.finish([WIDTH, y - 4.0], &figure.title)
}

/// Parted between words so that no line is wider than `width`, as far as words allow.
fn lines_of(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if text_width(&format!("{line} {word}"), size) <= width => {
                *line += &format!(" {word}")
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
