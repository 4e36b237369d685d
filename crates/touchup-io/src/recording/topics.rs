//! Topics of a recording against the required ones.

use std::path::Path;

use super::RecordingError;
use super::layout::{RecordingLayout, TopicInfo, TopicKind};
use super::messages::message_type::MessageFormat;

/// Checks that the required topics exist, and that the topics in use have suitable types.
pub(super) fn check_topics(
    path: &Path,
    layout: &RecordingLayout,
    found: &[TopicInfo],
) -> Result<(), RecordingError> {
    for kind in layout.needed() {
        if !found.iter().any(|info| layout.is_topic(kind, &info.name)) {
            let shown: Vec<_> = found
                .iter()
                .map(|info| format!("{} ({})", info.name, info.type_name))
                .collect();
            let found = if shown.is_empty() {
                "no topics".to_owned()
            } else {
                shown.join(", ")
            };
            let (path, topic) = (path.to_owned(), layout.topics.name(kind).to_owned());
            return Err(RecordingError::MissingTopic {
                path,
                topic,
                flag: kind.flag(),
                found,
            });
        }
    }
    found
        .iter()
        .try_for_each(|info| check_topic(path, layout, info).map(drop))
}

/// Content and format of a topic; `None` for unused ones.
pub(super) fn check_topic(
    path: &Path,
    layout: &RecordingLayout,
    info: &TopicInfo,
) -> Result<Option<(TopicKind, MessageFormat)>, RecordingError> {
    let Some(kind) = layout.kind_of(&info.name) else {
        return Ok(None);
    };
    let wrong = |why| RecordingError::WrongTopic {
        path: path.to_owned(),
        topic: info.name.clone(),
        why,
    };
    MessageFormat::of(info, kind)
        .map(|format| Some((kind, format)))
        .map_err(wrong)
}
