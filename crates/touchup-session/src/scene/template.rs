//! Texts from the definition of the parameters: the scene with every key explained, and the table
//! of all keys.

use touchup_method::parameters::{Parameter, Section};

use super::Scene;

const HEAD: &str = "\
# The scene that `touchup refine` uses without --scene. Copy it, change the values that differ, and give it by --scene.
# Keys that are left out keep the values here. The word off leaves out a part, as in `patch: off`.
# A line that begins with #key is a setting that is off here. Flags override the scene.
# Written from the definition of the parameters, like docs/scene.md, which has their ranges.
";

const TABLE_HEAD: &str = "\
# The scene

All keys of the YAML that `--scene` names, written from the definition of the parameters, like
[`config/default.yaml`](../config/default.yaml). A scene lists differences only: keys that are left out keep their defaults, and the word `off`
leaves out a part, as in `patch: off`. The name of a part that is off in the default scene turns it on, with its defaults if it has no keys. An
error names the key of a number outside its range, and the line and column of an unknown key.
";

/// Maximum number of letters in a line of comment.
const WIDTH: usize = 118;
/// Spaces per level.
const STEP: usize = 2;

impl Scene {
    /// [`Scene::default`] as YAML, with every key explained; inactive keys are comments.
    pub fn template() -> String {
        Self::parameters()
            .iter()
            .fold(HEAD.to_owned(), |text, section| {
                text + "\n" + &explained(section, 0, false)
            })
    }

    /// The template without the radius of the ball, which the user has yet to give.
    pub fn template_without_radius() -> String {
        Self::template().replace("\n  radius_mm: ", "\n  #radius_mm: ")
    }

    /// Every key with unit, range and default, as Markdown.
    pub fn table() -> String {
        Self::parameters()
            .iter()
            .fold(TABLE_HEAD.to_owned(), |text, section| text + &rows(section))
    }
}

/// A key with its comment and its inner keys.
fn explained(parameter: &Parameter, indent: usize, is_off: bool) -> String {
    let Parameter {
        key,
        default,
        example,
        inner,
        ..
    } = parameter;
    let (mark, space) = (if is_off { "#" } else { "" }, " ".repeat(indent));
    let comment = wrapped(&with_words(parameter), WIDTH - indent);
    let mut text: String = comment
        .iter()
        .map(|line| format!("{mark}{space}# {line}\n"))
        .collect();
    let own_mark = if !is_off && default.is_none() {
        "#"
    } else {
        ""
    };
    let value = default.as_deref().unwrap_or(example);
    text += format!("{mark}{space}{own_mark}{key}: {value}").trim_end();
    text += "\n";
    let is_off = is_off || default.is_none();
    let inner_of = |indent: usize| {
        let below = inner.iter().map(|below| explained(below, indent, is_off));
        below.collect::<String>()
    };
    if !parameter.is_list {
        return text + &inner_of(indent + STEP);
    }
    // the first key of the first section begins the list
    let (space, first) = (
        " ".repeat(indent + STEP),
        inner.first().map_or("", |first| first.key),
    );
    text + &inner_of(indent + 2 * STEP).replacen(
        &format!("{space}  {first}:"),
        &format!("{space}- {first}:"),
        1,
    )
}

/// The summary of a key, with its allowed words.
fn with_words(parameter: &Parameter) -> String {
    let summary = parameter.summary();
    if parameter.words.is_empty() {
        return summary;
    }
    format!(
        "{} ({}).",
        summary.trim_end_matches('.'),
        parameter.words.join(", ")
    )
}

/// Wraps a text at `width` letters.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                *line += &format!(" {word}")
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A section as a table, then its inner sections.
fn rows(section: &Parameter) -> String {
    let built = match (&section.default, section.is_list) {
        (Some(_), _) => "",
        (None, true) => " A list; empty in the default scene.",
        (None, false) => " Off in the default scene.",
    };
    let mut text = format!(
        "\n## `{}`\n\n{}{built}\n",
        section.name(),
        section.summary()
    );
    let keys: Vec<_> = section.inner.iter().filter(|one| !one.is_section).collect();
    if !keys.is_empty() {
        text += "\n| key | unit | range | default | meaning |\n|---|---|---|---|---|\n";
    }
    for one in keys {
        let default = one.default.as_deref().unwrap_or("left out");
        let [symbol, allowed, what] = [one.unit.symbol, &one.allowed(), &one.summary()];
        text += &format!(
            "| `{}` | {symbol} | {allowed} | {default} | {what} |\n",
            one.key
        );
    }
    section
        .inner
        .iter()
        .filter(|one| one.is_section)
        .fold(text, |text, inner| text + &rows(inner))
}
