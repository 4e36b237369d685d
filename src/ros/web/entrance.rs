//! How everything on the page is reached, whatever is served behind it: the checks of each request,
//! links that let pages in, and the files of the page.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use axum::Router;
use axum::extract::{Path, Query, Request, State};
use axum::http::header::{self, HeaderMap, HeaderName};
use axum::http::{HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use serde::Deserialize;
use serde_json::json;

use super::access::{Access, Role};
use super::page::PAGE;

/// The page loads nothing from elsewhere, and nobody shows it within another one.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// For how long a browser keeps a file of the page: whose name has a checksum in it, and others.
const KEPT: &str = "public, max-age=31536000, immutable";
const SEEN_AGAIN: &str = "no-cache";

/// Who comes in, and by which names and links.
#[derive(Debug)]
pub(super) struct Entrance {
    pub access: Access,
    /// tells the operator beside the machine
    pub notify: fn(&Invitation),
    /// pages that were ever opened on a node
    pub pages_so_far: AtomicU64,
}

/// A link for one page, in words and as a QR code.
#[derive(Clone, Debug)]
pub struct Invitation {
    /// the link at each address of the page, and what it gives
    pub text: String,
    /// lines of half blocks, dark on light; empty for who only looks
    pub code: String,
}

impl Entrance {
    /// The role of who asks.
    pub fn role_of(&self, headers: &HeaderMap) -> Result<Role, Box<Response>> {
        let cookies = headers
            .get(header::COOKIE)
            .and_then(|value| value.to_str().ok())
            .unwrap_or_default();
        let why = "this page was not let in: open it by a new link, which touchup prints, or another page makes";
        self.access
            .role(cookies)
            .ok_or_else(|| Box::new(refusal(StatusCode::UNAUTHORIZED, why)))
    }

    /// A link that lets another page in where one needs it, and its QR code, row by row: 1 where it
    /// is dark.
    pub fn invite(&self, role: Role) -> io::Result<(String, Vec<String>)> {
        let mut link = self.access.urls().swap_remove(0);
        if self.access.needs_cookie() {
            link += &format!("/pair?token={}", self.access.invite(role)?.text());
        }
        let code = QrCode::new(&link)
            .map(|code| rows(&code))
            .unwrap_or_default();
        Ok((link, code))
    }

    /// Somebody came in by a link, which is used up: here is the next.
    fn note_paired(&self, role: Role) {
        match self.invitation(role) {
            Ok(Invitation { text, code }) => {
                let text = format!("a page was let in to {}; {text}", in_words(role));
                (self.notify)(&Invitation { text, code });
            }
            Err(error) => tracing::warn!(%error, "there is no new link"),
        }
    }

    /// A new link in words, and as a QR code.
    pub fn invitation(&self, role: Role) -> io::Result<Invitation> {
        let secret = self.access.invite(role)?;
        let mut links = self.access.urls();
        links
            .iter_mut()
            .for_each(|link| *link += &format!("/pair?token={}", secret.text()));
        let code = match role {
            Role::Operate => QrCode::new(&links[0])
                .map(|code| code.render::<Dense1x2>().build())
                .unwrap_or_default(),
            Role::Look => String::new(),
        };
        let text = format!(
            "the next one may {} by {}",
            in_words(role),
            links.join(" or ")
        );
        Ok(Invitation { text, code })
    }

    fn refused(&self, method: &Method, headers: &HeaderMap) -> Option<&'static str> {
        let text = |name: HeaderName| {
            headers
                .get(name)
                .map(|value| value.to_str().unwrap_or_default())
        };
        if !text(header::HOST).is_some_and(|host| self.access.is_host(host)) {
            return Some(
                "this page is called by another name: use the address that touchup printed, or allow the name by --web-name",
            );
        }
        // who changes something, or opens the socket, says where it was loaded from
        let needs_origin = method != Method::GET && method != Method::HEAD
            || headers.contains_key(header::UPGRADE);
        match text(header::ORIGIN) {
            None if needs_origin => Some("a request without Origin is refused here"),
            Some(origin) if !self.access.is_origin(origin) => {
                Some("the request comes from another page")
            }
            _ => None,
        }
    }
}

