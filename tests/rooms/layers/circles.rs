//! Circles of use: between files of a crate, and between folders.

use super::source::Source;
use super::uses::{CRATES, Module, Uses, uses};
use std::collections::{BTreeMap, BTreeSet};

/// Modules of one crate that use one another in a circle, each with those that it uses.
fn circles(mut uses: Uses) -> Vec<String> {
    // a module without users or without uses among the rest is in no circle
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

/// Circles of use between the entries of a folder, which are its files and folders: each as the
/// folder and its entries in the circle; `mod` is the file of the folder itself.
///
/// - `tests`: modules that do not count.
fn folder_circles<'a>(uses: &Uses<'a>, tests: &BTreeSet<Module<'a>>) -> BTreeSet<String> {
    let mut folders: BTreeMap<&[&str], BTreeMap<&str, BTreeSet<&str>>> = BTreeMap::new();
    for (user, used) in uses.iter().filter(|(user, _)| !tests.contains(*user)) {
        // the root stands for other crates
        for other in used.iter().filter(|other| !other.is_empty()) {
            let pairs = user.iter().zip(other);
            let common = pairs.take_while(|(one, other)| one == other).count();
            let entry = |module: &Module<'a>| module.get(common).copied().unwrap_or("mod");
            let entries = folders.entry(&user[..common]).or_default();
            entries.entry(entry(user)).or_default().insert(entry(other));
        }
    }
    let circles = folders.iter().flat_map(|(folder, entries)| {
        let reached = |one: &'a str| {
            let (mut reached, mut next) = (BTreeSet::new(), vec![one]);
            while let Some(entry) = next.pop() {
                let others = entries.get(entry).into_iter().flatten();
                next.extend(others.filter(|other| reached.insert(**other)));
            }
            reached
        };
        entries.keys().filter_map(move |one| {
            let mut circle = reached(one);
            circle.retain(|other| reached(other).contains(one));
            let circle: Vec<_> = circle.into_iter().collect();
            (!circle.is_empty()).then(|| format!("{}: {}", folder.join("/"), circle.join(" ")))
        })
    });
    circles.collect()
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

#[test]
fn entries_of_a_folder_use_one_another_one_way() {
    let found = CRATES.iter().flat_map(|one| {
        let circles = folder_circles(&one.uses, &one.tests).into_iter();
        circles.map(|circle| format!("{}/{circle}", one.folder))
    });
    let found: Vec<_> = found.collect();
    assert!(found.is_empty(), "circles: {found:#?}");
}

/// Number of modules of these files in circles.
fn circles_of(files: &[(&str, &str)]) -> usize {
    let sources: Vec<_> = sources_of(files);
    circles(uses(&sources.iter().collect::<Vec<_>>())).len()
}

/// Of these files below `src` and their texts.
fn sources_of<'a>(files: &[(&'a str, &'a str)]) -> Vec<Source<'a>> {
    let sources = files.iter().map(|(file, text)| Source::of(file, text));
    sources.collect()
}

/// Of two files in a folder, by their texts and that of the parent.
fn circles_in_a_room(a: &str, b: &str, parent: &str) -> usize {
    circles_of(&[
        ("src/lib.rs", "pub mod mesh;"),
        ("src/mesh/mod.rs", parent),
        ("src/mesh/a.rs", a),
        ("src/mesh/b.rs", b),
    ])
}

const GIVES_ON: &str = "mod a; mod b; pub use a::{A, F}; pub(crate) use b::B;";
const IMPORTS: &str = "mod a; mod b; use a::A; use b::B; use serde::Serialize;";

#[test]
fn a_circle_is_found_however_it_is_closed() {
    let closed = [
        ("use super::b::B;", "use super::a::{self, A};", GIVES_ON),
        // through a re-export of the parent
        ("use super::B;", "fn f() -> crate::mesh::A {}", GIVES_ON),
        (
            "use crate::mesh::{b::{B, C}, D};",
            "use super::{A};",
            "mod a; mod b; pub use a::A;",
        ),
        // through an import of the parent for itself
        ("use super::B;", "use super::A;", IMPORTS),
        // parent and child
        (
            "use super::Own;",
            "",
            "mod a; mod b; use a::A; pub struct Own;",
        ),
        (
            "use super::Own;",
            "",
            "mod a; mod b; fn f() { a::f() } pub struct Own;",
        ),
    ];
    for (a, b, parent) in closed {
        assert_eq!(circles_in_a_room(a, b, parent), 2, "{a} {b} {parent}");
    }
    let from_room_to_room = [
        ("src/lib.rs", "mod a; mod b;"),
        ("src/a.rs", "use super::b::B;"),
        ("src/b.rs", "use crate::a::A;"),
    ];
    assert_eq!(circles_of(&from_room_to_room), 2);
}

#[test]
fn one_way_is_no_circle() {
    let open = [
        ("use super::b::B;", "", GIVES_ON),
        (
            "use super::{B, Serialize}; pub(in crate::mesh) struct A;",
            "",
            IMPORTS,
        ),
        (
            "use super::Own; use super::B;",
            "",
            "mod a; mod b; pub use a::A; pub struct Own;",
        ),
    ];
    for (a, b, parent) in open {
        assert_eq!(circles_in_a_room(a, b, parent), 0, "{a} {b} {parent}");
    }
}

#[test]
fn a_circle_of_folders_is_found_at_each_level() {
    let circles = |texts: [&str; 5], tests: &[&[&str]]| {
        let files = ["a/mod", "a/b/one", "a/b/two", "a/c/three", "a/d"];
        let files = files.map(|file| format!("src/{file}.rs"));
        let files = files.iter().map(String::as_str).zip(texts);
        let sources = sources_of(&files.collect::<Vec<_>>());
        let sources: Vec<_> = sources.iter().collect();
        let tests = tests.iter().map(|module| module.to_vec()).collect();
        Vec::from_iter(folder_circles(&uses(&sources), &tests))
    };
    let between = [
        "",
        "use crate::a::c::three::A;",
        "",
        "fn f() { super::super::b::two::f() }",
        "",
    ];
    assert_eq!(circles(between, &[]), ["a: b c"], "no file is in a circle");
    assert_eq!(circles(between, &[&["a", "b", "one"]]), [""; 0]);
    let one_way = [
        "",
        "use crate::a::c::three::A;",
        "use super::one::B;",
        "",
        "use super::b::two::C;",
    ];
    assert_eq!(circles(one_way, &[]), [""; 0]);
    let over_a_file = [
        "",
        "use super::super::d::A;",
        "",
        "",
        "use crate::a::b::two::B;",
    ];
    assert_eq!(circles(over_a_file, &[]), ["a: b d"]);
    let with_parent = [
        "use crate::a::b::two::A; struct Own;",
        "use crate::a::Own;",
        "",
        "",
        "",
    ];
    assert_eq!(circles(with_parent, &[]), ["a: b mod"]);
    let three = [
        "",
        "use crate::a::c::three::A;",
        "use super::super::d::D;",
        "use super::super::d::C;",
        "use super::b::two::B;",
    ];
    assert_eq!(circles(three, &[]), ["a: b c d"]);
}
