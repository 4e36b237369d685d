//! Progress bar for work over a second: on stderr, and only on a terminal.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shorter work has no bar.
const QUIET_FOR: Duration = Duration::from_secs(1);
/// Number of steps between two looks at the clock.
const STEPS_PER_LOOK: u64 = 1024;

/// Counter of steps with a bar after the first second. The bar vanishes when dropped.
#[derive(Debug)]
pub struct WorkProgress {
    bar: ProgressBar,
    started: Instant,
    steps: u64,
    waiting: bool,
}

impl WorkProgress {
    /// `steps`: their total number, if known.
    pub fn new(what: &'static str, steps: Option<u64>) -> Self {
        let bar = ProgressBar::with_draw_target(steps, ProgressDrawTarget::hidden());
        let template = match steps {
            Some(_) => "{msg} {wide_bar} {percent}% {eta}",
            None => "{msg} {spinner} {human_pos} {elapsed}",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self {
            bar,
            started: Instant::now(),
            steps: 0,
            waiting: stderr().is_terminal(),
        }
    }

    /// Stage without countable steps.
    pub fn stage(what: &'static str) -> Self {
        let mut stage = Self::new(what, None);
        if stage.waiting {
            stage.waiting = false;
            stage.bar.set_draw_target(ProgressDrawTarget::stderr());
            stage.bar.enable_steady_tick(QUIET_FOR);
        }
        stage
    }

    /// Counts one step.
    #[inline]
    pub fn step(&mut self) {
        self.steps += 1;
        if self.steps.is_multiple_of(STEPS_PER_LOOK) {
            self.look();
        }
    }

    /// Counts one of few steps.
    pub fn step_now(&mut self) {
        self.steps += 1;
        self.look();
    }

    fn look(&mut self) {
        if self.waiting && self.started.elapsed() > QUIET_FOR {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.waiting = false;
        }
        self.bar.set_position(self.steps);
    }
}

impl Drop for WorkProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
