//! A report from the files of a session: what `touchup inspect` makes of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::sync::Semaphore;

use crate::inspection::{
    InspectionError, InspectionParams, InspectionSource, PartDrawing, PartPicture, ReportFiles,
    inspected,
};
use crate::io::mesh_file::MeshUnit;
use crate::io::session_folder::{HandedIn, SessionFolder};

/// What was measured of a session that runs: as `~/save_mesh` writes it.
const SAVED: [&str; 3] = [
    "refined.features.json",
    "refined.touches.csv",
    "refined.ply",
];

/// What reports need of the node.
#[derive(Debug)]
pub(super) struct Reports {
    /// one at a time
    pub turn: Arc<Semaphore>,
    /// the nominal part of the node
    pub part: Option<PathBuf>,
    /// of its meshes
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
pub(super) enum NominalFile {
    /// that were handed in; gone with this
    HandedIn(HandedIn),
    /// of a file that stays
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

/// What a report is made of.
#[derive(Debug)]
pub(super) struct ReportWork {
    pub session: SessionFolder,
    /// it runs: what was saved of it counts, whatever else lies there
    pub is_current: bool,
    pub nominal: NominalFile,
    pub params: InspectionParams,
    /// of the meshes of the session
    pub mesh_unit: MeshUnit,
}

impl ReportWork {
    /// Makes it, and writes its files into the folder of the session.
    ///
    /// # Errors
    /// In the words of `touchup inspect`.
    pub fn run(self) -> Result<(), String> {
        self.files()
            .and_then(|files| self.write(&files).map_err(|error| self.in_words(&error)))
    }

    /// Its files; none of them is a link to elsewhere.
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

    fn write(&self, files: &ReportFiles) -> Result<(), InspectionError> {
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
            // where it lies now it will not be found again
            drawing.file.path = name_of(file.path());
        }
        let inspected = inspected(&source, &drawing, &self.params)?;
        files.write(
            &source,
            &inspected,
            &PartPicture {
                mesh_unit: self.mesh_unit,
                view: None,
            },
        )
    }

    /// An error, which names what was handed in as it was called there.
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
