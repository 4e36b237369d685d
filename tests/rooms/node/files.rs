//! The files of the node use each other in one direction.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Each file below `folder` as a path of modules, with the text of it but for its inline tests.
fn files(folder: &Path, module: &str, into: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let whole = if name == "mod" {
            module.to_owned()
        } else {
            format!("{module}::{name}")
        };
        if path.is_dir() {
            files(&path, &whole, into);
        } else {
            let text = fs::read_to_string(&path).unwrap();
            into.insert(
                whole,
                text.split("#[cfg(test)]\nmod ").next().unwrap().to_owned(),
            );
        }
    }
}

/// The files that one names: `use super::replica::Edits` in `node::view` is `node::replica`.
fn used(name: &str, text: &str, known: &BTreeSet<String>) -> BTreeSet<String> {
    let parent = name.rsplit_once("::").map_or("", |(parent, _)| parent);
    let paths = text.lines().filter_map(|line| {
        let path = line
            .strip_prefix("use ")?
            .trim_end_matches(';')
            .split(['{', ' '])
            .next()?;
        let above = path
            .strip_prefix("super::")
            .map(|rest| format!("{parent}::{rest}"));
        above.or_else(|| path.strip_prefix("crate::ros::").map(str::to_owned))
    });
    let longest = |path: String| {
        known
            .iter()
            .filter(|file| format!("{path}::").starts_with(&format!("{file}::")))
            .max()
    };
    paths
        .filter_map(|path| longest(path).cloned())
        .filter(|file| file != name)
        .collect()
}

#[test]
fn no_file_of_the_node_uses_one_that_uses_it() {
    let mut texts = BTreeMap::new();
    files(
        &Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("src/ros/node"),
        "node",
        &mut texts,
    );
    let known: BTreeSet<String> = texts.keys().cloned().collect();
    let mut left: BTreeMap<_, _> = texts
        .iter()
        .map(|(name, text)| (name, used(name, text, &known)))
        .collect();
    let arrows: usize = left.values().map(BTreeSet::len).sum();
    assert!(arrows > 50, "only {arrows} uses are found");
    while let Some(name) = left
        .iter()
        .find(|(_, used)| used.is_empty())
        .map(|(name, _)| *name)
    {
        left.remove(name);
        left.values_mut().for_each(|used| _ = used.remove(name));
    }
    assert!(
        left.is_empty(),
        "circles, and what is above them: {left:#?}"
    );
}
