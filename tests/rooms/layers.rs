//! Rules that the order of the crates cannot enforce: reads the sources and fails on a reference
//! that a room may not make, on files of a crate that use one another in a circle, and on files,
//! threads, clock, environment or printing in a crate that is pure. Comments, strings and inline
//! tests do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Each room and the rooms it may use; itself always. A room that is missing here fails the check.
/// The crates of the simulator, of files and of the report are a room each. Circles between crates
/// need no check: cargo refuses them.
const MAY_USE: &[(&str, &str)] = &[
    ("clock", ""),
    ("log_lines", ""),
    ("threads", "mesh"),
    ("numeric", ""),
    ("parameters", ""),
    ("stylus", "numeric parameters"),
    ("mesh", "numeric"),
    ("reconstruct", "numeric parameters stylus mesh"),
    ("haptic", "numeric parameters stylus mesh reconstruct"),
    ("live", "clock stylus mesh reconstruct haptic"),
    ("plan", "numeric parameters stylus mesh features conformity"),
    ("arm", "numeric parameters stylus plan"),
    (
        "execute",
        "numeric parameters stylus mesh features calibrate plan arm",
    ),
    ("sim", "numeric stylus mesh calibrate diagnose arm"),
    ("form", "numeric"),
    ("features", "numeric stylus mesh form"),
    ("conformity", "numeric features"),
    ("align", "numeric mesh features"),
    ("compare", "numeric stylus mesh align features"),
    ("calibrate", "numeric stylus mesh align"),
    ("diagnose", "numeric stylus mesh"),
    (
        "io",
        "numeric parameters stylus mesh form features conformity align arm execute",
    ),
    ("scan", "mesh reconstruct io threads"),
    (
        "scene",
        "parameters stylus mesh reconstruct haptic diagnose plan arm execute sim io",
    ),
    ("replay", "numeric stylus io scene"),
    (
        "session",
        "clock numeric stylus mesh reconstruct haptic live features io threads scan replay",
    ),
    (
        "refinement",
        "stylus mesh reconstruct haptic live diagnose threads scene replay session",
    ),
    (
        "sweep",
        "stylus mesh features compare sim io threads scan scene replay session refinement",
    ),
    ("html", ""),
    (
        "inspection",
        "html numeric stylus mesh features conformity align compare io scan scene session",
    ),
    (
        "calibration",
        "stylus align calibrate execute io scene replay",
    ),
    ("input_check", "stylus mesh diagnose threads scene replay"),
    (
        "report",
        "numeric stylus mesh reconstruct haptic live features align sim compare diagnose io scan scene session replay",
    ),
    (
        "python",
        "numeric parameters stylus mesh reconstruct haptic live features align sim compare diagnose io threads scan scene session replay refinement sweep",
    ),
    ("ur", "clock stylus plan arm"),
    (
        "ros",
        "parameters clock log_lines stylus mesh reconstruct haptic live form features plan arm execute sim align \
         calibrate compare diagnose io scan scene session replay conformity inspection input_check calibration",
    ),
    ("ros2_control", "clock stylus plan arm ros"),
    (
        "cli",
        "clock numeric stylus mesh reconstruct haptic live features conformity plan arm execute sim align \
         calibrate compare diagnose io threads scan scene session replay refinement sweep html inspection input_check calibration ros \
         ros2_control ur",
    ),
];

/// Same input, same bytes out: nothing of the world outside comes in.
const PURE: &[&str] = &["touchup-core", "touchup-sim"];

/// The only places with Python.
const MAY_USE_PYTHON: &[&str] = &["src/ur/child/", "crates/touchup-python/"];

/// What a pure crate may not name.
const IMPURE_PATHS: &[&str] = &[
    "std::fs",
    "std::thread",
    "std::env",
    "std::io",
    "std::net",
    "std::process",
];
const IMPURE_NAMES: &[&str] = &[
    "Instant",
    "SystemTime",
    "println",
    "eprintln",
    "print",
    "eprint",
    "dbg",
];

/// The only places with file access.
const MAY_OPEN_FILES: &[&str] = &["crates/touchup-io/", "crates/touchup-session/src/scene/"];

/// The files that ask the system about itself, which answers by files: the packet sizes of its
/// networks, the open sockets.
const MAY_ASK_THE_SYSTEM: &[&str] = &["src/ros/dds/answers.rs", "src/ros/dds/sockets.rs"];

