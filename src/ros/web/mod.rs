//! The operator's page: a port beside that of the network. What the node publishes goes to both, and what a page asks comes into the
//! same inbox.
//!
//! One thread of its own, with all pages on it. The node only notes what is new, under a lock that is held for as long as a message is
//! copied: a page that is slow has less to show, and nobody waits for it.

mod access;
mod annotations;
mod board;
mod calls;
mod connection;
mod downloads;
mod http;
mod knowledge;
mod listener;
mod mesh_copy;
mod nominal;
mod page;
mod vertex_numbers;

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};

use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::sync::Notify;

pub use self::access::Role;
use self::access::{Access, in_a_link};
use self::annotations::{AnnotateRequest, Annotations};
use self::board::Board;
use self::calls::{Answer, Calls, MAY_ONLY_LOOK};
pub use self::listener::Certificate;
use self::nominal::Nominal;
use super::exchange::RosError;
use super::inbox::Inbox;
use super::messages::MeshPatch;
use super::port::{Port, Publication};
use super::stop::Motion;
use crate::mesh::{FaceTree, TriMesh};

/// Why the page is not served.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// the address cannot be listened to
    #[error("the page cannot be served at {address}: {source}; choose another address or port by --web")]
    Address {
        /// which
        address: SocketAddr,
        /// what the system says
        source: io::Error,
    },
    /// a file of the certificate is none
    #[error("{}: {why}; --web-certificate and --web-key take PEM files", .file.display())]
    Certificate {
        /// which
        file: PathBuf,
        /// what is wrong with it
        why: String,
    },
    /// a service has a name that is none
    #[error(transparent)]
    Ros(#[from] RosError),
    /// no thread, no random numbers
    #[error("the page cannot be served: {0}")]
    System(#[from] io::Error),
}

/// Where the page is served, and how.
#[derive(Clone, Debug)]
pub struct WebParams {
    /// port 0: any that is free
    pub address: SocketAddr,
    /// names of this machine by which the page may be called, beside the address
    pub names: Vec<String>,
    /// lets in by link alone; otherwise everybody who reaches the address operates
    pub by_link: bool,
    /// TLS by it; `None`: no TLS
    pub certificate: Option<Certificate>,
}

/// What a page is told of the node, and does not change.
#[derive(Debug)]
pub struct NodeFacts {
    /// where the scan was read from
    pub scan: PathBuf,
    /// it, m in O, with the tree over its faces
    pub scan_mesh: Arc<(TriMesh, FaceTree)>,
    /// where sessions lie, each in a folder of its own
    pub session_folder: PathBuf,
    /// the part as it should be, m in O; `None`: nobody said
    pub nominal: Option<TriMesh>,
}

/// What all pages share.
struct Site {
    board: Board,
    calls: Calls,
    inbox: Inbox,
    access: Access,
    annotations: Annotations,
    nominal: Option<Arc<Nominal>>,
    scan: ScanShown,
    /// with the tree over its faces
    scan_mesh: Arc<(TriMesh, FaceTree)>,
    session_folder: PathBuf,
    /// pages that are open
    pages: AtomicUsize,
    /// … and that were ever opened
    pages_so_far: AtomicU64,
    /// address of the page: for links
    base: String,
    /// tells the operator beside the machine
    notify: fn(&str),
}

#[derive(Clone, Debug, Serialize)]
struct ScanShown {
    file: String,
    faces: usize,
}

#[derive(Debug, Serialize)]
struct ArmShown {
    may_move: bool,
    motion: Motion,
    stays_because: Option<&'static str>,
}

/// The topic `state`.
#[derive(Debug, Serialize)]
struct SiteState<'a> {
    role: Role,
    program: &'static str,
    session: String,
    is_paused: bool,
    scan: &'a ScanShown,
    arm: Option<ArmShown>,
    clients: usize,
}

impl Site {
    fn state(&self, role: Role) -> SiteState<'_> {
        let stops = self.inbox.stops();
        let arm = stops.arm().map(|(may_move, motion, stays_because)| ArmShown { may_move, motion, stays_because });
        SiteState {
            role,
            program: concat!("touchup ", env!("CARGO_PKG_VERSION")),
            session: self.board.session(),
            is_paused: stops.is_paused(),
            scan: &self.scan,
            arm,
            clients: self.pages.load(Ordering::Relaxed),
        }
    }

    /// A call of a page: of the page's own, or of a service of the node.
    fn call(&self, role: Role, name: &str, request: Value, reply: Answer) {
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

    /// A link for another page: `{"role": "look"}`.
    fn invite(&self, request: Value) -> Result<Value, String> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct InviteRequest {
            role: Role,
        }
        let InviteRequest { role } = serde_json::from_value(request).map_err(|error| error.to_string())?;
        if !self.access.needs_cookie() {
            return Ok(json!({ "link": self.base }));
        }
        let secret = self.access.invite(role).map_err(|error| error.to_string())?;
        Ok(json!({ "link": self.link(secret.text()) }))
    }

    fn link(&self, token: &str) -> String {
        format!("{}/pair?token={token}", self.base)
    }

    /// Somebody came in by a link, which is used up: here is the next.
    fn note_paired(&self, role: Role) {
        match self.invitation(role) {
            Ok(text) => (self.notify)(&format!("a page was let in to {}; {text}", in_words(role))),
            Err(error) => tracing::warn!(%error, "there is no new link"),
        }
    }

    /// A new link in words, and as a QR code.
    fn invitation(&self, role: Role) -> io::Result<String> {
        let link = self.link(self.access.invite(role)?.text());
        let code = QrCode::new(&link).map(|code| code.render::<Dense1x2>().build()).unwrap_or_default();
        let code = if role == Role::Operate { format!("\n{code}") } else { String::new() };
        Ok(format!("the next one may {} by {link}{code}", in_words(role)))
    }
}

