//! Connections to the page: their number, time-outs and TLS.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};

use crate::page::error::WebError;
use crate::ros::locked;
use touchup_io::text_file::read_text;

/// Maximum number of connections.
const MOST_CONNECTIONS: usize = 64;
/// Time-out for the TLS handshake, and for the head of each request.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Wait after a system error, as too many open files.
const AFTER_ERROR: Duration = Duration::from_millis(100);

/// Files of a certificate and of its key, PEM.
#[derive(Clone, Debug)]
pub struct Certificate {
    /// the chain, the server's own first
    pub chain: PathBuf,
    /// the private key
    pub key: PathBuf,
}

impl Certificate {
    /// TLS acceptor.
    pub(in crate::page) fn acceptor(&self) -> Result<TlsAcceptor, WebError> {
        let bad = |file: &Path, why: String| WebError::Certificate {
            file: file.to_owned(),
            why,
        };
        let text = |file: &Path| read_text(file).map_err(|error| bad(file, error.to_string()));
        let chain = CertificateDer::pem_slice_iter(text(&self.chain)?.as_bytes())
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| bad(&self.chain, error.to_string()))?;
        if chain.is_empty() {
            return Err(bad(&self.chain, "there is no certificate in it".to_owned()));
        }
        let key = PrivateKeyDer::from_pem_slice(text(&self.key)?.as_bytes())
            .map_err(|error| bad(&self.key, error.to_string()))?;
        let config = ServerConfig::builder()
            .with_no_client_auth()
            .with_single_cert(chain, key);
        let mut config = config.map_err(|error| bad(&self.key, error.to_string()))?;
        // a client that reads and writes in two threads, as Python's, may lose its request to a ticket
        config.send_tls13_tickets = 0;
        Ok(TlsAcceptor::from(Arc::new(config)))
    }
}

/// The served routes, which change while connections are open.
#[derive(Clone, Debug)]
pub(in crate::page) struct Routes(Arc<Mutex<Router>>);

impl Routes {
    /// The first routes.
    pub fn new(router: Router) -> Self {
        Self(Arc::new(Mutex::new(router)))
    }

    /// Replaces the routes.
    pub fn set(&self, router: Router) {
        *locked(&self.0) = router;
    }

    fn now(&self) -> Router {
        locked(&self.0).clone()
    }
}

/// Serves until dropped.
pub(in crate::page) async fn serve(
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
    routes: Routes,
) {
    let room = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok(place) = Arc::clone(&room).acquire_owned().await else {
            return;
        };
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                tracing::warn!(%error, "a connection to the page was not taken");
                sleep(AFTER_ERROR).await;
                continue;
            }
        };
        let (tls, routes) = (tls.clone(), routes.clone());
        tokio::spawn(async move {
            // a client's disconnect is no error
            let _ = connect(stream, tls, routes).await;
            drop(place);
        });
    }
}

async fn connect(stream: TcpStream, tls: Option<TlsAcceptor>, routes: Routes) -> io::Result<()> {
    // a mesh change does not wait for the next one
    stream.set_nodelay(true)?;
    match tls {
        None => answer(stream, routes).await,
        Some(tls) => answer(timeout(HEAD_WITHIN, tls.accept(stream)).await??, routes).await,
    }
}

async fn answer(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    routes: Routes,
) -> io::Result<()> {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(HEAD_WITHIN)
        .max_buf_size(64 << 10);
    // an open connection gets the routes at the time of its request
    let service = service_fn(move |request| TowerToHyperService::new(routes.now()).call(request));
    let connection = http.serve_connection(TokioIo::new(stream), service);
    connection.with_upgrades().await.map_err(io::Error::other)
}
