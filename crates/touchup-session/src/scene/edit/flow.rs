//! Mappings in braces: `{ key: value, … }`, over one line or several.

/// Start of the mapping, if the whole text is one mapping in braces.
pub(super) fn start(text: &str) -> Option<usize> {
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let content = line.trim_start();
        if !content.is_empty() && !content.starts_with(['#', '%']) && content.trim_end() != "---" {
            return content
                .starts_with('{')
                .then(|| at + line.len() - content.len());
        }
        at += line.len();
    }
    None
}

/// The text with `path` set to `value` in the mapping with its brace at `begin`.
pub(super) fn set(text: &str, begin: usize, path: &[&str], value: &str) -> Option<String> {
    let (first, rest) = path.split_first()?;
    let Mapping {
        entries,
        last,
        is_separated,
    } = Mapping::read(text, begin)?;
    let inner = rest.iter().rev().fold(value.to_owned(), |inner, key| {
        format!("{{ {key}: {inner} }}")
    });
    let Some(entry) = entries.iter().find(|entry| entry.key == *first) else {
        let separator = if is_separated { "" } else { "," };
        return Some(spliced(
            text,
            last,
            last,
            &format!("{separator} {first}: {inner}"),
        ));
    };
    let old = &text[entry.begin..entry.end];
    match old.trim_start() {
        "" | "~" | "null" | "off" => {
            Some(spliced(text, entry.begin, entry.end, &format!(" {inner}")))
        }
        _ if rest.is_empty() => Some(spliced(text, entry.begin, entry.end, &format!(" {inner}"))),
        old if old.starts_with('{') => set(text, entry.end - old.len(), rest, value),
        _ => None,
    }
}

fn spliced(text: &str, begin: usize, end: usize, new: &str) -> String {
    format!("{}{new}{}", &text[..begin], &text[end..])
}

/// A key, and the range of its value, up to its last character.
struct FlowEntry<'a> {
    key: &'a str,
    begin: usize,
    end: usize,
}

struct Mapping<'a> {
    entries: Vec<FlowEntry<'a>>,
    /// position after the last content that is no comment
    last: usize,
    /// whether a comma or the opening brace precedes
    is_separated: bool,
}

impl<'a> Mapping<'a> {
    /// Reads up to the closing brace; `None` without one.
    fn read(text: &'a str, begin: usize) -> Option<Self> {
        let mut mapping = Self {
            entries: Vec::new(),
            last: begin + 1,
            is_separated: true,
        };
        let (mut depth, mut quote, mut in_comment, mut before) = (0usize, None, false, ' ');
        let (mut from, mut colon) = (begin + 1, None);
        for (at, c) in text[begin..].char_indices().map(|(at, c)| (begin + at, c)) {
            let previous = std::mem::replace(&mut before, c);
            if in_comment {
                in_comment = c != '\n';
                continue;
            }
            match (quote, c) {
                (Some(open), _) => quote = if c == open { None } else { quote },
                (None, '"' | '\'') => quote = Some(c),
                (None, '#') if previous.is_whitespace() => {
                    in_comment = true;
                    continue;
                }
                (None, '{' | '[') => depth += 1,
                (None, ':') if depth == 1 => colon = colon.or(Some(at)),
                (None, ',' | '}') if depth == 1 => {
                    mapping
                        .entries
                        .extend(entry(text, from, colon.take(), mapping.last));
                    from = at + 1;
                    if c == '}' {
                        return Some(mapping);
                    }
                }
                (None, '}' | ']') => depth = depth.checked_sub(1)?,
                _ => {}
            }
            if !c.is_whitespace() {
                mapping.last = at + c.len_utf8();
                mapping.is_separated = at == begin || (c == ',' && depth == 1 && quote.is_none());
            }
        }
        None
    }
}

fn entry(text: &str, from: usize, colon: Option<usize>, end: usize) -> Option<FlowEntry<'_>> {
    let colon = colon?;
    let key = text[from..colon]
        .lines()
        .map(str::trim)
        .rfind(|line| !line.is_empty() && !line.starts_with('#'))?;
    Some(FlowEntry {
        key: key.trim_matches(['"', '\'']),
        begin: colon + 1,
        end: end.max(colon + 1),
    })
}
