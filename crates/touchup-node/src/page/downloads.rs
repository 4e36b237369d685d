//! List of downloadable sessions, and streams of their files.

use std::io::{self, Read};
use std::path::Path;

use futures_util::{Stream, stream};
use serde_json::{Value, json};

use touchup_io::session_folder::{ListedSession, list_sessions};
use touchup_session::session::SessionFacts;

/// Bytes per read.
const PIECE: usize = 256 << 10;

/// All sessions, the newest first.
///
/// - `current`: name of the running session.
pub(super) fn sessions(folder: &Path, current: &str) -> io::Result<Vec<Value>> {
    let listed = list_sessions(folder)?;
    let shown = |ListedSession { name, bytes, files }: ListedSession| {
        // file times do not count: copies change them
        let begun = SessionFacts::read(&folder.join(&name))
            .ok()
            .and_then(|facts| facts.begun);
        let mut session =
            json!({ "is_current": name == current, "name": name, "bytes": bytes, "files": files });
        if let Some(begun) = begun {
            session["begun"] = begun.into();
        }
        session
    };
    Ok(listed.into_iter().map(shown).collect())
}

/// Stream of the rest of a file; reads run on threads that may block.
pub(super) fn body_of(
    file: impl Read + Send + 'static,
) -> impl Stream<Item = io::Result<Vec<u8>>> + Send {
    stream::unfold(Some(file), |file| async move {
        let mut file = file?;
        let read = move || {
            let mut piece = vec![0; PIECE];
            let count = file.read(&mut piece)?;
            piece.truncate(count);
            Ok((piece, file))
        };
        match tokio::task::spawn_blocking(read)
            .await
            .map_err(io::Error::other)
            .flatten()
        {
            Ok((piece, _)) if piece.is_empty() => None,
            Ok((piece, file)) => Some((Ok(piece), Some(file))),
            Err(error) => Some((Err(error), None)),
        }
    })
}
