//! The dashboard port: one line in, one line out.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::sync::Mutex;

use crate::Served;
use crate::model::panel::answer;

/// One client, until it goes.
pub fn serve(mut socket: TcpStream, served: &Mutex<Served>) -> anyhow::Result<()> {
    let lines = BufReader::new(socket.try_clone()?).lines();
    writeln!(
        socket,
        "Connected: stand-in for a Universal Robots Dashboard Server, in lock step"
    )?;
    for line in lines {
        let line = line?;
        let mut served = served
            .lock()
            .map_err(|_| anyhow::anyhow!("the controller has ended"))?;
        if served.controller.faults.is_unplugged || served.controller.faults.is_mute {
            continue;
        }
        let answer = answer(&mut served.controller, line.trim());
        drop(served);
        writeln!(socket, "{answer}")?;
    }
    Ok(())
}
