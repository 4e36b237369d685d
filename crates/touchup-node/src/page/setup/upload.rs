//! Upload of a scan, a recording or a table by a page: piece by piece into the folder of scans.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::http::StatusCode;
use futures_util::StreamExt;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use super::node_setup::{LARGEST_UPLOAD, NodeSetup};
use super::setup_shown::{ScanChoice, UploadShown};
use super::setup_state::{NodeSetupError, READING};
use crate::ros::locked;
use touchup_io::scan_folder::{ScanFolderError, ScanUpload};

/// Bytes per write.
const PIECE: usize = 1 << 20;
/// Maximum number of bytes skipped of a refused file.
const LARGEST_UNHEARD: usize = 64 << 20;
/// Time-out for the next piece of an upload.
const STALLED: Duration = Duration::from_secs(30);

/// Reason of a refused file.
pub(super) type UploadRefusal = (StatusCode, String);

/// Receives a file: returns its name in the folder.
///
/// - `is_scan`: a scan, or else a recording or a table of points.
/// - `length`: announced number of bytes, if any.
///
/// # Errors
/// The status and the reason, in words; nothing of the file remains.
pub(super) async fn take(
    setup: &Arc<NodeSetup>,
    name: String,
    is_scan: bool,
    length: Option<u64>,
    body: Body,
) -> Result<String, UploadRefusal> {
    if length.is_some_and(|length| length > LARGEST_UPLOAD) {
        return Err(refusal(ScanFolderError::TooLarge(LARGEST_UPLOAD)));
    }
    let mut pieces = body.into_data_stream();
    let (place, mut upload) = match begin(setup, name, is_scan, length).await {
        Ok(begun) => begun,
        Err(refused) => {
            // a browser that still sends reads no answer
            let mut left = LARGEST_UNHEARD;
            while let Ok(Some(Ok(piece))) = timeout(STALLED, pieces.next()).await {
                let Some(less) = left.checked_sub(piece.len()) else {
                    break;
                };
                left = less;
            }
            return Err(refused);
        }
    };
    let (mut waiting, mut count) = (Vec::with_capacity(PIECE), 0);
    loop {
        let next = timeout(STALLED, pieces.next()).await;
        let next = next.map_err(|_| {
            (
                StatusCode::REQUEST_TIMEOUT,
                "nothing came any more: send it again".to_owned(),
            )
        })?;
        let is_last = next.is_none();
        if let Some(piece) = next {
            waiting.extend_from_slice(
                &piece.map_err(|error| (StatusCode::BAD_REQUEST, error.to_string()))?,
            );
        }
        if waiting.len() >= PIECE || is_last {
            count += waiting.len() as u64;
            (upload, waiting) = write(upload, waiting).await?;
            place.note(count);
        }
        if is_last {
            return on_disk(move || upload.commit()).await;
        }
    }
}

impl NodeSetup {
    /// Takes the place of the only upload; dropping the result frees it.
    ///
    /// # Errors
    /// [`NodeSetupError::NotNow`]
    fn begin_upload(
        self: &Arc<Self>,
        name: &str,
        of: Option<u64>,
    ) -> Result<UploadPlace, NodeSetupError> {
        let mut state = self.choosing()?;
        match &state.scan {
            _ if state.upload.is_some() => {
                return Err(NodeSetupError::NotNow(
                    "another file is on its way: wait for it",
                ));
            }
            ScanChoice::Reading { .. } => return Err(READING),
            _ => {}
        }
        state.upload = Some(UploadShown {
            name: name.chars().take(200).collect(),
            bytes: 0,
            of,
        });
        Ok(UploadPlace(Arc::clone(self)))
    }
}

/// The place of an upload.
struct UploadPlace(Arc<NodeSetup>);

impl UploadPlace {
    /// Sets the number of received bytes.
    fn note(&self, so_far: u64) {
        if let Some(upload) = &mut locked(&self.0.state).upload {
            upload.bytes = so_far;
        }
    }
}

impl Drop for UploadPlace {
    fn drop(&mut self) {
        locked(&self.0.state).upload = None;
    }
}

async fn begin(
    setup: &Arc<NodeSetup>,
    name: String,
    is_scan: bool,
    length: Option<u64>,
) -> Result<(UploadPlace, ScanUpload), UploadRefusal> {
    let not_now = |error: NodeSetupError| (StatusCode::CONFLICT, error.to_string());
    let place = setup.begin_upload(&name, length).map_err(not_now)?;
    let folder = setup.folder.clone();
    let upload = on_disk(move || folder.begin_upload(&name, is_scan, LARGEST_UPLOAD)).await?;
    Ok((place, upload))
}

async fn write(
    mut upload: ScanUpload,
    mut piece: Vec<u8>,
) -> Result<(ScanUpload, Vec<u8>), UploadRefusal> {
    on_disk(move || {
        upload.add(&piece)?;
        piece.clear();
        Ok((upload, piece))
    })
    .await
}

/// Runs on a thread that may wait for the disk.
async fn on_disk<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ScanFolderError> + Send + 'static,
) -> Result<T, UploadRefusal> {
    match spawn_blocking(work).await {
        Ok(done) => done.map_err(refusal),
        Err(error) => Err((StatusCode::SERVICE_UNAVAILABLE, error.to_string())),
    }
}

fn refusal(error: ScanFolderError) -> UploadRefusal {
    let status = match error {
        ScanFolderError::TooLarge(_) => StatusCode::PAYLOAD_TOO_LARGE,
        ScanFolderError::System(_) => StatusCode::INSUFFICIENT_STORAGE,
        _ => StatusCode::BAD_REQUEST,
    };
    (status, error.to_string())
}
