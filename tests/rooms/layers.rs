//! Who may use whom: reads `src/` and fails on a reference against the flow of data, and on files, threads, clock,
//! environment or printing in a room that is pure. Comments, strings and inline tests do not count.

use std::fs;
use std::path::Path;

/// Each room and the rooms it may use; itself always. A room that is missing here fails the check.
const MAY_USE: &[(&str, &[&str])] = &[
    ("clock", &[]),
    ("touch", &[]),
    ("mesh", &[]),
    ("patch", &["touch", "mesh"]),
    ("refine", &["touch", "mesh", "patch"]),
    ("live", &["clock", "touch", "mesh", "patch", "refine"]),
    ("explore", &["touch", "mesh", "features"]),
    ("robot", &["clock", "touch", "explore"]),
    ("probe", &["touch", "mesh", "features", "explore", "robot"]),
    ("sim", &["touch", "mesh", "robot"]),
    ("features", &["touch", "mesh"]),
    ("align", &["mesh", "features"]),
    ("compare", &["touch", "mesh", "align", "features"]),
    ("calibrate", &["touch", "align"]),
    ("io", &["touch", "mesh", "features", "align", "robot", "probe"]),
    ("scene", &["touch", "mesh", "patch", "refine", "explore", "robot", "probe", "sim", "io"]),
    ("session", &["clock", "touch", "mesh", "patch", "refine", "live", "features", "io"]),
    (
        "report",
        &["touch", "mesh", "patch", "refine", "live", "features", "align", "sim", "compare", "io", "scene", "session"],
    ),
    (
        "ros",
        &[
            "clock",
            "touch",
            "mesh",
            "patch",
            "refine",
            "live",
            "features",
            "explore",
            "robot",
            "probe",
            "sim",
            "align",
            "calibrate",
            "compare",
            "io",
            "scene",
            "session",
        ],
    ),
    (
        "cli",
        &[
            "clock",
            "touch",
            "mesh",
            "patch",
            "refine",
            "live",
            "features",
            "explore",
            "robot",
            "probe",
            "sim",
            "align",
            "calibrate",
            "compare",
            "io",
            "scene",
            "session",
            "report",
            "ros",
            "robot",
        ],
    ),
];

/// Same input, same bytes out: nothing of the world outside comes in.
const PURE: &[&str] = &[
    "touch",
    "mesh",
    "patch",
    "features",
    "refine",
    "align",
    "compare",
    "calibrate",
    "explore",
    "robot",
    "probe",
    "sim",
];

/// The parts of them that are the way to a device, with its processes, sockets and deadlines; by how their files begin.
const DEVICES: &[&str] = &["robot/ur/"];

/// The only places with Python.
const MAY_USE_PYTHON: &[&str] = &["robot/ur/child/"];

/// What a pure room may not name.
const IMPURE_PATHS: &[&str] = &["std::fs", "std::thread", "std::env", "std::io", "std::net", "std::process"];
const IMPURE_NAMES: &[&str] = &["Instant", "SystemTime", "println", "eprintln", "print", "eprint", "dbg"];

/// The only rooms with file access.
const MAY_OPEN_FILES: &[&str] = &["io", "scene"];

/// The files that ask the system about itself, which answers by files: the packet sizes of its networks.
const MAY_ASK_THE_SYSTEM: &[&str] = &["ros/dds/answers.rs"];

/// The code alone: comments, the insides of strings and characters, and `#[cfg(test)] mod … { … }` are blanked.
fn code_of(source: &str) -> String {
    without_inline_tests(&without_comments_and_strings(source))
}

fn without_comments_and_strings(source: &str) -> String {
    let mut code = String::new();
    let mut rest = source;
    while let Some(next) = rest.chars().next() {
        let skipped = comment_length(rest).or_else(|| string_length(rest, &code));
        match skipped {
            Some(length) => {
                code.push(' ');
                rest = &rest[length..];
            }
            None => {
                code.push(next);
                rest = &rest[next.len_utf8()..];
            }
        }
    }
    code
}

fn comment_length(rest: &str) -> Option<usize> {
    if rest.starts_with("//") {
        return Some(rest.find('\n').unwrap_or(rest.len()));
    }
    if !rest.starts_with("/*") {
        return None;
    }
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        let step = if rest[at..].starts_with("/*") {
            depth += 1;
            2
        } else if rest[at..].starts_with("*/") {
            depth -= 1;
            2
        } else {
            rest[at..].chars().next().map_or(1, char::len_utf8)
        };
        at += step;
        if depth == 0 {
            break;
        }
    }
    Some(at)
}

