//! Output files of a report.

use std::collections::BTreeSet;

use super::document::Report;
use super::{csv, page};
use touchup_document::{ChartSize, Looks, printable};

/// Error of writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// Two figures or tables have the same file name.
    #[error("two figures or tables are called {0}")]
    SameName(String),
    /// A name that is no plain file name.
    #[error("{0:?} cannot be the name of a file: small letters, digits and _ alone")]
    BadName(String),
    /// The results have no JSON form.
    #[error("the report cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// One file of a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// file name without folder
    pub name: String,
    /// content
    pub bytes: Vec<u8>,
}

impl Report {
    /// `report.html`, `report.json`, SVG and CSV of each figure, CSV of each table.
    ///
    /// # Errors
    /// [`ReportError`]: invalid or duplicate names.
    pub fn files(&self) -> Result<Vec<OutputFile>, ReportError> {
        self.check_names()?;
        let provenance = self.provenance();
        let looks = Looks::of(self.figures());
        let mut files = Vec::new();
        let mut add = |id: &str, ending: &str, text: String| {
            files.push(OutputFile {
                name: format!("{id}.{ending}"),
                bytes: text.into_bytes(),
            });
        };
        add("report", "html", page::html(self));
        add("report", "json", serde_json::to_string_pretty(self)? + "\n");
        for figure in self.figures() {
            let picture = figure.svg(&looks, ChartSize::PAGE, &provenance);
            add(&figure.id, "svg", printable(&picture) + "\n");
            add(&figure.id, "csv", csv::of_figure(figure));
        }
        for table in self.tables() {
            add(&table.id, "csv", csv::of_table(table));
        }
        Ok(files)
    }

    fn check_names(&self) -> Result<(), ReportError> {
        let tables = self.tables().map(|table| &table.id);
        let mut seen = BTreeSet::from(["report"]);
        for id in self.figures().map(|figure| &figure.id).chain(tables) {
            if id.is_empty()
                || !id
                    .bytes()
                    .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_')
            {
                return Err(ReportError::BadName(id.clone()));
            }
            if !seen.insert(id) {
                return Err(ReportError::SameName(id.clone()));
            }
        }
        Ok(())
    }
}
