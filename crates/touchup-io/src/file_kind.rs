//! Kinds of files by the endings of their names.

use std::path::Path;

use touchup_method::names;

names! {
    /// Kind of a file by the ending of its name; its reader may know better by the content.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum FileKind {
        /// triangle mesh, or points
        Ply = "ply",
        /// triangle mesh
        Stl = "stl",
        /// triangle mesh
        Obj = "obj",
        /// points
        Pcd = "pcd",
        /// points as text
        Xyz = "xyz",
        /// points as text, or a table of a recording
        Txt = "txt",
        /// points as text
        Asc = "asc",
        /// points, in m by the standard
        E57 = "e57",
        /// recording of ROS 2
        Mcap = "mcap",
        /// recording of ROS 2
        Db3 = "db3",
        /// table
        Csv = "csv",
        /// table
        Tsv = "tsv",
        /// table
        Log = "log",
        /// table
        Parquet = "parquet",
        /// features, or nominal values
        Json = "json",
        /// inspection as QIF
        Xml = "xml",
    }
}

impl FileKind {
    /// Triangle meshes, read and written.
    pub const MESHES: [Self; 3] = [Self::Ply, Self::Stl, Self::Obj];
    /// Scans: meshes, then point clouds.
    pub(crate) const SCANS: [Self; 8] = [
        Self::Ply,
        Self::Stl,
        Self::Obj,
        Self::Pcd,
        Self::Xyz,
        Self::Txt,
        Self::Asc,
        Self::E57,
    ];

    /// Kind of a path, with letters of either case; `None` for other endings.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        Self::ALL
            .into_iter()
            .find(|kind| ending.eq_ignore_ascii_case(kind.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ending_in_either_case_is_a_kind_and_a_bare_name_is_none() {
        let of = |name: &str| FileKind::of(Path::new(name));
        assert_eq!(of("a/part.PlY"), Some(FileKind::Ply));
        assert_eq!(of("part.stl.csv"), Some(FileKind::Csv));
        for other in ["ply", ".ply", "part.", "part.ply.zst", "part.plyx", ""] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
