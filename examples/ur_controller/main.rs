//! A stand-in for the controller of a UR5e, to test against: RTDE, dashboard and script ports, and an arm that touches a part.
//!
//! cargo run --features ur --example ur_controller -- ADDRESS [--record FILE] [--version 5.15.0] [--start-mm X,Y,Z]
//!     [--payload KG,X,Y,Z]
//!
//! It does what ur_rtde 1.6.5 and its program see of a controller; how a real one stops, presses and watches is modelled, not
//! copied. Lines on stdin make faults: drop, undash, mute, silent, deaf, stuck, hung, pause, resume, open, shut, unplug, die,
//! protective, operator, release, halt, off, local, spike N, mend, mark TEXT. It ends when stdin does.
//!
//! It has a clock of its own, in lock step with its client: while a program of the client plays, a period passes when the client has
//! sent its next order, so a machine that is late changes nothing. No period is shorter than on a robot; without a program the clock
//! is that of the machine. A line `run MS` lets so much time pass whatever the client says. States, motion, safety, watchdog and
//! record go by this clock. Each line is repeated on stdout when it has been done.

mod body;
mod controller;
mod dashboard;
mod record;
mod rtde;

use std::io::{BufRead, BufReader, stdin};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use nalgebra::{Point3, Vector3};
use touchup::sim::{ArmParams, MeshSurface, Plate, WEIGHTLESS};
use touchup::stylus::Payload;

use body::{Body, PERIOD};
use controller::{Controller, Safety};

const DASHBOARD: u16 = 29999;
const SCRIPT: u16 = 30003;
const RTDE: u16 = 30004;
/// How often it looks whether a period may pass.
const LOOK: Duration = Duration::from_micros(500);
/// The holes of the part are polygons within this of their circles, m.
const CHORD: f64 = 2e-6;

/// What hangs on the flange: the payload that the client states for a probe by default.
const PROBE: Payload = Payload { mass: 0.25, p_sc: Vector3::new(0.0, 0.0, 0.05), ..WEIGHTLESS };

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
    let mut found = Arguments { address, record: None, version: [5, 15, 0], start, payload: PROBE };
    while let Some(flag) = words.next() {
        let value = words.next().with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--record" => found.record = Some(value.into()),
            "--version" => {
                let parts: Result<Vec<u32>, _> = value.split('.').map(str::parse).collect();
                found.version = parts?.try_into().map_err(|_| anyhow::anyhow!("--version takes three numbers"))?;
            }
            "--start-mm" => {
                let parts: Result<Vec<f64>, _> = value.split(',').map(str::parse).collect();
                let parts: [f64; 3] =
                    parts?.try_into().map_err(|_| anyhow::anyhow!("--start-mm takes three numbers"))?;
                found.start = Point3::from(parts.map(|mm| mm * 1e-3));
            }
            "--payload" => {
                let parts: Result<Vec<f64>, _> = value.split(',').map(str::parse).collect();
                let [mass, x, y, z]: [f64; 4] =
                    parts?.try_into().map_err(|_| anyhow::anyhow!("--payload takes kg and three numbers in mm"))?;
                found.payload = Payload { mass, p_sc: Vector3::new(x, y, z) * 1e-3, ..WEIGHTLESS };
            }
            _ => anyhow::bail!("{flag} is unknown"),
        }
    }
    Ok(found)
}

