//! SVG elements, with coordinates to a tenth.

use maud::{Markup, html};

/// Width of a text, slightly overestimated.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    0.58 * size * text.chars().count() as f64
}

/// A coordinate to a tenth; 0 if it is not finite.
pub(super) fn px(value: f64) -> String {
    let value = if value.is_finite() { value } else { 0.0 };
    ((value * 10.0).round() / 10.0 + 0.0).to_string()
}

/// Points in the attribute syntax of lines and polygons.
pub(super) fn points(places: impl IntoIterator<Item = [f64; 2]>) -> String {
    let places = places.into_iter().map(|place| place.map(px).join(","));
    places.collect::<Vec<_>>().join(" ")
}

/// A text with its `start`, `middle` or `end` (`anchor`) at a place.
pub(super) fn label(at: [f64; 2], anchor: &str, size: f64, text: &str) -> Markup {
    let [x, y] = at.map(px);
    html! { text x=(x) y=(y) text-anchor=(anchor) font-size=(size) { (text) } }
}

/// A text that reads upward.
pub(super) fn upward_label(at: [f64; 2], text: &str) -> Markup {
    let [x, y] = at.map(px);
    html! {
        text x=(x) y=(y) text-anchor="middle" transform={ "rotate(-90 " (x) " " (y) ")" } { (text) }
    }
}
