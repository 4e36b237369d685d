//! From messages and rows of a recording to records, and counts of unusable ones.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

use super::FilePlace;
use super::error::BadCount;
use super::messages::cdr::unpack;
use super::messages::decode::{MessageContent, decode};
use super::messages::transforms::TransformChain;
use super::messages::wire::WireFormat;
use super::tables::number_table::TableRow;
use crate::recording::error::BadMessage;
use crate::recording::layout::TopicKind;
use crate::recording::record::Record;
use crate::recording::record::StampSource;
use crate::recording::recording_file::RawMessage;
use touchup_method::stylus::Message;

/// Decodes messages, and counts frames and unusable messages.
#[derive(Default)]
pub(super) struct Intake {
    pub pose_frame: Option<String>,
    pub wrench_frame: Option<String>,
    /// further records of a message that gives several
    pub others: VecDeque<Record>,
    /// source of poses from transforms
    chain: Option<TransformChain>,
    pub bad: BTreeMap<BadMessage, BadCount>,
}

impl Intake {
    /// For a recording whose messages name no frames.
    pub fn in_frames(pose: &str, wrench: &str) -> Self {
        Self {
            pose_frame: Some(pose.to_owned()),
            wrench_frame: Some(wrench.to_owned()),
            ..Self::default()
        }
    }

    pub fn take_chain(&mut self, chain: TransformChain) {
        self.pose_frame = Some(chain.poses.base().to_owned());
        self.chain = Some(chain);
    }

    pub fn accept(&mut self, raw: &RawMessage, path: &Path, stamps: StampSource) -> Option<Record> {
        let decoded = self.decode(raw, stamps);
        if let Err(reason) = decoded {
            let holds = [
                raw.kind != TopicKind::Wrench,
                matches!(raw.kind, TopicKind::Wrench | TopicKind::State),
            ];
            self.leave_out(reason, holds, path, raw.place);
        }
        if raw.kind == TopicKind::Transforms {
            self.count_apart(path, raw.place);
        }
        decoded.ok().flatten()
    }

    /// Ends the recording: records that wait for transforms get none.
    pub fn finish(&mut self) {
        self.chain.iter_mut().for_each(|chain| chain.poses.finish());
    }

    /// Number of poses from interpolated transforms, and of stamps outside of the transforms'
    /// range.
    pub fn transform_counts(&self) -> Option<[u64; 2]> {
        self.chain
            .as_ref()
            .map(|chain| [chain.poses.interpolated, chain.poses.outside])
    }

    /// Counts the stamps for which the transforms give no pose.
    fn count_apart(&mut self, path: &Path, place: FilePlace) {
        let apart = self
            .chain
            .as_mut()
            .map_or(0, |chain| chain.poses.take_apart());
        (0..apart)
            .for_each(|_| self.leave_out(BadMessage::TransformsApart, [true, false], path, place));
    }

    /// Pose and wrench of a row of a table.
    pub fn accept_row(
        &mut self,
        row: Result<TableRow, BadMessage>,
        place: FilePlace,
        path: &Path,
    ) -> Option<Record> {
        match row {
            Ok(TableRow { pose, wrench }) => {
                let wrench = wrench.map(|wrench| Record::from(Message::Wrench(wrench)));
                let Some(pose) = pose else { return wrench };
                self.others.extend(wrench);
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
        let first = BadCount {
            poses: 0,
            wrenches: 0,
            path: path.to_owned(),
            place,
        };
        let bad = self.bad.entry(reason).or_insert(first);
        bad.poses += u64::from(holds[0]);
        bad.wrenches += u64::from(holds[1]);
    }

    fn decode(
        &mut self,
        raw: &RawMessage,
        stamps: StampSource,
    ) -> Result<Option<Record>, BadMessage> {
        let logged_ns = (stamps == StampSource::Log).then_some(raw.logged_ns);
        let stamped = |mut record: Record| {
            logged_ns
                .into_iter()
                .for_each(|logged_ns| record.set_stamp(logged_ns));
            record
        };
        match decode_raw(raw)? {
            MessageContent::Record(frame, record) => {
                let is_wrench = raw.kind == TopicKind::Wrench;
                let first = if is_wrench {
                    &mut self.wrench_frame
                } else {
                    &mut self.pose_frame
                };
                in_one_frame(first, &frame)?;
                Ok(Some(stamped(record)))
            }
            MessageContent::State(state) => {
                let [pose, wrench] = *state;
                if raw.kind != TopicKind::Wrench {
                    in_one_frame(&mut self.pose_frame, &pose.frame)?;
                }
                if raw.kind != TopicKind::Pose {
                    in_one_frame(&mut self.wrench_frame, &wrench.frame)?;
                }
                let [pose, wrench] = [pose, wrench].map(|one| stamped(one.message.into()));
                match raw.kind {
                    TopicKind::Wrench => return Ok(Some(wrench)),
                    TopicKind::Pose => {}
                    _ => self.others.push_back(wrench),
                }
                Ok(Some(pose))
            }
            MessageContent::Transforms(links) => {
                let Some(chain) = &mut self.chain else {
                    return Ok(None);
                };
                // the newest of several stamps is the one recorded now
                let newest_ns = links
                    .iter()
                    .map(|link| link.stamp_ns)
                    .max()
                    .unwrap_or_default();
                let shift_ns = logged_ns.map_or(0, |logged_ns| logged_ns.saturating_sub(newest_ns));
                chain.push(links, raw.kind == TopicKind::StaticTransforms)?;
                while let Some(mut pose) = chain.next_pose() {
                    pose.stamp_ns = pose.stamp_ns.saturating_add(shift_ns);
                    self.others.push_back(Message::Pose(pose).into());
                }
                Ok(self.others.pop_front())
            }
        }
    }
}

/// All messages of a topic must name the frame of the first.
fn in_one_frame(first: &mut Option<String>, frame: &str) -> Result<(), BadMessage> {
    let is_first = first.get_or_insert_with(|| frame.to_owned()) == frame;
    if is_first {
        Ok(())
    } else {
        Err(BadMessage::FrameChanged)
    }
}

/// Reads a message as stored.
pub(super) fn decode_raw(raw: &RawMessage) -> Result<MessageContent, BadMessage> {
    match raw.format.wire {
        WireFormat::Cdr => decode(raw.format, &unpack(&raw.payload)?, raw.logged_ns),
        WireFormat::Ros1 => decode(raw.format, &raw.payload, raw.logged_ns),
    }
}
