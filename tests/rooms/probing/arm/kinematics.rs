//! An arm's kinematics and the onset of its touches.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Matrix4, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use touchup::probing::arm::{
    Arm, ArmGeometry, Command, OnsetError, OnsetParams, OnsetVerdict, TouchMoment, UrGeometry,
    find_onset,
};
use touchup::sim::{ArmParams, Plate, SimArm, WEIGHTLESS};
use touchup::stylus::Payload;

const ARMS: [UrGeometry; 4] = [
    UrGeometry::UR3E,
    UrGeometry::UR5E,
    UrGeometry::UR10E,
    UrGeometry::UR16E,
];

/// Parameters of a touch, which the fit has to find.
#[derive(Clone, Copy, Debug)]
struct Making {
    /// m
    onset: f64,
    /// N/m
    stiffness: f64,
    /// m/s
    speed: f64,
    /// m/s², while it stops
    braking: f64,
    /// of the force behind the travel, s
    delay: f64,
    /// N
    noise: f64,
    /// of the travel, m
    pose_noise: f64,
    /// N
    bias: f64,
    /// of the force across to the force along
    lateral: f64,
    /// it comes back too
    comes_back: bool,
}

const MAKING: Making = Making {
    onset: 3.2e-3,
    stiffness: 20e3,
    speed: 5e-3,
    braking: 0.2,
    delay: 4e-3,
    noise: 0.05,
    pose_noise: 5e-6,
    bias: 0.3,
    lateral: 0.1,
    comes_back: true,
};

/// A touch at 500 Hz: the arm stops when it measures 2 N, brakes, dwells and retracts.
fn made(making: &Making, seed: u64) -> Vec<TouchMoment> {
    const DT: f64 = 2e-3;
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut noise = |rms: f64| {
        let x: f64 = StandardNormal.sample(&mut rng);
        x * rms
    };
    let (mut true_travel, mut speed, mut rested, mut moments) =
        (0.0, making.speed, 0.0, Vec::new());
    let (mut history, mut is_stopping) = (vec![], false);
    for tick in 0.. {
        let t = f64::from(tick) * DT;
        history.push((t, true_travel));
        let then = t - making.delay;
        let late = history
            .iter()
            .rev()
            .find(|(at, _)| *at <= then)
            .map_or(0.0, |&(at, s)| {
                let next = history
                    .iter()
                    .find(|(other, _)| *other > at)
                    .map_or(s, |next| next.1);
                s + (next - s) * (then - at) / DT
            });
        let force = making.stiffness * (late - making.onset).max(0.0);
        moments.push(TouchMoment {
            t,
            travel: true_travel + noise(making.pose_noise),
            force: force + making.bias + noise(making.noise),
            lateral: making.lateral * force,
        });
        is_stopping |= force > 2.0;
        if is_stopping && speed > 0.0 {
            speed = (speed - making.braking * DT).max(0.0);
        } else if is_stopping && rested < 0.02 {
            rested += DT;
        } else if is_stopping {
            speed = (speed - making.braking * DT).max(-making.speed);
        }
        true_travel += speed * DT;
        let is_back = is_stopping
            && rested >= 0.02
            && (!making.comes_back || true_travel < making.onset - 1e-3);
        if is_back {
            return moments;
        }
    }
    unreachable!("it stops")
}

/// Mean and root mean square of errors, m, and of normalised errors.
fn errors(making: &Making, params: &OnsetParams) -> [f64; 3] {
    let found: Vec<_> = (0..100)
        .map(|seed| find_onset(&made(making, seed), params).unwrap())
        .collect();
    let count = found.len() as f64;
    let errors: Vec<f64> = found
        .iter()
        .map(|onset| onset.travel - making.onset)
        .collect();
    let mean = errors.iter().sum::<f64>() / count;
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
    let normal = found
        .iter()
        .zip(&errors)
        .map(|(onset, e)| (e / onset.sigma).powi(2))
        .sum::<f64>()
        / count;
    [mean, rms, normal.sqrt()]
}

