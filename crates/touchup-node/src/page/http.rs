//! Routes of the page while a node runs: the page itself, the socket, and files of sessions. Each
//! request passes the checks first.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::http::header::{self, HeaderMap};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Extension, Router};
use serde::Deserialize;
use serde_json::{Value, json};

use super::admission::access::Role;
use super::admission::entrance::{self, as_json, refusal};
use super::connection;
use super::downloads::{body_of, sessions};
use super::page_place::PagePlace;
use super::replay::{self, Replays};
use super::reports;
use super::site::Site;

/// Maximum size of a message from a page, bytes.
const LARGEST_MESSAGE: usize = 64 << 10;
/// Maximum backlog of the socket to a page, bytes.
const LARGEST_BACKLOG: usize = 8 << 20;
/// The protocol of the socket.
const PROTOCOL: &str = "touchup.v1";

/// All routes.
pub(super) fn router(site: Arc<Site>, replays: Arc<Replays>) -> Router {
    let checked = from_fn_with_state(Arc::clone(&site.entrance), entrance::check);
    let page = entrance::routes(&site.entrance);
    Router::new()
        .route("/ws", get(upgrade).layer(Extension(replays)))
        .route("/api/state", get(state))
        .route("/api/setup", get(no_setup))
        .route("/api/sessions", get(list_sessions))
        .route("/api/sessions/{session}/{file}", get(download))
        .route(
            "/api/reports/{session}",
            get(reports::show).post(reports::make),
        )
        .with_state(site)
        .merge(page)
        .fallback(entrance::nothing)
        .layer(checked)
}

/// The node runs: no setup remains.
async fn no_setup(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    role_of(&site, &headers).map_or_else(
        |response| *response,
        |_| as_json(&json!({ "stage": "running" })),
    )
}

/// The role of a request.
fn role_of(site: &Site, headers: &HeaderMap) -> Result<Role, Box<Response>> {
    site.entrance.role_of(headers)
}

/// Query of a socket.
#[derive(Debug, Deserialize)]
struct SocketQuery {
    /// replayed session; `None`: the session of the node
    replay: Option<String>,
}

async fn upgrade(
    State(site): State<Arc<Site>>,
    Extension(replays): Extension<Arc<Replays>>,
    Query(SocketQuery { replay }): Query<SocketQuery>,
    headers: HeaderMap,
    socket: WebSocketUpgrade,
) -> Response {
    let role = match role_of(&site, &headers) {
        Ok(role) => role,
        Err(response) => return *response,
    };
    let Some(place) = PagePlace::take(&site) else {
        return refusal(
            StatusCode::SERVICE_UNAVAILABLE,
            "so many pages are open already: close one",
        );
    };
    let socket = socket
        .protocols([PROTOCOL])
        .max_message_size(LARGEST_MESSAGE)
        .max_frame_size(LARGEST_MESSAGE);
    socket
        .max_write_buffer_size(LARGEST_BACKLOG)
        .on_upgrade(move |socket| async move {
            match replay {
                None => connection::serve(socket, site, role).await,
                Some(session) => replay::serve(socket, &replays, &session).await,
            }
            drop(place);
        })
}

async fn state(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    role_of(&site, &headers).map_or_else(|response| *response, |role| as_json(&site.state(role)))
}

async fn list_sessions(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    if let Err(response) = role_of(&site, &headers) {
        return *response;
    }
    let (folder, current) = (site.session_folder.clone(), site.mesh.session());
    match tokio::task::spawn_blocking(move || sessions(&folder, &current)).await {
        Ok(Ok(listed)) => as_json(&Value::from(listed)),
        Ok(Err(error)) => refusal(
            StatusCode::SERVICE_UNAVAILABLE,
            &format!("the sessions could not be read: {error}"),
        ),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}

async fn download(
    State(site): State<Arc<Site>>,
    headers: HeaderMap,
    Path((session, file)): Path<(String, String)>,
) -> Response {
    if let Err(response) = role_of(&site, &headers) {
        return *response;
    }
    let folder = site.session_folder.clone();
    let name = file.clone();
    let opened = tokio::task::spawn_blocking(move || {
        touchup_io::session_folder::open_file(&folder, &session, &name)
    })
    .await;
    match opened {
        Ok(Ok((opened, length))) => {
            let disposition = format!("attachment; filename=\"{file}\"");
            let head = [
                (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
                (header::CONTENT_LENGTH, length.to_string()),
                (header::CONTENT_DISPOSITION, disposition),
                (header::CACHE_CONTROL, "no-store".to_owned()),
            ];
            (head, Body::from_stream(body_of(opened))).into_response()
        }
        Ok(Err(error)) => refusal(StatusCode::NOT_FOUND, &error.to_string()),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}
