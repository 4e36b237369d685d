//! Makes the folder of Python packages that the client needs.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::child::python_version;
use super::protocol::WHEEL;

/// Reason why the folder is missing.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// A failed step.
    #[error("{command}: {reason}")]
    Step {
        /// command line
        command: String,
        /// its last words
        reason: String,
    },
    /// The packages are for another Python than the program's.
    #[error(
        "{python} is Python {found}, and touchup was built with {wanted}: give that one with --python"
    )]
    OtherPython {
        /// interpreter
        python: String,
        /// its version
        found: String,
        /// version of the program
        wanted: String,
    },
}

/// Makes a virtual environment with ur-rtde; returns the folder of packages, for
/// [`super::UrParams::site_packages`].
///
/// - `folder`: of the environment; completes an existing one.
/// - `python`: the interpreter; `None`: the version that touchup was built with.
///
/// # Errors
/// [`SetupError`]
pub fn setup(folder: &Path, python: Option<&str>) -> Result<PathBuf, SetupError> {
    let wanted = python_version();
    let python = python.map_or_else(|| format!("python{wanted}"), str::to_owned);
    let found = run(
        &python,
        &["-c", "import sys; print('%d.%d' % sys.version_info[:2])"],
    )?;
    if found != wanted {
        return Err(SetupError::OtherPython {
            python,
            found,
            wanted,
        });
    }
    run(&python, &["-m", "venv", &folder.to_string_lossy()])?;
    let python = folder.join("bin/python").to_string_lossy().into_owned();
    // only a wheel: its source takes a compiler, Boost and a quarter of an hour
    let wheel = format!("ur-rtde=={WHEEL}");
    run(
        &python,
        &[
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--only-binary=:all:",
            &wheel,
        ],
    )?;
    run(&python, &["-c", "import rtde_control, rtde_receive"])?;
    run(
        &python,
        &[
            "-c",
            "import sysconfig; print(sysconfig.get_path('platlib'))",
        ],
    )
    .map(PathBuf::from)
}

/// Runs a command; returns its output.
fn run(program: &str, arguments: &[&str]) -> Result<String, SetupError> {
    let command = || format!("{program} {}", arguments.join(" "));
    let output = Command::new(program)
        .args(arguments)
        .output()
        .map_err(|error| SetupError::Step {
            command: command(),
            reason: error.to_string(),
        })?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned());
    }
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    let reason = said
        .lines()
        .rev()
        .find(|line| !line.trim().is_empty())
        .unwrap_or("it failed")
        .to_owned();
    Err(SetupError::Step {
        command: command(),
        reason,
    })
}