/// The bent line is synthetic, so its corner is exact. Neither speed nor braking nor delay moves
/// it.
#[test]
#[ignore = "a slow proof"]
fn the_corner_is_found_whatever_the_arm_does_after_it() {
    for making in [
        MAKING,
        Making {
            speed: 1e-3,
            ..MAKING
        },
        Making {
            speed: 10e-3,
            braking: 0.05,
            ..MAKING
        },
        Making {
            stiffness: 2e3,
            ..MAKING
        },
        Making {
            stiffness: 100e3,
            ..MAKING
        },
        Making {
            delay: 0.0,
            ..MAKING
        },
        Making {
            delay: 10e-3,
            ..MAKING
        },
        Making {
            noise: 0.2,
            ..MAKING
        },
        Making {
            pose_noise: 20e-6,
            ..MAKING
        },
    ] {
        let params = OnsetParams {
            force_noise: making.noise,
            ..OnsetParams::default()
        };
        let [mean, rms, normal] = errors(&making, &params);
        println!(
            "{making:?}: mean {:.2} um, rms {:.2} um, over what is stated {normal:.2}",
            mean * 1e6,
            rms * 1e6
        );
        assert!(
            mean.abs() < 0.3 * rms + 0.2e-6,
            "{making:?}: mean {mean}, rms {rms}"
        );
        assert!(rms < 12e-6, "{making:?}: {rms}");
        assert!((0.5..1.5).contains(&normal), "{making:?}: {normal}");
    }
}

/// Going in at one speed, a delay looks like a corner farther in: the stated uncertainty covers it.
#[test]
fn without_braking_and_retraction_the_delay_is_uncertainty() {
    let both = made(&MAKING, 1);
    let braking = both.iter().position(|m| m.force > 2.0).unwrap();
    let params = OnsetParams {
        force_noise: 0.05,
        ..OnsetParams::default()
    };
    let found = find_onset(&both[..braking], &params).unwrap();
    assert!(
        (found.travel - MAKING.onset).abs() < 2.0 * found.sigma,
        "{found:?}"
    );
    let by_delay = params.delay_sigma * MAKING.speed;
    // and that of the corner itself, which was hardly touched
    assert!(
        (1.0..1.3).contains(&(found.sigma / by_delay)),
        "{found:?}: {by_delay}"
    );
    assert!(find_onset(&both, &params).unwrap().sigma < 0.2 * by_delay);
}

#[test]
fn an_unclean_touch_is_reported() {
    let params = OnsetParams {
        force_noise: 0.05,
        ..OnsetParams::default()
    };
    let verdict = |moments: &[TouchMoment]| find_onset(moments, &params).unwrap().verdict;
    let clean = made(&MAKING, 1);
    assert_eq!(verdict(&clean), OnsetVerdict::Clean);
    assert_eq!(
        verdict(&made(
            &Making {
                lateral: 0.9,
                ..MAKING
            },
            1
        )),
        OnsetVerdict::Edge
    );
    // pushed for 6 ms in free air
    let mut hit = clean.clone();
    hit[40..43].iter_mut().for_each(|m| m.force += 3.0);
    assert_eq!(verdict(&hit), OnsetVerdict::Impact);
    // lost for 20 ms when it had just come
    let mut bounced = clean.clone();
    let first = bounced.iter().position(|m| m.force > 1.8).unwrap();
    bounced.splice(
        first..first,
        (0..10).map(|_| TouchMoment {
            force: MAKING.bias,
            ..clean[first]
        }),
    );
    bounced
        .iter_mut()
        .enumerate()
        .for_each(|(at, m)| m.t = at as f64 * 2e-3);
    let held: Vec<_> = bounced.iter().map(|m| m.force).collect();
    assert!(held[first - 1] > 0.8 && held[first] < 0.5);
    assert_eq!(verdict(&bounced), OnsetVerdict::Bounce);
    // while it retracts a third of the force is gone
    let mut slipped = clean.clone();
    let deepest = clean.iter().map(|m| m.travel).fold(0.0, f64::max);
    let top = clean
        .iter()
        .rposition(|m| m.travel > deepest - 20e-6)
        .unwrap();
    slipped[top..]
        .iter_mut()
        .for_each(|m| m.force -= (m.force - MAKING.bias) * 0.33);
    // with an unknown delay it could be that
    let known = OnsetParams {
        delay: MAKING.delay,
        delay_sigma: 0.3e-3,
        ..params
    };
    assert_eq!(
        find_onset(&clean, &known).unwrap().verdict,
        OnsetVerdict::Clean
    );
    assert_eq!(
        find_onset(&slipped, &known).unwrap().verdict,
        OnsetVerdict::Slip
    );
}

