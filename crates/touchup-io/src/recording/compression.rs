//! Signatures of compressed files and messages.

/// Start of a zstd frame: a file compressed as a whole, or a message (CDR begins with 0).
pub(super) const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
