//! The inspection report of a session: operators make it, everybody may read it.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::{Path, Query, Request, State};
use axum::http::header::{self, HeaderMap};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use serde_json::json;
use tokio::sync::oneshot;
use tokio::time::timeout;

use super::reporting::report_request::{NominalSource, ReportRequest};
use super::reporting::report_work::{NominalFile, ReportWork};
use crate::page::admission::access::Role;
use crate::page::admission::entrance::{as_json, refusal};
use crate::page::background::begin;
use crate::page::calls::MAY_ONLY_LOOK;
use crate::page::downloads::body_of;
use crate::page::site::Site;
use crate::ros::port::Reply;
use touchup_inspect::ReportFiles;
use touchup_io::session_folder::{HandedIn, SessionFolder, open_file};
use touchup_session::session::SessionFacts;

/// A report is a document alone: without scripts, external content, and links.
const POLICY: &str = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";
/// Time-out for each piece of an upload.
const PIECE_WITHIN: Duration = Duration::from_secs(20);
/// Time-out for a whole upload, enough at 1 Mbit/s: others wait for their turn.
const WHOLE_WITHIN: Duration = Duration::from_secs(600);
/// Time-out for saving the session.
const SAVED_WITHIN: Duration = Duration::from_secs(120);

/// Reason of a missing report.
struct ReportRefusal(StatusCode, String);

impl ReportRefusal {
    fn bad(why: impl ToString) -> Self {
        Self(StatusCode::BAD_REQUEST, why.to_string())
    }

    fn unavailable(why: impl ToString) -> Self {
        Self(StatusCode::SERVICE_UNAVAILABLE, why.to_string())
    }
}

/// Makes a report: `POST /api/reports/SESSION?…`, with uploaded nominal values in its body.
pub(super) async fn make(
    State(site): State<Arc<Site>>,
    headers: HeaderMap,
    Path(session): Path<String>,
    query: Result<Query<ReportRequest>, axum::extract::rejection::QueryRejection>,
    request: Request,
) -> Response {
    match site.entrance.role_of(&headers) {
        Ok(Role::Operate) => {}
        Ok(Role::Look) => return refusal(StatusCode::FORBIDDEN, MAY_ONLY_LOOK),
        Err(response) => return *response,
    }
    let asked = query
        .map(|Query(asked)| asked)
        .map_err(|error| ReportRefusal::bad(error.body_text()));
    let made = match asked {
        Ok(asked) => report(&site, &session, &asked, &headers, request.into_body()).await,
        Err(refused) => Err(refused),
    };
    match made {
        Ok(was_saved) => as_json(&json!({ "files": ReportFiles::NAMES, "was_saved": was_saved })),
        Err(ReportRefusal(status, why)) => refusal(status, &why),
    }
}

/// Makes the report; returns whether the session runs, and was saved for it.
async fn report(
    site: &Arc<Site>,
    session: &str,
    asked: &ReportRequest,
    headers: &HeaderMap,
    body: Body,
) -> Result<bool, ReportRefusal> {
    let Ok(turn) = Arc::clone(&site.reports.turn).try_acquire_owned() else {
        let why = "another report is being made: ask again when it is there";
        return Err(ReportRefusal(StatusCode::TOO_MANY_REQUESTS, why.to_owned()));
    };
    let is_current = session == site.mesh.session();
    let folder = SessionFolder::open(&site.session_folder, session);
    let session =
        folder.map_err(|error| ReportRefusal(StatusCode::NOT_FOUND, error.to_string()))?;
    let own_unit = SessionFacts::read(session.path())
        .ok()
        .map(|facts| facts.mesh_unit);
    let mesh_unit = own_unit.unwrap_or_default();
    let mut params = asked.params(mesh_unit).map_err(ReportRefusal::bad)?;
    let nominal = match asked.nominal {
        NominalSource::Upload => {
            NominalFile::HandedIn(whole_within(handed_in(&session, asked, headers, body)).await?)
        }
        NominalSource::Session => {
            NominalFile::File(asked.in_session(&session).map_err(ReportRefusal::bad)?)
        }
        NominalSource::Part => {
            let part = site.reports.part.clone();
            params.drawing.unit = site.reports.mesh_unit;
            NominalFile::File(part.ok_or_else(|| {
                ReportRefusal::bad(
                    "the node has no nominal part: hand in one, or start it with --web-nominal",
                )
            })?)
        }
    };
    if is_current {
        save(site).await?;
    }
    let work = ReportWork {
        session,
        is_current,
        nominal,
        params,
        mesh_unit,
    };
    let made = begin("report", move || {
        let made = work.run();
        drop(turn);
        made
    });
    let made = made.map_err(ReportRefusal::unavailable)?.await;
    let made = made.map_err(|_| {
        ReportRefusal::unavailable("the report was not made, by a fault of the program")
    })?;
    made.map(|()| is_current).map_err(ReportRefusal::bad)
}