fn main() -> anyhow::Result<()> {
    let Arguments { address, record, version, start, payload } = arguments()?;
    let mesh = Plate::default().mesh(CHORD)?;
    let surface = MeshSurface::new(&mesh)?;
    let body = Body::new(&surface, ArmParams { payload, ..ArmParams::default() }, start)?;
    let controller = Mutex::new(Controller::new(body, version, record::Record::new(record.as_deref())?));
    let listen = |port| TcpListener::bind((address.as_str(), port)).with_context(|| format!("{address}:{port}"));
    let (rtde, dashboard, script) = (listen(RTDE)?, listen(DASHBOARD)?, listen(SCRIPT)?);
    println!("ready");
    thread::scope(|scope| {
        let (controller, address) = (&controller, &address);
        scope.spawn(move || accept(rtde, controller, |socket, number| rtde::serve(socket, number, controller)));
        scope.spawn(move || accept(dashboard, controller, |socket, _| dashboard::serve(socket, controller)));
        scope.spawn(move || accept(script, controller, |socket, _| take_programs(socket, controller)));
        scope.spawn(move || {
            for line in stdin().lines().map_while(Result::ok) {
                if let Ok(mut controller) = controller.lock() {
                    fail(&mut controller, &line);
                }
                println!("{line}");
            }
            // every other thread waits for somebody
            eprintln!("ur_controller: {address} ends");
            std::process::exit(0);
        });
        let period = Duration::from_secs_f64(PERIOD);
        let mut last = Instant::now();
        loop {
            // a machine that was late is late for good: a period is never made up for
            thread::sleep((last + period).saturating_duration_since(Instant::now()).max(LOOK));
            let Ok(mut controller) = controller.lock() else { continue };
            if controller.may_tick() {
                last = Instant::now();
                controller.tick();
            }
        }
    })
}

/// Serves each client on a thread of its own.
fn accept(
    listener: TcpListener,
    controller: &Mutex<Controller>,
    serve: impl Fn(TcpStream, u64) -> anyhow::Result<()> + Sync,
) {
    thread::scope(|scope| {
        for (number, socket) in (0..).zip(listener.incoming()) {
            let (Ok(socket), Ok(mut controller)) = (socket, controller.lock()) else { continue };
            let Ok(copy) = socket.try_clone() else { continue };
            if controller.faults.is_dead {
                continue;
            }
            controller.sockets.push(copy);
            let serve = &serve;
            // small packets, each wanted at once; a client that goes in the middle of an answer is no matter
            scope.spawn(move || socket.set_nodelay(true).is_ok_and(|()| serve(socket, number).is_ok()));
        }
    });
}

/// A program ends with a line `end`.
fn take_programs(socket: TcpStream, controller: &Mutex<Controller>) -> anyhow::Result<()> {
    let mut program = String::new();
    for line in BufReader::new(socket).lines() {
        let line = line?;
        program += &line;
        program.push('\n');
        if line == "end" {
            let mut controller = controller.lock().map_err(|_| anyhow::anyhow!("the controller has ended"))?;
            controller.load(&std::mem::take(&mut program));
        }
    }
    Ok(())
}

/// What a line on stdin asks for.
fn fail(controller: &mut Controller, line: &str) {
    controller.record.event(line);
    match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["drop"] => controller.cut(&[RTDE]),
        ["silent"] => controller.faults.is_silent = true,
        ["deaf"] => controller.faults.is_deaf = true,
        ["stuck"] => controller.faults.is_stuck = true,
        ["hung"] => controller.faults.is_hung = true,
        ["mute"] => controller.faults.is_mute = true,
        ["pause"] => controller.pause("at the panel"),
        ["resume"] => controller.resume(),
        ["open"] => {
            controller.safety = Safety::Safeguard;
            controller.pause("a door is open");
        }
        // with the automatic resume that a cell may have
        ["shut"] => {
            controller.safety = Safety::Normal;
            controller.resume();
        }
        ["undash"] => controller.cut(&[DASHBOARD]),
        ["unplug"] => controller.faults.is_unplugged = true,
        ["die"] => {
            controller.faults.is_dead = true;
            controller.cut(&[RTDE, DASHBOARD, SCRIPT]);
            // without power the brakes close
            controller.stop_program("no power");
        }
        ["protective"] => controller.stop_for(Safety::Protective, "a safety plane"),
        ["operator"] => controller.stop_for(Safety::Emergency, "the button"),
        ["release"] => controller.safety = Safety::Normal,
        ["off"] => controller.is_powered = false,
        ["local"] => controller.is_remote = false,
        ["halt"] => controller.stop_program("at the panel"),
        ["run", ms] => controller.grant(ms.parse().unwrap_or(0.0) * 1e-3),
        ["spike", force] => controller.body.hit(force.parse().unwrap_or(0.0)),
        ["mend", ..] => controller.faults = Default::default(),
        ["mark", ..] => {}
        _ => eprintln!("ur_controller: {line}: unknown"),
    }
}
