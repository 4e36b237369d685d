//! Cut, flipped and crafted files: no panic, no memory taken on trust, an error that names the
//! file.

use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use touchup::io::recording::RecordingError;
use touchup::stylus::Message;

use crate::allocations::largest_request;
use crate::io::recordings::made::{Outcome, db3_of, mcap_bytes, put, read, touch};

/// The files here are below 1 MiB and unpack to less than 4; buffers grow by doubling, and readers
/// have their own.
const MAX_REQUEST_BYTES: usize = 16 << 20;

fn read_metered(path: &Path) -> Outcome {
    let (outcome, largest) = largest_request(|| read(path));
    assert!(
        largest < MAX_REQUEST_BYTES,
        "{largest} bytes in one request"
    );
    if let Some(error) = &outcome.error {
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(
            error.to_string().contains(name),
            "{error} does not name {name}"
        );
    }
    outcome
}

/// Whether `part` is `whole` with messages left out.
fn is_subsequence(part: &[Message], whole: &[Message]) -> bool {
    let mut whole = whole.iter();
    part.iter()
        .all(|message| whole.any(|other| other == message))
}

/// 30,000 messages: three chunks.
fn whole() -> (Vec<Message>, Vec<u8>) {
    let messages = touch(30_000);
    let bytes = mcap_bytes(&messages);
    (messages, bytes)
}

#[test]
#[ignore = "a slow proof"]
fn a_cut_mcap_gives_its_whole_chunks_and_then_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let (messages, bytes) = whole();
    let step = bytes.len() / 150;
    let lengths = (0..40)
        .chain((0..bytes.len()).step_by(step))
        .chain(bytes.len() - 300..bytes.len());
    let (mut last, mut silent) = (0, 0);
    for len in lengths {
        let outcome = read_metered(&put(folder.path(), "cut.mcap", &bytes[..len]));
        assert!(
            outcome.messages == messages[..outcome.messages.len()],
            "cut to {len} bytes"
        );
        last = last.max(outcome.messages.len());
        if outcome.error.is_none() {
            assert!(
                outcome.truncated && outcome.messages.len() == messages.len(),
                "cut to {len} bytes"
            );
            silent += 1;
        }
    }
    assert_eq!(last, messages.len());
    assert!(silent > 0, "a cut inside the index loses nothing");
}

#[test]
#[ignore = "a slow proof"]
fn every_bit_flip_of_an_mcap_is_found_or_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let (messages, bytes) = whole();
    let mut random = Pcg64::seed_from_u64(7);
    for flip in 0..400 {
        let mut bytes = bytes.clone();
        // half of them hit the structure
        let range = if flip % 2 == 0 { bytes.len() } else { 200 };
        let at = random.next_u64() as usize % range;
        bytes[at] ^= 1 << (random.next_u64() % 8);
        let outcome = read_metered(&put(folder.path(), "flipped.mcap", &bytes));
        assert!(is_subsequence(&outcome.messages, &messages), "byte {at}");
        assert!(
            outcome.error.is_some() || outcome.messages == messages,
            "byte {at}: loss without a word"
        );
    }
}

#[test]
fn lengths_that_lie_are_refused_before_memory_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let (_, bytes) = whole();
    // magic 8, header record 9 + n; the chunk: head 9, times 16, size 8, checksum 4, compression 4
    // + "zstd", packed 8
    let header_len = u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    let chunk = 8 + 9 + header_len;
    assert_eq!(bytes[chunk], 6, "a chunk");
    assert_eq!(&bytes[chunk + 41..chunk + 45], b"zstd");
    for (field, width) in [
        (chunk + 1, 8),
        (chunk + 25, 8),
        (chunk + 37, 4),
        (chunk + 45, 8),
        (9, 8),
    ] {
        for value in [u64::MAX, 1 << 62, 1 << 40, 0xffff_ffff, 255 << 20] {
            let mut bytes = bytes.clone();
            bytes[field..field + width].copy_from_slice(&value.to_le_bytes()[..width]);
            let outcome = read_metered(&put(folder.path(), "lying.mcap", &bytes));
            let error = outcome.error.expect("the length is a lie");
            assert!(matches!(error, RecordingError::Damaged { .. }), "{error}");
            assert!(outcome.messages.is_empty());
        }
    }
}

