//! A recording and its findings.

use touchup_features::diagnose::InputFinding;
use touchup_sim::{InputMistake, SimWorld};

/// Findings for one recording.
#[derive(Clone, Debug)]
pub struct CheckedRecording {
    /// world of the recording
    pub world: SimWorld,
    /// seed of the world
    pub seed: u64,
    /// mistake in the recording; `None`: sound
    pub mistake: Option<&'static InputMistake>,
    /// most certain first
    pub findings: Vec<InputFinding>,
}

impl CheckedRecording {
    /// Whether the first finding is the mistake, and sure; for a sound recording, whether findings
    /// are absent.
    pub fn is_right(&self) -> bool {
        match (self.mistake, self.findings.first()) {
            (None, first) => first.is_none(),
            (Some(mistake), first) => {
                first.is_some_and(|first| first.is_sure && first.cause == mistake.cause)
            }
        }
    }

    /// First finding; empty without findings.
    pub fn said(&self) -> String {
        self.findings
            .first()
            .map_or_else(String::new, |first| format!("{}: {first}", first.cause))
    }
}

/// Count of correct judgements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RightCount {
    /// correct judgements
    pub right: usize,
    /// all recordings
    pub all: usize,
}

impl RightCount {
    /// Counts these recordings.
    pub fn of<'a>(checked: impl Iterator<Item = &'a CheckedRecording>) -> Self {
        checked.fold(Self::default(), |count, checked| Self {
            right: count.right + usize::from(checked.is_right()),
            all: count.all + 1,
        })
    }
}
