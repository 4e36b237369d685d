//! The modules of a crate, and which of them each one uses.

use super::source::{SOURCES, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// A module by its path from the root of its crate.
pub type Module<'a> = Vec<&'a str>;

/// Each module of a crate with those that it uses.
pub type Uses<'a> = BTreeMap<Module<'a>, BTreeSet<Module<'a>>>;

/// One crate.
pub struct Crate {
    /// folder of its sources
    pub folder: String,
    pub uses: Uses<'static>,
    /// the modules of its tests
    pub tests: BTreeSet<Module<'static>>,
}

/// All crates of the repository with sources.
pub static CRATES: LazyLock<Vec<Crate>> = LazyLock::new(|| {
    let mut crates: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for source in SOURCES.iter() {
        let (folder, _) = source.file.split_once("src/").unwrap();
        crates.entry(folder).or_default().push(source);
    }
    let crates = crates.into_iter().map(|(folder, sources)| Crate {
        folder: format!("{folder}src"),
        uses: uses(&sources),
        tests: sources
            .iter()
            .filter(|source| source.of_tests)
            .map(|source| module_in(source.file))
            .collect(),
    });
    crates.collect()
});

/// The modules of one crate, each with the tokens of its code.
type Modules<'a> = BTreeMap<Module<'a>, &'a [&'a str]>;

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

/// Paths from the root of the crate.
#[derive(Default)]
struct Paths<'a> {
    /// of its crate
    used: BTreeSet<Vec<&'a str>>,
    /// by `use`, of other crates too: those begin with `::`
    imported: Vec<Vec<&'a str>>,
}

/// Those that a module names.
fn paths_of<'a>(module: &[&'a str], modules: &Modules<'a>) -> Paths<'a> {
    let tokens = modules[module];
    let children = modules.range(module.to_vec()..);
    let children: BTreeSet<_> = children
        .take_while(|(name, _)| name.starts_with(module))
        .filter(|(name, _)| name.len() == module.len() + 1)
        .map(|(name, _)| name[module.len()])
        .collect();
    let mut paths = Paths::default();
    let (mut at, mut is_public) = (0, false);
    while at < tokens.len() {
        match tokens[at] {
            "pub" => is_public = true,
            "fn" | "mod" | "struct" | ";" | "{" => is_public = false,
            _ => {}
        }
        let is_use = at > 0 && tokens[at - 1] == "use";
        let begins_path = || {
            let begins = at > 0 && tokens.get(at + 1) == Some(&"::") && tokens[at - 1] != "::";
            let is_visibility = || tokens[..at].ends_with(&["pub", "(", "in"]);
            begins
                && (children.contains(tokens[at])
                    || matches!(tokens[at], "crate" | "super" | "self") && !is_visibility())
        };
        if !is_use && !begins_path() {
            at += 1;
            continue;
        }
        for path in paths_at(tokens, &mut at, &[]) {
            let supers = path.iter().take_while(|part| **part == "super").count();
            let mut path = match path.first() {
                Some(&"crate") => path[1..].to_vec(),
                Some(&"super") => [&module[..module.len() - supers], &path[supers..]].concat(),
                Some(&"self") => [module, &path[1..]].concat(),
                Some(first) if children.contains(first) => [module, &path].concat(),
                _ => [&["::"], &path[..]].concat(),
            };
            path.pop_if(|last| *last == "self");
            if is_use && path.last().is_some_and(|last| *last != "*") {
                paths.imported.push(path.clone());
            }
            if !(is_use && is_public) && path.first() != Some(&"::") {
                paths.used.insert(path);
            }
        }
    }
    paths
}

/// The module that a file is.
fn module_in(file: &str) -> Vec<&str> {
    let (_, path) = file.split_once("src/").unwrap();
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod");
    if path == "lib" {
        Vec::new()
    } else {
        path.split('/').collect()
    }
}

/// The module that defines the item of a path: the longest start of the path that is a module,
/// followed through imports and re-exports of modules; for an item of another crate the root, which
/// uses none.
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

/// Of the files of one crate.
pub fn uses<'a>(sources: &[&'a Source<'a>]) -> Uses<'a> {
    let modules: Modules = sources
        .iter()
        .map(|source| (module_in(source.file), &source.tokens[..]))
        .collect();
    let paths: Vec<_> = modules
        .keys()
        .map(|name| (name, paths_of(name, &modules)))
        .collect();
    let imported = paths.iter().flat_map(|(name, paths)| {
        let origins = paths.imported.iter();
        origins.map(|origin| ([name, &origin[origin.len() - 1..]].concat(), origin.clone()))
    });
    let imported: BTreeMap<_, _> = imported.collect();
    let uses = paths.iter().map(|(name, paths)| {
        let used = paths.used.iter();
        let others = used.map(|path| module_of(path, &modules, &imported));
        let others = others.filter(|other| other != *name).collect();
        ((*name).clone(), others)
    });
    uses.collect()
}
