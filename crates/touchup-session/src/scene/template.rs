//! Texts from the definition of the parameters: the scene with every key explained, and the table
//! of all keys.

use touchup_method::parameters::{Parameter, Section};

use super::Scene;

const HEAD: &str = "\
# The scene that `touchup refine` uses when none is given. Copy it, change what differs, and give it by --scene.
# What is not named is as it is here: leave out what does not differ. A part is not built where the scene says off, as in `patch: off`.
# A line that begins with #key is a setting that is off here. Flags override all.
# Written from the definition of the parameters, as docs/scene.md is, which has their ranges.
";

const TABLE_HEAD: &str = "\
# The scene

Every key of the YAML that `--scene` names, written from the definition of the parameters as
[`config/default.yaml`](../config/default.yaml) is. A scene says what differs: what is not named takes its default, and a part is not built
where the scene says `off`, as in `patch: off`. Parts that are off in the default scene are built where they are named; a name alone gives them
their defaults. A number outside its range is refused by its key, an unknown key with its line and column.
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
    inner.iter().fold(text, |text, below| {
        text + &explained(below, indent + STEP, is_off || default.is_none())
    })
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
    let built = if section.default.is_some() {
        ""
    } else {
        " Off in the default scene."
    };
    let mut text = format!(
        "\n## `{}`\n\n{}{built}\n",
        section.name(),
        section.summary()
    );
    let keys: Vec<_> = section.inner.iter().filter(|one| !one.is_section).collect();
    if !keys.is_empty() {
        text += "\n| key | unit | range | default | what |\n|---|---|---|---|---|\n";
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
