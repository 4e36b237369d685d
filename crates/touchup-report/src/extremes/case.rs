//! One extreme input: its outcome beside the right answer.

use std::fmt::Display;

/// One extreme.
#[derive(Clone, Debug, PartialEq)]
pub struct Extreme {
    /// the input
    pub fed: String,
    /// the outcome
    pub came_out: String,
    /// the right answer, and why
    pub right_answer: String,
    /// whether the outcome is the right answer
    pub is_right: bool,
}

/// The outcome in words, and whether it is right; an error where none would be.
pub(super) type CaseOutcome<E> = Result<(String, bool), E>;

pub(super) fn extreme<E: Display>(fed: &str, right_answer: &str, outcome: CaseOutcome<E>) -> Extreme {
    let (came_out, is_right) = outcome.unwrap_or_else(|error| (format!("refused: {error}"), false));
    Extreme { fed: fed.to_owned(), came_out, right_answer: right_answer.to_owned(), is_right }
}

/// What should be refused with a certain error.
pub(super) fn refused<T, E: Display>(result: Result<T, E>, is_right: impl Fn(&E) -> bool) -> CaseOutcome<E> {
    Ok(result.map_or_else(|error| (format!("refused: {error}"), is_right(&error)), |_| ("taken".to_owned(), false)))
}
