//! The node's reading of `--ros-args`: hand-written cases from the documentation of ROS 2.

use std::io::Write;

use touchup::ros::arguments::{ArgumentError, NodeConfig, log_level, split};

fn words(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
}

fn config(line: &str) -> Result<NodeConfig, ArgumentError> {
    NodeConfig::new(&words(line), |_| None)
}

fn refusal_of(line: &str) -> String {
    config(line).unwrap_err().to_string()
}

fn file(text: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file
}

#[test]
fn ros_arguments_are_taken_out_wherever_they_stand() {
    let line = "node --ros-args -p a:=1 -- --scene x.yaml --ros-args -r a:=b";
    let (others, ros) = split(words(line));
    assert_eq!(others, words("node --scene x.yaml"));
    assert_eq!(ros, words("-p a:=1 -r a:=b"));
    // outside of them "--" is not ours
    assert_eq!(split(words("node -- x")).0, words("node -- x"));
}

#[test]
fn nothing_given_is_the_default() {
    let config = config("").unwrap();
    assert_eq!(config.place.full_name(), "/touchup");
    assert_eq!((config.domain_id, config.localhost_only), (0, false));
    assert_eq!(config.parameters.double("view_rate_hz"), 20.0);
}

#[test]
fn names_are_relative_to_the_namespace_wherever_that_stands() {
    let config =
        config("-r stylus/wrench:=ft/wrench -r mesh:=/view -r __ns:=/bench -r __node:=left")
            .unwrap();
    assert_eq!(config.place.full_name(), "/bench/left");
    assert_eq!(config.resolve("stylus/wrench").unwrap(), "/bench/ft/wrench");
    assert_eq!(config.resolve("mesh").unwrap(), "/view");
    assert_eq!(config.resolve("~/undo").unwrap(), "/bench/left/undo");
}

#[test]
fn a_rule_for_another_node_is_passed_over() {
    let config = config("-r other:mesh:=x -r touchup:tip:=y -r other:__ns:=/z").unwrap();
    assert_eq!(config.resolve("mesh").unwrap(), "/mesh");
    assert_eq!(config.resolve("tip").unwrap(), "/y");
}

#[test]
fn launch_may_say_what_is_of_no_use_here() {
    let line = "--log-level debug --log-level rcl:=warn --enclave /a -e /b --disable-rosout-logs --log-config-file f";
    assert!(config(line).is_ok());
    assert_eq!(log_level("rcl:=warn").unwrap(), "warn");
}

#[test]
fn the_later_value_counts() {
    let file = file("/**:\n  ros__parameters:\n    view_rate_hz: 7.0\n    colour_by: mismatch\n");
    let path = file.path().display();
    let after = config(&format!("--params-file {path} -p view_rate_hz:=9")).unwrap();
    assert_eq!(after.parameters.double("view_rate_hz"), 9.0);
    assert_eq!(after.parameters.string("colour_by"), "mismatch");
    let before = config(&format!("-p view_rate_hz:=9 --params-file {path}")).unwrap();
    assert_eq!(before.parameters.double("view_rate_hz"), 7.0);
}

#[test]
fn a_file_speaks_to_the_nodes_that_it_names() {
    let file = file(concat!(
        "/**:\n  ros__parameters: {stale_ms: 1, some_other: {deep: [1, 2]}}\n",
        "/bench/touchup:\n  ros__parameters:\n    stale_ms: 2\n    object_frame: \"5\"\n",
        "bench:\n  other:\n    ros__parameters: {stale_ms: 3}\n",
        "other_node:\n  ros__parameters: {robot: nonsense}\n",
    ));
    let path = file.path().display();
    let config = config(&format!("-r __ns:=/bench --params-file {path}")).unwrap();
    assert_eq!(config.parameters.double("stale_ms"), 2.0);
    assert_eq!(config.parameters.string("object_frame"), "5");
    assert_eq!(config.unused, ["some_other.deep"]);
}

#[test]
fn the_file_of_this_repository_is_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/node.yaml");
    let config = NodeConfig::new(&["--params-file".into(), path.into()], |_| None).unwrap();
    assert_eq!(config.parameters, Default::default());
    assert!(config.unused.is_empty());
}

#[test]
fn what_is_wrong_is_named_with_a_way_out() {
    let cases = [
        (
            "--remaps a:=b",
            "--ros-args does not know \"--remaps\": did you mean --remap?",
        ),
        ("--scene x", "--ros-args does not know \"--scene\""),
        ("-p", "-p needs NAME:=VALUE behind it"),
        (
            "-p scan=part.ply",
            "-p scan=part.ply: it must be NAME:=VALUE, as in scan:=part.ply",
        ),
        (
            "-p scna:=part.ply",
            "-p scna:=part.ply: there is no parameter \"scna\": did you mean \"scan\"?",
        ),
        (
            "-p view_rat_hz:=1",
            "-p view_rat_hz:=1: there is no parameter \"view_rat_hz\": did you mean \"view_rate_hz\"?",
        ),
        (
            "-p view_rate_hz:=0",
            "-p view_rate_hz:=0: view_rate_hz is 0.0: it may be 0.1 to 100",
        ),
        (
            "-r mesh",
            "--remap mesh: it must be FROM:=TO, as in stylus/wrench:=/ft_sensor/wrench",
        ),
        (
            "-r mesh:=a//b",
            "--remap mesh:=a//b: \"/a//b\" has an empty part: a name is words between single slashes",
        ),
        (
            "-r __ns:=/1a",
            "--remap __ns:=/1a: \"/1a\" has the part \"1a\": letters, digits and single _ are allowed, no digit at the beginning",
        ),
        (
            "--log-level loud",
            "--log-level loud: it must be debug, info, warn, error or fatal",
        ),
        (
            "--params-file /nowhere.yaml",
            "cannot read the parameter file /nowhere.yaml: No such file or directory (os error 2)",
        ),
    ];
    for (line, reason) in cases {
        assert_eq!(refusal_of(line), reason);
    }
    let not_nodes = file("view_rate_hz: 3.0\n");
    let line = format!("--params-file {}", not_nodes.path().display());
    assert!(
        refusal_of(&line)
            .ends_with("\"view_rate_hz\" is no node: below it must be ros__parameters, or a node")
    );
}

#[test]
fn the_environment_says_who_is_seen() {
    let with = |name: &'static str, value: &'static str| {
        NodeConfig::new(&[], move |asked| (asked == name).then(|| value.to_owned()))
    };
    assert_eq!(with("ROS_DOMAIN_ID", "42").unwrap().domain_id, 42);
    assert_eq!(with("ROS_DOMAIN_ID", "").unwrap().domain_id, 0);
    assert_eq!(
        with("ROS_DOMAIN_ID", "233").unwrap_err().to_string(),
        "ROS_DOMAIN_ID=233: it must be 0 to 232"
    );
    assert!(with("ROS_DOMAIN_ID", "-1").is_err());
    assert!(with("ROS_LOCALHOST_ONLY", "1").unwrap().localhost_only);
    assert!(!with("ROS_LOCALHOST_ONLY", "0").unwrap().localhost_only);
    assert!(
        with("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .unwrap()
            .localhost_only
    );
    assert!(with("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF").is_err());
}
