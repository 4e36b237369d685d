//! Converts errors to exceptions in the words of the command line, and log warnings to Python
//! warnings.

use std::ffi::CString;
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;
use touchup::cli::CliError;
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::{Context, SubscriberExt};

pyo3::create_exception!(
    touchup,
    TouchupError,
    PyException,
    "Error, in the words of the command line: `kind`, `hint` and `exit_code` are those of its `--json`."
);
pyo3::create_exception!(
    touchup,
    TouchupWarning,
    PyUserWarning,
    "Finding about an input, or a loss that a better input would avoid."
);

/// Maximum number of warnings per call; a last line counts the rest.
const MOST_WARNINGS: usize = 100;

/// The exception of an error.
pub fn exception(py: Python<'_>, error: CliError) -> PyErr {
    let CliError {
        kind,
        message,
        hint,
        exit_code,
    } = error;
    let exception = TouchupError::new_err(message);
    let value = exception.value(py);
    let set = value
        .setattr("kind", kind)
        .and_then(|()| value.setattr("hint", hint));
    match set.and_then(|()| value.setattr("exit_code", exit_code)) {
        Ok(()) => exception,
        Err(other) => other,
    }
}

/// An error of the caller.
pub fn usage(message: String) -> CliError {
    CliError {
        kind: "usage",
        message,
        hint: None,
        exit_code: 2,
    }
}

/// Runs `work` without holding the interpreter; its log warnings follow as Python warnings.
///
/// # Errors
/// The error of `work` as an exception, or a warning that the user turned into one.
pub fn at_work<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, CliError> + Send,
) -> PyResult<T> {
    let lines = WarningLines::default();
    let subscriber = tracing_subscriber::registry()
        .with(lines.clone())
        .with(LevelFilter::WARN);
    let done = py.detach(|| tracing::subscriber::with_default(subscriber, work));
    let warned = warn(py, &lines.take());
    let done = done.map_err(|error| exception(py, error))?;
    warned.map(|()| done)
}

/// Warns of each line.
///
/// # Errors
/// A warning that the user turned into an exception.
pub fn warn(py: Python<'_>, lines: &[String]) -> PyResult<()> {
    let category = py.get_type::<TouchupWarning>();
    for line in lines {
        let text = CString::new(line.replace('\0', " "))?;
        PyErr::warn(py, &category, &text, 2)?;
    }
    Ok(())
}

/// Warning lines of the log.
#[derive(Clone, Default)]
struct WarningLines {
    lines: Arc<Mutex<Vec<String>>>,
}

impl WarningLines {
    fn take(&self) -> Vec<String> {
        let mut lines =
            std::mem::take(&mut *self.lines.lock().unwrap_or_else(PoisonError::into_inner));
        if lines.len() > MOST_WARNINGS {
            let more = lines.len() - MOST_WARNINGS;
            lines.truncate(MOST_WARNINGS);
            lines.push(format!("{more} more warnings"));
        }
        lines
    }
}

impl<S: Subscriber> Layer<S> for WarningLines {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        // only the program's crates, including this one, whose name begins with `_`
        if !event
            .metadata()
            .target()
            .trim_start_matches('_')
            .starts_with("touchup")
        {
            return;
        }
        let mut line = LineOfEvent(String::new());
        event.record(&mut line);
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() <= 100 * MOST_WARNINGS {
            lines.push(line.0);
        }
    }
}

/// The message, followed by its fields.
struct LineOfEvent(String);

impl Visit for LineOfEvent {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        // writing to a String never fails
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, " {name}={value:?}"),
        };
    }
}
