//! Why the page is not served.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use crate::ros::exchange::RosError;

/// Why the page is not served.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// the address cannot be listened to
    #[error(
        "the page cannot be served at {address}: {source}; choose another address or port by --web"
    )]
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
    /// nothing can be set up with these
    #[error("{0}")]
    Setup(String),
    /// a service has a name that is none
    #[error(transparent)]
    Ros(#[from] RosError),
    /// no thread, no random numbers
    #[error("the page cannot be served: {0}")]
    System(#[from] io::Error),
}
