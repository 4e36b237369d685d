//! `--web`: address of the operator page, for all verbs with one.

use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::begin::BeginError;
#[cfg(feature = "web")]
use super::output::{notify, notify_with_code};
#[cfg(feature = "web")]
use super::set_up::{set_up, set_up_on_page};
use crate::cli::CliError;
use crate::cli::require;
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::MeshUnit;
use touchup_node::node::PreparedNode;
#[cfg(feature = "web")]
use touchup_node::page::{Certificate, Invitation, NodeFacts, WebParams, WebServer};
use touchup_node::ros::arguments::NodeConfig;
use touchup_node::ros::inbox::Inbox;
use touchup_node::ros::parameters::Parameters;
use touchup_node::ros::port::Port;
#[cfg(feature = "web")]
use touchup_session::scan::read_scan;
use touchup_session::scene::Scene;

/// Server of a build without the page: none.
#[cfg(not(feature = "web"))]
pub(in crate::cli) enum WebServer {}

#[cfg(not(feature = "web"))]
impl WebServer {
    pub fn was_opened(&self) -> bool {
        match *self {}
    }
}

#[cfg(not(feature = "web"))]
const NOT_BUILT: &str = "this touchup was built without the page: cargo install --locked --path . --features web (needs npm)";

/// Address and access of the page.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct WebFlags {
    /// Serves the operator page at ADDRESS; on a non-loopback address access needs a link
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8321", value_parser = address)]
    web: Option<SocketAddr>,
    /// Name of this machine for the page, beside its address; repeat for each
    #[arg(long, value_name = "NAME", requires = "web")]
    web_name: Vec<String>,
    /// Requires a link on this machine too, instead of access for every user
    #[arg(long, requires = "web")]
    web_links: bool,
    /// Nominal part, in the frame and unit of the scan: the page colours by the deviation from it
    #[arg(long, value_name = "MESH", requires = "web")]
    web_nominal: Option<PathBuf>,
    /// Serves the page by TLS with this certificate chain, PEM
    #[arg(long, value_name = "PEM", requires_all = ["web", "web_key"])]
    web_certificate: Option<PathBuf>,
    /// Key of the certificate, PEM
    #[arg(long, value_name = "PEM", requires = "web_certificate")]
    web_key: Option<PathBuf>,
}

fn address(text: &str) -> Result<SocketAddr, String> {
    let why = || "it must be an address and a port of this machine, as 192.168.0.7:8321".to_owned();
    text.to_socket_addrs()
        .map_err(|_| why())?
        .next()
        .ok_or_else(why)
}

impl WebFlags {
    /// Whether `--web` requests a page.
    pub fn is_wanted(&self) -> bool {
        self.web.is_some()
    }

    /// The same flags with a nominal part, unless they name one.
    pub fn with_nominal(&self, mesh: PathBuf) -> Self {
        Self {
            web_nominal: self.web_nominal.clone().or(Some(mesh)),
            ..self.clone()
        }
    }

    /// Whether the page must do the setup: `--web` without a scan.
    ///
    /// # Errors
    /// An unusable scene.
    fn needs_setup(&self, parameters: &Parameters) -> Result<bool, CliError> {
        if !self.is_wanted() || !parameters.string("scan").is_empty() {
            return Ok(false);
        }
        let scene = Path::new(parameters.string("scene"));
        Ok(scene.as_os_str().is_empty() || Scene::read(scene)?.scan_file(scene).is_none())
    }

    /// Result of `begin` for a configuration.
    #[cfg(not(feature = "web"))]
    pub fn begun<B>(
        &self,
        _: Option<&Path>,
        config: &mut NodeConfig,
        begin: &mut dyn FnMut(&NodeConfig) -> Result<B, BeginError>,
    ) -> Result<(B, Option<WebServer>), CliError> {
        require(!self.needs_setup(&config.parameters)?, NOT_BUILT)?;
        Ok((begin(config)?, None))
    }

