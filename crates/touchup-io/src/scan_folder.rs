//! A folder from which a user chooses scans, recordings and tables of points, and adds them:
//! nothing outside of it is listed, read or written, and nothing in it is overwritten.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::Serialize;
use tempfile::TempPath;

use super::atomic::remove_left;
use super::file_kind::FileKind;
use super::recording::{is_of_recording, own_files};
use super::session_folder::is_plain_name;

/// Maximum number of files in a list: the newest.
const MOST_LISTED: usize = 500;
/// Maximum number of files in the check for a recording folder.
const MOST_LOOKED_AT: usize = 1000;
/// Maximum length of a name, bytes: the limit of file systems, with room for a number.
const LONGEST_NAME: usize = 200;
/// Maximum number of files of one name.
const MOST_OF_A_NAME: u32 = 1000;
/// Start of an upload's temporary name.
const UPLOAD_STEM: &str = ".upload.";

/// Kind of a file, by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FolderFileKind {
    /// a mesh or a point cloud
    Scan,
    /// a ROS 2 recording: one file, or a folder of rosbag2
    Recording,
    /// points picked on a scan
    PointTable,
}

impl FolderFileKind {
    fn of(name: &str) -> Option<Self> {
        match FileKind::of(Path::new(name))? {
            FileKind::Mcap | FileKind::Db3 => Some(Self::Recording),
            FileKind::Csv => Some(Self::PointTable),
            kind => FileKind::SCANS.contains(&kind).then_some(Self::Scan),
        }
    }
}

/// A selectable file, or a folder that is one recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FolderFile {
    /// without a folder
    pub name: String,
    /// its length, or that of all files in the folder
    pub bytes: u64,
    /// last change, for a folder the last added or removed file, s since 1970 UTC; `None` if
    /// unknown to the system
    pub modified_s: Option<u64>,
}

/// Why a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum ScanFolderError {
    /// A name that could lead out of the folder, or no name.
    #[error("\"{0}\" is not a plain name of a file: give one without folders, such as scan.ply")]
    NotAPlainName(String),
    /// An extension of another kind than a scan.
    #[error("\"{0}\" is no scan by its name: it must end in one of {known}", known = FileKind::SCANS.map(FileKind::name).join(", "))]
    NotAScan(String),
    /// An extension of another kind than a recording or table.
    #[error(
        "\"{0}\" is neither a recording nor a table of points by its name: it must end in one of {known}",
        known = [FileKind::Mcap, FileKind::Db3, FileKind::Csv].map(FileKind::name).join(", ")
    )]
    NotARecording(String),
    /// A folder that is no recording, or leads out of itself.
    #[error(
        "\"{0}\" is no whole recording of rosbag2: metadata.yaml must name files that lie in it, and none of them may be a link"
    )]
    NotABag(String),
    /// A missing file, a link or a folder.
    #[error("there is no file \"{0}\" in the folder of scans: look at the list again")]
    NotThere(String),
    /// Excess size.
    #[error(
        "the file is larger than {0} bytes: make a scan coarser, a recording shorter, or copy it into the folder of scans"
    )]
    TooLarge(u64),
    /// A system error.
    #[error("the folder of scans cannot be used: {0}")]
    System(#[from] io::Error),
}

/// The folder.
#[derive(Clone, Debug)]
pub struct ScanFolder {
    path: PathBuf,
}

