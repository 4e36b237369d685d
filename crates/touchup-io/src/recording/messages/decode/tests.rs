use cdr_encoding::CdrDeserializer;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::de::DeserializeSeed;
use touchup_method::stylus::Wrench;

use super::super::cdr::{encode_pose, encode_wrench};
use super::super::wire::WireFormat;
use super::*;
use crate::recording::layout::TopicKind;
use crate::recording::{LiveType, SampleKind};

const POSE: MessageFormat = MessageFormat {
    message_type: MessageType::PoseStamped,
    wire: WireFormat::Cdr,
};
const WRENCH: MessageFormat = MessageFormat {
    message_type: MessageType::WrenchStamped,
    wire: WireFormat::Cdr,
};

fn decode_pose(payload: &[u8]) -> Result<(String, StampedPose), BadMessage> {
    match decode(POSE, payload, 0)? {
        MessageContent::Record(frame, Record::Message(Message::Pose(pose))) => Ok((frame, pose)),
        _ => panic!("a pose is one"),
    }
}

/// Assembled by hand from the CDR rules: 4-byte header, i32, u32, length 2, "O\0", 2 bytes to the
/// next multiple of eight, doubles.
fn pose_bytes(order: u8, numbers: [f64; 7], nanosec: u32) -> Vec<u8> {
    let u32_bytes = |v: u32| {
        if order == 1 {
            v.to_le_bytes()
        } else {
            v.to_be_bytes()
        }
    };
    let mut bytes = vec![0, order, 0, 0];
    bytes.extend(u32_bytes(7));
    bytes.extend(u32_bytes(nanosec));
    bytes.extend(u32_bytes(2));
    bytes.extend(b"O\0\0\0");
    for v in numbers {
        bytes.extend(if order == 1 {
            v.to_le_bytes()
        } else {
            v.to_be_bytes()
        });
    }
    bytes
}

#[test]
fn both_byte_orders_give_the_pose_laid_out_by_hand() {
    for order in [0, 1] {
        let bytes = pose_bytes(order, [1.0, -2.0, 3.5, 0.5, -0.5, 0.5, 0.5], 9);
        let (frame, pose) = decode_pose(&bytes).unwrap();
        assert_eq!((frame.as_ref(), pose.stamp_ns), ("O", 7_000_000_009));
        assert_eq!(
            pose.pose_ot.translation.vector,
            Vector3::new(1.0, -2.0, 3.5)
        );
        let q = pose.pose_ot.rotation;
        assert_eq!((q.i, q.j, q.k, q.w), (0.5, -0.5, 0.5, 0.5));
    }
}

#[test]
fn encoding_gives_the_bytes_laid_out_by_hand() {
    let bytes = pose_bytes(1, [1.0, -2.0, 3.5, 0.0, 0.0, 1.0, 0.0], 9);
    let half_turn_about_z = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 1.0));
    let pose_ot = Isometry3::from_parts(Translation3::new(1.0, -2.0, 3.5), half_turn_about_z);
    assert_eq!(
        encode_pose(
            &StampedPose {
                stamp_ns: 7_000_000_009,
                pose_ot
            },
            "O"
        )
        .unwrap(),
        bytes
    );
}

#[test]
fn a_position_may_be_nan_but_a_rotation_is_refused_when_it_is_none() {
    let (_, pose) = decode_pose(&pose_bytes(
        1,
        [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.005],
        0,
    ))
    .unwrap();
    assert!(pose.pose_ot.translation.x.is_nan());
    assert!((pose.pose_ot.rotation.norm() - 1.0).abs() < 1e-15);
    for q in [
        [0.0; 4],
        [f64::NAN, 0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0, 1.02],
        [f64::INFINITY; 4],
    ] {
        let bytes = pose_bytes(1, [0.0, 0.0, 0.0, q[0], q[1], q[2], q[3]], 0);
        assert_eq!(decode_pose(&bytes).unwrap_err(), BadMessage::Quaternion);
    }
}

#[test]
fn every_shortened_or_lengthened_payload_is_malformed() {
    let bytes = pose_bytes(1, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 0);
    for len in 0..bytes.len() {
        assert_eq!(
            decode_pose(&bytes[..len]).unwrap_err(),
            BadMessage::Malformed,
            "{len} bytes"
        );
    }
    let longer = |n: usize| [bytes.clone(), vec![0; n]].concat();
    assert!(decode_pose(&longer(3)).is_ok());
    assert_eq!(decode_pose(&longer(4)).unwrap_err(), BadMessage::Malformed);
}

