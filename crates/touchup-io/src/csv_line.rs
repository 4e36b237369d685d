//! Lines of comma-separated values that spreadsheets open.

/// One line without its end; a value with a comma, a quotation mark or a line end is quoted (RFC
/// 4180).
pub(crate) fn csv_line<'a>(values: impl Iterator<Item = &'a str>) -> String {
    let quoted = |value: &str| match value.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", value.replace('"', "\"\"")),
        false => value.to_owned(),
    };
    values.map(quoted).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_break_a_line_is_quoted() {
        assert_eq!(
            csv_line(["a", "b, c", "d \"e\"", ""].into_iter()),
            "a,\"b, c\",\"d \"\"e\"\"\","
        );
    }
}
