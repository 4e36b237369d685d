//! Elements of SVG as text: text is escaped, and all coordinates are finite.

use std::fmt::Write;

/// A picture that grows element by element.
#[derive(Default)]
pub(super) struct Svg(String);

impl Svg {
    /// A straight line; `style`: further attributes, as they are.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], style: &str) {
        let ([x1, y1], [x2, y2]) = (from.map(number), to.map(number));
        self.push(format_args!(
            "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" {style}/>"
        ));
    }

    /// A line through several points.
    pub fn polyline(&mut self, points: &[[f64; 2]], style: &str) {
        self.push(format_args!(
            "<polyline points=\"{}\" fill=\"none\" {style}/>",
            joined(points)
        ));
    }

    /// A closed shape.
    pub fn polygon(&mut self, points: &[[f64; 2]], style: &str) {
        self.push(format_args!(
            "<polygon points=\"{}\" {style}/>",
            joined(points)
        ));
    }

    pub fn circle(&mut self, centre: [f64; 2], radius: f64, style: &str) {
        let ([x, y], r) = (centre.map(number), number(radius));
        self.push(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" {style}/>"
        ));
    }

    /// A rectangle from its upper left corner; `title` shows when it is pointed at, unless it is
    /// empty.
    pub fn rectangle(&mut self, corner: [f64; 2], size: [f64; 2], style: &str, title: &str) {
        let ([x, y], [width, height]) = (
            corner.map(number),
            size.map(|length| number(length.max(0.0))),
        );
        let element =
            format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" {style}");
        if title.is_empty() {
            self.push(format_args!("{element}/>"));
        } else {
            self.push(format_args!(
                "{element}><title>{}</title></rect>",
                escaped(title)
            ));
        }
    }

    /// A text whose `start`, `middle` or `end` (`anchor`) is at a place.
    pub fn text(&mut self, at: [f64; 2], anchor: &str, style: &str, text: &str) {
        let ([x, y], text) = (at.map(number), escaped(text));
        self.push(format_args!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" {style}>{text}</text>"
        ));
    }

    /// A text that is read from below.
    pub fn upward_text(&mut self, at: [f64; 2], text: &str) {
        let ([x, y], text) = (at.map(number), escaped(text));
        self.push(format_args!(
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" transform=\"rotate(-90 {x} {y})\">{text}</text>"
        ));
    }

    /// The whole picture, `size` wide and high, that names itself by `title`.
    pub fn finish(self, size: [f64; 2], title: &str) -> String {
        let ([width, height], title) = (size.map(number), escaped(title));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\" font-family=\"system-ui, 'DejaVu Sans', Arial, sans-serif\" \
             font-size=\"13\" fill=\"#222\">\n<title>{title}</title>\n<rect width=\"{width}\" height=\"{height}\" \
             fill=\"#fff\"/>\n{}</svg>\n",
            self.0
        )
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        // a string takes whatever is written into it
        let _ = writeln!(self.0, "{element}");
    }
}

/// Text as XML and HTML hold it; control characters, which XML does not know, are left out.
pub(crate) fn escaped(text: &str) -> String {
    let text = text
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;");
    text.replace(char::is_control, " ")
}

/// A coordinate to a tenth of a pixel; 0 where it is none.
fn number(value: f64) -> String {
    let value = if value.is_finite() {
        (value * 10.0).round() / 10.0 + 0.0
    } else {
        0.0
    };
    format!("{value}")
}

fn joined(points: &[[f64; 2]]) -> String {
    points
        .iter()
        .map(|point| point.map(number).join(","))
        .collect::<Vec<_>>()
        .join(" ")
}
