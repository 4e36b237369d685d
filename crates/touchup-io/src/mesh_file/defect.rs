//! Defects inside a mesh file, and their places.

use std::fmt;

use crate::file_error::FilePlace;

/// The defect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Defect {
    /// An unexpected value of a field.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// allowed values
        expected: &'static str,
        /// the text found, shortened
        found: String,
    },
    /// Fewer bytes than the header asks for, or more.
    #[error(
        "the header announces {count} {what}, which take {needed} bytes, but {left} follow: {}, export it again",
        if *needed > *left as u128 { "the file is damaged or cut short" } else { "the count or the end is wrong" }
    )]
    Length {
        /// counted item
        what: String,
        /// announced number
        count: u64,
        /// minimum size of them, bytes
        needed: u128,
        /// available bytes
        left: usize,
    },
    /// A number of a missing vertex.
    #[error("a face uses vertex {vertex}, but there are only {vertices} vertices")]
    NoSuchVertex {
        /// as written in the file
        vertex: i64,
        /// number of vertices
        vertices: usize,
    },
    /// A polygon with crossing sides.
    #[error("the sides of a polygon cross: export the mesh in triangles")]
    SidesCross,
    /// An empty point file.
    #[error("no point in it: export it again with x, y and z of each point")]
    NoPoints,
    /// An error of the E57 reader.
    #[error("the E57 file is damaged or of a kind not known here ({reason}): export it again")]
    E57 {
        /// in its own words
        reason: String,
    },
}

/// A [`Defect`] with its [`FilePlace`].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Syntax {
    pub place: FilePlace,
    pub defect: Defect,
}

impl Syntax {
    /// `found` is shown on one line and shortened.
    pub fn unexpected(place: FilePlace, expected: &'static str, found: impl fmt::Display) -> Self {
        /// Enough to find it again.
        const SHOWN: usize = 40;
        let found = found.to_string();
        let shown: String = found
            .chars()
            .take(SHOWN)
            .flat_map(char::escape_debug)
            .collect();
        let more = if found.chars().count() > SHOWN {
            "…"
        } else {
            ""
        };
        Self {
            place,
            defect: Defect::Unexpected {
                expected,
                found: format!("'{shown}{more}'"),
            },
        }
    }

    /// A premature end of the file.
    pub fn ends(place: FilePlace, expected: &'static str) -> Self {
        Self {
            place,
            defect: Defect::Unexpected {
                expected,
                found: "the end of the file".into(),
            },
        }
    }
}
