//! The files of a report.

use std::path::{Path, PathBuf};

use clap::Args;

use super::InspectionError;
use super::calibration::calibration_of;
use super::page::{ReportInput, page};
use super::params::PartPicture;
use super::rows::Inspection;
use super::source::InspectionSource;
use touchup_io::file_error::FileError;
use touchup_io::inspection_file::write_inspection_table;
use touchup_io::qif_file::write_qif;
use touchup_io::session_folder::write_text_file;

/// Paths of the report's files; `None`: not written.
#[derive(Clone, Debug, Default, Args)]
pub struct ReportFiles {
    /// Output: the report, one printable HTML file
    #[arg(long = "out", value_name = "HTML")]
    pub html: Option<PathBuf>,
    /// Output: the characteristics as a table
    #[arg(long, value_name = "CSV")]
    pub csv: Option<PathBuf>,
    /// the whole report, as one object; on the command line it goes to stdout
    #[arg(skip)]
    pub json: Option<PathBuf>,
    /// Output: the results as QIF 3.0
    #[arg(long, value_name = "QIF")]
    pub qif: Option<PathBuf>,
}

/// A whole report, as the page makes it.
impl ReportFiles {
    /// File names in the folder of a session: HTML, CSV, JSON, QIF.
    pub const NAMES: [&str; 4] = ["report.html", "results.csv", "results.json", "results.qif"];

    /// All files in a folder.
    pub fn in_folder(folder: &Path) -> Self {
        let [html, csv, json, qif] = Self::NAMES.map(|name| Some(folder.join(name)));
        Self {
            html,
            csv,
            json,
            qif,
        }
    }
}

impl ReportFiles {
    /// Writes each file as a whole; nothing, unless the report succeeds.
    ///
    /// # Errors
    /// [`InspectionError`] for an unreadable mesh or scene, and for unwritable files.
    pub fn write(
        &self,
        source: &InspectionSource,
        inspected: &Inspection,
        picture: &PartPicture,
    ) -> Result<(), InspectionError> {
        let record = &inspected.record;
        let made = |_: &PathBuf| -> Result<String, InspectionError> {
            let calibration = calibration_of(source)?;
            page(&ReportInput {
                inspected,
                source,
                calibration: &calibration,
                picture: *picture,
            })
        };
        let html = self.html.as_ref().map(made).transpose()?;
        if let Some(path) = &self.csv {
            write_inspection_table(path, &record.characteristics, &record.frame())?;
        }
        if let Some(path) = &self.json {
            let mut text =
                serde_json::to_string(record).expect("finite numbers and names alone cannot fail");
            text.push('\n');
            write_text(path, &text)?;
        }
        if let Some(path) = &self.qif {
            write_qif(path, record)?;
        }
        match self.html.as_ref().zip(html) {
            Some((path, html)) => write_text(path, &html),
            None => Ok(()),
        }
    }
}

fn write_text(path: &Path, text: &str) -> Result<(), InspectionError> {
    write_text_file(path, text).map_err(|source| {
        FileError::Write {
            path: path.to_owned(),
            source,
        }
        .into()
    })
}
