//! Every message against rosbags' encoding of the same fields, both ways. rosbags reads the files
//! of `msg/` and has the definitions of ROS 2's own packages; it shares no code with us.

use std::collections::BTreeSet;

use byteorder::LittleEndian;
use serde_json::{Map, Value};
use touchup::ros::messages::*;

fn golden() -> Map<String, Value> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/ros_cdr.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits = hexadecimal.as_bytes().chunks(2);
    digits
        .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

/// Bytes, fields, and the message agree; any shorter piece of the bytes is an error.
fn check<M: RosMessage>(golden: &Map<String, Value>) -> &'static str {
    let entry = &golden[M::TYPE_NAME];
    let (wire, fields) = (bytes(entry["cdr"].as_str().unwrap()), &entry["fields"]);
    let (read, length) = cdr_encoding::from_bytes::<M, LittleEndian>(&wire).unwrap();
    assert_eq!(length, wire.len(), "{}", M::TYPE_NAME);
    assert_eq!(
        serde_json::to_value(&read).unwrap(),
        *fields,
        "{}",
        M::TYPE_NAME
    );
    let written: M = serde_json::from_value(fields.clone()).unwrap();
    assert_eq!(written, read, "{}", M::TYPE_NAME);
    assert_eq!(
        cdr_encoding::to_vec::<M, LittleEndian>(&written).unwrap(),
        wire,
        "{}",
        M::TYPE_NAME
    );
    for end in 0..wire.len() {
        assert!(
            cdr_encoding::from_bytes::<M, LittleEndian>(&wire[..end]).is_err(),
            "{} to {end}",
            M::TYPE_NAME
        );
    }
    M::TYPE_NAME
}

macro_rules! check_all {
    ($($message:ident)+) => {{
        let golden = golden();
        let checked: BTreeSet<&str> = [$(check::<$message>(&golden)),+].into();
        let known: BTreeSet<&str> = golden.keys().map(String::as_str).collect();
        assert_eq!(checked, known);
    }};
}

#[test]
fn every_message_is_on_the_wire_as_rosbags_has_it() {
    check_all!(
        Time Duration Header ColorRGBA Point Vector3 Quaternion Pose Transform Wrench PointStamped PoseStamped
        WrenchStamped TransformStamped KeyValue DiagnosticStatus DiagnosticArray UVCoordinate MeshFile Marker MarkerArray
        TFMessage Clock Path CompressedImage JointState JointTrajectoryPoint JointTrajectory
        FloatingPointRange IntegerRange ListParametersResult Parameter ParameterDescriptor ParameterEvent ParameterValue
        SetParametersResult GetParametersRequest GetParametersResponse GetParameterTypesRequest GetParameterTypesResponse
        ListParametersRequest ListParametersResponse DescribeParametersRequest DescribeParametersResponse
        SetParametersRequest SetParametersResponse SetParametersAtomicallyRequest SetParametersAtomicallyResponse
        TriggerRequest TriggerResponse SetBoolRequest SetBoolResponse
        Feature FeatureArray FormDeviation HapticMismatch MeshPatch ProbeResult ProbeSettings ProbeTouch Relation
        DetectFeaturesRequest DetectFeaturesResponse FlagFeatureRequest FlagFeatureResponse ProbeFeatureRequest
        ProbeFeatureResponse ResyncMeshRequest ResyncMeshResponse SaveMeshRequest SaveMeshResponse TakeOutTouchRequest
        TakeOutTouchResponse UndoRequest UndoResponse
        UnflagFeatureRequest UnflagFeatureResponse ProbeGoal ProbeResponse ProbeFeedback
    );
}

#[test]
fn a_length_that_lies_takes_no_memory() {
    // a list of transforms that says it has 4 294 967 295, and ends
    let lie = [0xff, 0xff, 0xff, 0xff];
    assert!(cdr_encoding::from_bytes::<TFMessage, LittleEndian>(&lie).is_err());
    // a text of 4 GB
    let mut header = vec![0; 8];
    header.extend(lie);
    assert!(cdr_encoding::from_bytes::<Header, LittleEndian>(&header).is_err());
}
