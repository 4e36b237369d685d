//! Paths as parameters of the node.

use std::path::Path;

use crate::cli::CliError;
use touchup_node::ros::parameters::ParameterValue;

/// Path as a parameter.
pub(in crate::cli) fn path(path: &Path) -> Result<ParameterValue, CliError> {
    let why = || {
        CliError::usage(format!(
            "{}: parameters of ROS are UTF-8, rename the file",
            path.display()
        ))
    };
    Ok(ParameterValue::String(
        path.to_str().ok_or_else(why)?.to_owned(),
    ))
}
