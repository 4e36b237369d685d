//! A file's content as a number of 256 bits: equal for equal bytes, wherever they lie.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::file_error::{FileError, open_up_to};

/// Size of one read, bytes.
const CHUNK: usize = 1 << 16;
/// Maximum number of files in a folder: a recording in parts has a few.
const MOST_FILES: usize = 10_000;

/// SHA-256 of bytes, as `sha256sum` prints it.
pub fn hash_of(bytes: &[u8]) -> String {
    hex(Sha256::new_with_prefix(bytes))
}

/// SHA-256 of a file, as `sha256sum` prints it; for a folder, as a recording in parts, the SHA-256
/// of a list: a line with hash, two spaces and path for each file below it, ordered by path.
///
/// # Errors
/// [`FileError::Read`]
pub fn content_hash(path: &Path) -> Result<String, FileError> {
    let of_file = |path: &Path| {
        file_hash(path).map_err(|source| FileError::Read {
            path: path.to_owned(),
            source,
        })
    };
    if !path.is_dir() {
        return of_file(path);
    }
    let names = files_below(path).map_err(|source| FileError::Read {
        path: path.to_owned(),
        source,
    })?;
    let mut list = String::new();
    for name in names {
        list += &format!("{}  {}\n", of_file(&path.join(&name))?, name.display());
    }
    Ok(hash_of(list.as_bytes()))
}

fn file_hash(path: &Path) -> io::Result<String> {
    // without a size limit for a regular file
    let (mut file, mut hash) = (open_up_to(path, u64::MAX - 1)?, Sha256::new());
    let mut chunk = vec![0; CHUNK];
    loop {
        match file.read(&mut chunk)? {
            0 => return Ok(hex(hash)),
            count => hash.update(&chunk[..count]),
        }
    }
}

/// Files by their paths from `folder`, in order.
fn files_below(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let (mut files, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = folders.pop() {
        for entry in fs::read_dir(folder.join(&inner))? {
            let name = inner.join(entry?.file_name());
            if folder.join(&name).is_dir() {
                folders.push(name)
            } else {
                files.push(name)
            }
            if files.len() + folders.len() > MOST_FILES {
                return Err(io::Error::other(format!(
                    "it holds more than {MOST_FILES} files: name the recording itself"
                )));
            }
        }
    }
    files.sort();
    Ok(files)
}

fn hex(hash: Sha256) -> String {
    hash.finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of FIPS 180-2, B.1, and of no bytes at all.
    #[test]
    fn hashes_are_those_of_the_standard() {
        assert_eq!(
            hash_of(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        assert_eq!(
            hash_of(b""),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
        );
    }

    #[test]
    fn a_folder_has_the_hash_of_its_list() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("b")).unwrap();
        fs::write(folder.path().join("b/c"), "").unwrap();
        fs::write(folder.path().join("a"), "abc").unwrap();
        let list = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  a\n\
                    e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  b/c\n";
        assert_eq!(
            content_hash(folder.path()).unwrap(),
            hash_of(list.as_bytes())
        );
        assert_eq!(
            content_hash(&folder.path().join("a")).unwrap(),
            hash_of(b"abc")
        );
    }
}
