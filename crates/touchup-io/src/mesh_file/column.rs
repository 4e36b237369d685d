//! Further numbers of the vertices of a mesh.

/// One number for each vertex of a mesh, by id; a property of the vertices in a PLY file.
#[derive(Clone, Debug)]
pub struct VertexColumn {
    /// name of the property, with its unit
    pub name: &'static str,
    /// as many as the mesh has vertices
    pub values: ColumnValues,
}

/// The numbers of a [`VertexColumn`], with their type in the file.
#[derive(Clone, Debug)]
pub enum ColumnValues {
    /// `float`
    Single(Vec<f32>),
    /// `uchar`, as colours are
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
