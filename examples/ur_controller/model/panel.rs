//! Acts of a person at the panel, at the cable or at the part, a line each; and the answers of the
//! dashboard.

use touchup_method::stylus::Payload;

use super::controller::{Controller, Safety};

/// Executes a line. Owners of connections end them: `drop`, `undash` and `die` only say so here.
#[expect(clippy::too_many_lines)]
pub fn happen(controller: &mut Controller, line: &str) {
    controller.record.event(line);
    let number = |word: &str| word.parse::<f64>().unwrap_or(0.0);
    match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["silent"] => controller.faults.is_silent = true,
        ["deaf"] => controller.faults.is_deaf = true,
        ["stuck"] => controller.faults.is_stuck = true,
        ["hung"] => controller.faults.is_hung = true,
        ["slow", periods] => controller.faults.slow = number(periods) as u64,
        ["tired"] => controller.faults.is_tired = true,
        ["mute"] => controller.faults.is_mute = true,
        ["late", "states", ms] => controller.faults.states_late = number(ms) * 1e-3,
        ["late", "orders", ms] => controller.faults.orders_late = number(ms) * 1e-3,
        ["rate", hz] => controller.set_rate(number(hz)),
        ["slider", percent] => controller.body.slider = (number(percent) * 1e-2).clamp(0.0, 1.0),
        ["reduced"] => controller.is_reduced = true,
        ["full"] => controller.is_reduced = false,
        ["watchdog", "counts"] => controller.watchdog_counts_paused = true,
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
        ["unplug"] => controller.faults.is_unplugged = true,
        ["die"] => {
            controller.faults.is_dead = true;
            // without power the brakes close
            controller.stop_program("no power");
        }
        ["protective"] => controller.stop_for(Safety::Protective, "a safety plane"),
        ["operator"] => controller.stop_for(Safety::Emergency, "the button"),
        ["release"] => controller.safety = Safety::Normal,
        ["off"] => {
            controller.is_powered = false;
            controller.stop_program("no power at the arm");
        }
        ["local"] => {
            controller.is_remote = false;
            controller.stop_program("set to local control");
        }
        ["on"] => controller.is_powered = true,
        ["remote"] => controller.is_remote = true,
        ["halt"] => controller.stop_program("at the panel"),
        ["run", ms] => controller.grant(number(ms) * 1e-3),
        ["spike", force] => controller.body.hit(number(force)),
        ["drift", per_s] => controller.body.drift = number(per_s),
        // warm, and zeroed in free air
        ["steady"] => controller.body.settle(),
        ["noise", force] => controller.body.more_noise = number(force),
        ["payload", kg] => {
            let set = controller.body.configured_payload;
            controller.body.configured_payload = Payload {
                mass: number(kg),
                ..set
            };
        }
        ["raise", mm] => controller.body.raise(number(mm) * 1e-3),
        ["mend", ..] => controller.faults = Default::default(),
        ["drop" | "undash" | "mark", ..] => {}
        _ => eprintln!("ur_controller: {line}: unknown"),
    }
}

/// The answer of the dashboard to a line.
pub fn answer(controller: &mut Controller, line: &str) -> String {
    let [major, minor, bugfix] = controller.version;
    match line {
        "PolyscopeVersion" => format!("URSoftware {major}.{minor}.{bugfix}.0 (Jan 01 2024)"),
        "get serial number" => "20245500001".to_owned(),
        "is in remote control" => controller.is_remote.to_string(),
        "running" => format!("Program running: {}", controller.is_playing()),
        "robotmode" => format!(
            "Robotmode: {}",
            if controller.is_powered {
                "RUNNING"
            } else {
                "IDLE"
            }
        ),
        "safetystatus" => match controller.safety {
            Safety::Normal if controller.is_reduced => "Safetystatus: REDUCED",
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
        "programState" => if controller.is_paused() {
            "PAUSED"
        } else {
            "STOPPED"
        }
        .to_owned(),
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
