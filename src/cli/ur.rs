//! `touchup ur`: the Python environment of a UR arm.

use std::path::PathBuf;

use clap::Subcommand;

use super::{CliError, Losses, print_result};
use touchup_node::ur::{child, setup};

#[derive(Debug, Subcommand)]
pub(super) enum UrArguments {
    /// Makes a virtual environment with ur-rtde and prints the folder for the parameter
    /// site_packages
    Setup {
        /// Folder of the environment
        folder: PathBuf,
        /// Interpreter for the environment [default: that of the version touchup was built with]
        #[arg(long)]
        python: Option<String>,
    },
    /// Speaks to an arm; started by touchup itself
    #[command(hide = true)]
    Child,
}

pub(super) fn ur(arguments: &UrArguments) -> Result<Losses, CliError> {
    match arguments {
        UrArguments::Setup { folder, python } => {
            let site_packages = setup(folder, python.as_deref())?;
            print_result(&format!("site_packages: {}", site_packages.display()))?;
        }
        UrArguments::Child => child::run()?,
    }
    Ok(Losses::new())
}