/// A thousand such chunks in a file of 50 kB would otherwise fill the memory with names.
#[test]
fn names_that_only_packing_makes_small_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = ::mcap::WriteOptions::new()
        .profile("ros2")
        .create(&mut file)
        .unwrap();
    let schema = writer
        .add_schema("std_msgs/msg/Empty", "ros2msg", b"")
        .unwrap();
    writer
        .add_channel(schema, &"x".repeat(1 << 20), "cdr", &Default::default())
        .unwrap();
    writer.finish().unwrap();
    drop(writer);
    let outcome = read_metered(&put(folder.path(), "names.mcap", &file.into_inner()));
    let error = outcome.error.expect("no topic is called that").to_string();
    assert!(
        error.contains("topic of a channel of 1048576 bytes, over the limit of 65536 bytes"),
        "{error}"
    );
}

/// An unchecked, uncompressed chunk whose message and names claim more than is there.
#[test]
fn records_that_overrun_an_unchecked_chunk_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let options = ::mcap::WriteOptions::new()
        .compression(None)
        .calculate_chunk_crcs(false)
        .profile("ros2");
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = options.create(&mut file).unwrap();
    let schema = writer
        .add_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b"")
        .unwrap();
    writer
        .add_channel(schema, "/stylus/pose", "cdr", &Default::default())
        .unwrap();
    writer.finish().unwrap();
    drop(writer);
    let bytes = file.into_inner();
    let name = bytes.windows(4).position(|w| w == b"geom").unwrap();
    // the schema's record length, and the length of its name
    for (field, width) in [(name - 4 - 2 - 8, 8), (name - 4, 4)] {
        let mut bytes = bytes.clone();
        bytes[field..field + width].copy_from_slice(&0xffff_fff0_u64.to_le_bytes()[..width]);
        // without the index the reader must search the chunk itself
        bytes.truncate(bytes.len() - 1);
        let outcome = read_metered(&put(folder.path(), "overrun.mcap", &bytes));
        assert!(
            matches!(outcome.error, Some(RecordingError::Damaged { .. })),
            "{:?}",
            outcome.error
        );
    }
}

#[test]
fn a_cut_or_flipped_db3_ends_in_an_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let messages = touch(3000);
    let path = folder.path().join("whole.db3");
    db3_of(&path, &mcap_bytes(&messages), <[u8]>::to_vec);
    let bytes = std::fs::read(&path).unwrap();
    assert!(read_metered(&path).messages == messages);
    let step = bytes.len() / 60;
    for len in (0..20).chain((0..bytes.len() - 1).step_by(step)) {
        let outcome = read_metered(&put(folder.path(), "cut.db3", &bytes[..len]));
        assert!(
            outcome.error.is_some(),
            "cut to {len} of {} bytes",
            bytes.len()
        );
        assert!(is_subsequence(&outcome.messages, &messages));
    }
    let mut random = Pcg64::seed_from_u64(11);
    let mut errors = 0;
    for _ in 0..300 {
        let mut bytes = bytes.clone();
        let at = random.next_u64() as usize % bytes.len();
        bytes[at] ^= 1 << (random.next_u64() % 8);
        let outcome = read_metered(&put(folder.path(), "flipped.db3", &bytes));
        errors += usize::from(outcome.error.is_some() || outcome.bad > 0);
        // SQLite has no checksums: a flipped digit is another number, but nothing multiplies
        assert!(outcome.messages.len() <= messages.len(), "byte {at}");
    }
    assert!(errors > 0);
}
