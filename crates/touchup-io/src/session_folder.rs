//! The folder of a session: made once; no file is written outside of it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Component, Path, PathBuf};

use super::atomic::write_atomically;
use super::file_error::open_up_to;

/// Longest file of lines for reading: a million strokes.
const MOST_BYTES: u64 = 64 << 20;

/// Why a name is refused for a file in the folder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// Absolute, with folders in it, or none at all.
    #[error(
        "\"{0}\" is not the name of a file in the session's folder: give a plain name such as refined.ply"
    )]
    NotAPlainName(String),
    /// An existing entry that is no file, such as a link.
    #[error("\"{0}\" is there and is no plain file: choose another name")]
    NotAFile(String),
    /// An existing file.
    #[error("\"{0}\" is there already: choose another name, or set overwrite")]
    Taken(String),
}

/// A folder made by this process.
#[derive(Clone, Debug)]
pub struct SessionFolder {
    path: PathBuf,
    name: String,
}

impl SessionFolder {
    /// Makes a folder `name` in `parent`, or `name-2` and so on for a taken name.
    ///
    /// # Errors
    /// Any system error.
    pub fn create(parent: &Path, name: &str) -> io::Result<Self> {
        fs::create_dir_all(parent)?;
        let parent = fs::canonicalize(parent)?;
        for number in 1u32.. {
            let name = if number == 1 {
                name.to_owned()
            } else {
                format!("{name}-{number}")
            };
            let path = parent.join(&name);
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path, name }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::from(io::ErrorKind::AlreadyExists))
    }

    /// An existing one, by a name from outside.
    ///
    /// # Errors
    /// Any system error, and names that could lead elsewhere.
    pub fn open(parent: &Path, name: &str) -> io::Result<Self> {
        let path = parent.join(name);
        // a link may lead anywhere
        if !is_plain_name(name) || !fs::symlink_metadata(&path).is_ok_and(|there| there.is_dir()) {
            return Err(io::Error::new(
                io::ErrorKind::NotFound,
                "there is no session of this name",
            ));
        }
        Ok(Self {
            path,
            name: name.to_owned(),
        })
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its own name: that of the session.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Makes a folder in it.
    ///
    /// # Errors
    /// Any system error.
    pub fn create_folder(&self, name: &str) -> io::Result<PathBuf> {
        let path = self.path.join(name);
        fs::create_dir(&path).map(|()| path)
    }

    /// The place of a file, by a name from outside.
    ///
    /// # Errors
    /// [`PlaceError`] for any name that could lead out of the folder, and for an existing file
    /// unless it may be replaced.
    pub fn place(&self, name: &str, may_replace: bool) -> Result<PathBuf, PlaceError> {
        if !is_plain_name(name) {
            return Err(PlaceError::NotAPlainName(name.to_owned()));
        }
        let path = self.path.join(name);
        match fs::symlink_metadata(&path) {
            Ok(there) if !there.is_file() => Err(PlaceError::NotAFile(name.to_owned())),
            Ok(_) if !may_replace => Err(PlaceError::Taken(name.to_owned())),
            _ => Ok(path),
        }
    }

    /// Writes a text file as a whole.
    ///
    /// # Errors
    /// Any system error.
    pub fn write_text(&self, name: &str, text: &str) -> io::Result<()> {
        write_text_file(&self.path.join(name), text)
    }

    /// Adds a line to a file, and syncs it to the disk.
    ///
    /// # Errors
    /// Any system error.
    pub fn append_line(&self, name: &str, line: &str) -> io::Result<()> {
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(self.path.join(name))?;
        file.write_all(format!("{line}\n").as_bytes())?;
        file.sync_data()
    }
}

/// Prefix of upload folders: hidden, so that nobody lists or reads them.
const HANDED_IN: &str = ".upload-";

/// An upload in pieces, in a hidden folder of a session, until drop.
#[derive(Debug)]
pub struct HandedIn {
    file: File,
    path: PathBuf,
    room: u64,
    /// removes both on drop
    _folder: tempfile::TempDir,
}