impl ScanFolder {
    /// - `path`: an existing folder.
    ///
    /// # Errors
    /// Any system error, and a path to something else.
    pub fn open(path: &Path) -> io::Result<Self> {
        let path = fs::canonicalize(path)?;
        match path.is_dir() {
            true => Ok(Self { path }),
            false => Err(io::Error::new(
                io::ErrorKind::NotADirectory,
                "it is no folder",
            )),
        }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The plain files of a kind in it, the newest first, and for recordings the folders too; links
    /// are left out.
    ///
    /// # Errors
    /// Any system error about the folder.
    pub fn list(&self, kind: FolderFileKind) -> io::Result<Vec<FolderFile>> {
        let mut found = Vec::new();
        for entry in fs::read_dir(&self.path)? {
            // a file removed meanwhile is left out
            let Ok((name, about)) =
                entry.and_then(|entry| Ok((entry.file_name(), entry.metadata()?)))
            else {
                continue;
            };
            let Ok(name) = name.into_string() else {
                continue;
            };
            let bytes = match about.is_dir() {
                _ if !is_plain_name(&name) => None,
                true if kind == FolderFileKind::Recording => bag_bytes(&self.path.join(&name)),
                _ => (about.is_file() && FolderFileKind::of(&name) == Some(kind))
                    .then_some(about.len()),
            };
            let since = |time: SystemTime| time.duration_since(UNIX_EPOCH).ok();
            let modified_s = about
                .modified()
                .ok()
                .and_then(since)
                .map(|since| since.as_secs());
            found.extend(bytes.map(|bytes| FolderFile {
                name,
                bytes,
                modified_s,
            }));
        }
        found.sort_by(|a, b| {
            b.modified_s
                .cmp(&a.modified_s)
                .then_with(|| a.name.cmp(&b.name))
        });
        found.truncate(MOST_LISTED);
        Ok(found)
    }

    /// The place of a file chosen by the user.
    ///
    /// # Errors
    /// [`ScanFolderError`] for anything but a plain file of that kind in the folder.
    pub fn file(&self, name: &str, kind: FolderFileKind) -> Result<PathBuf, ScanFolderError> {
        if !is_plain_name(name) {
            return Err(ScanFolderError::NotAPlainName(name.to_owned()));
        }
        let path = self.path.join(name);
        // a link may lead anywhere
        match fs::symlink_metadata(&path) {
            Ok(about) if about.is_file() && FolderFileKind::of(name) == Some(kind) => Ok(path),
            Ok(about) if about.is_dir() && kind == FolderFileKind::Recording => {
                match own_files(&path) {
                    Some(_) => Ok(path),
                    None => Err(ScanFolderError::NotABag(name.to_owned())),
                }
            }
            _ => Err(ScanFolderError::NotThere(name.to_owned())),
        }
    }

    /// The place of a plain file of that name, if there is one.
    pub fn plain_file(&self, name: &str) -> Option<PathBuf> {
        let path = self.path.join(name);
        let is_there =
            is_plain_name(name) && fs::symlink_metadata(&path).is_ok_and(|about| about.is_file());
        is_there.then_some(path)
    }

    /// An unused place: `stem.extension`, or with a number.
    pub fn free_place(&self, stem: &str, extension: &str) -> PathBuf {
        let named = |number| match number {
            1 => self.path.join(format!("{stem}.{extension}")),
            _ => self.path.join(format!("{stem}-{number}.{extension}")),
        };
        let free = (1u32..)
            .map(named)
            .find(|path| fs::symlink_metadata(path).is_err());
        free.unwrap_or_else(|| self.path.join(format!("{stem}.{extension}")))
    }

    /// Begins a new file, which appears when it is whole.
    ///
    /// - `name`: the owner's name; unsuitable characters become `_`.
    /// - `is_scan`: requires the extension of a scan, or else of a recording or a table.
    /// - `most`: maximum number of bytes.
    ///
    /// # Errors
    /// [`ScanFolderError`]
    pub fn begin_upload(
        &self,
        name: &str,
        is_scan: bool,
        most: u64,
    ) -> Result<ScanUpload, ScanFolderError> {
        let name = cleaned(name, is_scan)?;
        remove_left(&self.path, UPLOAD_STEM);
        let prefix = format!("{UPLOAD_STEM}{}-", std::process::id());
        let made = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(".part")
            .make_in(&self.path, |path| File::create_new(path))?;
        let (file, temporary) = made.into_parts();
        Ok(ScanUpload {
            folder: self.path.clone(),
            name,
            file,
            temporary,
            bytes: 0,
            most,
        })
    }
}

/// Length of all files in a folder that looks like a recording of rosbag2; `None` for others.
fn bag_bytes(folder: &Path) -> Option<u64> {
    let (mut bytes, mut is_recording) = (0, false);
    for entry in fs::read_dir(folder).ok()?.flatten().take(MOST_LOOKED_AT) {
        let Some(about) = entry.metadata().ok().filter(fs::Metadata::is_file) else {
            continue;
        };
        bytes += about.len();
        is_recording |= entry.file_name().to_str().is_some_and(is_of_recording);
    }
    is_recording.then_some(bytes)
}

/// A name in the folder's form.
fn cleaned(name: &str, is_scan: bool) -> Result<String, ScanFolderError> {
    if !is_plain_name(name) || name.len() > LONGEST_NAME {
        return Err(ScanFolderError::NotAPlainName(
            name.chars().take(LONGEST_NAME).collect(),
        ));
    }
    match FolderFileKind::of(name) {
        Some(kind) if (kind == FolderFileKind::Scan) == is_scan => {}
        _ if is_scan => return Err(ScanFolderError::NotAScan(name.to_owned())),
        _ => return Err(ScanFolderError::NotARecording(name.to_owned())),
    }
    let is_plain = |c: char| c.is_alphanumeric() || "-_.()+ ".contains(c);
    Ok(name
        .chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect())
}

/// An upload in progress; drop before its end removes it.
#[derive(Debug)]
pub struct ScanUpload {
    folder: PathBuf,
    name: String,
    file: File,
    /// removes the file on drop
    temporary: TempPath,
    bytes: u64,
    most: u64,
}

impl ScanUpload {
    /// Adds a piece.
    ///
    /// # Errors
    /// [`ScanFolderError::TooLarge`], [`ScanFolderError::System`].
    pub fn add(&mut self, piece: &[u8]) -> Result<(), ScanFolderError> {
        self.bytes += piece.len() as u64;
        if self.bytes > self.most {
            return Err(ScanFolderError::TooLarge(self.most));
        }
        Ok(self.file.write_all(piece)?)
    }