#[test]
fn what_is_no_touch_is_refused() {
    let params = OnsetParams {
        force_noise: 0.05,
        ..OnsetParams::default()
    };
    let clean = made(&MAKING, 1);
    let air: Vec<_> = clean
        .iter()
        .copied()
        .take_while(|m| m.travel < 2e-3)
        .collect();
    assert!(matches!(
        find_onset(&air, &params),
        Err(OnsetError::NoContact { .. })
    ));
    let first = clean
        .iter()
        .position(|m| m.travel > MAKING.onset + 60e-6)
        .unwrap();
    assert!(matches!(
        find_onset(&clean[first..], &params),
        Err(OnsetError::NoFreeAir { .. } | OnsetError::NoContact { .. })
    ));
    let mut bad = clean.clone();
    bad[7].force = f64::NAN;
    assert_eq!(
        find_onset(&bad, &params),
        Err(OnsetError::BadMoment { index: 7 })
    );
    bad[7] = bad[6];
    assert_eq!(
        find_onset(&bad, &params),
        Err(OnsetError::BadMoment { index: 7 })
    );
    assert!(find_onset(&[], &params).is_err());
}

/// Denavit and Hartenberg's matrices, multiplied as in the book.
fn by_matrices(arm: &UrGeometry, joints: &[f64; 6]) -> Matrix4<f64> {
    let table = [
        (arm.d1, 0.0, PI / 2.0),
        (0.0, arm.a2, 0.0),
        (0.0, arm.a3, 0.0),
        (arm.d4, 0.0, PI / 2.0),
        (arm.d5, 0.0, -PI / 2.0),
        (arm.d6, 0.0, 0.0),
    ];
    table
        .iter()
        .zip(joints)
        .fold(Matrix4::identity(), |product, (&(d, a, alpha), &theta)| {
            let ((st, ct), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
            #[rustfmt::skip]
        let link = Matrix4::new(
            ct, -st * ca, st * sa, a * ct,
            st, ct * ca, -ct * sa, a * st,
            0.0, sa, ca, d,
            0.0, 0.0, 0.0, 1.0,
        );
            product * link
        })
}

fn joints() -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-PI..PI)
}

proptest! {
    #[test]
    fn the_flange_is_where_the_matrices_have_it(joints in joints(), arm in 0..4usize) {
        let difference = ArmGeometry::from(ARMS[arm]).flange(&joints.into()).to_homogeneous() - by_matrices(&ARMS[arm], &joints);
        prop_assert!(difference.norm() < 1e-14, "{difference}");
    }

    /// Each solution brings the flange there, and the joints that it came from are among them.
    #[test]
    fn the_inverse_brings_it_there(joints in joints(), arm in 0..4usize) {
        let (ur, arm) = (ARMS[arm], ArmGeometry::from(ARMS[arm]));
        prop_assume!(arm.dexterity(&joints.into()) > 1e-4);
        let pose = arm.flange(&joints.into());
        let found = ur.inverse(&pose, &joints);
        prop_assert!((1..=8).contains(&found.len()));
        let turn = |a: f64, b: f64| (a - b + PI).rem_euclid(2.0 * PI) - PI;
        let is_it = |other: &[f64; 6]| other.iter().zip(&joints).all(|(a, b)| turn(*a, *b).abs() < 1e-6);
        prop_assert!(found.iter().any(is_it), "{found:?}");
        for solution in &found {
            let error = pose.inv_mul(&arm.flange(&(*solution).into()));
            prop_assert!(error.translation.vector.norm() < 1e-9 && error.rotation.angle() < 1e-7, "{error}");
        }
    }

    /// Against differences of the flange's pose.
    #[test]
    fn the_jacobian_is_the_slope_of_the_flange(joints in joints(), arm in 0..4usize) {
        let (arm, step) = (ArmGeometry::from(ARMS[arm]), 1e-6);
        let jacobian = arm.jacobian(&joints.into());
        for column in 0..6 {
            let moved = |by: f64| {
                let mut moved = joints;
                moved[column] += by;
                arm.flange(&moved.into())
            };
            let (back, forth) = (moved(-step), moved(step));
            let linear = (forth.translation.vector - back.translation.vector) / (2.0 * step);
            let angular = (forth.rotation * back.rotation.inverse()).scaled_axis() / (2.0 * step);
            prop_assert!((linear - jacobian.fixed_view::<3, 1>(0, column)).norm() < 1e-8);
            prop_assert!((angular - jacobian.fixed_view::<3, 1>(3, column)).norm() < 1e-8);
        }
    }

    #[test]
    fn what_is_out_of_reach_has_no_solution(direction in prop::array::uniform3(-1.0..1.0f64), arm in 0..4usize) {
        let arm = ARMS[arm];
        let direction = Vector3::from(direction);
        prop_assume!(direction.norm() > 0.1);
        let far = direction.normalize() * (arm.d1 + arm.a2.abs() + arm.a3.abs() + arm.d4 + arm.d5 + arm.d6 + 0.01);
        let pose = Isometry3::from_parts(far.into(), UnitQuaternion::identity());
        prop_assert!(arm.inverse(&pose, &[0.0; 6]).is_empty());
    }
}

