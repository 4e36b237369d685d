//! Output of the verbs: results on stdout, files, and checks of output paths before the work
//! begins.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::{CliError, require};
use touchup_io::atomic::{AtomicFile, is_same_file, write_atomically};
use touchup_io::file_error::FileError;

/// Prints one or more lines on stdout, whole, or returns an error; a closed pipe is none.
pub(in crate::cli) fn print_result(text: &str) -> Result<(), CliError> {
    let mut out = stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Prints a result as one JSON object, or in words.
pub(in crate::cli) fn print_report(
    as_json: bool,
    report: &impl Serialize,
    in_words: impl FnOnce() -> String,
) -> Result<(), CliError> {
    let json =
        || serde_json::to_string(report).expect("finite numbers and names alone cannot fail");
    print_result(&if as_json { json() } else { in_words() })
}

/// Counts by their reasons, in words.
pub(in crate::cli) fn by_reason(counts: &BTreeMap<String, u64>) -> String {
    let counts: Vec<_> = counts
        .iter()
        .map(|(reason, count)| format!("{count} {reason}"))
        .collect();
    if counts.is_empty() {
        "none".to_owned()
    } else {
        counts.join(", ")
    }
}

/// Prints one line on stderr that is no error.
pub(in crate::cli) fn notify(line: &str) {
    let _ = writeln!(io::stderr(), "touchup: {}", line.replace('\n', " "));
}

/// As [`notify`], with the lines of a QR code below, dark on light in a terminal of any colours.
#[cfg(feature = "web")]
pub(in crate::cli) fn notify_with_code(line: &str, code: &str) {
    notify(line);
    let mut err = io::stderr().lock();
    let [begin, end] = match io::IsTerminal::is_terminal(&err) {
        true => ["\x1b[30;107m", "\x1b[0m\n"],
        false => ["", "\n"],
    };
    let lines = code.lines().map(|line| [begin, line, end].concat());
    let _ = err.write_all(lines.collect::<String>().as_bytes());
}

/// Error constructor for a file or folder with a write failure.
pub(in crate::cli) fn not_written(path: &Path) -> impl FnOnce(io::Error) -> CliError {
    |source| {
        CliError::not_written(FileError::Write {
            path: path.to_owned(),
            source,
        })
    }
}

/// Writes a result as JSON.
pub(in crate::cli) fn write_json(path: &Path, report: &impl Serialize) -> Result<(), CliError> {
    let text = serde_json::to_string_pretty(report).expect("numbers and names alone cannot fail");
    write_atomically(path, |out| writeln!(out, "{text}")).map_err(not_written(path))
}

/// Refuses a `--out` that would overwrite the input.
pub(in crate::cli) fn check_kept(flag: &str, input: &Path, output: &Path) -> Result<(), CliError> {
    check_kept_by("--out", flag, input, output)
}

/// As [`check_kept`], for the output flag `by`.
pub(in crate::cli) fn check_kept_by(
    by: &str,
    flag: &str,
    input: &Path,
    output: &Path,
) -> Result<(), CliError> {
    let path = output.display();
    let why = format!("{by} would write over {path}, which {flag} reads: choose another place");
    require(!is_same_file(input, output), why)
}

/// Checks that a file can be written.
pub(in crate::cli) fn check_place(path: &Path) -> Result<(), CliError> {
    AtomicFile::create(path)
        .map(drop)
        .map_err(not_written(path))
}

/// Checks names and paths of outputs.
///
/// - `outputs`: flag, ending and path of each.
/// - `inputs`: files that no output may overwrite, and `used`: their use.
pub(in crate::cli) fn check_outputs(
    outputs: &[(&str, &str, &Option<PathBuf>)],
    inputs: &[Option<&PathBuf>],
    used: &str,
) -> Result<(), CliError> {
    for (flag, ending, path) in outputs {
        let Some(path) = path else { continue };
        let shown = path.display();
        let is_of_kind = shown.to_string().to_ascii_lowercase().ends_with(ending);
        require(
            is_of_kind,
            format_args!("{flag} {shown} must end in {ending}"),
        )?;
        let is_read = inputs
            .iter()
            .flatten()
            .any(|input| is_same_file(input, path));
        require(
            !is_read,
            format_args!("{flag} would write over {shown}, which is {used}"),
        )?;
        check_place(path)?;
    }
    Ok(())
}
