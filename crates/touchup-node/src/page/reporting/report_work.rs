//! A report from the files of a session, as by `touchup inspect`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::sync::Semaphore;

use touchup_inspect::{
    InspectionError, InspectionParams, InspectionSource, PartDrawing, PartPicture, ReportFiles,
    inspected,
};
use touchup_io::mesh_file::MeshUnit;
use touchup_io::session_folder::{HandedIn, SessionFolder};

/// Measurements of the running session, as `~/save_mesh` writes them.
const SAVED: [&str; 3] = [
    "refined.features.json",
    "refined.touches.csv",
    "refined.ply",
];

/// Report inputs from the node.
#[derive(Debug)]
pub(in crate::page) struct Reports {
    /// one report at a time
    pub turn: Arc<Semaphore>,
    /// the nominal part of the node
    pub part: Option<PathBuf>,
    /// unit of the node's meshes
    pub mesh_unit: MeshUnit,
}

impl Reports {
    /// - `part`: the nominal part of the node, in its unit.
    pub fn new(part: Option<PathBuf>, mesh_unit: MeshUnit) -> Self {
        Self {
            turn: Arc::new(Semaphore::new(1)),
            part,
            mesh_unit,
        }
    }

    /// Name of the nominal part.
    pub fn part_name(&self) -> Option<String> {
        Some(
            self.part
                .as_ref()?
                .file_name()?
                .to_string_lossy()
                .into_owned(),
        )
    }
}

/// Nominal values.
#[derive(Debug)]
pub(in crate::page) enum NominalFile {
    /// an uploaded file, removed on drop
    HandedIn(HandedIn),
    /// a permanent file
    File(PathBuf),
}

impl NominalFile {
    fn path(&self) -> &Path {
        match self {
            Self::HandedIn(file) => file.path(),
            Self::File(path) => path,
        }
    }
}

/// Inputs of a report.
#[derive(Debug)]
pub(in crate::page) struct ReportWork {
    pub session: SessionFolder,
    /// the session runs: only its saved files count
    pub is_current: bool,
    pub nominal: NominalFile,
    pub params: InspectionParams,
    /// unit of the session's meshes
    pub mesh_unit: MeshUnit,
}

impl ReportWork {
    /// Makes the report, and writes its files into the folder of the session.
    ///
    /// # Errors
    /// In the words of `touchup inspect`.
    pub fn run(self) -> Result<(), String> {
        self.files()
            .and_then(|files| self.write(&files).map_err(|error| self.in_words(&error)))
    }

    /// Files of the report; none of them is a link to elsewhere.
    fn files(&self) -> Result<ReportFiles, String> {
        let place = |name: &&str| {
            self.session
                .place(name, true)
                .map(drop)
                .map_err(|why| why.to_string())
        };
        ReportFiles::NAMES.iter().try_for_each(place)?;
        Ok(ReportFiles::in_folder(self.session.path()))
    }

    fn write(&self, files: &ReportFiles) -> Result<(), Box<InspectionError>> {
        let folder = self.session.path();
        let source = if self.is_current {
            let [features, touches, mesh] = SAVED.map(|name| folder.join(name));
            let touches = Some(&*touches).filter(|touches| touches.is_file());
            InspectionSource::read(&features, [touches, Some(&mesh), None])?
        } else {
            InspectionSource::read(folder, [None; 3])?
        };
        let mut drawing = PartDrawing::read(self.nominal.path(), &self.params.drawing)?;
        if let NominalFile::HandedIn(file) = &self.nominal {
            // the report names no temporary file
            drawing.file.path = name_of(file.path());
        }
        let inspected = inspected(&source, &drawing, &self.params)?;
        let picture = PartPicture {
            mesh_unit: self.mesh_unit,
            view: None,
        };
        Ok(files.write(&source, &inspected, &picture)?)
    }

    /// Error text with the upload's original name.
    fn in_words(&self, error: &InspectionError) -> String {
        let words = error.to_string();
        match &self.nominal {
            NominalFile::HandedIn(file) => {
                words.replace(&file.path().display().to_string(), &name_of(file.path()))
            }
            NominalFile::File(_) => words,
        }
    }
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default()
}