/// Arms that cannot move in some direction: stretched, the hand above the shoulder, axes 4 and 6
/// parallel.
#[test]
fn where_an_arm_is_stuck_it_has_no_dexterity() {
    let arm = ArmGeometry::from(UrGeometry::UR5E);
    let somewhere = [0.3, -1.2, 1.4, -0.9, 1.1, 0.4];
    assert!(arm.dexterity(&somewhere.into()) > 0.01);
    let [stretched, straight_wrist] = [(2, 0.0), (4, 0.0)].map(|(joint, angle)| {
        let mut joints = somewhere;
        joints[joint] = angle;
        arm.dexterity(&joints.into())
    });
    assert!(
        stretched < 1e-12 && straight_wrist < 1e-12,
        "{stretched} {straight_wrist}"
    );
    let mut rng = Pcg64::seed_from_u64(3);
    let most = (0..1000)
        .map(|_| arm.dexterity(&[(); 6].map(|()| rng.random_range(-PI..PI)).into()))
        .fold(0.0, f64::max);
    assert!(most < 2.0, "lengths are in units of the arm: {most}");
}

/// Force that a simulated arm reports after zeroing upright and a turn by 60° about x, N in B.
fn force_after_a_turn(configured_payload: Payload) -> Vector3<f64> {
    let payload = Payload {
        mass: 1.2,
        p_sc: Vector3::new(0.01, 0.0, 0.05),
        ..WEIGHTLESS
    };
    let params = ArmParams {
        payload,
        configured_payload,
        ..ArmParams::default()
    };
    let plate = Plate::default();
    let start = Isometry3::translation(-0.37, -0.08, 0.15);
    let mut arm = SimArm::new(&plate, params, &start).unwrap();
    arm.zero_sensor().unwrap();
    let to = start * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI / 3.0);
    let command = Command::Line {
        to,
        speed: 0.05,
        acceleration: 0.5,
    };
    // 60° at 0.5 rad/s take 2.1 s
    for _ in 0..1500 {
        arm.command(&command).unwrap();
        arm.next_state().unwrap();
    }
    let states = 400;
    let sum: Vector3<f64> = (0..states)
        .map(|_| {
            arm.command(&command).unwrap();
            arm.next_state().unwrap().wrench_b.force
        })
        .sum();
    sum / f64::from(states)
}

/// After zeroing, an uncompensated weight acts as a force once the sensor turns: Δw − R Δw with Δw
/// of 1 kg; a correct payload leaves none. The noise of the zero (64 readings of 0.15 N) is 0.02 N
/// on each axis.
#[test]
fn a_wrong_payload_shows_as_a_force_when_the_sensor_turns() {
    let weight = Vector3::new(0.0, 0.0, -9.81);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI / 3.0);
    let payload = |mass: f64| Payload {
        mass,
        p_sc: Vector3::new(0.01, 0.0, 0.05),
        ..WEIGHTLESS
    };
    let force = force_after_a_turn(payload(0.2));
    assert!((force - (weight - turn * weight)).norm() < 0.1, "{force}");
    let force = force_after_a_turn(payload(1.2));
    assert!(force.norm() < 0.1, "{force}");
}
