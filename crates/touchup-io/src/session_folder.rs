//! The folder of a session: made once; no file is written outside of it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Component, Path, PathBuf};

use super::atomic::write_atomically;

/// Longest file of lines that is read: a million strokes.
const MOST_BYTES: u64 = 64 << 20;

/// Why a name was refused as one of a file in the folder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// Absolute, with folders in it, or none at all.
    #[error("\"{0}\" is not the name of a file in the session's folder: give a plain name such as refined.ply")]
    NotAPlainName(String),
    /// There is something of that name that is no file, as a link.
    #[error("\"{0}\" is there and is no plain file: choose another name")]
    NotAFile(String),
    /// There is a file of that name.
    #[error("\"{0}\" is there already: choose another name, or set overwrite")]
    Taken(String),
}

/// A folder that this process made.
#[derive(Clone, Debug)]
pub struct SessionFolder {
    path: PathBuf,
    name: String,
}

impl SessionFolder {
    /// Makes a folder `name` in `parent`, or `name-2` and so on where that is taken.
    ///
    /// # Errors
    /// Whatever the system reports.
    pub fn create(parent: &Path, name: &str) -> io::Result<Self> {
        fs::create_dir_all(parent)?;
        let parent = fs::canonicalize(parent)?;
        for number in 1u32.. {
            let name = if number == 1 { name.to_owned() } else { format!("{name}-{number}") };
            let path = parent.join(&name);
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path, name }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::from(io::ErrorKind::AlreadyExists))
    }

    /// Where it is.
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
    /// Whatever the system reports.
    pub fn create_folder(&self, name: &str) -> io::Result<PathBuf> {
        let path = self.path.join(name);
        fs::create_dir(&path).map(|()| path)
    }

    /// The place of a file that somebody else named.
    ///
    /// # Errors
    /// [`PlaceError`] for whatever could lead out of the folder, and for a file that is there unless it may be replaced.
    pub fn place(&self, name: &str, may_replace: bool) -> Result<PathBuf, PlaceError> {
        let mut parts = Path::new(name).components();
        let is_plain = matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name)
            && !name.starts_with('.')
            && !name.chars().any(|c| c.is_control() || c == '\\');
        if !is_plain {
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
    /// Whatever the system reports.
    pub fn write_text(&self, name: &str, text: &str) -> io::Result<()> {
        write_atomically(&self.path.join(name), |out| out.write_all(text.as_bytes()))
    }

    /// Adds a line to a file, and has it on the disk.
    ///
    /// # Errors
    /// Whatever the system reports.
    pub fn append_line(&self, name: &str, line: &str) -> io::Result<()> {
        let mut file = OpenOptions::new().create(true).append(true).open(self.path.join(name))?;
        file.write_all(format!("{line}\n").as_bytes())?;
        file.sync_data()
    }
}

/// The text of a file that is not absurdly long; empty where there is none.
///
/// # Errors
/// Whatever the system reports, and a file that is too long or no text.
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

/// A path that holds wherever the process is started from, and the checksum of what is there.
///
/// # Errors
/// Whatever the system reports.
pub fn fingerprint(path: &Path) -> io::Result<(PathBuf, u32)> {
    let (mut file, mut crc, mut buffer) = (File::open(path)?, crc32fast::Hasher::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((fs::canonicalize(path)?, crc.finalize())),
            count => crc.update(&buffer[..count]),
        }
    }
}
