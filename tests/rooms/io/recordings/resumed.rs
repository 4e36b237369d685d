//! A recording that breaks off, as by a crash, and goes on.

use std::fs;

use touchup::io::recording::{RecordingError, RecordingReader, SegmentedWriter, Topics};
use touchup::stylus::Message;

use super::made::touch;
use super::read_all;

const FRAMES: [&str; 2] = ["O", "T"];

fn write(writer: &mut SegmentedWriter, messages: &[Message]) {
    for message in messages {
        let is_wrench = matches!(message, Message::Wrench(_));
        writer
            .write(message, FRAMES[usize::from(is_wrench)])
            .unwrap();
    }
}

/// After a cut at any place everything flushed is there, and new messages follow it; the result has
/// its end.
#[test]
fn a_recording_that_was_cut_goes_on_behind_what_was_flushed() {
    let folder = tempfile::tempdir().unwrap();
    let (recording, topics) = (folder.path().join("recording"), Topics::default());
    let segment = recording.join("touch_0000.mcap");
    let messages = touch(60);
    let mut writer = SegmentedWriter::replace(&recording, &topics).unwrap();
    let lengths = [20, 40].map(|count| {
        write(&mut writer, &messages[count - 20..count]);
        writer.sync().unwrap();
        fs::metadata(&segment).unwrap().len() as usize
    });
    drop(writer);
    let bytes = fs::read(&segment).unwrap();
    assert!(0 < lengths[0] && lengths[0] < lengths[1] && lengths[1] < bytes.len());

    for cut in (0..bytes.len())
        .step_by(61)
        .chain(lengths)
        .chain([lengths[0] - 1, lengths[1] - 1])
    {
        fs::write(&segment, &bytes[..cut]).unwrap();
        let mut there = Vec::new();
        let mut writer = SegmentedWriter::resume(&recording, &topics, FRAMES, &mut |message| {
            there.push(*message)
        })
        .unwrap();
        // at least the flushed messages; of the rest all that is still readable
        let flushed = 20 * lengths.iter().filter(|length| **length <= cut).count();
        assert!(
            there.len() >= flushed && there.len() <= 40,
            "cut at {cut}: {}",
            there.len()
        );
        assert_eq!(there, messages[..there.len()], "cut at {cut}");
        write(&mut writer, &messages[40..]);
        writer.finish().unwrap();
        assert!(recording.join("metadata.yaml").exists());
        let all = [&there[..], &messages[40..]].concat();
        assert_eq!(read_all(&recording, &topics), all, "cut at {cut}");
        let reader = RecordingReader::open(&recording, &topics).unwrap();
        assert!(
            !reader.truncated() && reader.message_count() == Some(all.len() as u64),
            "cut at {cut}"
        );
        // and once more from the beginning
        SegmentedWriter::replace(&recording, &topics).unwrap();
        assert_eq!(fs::read_dir(&recording).unwrap().count(), 0);
    }
}

/// A file that failed to begin, as on a full disk, takes none before it along: messages that find
/// room later go behind them.
#[test]
fn a_file_that_could_not_be_begun_takes_no_other_along() {
    let folder = tempfile::tempdir().unwrap();
    let (messages, topics) = (touch(60), Topics::default());
    let mut writer = SegmentedWriter::new(folder.path(), &topics);
    write(&mut writer, &messages[..20]);
    assert_eq!((writer.flush().unwrap(), writer.give_up_segment()), (20, 0));
    // in the way, like a disk that takes no file
    let next = folder.path().join("touch_0001.mcap");
    fs::create_dir(&next).unwrap();
    for refused in &messages[20..23] {
        let written = writer.write(refused, FRAMES[0]);
        assert!(matches!(written, Err(RecordingError::NotWritten(_))));
        assert_eq!(writer.give_up_segment(), 0);
    }
    fs::remove_dir(&next).unwrap();
    write(&mut writer, &messages[23..]);
    writer.finish().unwrap();
    let kept = [&messages[..20], &messages[23..]].concat();
    assert_eq!(read_all(folder.path(), &topics), kept);
}
