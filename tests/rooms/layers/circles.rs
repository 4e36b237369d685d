//! Circles of use between files of a crate.

use super::source::Source;
use super::uses::{CRATES, Uses, uses};
use std::collections::BTreeSet;

/// Modules of one crate that use one another in a circle, each with those that it uses.
fn circles(mut uses: Uses) -> Vec<String> {
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
fn files_of_a_crate_use_one_another_one_way() {
    for one in CRATES.iter() {
        let found = circles(one.uses.clone());
        assert!(
            found.is_empty(),
            "{} has circles:\n{}",
            one.folder,
            found.join("\n")
        );
    }
}

/// How many modules of these files are in circles.
fn circles_of(files: &[(&str, &str)]) -> usize {
    let sources: Vec<_> = sources_of(files);
    circles(uses(&sources.iter().collect::<Vec<_>>())).len()
}

/// Of these files below `src` and their texts.
fn sources_of<'a>(files: &[(&'a str, &'a str)]) -> Vec<Source<'a>> {
    let sources = files.iter().map(|(file, text)| Source::of(file, text));
    sources.collect()
}

#[test]
fn a_circle_is_found_however_it_is_closed() {
    let room = |a: &str, b: &str, parent: &str| {
        let files = [
            ("src/lib.rs", "pub mod mesh;"),
            ("src/mesh/mod.rs", parent),
            ("src/mesh/a.rs", a),
            ("src/mesh/b.rs", b),
        ];
        circles_of(&files)
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
        ("src/lib.rs", "mod a; mod b;"),
        ("src/a.rs", "use super::b::B;"),
        ("src/b.rs", "use crate::a::A;"),
    ];
    assert_eq!(circles_of(&files), 2, "from room to room");
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
