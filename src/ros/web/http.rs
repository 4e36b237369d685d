//! What the page's address answers: the page itself, the socket, and files of sessions. Each request is checked before anything is
//! looked at.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use axum::Router;
use axum::body::Body;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Query, Request, State};
use axum::http::header::{self, HeaderMap, HeaderName};
use axum::http::{HeaderValue, Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use serde_json::Value;

use super::answers::{as_json, refusal, role_of};
use super::connection;
use super::downloads::{body_of, sessions};
use super::page::PAGE;
use super::reports;
use super::site::Site;

/// Pages at a time at most.
const MOST_PAGES: usize = 16;
/// Bytes that a page may send in one message.
const LARGEST_MESSAGE: usize = 64 << 10;
/// Bytes that wait for a page in the socket at most.
const LARGEST_BACKLOG: usize = 8 << 20;
/// The protocol of the socket.
const PROTOCOL: &str = "touchup.v1";

/// The page loads nothing from elsewhere, and nobody shows it within another one.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// For how long a browser keeps a file of the page: whose name has a checksum in it, and others.
const KEPT: &str = "public, max-age=31536000, immutable";
const SEEN_AGAIN: &str = "no-cache";

/// All that is answered.
pub(super) fn router(site: Arc<Site>) -> Router {
    let checked = from_fn_with_state(Arc::clone(&site), check);
    Router::new()
        .route("/", get(|headers: HeaderMap| async move { asset("index.html", SEEN_AGAIN, &headers) }))
        .route(
            "/assets/{name}",
            get(|Path(name): Path<String>, headers: HeaderMap| async move { asset(&name, KEPT, &headers) }),
        )
        // names of these have no checksum in them
        .route(
            "/{name}",
            get(|Path(name): Path<String>, headers: HeaderMap| async move { asset(&name, SEEN_AGAIN, &headers) }),
        )
        .route("/pair", get(pair))
        .route("/ws", get(upgrade))
        .route("/api/state", get(state))
        .route("/api/sessions", get(list_sessions))
        .route("/api/sessions/{session}/{file}", get(download))
        .route("/api/reports/{session}", get(reports::show).post(reports::make))
        .fallback(|| async { refusal(StatusCode::NOT_FOUND, "there is nothing at this address") })
        .layer(checked)
        .with_state(site)
}

/// Host and origin of every request; what goes out with every answer.
async fn check(State(site): State<Arc<Site>>, request: Request, next: Next) -> Response {
    let mut response = match refused(&site, request.method(), request.headers()) {
        Some(why) => refusal(StatusCode::FORBIDDEN, why),
        None => next.run(request).await,
    };
    let constant: [(HeaderName, &str); 4] = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "DENY"),
    ];
    for (name, value) in constant {
        // a report has a stricter policy of its own
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

fn refused(site: &Site, method: &Method, headers: &HeaderMap) -> Option<&'static str> {
    let text = |name: HeaderName| headers.get(name).map(|value| value.to_str().unwrap_or_default());
    if !text(header::HOST).is_some_and(|host| site.access.is_host(host)) {
        return Some(
            "this page is called by another name: use the address that touchup printed, or allow the name by --web-name",
        );
    }
    // who changes something, or opens the socket, says where it was loaded from
    let needs_origin = method != Method::GET && method != Method::HEAD || headers.contains_key(header::UPGRADE);
    match text(header::ORIGIN) {
        None if needs_origin => Some("a request without Origin is refused here"),
        Some(origin) if !site.access.is_origin(origin) => Some("the request comes from another page"),
        _ => None,
    }
}

fn asset(name: &str, cache: &'static str, headers: &HeaderMap) -> Response {
    let Some(file) = PAGE.iter().find(|file| file.name == name) else {
        return refusal(StatusCode::NOT_FOUND, "the page has no such file");
    };
    let head =
        [(header::CONTENT_TYPE, file.content_type), (header::CACHE_CONTROL, cache), (header::VARY, "accept-encoding")];
    let accepts_gzip = headers
        .get(header::ACCEPT_ENCODING)
        .and_then(|value| value.to_str().ok())
        .is_some_and(|all| all.contains("gzip"));
    match file.gzip {
        Some(gzip) if accepts_gzip => (head, [(header::CONTENT_ENCODING, "gzip")], gzip).into_response(),
        _ => (head, file.bytes).into_response(),
    }
}

#[derive(Deserialize)]
struct PairQuery {
    #[serde(default)]
    token: String,
}

/// A link that somebody follows.
async fn pair(State(site): State<Arc<Site>>, Query(PairQuery { token }): Query<PairQuery>) -> Response {
    match site.access.pair(&token) {
        Ok(Some((cookie, role))) => {
            site.note_paired(role);
            (StatusCode::SEE_OTHER, [(header::SET_COOKIE, cookie), (header::LOCATION, "/".to_owned())]).into_response()
        }
        Ok(None) => refusal(StatusCode::FORBIDDEN, "this link is not valid, or was used: ask for a new one"),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}

async fn upgrade(State(site): State<Arc<Site>>, headers: HeaderMap, socket: WebSocketUpgrade) -> Response {
    let role = match role_of(&site, &headers) {
        Ok(role) => role,
        Err(response) => return *response,
    };
    let Some(place) = PagePlace::take(&site) else {
        return refusal(StatusCode::SERVICE_UNAVAILABLE, "so many pages are open already: close one");
    };
    let socket = socket.protocols([PROTOCOL]).max_message_size(LARGEST_MESSAGE).max_frame_size(LARGEST_MESSAGE);
    socket.max_write_buffer_size(LARGEST_BACKLOG).on_upgrade(move |socket| async move {
        connection::serve(socket, site, role).await;
        drop(place);
    })
}

/// One of the pages at a time.
struct PagePlace(Arc<Site>);

impl PagePlace {
    fn take(site: &Arc<Site>) -> Option<Self> {
        let is_there = |count: usize| (count < MOST_PAGES).then_some(count + 1);
        let taken = site.pages.fetch_update(Ordering::Relaxed, Ordering::Relaxed, is_there);
        taken.is_ok().then(|| Self(Arc::clone(site)))
    }
}

impl Drop for PagePlace {
    fn drop(&mut self) {
        let pages: &AtomicUsize = &self.0.pages;
        pages.fetch_sub(1, Ordering::Relaxed);
    }
}

async fn state(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    role_of(&site, &headers).map_or_else(|response| *response, |role| as_json(&site.state(role)))
}

async fn list_sessions(State(site): State<Arc<Site>>, headers: HeaderMap) -> Response {
    if let Err(response) = role_of(&site, &headers) {
        return *response;
    }
    let (folder, current) = (site.session_folder.clone(), site.board.session());
    match tokio::task::spawn_blocking(move || sessions(&folder, &current)).await {
        Ok(Ok(listed)) => as_json(&Value::from(listed)),
        Ok(Err(error)) => refusal(StatusCode::SERVICE_UNAVAILABLE, &format!("the sessions could not be read: {error}")),
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
    let opened =
        tokio::task::spawn_blocking(move || crate::io::session_folder::open_file(&folder, &session, &name)).await;
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
