//! ROS 2 recordings of a touch: poses (`geometry_msgs/msg/PoseStamped` and other types that hold
//! one, or a tree of transforms) and wrenches (`geometry_msgs/msg/WrenchStamped` and others), or in
//! place of the poses the markers on the stylus (`sensor_msgs/msg/PointCloud2`), read from MCAP,
//! rosbag2 SQLite files, ROS 1 bags and tables of numbers, written as MCAP.
//!
//! Both deal in [`touchup_method::stylus::Message`]s, with the stamps of the message headers.
//! [`RecordingReader`] streams: its memory does not grow with the recording, and it checks every
//! length in a file before use. [`RecordingWriter`] makes a file that rosbag2, Foxglove and the
//! Python readers open; [`write_recording`] publishes only whole ones, [`SegmentedWriter`] writes a
//! growing one, in pieces that a crash leaves whole.

mod bags;
mod compression;
mod copy;
mod db3;
mod error;
mod folder;
mod intake;
mod known_surfaces_file;
mod layout;
mod mcap_files;
mod messages;
mod opening;
mod reader;
mod record;
mod recording_file;
mod resume;
mod segments;
mod tables;
mod topics;

pub use crate::file_error::FilePlace;
pub use copy::{CopiedRecording, copy_recording};
pub use error::{BadCount, BadMessage, Damage, RecordingError};
pub(crate) use folder::{is_of_recording, own_files};
pub use known_surfaces_file::{
    KnownSurfaceLine, append_known_surfaces, bad_surface_line, known_surfaces_beside,
    read_known_surfaces,
};
pub use layout::{RecordingLayout, Topics, TransformFrames};
pub use mcap_files::writer::{RecordingWriter, write_recording};
pub use messages::live_message::{LiveSeed, LiveType, SampleKind};
pub use reader::RecordingReader;
pub use record::{LiveMessage, Record, StampSource};
pub use segments::SegmentedWriter;
pub use tables::columns::{TableColumns, WrenchAxes};
