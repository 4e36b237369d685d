//! A stand-in for the controller of a UR5e, to test against: RTDE, dashboard and script ports, and
//! an arm that touches a part.
//!
//! cargo run --features ur --example ur_controller -- ADDRESS [--record FILE] [--version 5.15.0]
//!     [--start-mm X,Y,Z] [--payload KG,X,Y,Z]
//!
//! It covers the part of a controller that ur_rtde 1.6.5 and its program see; a model stands in for
//! the stopping, pressing and watching of a real one. Lines on stdin make faults: drop, undash,
//! mute, silent, deaf, stuck, hung, slow PERIODS, tired, late states MS, late orders MS, rate HZ,
//! slider PERCENT, reduced, full, watchdog counts, pause, resume, open, shut, unplug, die,
//! protective, operator, release, halt, off, local, spike N, drift N_PER_S, noise N, payload KG,
//! raise MM, mend, mark TEXT. It ends with stdin.
//!
//! It has a clock of its own, in lock step with its client: while a program of the client plays, a
//! period passes when the client has sent its next order, so a slow machine changes nothing. No
//! period is shorter than on a robot; without a program the clock is that of the machine. A line
//! `run MS` lets MS milliseconds pass regardless of the client. States, motion, safety, watchdog
//! and record go by this clock. Stdout repeats each line after its execution.

mod dashboard;
mod model;
mod rtde;

use std::io::{BufRead, BufReader, stdin};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use nalgebra::{Point3, Vector3};
use touchup_method::stylus::Payload;
use touchup_sim::{ArmParams, MeshSurface, Plate, WEIGHTLESS};

use model::body::{Body, PERIOD};
use model::controller::Controller;
use model::panel::happen;
use model::record::Record;
use rtde::Stream;

const DASHBOARD: u16 = 29999;
const SCRIPT: u16 = 30003;
const RTDE: u16 = 30004;
/// Interval of the checks for a period.
const LOOK: Duration = Duration::from_micros(500);
/// The holes of the part are polygons within this of their circles, m.
const CHORD: f64 = 2e-6;

/// Payload on the flange: the one that the client states for a probe by default.
const PROBE: Payload = Payload {
    mass: 0.25,
    p_sc: Vector3::new(0.0, 0.0, 0.05),
    ..WEIGHTLESS
};

struct Arguments {
    address: String,
    record: Option<PathBuf>,
    version: [u32; 3],
    start: Point3<f64>,
    payload: Payload,
}

fn arguments() -> anyhow::Result<Arguments> {
    let mut words = std::env::args().skip(1);
    let address = words.next().context(
        "usage: ur_controller ADDRESS [--record FILE] [--version V] [--start-mm X,Y,Z] [--payload KG,X,Y,Z]",
    )?;
    let start = Point3::new(45e-3, 8e-3, 25e-3);
    let mut found = Arguments {
        address,
        record: None,
        version: [5, 15, 0],
        start,
        payload: PROBE,
    };
    while let Some(flag) = words.next() {
        let value = words
            .next()
            .with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--record" => found.record = Some(value.into()),
            "--version" => {
                let parts: Result<Vec<u32>, _> = value.split('.').map(str::parse).collect();
                found.version = parts?
                    .try_into()
                    .map_err(|_| anyhow::anyhow!("--version takes three numbers"))?;
            }
            "--start-mm" => {
                let parts: Result<Vec<f64>, _> = value.split(',').map(str::parse).collect();
                let parts: [f64; 3] = parts?
                    .try_into()
                    .map_err(|_| anyhow::anyhow!("--start-mm takes three numbers"))?;
                found.start = Point3::from(parts.map(|mm| mm * 1e-3));
            }
            "--payload" => {
                let parts: Result<Vec<f64>, _> = value.split(',').map(str::parse).collect();
                let [mass, x, y, z]: [f64; 4] = parts?
                    .try_into()
                    .map_err(|_| anyhow::anyhow!("--payload takes kg and three numbers in mm"))?;
                found.payload = Payload {
                    mass,
                    p_sc: Vector3::new(x, y, z) * 1e-3,
                    ..WEIGHTLESS
                };
            }
            _ => anyhow::bail!("{flag} is unknown"),
        }
    }
    Ok(found)
}

