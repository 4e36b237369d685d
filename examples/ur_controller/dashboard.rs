//! The dashboard port: one line in, one line out.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::sync::Mutex;

use crate::controller::{Controller, Safety};

/// One client, until it goes.
pub fn serve(mut socket: TcpStream, controller: &Mutex<Controller>) -> anyhow::Result<()> {
    let lines = BufReader::new(socket.try_clone()?).lines();
    writeln!(socket, "Connected: stand-in for a Universal Robots Dashboard Server, in lock step")?;
    for line in lines {
        let line = line?;
        let mut controller = controller.lock().map_err(|_| anyhow::anyhow!("the controller has ended"))?;
        if controller.faults.is_unplugged || controller.faults.is_mute {
            continue;
        }
        let answer = answer(&mut controller, line.trim());
        drop(controller);
        writeln!(socket, "{answer}")?;
    }
    Ok(())
}

fn answer(controller: &mut Controller, line: &str) -> String {
    let [major, minor, bugfix] = controller.version;
    match line {
        "PolyscopeVersion" => format!("URSoftware {major}.{minor}.{bugfix}.0 (Jan 01 2024)"),
        "get serial number" => "20245500001".to_owned(),
        "is in remote control" => controller.is_remote.to_string(),
        "running" => format!("Program running: {}", controller.is_playing()),
        "robotmode" => format!("Robotmode: {}", if controller.is_powered { "RUNNING" } else { "IDLE" }),
        "safetystatus" => match controller.safety {
            Safety::Normal => "Safetystatus: NORMAL",
            Safety::Protective => "Safetystatus: PROTECTIVE_STOP",
            Safety::Safeguard => "Safetystatus: SAFEGUARD_STOP",
            Safety::Emergency => "Safetystatus: ROBOT_EMERGENCY_STOP",
        }
        .to_owned(),
        "stop" if controller.is_playing() || controller.is_paused() => {
            controller.stop_program("dashboard");
            "Stopped".to_owned()
        }
        "stop" => "Failed to execute: stop".to_owned(),
        "programState" if controller.is_playing() => "PLAYING".to_owned(),
        "programState" => if controller.is_paused() { "PAUSED" } else { "STOPPED" }.to_owned(),
        "unlock protective stop" => {
            if controller.safety == Safety::Protective {
                controller.safety = Safety::Normal;
            }
            "Protective stop releasing".to_owned()
        }
        "close safety popup" => "closing safety popup".to_owned(),
        _ => format!("could not understand: '{line}'"),
    }
}
