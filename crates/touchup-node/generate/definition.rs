//! Reads definitions of messages as ROS 2 has them: the lines of `.msg`, `.srv` and `.action`
//! files.
//!
//! A comment belongs to the lines below it up to an empty one; of constants to the next line alone.
//! The first comment of a file that an empty line follows is that of the whole file.

use std::mem::{replace, take};

/// A message: all of a `.msg`, or a part of a `.srv` or `.action`.
#[derive(Debug, Default, PartialEq)]
pub struct Message {
    /// of the file
    pub package: String,
    /// `msg`, `srv` or `action`
    pub kind: String,
    /// of the file
    pub file: String,
    /// `Request`, `Goal`, …; of a `.msg` empty
    pub part: &'static str,
    /// of the file, its paragraphs
    pub comment: Vec<String>,
    /// in the order of the file
    pub constants: Vec<Constant>,
    /// in the order of the wire
    pub fields: Vec<Field>,
}

/// A constant.
#[derive(Debug, PartialEq)]
pub struct Constant {
    /// its type
    pub item: String,
    /// in capitals
    pub name: String,
    /// in the spelling of the file
    pub value: String,
    /// of its own; empty if it has none
    pub comment: String,
    /// index of the field below it, of which this is a value
    pub of: usize,
}

/// A field.
#[derive(Debug, PartialEq)]
pub struct Field {
    /// type of one: a basic one, or package and name
    pub item: String,
    /// number of its elements
    pub length: Length,
    /// in snake_case
    pub name: String,
    /// default value in the definition; `None` without one
    pub default: Option<String>,
    /// with the largest length, if there is one
    pub comment: String,
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// it is no list
    One,
    /// the message says how many
    Any,
    /// always as many
    Fixed(usize),
}

/// Types without a definition, with their Rust types.
pub const BASIC: [(&str, &str); 14] = [
    ("bool", "bool"),
    ("byte", "u8"),
    ("char", "u8"),
    ("int8", "i8"),
    ("uint8", "u8"),
    ("int16", "i16"),
    ("uint16", "u16"),
    ("int32", "i32"),
    ("uint32", "u32"),
    ("int64", "i64"),
    ("uint64", "u64"),
    ("float32", "f32"),
    ("float64", "f64"),
    ("string", "String"),
];

/// The messages in a file: one in a `.msg`, two in a `.srv`, three in a `.action`.
pub fn parse(package: &str, path: &str, text: &str) -> Result<Vec<Message>, String> {
    let (file, kind) = path
        .rsplit('/')
        .next()
        .and_then(|name| name.split_once('.'))
        .unwrap_or((path, ""));
    let parts: &[&'static str] = match kind {
        "msg" => &[""],
        "srv" => &["Request", "Response"],
        "action" => &["Goal", "Result", "Feedback"],
        _ => {
            return Err(format!(
                "{path}: it ends in .{kind}, definitions end in .msg, .srv or .action"
            ));
        }
    };
    let texts: Vec<&str> = text.split("\n---\n").collect();
    if texts.len() != parts.len() {
        return Err(format!(
            "{path}: {} parts, a .{kind} has {}",
            texts.len(),
            parts.len()
        ));
    }
    let whole = |part| Message {
        package: package.into(),
        kind: kind.into(),
        file: file.into(),
        part,
        ..Message::default()
    };
    let read =
        |(part, text)| part_of(whole(part), text).map_err(|error| format!("{path}: {error}"));
    parts.iter().copied().zip(texts).map(read).collect()
}

fn part_of(mut message: Message, text: &str) -> Result<Message, String> {
    let mut comment = Comment::default();
    // the end of a part is as an empty line
    for line in text.lines().chain([""]).map(str::trim) {
        if let Some(more) = line.strip_prefix('#') {
            comment.add(more.trim());
            continue;
        }
        if line.is_empty() {
            let comment = take(&mut comment);
            if !comment.is_used && message.comment.is_empty() && message.fields.is_empty() {
                message.comment = comment.paragraphs;
            }
            continue;
        }
        let (code, behind) = line
            .split_once('#')
            .map_or((line, ""), |(code, behind)| (code.trim(), behind.trim()));
        let (item, rest) = code
            .split_once(' ')
            .ok_or_else(|| format!("\"{line}\" has a type and no name"))?;
        let own = if behind.is_empty() {
            comment.paragraphs.join(" ")
        } else {
            behind.to_owned()
        };
        let is_silent = behind.is_empty() && replace(&mut comment.is_used, true);
        match rest.split_once('=') {
            Some((name, value)) => message.constants.push(Constant {
                item: item.to_owned(),
                name: name.trim().to_owned(),
                value: value.trim().to_owned(),
                comment: if is_silent { String::new() } else { own },
                of: message.fields.len(),
            }),
            None => message
                .fields
                .push(field(&message.package, item, rest, own)?),
        }
    }
    Ok(message)
}

/// The lines of a comment, as paragraphs.
#[derive(Default)]
struct Comment {
    paragraphs: Vec<String>,
    /// a line below it has it: the next line of a comment begins another
    is_used: bool,
}

impl Comment {
    fn add(&mut self, line: &str) {
        if replace(&mut self.is_used, false) {
            self.paragraphs.clear();
        }
        match self.paragraphs.last_mut() {
            Some(paragraph) if paragraph.is_empty() => paragraph.push_str(line),
            Some(paragraph) if !line.is_empty() => *paragraph += &format!(" {line}"),
            _ => self.paragraphs.push(line.to_owned()),
        }
    }
}

fn field(package: &str, item: &str, rest: &str, mut comment: String) -> Result<Field, String> {
    let (name, default) = rest
        .split_once(' ')
        .map_or((rest, None), |(name, default)| {
            (name, Some(default.trim().into()))
        });
    let (item, count) = item
        .strip_suffix(']')
        .and_then(|item| item.split_once('['))
        .map_or((item, None), |(item, count)| (item, Some(count)));
    let (item, letters) = item
        .split_once("<=")
        .map_or((item, None), |(item, most)| (item, Some(most)));
    let most = count.and_then(|count| count.strip_prefix("<="));
    for (most, of) in [(most, "items"), (letters, "letters")] {
        if let Some(most) = most {
            comment += &format!("; at most {most} {of}");
        }
    }
    let length = match count {
        None => Length::One,
        Some(count) if count.is_empty() || most.is_some() => Length::Any,
        Some(count) => Length::Fixed(
            count
                .parse()
                .map_err(|_| format!("{name} has a length that is no number: {count}"))?,
        ),
    };
    let is_whole = item.contains('/') || BASIC.iter().any(|(basic, _)| *basic == item);
    let item = if is_whole {
        item.to_owned()
    } else {
        format!("{package}/{item}")
    };
    Ok(Field {
        item,
        length,
        name: name.to_owned(),
        default,
        comment,
    })
}