/// The code alone: comments, the insides of strings and characters, and `#[cfg(test)] mod … { … }`
/// are blanked.
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
            return Some(
                rest[body..]
                    .find(&end)
                    .map_or(rest.len(), |at| body + at + end.len()),
            );
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
        let word = rest
            .find(|c: char| !c.is_alphanumeric() && c != '_')
            .unwrap_or(rest.len());
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
    let Some(&first) = tokens.get(at) else {
        return Vec::new();
    };
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

/// Where a file is.
struct Place<'a> {
    package: &'a str,
    /// empty for `lib.rs` and `main.rs` of a crate with several
    room: &'a str,
    /// how many modules deep, where the crate has several rooms; 0 where all of it is one
    depth: usize,
    /// whether it is one of the rooms of `probing`
    has_siblings: bool,
}

impl<'a> Place<'a> {
    /// Of a file's path in the repository.
    fn of(file: &'a str) -> Self {
        let (package, path) = match file.strip_prefix("crates/") {
            Some(file) => file.split_once("/src/").unwrap(),
            None => ("touchup", file.strip_prefix("src/").unwrap()),
        };
        if let Some((_, room)) = WHOLE.iter().find(|(name, _)| *name == package) {
            return Self {
                package,
                room,
                depth: 0,
                has_siblings: false,
            };
        }
        let path = path.strip_suffix(".rs").unwrap();
        let path = path.strip_suffix("/mod").unwrap_or(path);
        if path == "lib" || path == "main" {
            return Self {
                package,
                room: "",
                depth: 0,
                has_siblings: false,
            };
        }
        let inner = path.strip_prefix("probing/").unwrap_or(path);
        let room = if inner == "probing" {
            ""
        } else {
            inner.split('/').next().unwrap()
        };
        Self {
            package,
            room,
            depth: path.split('/').count(),
            has_siblings: inner != path,
        }
    }
}

/// Crates that are one room each, and its name.
const WHOLE: &[(&str, &str)] = &[
    ("touchup-sim", "sim"),
    ("touchup-io", "io"),
    ("touchup-report", "report"),
    ("touchup-python", "python"),
];

/// Crates with several rooms, as other crates name them.
const WITH_ROOMS: &[&str] = &["touchup_core", "touchup_session"];

/// The rooms that `tokens` reach: of other crates by their names, of the own one from its root or
/// by enough `super`.
///
/// - `depth`, `has_siblings`: of [`Place`].
fn rooms_reached<'a>(tokens: &[&'a str], depth: usize, has_siblings: bool) -> Vec<&'a str> {
    let mut rooms = Vec::new();
    for at in 0..tokens.len() {
        if at >= 2 && tokens[at - 1] == "::" && (tokens[at - 2] == "super" || tokens[at] == "crate")
        {
            continue;
        }
        let is_path = tokens.get(at + 1) == Some(&"::");
        let supers = tokens[at..]
            .chunks(2)
            .take_while(|pair| *pair == ["super", "::"])
            .count();
        if is_path && (WITH_ROOMS.contains(&tokens[at]) || tokens[at] == "crate" && depth > 0) {
            rooms.extend(names_at(tokens, at + 2));
        } else if supers > 0 && depth > 0 && supers + usize::from(has_siblings) >= depth {
            rooms.extend(names_at(tokens, at + 2 * supers));
        }
        // the rooms of `probing`, in a path or in a group
        let follows = at > 0 && ["::", "{", ","].contains(&tokens[at - 1]);
        if tokens[at] == "probing" && is_path && follows {
            rooms.extend(names_at(tokens, at + 2));
        }
        rooms.extend(
            WHOLE
                .iter()
                .filter(|(name, _)| name.replace('-', "_") == tokens[at])
                .map(|(_, room)| *room),
        );
    }
    rooms
}