#[expect(clippy::too_many_lines)]
fn main() -> anyhow::Result<()> {
    let Arguments {
        address,
        record,
        version,
        start,
        payload,
    } = arguments()?;
    let mesh = Plate::default().mesh(CHORD)?;
    let surface = MeshSurface::new(&mesh)?;
    let body = Body::new(
        &surface,
        ArmParams {
            payload,
            ..ArmParams::default()
        },
        start,
    )?;
    let controller = Controller::new(body, version, Record::new(record.as_deref())?);
    let served = Mutex::new(Served {
        controller,
        streams: Vec::new(),
        sockets: Vec::new(),
    });
    let listen = |port| {
        TcpListener::bind((address.as_str(), port)).with_context(|| format!("{address}:{port}"))
    };
    let (rtde, dashboard, script) = (listen(RTDE)?, listen(DASHBOARD)?, listen(SCRIPT)?);
    println!("ready");
    thread::scope(|scope| {
        let (served, address) = (&served, &address);
        scope.spawn(move || {
            accept(rtde, served, |socket, number| {
                rtde::serve(socket, number, served)
            })
        });
        scope.spawn(move || {
            accept(dashboard, served, |socket, _| {
                dashboard::serve(socket, served)
            })
        });
        scope.spawn(move || accept(script, served, |socket, _| take_programs(socket, served)));
        scope.spawn(move || {
            for line in stdin().lines().map_while(Result::ok) {
                if let Ok(mut served) = served.lock() {
                    served.happen(&line);
                }
                println!("{line}");
            }
            // every other thread blocks on its peer
            eprintln!("ur_controller: {address} ends");
            std::process::exit(0);
        });
        let period = Duration::from_secs_f64(PERIOD);
        let mut last = Instant::now();
        loop {
            // a late machine stays late: the clock never makes up for a period
            thread::sleep(
                (last + period)
                    .saturating_duration_since(Instant::now())
                    .max(LOOK),
            );
            let Ok(mut served) = served.lock() else {
                continue;
            };
            if served.controller.may_tick() {
                last = Instant::now();
                served.tick();
            }
        }
    })
}

/// Serves each client on a thread of its own.
fn accept(
    listener: TcpListener,
    served: &Mutex<Served>,
    serve: impl Fn(TcpStream, u64) -> anyhow::Result<()> + Sync,
) {
    thread::scope(|scope| {
        for (number, socket) in (0..).zip(listener.incoming()) {
            let (Ok(socket), Ok(mut served)) = (socket, served.lock()) else {
                continue;
            };
            let Ok(copy) = socket.try_clone() else {
                continue;
            };
            if served.controller.faults.is_dead {
                continue;
            }
            served.sockets.push(copy);
            let serve = &serve;
            // small packets, each wanted at once; a client that goes in the middle of an answer is
            // no matter
            scope.spawn(move || {
                socket
                    .set_nodelay(true)
                    .is_ok_and(|()| serve(socket, number).is_ok())
            });
        }
    });
}

/// A program ends with a line `end`.
fn take_programs(socket: TcpStream, served: &Mutex<Served>) -> anyhow::Result<()> {
    let mut program = String::new();
    for line in BufReader::new(socket).lines() {
        let line = line?;
        program += &line;
        program.push('\n');
        if line == "end" {
            let mut served = served
                .lock()
                .map_err(|_| anyhow::anyhow!("the controller has ended"))?;
            served.controller.load(&std::mem::take(&mut program));
        }
    }
    Ok(())
}

/// The controller with its connections.
struct Served<'a> {
    controller: Controller<'a>,
    streams: Vec<Stream>,
    /// all of them, of all ports
    sockets: Vec<TcpStream>,
}

impl Served<'_> {
    fn tick(&mut self) {
        self.controller.tick();
        while let Some(states) = self.controller.sent() {
            self.streams.retain_mut(|stream| stream.send(&states));
        }
    }

    /// Executes a line of stdin.
    fn happen(&mut self, line: &str) {
        happen(&mut self.controller, line);
        match line {
            "drop" => self.cut(&[RTDE]),
            "undash" => self.cut(&[DASHBOARD]),
            "die" => self.cut(&[RTDE, DASHBOARD, SCRIPT]),
            _ => {}
        }
    }

    /// Ends all connections that are there now.
    fn cut(&mut self, ports: &[u16]) {
        let is_cut = |socket: &TcpStream| {
            socket
                .local_addr()
                .is_ok_and(|own| ports.contains(&own.port()))
        };
        for socket in self.sockets.extract_if(.., |socket| is_cut(socket)) {
            // one that has ended already is as good
            let _ = socket.shutdown(Shutdown::Both);
        }
    }
}