/// A string, raw string or character at the start of `rest`; a lifetime is none.
fn string_length(rest: &str, before: &str) -> Option<usize> {
    let in_a_word = before.ends_with(|c: char| c.is_alphanumeric() || c == '_');
    if !in_a_word && let Some(raw) = rest.strip_prefix('r') {
        let hashes = raw.len() - raw.trim_start_matches('#').len();
        if raw[hashes..].starts_with('"') {
            let end = format!("\"{}", "#".repeat(hashes));
            let body = 1 + hashes + 1;
            return Some(rest[body..].find(&end).map_or(rest.len(), |at| body + at + end.len()));
        }
    }
    let quote = rest.chars().next()?;
    if quote == '\'' {
        let mut after = rest.char_indices().skip(1);
        let (_, first) = after.next()?;
        let (at, second) = after.next()?;
        if first != '\\' {
            return (second == '\'').then_some(at + 1);
        }
    } else if quote != '"' {
        return None;
    }
    let mut escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    Some(rest.len())
}

fn without_inline_tests(code: &str) -> String {
    let mut kept = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("#[cfg(test)]") {
        kept.push_str(&rest[..at]);
        rest = &rest[at + "#[cfg(test)]".len()..];
        if rest.trim_start().starts_with("mod ") {
            rest = &rest[block_end(rest)..];
        }
    }
    kept + rest
}

/// Just behind the first `{ … }` of `code`, or its first `;` when that comes before.
fn block_end(code: &str) -> usize {
    let mut depth = 0;
    for (at, c) in code.char_indices() {
        match c {
            ';' if depth == 0 => return at + 1,
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
            }
            _ => {}
        }
    }
    code.len()
}

/// Words and signs: `use crate::{io, mesh::TriMesh}` is use crate :: { io , mesh :: TriMesh }.
fn tokens(code: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = code.trim_start();
    while !rest.is_empty() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let length = match word {
            0 if rest.starts_with("::") => 2,
            0 => rest.chars().next().map_or(1, char::len_utf8),
            word => word,
        };
        tokens.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    tokens
}

/// The names that follow `at` (just behind a `::`): one, or each of a group in braces.
fn names_at<'a>(tokens: &[&'a str], at: usize) -> Vec<&'a str> {
    let Some(&first) = tokens.get(at) else { return Vec::new() };
    if first != "{" {
        return vec![first];
    }
    let mut names = Vec::new();
    let mut depth = 0;
    let mut expected = false;
    for token in &tokens[at..] {
        match *token {
            "{" => {
                depth += 1;
                expected = depth == 1;
            }
            "}" => depth -= 1,
            "," => expected = depth == 1,
            name if expected => {
                names.push(name);
                expected = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    names
}

/// The room of a file below `src/`, and how many modules deep it is; `None` for `lib.rs` and `main.rs`.
fn room_of(file: &str) -> Option<(&str, usize)> {
    let path = file.strip_suffix(".rs")?;
    let path = path.strip_suffix("/mod").unwrap_or(path);
    let room = path.split('/').next()?;
    (room != "lib" && room != "main").then(|| (room, path.split('/').count()))
}

/// The rooms that `tokens` reach, from the root of the crate or by enough `super`.
fn rooms_reached<'a>(tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let mut rooms = Vec::new();
    for at in 0..tokens.len() {
        if at >= 2 && tokens[at - 1] == "::" && (tokens[at - 2] == "super" || tokens[at] == "crate") {
            continue;
        }
        let supers = tokens[at..].chunks(2).take_while(|pair| *pair == ["super", "::"]).count();
        if tokens[at] == "crate" && tokens.get(at + 1) == Some(&"::") {
            rooms.extend(names_at(tokens, at + 2));
        } else if supers > 0 && supers >= depth {
            rooms.extend(names_at(tokens, at + 2 * supers));
        }
    }
    rooms
}

/// Every breach in one file, each as one line.
fn breaches(file: &str, source: &str) -> Vec<String> {
    let Some((room, depth)) = room_of(file) else { return Vec::new() };
    let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == room) else {
        return vec![format!("{file}: the room {room} is not in the table of tests/layers.rs")];
    };
    let code = code_of(source);
    let tokens = tokens(&code);
    let is_pure = PURE.contains(&room) && !DEVICES.iter().any(|start| file.starts_with(start));
    let may_use_python = MAY_USE_PYTHON.iter().any(|start| file.starts_with(start));
    let is_room = |name: &&str| MAY_USE.iter().any(|(room, _)| room == name);
    let mut found: Vec<String> = rooms_reached(&tokens, depth)
        .into_iter()
        .filter(|name| is_room(name) && *name != room && !allowed.contains(name))
        .map(|name| format!("{file}: {room} may not use crate::{name}"))
        .collect();
    for at in 0..tokens.len() {
        let is_std = tokens[at] == "std" && tokens.get(at + 1) == Some(&"::");
        for name in if is_std { names_at(&tokens, at + 2) } else { Vec::new() } {
            let path = format!("std::{name}");
            let is_impure = is_pure && IMPURE_PATHS.contains(&path.as_str());
            if is_impure || (name == "fs" && !MAY_OPEN_FILES.contains(&room) && !MAY_ASK_THE_SYSTEM.contains(&file)) {
                found.push(format!("{file}: {room} may not use {path}"));
            }
        }
        if is_pure && IMPURE_NAMES.contains(&tokens[at]) {
            found.push(format!("{file}: {room} is pure and may not use {}", tokens[at]));
        }
        if tokens[at] == "pyo3" && !may_use_python {
            found.push(format!("{file}: Python is in {} alone", MAY_USE_PYTHON.join(", ")));
        }
    }
    found
}

