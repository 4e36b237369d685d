//! Sizes: of functions, as clippy measures them, and of folders.

use super::bound::Bound;
use super::source::{SOURCES, files};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Functions of more than 60 lines of code, in all compiled files: tests, benches, examples and
/// fuzz targets too.
const LONG_FUNCTIONS: Bound = Bound {
    today: 95,
    wanted: 0,
};

/// Folders with more than [`MOST_FILES`] directly in them.
const FLAT_FOLDERS: Bound = Bound {
    today: 0,
    wanted: 0,
};

const MOST_FILES: usize = 20;

const LONG: &str = concat!("clippy::too_many", "_lines");

/// The lines of a text that expect the lint for long functions of the function below them, or the
/// first line that names the lint otherwise.
fn long_functions(text: &str) -> Result<Vec<usize>, usize> {
    if !text.contains(LONG) {
        return Ok(Vec::new());
    }
    let expected = format!("#[expect({LONG})]");
    let lines: Vec<_> = text.lines().chain([""]).collect();
    let named = (1..lines.len()).filter(|&line| lines[line - 1].contains(LONG));
    named
        .map(|line| {
            let is_expected = lines[line - 1].trim() == expected && lines[line].contains("fn ");
            if is_expected { Ok(line) } else { Err(line) }
        })
        .collect()
}

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
fn functions_are_short() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let is_set = |file: &str, setting: &str| {
        let text = fs::read_to_string(root.join(file)).unwrap();
        assert!(
            text.lines().any(|line| line == setting),
            "{file}: {setting}"
        );
    };
    is_set("clippy.toml", "too-many-lines-threshold = 60");
    is_set("Cargo.toml", "too_many_lines = \"warn\"");
    let mut found = Vec::new();
    let all = [
        "src", "crates", "tests", "benches", "examples", "fuzz", "generate", "build.rs",
    ];
    for (file, text) in files(&all) {
        match long_functions(&text) {
            Ok(lines) => found.extend(lines.iter().map(|line| format!("{file}:{line}"))),
            Err(line) => panic!("{file}:{line}: the lint may only be expected, of one function"),
        }
    }
    LONG_FUNCTIONS.hold_cases(&found);
}

#[test]
fn folders_are_lists_of_ideas() {
    FLAT_FOLDERS.hold_cases(&flat_folders(SOURCES.iter().map(|source| source.file)));
}

#[test]
fn expected_long_functions_are_counted() {
    let expected = format!("\n#[test]\n    #[expect({LONG})]\n    pub fn f() {{}}\nfn g() {{}}\n");
    assert_eq!(long_functions(&expected.repeat(2)), Ok(vec![3, 8]));
    assert_eq!(long_functions("fn f() {}"), Ok(vec![]));
    for (level, item) in [("allow", "fn f()"), ("expect", "mod tests"), ("expect", "")] {
        let text = format!("use a;\n#[{level}({LONG})]\n{item}");
        assert_eq!(long_functions(&text), Err(2), "{level} {item}");
    }
    assert_eq!(
        long_functions(&format!("#![expect({LONG})]\nfn f()")),
        Err(1)
    );
}

#[test]
fn a_folder_is_flat_by_its_own_files() {
    let within = (0..20).map(|file| format!("src/a/{file}.rs"));
    let beyond = (0..21).map(|file| format!("src/a/b/{file}.rs"));
    let files: Vec<_> = within.chain(beyond).collect();
    let found = flat_folders(files.iter().map(String::as_str));
    assert_eq!(found, ["src/a/b: 21"]);
}
