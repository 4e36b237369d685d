//! Routes of the page during the setup of a node.

use std::sync::Arc;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::http::header::{self, HeaderMap};
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::{get, post};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use tokio::task::spawn_blocking;

use super::calibrating::CalibrateRequest;
use super::node_setup::NodeSetup;
use super::scene_draft::StatedTip;
use super::setup_state::NodeSetupError;
use super::upload;
use crate::page::admission::access::Role;
use crate::page::admission::entrance::{self, Entrance, as_json, refusal};
use crate::page::calls::MAY_ONLY_LOOK;
use touchup_io::mesh_file::MeshUnit;
use touchup_session::calibration::CalibrationKind;

/// Maximum size of a request without a file, bytes.
const LARGEST_REQUEST: usize = 16 << 10;

/// State of the routes.
#[derive(Clone)]
struct RouteState {
    entrance: Arc<Entrance>,
    setup: Arc<NodeSetup>,
}

/// All routes.
pub(in crate::page) fn router(entrance: &Arc<Entrance>, setup: &Arc<NodeSetup>) -> Router {
    let checked = from_fn_with_state(Arc::clone(entrance), entrance::check);
    Router::new()
        .route("/api/setup", get(shown))
        .route("/api/setup/upload", post(take_upload))
        .route("/api/setup/scan", post(choose_scan))
        .route("/api/setup/unit", post(choose_unit))
        .route("/api/setup/tip", post(state_tip))
        .route("/api/setup/file", post(take_file))
        .route("/api/setup/calibrate", post(calibrate))
        .route("/api/setup/use", post(use_calibration))
        .route("/api/setup/check", post(check))
        .route("/api/setup/start", post(start))
        .with_state(RouteState {
            entrance: Arc::clone(entrance),
            setup: Arc::clone(setup),
        })
        .merge(entrance::routes(entrance))
        .fallback(entrance::nothing)
        .layer(checked)
}

type RouteResult = Result<Response, Box<Response>>;

impl RouteState {
    /// Refuses viewers.
    fn operator(&self, headers: &HeaderMap) -> Result<(), Box<Response>> {
        match self.entrance.role_of(headers)? {
            Role::Operate => Ok(()),
            Role::Look => Err(Box::new(refusal(StatusCode::FORBIDDEN, MAY_ONLY_LOOK))),
        }
    }

    /// The present setup.
    async fn answer(&self, role: Role) -> RouteResult {
        let setup = Arc::clone(&self.setup);
        let shown = spawn_blocking(move || setup.shown(role))
            .await
            .map_err(|error| error.to_string())
            .flatten();
        shown
            .map(|shown| as_json(&shown))
            .map_err(|why| Box::new(refusal(StatusCode::SERVICE_UNAVAILABLE, &why)))
    }

    /// Receives a file from an operator: returns its name in the folder.
    async fn take(
        &self,
        name: String,
        is_scan: bool,
        headers: &HeaderMap,
        body: Body,
    ) -> Result<String, Box<Response>> {
        self.operator(headers)?;
        let length = headers
            .get(header::CONTENT_LENGTH)
            .and_then(|value| value.to_str().ok()?.parse().ok());
        let taken = upload::take(&self.setup, name, is_scan, length, body).await;
        taken.map_err(|(status, why)| Box::new(refusal(status, &why)))
    }

