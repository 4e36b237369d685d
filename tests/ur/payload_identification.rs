//! `touchup calibrate payload --robot ur`: the payload on the flange, through the real client.

use std::fs;
use std::process::Command;

use serde_json::Value;

use super::probing::cell;
use super::stand_in::StandIn;
use super::with_library;

/// 1.17 kg off the axis, against 0.25 kg in the scene: the controller subtracts the configured
/// payload, and the sensor has all of it.
#[test]
#[ignore = "a slow proof"]
fn a_ur_identifies_the_payload_on_its_flange() {
    with_library(|packages| {
        let stand_in = StandIn::start(&["--start-mm", "30,25,60", "--payload", "1.17,3,-2,42"]);
        let folder = cell(&stand_in, packages);
        let path = |name: &str| folder.path().join(name);
        let done = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
            .env("TOUCHUP_UR_LOCK_STEP", "1")
            .args(["calibrate", "payload", "--robot", "ur", "--json"])
            .arg("--scene")
            .arg(path("scene.yaml"))
            .arg("--out")
            .arg(path("calibrated.yaml"))
            .output()
            .unwrap();
        assert_eq!(
            done.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&done.stderr)
        );
        let found: Value = serde_json::from_slice(&done.stdout).unwrap();
        println!("{found}");
        let (mass, std) = (
            found["mass_kg"].as_f64().unwrap(),
            found["mass_std_kg"].as_f64().unwrap(),
        );
        assert!(
            (mass - 1.17).abs() < 3.0 * std && std < 1e-3,
            "{mass} ± {std} kg"
        );
        for (axis, expected) in [3.0, -2.0, 42.0].into_iter().enumerate() {
            let [value, std] =
                ["value", "std"].map(|part| found["centre_mm"][part][axis].as_f64().unwrap());
            assert!(
                (value - expected).abs() < 3.0 * std,
                "{axis}: {value} ± {std} mm"
            );
        }
        assert!(
            fs::read_to_string(path("calibrated.yaml"))
                .unwrap()
                .contains("payload_kg: 1.1")
        );
        // the client set the payload of the scene once, when it started
        let events: Vec<String> = stand_in
            .record()
            .into_iter()
            .map(|line| line.event)
            .collect();
        let payloads: Vec<&str> = events
            .iter()
            .map(String::as_str)
            .filter(|event| event.contains("payload"))
            .collect();
        assert!(
            matches!(payloads[..], [only] if only.contains("payload 0.25 kg")),
            "{payloads:?}"
        );
        Ok(())
    });
}
