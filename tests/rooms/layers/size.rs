//! Sizes of folders.

use super::bound::Bound;
use super::source::SOURCES;
use std::collections::BTreeMap;
use std::path::Path;

/// Folders with more than [`MOST_FILES`] directly in them.
const FLAT_FOLDERS: Bound = Bound {
    today: 9,
    wanted: 0,
};

const MOST_FILES: usize = 20;

/// Folders with more files directly in them, each with their number.
fn flat_folders<'a>(files: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut folders: BTreeMap<_, usize> = BTreeMap::new();
    for file in files {
        *folders.entry(Path::new(file).parent()).or_default() += 1;
    }
    let flat = folders.into_iter().filter(|(_, files)| *files > MOST_FILES);
    flat.map(|(folder, files)| format!("{}: {files}", folder.unwrap().display()))
        .collect()
}

#[test]
fn folders_are_lists_of_ideas() {
    FLAT_FOLDERS.hold_cases(&flat_folders(SOURCES.iter().map(|source| source.file)));
}

#[test]
fn a_folder_is_flat_by_its_own_files() {
    let within = (0..20).map(|file| format!("src/a/{file}.rs"));
    let beyond = (0..21).map(|file| format!("src/a/b/{file}.rs"));
    let files: Vec<_> = within.chain(beyond).collect();
    let found = flat_folders(files.iter().map(String::as_str));
    assert_eq!(found, ["src/a/b: 21"]);
}
