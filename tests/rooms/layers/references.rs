//! References between rooms, and to files, threads, clock, environment and printing in a crate that
//! is pure.

use super::rooms::{
    IMPURE_NAMES, IMPURE_PATHS, MAY_ASK_THE_SYSTEM, MAY_OPEN_FILES, MAY_USE, MAY_USE_PYTHON, PURE,
    Place, WHOLE, WITH_ROOMS,
};
use super::source::{SOURCES, Source, of_program};

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

/// The rooms that `tokens` reach: of other crates by their names, of the own one from its root or
/// by enough `super`.
///
/// - `depth`: of [`Place`].
fn rooms_reached<'a>(tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let mut rooms = Vec::new();
    for (at, &token) in tokens.iter().enumerate() {
        let behind = match at {
            0 => "",
            _ => tokens[at - 1],
        };
        if token.starts_with("touchup_") {
            let whole = WHOLE.iter().filter(|(name, _)| *name == token);
            rooms.extend(whole.map(|(_, room)| *room));
        }
        if tokens.get(at + 1) != Some(&"::") {
            continue;
        }
        let is_inner = behind == "::";
        let is_root = match token {
            "crate" => depth > 0 && !is_inner,
            _ => WITH_ROOMS.contains(&token),
        };
        if is_root {
            rooms.extend(names_at(tokens, at + 2));
        } else if token == "super" && !(is_inner && at > 1 && tokens[at - 2] == "super") {
            let pairs = tokens[at..].chunks(2);
            let supers = pairs.take_while(|pair| *pair == ["super", "::"]).count();
            if depth > 0 && supers >= depth {
                rooms.extend(names_at(tokens, at + 2 * supers));
            }
        }
    }
    rooms
}

/// Every breach in one file, each as one line.
fn breaches(source: &Source) -> Vec<String> {
    let mut found = wrong_rooms(source);
    found.extend(wrong_world(source));
    found
}

fn wrong_rooms(source: &Source) -> Vec<String> {
    let file = source.file;
    let place = Place::of(file);
    if place.room.is_empty() {
        return Vec::new();
    }
    let Some((room, allowed)) = MAY_USE.iter().find(|(room, _)| *room == place.room) else {
        return vec![format!(
            "{file}: the room {} is not in the table of tests/rooms/layers/rooms.rs",
            place.room
        )];
    };
    let is_room = |name: &str| MAY_USE.iter().any(|(room, _)| *room == name);
    let may_use = |name: &str| name == *room || allowed.split(' ').any(|one| one == name);
    rooms_reached(&source.tokens, place.depth)
        .into_iter()
        .filter(|name| is_room(name) && !may_use(name))
        .map(|name| format!("{file}: {room} may not use {name}"))
        .collect()
}

/// Files, threads, clock, environment, printing and Python in the wrong place.
fn wrong_world(source: &Source) -> Vec<String> {
    let (file, tokens) = (source.file, &source.tokens);
    let package = Place::of(file).package;
    let is_pure = PURE.contains(&package);
    let is_in = |starts: &[&str]| starts.iter().any(|start| file.starts_with(start));
    let may_open_files =
        is_in(MAY_OPEN_FILES) || is_in(MAY_ASK_THE_SYSTEM) || file == "src/main.rs";
    let mut found = Vec::new();
    for (at, &token) in tokens.iter().enumerate() {
        if token == "std" && tokens.get(at + 1) == Some(&"::") {
            let wrong = names_at(tokens, at + 2).into_iter().filter(|name| {
                let is_impure = || IMPURE_PATHS.contains(&format!("std::{name}").as_str());
                *name == "fs" && !may_open_files || is_pure && is_impure()
            });
            found.extend(wrong.map(|name| format!("{file} may not use std::{name}")));
        }
        if is_pure && IMPURE_NAMES.contains(&token) {
            found.push(format!("{file}: {package} is pure and may not use {token}"));
        }
        if token == "pyo3" && !is_in(MAY_USE_PYTHON) {
            let places = MAY_USE_PYTHON.join(", ");
            found.push(format!("{file}: Python is in {places} alone"));
        }
    }
    found
}

