//! Reading of Rust: files, the tokens of their code, the lines of their comments.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// One file.
pub struct Source<'a> {
    /// path from the root of the repository
    pub file: &'a str,
    /// words and signs of the code: `use crate::{io, mesh::TriMesh}` is use crate :: { io , mesh ::
    /// TriMesh }; without comments, strings, characters and `#[cfg(test)] mod … { … }`
    pub tokens: Vec<&'a str>,
    /// each line that is a comment alone, outside inline tests, with the number of tokens before it
    pub comments: Vec<(usize, &'a str)>,
    /// whether it is below a module for tests alone
    pub of_tests: bool,
}

/// All files below `src` and `crates/*/src`.
pub static SOURCES: LazyLock<Vec<Source>> = LazyLock::new(|| {
    static TEXTS: LazyLock<Vec<(String, String)>> = LazyLock::new(|| files(&["src", "crates"]));
    let texts = TEXTS.iter();
    let texts = texts.filter(|(file, _)| file.starts_with("src/") || file.contains("/src/"));
    let mut sources: Vec<_> = texts.map(|(file, text)| Source::of(file, text)).collect();
    let tests: BTreeSet<_> = sources.iter().flat_map(Source::modules_of_tests).collect();
    for source in &mut sources {
        let module = Path::new(source.file).with_extension("");
        source.of_tests = module.ancestors().any(|module| tests.contains(module));
    }
    sources
});

/// The files of the program, without those of its tests.
pub fn of_program() -> impl Iterator<Item = &'static Source<'static>> {
    SOURCES.iter().filter(|source| !source.of_tests)
}

/// Every file of Rust that is or is below one of `paths`: path from the root, and text.
pub fn files(paths: &[&str]) -> Vec<(String, String)> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let mut paths: Vec<_> = paths.iter().map(|path| root.join(path)).collect();
    let mut found = Vec::new();
    while let Some(path) = paths.pop() {
        if path.is_dir() {
            let entries = fs::read_dir(path).unwrap();
            paths.extend(entries.map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let file = path.strip_prefix(root).unwrap().to_str().unwrap();
            found.push((file.to_owned(), fs::read_to_string(&path).unwrap()));
        }
    }
    found.sort();
    found
}

const CFG_TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];

impl<'a> Source<'a> {
    /// Of a file with this text.
    pub fn of(file: &'a str, text: &'a str) -> Self {
        let bytes = text.as_bytes();
        let (mut tokens, mut comments) = (Vec::new(), Vec::new());
        let (mut at, mut line) = (0, 0);
        while at < bytes.len() {
            let rest = &bytes[at..];
            let word = word_length(rest);
            let length = match rest[0] {
                b'\n' => {
                    line = at + 1;
                    1
                }
                b' ' | b'\t' | b'\r' => 1,
                b'/' if rest.starts_with(b"//") => {
                    let length = length_until(rest, b'\n');
                    if text[line..at].trim().is_empty() {
                        comments.push((tokens.len(), text[at..at + length].trim_end()));
                    }
                    length
                }
                b'/' if rest.starts_with(b"/*") => block_comment_length(rest),
                b'"' => quoted_length(rest),
                b'\'' if is_character(rest) => quoted_length(rest),
                b'r' | b'b' | b'c' if raw_string_length(rest, word) > 0 => {
                    raw_string_length(rest, word)
                }
                _ => {
                    let is_path = rest.starts_with(b"::");
                    let length = if is_path { 2 } else { word.max(1) };
                    tokens.push(&text[at..at + length]);
                    length
                }
            };
            at += length;
        }
        let mut source = Self {
            file,
            tokens,
            comments,
            of_tests: false,
        };
        source.drop_inline_tests();
        source
    }

    fn drop_inline_tests(&mut self) {
        let tokens = std::mem::take(&mut self.tokens);
        let mut at = 0;
        while at < tokens.len() {
            let is_test = tokens[at] == "#" && tokens[at..].starts_with(&CFG_TEST);
            let item = &tokens[at..][if is_test { CFG_TEST.len() } else { 0 }..];
            if is_test && item.first() == Some(&"mod") && item.get(2) == Some(&"{") {
                let end = tokens.len() - item.len() + block_length(item);
                self.comments
                    .retain(|(before, _)| !(at..end).contains(before) || *before == at);
                at = end;
            } else {
                self.tokens.push(tokens[at]);
                at += 1;
            }
        }
    }

