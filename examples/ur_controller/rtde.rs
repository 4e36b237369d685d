//! The RTDE port: packets of u16 size, u8 type and body, big endian.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Mutex;

use crate::Served;
use crate::model::controller::{Controller, Written};
use crate::model::states::States;

const OUTPUTS: u8 = b'O';
const INPUTS: u8 = b'I';
const DATA: u8 = b'U';

/// A client that subscribed to states.
pub struct Stream {
    socket: TcpStream,
    names: Vec<String>,
}

impl Stream {
    /// Whether the client is still there.
    pub fn send(&mut self, states: &States) -> bool {
        let mut body = vec![1];
        self.names
            .iter()
            .filter_map(|name| value(states, name))
            .for_each(|(_, bytes)| body.extend(bytes));
        self.socket.write_all(&packet(DATA, &body)).is_ok()
    }
}

fn packet(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = Vec::with_capacity(body.len() + 3);
    packet.extend((body.len() as u16 + 3).to_be_bytes());
    packet.push(kind);
    packet.extend(body);
    packet
}

/// Type and bytes of a variable; `None`: unknown here.
fn value(states: &States, name: &str) -> Option<(&'static str, Vec<u8>)> {
    let six = |values: &[f64; 6]| {
        (
            "VECTOR6D",
            values.iter().flat_map(|v| v.to_be_bytes()).collect(),
        )
    };
    let unsigned = |value: u32| ("UINT32", value.to_be_bytes().to_vec());
    let register = |prefix: &str| {
        name.strip_prefix(prefix)?
            .parse::<usize>()
            .ok()
            .filter(|i| *i < 48)
    };
    Some(match name {
        "timestamp" => ("DOUBLE", states.time.to_be_bytes().to_vec()),
        "actual_q" => six(&states.q),
        "actual_TCP_pose" => six(&states.pose),
        "actual_TCP_speed" => six(&states.speed),
        "actual_TCP_force" => six(&states.force),
        "ft_raw_wrench" => six(&states.raw),
        "safety_status_bits" => unsigned(states.safety_bits),
        "robot_status_bits" => unsigned(1 | u32::from(states.is_playing) << 1),
        "runtime_state" if states.is_paused => unsigned(4),
        "runtime_state" => unsigned(if states.is_playing { 2 } else { 1 }),
        "target_speed_fraction" => ("DOUBLE", states.speed_fraction.to_be_bytes().to_vec()),
        "robot_mode" => ("INT32", 7i32.to_be_bytes().to_vec()),
        _ => match (
            register("output_int_register_"),
            register("output_double_register_"),
        ) {
            (Some(at), _) => ("INT32", states.ints[at].to_be_bytes().to_vec()),
            (_, Some(at)) => ("DOUBLE", states.doubles[at].to_be_bytes().to_vec()),
            _ => return None,
        },
    })
}

/// A register that a client may write.
#[derive(Clone, Copy)]
enum Input {
    Int(usize),
    Double(usize),
    /// read over
    Skipped(usize),
}

impl Input {
    fn of(name: &str) -> Option<(Self, &'static str)> {
        let number = |prefix: &str| {
            name.strip_prefix(prefix)?
                .parse::<usize>()
                .ok()
                .filter(|i| *i < 48)
        };
        match (
            number("input_int_register_"),
            number("input_double_register_"),
        ) {
            (Some(at), _) => Some((Self::Int(at), "INT32")),
            (_, Some(at)) => Some((Self::Double(at), "DOUBLE")),
            _ => (name == "external_force_torque").then_some((Self::Skipped(48), "VECTOR6D")),
        }
    }
}

/// One client, until it goes.
#[expect(clippy::too_many_lines)]
pub fn serve(mut socket: TcpStream, number: u64, served: &Mutex<Served>) -> anyhow::Result<()> {
    let (mut names, mut recipes): (Vec<String>, Vec<Vec<Input>>) = (Vec::new(), Vec::new());
    let mut head = [0; 3];
    while socket.read_exact(&mut head).is_ok() {
        let mut body = vec![0; (u16::from_be_bytes([head[0], head[1]]) as usize).saturating_sub(3)];
        if socket.read_exact(&mut body).is_err() {
            break;
        }
        let mut served = served
            .lock()
            .map_err(|_| anyhow::anyhow!("the controller has ended"))?;
        let Served {
            controller,
            streams,
            ..
        } = &mut *served;
        if controller.faults.is_deaf || controller.faults.is_unplugged {
            continue;
        }
        let list = || {
            String::from_utf8_lossy(&body)
                .split(',')
                .filter(|n| !n.is_empty())
                .map(str::to_owned)
                .collect()
        };
        let answer = match head[2] {
            b'V' => vec![1],
            b'v' => controller
                .version
                .iter()
                .chain(&[0])
                .flat_map(|part| part.to_be_bytes())
                .collect(),
            OUTPUTS => {
                names = body
                    .get(8..)
                    .map(String::from_utf8_lossy)
                    .unwrap_or_default()
                    .split(',')
                    .filter(|name| !name.is_empty())
                    .map(str::to_owned)
                    .collect();
                let states = States::read(controller);
                let types: Vec<_> = names
                    .iter()
                    .map(|name| value(&states, name).map_or("NOT_FOUND", |(kind, _)| kind))
                    .collect();
                [&[1], types.join(",").as_bytes()].concat()
            }
            INPUTS => {
                let names: Vec<String> = list();
                let inputs: Vec<_> = names.iter().map(|name| Input::of(name)).collect();
                let is_taken = *controller.owner.get_or_insert(number) != number;
                let types: Vec<_> = inputs
                    .iter()
                    .map(|input| match input {
                        Some((_, kind)) if !is_taken => kind,
                        Some(_) => "IN_USE",
                        None => "NOT_FOUND",
                    })
                    .collect();
                recipes.push(
                    inputs
                        .into_iter()
                        .flatten()
                        .map(|(input, _)| input)
                        .collect(),
                );
                [&[recipes.len() as u8], types.join(",").as_bytes()].concat()
            }
            b'S' | b'P' => vec![1],
            DATA => {
                write(controller, &recipes, &body);
                continue;
            }
            _ => continue,
        };
        socket.write_all(&packet(head[2], &answer))?;
        if head[2] == b'S' {
            streams.push(Stream {
                socket: socket.try_clone()?,
                names: names.clone(),
            });
        }
    }
    let mut served = served
        .lock()
        .map_err(|_| anyhow::anyhow!("the controller has ended"))?;
    if served.controller.owner == Some(number) {
        served.controller.owner = None;
    }
    Ok(())
}

fn write(controller: &mut Controller, recipes: &[Vec<Input>], body: &[u8]) {
    let Some((id, mut rest)) = body.split_first() else {
        return;
    };
    let Some(recipe) = recipes.get((*id as usize).wrapping_sub(1)) else {
        return;
    };
    let mut written = Vec::new();
    for input in recipe {
        let size = match input {
            Input::Int(_) => 4,
            Input::Double(_) => 8,
            Input::Skipped(size) => *size,
        };
        let Some((bytes, after)) = rest.split_at_checked(size) else {
            return;
        };
        rest = after;
        match (*input, bytes.try_into(), bytes.try_into()) {
            (Input::Int(at), Ok(bytes), _) => {
                written.push(Written::Int(at, i32::from_be_bytes(bytes)))
            }
            (Input::Double(at), _, Ok(bytes)) => {
                written.push(Written::Double(at, f64::from_be_bytes(bytes)))
            }
            _ => {}
        }
    }
    controller.write(written);
}
