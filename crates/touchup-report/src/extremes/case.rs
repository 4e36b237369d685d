//! One extreme input: its outcome beside the right answer.

use std::fmt::Display;

/// One extreme.
#[derive(Clone, Debug, Default, PartialEq)]
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

/// The outcome in words, and whether it is right; or an unexpected error.
pub(super) type CaseOutcome<E> = Result<(String, bool), E>;

impl Extreme {
    /// Starts a case with its input.
    pub(super) fn fed(fed: &str) -> Self {
        Self {
            fed: fed.to_owned(),
            ..Self::default()
        }
    }

    /// The right answer, and why.
    pub(super) fn should(self, right_answer: &str) -> Self {
        Self {
            right_answer: right_answer.to_owned(),
            ..self
        }
    }

    /// The outcome.
    pub(super) fn gave<E: Display>(self, outcome: CaseOutcome<E>) -> Self {
        let (came_out, is_right) =
            outcome.unwrap_or_else(|error| (format!("refused: {error}"), false));
        Self {
            came_out,
            is_right,
            ..self
        }
    }
}

/// Outcome of an input that should fail with a certain error.
pub(super) fn refused<T, E: Display>(
    result: Result<T, E>,
    is_right: impl Fn(&E) -> bool,
) -> CaseOutcome<E> {
    Ok(result.map_or_else(
        |error| (format!("refused: {error}"), is_right(&error)),
        |_| ("taken".to_owned(), false),
    ))
}
