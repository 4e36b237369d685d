//! Makes the folder of Python packages that the client needs.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::child::python_version;
use super::protocol::WHEEL;

/// Why there is no such folder.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// A step that did not work.
    #[error("{command}: {reason}")]
    Step {
        /// what was run
        command: String,
        /// what it said last
        reason: String,
    },
    /// The packages are for another Python than the program runs.
    #[error(
        "{python} is Python {found}, and touchup was built with {wanted}: give that one with --python"
    )]
    OtherPython {
        /// what was run
        python: String,
        /// its version
        found: String,
        /// ours
        wanted: String,
    },
}

/// Makes a virtual environment with ur-rtde in it; returns the folder of packages, for
/// [`super::UrParams::site_packages`].
///
/// - `folder`: of the environment; one that is there already is kept and completed.
/// - `python`: the interpreter; `None`: that of the version touchup was built with.
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
    // a wheel or nothing: its source takes a compiler, Boost and a quarter of an hour
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

/// What a command printed.
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
