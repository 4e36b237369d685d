//! Errors of the page server.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use crate::ros::RosError;

/// Error of the page server.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
    /// no listening at the address
    #[error(
        "the page cannot be served at {address}: {source}; choose another address or port by --web"
    )]
    Address {
        /// address
        address: SocketAddr,
        /// error of the system
        source: io::Error,
    },
    /// invalid file of a certificate
    #[error("{}: {why}; --web-certificate and --web-key take PEM files", .file.display())]
    Certificate {
        /// file
        file: PathBuf,
        /// reason
        why: String,
    },
    /// invalid setup parameters
    #[error("{0}")]
    Setup(String),
    /// invalid service name
    #[error(transparent)]
    Ros(#[from] RosError),
    /// no thread, no random numbers
    #[error("the page cannot be served: {0}")]
    System(#[from] io::Error),
}