impl HandedIn {
    /// An empty upload; removes the remains of killed processes.
    ///
    /// - `name`: name at its source.
    /// - `most`: maximum number of bytes.
    ///
    /// # Errors
    /// Any system error, and names that could lead elsewhere.
    pub fn new(session: &SessionFolder, name: &str, most: u64) -> io::Result<Self> {
        if !is_plain_name(name) {
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                PlaceError::NotAPlainName(name.to_owned()),
            ));
        }
        for left in fs::read_dir(session.path())?.filter_map(Result::ok) {
            if left.file_name().to_string_lossy().starts_with(HANDED_IN)
                && left.file_type()?.is_dir()
            {
                fs::remove_dir_all(left.path())?;
            }
        }
        let folder = tempfile::Builder::new()
            .prefix(HANDED_IN)
            .tempdir_in(session.path())?;
        let path = folder.path().join(name);
        Ok(Self {
            file: File::create_new(&path)?,
            path,
            room: most,
            _folder: folder,
        })
    }

    /// Adds a piece.
    ///
    /// # Errors
    /// Any system error; [`io::ErrorKind::FileTooLarge`] beyond the maximum size.
    pub fn add(&mut self, piece: &[u8]) -> io::Result<()> {
        let left = self.room.checked_sub(piece.len() as u64);
        self.room = left
            .ok_or_else(|| io::Error::new(io::ErrorKind::FileTooLarge, "the file is too large"))?;
        self.file.write_all(piece)
    }

    /// Path of the upload.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// A session in a folder of sessions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ListedSession {
    /// of its folder
    pub name: String,
    /// of all its files
    pub bytes: u64,
    /// names of its files, in their order
    pub files: Vec<String>,
}

/// Maximum number of sessions in a list: the last by name, which are the newest.
const MOST_LISTED: usize = 1000;

/// The sessions in a folder, the newest first; links and names of another form are left out.
///
/// # Errors
/// Any system error.
pub fn list_sessions(parent: &Path) -> io::Result<Vec<ListedSession>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(parent)? {
        let entry = entry?;
        let name = entry.file_name().into_string().unwrap_or_default();
        if still_there(entry.file_type())?.is_some_and(|kind| kind.is_dir()) && is_plain_name(&name)
        {
            names.push(name);
        }
    }
    names.sort();
    names.reverse();
    names.truncate(MOST_LISTED);
    let listed = names
        .into_iter()
        .filter_map(|name| still_there(listed(parent, name)).transpose());
    listed.collect()
}

/// `None` for a vanished entry, such as a temporary file that took another one's place meanwhile.
fn still_there<T>(found: io::Result<T>) -> io::Result<Option<T>> {
    match found {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        found => found.map(Some),
    }
}

fn listed(parent: &Path, name: String) -> io::Result<ListedSession> {
    let mut session = ListedSession {
        name,
        bytes: 0,
        files: Vec::new(),
    };
    for entry in fs::read_dir(parent.join(&session.name))? {
        let entry = entry?;
        let file = entry.file_name().into_string().unwrap_or_default();
        let Some(about) = still_there(entry.metadata())? else {
            continue;
        };
        if about.is_file() && is_plain_name(&file) {
            session.bytes += about.len();
            session.files.push(file);
        }
    }
    session.files.sort();
    Ok(session)
}

/// A file of a session, by a name from outside, and its length.
///
/// # Errors
/// Any system error, and names that could lead elsewhere.
pub fn open_file(parent: &Path, session: &str, file: &str) -> io::Result<(File, u64)> {
    if !is_plain_name(session) || !is_plain_name(file) {
        return Err(io::Error::new(
            io::ErrorKind::NotFound,
            "this is not the name of a file of a session",
        ));
    }
    let folder = parent.join(session);
    let path = folder.join(file);
    // a link may lead anywhere
    if !fs::symlink_metadata(&folder)?.is_dir() || !fs::symlink_metadata(&path)?.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::NotFound,
            "this is no plain file of a session",
        ));
    }
    let opened = File::open(path)?;
    let length = opened.metadata()?.len();
    Ok((opened, length))
}

/// Whether it is the name of one thing in a folder, and of none outside.
pub(super) fn is_plain_name(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name)
        && !name.starts_with('.')
        && !name
            .chars()
            .any(|c| c.is_control() || c == '\\' || c == '"')
}

/// Writes a text file as a whole.
///
/// # Errors
/// Any system error.
pub fn write_text_file(path: &Path, text: &str) -> io::Result<()> {
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}

/// The text of a file of sensible length; empty for a missing file.
///
/// # Errors
/// Any system error, and a file that is too long or no text.
pub fn read_text(path: &Path) -> io::Result<String> {
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(String::new()),
        file => file?,
    };
    let mut text = String::new();
    if file.take(MOST_BYTES).read_to_string(&mut text)? as u64 == MOST_BYTES {
        return Err(io::Error::other("it is too long"));
    }
    Ok(text)
}

