//! Further numbers of the vertices of a mesh.

use touchup_geometry::mesh::VertexColours;

/// One number for each vertex of a mesh, by id; a property of the vertices in a PLY file.
#[derive(Clone, Debug)]
pub struct VertexColumn {
    /// name of the property, with its unit
    pub name: &'static str,
    /// one per vertex of the mesh
    pub values: ColumnValues,
}

impl VertexColumn {
    /// A column for each colour, by the usual names.
    pub fn of_colours(colours: VertexColours) -> Vec<Self> {
        fn columns<const N: usize>(of: &[[u8; N]]) -> Vec<VertexColumn> {
            let column = |(at, name)| VertexColumn {
                name,
                values: of.iter().map(|c| c[at]).collect::<Vec<_>>().into(),
            };
            (0..N)
                .zip(["red", "green", "blue", "alpha"])
                .map(column)
                .collect()
        }
        match colours {
            VertexColours::Rgb(of) => columns(&of),
            VertexColours::Rgba(of) => columns(&of),
        }
    }
}

/// The numbers of a [`VertexColumn`], with their type in the file.
#[derive(Clone, Debug)]
pub enum ColumnValues {
    /// `float`
    Single(Vec<f32>),
    /// `uchar`, as for colours
    Byte(Vec<u8>),
}

impl From<Vec<f32>> for ColumnValues {
    fn from(values: Vec<f32>) -> Self {
        Self::Single(values)
    }
}

impl From<Vec<u8>> for ColumnValues {
    fn from(values: Vec<u8>) -> Self {
        Self::Byte(values)
    }
}
