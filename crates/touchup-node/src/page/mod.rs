//! The operator page: a port beside the network's. The node's publications go to both, and calls of
//! pages come into the same inbox.
//!
//! One thread serves all pages, which follow the feed of the mesh. The node only stores other news
//! under a lock, for the time of a message copy: a slow page skips states and delays nobody.

mod admission;
mod annotations;
mod background;
mod board;
mod built_page;
mod calls;
mod connection;
mod downloads;
mod error;
mod http;
mod page_place;
mod page_port;
mod replay;
mod replay_state;
mod reporting;
mod reports;
mod setup;
mod site;
mod vertex_numbers;

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};

use axum::middleware::from_fn_with_state;
use tokio::net::TcpListener;
use tokio::runtime::Handle;
use tokio::sync::Notify;

use self::admission::access::Access;
pub use self::admission::access::Role;
use self::admission::entrance::Entrance;
pub use self::admission::entrance::Invitation;
pub use self::admission::listener::Certificate;
use self::admission::listener::Routes;
use self::annotations::Annotations;
use self::board::Board;
use self::calls::Calls;
pub use self::error::WebError;
use self::page_port::PagePort;
use self::replay::Replays;
use self::reporting::nominal::Nominal;
use self::reporting::report_work::Reports;
pub use self::setup::{NodeSetup, SetupParams, SetupStep};
use self::site::{ScanShown, Site};
use crate::ros::inbox::Inbox;
use crate::ros::mesh_feed::MeshFeed;
use crate::ros::port::Port;
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::MeshUnit;

/// Address and access of the page.
#[derive(Clone, Debug)]
pub struct WebParams {
    /// port 0: any free port
    pub address: SocketAddr,
    /// further host names of the page
    pub names: Vec<String>,
    /// pages need a link; otherwise everybody who reaches the address operates
    pub by_link: bool,
    /// TLS certificate; `None`: no TLS
    pub certificate: Option<Certificate>,
}

/// Constant facts about the node.
#[derive(Debug)]
pub struct NodeFacts {
    /// file of the scan
    pub scan: PathBuf,
    /// its number of faces
    pub scan_faces: usize,
    /// whether an operator has just confirmed its size on the page
    pub is_size_confirmed: bool,
    /// parent of the session folders
    pub session_folder: PathBuf,
    /// the nominal part, m in O; `None`: not given
    pub nominal: Option<TriMesh>,
    /// file of the nominal part, in the unit of the scan
    pub nominal_file: Option<PathBuf>,
    /// unit of the coordinates in mesh files
    pub mesh_unit: MeshUnit,
}

/// Serves until dropped.
pub struct WebServer {
    invitations: Vec<Invitation>,
    entrance: Arc<Entrance>,
    routes: Routes,
    runtime: Handle,
    stop: Arc<Notify>,
    thread: Option<JoinHandle<()>>,
}

impl WebServer {
    /// Serves only the files of the page at first.
    ///
    /// - `notify`: announces the next link to the operator at the machine, after the use of one.
    ///
    /// # Errors
    /// [`WebError`]
    pub fn open(params: &WebParams, notify: fn(&Invitation)) -> Result<Self, WebError> {
        let tls = params
            .certificate
            .as_ref()
            .map(Certificate::acceptor)
            .transpose()?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()?;
        let listener = runtime.block_on(TcpListener::bind(params.address));
        let listener = listener.map_err(|source| WebError::Address {
            address: params.address,
            source,
        })?;
        let address = listener.local_addr()?;
        let access = Access::new(address, &params.names, params.by_link, tls.is_some());
        let entrance = Arc::new(Entrance {
            access,
            notify,
            pages_so_far: AtomicU64::new(0),
        });
        let roles = [Role::Operate, Role::Look];
        let invitations = match entrance.access.needs_cookie() {
            true => roles
                .map(|role| entrance.invitation(role))
                .into_iter()
                .collect::<io::Result<_>>()?,
            false => Vec::new(),
        };
        let checked = from_fn_with_state(Arc::clone(&entrance), admission::entrance::check);
        let routes = Routes::new(
            admission::entrance::routes(&entrance)
                .fallback(admission::entrance::nothing)
                .layer(checked),
        );
        let (stop, handle) = (Arc::new(Notify::new()), runtime.handle().clone());
        let (stopped, served) = (Arc::clone(&stop), routes.clone());
        let serve = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = admission::listener::serve(listener, tls, served) => {}
                    () = stopped.notified() => {}
                }
            });
            runtime.shutdown_background();
        };
        let thread = Some(Builder::new().name("touchup-web".to_owned()).spawn(serve)?);
        Ok(Self {
            invitations,
            entrance,
            routes,
            runtime: handle,
            stop,
            thread,
        })
    }

    /// Serves the setup of a node, until one runs.
    ///
    /// # Errors
    /// [`WebError::Setup`]
    pub fn set_up(&self, params: SetupParams) -> Result<Arc<NodeSetup>, WebError> {
        let setup = Arc::new(NodeSetup::new(params)?);
        self.routes.set(setup::router(&self.entrance, &setup));
        Ok(setup)
    }

    /// Serves a node: returns its port, which sends to `network` and to the page.
    ///
    /// - `mesh`: of the node.
    ///
    /// # Errors
    /// [`WebError`]
    pub fn serve_node(
        &self,
        facts: NodeFacts,
        inbox: Inbox,
        mesh: Arc<MeshFeed>,
        network: Arc<dyn Port>,
    ) -> Result<Arc<dyn Port>, WebError> {
        let file = facts
            .scan
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        let site = Arc::new(Site {
            board: Board::default(),
            mesh,
            calls: Calls::new(&inbox)?,
            inbox,
            entrance: Arc::clone(&self.entrance),
            annotations: Annotations::new(&facts.session_folder),
            nominal: facts.nominal.map(|mesh| Arc::new(Nominal::new(mesh))),
            reports: Reports::new(facts.nominal_file, facts.mesh_unit),
            scan: ScanShown {
                file,
                faces: facts.scan_faces,
                is_size_confirmed: facts.is_size_confirmed,
            },
            session_folder: facts.session_folder,
            pages: AtomicUsize::new(0),
            replay: None,
        });
        let replays = Replays::new(&self.entrance, &site.session_folder, &self.runtime);
        self.routes.set(http::router(Arc::clone(&site), replays));
        Ok(Arc::new(PagePort { network, site }))
    }

    /// Addresses of the page.
    pub fn urls(&self) -> Vec<String> {
        self.entrance.access.urls()
    }

    /// Whether a page was ever opened on a node.
    pub fn was_opened(&self) -> bool {
        self.entrance.pages_so_far.load(Ordering::Relaxed) > 0
    }

    /// Links to the page with their roles; none if pages need no link.
    pub fn invitations(&self) -> &[Invitation] {
        &self.invitations
    }
}

impl Drop for WebServer {
    fn drop(&mut self) {
        self.stop.notify_one();
        if let Some(thread) = self.thread.take() {
            // a thread that panicked has reported it
            let _ = thread.join();
        }
    }
}
