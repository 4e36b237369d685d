//! Starts the stand-in for a controller, makes its faults, reads its record, and ends it.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use touchup::probing::arm::Limits;
use touchup::ur::{UrArm, UrParams};

/// Ports that the library has fixed.
const PORTS: [u16; 3] = [30004, 29999, 30003];
/// Longest wait for an entry of the record.
const NEVER: Duration = Duration::from_secs(60);
/// Periods without motion after which the arm is at rest.
const STANDING: usize = 20;

static NEXT: AtomicU8 = AtomicU8::new(2);

/// The folder of packages with ur-rtde in it, or why there is none: `touchup ur setup` makes it for
/// the first process that asks, while others wait.
pub fn packages() -> Result<&'static Path, &'static str> {
    static PACKAGES: LazyLock<Result<PathBuf, String>> = LazyLock::new(|| {
        let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let lock = File::create(temporary.join("ur.lock")).unwrap();
        lock.lock().unwrap();
        let made = temporary.join("ur.site_packages");
        if let Ok(packages) = std::fs::read_to_string(&made) {
            return Ok(packages.into());
        }
        let setup = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
            .args(["ur", "setup"])
            .arg(temporary.join("ur"))
            .output()
            .unwrap();
        let output = String::from_utf8(setup.stdout).unwrap();
        match output.trim().strip_prefix("site_packages: ") {
            Some(packages) if setup.status.success() => {
                std::fs::write(made, packages).unwrap();
                Ok(packages.into())
            }
            _ => Err(String::from_utf8_lossy(&setup.stderr).trim().to_owned()),
        }
    });
    PACKAGES.as_deref().map_err(String::as_str)
}

/// One period of the arm, as the stand-in wrote it down.
#[derive(Clone, Debug)]
pub struct Line {
    /// s of its own clock
    pub time: f64,
    /// of the tip in B, m
    pub place: Vector3<f64>,
    /// m/s
    pub speed: f64,
    /// rad/s
    pub turn: f64,
    /// of the part on the tip, N
    pub force: f64,
    /// name of the event
    pub event: String,
}

/// A stand-in on an address of its own.
pub struct StandIn {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    record: tempfile::NamedTempFile,
    pub address: String,
}

impl StandIn {
    /// - `arguments`: further ones.
    pub fn start(arguments: &[&str]) -> Self {
        let program = std::env::current_exe()
            .unwrap()
            .parent()
            .unwrap()
            .join("../examples/ur_controller");
        assert!(
            program.exists(),
            "with --test alone, first: cargo build --features ur --example ur_controller, of the same profile"
        );
        let address = free_address();
        let record = tempfile::NamedTempFile::new().unwrap();
        let mut child = Command::new(program)
            .arg(&address)
            .arg("--record")
            .arg(record.path())
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (orders, answers) = (
            child.stdin.take().unwrap(),
            BufReader::new(child.stdout.take().unwrap()),
        );
        let mut stand_in = Self {
            child,
            orders,
            answers,
            record,
            address,
        };
        assert_eq!(stand_in.answer(), "ready");
        stand_in
    }

    fn answer(&mut self) -> String {
        let mut answer = String::new();
        self.answers.read_line(&mut answer).unwrap();
        answer.trim_end().to_owned()
    }

    /// Makes a fault, and returns when it is there; `mark …` only writes a line into the record.
    pub fn send(&mut self, fault: &str) {
        writeln!(self.orders, "{fault}").unwrap();
        assert_eq!(self.answer(), fault);
    }

    /// Lets some time of the controller pass, independent of its client, ms.
    pub fn run(&mut self, ms: u32) {
        self.send(&format!("run {ms}"));
    }

