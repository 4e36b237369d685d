//! What can be wrong inside a mesh file, and where.

use std::fmt;

use crate::file_error::FilePlace;

/// The defect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Defect {
    /// The field has another value.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// what could have been read
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
        /// what is counted
        what: String,
        /// how many there should be
        count: u64,
        /// bytes they take at least
        needed: u128,
        /// bytes there are
        left: usize,
    },
    /// A vertex number that names no vertex.
    #[error("a face uses vertex {vertex}, but there are only {vertices} vertices")]
    NoSuchVertex {
        /// as written in the file
        vertex: i64,
        /// how many there are
        vertices: usize,
    },
    /// A polygon that is none.
    #[error("the sides of a polygon cross: export the mesh in triangles")]
    SidesCross,
    /// A file of points without one.
    #[error("no point in it: export it again with x, y and z of each point")]
    NoPoints,
    /// What the reader of E57 files says.
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

    /// The file ends here.
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
