//! Folders that appear whole or not at all, even if several processes make the same one.
//!
//! A process makes a folder under a temporary name beside its place, while it holds a lock of its
//! name, and renames it once all of it is on the disk. The system releases the lock of a killed
//! process, on another machine too for a shared file system; the next owner removes its remains.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::file_error::FileError;

/// Result of a claim.
#[derive(Debug)]
pub enum Claim {
    /// the folder exists
    Done(PathBuf),
    /// the folder is ours to make
    Ours(ClaimedFolder),
}

/// A folder in the making, reserved for this process.
#[derive(Debug)]
pub struct ClaimedFolder {
    place: PathBuf,
    /// of the names of temporary folders
    prefix: String,
    /// vanishes on drop
    temporary: TempDir,
    _lock: Option<NameLock>,
}

/// Bytes as a file, for readers of files, in a temporary folder beside the claimed one. It vanishes
/// on drop; the next claim of the name removes remains of a killed process.
#[derive(Debug)]
pub struct FileBeside {
    path: PathBuf,
    _folder: TempDir,
}

impl FileBeside {
    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A lock beside a folder, by its name.
#[derive(Debug)]
struct NameLock {
    path: PathBuf,
    _file: File,
}

/// Claims the folder `name` in `folder`, which is made if missing. Waits while another process
/// makes it.
///
/// - `again`: replaces an existing one.
///
/// # Errors
/// [`FileError::Write`]
pub fn claim(folder: &Path, name: &str, again: bool) -> Result<Claim, FileError> {
    let place = folder.join(name);
    if !again && place.is_dir() {
        return Ok(Claim::Done(place));
    }
    let claimed = || {
        fs::create_dir_all(folder)?;
        let lock = NameLock::take(folder.join(format!(".{name}.lock")))?;
        if !again && place.is_dir() {
            return Ok(Claim::Done(place.clone()));
        }
        let prefix = format!(".{name}.");
        if lock.is_some() {
            remove_left(folder, &prefix);
        }
        let temporary = temporary_in(folder, &prefix)?;
        Ok(Claim::Ours(ClaimedFolder {
            place: place.clone(),
            prefix,
            temporary,
            _lock: lock,
        }))
    };
    claimed().map_err(|source| FileError::Write {
        path: place.clone(),
        source,
    })
}

/// Ending of temporary folders.
const PART: &str = ".part";

impl ClaimedFolder {
    /// Place for its files.
    pub fn path(&self) -> &Path {
        self.temporary.path()
    }

    /// Input bytes of the folder, as a file.
    ///
    /// - `name`: has the ending for the reader.
    ///
    /// # Errors
    /// [`FileError::Write`]
    pub fn file_beside(&self, name: &Path, bytes: &[u8]) -> Result<FileBeside, FileError> {
        let written = || {
            let folder = temporary_in(self.place.parent().unwrap_or(Path::new(".")), &self.prefix)?;
            let path = folder.path().join(name.file_name().unwrap_or_default());
            fs::write(&path, bytes)?;
            Ok(FileBeside {
                path,
                _folder: folder,
            })
        };
        written().map_err(|source| FileError::Write {
            path: name.to_owned(),
            source,
        })
    }

