//! Messages as Rust: structs, and the input of the macros in `src/ros/r2r`, which make conversions
//! and stand-ins.

use super::definition::{BASIC, Constant, Field, Length, Message};

/// Packages that r2r provides only with ROS sourced.
const STAND_INS: [&str; 2] = ["std_srvs", "touchup_msgs"];
/// The one byte of an empty message on the wire.
const EMPTY: &str = "structure_needs_at_least_one_member";

/// The structs, their constants and names.
pub fn structs(messages: &[Message]) -> Result<String, String> {
    messages
        .iter()
        .map(|message| structure(message, messages))
        .collect()
}

#[expect(clippy::too_many_lines)]
fn structure(message: &Message, all: &[Message]) -> Result<String, String> {
    let name = name(message);
    let fields: Result<String, String> = message
        .fields
        .iter()
        .map(|field| declared(field, all))
        .collect();
    let mut fields = fields?;
    if message.fields.is_empty() {
        fields = format!("    /// 0, means nothing\n    pub {EMPTY}: u8,\n");
    }
    let mut derived = vec![
        "Clone",
        "Debug",
        "PartialEq",
        "serde::Serialize",
        "serde::Deserialize",
    ];
    let has_default = message.fields.iter().any(|field| field.default.is_some());
    for (name, is_so) in [
        (
            "Copy",
            every(message, all, |field| {
                field.length != Length::Any && field.item != "string"
            }),
        ),
        (
            "Eq",
            every(message, all, |field| !field.item.starts_with("float")),
        ),
        ("Default", !has_default),
    ] {
        derived.extend(is_so.then_some(name));
    }
    let mut text = documentation(message);
    text += &format!(
        "#[derive({})]\npub struct {name} {{\n{fields}}}\n",
        derived.join(", ")
    );
    if !message.constants.is_empty() {
        let constants: String = message
            .constants
            .iter()
            .map(|one| constant(one, message))
            .collect();
        text += &format!("impl {name} {{\n{constants}}}\n");
    }
    if has_default {
        let values: String = message.fields.iter().map(default).collect();
        let begin =
            format!("impl Default for {name} {{\n    fn default() -> Self {{\n        Self {{\n");
        text += &(begin + &values + "        }\n    }\n}\n");
    }
    let Message {
        package,
        kind,
        file,
        part,
        ..
    } = message;
    let gap = if part.is_empty() { "" } else { "_" };
    let whole = format!("\"{package}/{kind}/{file}{gap}{part}\"");
    text += &format!(
        "impl RosMessage for {name} {{\n    const TYPE_NAME: &'static str = {whole};\n}}\n\n"
    );
    if message.part == "Request" {
        text += &service(message);
    }
    Ok(text)
}

/// A service by itself, as a type without values.
fn service(Message { package, file, .. }: &Message) -> String {
    let declared = format!(
        "/// The service `{package}/srv/{file}`.\n#[derive(Clone, Copy, Debug)]\npub enum {file} {{}}\n"
    );
    let parts = format!("    type Request = {file}Request;\n    type Response = {file}Response;\n");
    let name = format!("    const TYPE_NAME: [&'static str; 2] = [\"{package}\", \"{file}\"];\n");
    format!("{declared}impl RosService for {file} {{\n{parts}{name}}}\n\n")
}

/// For `carried!`: requests, answers and feedback.
pub fn carried(messages: &[Message]) -> String {
    let parts: Vec<_> = messages
        .iter()
        .filter(|message| !message.part.is_empty())
        .map(name)
        .collect();
    format!("carried!({});\n", parts.join(", "))
}

/// In a package of Rust names stand alone: `FlagFeatureRequest`; the result of an action gives way
/// to the message of that name.
fn name(message: &Message) -> String {
    format!(
        "{}{}",
        message.file,
        if message.part == "Result" {
            "Response"
        } else {
            message.part
        }
    )
}

fn documentation(message: &Message) -> String {
    let whole = if message.kind == "srv" {
        "service"
    } else {
        "action"
    };
    let head = (!message.part.is_empty())
        .then(|| format!("{} of the {whole} `{}`.", message.part, message.file));
    // of a service or action the comment of the file stands above its first part
    let gap = if head.is_some() && !message.comment.is_empty() {
        "///\n"
    } else {
        ""
    };
    let paragraphs: Vec<_> = message
        .comment
        .iter()
        .map(|paragraph| escaped(paragraph, ""))
        .collect();
    head.map(|head| format!("/// {head}\n")).unwrap_or_default() + gap + &paragraphs.join("///\n")
}

/// A line of documentation, in which Markdown sees neither link nor tag.
fn escaped(text: &str, indent: &str) -> String {
    let text = text.replace('[', "\\[").replace('<', "\\<");
    format!("{indent}/// {text}").trim_end().to_owned() + "\n"
}

fn declared(field: &Field, all: &[Message]) -> Result<String, String> {
    let item = match (basic(&field.item), defined(&field.item, all)) {
        (Some(basic), _) => basic.to_owned(),
        (None, Some(message)) => name(message),
        (None, None) => {
            return Err(format!(
                "{} is no type: is it described below src/ros/messages/standard?",
                field.item
            ));
        }
    };
    let comment = escaped(&field.comment, "    ");
    Ok(format!(
        "{comment}    pub {}: {},\n",
        raw(&field.name),
        list(&item, field.length)
    ))
}

fn list(item: &str, length: Length) -> String {
    match length {
        Length::One => item.to_owned(),
        Length::Any => format!("Vec<{item}>"),
        Length::Fixed(count) => format!("[{item}; {count}]"),
    }
}

