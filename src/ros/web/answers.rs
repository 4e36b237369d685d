//! What several addresses answer alike.

use axum::http::StatusCode;
use axum::http::header::{self, HeaderMap};
use axum::response::{IntoResponse, Response};
use serde_json::json;

use super::access::Role;
use super::site::Site;

/// `{"error": …}`.
pub(super) fn refusal(status: StatusCode, why: &str) -> Response {
    (status, [(header::CONTENT_TYPE, "application/json")], json!({ "error": why }).to_string()).into_response()
}

pub(super) fn as_json(value: &impl serde::Serialize) -> Response {
    let text = serde_json::to_string(value).unwrap_or_default();
    ([(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")], text).into_response()
}

/// The role of who asks.
pub(super) fn role_of(site: &Site, headers: &HeaderMap) -> Result<Role, Box<Response>> {
    let cookies = headers.get(header::COOKIE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let why = "this page was not let in: open it by a new link, which touchup prints, or another page makes";
    site.access.role(cookies).ok_or_else(|| Box::new(refusal(StatusCode::UNAUTHORIZED, why)))
}
