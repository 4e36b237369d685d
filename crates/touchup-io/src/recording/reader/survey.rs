//! Survey of a recording before reading.

use super::super::intake::decode_raw;
use super::super::messages::decode::MessageContent;
use super::super::messages::transforms::TransformTree;
use super::super::opening::open_file;
use super::super::topics::check_topics;
use super::super::{RecordingError, TransformFrames};
use super::RecordingReader;
use crate::recording::layout::TopicInfo;
use crate::recording::layout::TopicKind;
use crate::recording::recording_file::RecordingFile;

impl RecordingReader {
    /// Looks into every file once: topics, counts, missing ends. Returns the first, still open: it
    /// may be a packed one.
    pub(super) fn survey(&mut self) -> Result<Option<Box<dyn RecordingFile>>, RecordingError> {
        let mut first = None;
        let mut found: Vec<TopicInfo> = Vec::new();
        let mut first_damage = None;
        for file in &self.rest {
            let (source, damage) = open_file(file, &self.layout)?;
            first_damage = first_damage.or(damage);
            self.truncated |= source.truncated();
            self.message_count = self
                .message_count
                .zip(source.promised())
                .map(|(a, b)| a.saturating_add(b));
            found.extend(source.topics());
            found.sort_unstable();
            found.dedup();
            first = first.or(Some(source));
        }
        match (check_topics(&self.path, &self.layout, &found), first_damage) {
            (Err(RecordingError::MissingTopic { .. }), Some(damage)) => Err(damage),
            (checked, _) => checked.map(|()| first),
        }
    }

    /// The needed part of the tree of transforms; up to the damage of a damaged file.
    pub(super) fn read_tree(mut self, frames: &TransformFrames) -> TransformTree {
        let mut tree = TransformTree::default();
        while !tree.is_enough(frames)
            && let Some(source) = &mut self.source
        {
            match source.next_message() {
                Ok(Some(raw)) => {
                    if let Ok(MessageContent::Transforms(links)) = decode_raw(&raw) {
                        tree.add(links, raw.kind == TopicKind::StaticTransforms);
                    }
                }
                Ok(None) => {
                    let next = self
                        .rest
                        .pop_front()
                        .and_then(|path| open_file(&path, &self.layout).ok());
                    self.source = next.map(|(source, _)| source);
                }
                Err(_) => break,
            }
        }
        tree
    }
}
