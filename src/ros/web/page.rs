//! The files of the page, as npm built them from `web/` when the program was compiled.

/// A file of the page.
#[derive(Debug)]
pub(super) struct PageFile {
    /// without a folder
    pub name: &'static str,
    pub content_type: &'static str,
    pub bytes: &'static [u8],
    /// the same compressed, where that is smaller
    pub gzip: Option<&'static [u8]>,
}

include!(concat!(env!("OUT_DIR"), "/page.rs"));
