//! Mappings by indentation: one key per line.

use std::ops::Range;

use super::flow;

/// Beginning of a remark of this program; a new remark replaces an old one.
pub(super) const MARK: &str = "# touchup calibrate";

/// Spaces per level.
const STEP: usize = 2;

/// The text with `path` set to `value`; the line of the key ends with `remark`, unless it has
/// another comment.
pub(super) fn set(text: &str, path: &[&str], value: &str, remark: &str) -> Option<String> {
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let whole = 0..lines
        .iter()
        .position(|line| line.trim_end() == "...")
        .unwrap_or(lines.len());
    let indent = whole
        .clone()
        .map(|at| lines[at])
        .find(|line| is_content(line))
        .map_or(0, indent_of);
    set_in(&lines, whole, indent, path, value, remark)
}

/// Sets the value in the mapping of the lines of `range`, with keys at `indent`.
fn set_in(
    lines: &[&str],
    range: Range<usize>,
    indent: usize,
    path: &[&str],
    value: &str,
    remark: &str,
) -> Option<String> {
    let (first, rest) = path.split_first()?;
    let Some(key_line) = range
        .clone()
        .find(|&at| key_end(lines[at], indent, first).is_some())
    else {
        return Some(with_key(lines, range, indent, path, value, remark));
    };
    let behind = key_end(lines[key_line], indent, first)?;
    let body = key_line + 1..body_end(lines, key_line + 1..range.end, indent);
    let (inline, comment) = split_comment(&lines[key_line][behind..]);
    if rest.is_empty() {
        let kept: String = body
            .clone()
            .map(|at| lines[at])
            .filter(|line| !is_content(line))
            .collect();
        let is_free = comment.is_empty() || comment.starts_with(MARK);
        let comment = if is_free {
            remark.to_owned()
        } else {
            format!("  {comment}")
        };
        let line = format!("{} {value}{comment}\n", &lines[key_line][..behind]);
        return Some(lines[..key_line].concat() + &line + &kept + &lines[body.end..].concat());
    }
    if inline.starts_with('{') {
        let before: usize = lines[..key_line].iter().map(|line| line.len()).sum();
        let brace = lines[key_line][behind..].find('{')?;
        return flow::set(&lines.concat(), before + behind + brace, rest, value);
    }
    match inline {
        "" => {
            let inner = body
                .clone()
                .map(|at| lines[at])
                .find(|line| is_content(line))
                .map(indent_of);
            set_in(
                lines,
                body,
                inner.unwrap_or(indent + STEP),
                rest,
                value,
                remark,
            )
        }
        "~" | "null" | "off" => {
            let line = lines[key_line].replacen(inline, "", 1);
            let mut lines = lines.to_vec();
            lines[key_line] = &line;
            set_in(&lines, body, indent + STEP, rest, value, remark)
        }
        _ => None,
    }
}

/// The text with a new key in the mapping of the lines of `range`.
fn with_key(
    lines: &[&str],
    range: Range<usize>,
    indent: usize,
    path: &[&str],
    value: &str,
    remark: &str,
) -> String {
    let is_root = range.start == 0 && indent == 0 && range.end == lines.len();
    let at = if is_root {
        lines.len()
    } else {
        end_of(lines, range, indent)
    };
    let new = new_lines(indent, path, value, remark, is_root && at > 0);
    inserted(lines, at, &new)
}

/// Line for a new key of the mapping in `range`: after its last line, including comments at the
/// indentation of its keys.
fn end_of(lines: &[&str], range: Range<usize>, indent: usize) -> usize {
    let is_part = |at: &usize| !lines[*at].trim().is_empty() && indent_of(lines[*at]) >= indent;
    range
        .clone()
        .rev()
        .find(is_part)
        .map_or(range.start, |at| at + 1)
}

/// Line after the value of a key: deeper lines, and list items at its own depth. Comments and empty
/// lines at the end belong to the next key, unless they are deeper.
fn body_end(lines: &[&str], range: Range<usize>, indent: usize) -> usize {
    let is_item = |line: &str| indent_of(line) == indent && line.trim_start().starts_with('-');
    let is_inside = |line: &str| indent_of(line) > indent || is_item(line);
    let next = range
        .clone()
        .find(|&at| is_content(lines[at]) && !is_inside(lines[at]))
        .unwrap_or(range.end);
    let is_part = |at: &usize| !lines[*at].trim().is_empty() && is_inside(lines[*at]);
    (range.start..next)
        .rev()
        .find(is_part)
        .map_or(range.start, |at| at + 1)
}

fn new_lines(indent: usize, path: &[&str], value: &str, remark: &str, gap: bool) -> String {
    let mut text = if gap { "\n".to_owned() } else { String::new() };
    for (depth, key) in path.iter().enumerate() {
        let is_last = depth + 1 == path.len();
        let rest = if is_last {
            format!(" {value}{remark}")
        } else {
            String::new()
        };
        text += &format!("{:width$}{key}:{rest}\n", "", width = indent + STEP * depth);
    }
    text
}

fn inserted(lines: &[&str], at: usize, new: &str) -> String {
    let before = lines[..at].concat();
    let end = if before.is_empty() || before.ends_with('\n') {
        ""
    } else {
        "\n"
    };
    before + end + new + &lines[at..].concat()
}

/// Position after the colon, if the line holds `key` at this depth.
fn key_end(line: &str, indent: usize, key: &str) -> Option<usize> {
    if indent_of(line) != indent {
        return None;
    }
    let quoted = [key.to_owned(), format!("\"{key}\""), format!("'{key}'")];
    let written = quoted
        .iter()
        .find(|written| line[indent..].starts_with(written.as_str()))?;
    let rest = &line[indent + written.len()..];
    let colon = rest.len() - rest.trim_start_matches(' ').len();
    let after = rest[colon..].strip_prefix(':')?;
    (after.is_empty() || after.starts_with(char::is_whitespace))
        .then_some(indent + written.len() + colon + 1)
}

/// Value and comment after a colon; a `#` in quotes begins no comment.
fn split_comment(text: &str) -> (&str, &str) {
    let (mut quote, mut before) = (None, ' ');
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '#') if before.is_whitespace() => {
                return (text[..at].trim(), text[at..].trim_end());
            }
            _ => {}
        }
        before = c;
    }
    (text.trim(), "")
}

/// Whether the line is neither empty nor a comment nor a document mark.
fn is_content(line: &str) -> bool {
    let text = line.trim();
    !text.is_empty() && !text.starts_with(['#', '%']) && text != "---"
}

fn indent_of(line: &str) -> usize {
    line.len() - line.trim_start_matches(' ').len()
}