fn rows(code: &QrCode) -> Vec<String> {
    let modules: Vec<char> = code
        .to_colors()
        .into_iter()
        .map(|colour| colour.select('1', '0'))
        .collect();
    modules
        .chunks(code.width())
        .map(String::from_iter)
        .collect()
}

fn in_words(role: Role) -> &'static str {
    match role {
        Role::Look => "look",
        Role::Operate => "operate",
    }
}

/// What is served before and beside everything else: the page itself, and the way in.
pub(super) fn routes(entrance: &Arc<Entrance>) -> Router {
    Router::new()
        .route(
            "/",
            get(|headers: HeaderMap| async move { asset("index.html", SEEN_AGAIN, &headers) }),
        )
        .route(
            "/assets/{name}",
            get(|Path(name): Path<String>, headers: HeaderMap| async move {
                asset(&name, KEPT, &headers)
            }),
        )
        // names of these have no checksum in them
        .route(
            "/{name}",
            get(|Path(name): Path<String>, headers: HeaderMap| async move {
                asset(&name, SEEN_AGAIN, &headers)
            }),
        )
        .route("/pair", get(pair))
        .with_state(Arc::clone(entrance))
}

/// Host and origin of every request; what goes out with every answer.
pub(super) async fn check(
    State(entrance): State<Arc<Entrance>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match entrance.refused(request.method(), request.headers()) {
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
        response
            .headers_mut()
            .entry(name)
            .or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Nothing else is at this address.
pub(super) async fn nothing() -> Response {
    refusal(StatusCode::NOT_FOUND, "there is nothing at this address")
}

/// `{"error": …}`.
pub(super) fn refusal(status: StatusCode, why: &str) -> Response {
    (
        status,
        [(header::CONTENT_TYPE, "application/json")],
        json!({ "error": why }).to_string(),
    )
        .into_response()
}

/// An answer that no cache keeps.
pub(super) fn as_json(value: &impl serde::Serialize) -> Response {
    let text = serde_json::to_string(value).unwrap_or_default();
    (
        [
            (header::CONTENT_TYPE, "application/json"),
            (header::CACHE_CONTROL, "no-store"),
        ],
        text,
    )
        .into_response()
}

fn asset(name: &str, cache: &'static str, headers: &HeaderMap) -> Response {
    let Some(file) = PAGE.iter().find(|file| file.name == name) else {
        return refusal(StatusCode::NOT_FOUND, "the page has no such file");
    };
    let head = [
        (header::CONTENT_TYPE, file.content_type),
        (header::CACHE_CONTROL, cache),
        (header::VARY, "accept-encoding"),
    ];
    let accepts_gzip = headers
        .get(header::ACCEPT_ENCODING)
        .and_then(|value| value.to_str().ok())
        .is_some_and(|all| all.contains("gzip"));
    match file.gzip {
        Some(gzip) if accepts_gzip => {
            (head, [(header::CONTENT_ENCODING, "gzip")], gzip).into_response()
        }
        _ => (head, file.bytes).into_response(),
    }
}

#[derive(Deserialize)]
struct PairQuery {
    #[serde(default)]
    token: String,
}

/// A link that somebody follows.
async fn pair(
    State(entrance): State<Arc<Entrance>>,
    Query(PairQuery { token }): Query<PairQuery>,
) -> Response {
    match entrance.access.pair(&token) {
        Ok(Some((cookie, role))) => {
            entrance.note_paired(role);
            (
                StatusCode::SEE_OTHER,
                [
                    (header::SET_COOKIE, cookie),
                    (header::LOCATION, "/".to_owned()),
                ],
            )
                .into_response()
        }
        Ok(None) => refusal(
            StatusCode::FORBIDDEN,
            "this link is not valid, or was used: ask for a new one",
        ),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}