fn constant(constant: &Constant, message: &Message) -> String {
    let Constant {
        item,
        name,
        value,
        comment,
        of,
    } = constant;
    let comment = match message.fields.get(*of) {
        Some(field) if comment.is_empty() => {
            format!("    /// a value of [`Self::{}`]\n", field.name)
        }
        _ => escaped(comment, "    "),
    };
    let kind = if item == "string" {
        "&str"
    } else {
        basic(item).unwrap_or(item)
    };
    format!(
        "{comment}    pub const {name}: {kind} = {};\n",
        literal(item, value)
    )
}

fn default(field: &Field) -> String {
    let value = field
        .default
        .as_ref()
        .map(|value| literal(&field.item, value));
    let value = match value {
        Some(text) if field.item == "string" => format!("{text}.into()"),
        Some(value) => value,
        None => "Default::default()".to_owned(),
    };
    format!("            {}: {value},\n", raw(&field.name))
}

/// A value as a Rust literal; the compiler refuses a bad one.
fn literal(item: &str, value: &str) -> String {
    match item {
        "string" => format!("{:?}", value.trim_matches(['"', '\''])),
        "bool" => (value == "1" || value.eq_ignore_ascii_case("true")).to_string(),
        "float32" | "float64" => {
            format!("{value}_{}", if item == "float32" { "f32" } else { "f64" })
        }
        _ => value.to_owned(),
    }
}

fn basic(item: &str) -> Option<&'static str> {
    BASIC
        .iter()
        .find(|(name, _)| *name == item)
        .map(|(_, rust)| *rust)
}

fn defined<'a>(item: &str, all: &'a [Message]) -> Option<&'a Message> {
    let (package, name) = item.split_once('/')?;
    all.iter()
        .find(|message| message.kind == "msg" && message.package == package && message.file == name)
}

/// Whether something is so of every field, and of every field of those.
fn every(message: &Message, all: &[Message], is_so: fn(&Field) -> bool) -> bool {
    message.fields.iter().all(|field| {
        is_so(field) && defined(&field.item, all).is_none_or(|of| every(of, all, is_so))
    })
}

/// A name as Rust takes it.
fn raw(name: &str) -> String {
    if name == "type" {
        format!("r#{name}")
    } else {
        name.to_owned()
    }
}

/// For `message!` and `service!`: each message and service, its name in r2r, and the fields on both
/// sides.
pub fn conversions(messages: &[Message]) -> String {
    let lines = messages.iter().map(|message| {
        let fields = message
            .fields
            .iter()
            .map(|field| format!("{}: {}, ", raw(&field.name), trailed(&field.name)));
        let both = format!(
            "message!({} = {} {{ {}}});\n",
            name(message),
            path(message),
            fields.collect::<String>()
        );
        let service = path(message).replace("::Request", "::Service");
        both + &if message.part == "Request" {
            format!("service!({} = {service});\n", message.file)
        } else {
            String::new()
        }
    });
    lines.collect()
}

/// A name as r2r takes it.
fn trailed(name: &str) -> String {
    if name == "type" {
        format!("{name}_")
    } else {
        name.to_owned()
    }
}

/// Path of the message in r2r.
fn path(message: &Message) -> String {
    let Message {
        package,
        kind,
        file,
        part,
        ..
    } = message;
    let module = if STAND_INS.contains(&package.as_str()) {
        "super"
    } else {
        "r2r"
    };
    let end = if part.is_empty() {
        String::new()
    } else {
        format!("::{part}")
    };
    format!("{module}::{package}::{kind}::{file}{end}")
}

/// For `message!`, `service!` and `action!`: the modules that r2r makes only with ROS sourced.
pub fn stand_ins(messages: &[Message]) -> String {
    let modules = STAND_INS.map(|package| {
        let kinds = ["msg", "srv", "action"].map(|kind| {
            let of_kind: Vec<_> = messages
                .iter()
                .filter(|one| one.package == package && one.kind == kind)
                .collect();
            let files = of_kind
                .chunk_by(|one, next| one.file == next.file)
                .map(stand_in);
            format!("pub mod {kind} {{\n{}}}\n", files.collect::<String>())
        });
        format!("pub mod {package} {{\n{}}}\n", kinds.concat())
    });
    modules.concat()
}

fn stand_in(parts: &[&Message]) -> String {
    let kind = match parts.len() {
        1 => "message",
        2 => "service",
        _ => "action",
    };
    let parts: Vec<_> = parts
        .iter()
        .map(|part| {
            (
                part.file.as_str(),
                part.fields.iter().map(theirs).collect::<String>(),
            )
        })
        .collect();
    let name = parts.first().map_or("", |(name, _)| name);
    let fields: String = parts
        .iter()
        .map(|(_, fields)| format!(" {{ {fields}}}"))
        .collect();
    format!("{kind}!({name}{fields});\n")
}

/// A field as r2r declares it.
fn theirs(field: &Field) -> String {
    let item = match (basic(&field.item), field.item.split_once('/')) {
        (Some(basic), _) => basic.to_owned(),
        (None, Some((package, name))) if STAND_INS.contains(&package) => {
            format!("crate::ros::r2r::{package}::msg::{name}")
        }
        (None, Some((package, name))) => format!("r2r::{package}::msg::{name}"),
        (None, None) => field.item.clone(),
    };
    format!("{}: {}, ", trailed(&field.name), list(&item, field.length))
}
