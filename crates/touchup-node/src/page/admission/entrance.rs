//! Access to the page, for every router: request checks, links, and the files of the page.

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
use crate::page::built_page::PAGE;

/// The page loads nothing from elsewhere, and no other page may frame it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Cache lifetimes of page files: with a checksum in the name, and without.
const KEPT: &str = "public, max-age=31536000, immutable";
const SEEN_AGAIN: &str = "no-cache";

/// Access control, and links to the page.
#[derive(Debug)]
pub(in crate::page) struct Entrance {
    pub access: Access,
    /// notifies the operator at the machine
    pub notify: fn(&Invitation),
    /// number of pages ever opened on a node
    pub pages_so_far: AtomicU64,
}

/// A link for one page, in words and as a QR code.
#[derive(Clone, Debug)]
pub struct Invitation {
    /// the link at each address of the page, and its role
    pub text: String,
    /// lines of half blocks, dark on light; empty for viewers
    pub code: String,
}

impl Entrance {
    /// The role of a request.
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

    /// A link for another page, with a token if pages need one, and its QR code by rows: 1 is dark.
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

    /// Announces the next link after a page has used one.
    fn note_paired(&self, role: Role) {
        match self.invitation(role) {
            Ok(Invitation { text, code }) => {
                let text = format!("a page was let in to {}; {text}", in_words(role));
                (self.notify)(&Invitation { text, code });
            }
            Err(error) => tracing::warn!(%error, "there is no new link"),
        }
    }

    /// A new link, in words and as a QR code.
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
        // requests that change something or open the socket need an origin
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

/// Routes of every router: the page itself, and pairing by links.
pub(in crate::page) fn routes(entrance: &Arc<Entrance>) -> Router {
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
        // names without a checksum
        .route(
            "/{name}",
            get(|Path(name): Path<String>, headers: HeaderMap| async move {
                asset(&name, SEEN_AGAIN, &headers)
            }),
        )
        .route("/pair", get(pair))
        .with_state(Arc::clone(entrance))
}

/// Checks host and origin of every request, and adds security headers to every answer.
pub(in crate::page) async fn check(
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

/// Answer for an unknown path.
pub(in crate::page) async fn nothing() -> Response {
    refusal(StatusCode::NOT_FOUND, "there is nothing at this address")
}

/// `{"error": …}`.
pub(in crate::page) fn refusal(status: StatusCode, why: &str) -> Response {
    (
        status,
        [(header::CONTENT_TYPE, "application/json")],
        json!({ "error": why }).to_string(),
    )
        .into_response()
}

/// JSON answer that no cache keeps.
pub(in crate::page) fn as_json(value: &impl serde::Serialize) -> Response {
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

/// Pairs a page by a link.
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