#[test]
fn every_room_keeps_to_the_flow_of_data() {
    for (room, _) in MAY_USE {
        assert!(
            SOURCES
                .iter()
                .any(|source| Place::of(source.file).room == *room),
            "no file is in the room {room} of the table"
        );
    }
    let found: Vec<_> = of_program().flat_map(breaches).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// A file below the `src` of the crate of its room, or a path from the root of the repository.
fn path_of(file: &str) -> String {
    let (room, _) = file.split_once('/').unwrap();
    let package = match room {
        "mesh" => "geometry",
        "stylus" | "haptic" | "cellar" => "method",
        "arm" => "probing",
        "node" | "ur" => "node",
        _ => return file.to_owned(),
    };
    format!("crates/touchup-{package}/src/{file}")
}

/// Files, and texts with one breach each.
const BREACHES: &[(&str, &str)] = &[
    ("stylus/sync.rs", "use touchup_geometry::mesh::TriMesh;"),
    (
        "stylus/sync.rs",
        "use touchup_geometry::{mesh::{TriMesh, FaceId}, numeric::mean};",
    ),
    ("stylus/sync.rs", "fn f() -> crate :: reconstruct::Error {}"),
    ("stylus/sync.rs", "use super::super::haptic;"),
    ("stylus/mod.rs", "use super::{stylus, haptic};"),
    ("mesh/mod.rs", "use super::form;"),
    ("mesh/repair/weld.rs", "use super::super::super::form;"),
    (
        "crates/touchup-session/src/scene/mod.rs",
        "use crate::live;",
    ),
    ("node/mod.rs", "use crate::page::WebServer;"),
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
        "#[cfg(test)] mod tests { fn f() { { } } } use crate::form;",
    ),
    ("src/cli/demo.rs", "std::fs::write(path, text)"),
    ("arm/touching.rs", "use std::thread;"),
    ("ur/client.rs", "use pyo3::Python;"),
    ("src/cli/ur.rs", "pyo3::Python::attach(f)"),
    ("ur/setup.rs", "std::fs::read(path)"),
    ("ur/arm.rs", "use crate::ros::port::Port;"),
    ("ur/arm.rs", "use touchup_sim::Plate;"),
    (
        "crates/touchup-sim/src/arm.rs",
        "use touchup_method::reconstruct::Patcher;",
    ),
    (
        "crates/touchup-sim/src/arm.rs",
        "use touchup_features::{features::Kind, align::Motion};",
    ),
    (
        "crates/touchup-session/src/scene/mod.rs",
        "fn f() -> touchup_features::features::Kind {}",
    ),
    (
        "crates/touchup-session/src/session/mod.rs",
        "use touchup_sim::Plate;",
    ),
    ("cellar/mod.rs", ""),
];

#[test]
fn a_breach_is_found_however_it_is_written() {
    for (file, source) in BREACHES {
        let found = breaches(&Source::of(&path_of(file), source));
        assert_eq!(found.len(), 1, "{file}: {source}: {found:?}");
    }
}

#[test]
fn what_is_allowed_is_let_through() {
    let good = [
        (
            "haptic/mod.rs",
            "use crate::stylus::Sample; use crate::{reconstruct::Patcher, haptic::Update}; use super::stylus;",
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
            "use super::haptic_like; use super::super::stylus::sync;",
        ),
        (
            "mesh/mod.rs",
            "#[cfg(test)] mod tests { use crate::form; fn f() { println!(\"}\"); } } fn g() {}",
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
            "ur/client.rs",
            "use std::{thread, process}; use std::time::Instant; use touchup_probing::arm::ArmError;",
        ),
        ("ur/child/library.rs", "use pyo3::Python;"),
        ("src/main.rs", "use std::fs; fn main() { println!() }"),
    ];
    for (file, source) in good {
        assert_eq!(
            breaches(&Source::of(&path_of(file), source)),
            Vec::<String>::new(),
            "{file}: {source}"
        );
    }
}
