//! Files that appear whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

/// A file that appears under its name only by [`AtomicFile::commit`].
///
/// Until then it lies beside its target under a temporary name; without commit, drop removes it and
/// an older file of that name stays untouched. A link is followed, even to a missing file, and its
/// target replaced. The next writer to the same place removes temporary files of killed processes.
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    writer: BufWriter<File>,
    /// removes the file on drop
    temporary: TempPath,
}

impl AtomicFile {
    /// Opens a temporary file beside `path`.
    ///
    /// # Errors
    /// The folder is missing or not writable; `path` names something other than a plain file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let target = followed(path)?;
        let refused = |kind, why: String| Err(io::Error::new(kind, why));
        let Some(name) = target.file_name() else {
            return refused(io::ErrorKind::InvalidInput, "the path names no file".into());
        };
        if fs::metadata(&target).is_ok_and(|m| !m.is_file()) {
            return refused(
                io::ErrorKind::InvalidInput,
                "it is there already and is not a plain file".into(),
            );
        }
        let folder = folder_of(&target);
        if !folder.is_dir() {
            return refused(
                io::ErrorKind::NotFound,
                format!("there is no folder {}: make it first", folder.display()),
            );
        }
        let stem = format!(".{}.", name.display());
        remove_left(folder, &stem);
        let prefix = format!("{stem}{}-", std::process::id());
        let beside = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(".part")
            .make_in(folder, |path| File::create_new(path))?;
        let (file, temporary) = beside.into_parts();
        Ok(Self {
            target,
            writer: BufWriter::with_capacity(1 << 16, file),
            temporary,
        })
    }

    /// Syncs everything to disk and gives the file its name, in place of an older one.
    ///
    /// # Errors
    /// Any error of writing, synchronising or renaming, after removal of the temporary file.
    pub fn commit(mut self) -> io::Result<()> {
        self.writer.flush()?;
        self.writer.get_ref().sync_all()?;
        self.temporary
            .persist(&self.target)
            .map_err(|error| error.error)?;
        // the new name is on the disk once its folder is; some file systems do not support that
        let _ = File::open(folder_of(&self.target)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.writer.seek(to)
    }

    /// Unlike a seek it leaves the buffer as it is.
    fn stream_position(&mut self) -> io::Result<u64> {
        self.writer.stream_position()
    }
}

/// Writes a whole file by `write`; on any error an older file of that name stays untouched.
///
/// # Errors
/// As [`AtomicFile`] and `write`.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut AtomicFile) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file)?;
    file.commit()
}

/// Makes a folder and its missing parents.
///
/// # Errors
/// Any system error.
pub fn create_folder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path)
}

/// Whether both names lead to one existing file.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    fs::canonicalize(a).is_ok_and(|a| fs::canonicalize(b).is_ok_and(|b| a == b))
}

/// Maximum length of a chain of links, as on Linux.
const MOST_LINKS: usize = 40;

/// Target of a path, even if no file exists there.
fn followed(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        if let Ok(there) = fs::canonicalize(&target) {
            return Ok(there);
        }
        match fs::read_link(&target) {
            Ok(next) => target = folder_of(&target).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        "its links lead in a circle",
    ))
}

/// Removes temporary files `stem`PID-….part of dead processes; without `/proc` they stay.
pub(super) fn remove_left(folder: &Path, stem: &str) {
    let (processes, Ok(entries)) = (Path::new("/proc"), fs::read_dir(folder)) else {
        return;
    };
    if !processes.join("self").exists() {
        return;
    }
    for entry in entries.flatten() {
        let name = entry.file_name();
        let rest = name
            .to_str()
            .and_then(|name| name.strip_prefix(stem)?.strip_suffix(".part"));
        let Some((process, _)) = rest.and_then(|rest| rest.split_once('-')) else {
            continue;
        };
        if process
            .parse::<u32>()
            .is_ok_and(|id| !processes.join(id.to_string()).exists())
        {
            // without permission it stays
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn only_a_commit_changes_the_target() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        drop(file);
        assert_eq!(names(folder.path()), ["a.txt"]);
        let failed = write_atomically(&path, |w| {
            w.write_all(b"half").and(Err(io::Error::other("disk full")))
        });
        assert_eq!(failed.unwrap_err().to_string(), "disk full");
        assert_eq!(
            (
                fs::read_to_string(&path).unwrap().as_str(),
                names(folder.path()).len()
            ),
            ("old", 1)
        );
        write_atomically(&path, |w| w.write_all(b"new")).unwrap();
        assert_eq!(
            (
                fs::read_to_string(&path).unwrap().as_str(),
                names(folder.path()).len()
            ),
            ("new", 1)
        );
    }

    #[test]
    fn places_that_cannot_hold_a_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let missing = AtomicFile::create(&folder.path().join("no/a.txt"))
            .unwrap_err()
            .to_string();
        assert!(
            missing.starts_with("there is no folder") && missing.ends_with("no: make it first"),
            "{missing}"
        );
        let taken = AtomicFile::create(folder.path()).unwrap_err().to_string();
        assert!(taken.contains("not a plain file"), "{taken}");
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_killed_process_left_goes_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let gone = child.id();
        child.wait().unwrap();
        let here = std::process::id();
        let left = format!(".a.txt.{gone}-x1.part");
        let stay = [
            format!(".a.txt.{here}-x1.part"),
            format!(".b.txt.{gone}-x1.part"),
            format!(".a.txt.{gone}-x1"),
            ".a.txt.notes.part".to_owned(),
            format!("a.txt.{gone}-x1.part"),
        ];
        stay.iter()
            .chain([&left])
            .for_each(|name| fs::write(folder.path().join(name), "half").unwrap());
        write_atomically(&folder.path().join("a.txt"), |w| w.write_all(b"new")).unwrap();
        let mut expected = stay.to_vec();
        expected.push("a.txt".to_owned());
        expected.sort();
        let mut found = names(folder.path());
        found.sort();
        assert_eq!(found, expected);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_no_file_yet_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("there")).unwrap();
        let (far, link, first) = (
            folder.path().join("there/a.txt"),
            folder.path().join("link"),
            folder.path().join("first"),
        );
        std::os::unix::fs::symlink("there/a.txt", &link).unwrap();
        std::os::unix::fs::symlink("link", &first).unwrap();
        write_atomically(&first, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&far).unwrap(), "new");
        assert!(
            [&link, &first]
                .iter()
                .all(|path| fs::symlink_metadata(path).unwrap().is_symlink())
        );
        let round = folder.path().join("round");
        std::os::unix::fs::symlink("round", &round).unwrap();
        assert!(
            write_atomically(&round, |w| w.write_all(b"new"))
                .unwrap_err()
                .to_string()
                .contains("circle")
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.txt"), folder.path().join("link"));
        fs::write(&path, "old").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_atomically(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }
}