/// Every breach in one file, each as one line.
fn breaches(file: &str, source: &str) -> Vec<String> {
    let place = Place::of(file);
    let code = code_of(source);
    let tokens = tokens(&code);
    let mut found = Vec::new();
    if !place.room.is_empty() {
        let Some((room, allowed)) = MAY_USE.iter().find(|(room, _)| *room == place.room) else {
            return vec![format!(
                "{file}: the room {} is not in the table of tests/rooms/layers.rs",
                place.room
            )];
        };
        let is_room = |name: &&str| MAY_USE.iter().any(|(room, _)| room == name);
        let reached = rooms_reached(&tokens, place.depth, place.has_siblings).into_iter();
        let wrong = reached.filter(|name| {
            is_room(name) && name != room && allowed.split(' ').all(|one| one != *name)
        });
        found.extend(wrong.map(|name| format!("{file}: {room} may not use {name}")));
    }
    let is_pure = PURE.contains(&place.package);
    let is_in = |starts: &[&str]| starts.iter().any(|start| file.starts_with(start));
    for at in 0..tokens.len() {
        let is_std = tokens[at] == "std" && tokens.get(at + 1) == Some(&"::");
        for name in if is_std {
            names_at(&tokens, at + 2)
        } else {
            Vec::new()
        } {
            let path = format!("std::{name}");
            let is_impure = is_pure && IMPURE_PATHS.contains(&path.as_str());
            let is_entry = file == "src/main.rs";
            if is_impure
                || (name == "fs"
                    && !is_in(MAY_OPEN_FILES)
                    && !is_in(MAY_ASK_THE_SYSTEM)
                    && !is_entry)
            {
                found.push(format!("{file} may not use {path}"));
            }
        }
        if is_pure && IMPURE_NAMES.contains(&tokens[at]) {
            found.push(format!(
                "{file}: {} is pure and may not use {}",
                place.package, tokens[at]
            ));
        }
        if tokens[at] == "pyo3" && !is_in(MAY_USE_PYTHON) {
            found.push(format!(
                "{file}: Python is in {} alone",
                MAY_USE_PYTHON.join(", ")
            ));
        }
    }
    found
}

/// Every file of Rust below a folder of the repository, by its path from there.
fn sources(folder: &str) -> Vec<(String, String)> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(folder);
    let (mut found, mut folders) = (Vec::new(), vec![root.clone()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path
                    .strip_prefix(&root)
                    .unwrap()
                    .to_str()
                    .unwrap()
                    .to_owned();
                found.push((name, fs::read_to_string(path).unwrap()));
            }
        }
    }
    found
}

/// The modules of one crate by their path from its root, each with the tokens of its code.
type Modules<'a> = BTreeMap<Vec<&'a str>, Vec<&'a str>>;

/// Every path that `tokens` name from `at` on, with braces multiplied out.
fn paths_at<'a>(tokens: &[&'a str], at: &mut usize, before: &[&'a str]) -> Vec<Vec<&'a str>> {
    let mut path = before.to_vec();
    while let Some(&token) = tokens.get(*at) {
        *at += 1;
        match token {
            "{" => {
                let mut paths = Vec::new();
                while tokens.get(*at).is_some_and(|token| *token != "}") {
                    paths.extend(paths_at(tokens, at, &path));
                    *at += usize::from(tokens.get(*at) == Some(&","));
                }
                *at += 1;
                return paths;
            }
            word if word.starts_with(|c: char| c.is_alphanumeric() || c == '_' || c == '*') => {
                path.push(word)
            }
            _ => break,
        }
        if tokens.get(*at) != Some(&"::") {
            break;
        }
        *at += 1;
    }
    vec![path]
}

/// What a module names of its crate, as paths from the root: what it uses, and what it has by
/// `use`, of other crates too.
fn paths_of<'a>(
    module: &[&'a str],
    modules: &Modules<'a>,
) -> (Vec<Vec<&'a str>>, Vec<Vec<&'a str>>) {
    let tokens = &modules[module];
    let (mut used, mut imported) = (Vec::new(), Vec::new());
    let (mut at, mut is_public) = (0, false);
    while at < tokens.len() {
        let begins = at == 0 || tokens[at - 1] != "::";
        let is_use = at > 0 && tokens[at - 1] == "use";
        let is_own = |first: &'a str| modules.contains_key(&[module, &[first]].concat());
        let is_visibility = tokens[..at].ends_with(&["pub", "(", "in"]);
        let is_path = !is_visibility && matches!(tokens[at], "crate" | "super" | "self")
            || is_own(tokens[at]);
        match tokens[at] {
            "pub" => is_public = true,
            "fn" | "mod" | "struct" | ";" | "{" => is_public = false,
            _ => {}
        }
        if !(is_use || begins && at > 0 && is_path && tokens.get(at + 1) == Some(&"::")) {
            at += 1;
            continue;
        }
        for path in paths_at(tokens, &mut at, &[]) {
            let supers = path.iter().take_while(|part| **part == "super").count();
            let mut path = match path.first() {
                Some(&"crate") => path[1..].to_vec(),
                Some(&"super") => [&module[..module.len() - supers], &path[supers..]].concat(),
                Some(&"self") => [module, &path[1..]].concat(),
                Some(&first) if is_own(first) => [module, &path].concat(),
                _ => [&["::"], &path[..]].concat(),
            };
            path.pop_if(|last| *last == "self");
            if is_use && path.last().is_some_and(|last| *last != "*") {
                imported.push(path.clone());
            }
            if !(is_use && is_public) && path.first() != Some(&"::") {
                used.push(path);
            }
        }
    }
    (used, imported)
}

/// The module that a file below `src` is.
fn module_in(file: &str) -> Vec<&str> {
    let path = file.trim_end_matches(".rs").trim_end_matches("/mod");
    if path == "lib" {
        Vec::new()
    } else {
        path.split('/').collect()
    }
}

/// The module in which what a path names is defined: its longest start that is one, through what
/// modules import, for themselves or for others; the root, which uses none, for what is of another
/// crate.
fn module_of<'a>(
    path: &[&'a str],
    modules: &Modules<'a>,
    imported: &BTreeMap<Vec<&'a str>, Vec<&'a str>>,
) -> Vec<&'a str> {
    let mut path = path.to_vec();
    loop {
        let depth = (0..=path.len())
            .rev()
            .find(|&depth| modules.contains_key(&path[..depth]))
            .unwrap_or(0);
        let named = path.len().min(depth + 1);
        match imported.get(&path[..named]) {
            Some(origin) if named > depth && *origin != path[..named] => {
                path = [origin, &path[named..]].concat()
            }
            _ => return path[..depth].to_vec(),
        }
    }
}