#[test]
fn a_wrench_is_not_a_pose_and_other_encodings_are_refused() {
    let wrench = encode_wrench(
        &StampedWrench {
            stamp_ns: 0,
            wrench: Wrench::default(),
        },
        "O",
    )
    .unwrap();
    assert_eq!(decode_pose(&wrench).unwrap_err(), BadMessage::Malformed);
    for order in [2, 3, 6, 7, 255] {
        let mut bytes = wrench.clone();
        bytes[1] = order;
        assert_eq!(decode(WRENCH, &bytes, 0).err(), Some(BadMessage::Malformed));
    }
}

#[test]
fn stamps_outside_their_range_are_refused() {
    let bytes = pose_bytes(1, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], 1_000_000_000);
    assert_eq!(decode_pose(&bytes).unwrap_err(), BadMessage::Stamp);
    for stamp_ns in [-1, 2_147_483_648_000_000_000, i64::MIN, i64::MAX] {
        let wrench = StampedWrench {
            stamp_ns,
            wrench: Wrench::default(),
        };
        assert!(matches!(
            encode_wrench(&wrench, ""),
            Err(crate::recording::RecordingError::Stamp { .. })
        ));
    }
}

/// By the definition in franka_msgs 0.10 for ROS 1: the header, its numbers one after another, then
/// flags.
#[test]
#[expect(clippy::too_many_lines)]
fn a_state_of_a_franka_gives_the_tool_and_the_wrench_in_the_base() {
    let numbers_of = |names: &[(&str, usize)]| {
        let mut bytes = Vec::new();
        for &(name, count) in names {
            let numbers: Vec<f64> = match name {
                "O_F_ext_hat_K" => vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
                // a quarter turn about z, column by column, at (0.3, 0.4, 0.5)
                "O_T_EE" => vec![
                    0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.3, 0.4, 0.5, 1.0,
                ],
                _ => vec![77.0; count],
            };
            assert_eq!(numbers.len(), count);
            numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        bytes
    };
    let ros1 = numbers_of(&[
        ("cartesian_collision", 6),
        ("cartesian_contact", 6),
        ("q", 7),
        ("q_d", 7),
        ("dq", 7),
        ("dq_d", 7),
        ("theta", 7),
        ("dtheta", 7),
        ("tau_J", 7),
        ("dtau_J", 7),
        ("tau_J_d", 7),
        ("K_F_ext_hat_K", 6),
        ("elbow", 2),
        ("elbow_d", 2),
        ("joint_collision", 7),
        ("joint_contact", 7),
        ("O_F_ext_hat_K", 6),
        ("tau_ext_hat_filtered", 7),
        ("m_ee", 1),
        ("F_x_Cee", 3),
        ("I_ee", 9),
        ("m_load", 1),
        ("F_x_Cload", 3),
        ("I_load", 9),
        ("m_total", 1),
        ("F_x_Ctotal", 3),
        ("I_total", 9),
        ("O_T_EE", 16),
        ("O_T_EE_d", 16),
        ("F_T_EE", 16),
        ("EE_T_K", 16),
        ("time", 1),
        ("control_command_success_rate", 1),
    ]);
    // seq, secs, nsecs, frame; mode and two times 37 flags behind
    let head = [
        &9u32.to_le_bytes()[..],
        &7u32.to_le_bytes(),
        &5u32.to_le_bytes(),
        &1u32.to_le_bytes(),
        b"b",
    ]
    .concat();
    let whole = [&head[..], &ros1, &[0; 75]].concat();
    let format = MessageFormat {
        message_type: MessageType::FrankaState,
        wire: WireFormat::Ros1,
    };
    let Ok(MessageContent::State(state)) = decode(format, &whole, 0) else {
        panic!("a state is one")
    };
    assert!(state.iter().all(|one| one.frame == "b"));
    let [Message::Pose(pose), Message::Wrench(wrench)] = state.map(|one| one.message) else {
        panic!("a pose, then a wrench")
    };
    assert_eq!(
        (pose.stamp_ns, wrench.stamp_ns),
        (7_000_000_005, 7_000_000_005)
    );
    assert_eq!(pose.pose_ot.translation.vector, Vector3::new(0.3, 0.4, 0.5));
    assert!((pose.pose_ot.rotation * Vector3::x() - Vector3::y()).norm() < 1e-15);
    let Wrench { force, torque } = wrench.wrench;
    assert_eq!(
        (force, torque),
        (Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0))
    );
    // a release with one number more must not read as if it had none
    assert!(decode(format, &[&head[..], &[0; 8], &ros1, &[0; 75]].concat(), 0).is_err());
    assert!(decode(format, &whole[..whole.len() - 75], 0).is_err());
}

