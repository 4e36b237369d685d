//! The targets: each takes any bytes, and panics if the claim of its first line fails.

pub mod check_record;
pub mod cloud;
pub mod detect;
pub mod features;
pub mod mesh;
pub mod messages;
pub mod own_data;
pub mod patcher;
pub mod recording;
pub mod refiner;
pub mod rosbag2;
pub mod scene;
pub mod step;
pub mod synchroniser;
pub mod table;
pub mod urdf;

/// One input of a target.
pub type Target = fn(&[u8]);

/// Name and entry of each target.
pub const TARGETS: &[(&str, Target)] = &[
    ("check_record", check_record::run),
    ("cloud", cloud::run),
    ("detect", detect::run),
    ("features", features::run),
    ("mesh", mesh::run),
    ("messages", messages::run),
    ("own_data", own_data::run),
    ("patcher", patcher::run),
    ("recording", recording::run),
    ("refiner", refiner::run),
    ("rosbag2", rosbag2::run),
    ("scene", scene::run),
    ("step", step::run),
    ("synchroniser", synchroniser::run),
    ("table", table::run),
    ("urdf", urdf::run),
];

/// The target of this name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS
        .iter()
        .find(|(own, _)| *own == name)
        .map(|&(_, run)| run)
}
