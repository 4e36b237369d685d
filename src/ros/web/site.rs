//! What all pages share: what they are shown, who may ask what, and what the page answers by itself.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::access::{Access, Role};
use super::annotations::{AnnotateRequest, Annotations};
use super::board::Board;
use super::calls::{Answer, Calls, MAY_ONLY_LOOK};
use super::nominal::Nominal;
use super::report_work::Reports;
use crate::mesh::{FaceTree, TriMesh};
use crate::ros::inbox::Inbox;
use crate::ros::stop::Motion;

/// What all pages share.
pub(super) struct Site {
    pub board: Board,
    pub calls: Calls,
    pub inbox: Inbox,
    pub access: Access,
    pub annotations: Annotations,
    pub nominal: Option<Arc<Nominal>>,
    pub reports: Reports,
    pub scan: ScanShown,
    /// with the tree over its faces
    pub scan_mesh: Arc<(TriMesh, FaceTree)>,
    pub session_folder: PathBuf,
    /// pages that are open
    pub pages: AtomicUsize,
    /// … and that were ever opened
    pub pages_so_far: AtomicU64,
    /// address of the page: for links
    pub base: String,
    /// tells the operator beside the machine
    pub notify: fn(&str),
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct ScanShown {
    pub file: String,
    pub faces: usize,
}

#[derive(Debug, Serialize)]
struct ArmShown {
    may_move: bool,
    motion: Motion,
    stays_because: Option<&'static str>,
}

/// The topic `state`.
#[derive(Debug, Serialize)]
pub(super) struct SiteState<'a> {
    role: Role,
    program: &'static str,
    session: String,
    is_paused: bool,
    scan: &'a ScanShown,
    /// file of the nominal part
    nominal_part: Option<String>,
    arm: Option<ArmShown>,
    clients: usize,
}

impl Site {
    /// The topic `state` as it is for a page now.
    pub fn state(&self, role: Role) -> SiteState<'_> {
        let stops = self.inbox.stops();
        let arm = stops.arm().map(|(may_move, motion, stays_because)| ArmShown { may_move, motion, stays_because });
        SiteState {
            role,
            program: concat!("touchup ", env!("CARGO_PKG_VERSION")),
            session: self.board.session(),
            is_paused: stops.is_paused(),
            scan: &self.scan,
            nominal_part: self.reports.part_name(),
            arm,
            clients: self.pages.load(Ordering::Relaxed),
        }
    }

    /// A call of a page: of the page's own, or of a service of the node.
    pub fn call(&self, role: Role, name: &str, request: Value, reply: Answer) {
        let own: Option<OwnCall> = match name {
            "~/annotate_feature" => Some(Self::annotate),
            "~/invite" => Some(Self::invite),
            _ => None,
        };
        match own {
            None => self.calls.call(role, name, request, reply),
            Some(_) if role != Role::Operate => reply.send(Err(MAY_ONLY_LOOK.to_owned())),
            Some(own) => reply.send(own(self, request)),
        }
    }

    fn annotate(&self, request: Value) -> Result<Value, String> {
        let request: AnnotateRequest = serde_json::from_value(request).map_err(|error| error.to_string())?;
        let feature = self.board.feature(request.id);
        self.annotations.annotate(&self.board.session(), request, feature)?;
        self.board.wake();
        Ok(json!({ "success": true, "message": "noted" }))
    }

    /// A link for another page, and its QR code: `{"role": "look"}`.
    fn invite(&self, request: Value) -> Result<Value, String> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct InviteRequest {
            role: Role,
        }
        let InviteRequest { role } = serde_json::from_value(request).map_err(|error| error.to_string())?;
        let link = match self.access.needs_cookie() {
            true => self.link(self.access.invite(role).map_err(|error| error.to_string())?.text()),
            false => self.base.clone(),
        };
        Ok(json!({ "link": link, "code": code_rows(&link) }))
    }

    fn link(&self, token: &str) -> String {
        format!("{}/pair?token={token}", self.base)
    }

    /// Somebody came in by a link, which is used up: here is the next.
    pub fn note_paired(&self, role: Role) {
        match self.invitation(role) {
            Ok(text) => (self.notify)(&format!("a page was let in to {}; {text}", in_words(role))),
            Err(error) => tracing::warn!(%error, "there is no new link"),
        }
    }

    /// A new link in words, and as a QR code.
    pub fn invitation(&self, role: Role) -> io::Result<String> {
        let link = self.link(self.access.invite(role)?.text());
        let code = QrCode::new(&link).map(|code| code.render::<Dense1x2>().build()).unwrap_or_default();
        let code = if role == Role::Operate { format!("\n{code}") } else { String::new() };
        Ok(format!("the next one may {} by {link}{code}", in_words(role)))
    }
}

/// What the page itself is asked, and not the node.
type OwnCall = fn(&Site, Value) -> Result<Value, String>;

/// A QR code, row by row: 1 where it is dark.
fn code_rows(text: &str) -> Vec<String> {
    let Ok(code) = QrCode::new(text) else { return Vec::new() };
    let modules: Vec<char> = code.to_colors().into_iter().map(|colour| colour.select('1', '0')).collect();
    modules.chunks(code.width()).map(String::from_iter).collect()
}

fn in_words(role: Role) -> &'static str {
    match role {
        Role::Look => "look",
        Role::Operate => "operate",
    }
}