/// The upload, within its time-out.
async fn whole_within<F: Future<Output = Result<HandedIn, ReportRefusal>>>(
    file: F,
) -> Result<HandedIn, ReportRefusal> {
    let late = |_| {
        ReportRefusal::bad(format!(
            "the file did not come whole within {} s",
            WHOLE_WITHIN.as_secs()
        ))
    };
    timeout(WHOLE_WITHIN, file).await.map_err(late)?
}

/// Receives the body of a request, piece by piece.
async fn handed_in(
    session: &SessionFolder,
    asked: &ReportRequest,
    headers: &HeaderMap,
    body: Body,
) -> Result<HandedIn, ReportRefusal> {
    let (name, most) = asked.upload().map_err(ReportRefusal::bad)?;
    let too_large = || {
        ReportRefusal(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!("{name} may have up to {} MB", most >> 20),
        )
    };
    let length = headers
        .get(header::CONTENT_LENGTH)
        .and_then(|length| length.to_str().ok()?.parse::<u64>().ok());
    if length.is_some_and(|length| length > most) {
        return Err(too_large());
    }
    let mut file = HandedIn::new(session, name, most).map_err(ReportRefusal::bad)?;
    let mut pieces = body.into_data_stream();
    loop {
        let piece = timeout(PIECE_WITHIN, pieces.next()).await;
        let Some(piece) =
            piece.map_err(|_| ReportRefusal::bad(format!("{name} did not come whole")))?
        else {
            return Ok(file);
        };
        let piece = piece
            .map_err(|error| ReportRefusal::bad(format!("{name} did not come whole: {error}")))?;
        // the disk may be slow
        let added = tokio::task::spawn_blocking(move || file.add(&piece).map(|()| file)).await;
        file = match added.map_err(io::Error::other).flatten() {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::FileTooLarge => return Err(too_large()),
            Err(error) => {
                return Err(ReportRefusal::unavailable(format!(
                    "{name} could not be written: {error}"
                )));
            }
        };
    }
}

/// Makes the node save its session.
async fn save(site: &Site) -> Result<(), ReportRefusal> {
    let (to, saved) = oneshot::channel();
    let request = json!({ "overwrite": true, "with_features": true });
    site.call(
        Role::Operate,
        "~/save_mesh",
        request,
        Reply::new(move |answer| drop(to.send(answer))),
    );
    let late = || ReportRefusal::unavailable("the session was not saved in time: ask again");
    let answer = timeout(SAVED_WITHIN, saved)
        .await
        .map_err(|_| late())?
        .map_err(|_| late())?;
    let answer = answer.map_err(ReportRefusal::unavailable)?;
    match answer["success"].as_bool() {
        Some(true) => Ok(()),
        _ => Err(ReportRefusal::unavailable(
            answer["message"].as_str().unwrap_or_default(),
        )),
    }
}

/// Serves a report: `GET /api/reports/SESSION`.
pub(super) async fn show(
    State(site): State<Arc<Site>>,
    headers: HeaderMap,
    Path(session): Path<String>,
) -> Response {
    if let Err(response) = site.entrance.role_of(&headers) {
        return *response;
    }
    let folder = site.session_folder.clone();
    let [html, ..] = ReportFiles::NAMES;
    match tokio::task::spawn_blocking(move || open_file(&folder, &session, html)).await {
        Ok(Ok((file, length))) => {
            let head = [
                (
                    header::CONTENT_TYPE,
                    HeaderValue::from_static("text/html; charset=utf-8"),
                ),
                (header::CONTENT_LENGTH, HeaderValue::from(length)),
                (
                    header::CONTENT_SECURITY_POLICY,
                    HeaderValue::from_static(POLICY),
                ),
                (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
            ];
            (head, Body::from_stream(body_of(file))).into_response()
        }
        Ok(Err(_)) => refusal(StatusCode::NOT_FOUND, "this session has no report yet"),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}