    /// Applies an operator's request, and answers with the new setup.
    async fn change<T: DeserializeOwned + Send + 'static>(
        &self,
        headers: &HeaderMap,
        body: Body,
        change: impl FnOnce(&Arc<NodeSetup>, T) -> Result<(), NodeSetupError> + Send + 'static,
    ) -> RouteResult {
        self.operator(headers)?;
        let bad = |status, why: String| Box::new(refusal(status, &why));
        let text = to_bytes(body, LARGEST_REQUEST).await;
        let text = text.map_err(|error| bad(StatusCode::PAYLOAD_TOO_LARGE, error.to_string()))?;
        let asked = serde_json::from_slice(&text)
            .map_err(|error| bad(StatusCode::BAD_REQUEST, error.to_string()))?;
        let setup = Arc::clone(&self.setup);
        // may read or write a file
        let done = spawn_blocking(move || change(&setup, asked)).await;
        let done = done.map_err(|error| bad(StatusCode::SERVICE_UNAVAILABLE, error.to_string()))?;
        done.map_err(|error| match &error {
            NodeSetupError::NotNow(_) => bad(StatusCode::CONFLICT, error.to_string()),
            NodeSetupError::Refused(_) => bad(StatusCode::UNPROCESSABLE_ENTITY, error.to_string()),
        })?;
        self.answer(Role::Operate).await
    }
}

fn sent(answered: RouteResult) -> Response {
    answered.unwrap_or_else(|refused| *refused)
}

async fn shown(State(served): State<RouteState>, headers: HeaderMap) -> Response {
    match served.entrance.role_of(&headers) {
        Ok(role) => sent(served.answer(role).await),
        Err(refused) => *refused,
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScanRequest {
    file: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UnitRequest {
    unit: MeshUnit,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StartRequest {}

async fn choose_scan(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change = |setup: &Arc<NodeSetup>, ScanRequest { file }| setup.choose_scan(&file);
    sent(served.change(&headers, body, change).await)
}

async fn choose_unit(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change = |setup: &Arc<NodeSetup>, UnitRequest { unit }| setup.choose_unit(unit);
    sent(served.change(&headers, body, change).await)
}

async fn state_tip(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change = |setup: &Arc<NodeSetup>, tip: StatedTip| setup.state_tip(tip);
    sent(served.change(&headers, body, change).await)
}

async fn calibrate(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change = |setup: &Arc<NodeSetup>, request: CalibrateRequest| setup.calibrate(&request);
    sent(served.change(&headers, body, change).await)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UseRequest {
    what: CalibrationKind,
}

async fn use_calibration(
    State(served): State<RouteState>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let change = |setup: &Arc<NodeSetup>, UseRequest { what }| setup.use_calibration(what);
    sent(served.change(&headers, body, change).await)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CheckRequest {
    /// a recording of the folder; `None`: go on
    recording: Option<String>,
}

async fn check(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change =
        |setup: &Arc<NodeSetup>, CheckRequest { recording }| setup.check(recording.as_deref());
    sent(served.change(&headers, body, change).await)
}

async fn start(State(served): State<RouteState>, headers: HeaderMap, body: Body) -> Response {
    let change = |setup: &Arc<NodeSetup>, StartRequest {}| setup.start();
    sent(served.change(&headers, body, change).await)
}

#[derive(Deserialize)]
struct UploadQuery {
    #[serde(default)]
    name: String,
}

/// Receives and chooses a scan: the body is the file.
async fn take_upload(
    State(served): State<RouteState>,
    Query(UploadQuery { name }): Query<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    let file = match served.take(name, true, &headers, body).await {
        Ok(file) => file,
        Err(refused) => return *refused,
    };
    let setup = Arc::clone(&served.setup);
    match spawn_blocking(move || setup.choose_scan(&file)).await {
        Ok(Ok(())) => sent(served.answer(Role::Operate).await),
        Ok(Err(error)) => refusal(StatusCode::CONFLICT, &error.to_string()),
        Err(error) => refusal(StatusCode::SERVICE_UNAVAILABLE, &error.to_string()),
    }
}

/// Receives a recording or a table: the body is the file. Answers with its name, and chooses
/// nothing.
async fn take_file(
    State(served): State<RouteState>,
    Query(UploadQuery { name }): Query<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Response {
    match served.take(name, false, &headers, body).await {
        Ok(file) => as_json(&json!({ "file": file })),
        Err(refused) => *refused,
    }
}