    /// Result of `begin` for a configuration, or, if that names no scan, for the setup on the page,
    /// with its server.
    ///
    /// - `scans`: folder of the scans.
    #[cfg(feature = "web")]
    pub fn begun<B>(
        &self,
        scans: Option<&Path>,
        config: &mut NodeConfig,
        begin: &mut dyn FnMut(&NodeConfig) -> Result<B, BeginError>,
    ) -> Result<(B, Option<WebServer>), CliError> {
        if !self.needs_setup(&config.parameters)? {
            require(
                scans.is_none(),
                "--web-scans is for a node without a scan, and one is named",
            )?;
            return Ok((begin(config)?, None));
        }
        let Some(server) = self.listening()? else {
            return Ok((begin(config)?, None));
        };
        let setup = set_up(&server, scans.unwrap_or(Path::new(".")), &config.parameters)?;
        self.announce(&server);
        Ok((set_up_on_page(&setup, config, begin)?, Some(server)))
    }

    /// Nominal part, if named.
    #[cfg(not(feature = "web"))]
    pub fn nominal(&self, _: MeshUnit) -> Result<Option<TriMesh>, CliError> {
        Ok(None)
    }

    /// Nominal part, if named.
    ///
    /// - `unit`: unit of its file.
    #[cfg(feature = "web")]
    pub fn nominal(&self, unit: MeshUnit) -> Result<Option<TriMesh>, CliError> {
        let nominal = self
            .web_nominal
            .as_deref()
            .map(|path| read_scan(path, unit))
            .transpose();
        Ok(nominal.map_err(CliError::truth)?.map(|scan| scan.mesh))
    }

    /// Port for the node, without a page.
    #[cfg(not(feature = "web"))]
    pub fn serve(
        &self,
        _: Option<WebServer>,
        _: Option<TriMesh>,
        _: &PreparedNode,
        _: Inbox,
        network: Arc<dyn Port>,
    ) -> Result<(Arc<dyn Port>, Option<WebServer>), CliError> {
        require(!self.is_wanted(), NOT_BUILT)?;
        Ok((network, None))
    }

    /// Serves a requested page and prints its address; returns the port for the node.
    ///
    /// - `opened`: already running server.
    #[cfg(feature = "web")]
    pub fn serve(
        &self,
        opened: Option<WebServer>,
        nominal: Option<TriMesh>,
        ready: &PreparedNode,
        inbox: Inbox,
        network: Arc<dyn Port>,
    ) -> Result<(Arc<dyn Port>, Option<WebServer>), CliError> {
        let (server, was_open) = match opened {
            Some(server) => (server, true),
            None => match self.listening()? {
                Some(server) => (server, false),
                None => return Ok((network, None)),
            },
        };
        let (scan, scan_faces) = ready.scan();
        let session_folder = ready
            .folder()
            .parent()
            .map(PathBuf::from)
            .unwrap_or_default();
        let (nominal_file, mesh_unit) = (self.web_nominal.clone(), ready.mesh_unit());
        let facts = NodeFacts {
            scan: scan.to_owned(),
            scan_faces,
            // the setup on the page has confirmed it
            is_size_confirmed: was_open,
            session_folder,
            nominal,
            nominal_file,
            mesh_unit,
        };
        let port = server.serve_node(facts, inbox, ready.mesh_feed(), network)?;
        if !was_open {
            self.announce(&server);
        }
        Ok((port, Some(server)))
    }

    #[cfg(feature = "web")]
    fn certificate(&self) -> Option<Certificate> {
        let files = self.web_certificate.clone().zip(self.web_key.clone());
        files.map(|(chain, key)| Certificate { chain, key })
    }

    /// Unannounced server for a requested page.
    #[cfg(feature = "web")]
    fn listening(&self) -> Result<Option<WebServer>, CliError> {
        let Some(address) = self.web else {
            return Ok(None);
        };
        let by_link = self.web_links || !address.ip().is_loopback();
        let params = WebParams {
            address,
            names: self.web_name.clone(),
            by_link,
            certificate: self.certificate(),
        };
        Ok(Some(WebServer::open(&params, invite)?))
    }

    /// Prints addresses and invitation links of the page.
    #[cfg(feature = "web")]
    fn announce(&self, server: &WebServer) {
        for url in server.urls() {
            notify(&format!("page: {url}"));
        }
        server.invitations().iter().for_each(invite);
        if self.certificate().is_none()
            && self.web.is_some_and(|address| !address.ip().is_loopback())
        {
            notify(
                "the page is not encrypted: use it in a network of your own, or give --web-certificate and --web-key",
            );
        }
    }
}

#[cfg(feature = "web")]
fn invite(Invitation { text, code }: &Invitation) {
    notify_with_code(text, code);
}
