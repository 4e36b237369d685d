//! A recording and what was said of it.

use touchup_core::diagnose::InputFinding;
use touchup_sim::{InputMistake, SimWorld};

/// What was said of one recording.
#[derive(Clone, Debug)]
pub struct CheckedRecording {
    /// whose it is
    pub world: SimWorld,
    /// of the world
    pub seed: u64,
    /// `None`: it is sound
    pub mistake: Option<&'static InputMistake>,
    /// the surest first
    pub findings: Vec<InputFinding>,
}

impl CheckedRecording {
    /// Whether the mistake is what is said first, and surely; of a sound recording, that nothing is
    /// said.
    pub fn is_right(&self) -> bool {
        match (self.mistake, self.findings.first()) {
            (None, first) => first.is_none(),
            (Some(mistake), first) => {
                first.is_some_and(|first| first.is_sure && first.cause == mistake.cause)
            }
        }
    }

    /// What is said first; empty for nothing.
    pub fn said(&self) -> String {
        self.findings
            .first()
            .map_or_else(String::new, |first| format!("{}: {first}", first.cause))
    }
}

/// How many of some recordings were judged rightly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RightCount {
    /// judged rightly
    pub right: usize,
    /// of all
    pub all: usize,
}

impl RightCount {
    /// Of these.
    pub fn of<'a>(checked: impl Iterator<Item = &'a CheckedRecording>) -> Self {
        checked.fold(Self::default(), |count, checked| Self {
            right: count.right + usize::from(checked.is_right()),
            all: count.all + 1,
        })
    }
}