    /// The modules that a file has for its tests alone, without extension: those that it declares
    /// below `#[cfg(test)]`. They and all that is below them may use all rooms.
    fn modules_of_tests(&self) -> Vec<PathBuf> {
        let module = self.file.trim_end_matches(".rs");
        let folder = ["/mod", "/lib"]
            .iter()
            .find_map(|end| module.strip_suffix(end));
        let folder = Path::new(folder.unwrap_or(module));
        let declared = self.tokens.windows(CFG_TEST.len() + 3);
        let declared = declared.filter(|tokens| tokens[0] == "#" && tokens.starts_with(&CFG_TEST));
        declared
            .filter_map(|tokens| match tokens[CFG_TEST.len()..] {
                ["mod", name, ";"] => Some(folder.join(name)),
                _ => None,
            })
            .collect()
    }
}

fn word_length(rest: &[u8]) -> usize {
    let mut length = 0;
    while length < rest.len()
        && matches!(rest[length], b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'_' | 128..)
    {
        length += 1;
    }
    length
}

fn length_until(rest: &[u8], end: u8) -> usize {
    let mut length = 0;
    while length < rest.len() && rest[length] != end {
        length += 1;
    }
    length
}

fn block_comment_length(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                break;
            }
        } else {
            at += 1;
        }
    }
    at
}

/// Whether a character begins here, rather than a lifetime.
fn is_character(rest: &[u8]) -> bool {
    let width = rest.get(1).map_or(0, |first| match first {
        ..0xc0 => 1,
        0xc0..0xe0 => 2,
        0xe0..0xf0 => 3,
        0xf0.. => 4,
    });
    rest.get(1) == Some(&b'\\') || rest.get(1 + width) == Some(&b'\'')
}

/// Of a string or character in the quotes that it begins with.
fn quoted_length(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != rest[0] {
        at += if rest[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(rest.len())
}

/// Of a raw string, whose prefix is a word of this length; 0 for another word.
fn raw_string_length(rest: &[u8], word: usize) -> usize {
    if !matches!(&rest[..word], b"r" | b"br" | b"cr") {
        return 0;
    }
    let hashes = length_until_other(&rest[word..], b'#');
    if rest.get(word + hashes) != Some(&b'"') {
        return 0;
    }
    let mut at = word + hashes + 1;
    while at < rest.len() {
        let is_end = rest[at] == b'"' && length_until_other(&rest[at + 1..], b'#') >= hashes;
        if is_end {
            return at + 1 + hashes;
        }
        at += 1;
    }
    rest.len()
}

fn length_until_other(rest: &[u8], same: u8) -> usize {
    let mut length = 0;
    while length < rest.len() && rest[length] == same {
        length += 1;
    }
    length
}

/// Up to just behind the first `{ … }`.
fn block_length(tokens: &[&str]) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        match *token {
            "{" => depth += 1,
            "}" if depth == 1 => return at + 1,
            "}" => depth -= 1,
            _ => {}
        }
    }
    tokens.len()
}

#[test]
fn code_and_comments_are_told_apart() {
    let text = r##"
        // use a
        /* b /* c */ d */ let e = 'f'; // g
        let h = ["i // \" j", r#"k " l"#, b"m", br"\"]; fn n<'o>(p: &'o str) { '\''; 'ä' }
        /// q `r`
        #[cfg(test)]
        mod s { fn t() { {} } // u
            // v
        }
        // w
        mod x;
    "##;
    let source = Source::of("", text);
    let code = "let e = ; let h = [ , , b , ] ; fn n < ' o > ( p : & ' o str ) { ; } mod x ;";
    assert_eq!(source.tokens.join(" "), code);
    let comments: Vec<_> = source.comments.iter().map(|(_, line)| *line).collect();
    assert_eq!(comments, ["// use a", "/// q `r`", "// w"]);
}

#[test]
fn modules_of_tests_alone_are_known() {
    let text = "#[cfg(test)]\nmod scripted;\nmod b;\n#[cfg(test)]\nmod tests {\n    mod inner;\n}\n\
                #[cfg(test)]\nmod more;\n";
    let of_control = ["src/ur/control/scripted", "src/ur/control/more"].map(PathBuf::from);
    let declared = |file, text| Source::of(file, text).modules_of_tests();
    assert_eq!(declared("src/ur/control.rs", text), of_control);
    assert_eq!(
        declared("src/ur/mod.rs", "#[cfg(test)]\nmod a;"),
        [PathBuf::from("src/ur/a")]
    );
}