/// Modules of one crate that use one another in a circle, each with those that it uses.
///
/// - `sources`: paths below `src` and code.
fn circles(sources: &[(String, String)]) -> Vec<String> {
    let modules: Modules = sources
        .iter()
        .map(|(file, code)| (module_in(file), tokens(code)))
        .collect();
    let paths: Vec<_> = modules
        .keys()
        .map(|name| (name, paths_of(name, &modules)))
        .collect();
    let imported = paths.iter().flat_map(|(name, (_, imported))| {
        imported
            .iter()
            .map(|origin| ([name, &origin[origin.len() - 1..]].concat(), origin.clone()))
    });
    let imported: BTreeMap<_, _> = imported.collect();
    let mut uses: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for (name, (used, _)) in &paths {
        let others = used.iter().map(|path| module_of(path, &modules, &imported));
        uses.insert(
            (*name).clone(),
            others.filter(|other| other != *name).collect(),
        );
    }
    // who is used by nobody left, or uses nobody left, is in no circle
    loop {
        let left: BTreeSet<_> = uses.keys().cloned().collect();
        let used: BTreeSet<_> = uses.values().flatten().cloned().collect();
        uses.values_mut()
            .for_each(|others| others.retain(|other| left.contains(other)));
        uses.retain(|name, others| !others.is_empty() && used.contains(name));
        if uses.len() == left.len() {
            break;
        }
    }
    uses.iter()
        .map(|(name, others)| format!("{} uses {:?}", name.join("/"), others))
        .collect()
}

