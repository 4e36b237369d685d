//! Log lines for consumers such as the node, which forwards them to `/rosout`: a bounded queue that
//! takes one line per second from each place in the program.

use std::collections::BTreeMap;
use std::fmt::{Debug, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;

/// Most waiting lines; later ones reach stderr alone.
const MOST_WAITING: usize = 256;
/// Least time between lines of one place in the program.
const EVERY: Duration = Duration::from_secs(1);
/// Longest line before truncation, bytes.
const LONGEST: usize = 2000;

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// severity
    pub level: Level,
    /// message, with its fields behind it
    pub text: String,
    /// source file
    pub file: &'static str,
    /// source line
    pub line: u32,
}

/// The listener; none before [`listen`].
static LISTENER: Mutex<Option<SyncSender<LogLine>>> = Mutex::new(None);

/// Directs later lines to this receiver, and no longer to an earlier one.
pub fn listen() -> Receiver<LogLine> {
    let (to, lines) = sync_channel(MOST_WAITING);
    *locked(&LISTENER) = Some(to);
    lines
}

/// Locks; the content is whole even after a panic.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Forwards lines of this program, without those from libraries.
#[derive(Debug, Default)]
pub struct LogLines {
    /// time of the last line of each place, by file and line
    said: Mutex<BTreeMap<(&'static str, u32), Instant>>,
}

impl<S: Subscriber> Layer<S> for LogLines {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let about = event.metadata();
        if !about.target().starts_with("touchup") {
            return;
        }
        let Some(listener) = locked(&LISTENER).clone() else {
            return;
        };
        let place = (about.file().unwrap_or_default(), about.line().unwrap_or(0));
        let now = Instant::now();
        {
            let mut said = locked(&self.said);
            if said
                .get(&place)
                .is_some_and(|last| now.saturating_duration_since(*last) < EVERY)
            {
                return;
            }
            said.insert(place, now);
        }
        let mut text = LineText::default();
        event.record(&mut text);
        let LineText { mut said, fields } = text;
        said.push_str(&fields);
        let whole = (0..=LONGEST.min(said.len()))
            .rev()
            .find(|&at| said.is_char_boundary(at));
        said.truncate(whole.unwrap_or(0));
        let (file, line) = place;
        // drops the line if the queue is full
        let _ = listener.try_send(LogLine {
            level: *about.level(),
            text: said,
            file,
            line,
        });
    }
}

/// Message of an event, and its fields.
#[derive(Default)]
struct LineText {
    said: String,
    fields: String,
}

impl Visit for LineText {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        // writing to a string cannot fail
        let _ = match field.name() {
            "message" => write!(self.said, "{value:?}"),
            name => write!(self.fields, " {name}={value:?}"),
        };
    }
}

#[cfg(test)]
mod tests {
    use tracing_subscriber::layer::SubscriberExt;
    use tracing_subscriber::registry;

    use super::*;

    /// A single test, as the program has a single listener.
    #[test]
    fn lines_of_this_program_come_with_their_fields_and_what_repeats_itself_comes_once() {
        let lines = listen();
        tracing::subscriber::with_default(registry().with(LogLines::default()), || {
            (0..100).for_each(|count| {
                tracing::warn!(topic = "stylus/pose", count, "messages could not be read")
            });
            tracing::error!(target: "rustdds", "what a library says");
            tracing::info!("{}", "ä".repeat(LONGEST));
        });
        let mine: Vec<_> = lines
            .try_iter()
            .filter(|line| line.file.ends_with("log_lines.rs"))
            .collect();
        assert_eq!(mine.len(), 2, "{mine:?}");
        assert_eq!(
            mine[0].text,
            "messages could not be read topic=\"stylus/pose\" count=0"
        );
        assert_eq!(
            (mine[0].level, mine[1].level, mine[1].text.len()),
            (Level::WARN, Level::INFO, LONGEST)
        );
    }
}
