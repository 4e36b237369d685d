//! HTML documents.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

/// A whole document.
///
/// - `style`: its style sheet, verbatim.
pub fn document(title: &str, style: &str, body: &Markup) -> String {
    printable(&html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(style)) }
            }
            body { (body) }
        }
    })
}

/// Markup as text, with a blank for each control character: HTML and XML allow none.
pub fn printable(markup: &Markup) -> String {
    let is_refused = |letter: char| letter.is_control() && letter != '\n';
    markup.0.replace(is_refused, " ")
}

/// A table with a head that printers repeat.
///
/// - `rows`: the cells of each row, with their tags.
pub fn table<H: Render>(
    class: &str,
    heads: impl IntoIterator<Item = H>,
    rows: impl IntoIterator<Item = Markup>,
) -> Markup {
    html! {
        table class=(class) {
            thead { tr { @for head in heads { th scope="col" { (head) } } } }
            tbody { @for row in rows { tr { (row) } } }
        }
    }
}

/// The bytes of a PNG file as a data URL (RFC 2397).
pub fn picture_address(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png))
}

/// A text as a CSS string that can end neither the string nor the style.
pub fn css_string(text: &str) -> String {
    let letter = |letter: char| match letter {
        letter if letter.is_ascii_alphanumeric() || letter == ' ' => letter.to_string(),
        control if control.is_control() => " ".to_owned(),
        other => format!("\\{:x} ", other as u32),
    };
    format!("\"{}\"", text.chars().map(letter).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_name_stays_text() {
        let page = document("<b>&\"\u{7}", "", &html! { p title="a\"b" { "<i>" } });
        assert!(page.contains("<title>&lt;b&gt;&amp;&quot; </title>"));
        assert!(page.contains("<p title=\"a&quot;b\">&lt;i&gt;</p>"));
        assert_eq!(
            css_string("a\"</style>\n"),
            "\"a\\22 \\3c \\2f style\\3e  \""
        );
    }
}
