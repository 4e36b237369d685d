//! State that all pages share: content, access, and the page's own calls.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::admission::access::Role;
use super::admission::entrance::Entrance;
use super::annotations::{AnnotateRequest, Annotations};
use super::board::Board;
use super::calls::{CallReply, Calls, MAY_ONLY_LOOK};
use super::replay_state::ReplayControl;
use super::reporting::nominal::Nominal;
use super::reporting::report_work::Reports;
use crate::ros::inbox::Inbox;
use crate::ros::mesh_feed::MeshFeed;
use crate::ros::stop::ArmMotion;

/// Reason of a refused call during a replay.
const REPLAYED: &str =
    "this page replays a session, in which nothing can be changed: open the page of the node";

/// State that all pages share.
pub(super) struct Site {
    pub board: Board,
    /// the mesh of the node
    pub mesh: Arc<MeshFeed>,
    pub calls: Calls,
    pub inbox: Inbox,
    pub entrance: Arc<Entrance>,
    pub annotations: Annotations,
    pub nominal: Option<Arc<Nominal>>,
    pub reports: Reports,
    pub scan: ScanShown,
    pub session_folder: PathBuf,
    /// number of open pages
    pub pages: AtomicUsize,
    /// control of a replay, which is then the only service of the page
    pub replay: Option<Arc<ReplayControl>>,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct ScanShown {
    pub file: String,
    pub faces: usize,
    /// whether the page need not ask for the size: an operator has just confirmed it, or the
    /// session has touches at this size
    pub is_size_confirmed: bool,
}

#[derive(Debug, Serialize)]
struct ArmShown {
    may_move: bool,
    motion: ArmMotion,
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
    /// The present topic `state` for a page.
    pub fn state(&self, role: Role) -> SiteState<'_> {
        let stops = self.inbox.stops();
        let arm = stops
            .arm()
            .map(|(may_move, motion, stays_because)| ArmShown {
                may_move,
                motion,
                stays_because,
            });
        SiteState {
            role,
            program: concat!("touchup ", env!("CARGO_PKG_VERSION")),
            session: self
                .replay
                .as_ref()
                .map_or_else(|| self.mesh.session(), |replay| replay.session().to_owned()),
            is_paused: stops.is_paused(),
            scan: &self.scan,
            nominal_part: self.reports.part_name(),
            arm,
            clients: self.pages.load(Ordering::Relaxed),
        }
    }

    /// Calls a service of the page itself, or of the node.
    pub fn call(&self, role: Role, name: &str, request: Value, reply: CallReply) {
        if let Some(replay) = &self.replay {
            return reply.send(match name {
                "~/replay" => replay.call(request),
                _ => Err(REPLAYED.to_owned()),
            });
        }
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
        let request: AnnotateRequest =
            serde_json::from_value(request).map_err(|error| error.to_string())?;
        let feature = self.board.feature(request.id);
        self.annotations
            .annotate(&self.mesh.session(), request, feature)?;
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
        let InviteRequest { role } =
            serde_json::from_value(request).map_err(|error| error.to_string())?;
        let (link, code) = self
            .entrance
            .invite(role)
            .map_err(|error| error.to_string())?;
        Ok(json!({ "link": link, "code": code }))
    }
}

/// A call that the page answers, not the node.
type OwnCall = fn(&Site, Value) -> Result<Value, String>;
