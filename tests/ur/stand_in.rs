//! Starts the stand-in for a controller, makes its faults, reads its record, and ends it.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use touchup::robot::Limits;
use touchup::robot::ur::{UrArm, UrParams};

/// Ports that the library has fixed.
const PORTS: [u16; 3] = [30004, 29999, 30003];
/// The record is read again until it holds what is waited for, or this is over.
const PATIENCE: Duration = Duration::from_secs(10);

/// One arm at a time: what is tested is time.
static ONE_ARM: Mutex<()> = Mutex::new(());
static NEXT: AtomicU8 = AtomicU8::new(2);

/// The folder of packages with ur-rtde, made once by `touchup ur setup`; `None` is said, as a test that could not run.
pub fn packages(test: &str) -> Option<PathBuf> {
    static PACKAGES: LazyLock<Result<PathBuf, String>> = LazyLock::new(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ur");
        let setup = Command::new(env!("CARGO_BIN_EXE_touchup")).args(["ur", "setup"]).arg(folder).output().unwrap();
        let told = String::from_utf8(setup.stdout).unwrap();
        match told.trim().strip_prefix("site_packages: ") {
            Some(packages) if setup.status.success() => Ok(packages.into()),
            _ => Err(String::from_utf8_lossy(&setup.stderr).trim().to_owned()),
        }
    });
    static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let say = |reason: &String| {
        let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
        // once for a test, which may ask again
        if !told.iter().any(|told| told == test) {
            println!("SKIPPED: {test}: no ur-rtde: {reason}");
            told.push(test.to_owned());
        }
    };
    PACKAGES.as_ref().inspect_err(|reason| say(reason)).ok().cloned()
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
    /// what happened
    pub event: String,
}

/// A stand-in on an address of its own.
pub struct StandIn {
    child: Child,
    faults: Option<ChildStdin>,
    record: tempfile::NamedTempFile,
    pub address: String,
    _one: MutexGuard<'static, ()>,
}

impl StandIn {
    /// - `arguments`: further ones.
    pub fn start(arguments: &[&str]) -> Self {
        let one = ONE_ARM.lock().unwrap_or_else(PoisonError::into_inner);
        let program = std::env::current_exe().unwrap().parent().unwrap().join("../examples/ur_controller");
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
        let mut ready = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut ready).unwrap();
        assert_eq!(ready, "ready\n");
        let faults = child.stdin.take();
        Self { child, faults, record, address, _one: one }
    }

    /// Makes a fault; `mark …` only writes a line into the record.
    pub fn tell(&mut self, fault: &str) {
        writeln!(self.faults.as_mut().unwrap(), "{fault}").unwrap();
    }

    /// Ends it as a power cut would.
    pub fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub fn params(&self, packages: &Path) -> UrParams {
        UrParams { program: env!("CARGO_BIN_EXE_touchup").into(), ..UrParams::new(&self.address, packages) }
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
                Line { time, place, speed, turn, force, event: words.next().unwrap().to_owned() }
            })
            .collect()
    }

    /// The record from an event on, once it reaches some seconds beyond.
    pub fn record_after(&self, event: &str, seconds: f64) -> Vec<Line> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let record = self.record();
            if let Some(at) = record.iter().position(|line| line.event.contains(event))
                && record[record.len() - 1].time > record[at].time + seconds
            {
                return record[at..].to_vec();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("{event} is not in the record, or not {seconds} s of what came then");
    }

    /// From an event to the last motion, s; and it moved before.
    pub fn stood_after(&self, event: &str) -> f64 {
        let record = self.record_after(event, 0.6);
        assert!(record[0].speed > 1e-3, "{event} in mid-move: {:?}", record[0]);
        let moves = |line: &&Line| line.speed > 0.0 || line.turn > 0.0;
        record.iter().rev().find(moves).map_or(0.0, |line| line.time - record[0].time)
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        // it may have been killed by its test
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn free_address() -> String {
    for _ in 0..100 {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let address = format!("127.0.{}.{}", std::process::id() % 250 + 1, number);
        if PORTS.iter().all(|port| TcpListener::bind((address.as_str(), *port)).is_ok()) {
            return address;
        }
    }
    panic!("no loopback address has the ports of a controller free");
}

/// Around the plate of the stand-in.
pub fn limits() -> Limits {
    Limits {
        lowest: Point3::new(-0.6, -0.3, 0.0),
        highest: Point3::new(-0.2, 0.2, 0.4),
        acceleration: 1.5,
        ..Limits::default()
    }
}
