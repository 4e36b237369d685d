//! Figures as SVG, on white.

mod curves;
mod element;
mod extent;
mod frame;
mod looks;
mod maps;

use maud::{Markup, html};

use element::{px, text_width};
pub use frame::ChartSize;
pub use looks::Looks;

use crate::figure::{Drawing, Figure};

/// Font size of the provenance.
const SMALL: f64 = 10.5;

impl Figure {
    /// The figure as a stand-alone picture.
    ///
    /// - `looks`: looks of its series.
    /// - `provenance`: small print below it.
    pub fn svg(&self, looks: &Looks, size: ChartSize, provenance: &str) -> Markup {
        let (drawing, bottom) = match &self.drawing {
            Drawing::Curves(series) => curves::draw(self, series, looks, size),
            Drawing::Maps { share_of, panels } => maps::draw(self, share_of, panels, size.width),
        };
        let lines = lines_of(provenance, SMALL, size.width - 28.0);
        let line_at = |line: usize| bottom + 20.0 + 14.0 * line as f64;
        let height = lines
            .len()
            .checked_sub(1)
            .map_or(bottom, |last| line_at(last) + 10.0);
        let [width, height] = [size.width, height].map(px);
        html! {
            svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (width) " " (height) }
                width=(width) height=(height) role="img" font-size="13" fill="#222"
                font-family="system-ui, 'DejaVu Sans', Arial, sans-serif" {
                title { (self.title) }
                rect width=(width) height=(height) fill="#fff" {}
                @if size.is_labelled {
                    text x="14" y="22" font-size="15" font-weight="600" { (self.title) }
                }
                (drawing)
                @for (at, line) in lines.iter().enumerate() {
                    text x="14" y=(px(line_at(at))) font-size=(SMALL) fill="#666" { (line) }
                }
            }
        }
    }
}

/// Breaks a text into lines no wider than `width`, unless a single word is wider.
fn lines_of(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), size) <= width => {
                *line += &format!(" {word}")
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