#[test]
fn every_room_keeps_to_the_flow_of_data() {
    let files = ["src", "crates"].map(|folder| {
        sources(folder)
            .into_iter()
            .map(move |(file, source)| (format!("{folder}/{file}"), source))
    });
    let files: Vec<_> = files
        .into_iter()
        .flatten()
        .filter(|(file, _)| file.starts_with("src/") || file.contains("/src/"))
        .collect();
    for (room, _) in MAY_USE {
        assert!(
            files.iter().any(|(file, _)| Place::of(file).room == *room),
            "no file is in the room {room} of the table"
        );
    }
    let tests: BTreeSet<_> = files
        .iter()
        .flat_map(|(file, source)| modules_of_tests(file, source))
        .collect();
    let is_of_tests = |file: &str| {
        Path::new(file)
            .with_extension("")
            .ancestors()
            .any(|module| tests.contains(module))
    };
    let of_program = files.iter().filter(|(file, _)| !is_of_tests(file));
    let found: Vec<_> = of_program
        .flat_map(|(file, source)| breaches(file, source))
        .collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// The modules that a file has for its tests alone, without extension: those that it declares below
/// `#[cfg(test)]`. They and all that is below them may use all rooms.
fn modules_of_tests(file: &str, source: &str) -> Vec<PathBuf> {
    let folder = file
        .strip_suffix("/mod.rs")
        .or(file.strip_suffix("/lib.rs"))
        .or(file.strip_suffix(".rs"));
    let declared = source
        .split("#[cfg(test)]")
        .skip(1)
        .filter_map(|after| after.trim_start().strip_prefix("mod "));
    let name = |after: &str| {
        after
            .split_once(';')
            .map(|(name, _)| name.to_owned())
            .filter(|name| !name.contains('{'))
    };
    declared
        .filter_map(name)
        .map(|name| Path::new(folder.unwrap_or_default()).join(name))
        .collect()
}

#[test]
fn modules_of_tests_alone_are_known() {
    let source = "#[cfg(test)]\nmod scripted;\nmod b;\n#[cfg(test)]\nmod tests {\n    mod inner;\n}\n#[cfg(test)]\nmod more;\n";
    let of_control = ["src/ur/control/scripted", "src/ur/control/more"].map(PathBuf::from);
    assert_eq!(modules_of_tests("src/ur/control.rs", source), of_control);
    assert_eq!(
        modules_of_tests("src/ur/mod.rs", "#[cfg(test)]\nmod a;"),
        [PathBuf::from("src/ur/a")]
    );
}

const CORE: &str = "crates/touchup-core/src";

/// A file of the core below its `src`, or a path from the root of the repository.
fn path_of(file: &str) -> String {
    if file.starts_with("src/") || file.starts_with("crates/") {
        file.to_owned()
    } else {
        format!("{CORE}/{file}")
    }
}

#[test]
fn a_breach_is_found_however_it_is_written() {
    let bad = [
        ("stylus/sync.rs", "use crate::mesh::TriMesh;"),
        (
            "stylus/sync.rs",
            "use crate::{mesh::{TriMesh, FaceId}, stylus::Sample};",
        ),
        ("stylus/sync.rs", "fn f() -> crate :: reconstruct::Error {}"),
        ("stylus/sync.rs", "use super::super::mesh;"),
        ("stylus/mod.rs", "use super::{stylus, mesh};"),
        ("mesh.rs", "use super::haptic;"),
        ("mesh/repair/weld.rs", "use super::super::super::stylus;"),
        (
            "crates/touchup-session/src/scene/mod.rs",
            "use crate::live;",
        ),
        ("src/ros/node/mod.rs", "use crate::cli;"),
        ("haptic/mod.rs", "use std::fs::File;"),
        ("haptic/mod.rs", "use std::{collections::HashMap, thread};"),
        ("haptic/mod.rs", "let t = std::time::Instant::now();"),
        (
            "crates/touchup-sim/src/lib.rs",
            "let t = SystemTime::now();",
        ),
        (
            "crates/touchup-sim/src/arm.rs",
            "let home = std::env::var(\"HOME\");",
        ),
        ("mesh/mod.rs", "/* a */ println!(\"{x}\");"),
        ("mesh/mod.rs", "let c = '\"'; println!(\"{c}\");"),
        ("mesh/mod.rs", "fn f<'a>(x: &'a str) { dbg!(x) }"),
        (
            "mesh/mod.rs",
            "#[cfg(test)] mod tests { fn f() { { } } } use crate::reconstruct;",
        ),
        ("src/cli/demo.rs", "std::fs::write(path, text)"),
        ("probing/arm/touching.rs", "use std::thread;"),
        ("src/ur/client.rs", "use pyo3::Python;"),
        ("src/cli/ur.rs", "pyo3::Python::attach(f)"),
        ("src/ur/setup.rs", "std::fs::read(path)"),
        ("src/ur/arm.rs", "use crate::cli::demo;"),
        ("src/ur/arm.rs", "use crate::sim::Plate;"),
        (
            "crates/touchup-sim/src/arm.rs",
            "use touchup_core::reconstruct::Patcher;",
        ),
        (
            "crates/touchup-sim/src/arm.rs",
            "use touchup_core::{mesh::TriMesh, features::Kind};",
        ),
        (
            "crates/touchup-session/src/scene/mod.rs",
            "fn f() -> touchup_core::features::Kind {}",
        ),
        (
            "crates/touchup-session/src/session/mod.rs",
            "use touchup_sim::Plate;",
        ),
        ("cellar/mod.rs", ""),
    ];
    for (file, source) in bad {
        let found = breaches(&path_of(file), source);
        assert_eq!(found.len(), 1, "{file}: {source}: {found:?}");
    }
}

#[test]
fn what_is_allowed_is_let_through() {
    let good = [
        (
            "haptic/mod.rs",
            "use crate::stylus::Sample; use crate::{mesh::TriMesh, haptic::Update}; use super::mesh;",
        ),
        (
            "stylus/sync.rs",
            "// use crate::mesh\n/* std::fs /* nested */ crate::io */ /// [`crate::haptic::Refiner`]\n",
        ),
        (
            "stylus/sync.rs",
            "let s = \"crate::mesh println! \\\" std::fs\"; let r = r#\"std::fs \" crate::mesh\"#;",
        ),
        (
            "stylus/sync.rs",
            "use super::mesh_like; use super::super::stylus::sync;",
        ),
        (
            "mesh/mod.rs",
            "#[cfg(test)] mod tests { use crate::reconstruct; fn f() { println!(\"}\"); } } fn g() {}",
        ),
        (
            "crates/touchup-io/src/lib.rs",
            "use std::fs; use std::io::Read;",
        ),
        (
            "src/cli/refine.rs",
            "let t = std::time::Instant::now(); println!(\"x\");",
        ),
        (
            "src/ur/client.rs",
            "use std::{thread, process}; use std::time::Instant; use crate::probing::arm::ArmError;",
        ),
        ("src/ur/child/library.rs", "use pyo3::Python;"),
        ("src/main.rs", "use std::fs; fn main() { println!() }"),
    ];
    for (file, source) in good {
        assert_eq!(
            breaches(&path_of(file), source),
            Vec::<String>::new(),
            "{file}: {source}"
        );
    }
}

#[test]
fn files_of_a_crate_use_one_another_one_way() {
    let crates = fs::read_dir(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("crates")).unwrap();
    let crates = crates.map(|entry| format!("crates/{}/src", entry.unwrap().file_name().display()));
    for folder in crates.chain(["src".to_owned()]) {
        let files: Vec<_> = sources(&folder)
            .into_iter()
            .map(|(file, source)| (file, code_of(&source)))
            .collect();
        let found = circles(&files);
        assert!(
            found.is_empty(),
            "{folder} has circles:\n{}",
            found.join("\n")
        );
    }
}

#[test]
fn a_circle_is_found_however_it_is_closed() {
    let room = |a: &str, b: &str, parent: &str| {
        let files = [
            ("lib.rs", "pub mod mesh;"),
            ("mesh/mod.rs", parent),
            ("mesh/a.rs", a),
            ("mesh/b.rs", b),
        ];
        circles(&files.map(|(file, code)| (file.to_owned(), code.to_owned()))).len()
    };
    let gives_on = "mod a; mod b; pub use a::{A, F}; pub(crate) use b::B;";
    assert_eq!(
        room("use super::b::B;", "use super::a::{self, A};", gives_on),
        2
    );
    assert_eq!(
        room("use super::B;", "fn f() -> crate::mesh::A {}", gives_on),
        2,
        "through what the parent gives on"
    );
    assert_eq!(
        room(
            "use crate::mesh::{b::{B, C}, D};",
            "use super::{A};",
            "mod a; mod b; pub use a::A;"
        ),
        2
    );
    assert_eq!(
        room(
            "use super::Own;",
            "",
            "mod a; mod b; use a::A; pub struct Own;"
        ),
        2,
        "parent and child"
    );
    assert_eq!(
        room(
            "use super::Own;",
            "",
            "mod a; mod b; fn f() { a::f() } pub struct Own;"
        ),
        2
    );
    let imports = "mod a; mod b; use a::A; use b::B; use serde::Serialize;";
    assert_eq!(
        room("use super::B;", "use super::A;", imports),
        2,
        "through what the parent has for itself"
    );
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use super::b::B;"),
        ("b.rs", "use crate::a::A;"),
    ];
    assert_eq!(
        circles(&files.map(|(file, code)| (file.to_owned(), code.to_owned()))).len(),
        2,
        "from room to room"
    );
    assert_eq!(room("use super::b::B;", "", gives_on), 0);
    assert_eq!(
        room(
            "use super::{B, Serialize}; pub(in crate::mesh) struct A;",
            "",
            imports
        ),
        0
    );
    assert_eq!(
        room(
            "use super::Own; use super::B;",
            "",
            "mod a; mod b; pub use a::A; pub struct Own;"
        ),
        0
    );
}
