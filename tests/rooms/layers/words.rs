//! Patterns of speech that plain English does without, each per 1,000 lines of comments.

use super::bound::{Bound, per_thousand};
use super::source::{Source, files};
use std::sync::LazyLock;

const WHAT: Bound = Bound {
    today: 8,
    wanted: 8,
};
const WHERE: Bound = Bound {
    today: 8,
    wanted: 8,
};
const SO_MANY: Bound = Bound {
    today: 1,
    wanted: 1,
};
const PASSIVES: Bound = Bound {
    today: 60,
    wanted: 60,
};
const UNFINISHED: Bound = Bound {
    today: 0,
    wanted: 0,
};

/// The comments of files.
#[derive(Default)]
struct Comments {
    /// lines with text, outside fenced code
    lines: usize,
    /// lines that begin or end with an ellipsis
    unfinished: usize,
    /// words in lower case, and signs, of the lines that follow one another without a break
    paragraphs: Vec<Vec<String>>,
}

impl Comments {
    fn of<'a>(sources: impl Iterator<Item = &'a Source<'a>>) -> Self {
        let mut comments = Self::default();
        for source in sources {
            comments.add(source);
        }
        comments
    }

    fn add(&mut self, source: &Source) {
        let (mut last, mut is_code, mut goes_on) = ((0, ""), false, false);
        for (before, line) in &source.comments {
            let text = line.trim_start_matches('/').trim_start_matches('!');
            let place = (*before, &line[..line.len() - text.len()]);
            if std::mem::replace(&mut last, place) != place {
                (is_code, goes_on) = (false, false);
            }
            let text = text.trim();
            let is_fence = text.starts_with("```");
            is_code ^= is_fence;
            if is_code || is_fence || text.is_empty() {
                goes_on = false;
                continue;
            }
            if !std::mem::replace(&mut goes_on, true) {
                self.paragraphs.push(Vec::new());
            }
            self.lines += 1;
            self.unfinished += usize::from(text.starts_with('…') || text.ends_with(" …"));
            let words = text.split_whitespace().flat_map(word_and_signs);
            let paragraph = self.paragraphs.last_mut().unwrap();
            paragraph.extend(words.map(str::to_lowercase));
        }
    }

    /// The word "what" in any use: a comment asks nothing, and names things by nouns.
    fn whats(&self) -> usize {
        self.count(|words| words[0] == "what")
    }

    /// The word "where" directly before an article, a pronoun or a quantifier: it gives a condition
    /// for which there is "if".
    fn wheres(&self) -> usize {
        const SUBJECTS: &str = "\
            a all an both each it its neither no nobody none nothing one somebody something that \
            the their there they this what";
        self.count(|words| words[0] == "where" && is_listed(&words[1], SUBJECTS))
    }

    /// "So many", "so long", "so much" and "so far", for which there are numbers and names.
    fn so_manys(&self) -> usize {
        const MEASURES: &[&str] = &["many", "long", "much", "far"];
        self.count(|words| words[0] == "so" && MEASURES.contains(&&*words[1]))
    }

    /// A form of "be" directly before a word in -ed or a participle of the list.
    fn passives(&self) -> usize {
        const BE: &[&str] = &["is", "are", "was", "were", "be", "been", "being"];
        const PARTICIPLES: &str = "\
            bent bound broken brought built chosen cut done drawn driven felt found given heard \
            held hidden hit kept known laid left lost made meant met put read run said seen sent \
            set shown shut split spread taken thrown told undone understood written";
        self.count(|words| {
            BE.contains(&&*words[0])
                && (words[1].ends_with("ed") || is_listed(&words[1], PARTICIPLES))
        })
    }

    /// Over every two words that follow one another.
    fn count(&self, is_case: impl Fn(&[String]) -> bool) -> usize {
        let pairs = self.paragraphs.iter().flat_map(|words| words.windows(2));
        pairs.filter(|words| is_case(words)).count()
    }
}

fn is_listed(word: &str, list: &str) -> bool {
    list.split(' ').any(|one| one == word)
}

/// A word between blanks, without the signs at its ends, which stay parts of their own.
fn word_and_signs(text: &str) -> impl Iterator<Item = &str> {
    let begin = text.find(char::is_alphanumeric).unwrap_or(0);
    let word = text.trim_end_matches(|c: char| !c.is_alphanumeric());
    let end = word.len().max(begin);
    let parts = [&text[..begin], &text[begin..end], &text[end..]];
    parts.into_iter().filter(|part| !part.is_empty())
}

/// Those of the program and of all that tests and measures it.
static COMMENTS: LazyLock<Comments> = LazyLock::new(|| {
    let texts = files(&["src", "crates", "tests", "benches", "examples", "fuzz/src"]);
    let sources: Vec<_> = texts
        .iter()
        .map(|(file, text)| Source::of(file, text))
        .collect();
    Comments::of(sources.iter())
});

#[test]
fn comments_name_things_by_nouns() {
    WHAT.hold(per_thousand(COMMENTS.whats(), COMMENTS.lines));
}

#[test]
fn comments_give_conditions_by_if() {
    WHERE.hold(per_thousand(COMMENTS.wheres(), COMMENTS.lines));
}

#[test]
fn comments_give_measures_by_numbers() {
    SO_MANY.hold(per_thousand(COMMENTS.so_manys(), COMMENTS.lines));
}

#[test]
fn comments_are_active() {
    PASSIVES.hold(per_thousand(COMMENTS.passives(), COMMENTS.lines));
}

#[test]
fn comments_are_whole_sentences() {
    UNFINISHED.hold(per_thousand(COMMENTS.unfinished, COMMENTS.lines));
}

#[test]
fn patterns_of_speech_are_counted_as_by_hand() {
    let text = "
        //! What is felt here, where the tip is. What
        //! (is what) was written, where
        //! it may.
        /// is known. Whatever
        //
        // has been
        // not done, is called. Where: it
        use a; // what is left
        /// … so many times, so, far, so
        /// far …
        ///
        /// ```
        /// let what = \"so many\"; // … is done
        /// ```
        /// is a \"seed\", `was_moved` …
        fn f() {
            // where nothing is \"touched\" a · … · b
            what
        }
    ";
    let source = Source::of("a.rs", text);
    let comments = Comments::of([source].iter());
    assert_eq!(comments.lines, 10);
    assert_eq!(comments.whats(), 3, "What, What, what");
    assert_eq!(comments.wheres(), 3, "the, it, nothing");
    assert_eq!(comments.so_manys(), 2, "many, far");
    assert_eq!(comments.passives(), 4, "felt, written, known, called");
    assert_eq!(comments.unfinished, 3);
}
