//! Writes a touch as MCAP with profile `ros2`.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};
use std::path::Path;

use ::mcap::records::MessageHeader;
use ::mcap::write::Writer;
use ::mcap::{Compression, McapError, WriteOptions};

use crate::atomic::AtomicFile;
use crate::file_error::FileError;
use crate::recording::Topics;
use crate::recording::error::RecordingError;
use crate::recording::layout::TopicKind;
use crate::recording::messages::cdr::{encode_pose, encode_wrench};
use crate::recording::messages::point_cloud::{POINT_CLOUD, POINT_FIELD, encode_markers};
use crate::recording::record::Record;
use touchup_method::stylus::Message;

/// Separator in message definitions in rosbag2's form: the type, then each type it uses behind a
/// line of 80 equals signs.
const RULE: &str =
    "================================================================================";
const POSE_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/Pose pose\n";
const WRENCH_STAMPED: &str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n";
const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const POSE: (&str, &str) = (
    "geometry_msgs/Pose",
    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
);
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
);
const WRENCH: (&str, &str) = (
    "geometry_msgs/Wrench",
    "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
);
const VECTOR3: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");

/// rosbag2 keeps the publishers' quality of service as YAML whose words changed between releases;
/// the empty list reads in all of them and means that players use their default.
const NO_QOS_PROFILES: &str = "[]";

fn definition(kind: TopicKind) -> String {
    let (mut text, parts) = match kind {
        TopicKind::Wrench => (
            WRENCH_STAMPED.to_owned(),
            [HEADER, TIME, WRENCH, VECTOR3].as_slice(),
        ),
        TopicKind::Markers => (
            POINT_CLOUD.to_owned(),
            [HEADER, TIME, POINT_FIELD].as_slice(),
        ),
        // written form of a pose from any source
        _ => (
            POSE_STAMPED.to_owned(),
            [HEADER, TIME, POSE, POINT, QUATERNION].as_slice(),
        ),
    };
    for (name, fields) in parts {
        text.push_str(&format!("{RULE}\nMSG: {name}\n{fields}"));
    }
    text
}

/// Writes poses, wrenches and, when [`Topics::markers`] is named, markers into an MCAP file: zstd
/// chunks, CDR messages, index at the end.
///
/// Log and publish time are the stamp of the message, so messages should come in the order of their
/// stamps. The same messages give the same bytes.
pub struct RecordingWriter<W: Write + Seek> {
    mcap: Writer<W>,
    pose: Channel,
    wrench: Channel,
    markers: Option<Channel>,
}

struct Channel {
    id: u16,
    sequence: u32,
}

impl<W: Write + Seek> RecordingWriter<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// [`RecordingError::Write`] for a failed write to `out`.
    pub fn new(out: W, topics: &Topics) -> Result<Self, RecordingError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("touchup ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            // with threads the cuts of the stream depend on the machine
            .compression_threads(0);
        let mut mcap = options.create(out)?;
        let pose = add_channel(&mut mcap, topics, TopicKind::Pose)?;
        let wrench = add_channel(&mut mcap, topics, TopicKind::Wrench)?;
        let wanted = topics.markers.as_ref();
        let markers = wanted
            .map(|_| add_channel(&mut mcap, topics, TopicKind::Markers))
            .transpose()?;
        Ok(Self {
            mcap,
            pose,
            wrench,
            markers,
        })
    }

    /// Appends one message or frame of markers; markers without a topic are left out.
    ///
    /// - `frame`: for its header; for poses and markers the object frame O, for a wrench the frame
    ///   of its axes.
    ///
    /// # Errors
    /// [`RecordingError::Stamp`] for a stamp beyond a ROS 2 message; [`RecordingError::Write`].
    pub fn write(&mut self, record: impl Into<Record>, frame: &str) -> Result<(), RecordingError> {
        let record = record.into();
        let (payload, channel) = match &record {
            Record::Message(Message::Pose(pose)) => (encode_pose(pose, frame)?, &mut self.pose),
            Record::Message(Message::Wrench(wrench)) => {
                (encode_wrench(wrench, frame)?, &mut self.wrench)
            }
            Record::Markers(markers) => {
                let Some(channel) = &mut self.markers else {
                    return Ok(());
                };
                (encode_markers(markers, frame)?, channel)
            }
        };
        let stamp_ns = record.stamp_ns();
        let time = u64::try_from(stamp_ns).map_err(|_| RecordingError::Stamp { stamp_ns })?;
        let sequence = channel.sequence;
        channel.sequence = sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence,
            log_time: time,
            publish_time: time,
        };
        Ok(self.mcap.write_to_known_channel(&header, &payload)?)
    }

    /// Flushes to the output, so that a reader gets up to here.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        Ok(self.mcap.flush()?)
    }

    /// Writes the index and gives the output back. Without this call the file has no proper end.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn finish(mut self) -> Result<W, RecordingError> {
        self.mcap.finish()?;
        Ok(self.mcap.into_inner())
    }
}

fn add_channel<W: Write + Seek>(
    mcap: &mut Writer<W>,
    topics: &Topics,
    kind: TopicKind,
) -> Result<Channel, RecordingError> {
    let schema = mcap.add_schema(kind.type_name(), "ros2msg", definition(kind).as_bytes())?;
    let metadata = BTreeMap::from([(
        "offered_qos_profiles".to_owned(),
        NO_QOS_PROFILES.to_owned(),
    )]);
    let id = mcap.add_channel(schema, topics.name(kind), "cdr", &metadata)?;
    Ok(Channel { id, sequence: 0 })
}

/// Writes a whole recording to `path`, which is never half a file ([`AtomicFile`]).
///
/// - `pose_frame`: name of the object frame O of poses and markers; `wrench_frame`: name of the
///   frame of the wrenches.
///
/// # Errors
/// As [`RecordingWriter`], and [`RecordingError::NotWritten`] with the path for any system error.
pub fn write_recording(
    path: &Path,
    topics: &Topics,
    pose_frame: &str,
    wrench_frame: &str,
    records: impl IntoIterator<Item = impl Into<Record>>,
) -> Result<(), RecordingError> {
    let mut file = AtomicFile::create(path).map_err(|error| not_written(path, error))?;
    let write = || {
        let mut writer = RecordingWriter::new(&mut file, topics)?;
        for record in records {
            let record = record.into();
            let is_wrench = matches!(record, Record::Message(Message::Wrench(_)));
            writer.write(record, if is_wrench { wrench_frame } else { pose_frame })?;
        }
        writer.finish().map(drop)
    };
    write().map_err(|error: RecordingError| error.of_file(path))?;
    file.commit().map_err(|error| not_written(path, error))
}

pub(in crate::recording) fn not_written(path: &Path, source: io::Error) -> RecordingError {
    RecordingError::NotWritten(FileError::Write {
        path: path.to_owned(),
        source,
    })
}

impl RecordingError {
    /// Adds the path to an error of writing the container.
    pub(in crate::recording) fn of_file(self, path: &Path) -> Self {
        match self {
            Self::Write(McapError::Io(source)) => not_written(path, source),
            Self::Write(error) => not_written(path, io::Error::other(error)),
            error => error,
        }
    }
}