/// A path independent of the working directory, and the checksum of its file.
///
/// # Errors
/// Any system error.
pub fn fingerprint(path: &Path) -> io::Result<(PathBuf, u32)> {
    let (mut file, mut crc, mut buffer) = (
        // without a size limit for a regular file
        open_up_to(path, u64::MAX - 1)?,
        crc32fast::Hasher::new(),
        vec![0; 1 << 16],
    );
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((fs::canonicalize(path)?, crc.finalize())),
            count => crc.update(&buffer[..count]),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use super::*;

    /// Two sessions, a link to elsewhere, a hidden folder, and a file that is no session.
    fn sessions() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, file, text) in [
            ("one", "a.ply", "ply"),
            ("two", "b.json", "{}"),
            ("two", "a.ply", "ply\n"),
            (".hidden", "x", "x"),
        ] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
            write_text_file(&folder.path().join(name).join(file), text).unwrap();
        }
        fs::create_dir(folder.path().join("two/recording")).unwrap();
        write_text_file(&folder.path().join("notes.txt"), "no session").unwrap();
        symlink("/etc", folder.path().join("linked")).unwrap();
        symlink("/etc/hostname", folder.path().join("two/link.json")).unwrap();
        folder
    }

    #[test]
    fn sessions_are_listed_from_the_newest_on_with_their_plain_files() {
        let folder = sessions();
        let listed = list_sessions(folder.path()).unwrap();
        let session = |name: &str, bytes, files: &[&str]| ListedSession {
            name: name.to_owned(),
            bytes,
            files: files.iter().map(|&file| file.to_owned()).collect(),
        };
        assert_eq!(
            listed,
            [
                session("two", 6, &["a.ply", "b.json"]),
                session("one", 3, &["a.ply"])
            ]
        );
    }

    #[test]
    fn files_may_come_and_go_while_sessions_are_listed() {
        let folder = sessions();
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    write_text_file(&folder.path().join("two/b.json"), "{}").unwrap();
                }
            });
            let listed: Vec<_> = (0..3000).map(|_| list_sessions(folder.path())).collect();
            is_over.store(true, Ordering::Relaxed);
            assert!(listed.into_iter().all(|listed| listed.unwrap().len() == 2));
        });
    }

    #[test]
    fn what_is_handed_in_has_its_name_and_its_limit_and_goes_with_who_took_it() {
        let folder = sessions();
        let session = SessionFolder::open(folder.path(), "two").unwrap();
        let left = session.path().join(".upload-left");
        fs::create_dir(&left).unwrap();
        let mut file = HandedIn::new(&session, "part.stl", 5).unwrap();
        assert!(!left.exists(), "what another one left is gone");
        file.add(b"abc").unwrap();
        file.add(b"de").unwrap();
        assert_eq!(
            file.add(b"f").unwrap_err().kind(),
            io::ErrorKind::FileTooLarge
        );
        assert_eq!(fs::read(file.path()).unwrap(), b"abcde");
        assert!(file.path().ends_with("part.stl") && file.path().starts_with(session.path()));
        assert_eq!(
            list_sessions(folder.path()).unwrap()[0].files,
            ["a.ply", "b.json"],
            "nobody lists it"
        );
        let path = file.path().to_owned();
        drop(file);
        assert!(!path.exists() && !path.parent().unwrap().exists());
        for name in ["../part.stl", "/etc/passwd", "", ".hidden", "a\0b", "a/b"] {
            assert!(HandedIn::new(&session, name, 5).is_err(), "{name}");
        }
    }

    #[test]
    fn only_sessions_in_the_folder_are_opened() {
        let folder = sessions();
        assert_eq!(
            SessionFolder::open(folder.path(), "one").unwrap().path(),
            folder.path().join("one")
        );
        for name in [
            "linked",
            ".hidden",
            "..",
            "",
            "one/",
            "one/../two",
            "/etc",
            "notes.txt",
            "missing",
        ] {
            assert!(SessionFolder::open(folder.path(), name).is_err(), "{name}");
        }
    }

    #[test]
    fn only_plain_files_of_sessions_are_opened() {
        let folder = sessions();
        let mut text = String::new();
        let (mut file, length) = open_file(folder.path(), "two", "a.ply").unwrap();
        file.read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), length), ("ply\n", 4));
        for (session, file) in [
            ("two", "link.json"),
            ("two", "recording"),
            ("two", "../one/a.ply"),
            ("two", ".."),
            ("two", ""),
            ("..", "notes.txt"),
            ("", "notes.txt"),
            (".hidden", "x"),
            ("linked", "hostname"),
            ("/etc", "hostname"),
            ("two", "/etc/hostname"),
            ("two", "a.ply\0"),
            ("missing", "a.ply"),
        ] {
            assert!(
                open_file(folder.path(), session, file).is_err(),
                "{session}/{file}"
            );
        }
    }
}