fn rust_files(folder: &Path, into: &mut Vec<std::path::PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

#[test]
fn every_room_keeps_to_the_flow_of_data() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    for room in MAY_USE.iter().map(|(room, _)| room) {
        let is_there = files.iter().any(|f| f.starts_with(src.join(room)) || *f == src.join(format!("{room}.rs")));
        assert!(is_there, "the room {room} of the table is not in src/");
    }
    let found: Vec<_> = files
        .iter()
        .flat_map(|path| {
            let file = path.strip_prefix(&src).unwrap().to_str().unwrap();
            breaches(file, &fs::read_to_string(path).unwrap())
        })
        .collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn a_breach_is_found_however_it_is_written() {
    let bad = [
        ("touch/sync.rs", "use crate::mesh::TriMesh;"),
        ("touch/sync.rs", "use crate::{mesh::{TriMesh, FaceId}, touch::Sample};"),
        ("touch/sync.rs", "fn f() -> crate :: io::Error {}"),
        ("touch/sync.rs", "use super::super::mesh;"),
        ("touch/mod.rs", "use super::{touch, mesh};"),
        ("mesh.rs", "use super::refine;"),
        ("mesh/repair/weld.rs", "use super::super::super::touch;"),
        ("io/mod.rs", "use crate::cli;"),
        ("scene.rs", "use crate::cli;"),
        ("refine/mod.rs", "use std::fs::File;"),
        ("refine/mod.rs", "use std::{collections::HashMap, thread};"),
        ("refine/mod.rs", "let t = std::time::Instant::now();"),
        ("sim/mod.rs", "let t = SystemTime::now();"),
        ("sim/mod.rs", "let home = std::env::var(\"HOME\");"),
        ("mesh/mod.rs", "/* a */ println!(\"{x}\");"),
        ("mesh/mod.rs", "let c = '\"'; println!(\"{c}\");"),
        ("mesh/mod.rs", "fn f<'a>(x: &'a str) { dbg!(x) }"),
        ("mesh/mod.rs", "#[cfg(test)] mod tests { fn f() { { } } } use crate::io;"),
        ("cli/demo.rs", "std::fs::write(path, text)"),
        ("robot/touching.rs", "use std::thread;"),
        ("robot/ur/client.rs", "use pyo3::Python;"),
        ("cli/ur.rs", "pyo3::Python::attach(f)"),
        ("robot/ur/setup.rs", "std::fs::read(path)"),
        ("robot/ur/arm.rs", "use crate::sim::Plate;"),
        ("cellar/mod.rs", ""),
    ];
    for (file, source) in bad {
        assert_eq!(breaches(file, source).len(), 1, "{file}: {source}: {:?}", breaches(file, source));
    }
}

#[test]
fn what_is_allowed_is_let_through() {
    let good = [
        ("refine/mod.rs", "use crate::touch::Sample; use crate::{mesh::TriMesh, refine::Update}; use super::mesh;"),
        ("touch/sync.rs", "// use crate::mesh\n/* std::fs /* nested */ crate::io */ /// [`crate::refine::Refiner`]\n"),
        ("touch/sync.rs", "let s = \"crate::io println! \\\" std::fs\"; let r = r#\"std::fs \" crate::mesh\"#;"),
        ("touch/sync.rs", "use super::mesh_like; use super::super::touch::sync;"),
        ("mesh/mod.rs", "#[cfg(test)] mod tests { use crate::io; fn f() { println!(\"}\"); } } fn g() {}"),
        ("io/mod.rs", "use std::fs; use std::io::Read;"),
        ("cli/refine.rs", "let t = std::time::Instant::now(); println!(\"x\");"),
        ("robot/ur/client.rs", "use std::{thread, process}; use std::time::Instant; use crate::robot::ArmError;"),
        ("robot/ur/child/library.rs", "use pyo3::Python;"),
        ("main.rs", "use std::fs; fn main() { println!() }"),
    ];
    for (file, source) in good {
        assert_eq!(breaches(file, source), Vec::<String>::new(), "{file}: {source}");
    }
}
