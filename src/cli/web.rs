//! `--web`: where the operator's page is served, of every verb that has one.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::CliError;
#[cfg(feature = "web")]
use super::notify;
#[cfg(not(feature = "web"))]
use super::require;
use crate::ros::inbox::Inbox;
use crate::ros::node::Prepared;
use crate::ros::port::Port;
#[cfg(feature = "web")]
use crate::ros::web::{Certificate, NodeFacts, WebParams, WebServer, start};
#[cfg(feature = "web")]
use crate::scan::read_scan;

/// There is none.
#[cfg(not(feature = "web"))]
pub(super) enum WebServer {}

#[cfg(not(feature = "web"))]
impl WebServer {
    pub fn was_opened(&self) -> bool {
        match *self {}
    }
}

#[cfg(not(feature = "web"))]
const NOT_BUILT: &str =
    "this touchup was built without the page: cargo install --locked --path . --features web (needs npm)";

/// Where the page is served.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct WebFlags {
    /// Serves the operator's page at this address; another one than that of this machine alone lets in who has a link
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8321", value_parser = address)]
    web: Option<SocketAddr>,
    /// Name of this machine by which the page may be called, beside its address; can be given again
    #[arg(long, value_name = "NAME", requires = "web")]
    web_name: Vec<String>,
    /// Lets in by link alone also on this machine, where else every user is
    #[arg(long, requires = "web")]
    web_links: bool,
    /// The part as it should be, in the frame and the unit of the scan: the page colours by the deviation from it
    #[arg(long, value_name = "MESH", requires = "web")]
    web_nominal: Option<PathBuf>,
    /// Serves the page by TLS with this certificate chain, PEM
    #[arg(long, value_name = "PEM", requires_all = ["web", "web_key"])]
    web_certificate: Option<PathBuf>,
    /// The key of the certificate, PEM
    #[arg(long, value_name = "PEM", requires = "web_certificate")]
    web_key: Option<PathBuf>,
}

fn address(text: &str) -> Result<SocketAddr, String> {
    let why = || "it must be an address and a port of this machine, as 192.168.0.7:8321".to_owned();
    text.to_socket_addrs().map_err(|_| why())?.next().ok_or_else(why)
}

impl WebFlags {
    /// Whether a page is wanted.
    pub fn is_wanted(&self) -> bool {
        self.web.is_some()
    }

    /// The same with a nominal part, unless one was named.
    pub fn with_nominal(&self, mesh: PathBuf) -> Self {
        Self { web_nominal: self.web_nominal.clone().or(Some(mesh)), ..self.clone() }
    }

    /// The port for the node: no page is wanted, or this program has none.
    #[cfg(not(feature = "web"))]
    pub fn serve(
        &self,
        _: &Prepared,
        _: Inbox,
        network: Arc<dyn Port>,
    ) -> Result<(Arc<dyn Port>, Option<WebServer>), CliError> {
        require(!self.is_wanted(), NOT_BUILT)?;
        Ok((network, None))
    }

    /// Serves the page where it is wanted, and says where: the port for the node.
    #[cfg(feature = "web")]
    pub fn serve(
        &self,
        ready: &Prepared,
        inbox: Inbox,
        network: Arc<dyn Port>,
    ) -> Result<(Arc<dyn Port>, Option<WebServer>), CliError> {
        let Some(address) = self.web else { return Ok((network, None)) };
        let certificate = self.web_certificate.clone().zip(self.web_key.clone());
        let certificate = certificate.map(|(chain, key)| Certificate { chain, key });
        let is_open = certificate.is_none() && !address.ip().is_loopback();
        let scan = ready.scan().0.to_owned();
        let session_folder = ready.folder().parent().map(PathBuf::from).unwrap_or_default();
        let nominal = self.web_nominal.as_deref().map(|path| read_scan(path, ready.mesh_unit()));
        let nominal = nominal.transpose().map_err(CliError::truth)?.map(|scan| scan.mesh);
        let (nominal_file, mesh_unit) = (self.web_nominal.clone(), ready.mesh_unit());
        let facts = NodeFacts { scan, scan_mesh: ready.scan_mesh(), session_folder, nominal, nominal_file, mesh_unit };
        let by_link = self.web_links || !address.ip().is_loopback();
        let params = WebParams { address, names: self.web_name.clone(), by_link, certificate };
        let (port, server) = start(&params, facts, inbox, ready.whole_mesh(), network, notify)?;
        notify(&format!("page: {}", server.url()));
        server.invitations().iter().for_each(|invitation| notify(invitation));
        if is_open {
            notify(
                "the page is not encrypted: use it in a network of your own, or give --web-certificate and --web-key",
            );
        }
        Ok((port, Some(server)))
    }
}