#[test]
fn what_gives_no_pose_is_refused_with_what_does_and_the_flag() {
    let of = |type_name: &str, kind| {
        let info = crate::recording::layout::TopicInfo {
            name: "/a".into(),
            type_name: type_name.into(),
            encoding: "cdr".into(),
        };
        MessageFormat::of(&info, kind)
    };
    assert_eq!(
        of("nav_msgs/msg/Odometry", TopicKind::Pose)
            .unwrap()
            .message_type,
        MessageType::Odometry
    );
    assert_eq!(
        of("tf/tfMessage", TopicKind::Transforms)
            .unwrap()
            .message_type,
        MessageType::Transforms
    );
    let why = of("sensor_msgs/msg/Imu", TopicKind::Wrench).unwrap_err();
    assert!(
        why.contains("Imu") && why.contains("WrenchStamped") && why.contains("--wrench-topic"),
        "{why}"
    );
    let why = of("tf2_msgs/msg/TFMessage", TopicKind::Pose).unwrap_err();
    assert!(why.contains("--pose-frame"), "{why}");
}

/// A library's unpacking in either byte order agrees with the bytes themselves, bit by bit, and
/// ends at the same place.
#[test]
fn fields_that_a_deserializer_hands_out_are_those_of_the_bytes() {
    for order in [0, 1] {
        let numbers = [1.0, f64::NAN, 3.5, 0.5, -0.5, 0.5, 0.5];
        let bytes = pose_bytes(order, numbers, 9);
        let message = LiveType::of(SampleKind::Pose, "").unwrap();
        let unpacked = |body: &[u8]| match order {
            0 => message
                .seed(5)
                .deserialize(&mut CdrDeserializer::<byteorder::BigEndian>::new(body))
                .unwrap(),
            _ => message
                .seed(5)
                .deserialize(&mut CdrDeserializer::<byteorder::LittleEndian>::new(body))
                .unwrap(),
        };
        for len in 4..=bytes.len() {
            let (live, read) = (unpacked(&bytes[4..len]), message.decode(&bytes[..len], 5));
            assert_eq!(format!("{live:?}"), format!("{read:?}"), "{len} bytes");
            assert_eq!(live.is_ok(), len == bytes.len());
        }
        for more in 1..9 {
            let longer = [bytes.clone(), vec![0; more]].concat();
            assert_eq!(unpacked(&longer[4..]).is_ok(), more <= 3, "{more} more");
        }
    }
}

/// For every type and any bytes: random ones, and zeros, which are whole messages of some length.
#[test]
fn no_bytes_are_read_otherwise_by_a_deserializer() {
    let mut state = 1_u64;
    let mut drawn = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 56) as u8
    };
    for (kind, names) in [
        (
            SampleKind::Pose,
            &[
                "PoseStamped",
                "Pose",
                "PoseWithCovarianceStamped",
                "TransformStamped",
            ][..],
        ),
        (SampleKind::Wrench, &["WrenchStamped", "Wrench"]),
    ] {
        let others = [
            "nav_msgs/msg/Odometry",
            "iiwa_msgs/msg/CartesianPose",
            "iiwa_msgs/msg/CartesianWrench",
        ];
        let states = [
            "franka_msgs/msg/FrankaState",
            "franka_msgs/msg/FrankaRobotState",
        ];
        let names = names.iter().map(|name| format!("geometry_msgs/msg/{name}"));
        for name in names.chain(
            [&others[..], &states]
                .concat()
                .into_iter()
                .map(str::to_owned),
        ) {
            let Ok(message) = LiveType::of(kind, &name) else {
                continue;
            };
            let mut whole = 0;
            for len in (4..2600).step_by(3) {
                let noise: Vec<u8> = (0..len).map(|_| drawn()).collect();
                for mut bytes in [noise, vec![0; len]] {
                    bytes[..4].copy_from_slice(&[0, 1, 0, 0]);
                    let mut unpacked = CdrDeserializer::<byteorder::LittleEndian>::new(&bytes[4..]);
                    let live = message.seed(7).deserialize(&mut unpacked).unwrap();
                    assert_eq!(
                        format!("{live:?}"),
                        format!("{:?}", message.decode(&bytes, 7)),
                        "{name}, {len} bytes"
                    );
                    // a quaternion of zeros is invalid, and comes in the midst of a message
                    whole += u64::from(live.is_ok() || live == Err(BadMessage::Quaternion));
                }
            }
            assert!(whole > 0, "{name}");
        }
    }
}
