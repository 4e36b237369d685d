//! MCAP's framing: records of opcode and length, fields in little endian, every length checked
//! before use.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use crate::recording::Damage;

/// Longest record, packed or unpacked: far above the 1 MiB chunks of recorders, a small part of a
/// machine's memory.
const MAX_RECORD_BYTES: u64 = 256 << 20;
/// Longest name of a topic or type: the reader keeps all names, and packed bytes can pretend to be
/// long ones.
const MAX_TEXT_BYTES: u64 = 64 << 10;
/// Maximum total length of all topic and type names: many long ones would fill the memory.
const MAX_NAMES_BYTES: u64 = 16 << 20;
/// Opcode and length in front of every record.
pub(in crate::recording) const HEAD_BYTES: usize = 9;
/// Piece size for skipping unused records.
const SKIP_BYTES: u64 = 1 << 20;

/// Opcodes of the records in use.
pub(in crate::recording) mod op {
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const STATISTICS: u8 = 0x0b;
    pub const DATA_END: u8 = 0x0f;
}

/// A stored checksum of 0 means that none was computed.
pub(in crate::recording) fn check_crc(
    what: &'static str,
    stored: u32,
    computed: u32,
) -> Result<(), Damage> {
    if stored == 0 || stored == computed {
        Ok(())
    } else {
        Err(Damage::Checksum {
            what,
            stored,
            computed,
        })
    }
}

pub(in crate::recording) fn check_length(what: &'static str, bytes: u64) -> Result<(), Damage> {
    if bytes <= MAX_RECORD_BYTES {
        Ok(())
    } else {
        Err(Damage::TooLong {
            what,
            bytes,
            limit: MAX_RECORD_BYTES,
        })
    }
}

/// Total length of the stored names, limited to [`MAX_NAMES_BYTES`].
#[derive(Default)]
pub(in crate::recording) struct NameBytes(u64);

impl NameBytes {
    /// Adds a name of `bytes` in place of one of `replaced`.
    pub fn take(&mut self, bytes: usize, replaced: usize) -> Result<(), Damage> {
        self.0 = (self.0 + bytes as u64).saturating_sub(replaced as u64);
        if self.0 <= MAX_NAMES_BYTES {
            return Ok(());
        }
        Err(Damage::TooLong {
            what: "names of topics and types",
            bytes: self.0,
            limit: MAX_NAMES_BYTES,
        })
    }
}

/// The bytes of a file from front to end, with position and checksum.
pub(in crate::recording) struct ByteStream {
    input: Box<dyn Read + Send>,
    pub at: u64,
    /// Size of the file; unknown for a stream of unpacked bytes.
    size: Option<u64>,
    /// Checksum of everything up to here, without the head of the data end.
    pub crc: crc32fast::Hasher,
}

impl ByteStream {
    pub fn open(path: &Path, packed: bool) -> std::io::Result<Self> {
        let file = File::open(path)?;
        let size = if packed {
            None
        } else {
            Some(file.metadata()?.len())
        };
        let input: Box<dyn Read + Send> = if packed {
            Box::new(BufReader::new(zstd::Decoder::new(file)?))
        } else {
            Box::new(BufReader::new(file))
        };
        Ok(Self {
            input,
            at: 0,
            size,
            crc: crc32fast::Hasher::new(),
        })
    }

    /// Opcode and length of the next record; `None` at a file end between two records.
    pub fn head(&mut self) -> Result<Option<(u8, u64)>, Damage> {
        let mut head = Vec::with_capacity(HEAD_BYTES);
        let left = self
            .input
            .by_ref()
            .take(HEAD_BYTES as u64)
            .read_to_end(&mut head)? as u64;
        if left == 0 {
            return Ok(None);
        }
        let mut fields = Fields(&head);
        let cut = |_| Damage::Cut {
            wanted: HEAD_BYTES as u64,
            left,
        };
        let (opcode, len) = (
            fields.u8("opcode").map_err(cut)?,
            fields.u64("length").map_err(cut)?,
        );
        self.at += left;
        if opcode != op::DATA_END {
            self.crc.update(&head);
        }
        Ok(Some((opcode, len)))
    }

