//! Bodies of a mesh: a screw in a hole does not close the hole.
//!
//! A body is a piece of the mesh without a border. Queries around a body use its own faces alone.
//! Pieces with a border are parts of one another, as in a scan: their queries use the whole mesh.

use nalgebra::Point3;

use super::facets::{Facets, NONE};
use super::rays::Rays;
use touchup_geometry::mesh::{FaceId, FaceTree, TriMesh};
use touchup_geometry::numeric::{DisjointSets, distinct};

/// The closed pieces of a mesh with more than one piece.
#[derive(Default)]
pub(in crate::features) struct Bodies {
    /// number of the piece of each face; empty for a single piece
    piece_of: Vec<u32>,
    /// body of each piece, `None` if it has a border; empty for a single piece
    bodies: Vec<Option<ClosedBody>>,
}

struct ClosedBody {
    mesh: TriMesh,
    tree: FaceTree,
    /// ids of its faces in the whole mesh
    faces: Vec<u32>,
}

/// Surroundings of a place: its body, or the whole mesh.
#[derive(Clone, Copy)]
pub(in crate::features) struct Surroundings<'a> {
    mesh: &'a TriMesh,
    tree: &'a FaceTree,
    /// ids in the whole mesh, for a body
    faces: Option<&'a [u32]>,
}

impl Bodies {
    pub(crate) fn of(facets: &Facets) -> Self {
        let (piece_of, pieces) = pieces(facets);
        if pieces.len() < 2 {
            return Self::default();
        }
        let body = |faces: Vec<u32>| {
            let is_closed = faces
                .iter()
                .all(|&face| !facets.beside[face as usize].contains(&NONE));
            let mesh = is_closed.then(|| part(facets.mesh, &faces)).flatten()?;
            Some(ClosedBody {
                tree: FaceTree::new(&mesh),
                mesh,
                faces,
            })
        };
        Self {
            piece_of,
            bodies: pieces.into_iter().map(body).collect(),
        }
    }

    /// Number of the piece of a face.
    pub(crate) fn piece_of(&self, face: u32) -> u32 {
        self.piece_of.get(face as usize).copied().unwrap_or(0)
    }

    /// Surroundings of a face.
    pub(crate) fn around<'a>(
        &'a self,
        face: Option<u32>,
        mesh: &'a TriMesh,
        tree: &'a FaceTree,
    ) -> Surroundings<'a> {
        match face.and_then(|face| self.bodies.get(self.piece_of(face) as usize)?.as_ref()) {
            Some(ClosedBody { mesh, tree, faces }) => Surroundings {
                mesh,
                tree,
                faces: Some(faces),
            },
            None => Surroundings {
                mesh,
                tree,
                faces: None,
            },
        }
    }
}

impl<'a> Surroundings<'a> {
    /// The face closest to `p` within `reach`, m.
    pub(crate) fn closest(&self, p: &Point3<f64>, reach: f64) -> Option<u32> {
        let face = self.tree.closest(self.mesh, p, reach)?.face.0;
        Some(self.faces.map_or(face, |faces| faces[face as usize]))
    }

    /// - `piece`: as in [`Rays::new`], m.
    pub(crate) fn rays(&self, piece: f64) -> Rays<'a> {
        Rays::new(self.mesh, self.tree, piece, self.faces)
    }
}

/// The piece of each face, and the faces of each piece: faces connected over edges with two faces.
fn pieces(facets: &Facets) -> (Vec<u32>, Vec<Vec<u32>>) {
    let mut sets = DisjointSets::of(facets.slots());
    for (FaceId(face), _) in facets.mesh.faces() {
        let beside = facets.beside[face as usize]
            .iter()
            .filter(|&&other| other != NONE);
        beside.for_each(|&other| sets.join(face, other));
    }
    let (mut piece_of, mut faces) = (vec![NONE; facets.slots()], Vec::new());
    for (FaceId(face), _) in facets.mesh.faces() {
        // the root of a piece is its lowest face, so it already has its number
        let root = sets.root(face);
        if root == face {
            piece_of[face as usize] = faces.len() as u32;
            faces.push(Vec::new());
        }
        let piece = piece_of[root as usize];
        piece_of[face as usize] = piece;
        faces[piece as usize].push(face);
    }
    (piece_of, faces)
}

/// Some faces of a mesh as a mesh of their own.
fn part(mesh: &TriMesh, faces: &[u32]) -> Option<TriMesh> {
    let vertices = distinct(faces.iter().flat_map(|&face| mesh.corners(FaceId(face))));
    let number = |vertex| vertices.binary_search(&vertex).map(|at| at as u32).ok();
    let renumbered = faces.iter().map(|&face| {
        let [a, b, c] = mesh.corners(FaceId(face)).map(number);
        Some([a?, b?, c?])
    });
    let positions = vertices
        .iter()
        .map(|&vertex| mesh.position(vertex))
        .collect();
    TriMesh::new(positions, renumbered.collect::<Option<_>>()?).ok()
}
