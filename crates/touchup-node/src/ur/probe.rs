//! Checks that a controller speaks RTDE, has a known version, and a running clock, before the
//! library connects: that waits for a silent controller without end.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use super::dashboard::socket;
use super::error::UrError;

/// TCP port of RTDE.
const PORT: u16 = 30004;
/// Version of RTDE requested, the same as the library's.
const PROTOCOL: [u8; 2] = [0, 2];
/// The oldest minor version of PolyScope 5 that sends the raw reading of its force sensor.
const OLDEST: u32 = 9;
/// Number of states read; the clock has to advance between them.
const STATES: usize = 3;

/// Major and minor version of a controller. Refuses a silent controller and an unsupported kind.
pub(super) fn probe(host: &str, deadline: Duration) -> Result<[u32; 2], UrError> {
    let mut socket = socket(host, PORT, "RTDE", deadline)?;
    let reason = |reason: String| UrError::Unreachable {
        host: host.to_owned(),
        port: PORT,
        service: "RTDE",
        reason,
    };
    let mut talk = || -> std::io::Result<(Vec<u32>, Vec<f64>)> {
        ask(&mut socket, b'V', &PROTOCOL)?;
        let version = ask(&mut socket, b'v', &[])?;
        let version = version
            .chunks_exact(4)
            .map(|part| u32::from_be_bytes([part[0], part[1], part[2], part[3]]));
        let version = version.collect();
        ask(
            &mut socket,
            b'O',
            &[&125f64.to_be_bytes()[..], b"timestamp"].concat(),
        )?;
        ask(&mut socket, b'S', &[])?;
        let mut stamps = Vec::new();
        while stamps.len() < STATES {
            // number of the recipe, then the stamp
            let state = wait(&mut socket, b'U')?;
            stamps.extend(
                state
                    .get(1..9)
                    .and_then(|stamp| stamp.try_into().ok())
                    .map(f64::from_be_bytes),
            );
        }
        Ok((version, stamps))
    };
    let (version, stamps) = talk().map_err(|error| reason(error.to_string()))?;
    let minor = match version[..] {
        [5, minor, ..] if minor >= OLDEST => minor,
        _ => {
            let found = version
                .iter()
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(".");
            return Err(UrError::Version {
                host: host.to_owned(),
                found,
            });
        }
    };
    if stamps.first() == stamps.last() {
        return Err(reason("its clock has stopped".to_owned()));
    }
    Ok([5, minor])
}

fn ask(socket: &mut TcpStream, kind: u8, body: &[u8]) -> std::io::Result<Vec<u8>> {
    // total size, kind, body
    let head = [0, body.len() as u8 + 3, kind];
    socket.write_all(&[&head[..], body].concat())?;
    wait(socket, kind)
}

/// The next packet of a kind; skips others.
fn wait(socket: &mut TcpStream, kind: u8) -> std::io::Result<Vec<u8>> {
    loop {
        let mut head = [0; 3];
        socket.read_exact(&mut head)?;
        let mut body =
            vec![0; usize::from(u16::from_be_bytes([head[0], head[1]])).saturating_sub(head.len())];
        socket.read_exact(&mut body)?;
        if head[2] == kind {
            return Ok(body);
        }
    }
}
