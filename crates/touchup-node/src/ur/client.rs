//! The process that speaks to the arm, from the outside: start, commands, queries and end.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::dashboard::Dashboard;
use super::error::UrError;
use super::guard::{ClientLoss, FAREWELL, Guard, GuardState, Halt, SharedGuard, ZEROING};
use super::lateness::StartLateness;
use super::params::UrParams;
use super::priority;
use super::protocol::{Begin, ClientReport, Order, OrderAction, UrState, vector_of};
use touchup_probing::arm::ArmError;
use touchup_session::clock::Clock;

/// The process and its guard.
pub(super) struct Client {
    shared: Arc<SharedGuard>,
    orders: Option<ChildStdin>,
    guard: Option<JoinHandle<Option<Halt>>>,
    halt: Option<Halt>,
    /// whether the controller is a simulation that waits for this client: nothing is late then
    pub is_lock_step: bool,
    /// process number
    pub id: u32,
}

/// Raises the priority of a thread that watches the arm; the commanding thread reports a refusal.
fn be_in_time(is_lock_step: bool) {
    if !is_lock_step {
        let _ = priority::raise(priority::GUARD, false);
    }
}

/// Starts the program with pipes.
fn spawned(program: &Path) -> Result<Child, UrError> {
    Command::new(program)
        .args(["ur", "child"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        // an interrupt from the terminal is for the parent, which stops the arm first
        .process_group(0)
        .spawn()
        .map_err(|error| {
            UrError::Client(format!("does not start ({}): {error}", program.display()))
        })
}

/// Reads the reports of the process on a thread.
fn reports_of(lines: ChildStdout, is_lock_step: bool) -> Receiver<ClientReport> {
    let (sender, reports) = channel();
    thread::spawn(move || {
        be_in_time(is_lock_step);
        for line in BufReader::new(lines).lines().map_while(Result::ok) {
            let Ok(report) = serde_json::from_str::<ClientReport>(&line) else {
                tracing::warn!(
                    line,
                    "the program that speaks to the arm said what is no report"
                );
                continue;
            };
            if sender.send(report).is_err() {
                break;
            }
        }
    });
    reports
}

impl Client {
    /// Starts the process; returns when the arm takes commands.
    ///
    /// - `version`: major and minor, of the controller; `dashboard`: for the guard alone.
    pub fn start(
        params: &UrParams,
        version: [u32; 2],
        dashboard: Dashboard,
    ) -> Result<Self, UrError> {
        let mut child = spawned(&params.program)?;
        let (Some(mut orders), Some(lines), Some(words)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(UrError::Client("has no pipes".to_owned()));
        };
        let is_lock_step = params.is_lock_step && dashboard.is_lock_step;
        let begin = Begin {
            host: params.host.clone(),
            site_packages: params.site_packages.clone(),
            tool: vector_of(&params.pose_ft),
            mass_kg: params.mass,
            centre_m: params.centre.into(),
            version,
            damping: params.damping,
            gain: params.gain,
            is_lock_step,
        };
        let sent = line_of(&begin).and_then(|line| orders.write_all(&line));
        let reports = reports_of(lines, is_lock_step);
        thread::spawn(move || {
            for line in BufReader::new(words).lines().map_while(Result::ok) {
                tracing::debug!(line, "from ur-rtde");
            }
        });
        let (clock, hand) = (is_lock_step && !params.clock.is_manual())
            .then(Clock::manual)
            .unzip();
        let clock = clock.unwrap_or_else(|| params.clock.clone());
        let shared = Arc::new(SharedGuard::new(params.deadlines, clock));
        let id = child.id();
        let guard = Guard {
            child,
            host: params.host.clone(),
            dashboard,
            shared: shared.clone(),
            hand,
        };
        let guard = thread::spawn(move || {
            be_in_time(is_lock_step);
            guard.watch(&reports)
        });
        let client = Self {
            shared,
            orders: Some(orders),
            guard: Some(guard),
            halt: None,
            is_lock_step,
            id,
        };
        sent.map_err(|error| UrError::Client(format!("does not listen: {error}")))?;
        client.await_ready(params)?;
        Ok(client)
    }

    /// Waits until the arm takes commands.
    fn await_ready(&self, params: &UrParams) -> Result<(), UrError> {
        let known = self.wait(params.deadlines.connect + params.deadlines.beat, |known| {
            known.is_ready
        });
        match known.broken.clone() {
            None if known.is_ready => Ok(()),
            Some(ClientLoss::Wheel(reason)) => Err(UrError::Wheel {
                site_packages: params.site_packages.clone(),
                reason,
            }),
            Some(ClientLoss::Tool(reason)) => Err(UrError::Tool(reason)),
            Some(ClientLoss::Arm(ArmError::Client { reason })) => Err(UrError::Client(reason)),
            Some(ClientLoss::Arm(error)) => {
                Err(UrError::Client(format!("lost the arm at once: {error}")))
            }
            None => Err(UrError::Client("says nothing".to_owned())),
        }
    }

    /// Waits for a condition, a broken client, or the deadline.
    fn wait(
        &self,
        deadline: Duration,
        is_so: impl Fn(&GuardState) -> bool,
    ) -> MutexGuard<'_, GuardState> {
        let SharedGuard { changed, clock, .. } = &*self.shared;
        clock.wait_while(changed, self.shared.known(), deadline, |known| {
            known.broken.is_none() && !is_so(known)
        })
    }

    /// The oldest state not yet returned.
    pub fn next_state(&self, deadline: Duration) -> Result<UrState, ArmError> {
        let has_ended = |known: &GuardState| known.has_ended(self.shared.clock.now());
        let mut known = self.wait(deadline, |known| {
            !known.states.is_empty() || has_ended(known)
        });
        if let Some(broken) = &known.broken {
            return Err(broken.error());
        }
        if has_ended(&known) {
            return Err(known.ended());
        }
        let silent_ms = deadline.as_millis() as u64;
        known.states.pop_front().ok_or(ArmError::Lost { silent_ms })
    }

    /// Stamp of the newest state, returned or not, and its lateness, s.
    pub fn newest(&self) -> (f64, f64) {
        let known = self.shared.known();
        (known.newest_s, known.lateness.newest_s())
    }

    /// Lateness of the states of the first second; `None`: the second is not over.
    pub fn late_at_start(&self) -> Option<StartLateness> {
        self.shared.known().lateness.at_start()
    }

    /// Discards the waiting states.
    pub fn forget_states(&self) {
        self.shared.known().states.clear();
    }

    /// Sends an order without waiting for it.
    pub fn order(&mut self, what: OrderAction) -> Result<u64, ArmError> {
        let mut known = self.shared.known();
        if let Some(broken) = &known.broken {
            return Err(broken.error());
        }
        let number = known.send(&what, self.shared.clock.now());
        drop(known);
        let sent = match &mut self.orders {
            Some(orders) => {
                line_of(&Order { number, what }).and_then(|line| orders.write_all(&line))
            }
            None => Err(std::io::ErrorKind::BrokenPipe.into()),
        };
        if sent.is_err() {
            // the guard notices the end, and knows the reason
            let known = self.wait(ZEROING, |_| false);
            return Err(known
                .broken
                .as_ref()
                .map_or(ArmError::Lost { silent_ms: 0 }, ClientLoss::error));
        }
        Ok(number)
    }

    /// Sends an order and waits for its completion.
    pub fn ask(&mut self, what: OrderAction) -> Result<(), ArmError> {
        let number = self.order(what)?;
        let known = self.wait(ZEROING + FAREWELL, |known| known.done >= number);
        known
            .broken
            .as_ref()
            .map_or(Ok(()), |broken| Err(broken.error()))
    }

    /// Ends the process and the program of the controller; later calls return the reason.
    pub fn close(&mut self, reason: &str) {
        self.shared.known().close(self.shared.clock.now());
        // at the end of its stdin the process brakes, ends the program of the controller and itself
        self.orders = None;
        self.end_guard();
        self.shared.ask_no_more();
        let closed = || {
            ClientLoss::Arm(ArmError::Client {
                reason: reason.to_owned(),
            })
        };
        self.shared.known().broken.get_or_insert_with(closed);
    }

    /// How the guard stopped the arm; `None`: it did not have to.
    pub fn halt(&mut self) -> Option<Halt> {
        if self.shared.known().broken.is_some() {
            self.end_guard();
        }
        self.halt
    }

    fn end_guard(&mut self) {
        if let Some(guard) = self.guard.take() {
            // a failed guard has no result
            self.halt = guard.join().ok().flatten();
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.close("was let go");
    }
}

fn line_of(what: &impl serde::Serialize) -> std::io::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(what)?;
    line.push(b'\n');
    Ok(line)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::ur::dashboard::tests::listen;

    /// Time is the controller's only if both say so: a controller that could lift the deadlines by
    /// its greeting alone would be without a guard.
    #[test]
    fn a_greeting_alone_starts_no_lock_step() {
        let folder = tempfile::tempdir().unwrap();
        let (program, first_line) = (
            folder.path().join("client"),
            folder.path().join("first_line"),
        );
        fs::write(
            &program,
            format!("#!/bin/sh\nhead -n 1 > {}\n", first_line.display()),
        )
        .unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        for (is_allowed, greeting) in [
            (false, "in lock step"),
            (true, "Universal Robots Dashboard Server"),
            (true, "a test in lock step"),
        ] {
            let (host, listener) = listen();
            let greets = thread::spawn(move || {
                let (mut socket, _) = listener.accept().unwrap();
                writeln!(socket, "Connected: {greeting}").unwrap();
                socket
            });
            let deadline = Duration::from_secs(60);
            let dashboard = Dashboard::connect(&host, deadline).unwrap();
            let params = UrParams {
                program: program.clone(),
                is_lock_step: is_allowed,
                ..UrParams::new(&host, "none")
            };
            let ended = Client::start(&params, [5, 15], dashboard).err().unwrap();
            assert!(
                matches!(&ended, UrError::Client(reason) if reason.contains("has ended")),
                "{ended}"
            );
            let begin: serde_json::Value =
                serde_json::from_slice(&fs::read(&first_line).unwrap()).unwrap();
            let is_both = is_allowed && greeting.ends_with("in lock step");
            assert_eq!(
                begin["is_lock_step"], is_both,
                "allowed: {is_allowed}, greeted: {greeting}"
            );
            drop(greets.join().unwrap());
        }
    }
}
