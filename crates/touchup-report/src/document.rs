//! The whole report.

use serde::Serialize;

use touchup_page::figure::Figure;

use super::table::{Chapter, Table};

/// Provenance of the measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// processor, cores, memory, system
    pub machine: String,
    /// of the program that measured; "unknown" where it was built without its repository
    pub commit: String,
    /// the command line
    pub command: String,
    /// day and time in UTC
    pub date: String,
    /// what a practitioner should take from it: use this, because, cost; `None` where too little
    /// was measured to say
    pub advice: Option<Table>,
    /// what each part found, a paragraph each
    pub verdict: Vec<String>,
    /// its parts, in order
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

    /// What every picture says about where it is from.
    pub(super) fn provenance(&self) -> String {
        format!(
            "{} · commit {} · {}",
            self.machine, self.commit, self.command
        )
    }
}
