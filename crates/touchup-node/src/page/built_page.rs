//! The files of the page, which npm built from `web/` at compile time.

/// A file of the page.
#[derive(Debug)]
pub(super) struct PageFile {
    /// without a folder
    pub name: &'static str,
    pub content_type: &'static str,
    pub bytes: &'static [u8],
    /// compressed content, if smaller
    pub gzip: Option<&'static [u8]>,
}

include!(concat!(env!("OUT_DIR"), "/page.rs"));