    /// Gives the file its name, with a number if it is taken, and returns it.
    ///
    /// # Errors
    /// [`ScanFolderError::System`]; nothing remains then.
    pub fn commit(self) -> Result<String, ScanFolderError> {
        let Self {
            folder,
            name,
            file,
            mut temporary,
            ..
        } = self;
        file.sync_all()?;
        let (stem, extension) = name.rsplit_once('.').unwrap_or((&name, ""));
        for number in 1..=MOST_OF_A_NAME {
            let free = if number == 1 {
                name.clone()
            } else {
                format!("{stem}-{number}.{extension}")
            };
            match temporary.persist_noclobber(folder.join(&free)) {
                Ok(()) => return Ok(free),
                Err(taken) if taken.error.kind() == io::ErrorKind::AlreadyExists => {
                    temporary = taken.path
                }
                Err(other) => return Err(other.error.into()),
            }
        }
        Err(io::Error::from(io::ErrorKind::AlreadyExists).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uploaded(folder: &ScanFolder, name: &str, text: &str) -> Result<String, ScanFolderError> {
        let mut upload = folder.begin_upload(name, true, 10)?;
        upload.add(text.as_bytes())?;
        upload.commit()
    }

    #[test]
    fn an_upload_never_writes_over_a_file_and_is_there_whole_or_not_at_all() {
        let place = tempfile::tempdir().unwrap();
        let folder = ScanFolder::open(place.path()).unwrap();
        assert_eq!(uploaded(&folder, "part.ply", "one").unwrap(), "part.ply");
        assert_eq!(uploaded(&folder, "part.ply", "two").unwrap(), "part-2.ply");
        assert_eq!(
            uploaded(&folder, "part.ply", "three").unwrap(),
            "part-3.ply"
        );
        assert!(matches!(
            uploaded(&folder, "part.ply", "eleven char").unwrap_err(),
            ScanFolderError::TooLarge(10)
        ));
        let mut upload = folder.begin_upload("other.stl", true, 10).unwrap();
        upload.add(b"half").unwrap();
        drop(upload);
        let mut names: Vec<_> = fs::read_dir(place.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        names.sort();
        assert_eq!(names, ["part-2.ply", "part-3.ply", "part.ply"]);
        assert_eq!(
            fs::read_to_string(place.path().join("part.ply")).unwrap(),
            "one"
        );
    }

    #[test]
    fn names_that_lead_elsewhere_or_are_no_scan_are_refused_and_odd_ones_are_cleaned() {
        let place = tempfile::tempdir().unwrap();
        let folder = ScanFolder::open(place.path()).unwrap();
        for name in [
            "../part.ply",
            "/part.ply",
            "a/b.ply",
            "..",
            "",
            ".part.ply",
            "a\\b.ply",
            "a\nb.ply",
        ] {
            assert!(
                matches!(
                    uploaded(&folder, name, "x").unwrap_err(),
                    ScanFolderError::NotAPlainName(_)
                ),
                "{name}"
            );
        }
        for name in ["part", "part.exe", "scene.yaml", "touch.mcap"] {
            assert!(
                matches!(
                    uploaded(&folder, name, "x").unwrap_err(),
                    ScanFolderError::NotAScan(_)
                ),
                "{name}"
            );
        }
        assert_eq!(
            uploaded(&folder, "Gehäuse 7 (neu)'$.STL", "x").unwrap(),
            "Gehäuse 7 (neu)__.STL"
        );
        let beside = |name| {
            folder
                .begin_upload(name, false, 10)
                .and_then(ScanUpload::commit)
        };
        assert_eq!(beside("swing.mcap").unwrap(), "swing.mcap");
        assert_eq!(beside("points.csv").unwrap(), "points.csv");
        for name in ["part.ply", "scene.yaml", "swing"] {
            assert!(
                matches!(beside(name).unwrap_err(), ScanFolderError::NotARecording(_)),
                "{name}"
            );
        }
    }

    #[test]
    fn every_kind_of_file_that_is_listed_is_one_that_is_read() {
        use crate::mesh_file::{MeshFileError, MeshUnit, read_mesh_or_points};
        let place = tempfile::tempdir().unwrap();
        let is_known = |extension| {
            let path = place.path().join(format!("part.{extension}"));
            fs::write(&path, "nothing of it").unwrap();
            !matches!(
                read_mesh_or_points(&path, MeshUnit::Metre),
                Err(MeshFileError::UnknownFormat { .. })
            )
        };
        assert!(
            FileKind::SCANS
                .map(FileKind::name)
                .into_iter()
                .all(is_known)
        );
        assert!(!is_known("md") && !is_known("yaml"));
    }

    #[test]
    fn only_plain_files_of_the_kind_are_listed_and_found() {
        let place = tempfile::tempdir().unwrap();
        let folder = ScanFolder::open(place.path()).unwrap();
        for name in ["part.ply", "touch.mcap", "notes.md"] {
            fs::write(place.path().join(name), "x").unwrap();
        }
        fs::create_dir(place.path().join("folder.ply")).unwrap();
        std::os::unix::fs::symlink("/etc/hostname", place.path().join("link.ply")).unwrap();
        let names = |kind| {
            folder
                .list(kind)
                .unwrap()
                .into_iter()
                .map(|file| file.name)
                .collect::<Vec<_>>()
        };
        assert_eq!(names(FolderFileKind::Scan), ["part.ply"]);
        assert_eq!(names(FolderFileKind::Recording), ["touch.mcap"]);
        assert!(folder.file("part.ply", FolderFileKind::Scan).is_ok());
        for name in [
            "link.ply",
            "folder.ply",
            "touch.mcap",
            "none.ply",
            "../part.ply",
        ] {
            assert!(folder.file(name, FolderFileKind::Scan).is_err(), "{name}");
        }
    }

    #[test]
    #[expect(clippy::too_many_lines)]
    fn a_folder_of_rosbag2_is_a_recording_unless_it_leads_out_of_itself() {
        let place = tempfile::tempdir().unwrap();
        let folder = ScanFolder::open(place.path()).unwrap();
        fs::write(place.path().join("outside.mcap"), "x").unwrap();
        let make = |name: &str, listed: &str| {
            let bag = place.path().join(name);
            fs::create_dir(&bag).unwrap();
            fs::write(bag.join("bag_0.mcap"), "0123456789").unwrap();
            let metadata =
                format!("rosbag2_bagfile_information:\n  relative_file_paths: [{listed}]\n");
            fs::write(bag.join("metadata.yaml"), metadata).unwrap();
            bag
        };
        make("whole", "bag_0.mcap");
        // names of early versions of rosbag2
        make("early", "early/bag_0.mcap");
        for (name, listed) in [
            ("up", "../outside.mcap"),
            ("root", "/etc/hostname"),
            ("lost", "bag_1.mcap"),
        ] {
            make(name, listed);
        }
        let linked = make("linked", "bag_1.mcap");
        std::os::unix::fs::symlink(place.path().join("outside.mcap"), linked.join("bag_1.mcap"))
            .unwrap();
        fs::create_dir(place.path().join("photos")).unwrap();
        std::os::unix::fs::symlink(place.path().join("whole"), place.path().join("link")).unwrap();
        let mut found = folder.list(FolderFileKind::Recording).unwrap();
        found.sort_by(|a, b| a.name.cmp(&b.name));
        let names: Vec<_> = found.iter().map(|file| &*file.name).collect();
        assert_eq!(
            names,
            [
                "early",
                "linked",
                "lost",
                "outside.mcap",
                "root",
                "up",
                "whole"
            ]
        );
        assert!(found[6].bytes > 10);
        for name in ["whole", "early"] {
            assert_eq!(
                folder.file(name, FolderFileKind::Recording).unwrap(),
                folder.path().join(name)
            );
        }
        for name in ["up", "root", "lost", "linked"] {
            let refused = folder.file(name, FolderFileKind::Recording).unwrap_err();
            assert!(
                matches!(refused, ScanFolderError::NotABag(_)),
                "{name}: {refused}"
            );
        }
        for name in ["photos", "link", "."] {
            assert!(
                folder.file(name, FolderFileKind::Recording).is_err(),
                "{name}"
            );
        }
        assert!(folder.file("whole", FolderFileKind::Scan).is_err());
    }
}
