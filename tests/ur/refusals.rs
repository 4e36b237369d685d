//! Refusals before any motion, and their errors.

use std::time::Duration;

use nalgebra::Vector3;
use touchup::clock::Clock;
use touchup::probing::arm::{Arm, ArmError, Command};
use touchup::ur::{UrArm, UrError, UrParams};

use crate::faults::rest_for;
use crate::stand_in::StandIn;
use crate::{at, with_library};

#[test]
fn what_cannot_be_is_refused_before_it_moves() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&[]);
        let mut arm = stand_in.connect(packages);
        stand_in.send("mark begin");
        let velocity = |z: f64, acceleration: f64| Command::Velocity {
            linear: Vector3::new(0.0, 0.0, z),
            acceleration,
        };
        let press = |axis: Vector3<f64>, force: f64| Command::Press {
            axis,
            force,
            feed: Vector3::zeros(),
            speed: 5e-3,
        };
        let here = at([45e-3, 8e-3, 25e-3]);
        let nowhere = at([f64::NAN, 0.0, 0.0]);
        for bad in [
            velocity(0.3, 1.0),
            velocity(f64::NAN, 1.0),
            velocity(0.01, 0.0),
            velocity(0.01, 11.0),
            press(-Vector3::z(), 51.0),
            press(-Vector3::z(), -1.0),
            press(Vector3::zeros(), 5.0),
            Command::Line {
                to: nowhere,
                speed: 0.01,
                acceleration: 0.5,
            },
            Command::Line {
                to: here,
                speed: f64::INFINITY,
                acceleration: 0.5,
            },
            Command::Stop {
                deceleration: f64::NAN,
            },
        ] {
            let refused = arm.command(&bad);
            assert!(
                matches!(refused, Err(ArmError::Refused { .. })),
                "{bad:?}: {refused:?}"
            );
        }
        // time passes, and nothing moves
        rest_for(&mut arm, 0.2);
        stand_in.send("mark end");
        assert!(
            stand_in
                .record_between("mark begin", "mark end")
                .iter()
                .all(|line| line.speed == 0.0)
        );
        Ok(())
    });
}

/// A start reports faults at once, by name.
#[test]
fn a_wrong_controller_or_library_is_refused() {
    with_library(|packages| {
        for (version, found) in [
            ("3.15.8", "3.15.8.0"),
            ("5.4.0", "5.4.0.0"),
            ("10.7.0", "10.7.0.0"),
        ] {
            let stand_in = StandIn::start(&["--version", version]);
            let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
            assert!(
                matches!(&error, UrError::Version { found: reported, .. } if reported == found),
                "{error}"
            );
        }
        let stand_in = StandIn::start(&[]);
        let params = stand_in.params(packages);
        let error = |params: UrParams| UrArm::connect(&params).err().unwrap();
        let other = tempfile::tempdir().unwrap();
        let bad = error(UrParams {
            site_packages: other.path().into(),
            ..params.clone()
        });
        assert!(
            matches!(bad, UrError::Wheel { .. }) && bad.to_string().contains("touchup ur setup"),
            "{bad}"
        );
        let info = other.path().join("ur_rtde-1.5.9.dist-info");
        std::fs::create_dir(&info).unwrap();
        std::fs::write(
            info.join("METADATA"),
            "Metadata-Version: 2.1\nName: ur-rtde\nVersion: 1.5.9\n",
        )
        .unwrap();
        let bad = error(UrParams {
            site_packages: other.path().into(),
            ..params.clone()
        });
        assert!(
            matches!(&bad, UrError::Wheel { reason, .. } if reason.contains("1.5.9 is there, 1.6.5 is wanted")),
            "{bad}"
        );
        let bad = error(UrParams {
            mass: f64::NAN,
            ..params.clone()
        });
        assert!(matches!(bad, UrError::Parameters(_)), "{bad}");
        let bad = error(UrParams {
            program: "/bin/false".into(),
            ..params
        });
        assert!(matches!(bad, UrError::Client(_)), "{bad}");
        Ok(())
    });
}

#[test]
fn a_controller_whose_states_come_at_125_hz_is_refused() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&[]);
        stand_in.send("rate 125");
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(
            matches!(error, UrError::Rate { hz, .. } if (hz - 125.0).abs() < 1.0),
            "{error}"
        );
        Ok(())
    });
}

/// In local control, without power, silent, gone. The library would wait for a silent one without
/// end.
#[test]
fn a_controller_that_is_not_at_hand_is_reported_at_once() {
    with_library(|packages| {
        let mut stand_in = StandIn::start(&[]);
        stand_in.send("local");
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(matches!(error, UrError::Local { .. }), "{error}");
        drop(stand_in);
        let mut stand_in = StandIn::start(&[]);
        stand_in.send("stuck");
        // the library waits 4 s for the first answer of its program
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(
            matches!(&error, UrError::Client(reason) if reason.contains("setPayload")),
            "{error}"
        );
        // and with less patience
        let mut params = stand_in.params(packages);
        params.deadlines.connect = Duration::from_secs(2);
        let (clock, hand) = Clock::manual();
        params.clock = clock;
        let connecting = std::thread::spawn(move || UrArm::connect(&params).err().unwrap());
        // guard and caller
        while hand.waiting() < 2 {
            std::thread::yield_now();
        }
        hand.advance(Duration::from_millis(1999));
        assert_eq!(hand.waiting(), 2, "not a moment before");
        hand.advance(Duration::from_millis(1));
        let error = connecting.join().unwrap();
        assert!(
            matches!(&error, UrError::Client(reason) if reason.contains("not ready for 2000 ms")),
            "{error}"
        );
        drop(stand_in);
        let mut stand_in = StandIn::start(&[]);
        stand_in.send("off");
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(matches!(error, UrError::Off { .. }), "{error}");
        stand_in.send("unplug");
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(matches!(error, UrError::Unreachable { .. }), "{error}");
        stand_in.kill();
        let error = UrArm::connect(&stand_in.params(packages)).err().unwrap();
        assert!(matches!(error, UrError::Unreachable { .. }), "{error}");
        Ok(())
    });
}

#[test]
fn a_failed_setup_names_its_step() {
    let folder = tempfile::tempdir().unwrap();
    let setup = std::process::Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(["ur", "setup", "--python", "/bin/false"])
        .arg(folder.path())
        .output()
        .unwrap();
    assert_eq!(setup.status.code(), Some(1));
    let message = String::from_utf8_lossy(&setup.stderr);
    assert!(
        message.contains("/bin/false -c") && message.contains("it failed"),
        "{message}"
    );
    assert!(setup.stdout.is_empty());
}
