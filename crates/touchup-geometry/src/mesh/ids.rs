//! Ids of the faces and vertices of one mesh.

/// A face of one [`super::TriMesh`]; stays valid until that face is removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FaceId(pub u32);

/// A vertex of one [`super::TriMesh`]; stays valid until that vertex is removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);