    /// Ends it as a power cut would.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub fn params(&self, packages: &Path) -> UrParams {
        UrParams {
            program: env!("CARGO_BIN_EXE_touchup-tested").into(),
            is_lock_step: true,
            ..UrParams::new(&self.address, packages)
        }
    }

    pub fn connect(&self, packages: &Path) -> UrArm {
        UrArm::connect(&self.params(packages)).unwrap()
    }

    /// All that it has written down.
    pub fn record(&self) -> Vec<Line> {
        let text = std::fs::read_to_string(self.record.path()).unwrap();
        // the last line may be half written
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        whole
            .lines()
            .skip(1)
            .map(|line| {
                let mut words = line.splitn(8, ',');
                let mut number = || words.next().unwrap().parse::<f64>().unwrap();
                let (time, place) = (number(), Vector3::new(number(), number(), number()));
                let (speed, turn, force) = (number(), number(), number());
                Line {
                    time,
                    place,
                    speed,
                    turn,
                    force,
                    event: words.next().unwrap().to_owned(),
                }
            })
            .collect()
    }

    /// Waits for an entry of the record.
    fn wait<T>(&self, what: &str, find: impl Fn(&[Line]) -> Option<T>) -> T {
        let begun = Instant::now();
        while begun.elapsed() < NEVER {
            if let Some(found) = find(&self.record()) {
                return found;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let record = self.record();
        let events: Vec<_> = record
            .iter()
            .filter(|line| !line.event.is_empty())
            .collect();
        panic!(
            "{what} is never in the record, which ends at {:?}: {events:#?}",
            record.last()
        );
    }

    /// Waits for an event; the record from there on.
    pub fn record_after(&self, event: &str) -> Vec<Line> {
        self.wait(event, |record| {
            Some(record[position(record, event)?..].to_vec())
        })
    }

    /// The record from one event up to another that comes after it.
    pub fn record_between(&self, event: &str, end: &str) -> Vec<Line> {
        self.wait(end, |record| {
            let from = &record[position(record, event)?..];
            Some(from[..=position(from, end)?].to_vec())
        })
    }

    /// From the last such event, which is in mid-move, to the last motion before the arm is at
    /// rest, s.
    pub fn stood_after(&self, event: &str) -> f64 {
        let moves = |line: &Line| line.speed > 0.0 || line.turn > 0.0;
        let (at_event, stood) = self.wait(&format!("an arm at rest after `{event}`"), |record| {
            let at = record.iter().rposition(|line| line.event.contains(event))?;
            let still = record[at..]
                .windows(STANDING)
                .position(|lines| !lines.iter().any(moves))?;
            let last = record[at + still.saturating_sub(1)].time;
            Some((record[at].clone(), last - record[at].time))
        });
        assert!(at_event.speed > 1e-3, "{event} in mid-move: {at_event:?}");
        stood
    }

    /// As [`Self::stood_after`], which has to be within some seconds.
    pub fn stands_in(&self, event: &str, seconds: f64) {
        let stood = self.stood_after(event);
        println!(
            "{event}: at rest after {:.0} ms of at most {:.0}",
            stood * 1e3,
            seconds * 1e3
        );
        assert!(stood < seconds, "{event}: at rest after {stood} s");
    }
}

fn position(record: &[Line], event: &str) -> Option<usize> {
    record.iter().position(|line| line.event.contains(event))
}

impl Drop for StandIn {
    fn drop(&mut self) {
        // its test may have killed it
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn free_address() -> String {
    for _ in 0..100 {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let address = format!("127.0.{}.{}", std::process::id() % 250 + 1, number);
        if PORTS
            .iter()
            .all(|port| TcpListener::bind((address.as_str(), *port)).is_ok())
        {
            return address;
        }
    }
    panic!("no loopback address has the ports of a controller free");
}

/// Around the plate of the stand-in; all else as shipped.
pub fn limits() -> Limits {
    Limits {
        lowest: Point3::new(-0.6, -0.3, 0.0),
        highest: Point3::new(-0.2, 0.2, 0.4),
        ..Limits::default()
    }
}