    /// Appends the next `len` bytes, a few; `false` if the file ends before them.
    pub fn front(&mut self, len: u64, into: &mut Vec<u8>) -> Result<bool, Damage> {
        let start = into.len();
        let left = self.input.by_ref().take(len).read_to_end(into)? as u64;
        if left > 0 && left < len {
            return Err(Damage::Cut { wanted: len, left });
        }
        self.at += left;
        self.crc.update(&into[start..]);
        Ok(left > 0)
    }

    /// Appends the next `len` bytes to `into`.
    pub fn load(&mut self, len: u64, into: &mut Vec<u8>) -> Result<(), Damage> {
        self.check_left(len)?;
        check_length("record", len)?;
        let start = into.len();
        let left = self.input.by_ref().take(len).read_to_end(into)? as u64;
        if left < len {
            return Err(Damage::Cut { wanted: len, left });
        }
        self.at += len;
        self.crc.update(&into[start..]);
        Ok(())
    }

    pub fn skip(&mut self, len: u64, scratch: &mut Vec<u8>) -> Result<(), Damage> {
        self.check_left(len)?;
        let mut left = len;
        while left > 0 {
            let piece = left.min(SKIP_BYTES);
            scratch.clear();
            self.load(piece, scratch)?;
            left -= piece;
        }
        Ok(())
    }

    fn check_left(&self, wanted: u64) -> Result<(), Damage> {
        match self.size.map(|size| size.saturating_sub(self.at)) {
            Some(left) if left < wanted => Err(Damage::Cut { wanted, left }),
            _ => Ok(()),
        }
    }
}

/// Opcode and body of the record at the front of `bytes`.
pub(in crate::recording) fn split_record(bytes: &[u8]) -> Result<(u8, &[u8]), Damage> {
    let mut fields = Fields(bytes);
    let (opcode, len) = (fields.u8("record")?, fields.u64("record")?);
    Ok((opcode, fields.bytes(len, "record")?))
}

/// The rest of a record; each call takes one little-endian field off its front.
pub(in crate::recording) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub fn bytes(&mut self, len: u64, what: &'static str) -> Result<&'a [u8], Damage> {
        let split = usize::try_from(len)
            .ok()
            .and_then(|len| self.0.split_at_checked(len));
        let (front, rest) = split.ok_or(Damage::Field(what))?;
        self.0 = rest;
        Ok(front)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], Damage> {
        let (front, rest) = self.0.split_first_chunk().ok_or(Damage::Field(what))?;
        self.0 = rest;
        Ok(*front)
    }

    /// A field with its length in front, in four bytes.
    pub fn sized(&mut self, what: &'static str) -> Result<&'a [u8], Damage> {
        let bytes = self.u32(what)?;
        self.bytes(bytes.into(), what)
    }

    pub fn u8(&mut self, what: &'static str) -> Result<u8, Damage> {
        self.array::<1>(what).map(|[byte]| byte)
    }

    pub fn u16(&mut self, what: &'static str) -> Result<u16, Damage> {
        self.array(what).map(u16::from_le_bytes)
    }

    pub fn u32(&mut self, what: &'static str) -> Result<u32, Damage> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub fn u64(&mut self, what: &'static str) -> Result<u64, Damage> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// Replaces invalid UTF-8: names only have to compare and print.
    pub fn text(&mut self, what: &'static str) -> Result<String, Damage> {
        let bytes = u64::from(self.u32(what)?);
        if bytes > MAX_TEXT_BYTES {
            return Err(Damage::TooLong {
                what,
                bytes,
                limit: MAX_TEXT_BYTES,
            });
        }
        Ok(String::from_utf8_lossy(self.bytes(bytes, what)?).into_owned())
    }
}