/// What the page itself is asked, and not the node.
type OwnCall = fn(&Site, Value) -> Result<Value, String>;

fn in_words(role: Role) -> &'static str {
    match role {
        Role::Look => "look",
        Role::Operate => "operate",
    }
}

/// Serves until it is dropped.
pub struct WebServer {
    invitations: Vec<String>,
    site: Arc<Site>,
    stop: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl WebServer {
    /// Address of the page.
    pub fn url(&self) -> &str {
        &self.site.base
    }

    /// Whether a page was ever opened.
    pub fn was_opened(&self) -> bool {
        self.site.pages_so_far.load(Ordering::Relaxed) > 0
    }

    /// Links by which pages are let in, each with what it gives; none where everybody is.
    pub fn invitations(&self) -> &[String] {
        &self.invitations
    }
}

impl Drop for WebServer {
    fn drop(&mut self) {
        self.stop.notify_one();
        if let Some(thread) = self.thread.take() {
            // one that panicked has said so
            let _ = thread.join();
        }
    }
}

/// Serves the page: the port for the node, which sends to `network` and to the page.
///
/// - `whole`: the mesh as the node has it at its start.
/// - `notify`: tells the operator beside the machine of the next link, when one was used.
///
/// # Errors
/// [`WebError`]
pub fn start(
    params: &WebParams,
    facts: NodeFacts,
    inbox: Inbox,
    whole: impl Iterator<Item = MeshPatch>,
    network: Arc<dyn Port>,
    notify: fn(&str),
) -> Result<(Arc<dyn Port>, WebServer), WebError> {
    let tls = params.certificate.as_ref().map(Certificate::acceptor).transpose()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let listener = runtime.block_on(TcpListener::bind(params.address));
    let listener = listener.map_err(|source| WebError::Address { address: params.address, source })?;
    let address = listener.local_addr()?;
    let names: Vec<String> = params.names.iter().cloned().chain(own_address(address)).collect();
    let access = Access::new(address, &names, params.by_link, tls.is_some());
    let name = names.first().cloned().unwrap_or_else(|| in_a_link(address.ip()));
    let base = format!("{}://{name}:{}", access.scheme(), address.port());
    let file = facts.scan.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let site = Arc::new(Site {
        board: Board::new(whole),
        calls: Calls::new(&inbox)?,
        inbox,
        access,
        annotations: Annotations::new(&facts.session_folder),
        nominal: facts.nominal.map(|mesh| Arc::new(Nominal::new(mesh))),
        scan: ScanShown { file, faces: facts.scan_mesh.0.face_count() },
        scan_mesh: facts.scan_mesh,
        session_folder: facts.session_folder,
        pages: AtomicUsize::new(0),
        pages_so_far: AtomicU64::new(0),
        base,
        notify,
    });
    let invitations = match site.access.needs_cookie() {
        true => [Role::Operate, Role::Look].map(|role| site.invitation(role)).into_iter().collect::<io::Result<_>>()?,
        false => Vec::new(),
    };
    let (stop, router) = (Arc::new(Notify::new()), http::router(Arc::clone(&site)));
    let (stopped, followed) = (Arc::clone(&stop), Arc::clone(&site));
    let serve = move || {
        runtime.block_on(async {
            tokio::select! {
                () = listener::serve(listener, tls, router) => {}
                () = knowledge::follow(followed) => {}
                () = stopped.notified() => {}
            }
        });
        runtime.shutdown_background();
    };
    let thread = Some(Builder::new().name("touchup-web".to_owned()).spawn(serve)?);
    let port = Arc::new(PagePort { network, site: Arc::clone(&site) });
    Ok((port, WebServer { invitations, site, stop, thread }))
}

/// The address by which others reach a machine that listens to all of its own, as far as it is known: nothing is sent.
fn own_address(address: SocketAddr) -> Option<String> {
    if !address.ip().is_unspecified() {
        return None;
    }
    // of a block for documentation (RFC 5737), so that the way out is that to other networks
    let socket = UdpSocket::bind("0.0.0.0:0").and_then(|socket| socket.connect("192.0.2.1:9").map(|()| socket));
    socket.and_then(|socket| socket.local_addr()).ok().map(|own| in_a_link(own.ip()))
}

/// Sends to the network and to the pages.
struct PagePort {
    network: Arc<dyn Port>,
    site: Arc<Site>,
}

impl Port for PagePort {
    fn publish(&self, publication: Publication) {
        // those are the mesh and the features again, drawn for RViz
        if !matches!(publication, Publication::Tile(_) | Publication::FeatureMarkers(_)) {
            self.site.board.write(publication.clone());
        }
        self.network.publish(publication);
    }

    fn node_name(&self) -> &str {
        self.network.node_name()
    }

    fn sample_topics(&self) -> [&str; 2] {
        self.network.sample_topics()
    }

    fn now_ns(&self) -> i64 {
        self.network.now_ns()
    }

    fn dropped(&self) -> [u64; 2] {
        self.network.dropped()
    }

    fn lost(&self) -> [u64; 2] {
        self.network.lost()
    }

    fn unsent(&self) -> [u64; 2] {
        self.network.unsent()
    }

    fn tiles_waiting(&self) -> usize {
        self.network.tiles_waiting()
    }
}
