//! Names of types: one meaning each, and a noun.

use super::bound::Bound;
use super::source::{Source, of_program};
use std::collections::BTreeMap;

/// Names of types with two definitions or more.
const HOMONYMS: Bound = Bound {
    today: 15,
    wanted: 15,
};

/// Types without a noun as their name.
const NO_NOUNS: Bound = Bound {
    today: 0,
    wanted: 0,
};

/// Nouns that end as participles do.
const NOUNS_IN_ED: &[&str] = &["Bed", "Feed", "Need", "Reed", "Seed", "Speed", "Weed"];

/// Participles other than in -ed; words that stand for a noun; words of place, time and manner;
/// pictures.
const OTHER_WORDS: &str = "\
    Begun Built Done Drawn Found Given Gone Heard Held Kept Known Left Lost Made Met Run Seen \
    Sent Sewn Shown Slid Taken Told Written Doing Growing Lacking Leading Moving Outgoing \
    Running Waiting Working Both Other Others Own Six Theirs Two Alone Along Backwards Common \
    Compact During Implausible Inside Latest Local Loose Manual Narrower Nearby Newest Outside \
    Past Possible Ready Land Skin";

/// The types that a file defines, in the order of the text: structs, enums, unions, traits, and
/// aliases other than those inside a trait or an `impl`.
fn types_in<'a>(source: &Source<'a>) -> Vec<&'a str> {
    let mut types = Vec::new();
    // the keywords of the item at hand and of the items around it
    let (mut item, mut around) = ("", Vec::new());
    for pair in source.tokens.windows(2) {
        match pair[0] {
            ";" => item = "",
            "{" => around.push(std::mem::take(&mut item)),
            "}" => {
                around.pop();
                item = "";
            }
            word @ ("struct" | "enum" | "union" | "trait" | "type" | "impl" | "fn" | "mod")
                if item.is_empty() =>
            {
                item = word;
                let is_definition = match word {
                    "impl" | "fn" | "mod" => false,
                    "type" => !matches!(around.last(), Some(&("impl" | "trait"))),
                    _ => true,
                };
                if is_definition && pair[1].starts_with(|c: char| c.is_uppercase()) {
                    types.push(pair[1]);
                }
            }
            _ => {}
        }
    }
    types
}

/// Whether a name is one word in -ed, or of the list.
fn is_no_noun(name: &str) -> bool {
    let is_one_word = !name[1..].contains(|c: char| c.is_uppercase());
    let is_participle = name.ends_with("ed") && !NOUNS_IN_ED.contains(&name);
    is_one_word && is_participle || OTHER_WORDS.split(' ').any(|word| word == name)
}

/// Each name with two definitions or more, and the files of those.
fn homonyms<'a>(sources: impl Iterator<Item = &'a Source<'a>>) -> Vec<String> {
    let mut files: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for source in sources {
        for name in types_in(source) {
            files.entry(name).or_default().push(source.file);
        }
    }
    let several = files.into_iter().filter(|(_, files)| files.len() > 1);
    let lines = several.map(|(name, files)| format!("{name}: {}", files.join(" ")));
    lines.collect()
}

#[test]
fn a_name_of_a_type_has_one_meaning() {
    HOMONYMS.hold_cases(&homonyms(of_program()));
}

#[test]
fn types_are_named_by_nouns() {
    let found = of_program().flat_map(|source| {
        let names = types_in(source).into_iter().filter(|name| is_no_noun(name));
        names.map(|name| format!("{name}: {}", source.file))
    });
    NO_NOUNS.hold_cases(&found.collect::<Vec<_>>());
}

#[test]
fn types_are_found_however_they_are_written() {
    let text = "
        #[derive(Debug)] pub(crate) struct A<T: Into<D>>(T); enum B { C, D } type E = A<B>;
        mod inner { pub unsafe trait F { type G: Iterator; fn h(&self) -> impl Iterator; } }
        impl<T> F for A<T> { type G = T; fn h(&self) -> impl Iterator { struct I; type J = I; I } }
        // struct K;
        macro_rules! l { ($m:ident) => { struct $m; } }
        #[cfg(test)] mod tests { struct B; }
        fn n(r#type: A, s: impl F) { let t = \"struct O\"; union.p() } union Q { r: u8 }
        type B = u8;
    ";
    let source = Source::of("a.rs", text);
    assert_eq!(types_in(&source).concat(), "ABEFIJQB");
    assert_eq!(homonyms([source].iter()), ["B: a.rs a.rs"]);
}

#[test]
fn participles_and_pronouns_are_no_nouns() {
    let names = [
        "Asked",
        "Seed",
        "Met",
        "Own",
        "NotReached",
        "Contact",
        "Aligned",
        "Speed",
    ];
    assert_eq!(
        names.map(is_no_noun).map(u8::from),
        [1, 0, 1, 1, 0, 0, 1, 0]
    );
}
