//! The peers of the report: a virtual environment with libraries from PyPI, and one process in it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use touchup_io::atomic::write_atomically;
use touchup_method::haptic::RefineError;
use touchup_report::Effort;
use touchup_report::peers::{PACKAGES, Peers, PeersAtSize, PeersInput, SCRIPT, UnknownLine};

/// Error of the measurement of the peers.
#[derive(Debug, thiserror::Error)]
pub enum PeersError {
    /// Failure of the interpreter, the environment or the packages.
    #[error("{command}: {reason}; --peers needs python3 with venv, and PyPI the first time")]
    Setup { command: String, reason: String },
    /// The script ended without a measurement.
    #[error("the peers' script failed: {0}")]
    Script(String),
    #[error(transparent)]
    UnknownLine(#[from] UnknownLine),
    #[error("cannot write {}: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("touchup itself: {0}")]
    Touchup(#[from] RefineError),
}

/// Measures touchup and the peers in turns, on 100k faces and, unless quick, on 1M.
///
/// `environment`: folder of the virtual environment; created and filled if missing.
pub fn peers(
    effort: Effort,
    environment: &Path,
    progress: &mut dyn FnMut(&str),
) -> Result<Peers, PeersError> {
    progress("peers: virtual environment");
    let python = make_environment(environment)?;
    let sizes: &[usize] = effort.choose(&[100_000], &[100_000, 1_000_000]);
    let at_size = |&faces: &usize| {
        progress(&format!("peers: touchup at {faces} faces"));
        let input = PeersInput::new(faces, effort).map_err(RefineError::from)?;
        let before = input.measure("before")?;
        progress(&format!("peers: libraries at {faces} faces"));
        let printed = run_script(&python, &input)?;
        progress(&format!("peers: touchup again at {faces} faces"));
        Ok(PeersAtSize::read(
            &input,
            [before, input.measure("after")?],
            &printed,
        )?)
    };
    Ok(Peers {
        sizes: sizes
            .iter()
            .map(at_size)
            .collect::<Result<_, PeersError>>()?,
    })
}

/// The interpreter of an environment with the packages.
fn make_environment(folder: &Path) -> Result<PathBuf, PeersError> {
    let python = folder.join("bin/python");
    if !python.exists() {
        set_up(Command::new("python3").arg("-m").arg("venv").arg(folder))?;
    }
    let install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "--only-binary=:all:",
    ];
    set_up(Command::new(&python).args(install).args(PACKAGES))?;
    Ok(python)
}

fn set_up(command: &mut Command) -> Result<(), PeersError> {
    let Err(reason) = run(command) else {
        return Ok(());
    };
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words: Vec<_> = words.map(|word| word.to_string_lossy()).collect();
    Err(PeersError::Setup {
        command: words.join(" "),
        reason,
    })
}

/// Output of a program, or its last line before a failure.
fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|error| error.to_string())?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    let line = said.lines().rev().find(|line| !line.trim().is_empty());
    Err(line.map_or_else(|| format!("it ended with {}", output.status), str::to_owned))
}

fn run_script(python: &Path, input: &PeersInput) -> Result<String, PeersError> {
    let write_error = |path: PathBuf| move |source| PeersError::Write { path, source };
    let folder = tempfile::tempdir().map_err(write_error(std::env::temp_dir()))?;
    for (name, bytes) in input.files() {
        let path = folder.path().join(name);
        write_atomically(&path, |to| to.write_all(&bytes)).map_err(write_error(path))?;
    }
    let mut command = Command::new(python);
    command
        .args(["-c", SCRIPT])
        .arg(folder.path())
        .arg(input.distances.len().to_string());
    run(&mut command).map_err(PeersError::Script)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_environment_names_what_it_needs() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("taken");
        std::fs::write(&file, "no folder").unwrap();
        let error = make_environment(&file.join("env")).unwrap_err().to_string();
        assert!(
            error.contains("python3 -m venv") && error.contains("PyPI"),
            "{error}"
        );
    }
}
