//! Text within HTML.

/// A text as HTML shows it, also within quoted attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => html += "&amp;",
            '<' => html += "&lt;",
            '>' => html += "&gt;",
            '"' => html += "&quot;",
            '\'' => html += "&#39;",
            // HTML has no place for them
            control if control.is_control() && !control.is_whitespace() => html.push('\u{fffd}'),
            other => html.push(other),
        }
    }
    html
}

/// A text as a string of CSS, which can end neither the string nor the style.
pub(crate) fn css_string(text: &str) -> String {
    let letter = |letter: char| match letter {
        letter if letter.is_ascii_alphanumeric() || letter == ' ' => letter.to_string(),
        control if control.is_control() => " ".to_owned(),
        other => format!("\\{:x} ", other as u32),
    };
    format!("\"{}\"", text.chars().map(letter).collect::<String>())
}

/// Bytes in letters, as an address of data has them (RFC 4648, 4).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |at: usize| u32::from(chunk.get(at).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for at in 0..4 {
            let sextet = bits >> (18 - 6 * at) & 63;
            text.push(if at > chunk.len() {
                '='
            } else {
                LETTERS[sextet as usize] as char
            });
        }
    }
    text
}

/// A table with a head that printers repeat.
///
/// - `rows`: cells that are HTML already.
pub(crate) fn table(class: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| {
        cells
            .map(|cell| format!("<{tag}>{cell}</{tag}>"))
            .collect::<String>()
    };
    let body: String = rows
        .iter()
        .map(|row| {
            format!(
                "<tr>{}</tr>\n",
                cells("td", &mut row.iter().map(String::as_str))
            )
        })
        .collect();
    let head: String = head
        .iter()
        .map(|cell| format!("<th scope=\"col\">{cell}</th>"))
        .collect();
    format!(
        "<table class=\"{class}\">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_a_name_stays_text() {
        assert_eq!(escaped("<b>&\"'\u{7}"), "&lt;b&gt;&amp;&quot;&#39;\u{fffd}");
        assert_eq!(
            css_string("a\"</style>\n"),
            "\"a\\22 \\3c \\2f style\\3e  \""
        );
    }

    /// The examples of RFC 4648, 10.
    #[test]
    fn base64_has_the_examples_of_its_standard() {
        for (text, expected) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), expected);
        }
    }
}
