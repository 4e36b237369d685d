//! What becomes of the messages and rows of a recording: records, or counts of what cannot be used.

use std::collections::BTreeMap;
use std::path::Path;

use super::cdr::unpack;
use super::decode::{Decoded, decode};
use super::error::BadCount;
use super::number_table::TableRow;
use super::transforms::TransformChain;
use super::wire::Wire;
use super::{BadMessage, FilePlace, RawMessage, Record, StampSource, TopicKind};
use touchup_core::stylus::Message;

/// Decodes messages, and counts frames and unusable messages.
#[derive(Default)]
pub(super) struct Intake {
    pub pose_frame: Option<String>,
    pub wrench_frame: Option<String>,
    /// of a message that holds both, what comes behind the first
    pub second: Option<Record>,
    /// where the pose comes from transforms
    chain: Option<TransformChain>,
    pub bad: BTreeMap<BadMessage, BadCount>,
}

impl Intake {
    /// Of a recording whose messages name no frames.
    pub fn in_frames(pose: &str, wrench: &str) -> Self {
        Self { pose_frame: Some(pose.to_owned()), wrench_frame: Some(wrench.to_owned()), ..Self::default() }
    }

    pub fn take_chain(&mut self, chain: TransformChain) {
        self.pose_frame = Some(chain.base.clone());
        self.chain = Some(chain);
    }

    pub fn accept(&mut self, raw: &RawMessage, path: &Path, stamps: StampSource) -> Option<Record> {
        let decoded = self.decode(raw, stamps);
        if let Err(reason) = decoded {
            let holds = [raw.kind != TopicKind::Wrench, matches!(raw.kind, TopicKind::Wrench | TopicKind::State)];
            self.leave_out(reason, holds, path, raw.place);
        }
        decoded.ok().flatten()
    }

    /// Pose and wrench of a row of a table.
    pub fn accept_row(&mut self, row: Result<TableRow, BadMessage>, place: FilePlace, path: &Path) -> Option<Record> {
        match row {
            Ok(TableRow { pose, wrench }) => {
                let wrench = wrench.map(|wrench| Record::from(Message::Wrench(wrench)));
                let Some(pose) = pose else { return wrench };
                self.second = wrench;
                Some(Message::Pose(pose).into())
            }
            Err(reason) => {
                self.leave_out(reason, [true; 2], path, place);
                None
            }
        }
    }

    /// - `holds`: whether it holds a pose, and a wrench.
    fn leave_out(&mut self, reason: BadMessage, holds: [bool; 2], path: &Path, place: FilePlace) {
        let first = BadCount { poses: 0, wrenches: 0, path: path.to_owned(), place };
        let bad = self.bad.entry(reason).or_insert(first);
        bad.poses += u64::from(holds[0]);
        bad.wrenches += u64::from(holds[1]);
    }

    fn decode(&mut self, raw: &RawMessage, stamps: StampSource) -> Result<Option<Record>, BadMessage> {
        let stamped = |mut record: Record| {
            if stamps == StampSource::Log {
                record.set_stamp(raw.logged_ns);
            }
            record
        };
        match decode_raw(raw)? {
            Decoded::Record(frame, record) => {
                let is_wrench = raw.kind == TopicKind::Wrench;
                let first = if is_wrench { &mut self.wrench_frame } else { &mut self.pose_frame };
                in_one_frame(first, &frame)?;
                Ok(Some(stamped(record)))
            }
            Decoded::State(frame, pose, wrench) => {
                in_one_frame(&mut self.pose_frame, &frame)?;
                self.wrench_frame = Some(frame);
                self.second = Some(stamped(Message::Wrench(wrench).into()));
                Ok(Some(stamped(Message::Pose(pose).into())))
            }
            Decoded::Transforms(links) => {
                let Some(chain) = &mut self.chain else { return Ok(None) };
                let pose = chain.push(links, raw.kind == TopicKind::StaticTransforms)?;
                Ok(pose.map(|pose| stamped(Message::Pose(pose).into())))
            }
        }
    }
}

/// All messages of a topic name the frame that the first one named.
fn in_one_frame(first: &mut Option<String>, frame: &str) -> Result<(), BadMessage> {
    let is_first = first.get_or_insert_with(|| frame.to_owned()) == frame;
    if is_first { Ok(()) } else { Err(BadMessage::FrameChanged) }
}

/// Reads a message as the file has it.
pub(super) fn decode_raw(raw: &RawMessage) -> Result<Decoded, BadMessage> {
    match raw.format.wire {
        Wire::Cdr => decode(raw.format, &unpack(&raw.payload)?, raw.logged_ns),
        Wire::Ros1 => decode(raw.format, &raw.payload, raw.logged_ns),
    }
}