    /// Gives the folder its name. Another one made meanwhile stays, unless `again`.
    ///
    /// - `again`: as of [`claim`].
    ///
    /// # Errors
    /// [`FileError::Write`]
    pub fn publish(self, again: bool) -> Result<PathBuf, FileError> {
        let Self {
            place,
            prefix,
            temporary,
            _lock,
        } = self;
        let publish = || {
            let folder = place.parent().unwrap_or(Path::new("."));
            sync(temporary.path());
            if again && place.is_dir() {
                // renaming cannot replace a folder: the old one steps aside, and vanishes with this
                let aside = temporary_in(folder, &prefix)?;
                fs::rename(&place, aside.path().join("old"))?;
                fs::rename(temporary.path(), &place)?;
            } else {
                match fs::rename(temporary.path(), &place) {
                    Err(_) if place.is_dir() => return Ok(()),
                    renamed => renamed?,
                }
            }
            sync(folder);
            Ok(())
        };
        publish().map_err(|source| FileError::Write {
            path: place.clone(),
            source,
        })?;
        Ok(place)
    }
}

/// A folder with usual permissions for others.
fn temporary_in(folder: &Path, prefix: &str) -> io::Result<TempDir> {
    let mut temporary = tempfile::Builder::new();
    temporary.prefix(prefix).suffix(PART);
    #[cfg(unix)]
    temporary.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    temporary.tempdir_in(folder)
}

/// A new name is on the disk once its folder is; some file systems do not support that.
fn sync(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

impl NameLock {
    /// Waits for exclusive ownership; `None` for a file system without locks.
    fn take(path: PathBuf) -> io::Result<Option<Self>> {
        loop {
            let file = File::options().create(true).append(true).open(&path)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => file.lock()?,
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    return Ok(None);
                }
                Err(TryLockError::Error(error)) => return Err(error),
                Ok(()) => {}
            }
            // a former owner may have removed the file: then the name leads to another one, which
            // others lock
            if is_at(&file, &path) {
                return Ok(Some(Self { path, _file: file }));
            }
        }
    }
}

/// Removes the file before the system releases it.
impl Drop for NameLock {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |of: fs::Metadata| (of.dev(), of.ino());
    file.metadata()
        .is_ok_and(|own| fs::metadata(path).is_ok_and(|there| number(own) == number(there)))
}

/// Such systems do not remove open files.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// Removes temporary folders of a name: their makers have released its lock.
fn remove_left(folder: &Path, prefix: &str) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name
            .to_str()
            .is_some_and(|name| name.starts_with(prefix) && name.ends_with(PART))
        {
            // without permission it stays
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn ours(claim: Claim) -> ClaimedFolder {
        let Claim::Ours(claimed) = claim else {
            panic!("it is there already")
        };
        claimed
    }

    #[test]
    fn a_folder_is_there_whole_and_nothing_beside_it() {
        let results = tempfile::tempdir().unwrap();
        let claimed = ours(claim(results.path(), "a", false).unwrap());
        fs::write(claimed.path().join("x"), "1").unwrap();
        let beside = claimed
            .file_beside(Path::new("far/scan.ply"), b"ply")
            .unwrap();
        assert!(beside.path().ends_with("scan.ply") && fs::read(beside.path()).unwrap() == b"ply");
        let left = beside
            .path()
            .parent()
            .unwrap()
            .file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .to_owned();
        assert!(
            left.starts_with(".a.") && left.ends_with(PART),
            "{left}: the next claim removes it"
        );
        assert!(!results.path().join("a").exists());
        claimed.publish(false).unwrap();
        drop(beside);
        assert_eq!(names(results.path()), ["a"]);
        assert!(matches!(
            claim(results.path(), "a", false).unwrap(),
            Claim::Done(_)
        ));
        let again = ours(claim(results.path(), "a", true).unwrap());
        fs::write(again.path().join("x"), "2").unwrap();
        again.publish(true).unwrap();
        assert_eq!(names(results.path()), ["a"]);
        assert_eq!(fs::read_to_string(results.path().join("a/x")).unwrap(), "2");
    }

    #[test]
    fn who_waited_finds_what_the_other_one_made() {
        let results = tempfile::tempdir().unwrap();
        let claimed = ours(claim(results.path(), "a", false).unwrap());
        std::thread::scope(|scope| {
            let other = scope
                .spawn(|| matches!(claim(results.path(), "a", false).unwrap(), Claim::Done(_)));
            claimed.publish(false).unwrap();
            assert!(other.join().unwrap());
        });
        assert_eq!(names(results.path()), ["a"]);
    }

    #[test]
    fn what_a_killed_process_left_goes_and_what_is_of_others_stays() {
        let results = tempfile::tempdir().unwrap();
        for left in [".a.x1.part", ".b.x1.part"] {
            fs::create_dir(results.path().join(left)).unwrap();
        }
        fs::write(results.path().join(".a.lock"), "").unwrap();
        ours(claim(results.path(), "a", false).unwrap())
            .publish(false)
            .unwrap();
        assert_eq!(names(results.path()), [".b.x1.part", "a"]);
    }
}
