//! The whole report.

use serde::Serialize;

use touchup_document::figure::Figure;

use super::table::{Chapter, Table};

/// Provenance of the measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// processor, cores, memory, system
    pub machine: String,
    /// commit of the measuring program; "unknown" in a build without its repository
    pub commit: String,
    /// the command line
    pub command: String,
    /// day and time in UTC
    pub date: String,
    /// advice to a practitioner: choice, reason, cost; `None` if the measurements are too few
    pub advice: Option<Table>,
    /// findings of each part, a paragraph each
    pub verdict: Vec<String>,
    /// chapters, in order
    pub chapters: Vec<Chapter>,
}

impl Report {
    pub(super) fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.chapters.iter().flat_map(|chapter| &chapter.figures)
    }

    pub(super) fn tables(&self) -> impl Iterator<Item = &Table> {
        self.advice
            .iter()
            .chain(self.chapters.iter().flat_map(|chapter| &chapter.tables))
    }

    /// Provenance text of every picture.
    pub(super) fn provenance(&self) -> String {
        format!(
            "{} · commit {} · {}",
            self.machine, self.commit, self.command
        )
    }
}
