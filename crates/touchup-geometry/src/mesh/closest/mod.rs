//! Closest face of a changing mesh: a bounding volume tree that is exact after every edit, and
//! never far from tight.
//!
//! A binary tree over the faces. Boxes have single precision relative to the middle of the mesh,
//! rounded outward, so pruning by them never misses a face; distances to faces have double
//! precision. [`FaceTree::refit`] recomputes the boxes of the leaves with moved faces and all boxes
//! above them; [`FaceTree::insert`] and [`FaceTree::remove`] do the same on one path to the root.
//! [`FaceTree::refit_planned`] may leave a margin, within which small motions cost nothing. As
//! boxes also shrink, no later tightening is necessary.

mod aabb;
mod build;
mod edit;
mod nearby;
mod query;
mod refit;

use nalgebra::Point3;

use super::{FaceId, TriMesh};
use aabb::Aabb;
pub(super) use aabb::greater;
pub use nearby::NearbyLeaves;
pub use query::{BoxQuery, FaceHit};
pub use refit::RefitPlan;

/// Maximum number of faces in a leaf. Two to four are equally fast within noise; four makes the
/// smallest tree.
const LEAF_FACES: usize = 4;
/// Slots of the traversal stack: one for each level, see [`edit`].
const STACK: usize = 96;
/// No node.
const NONE: u32 = u32::MAX;
/// The root node, which is in no pair.
const ROOT: u32 = u32::MAX >> 1;

/// One node over `count` faces: a leaf with its faces at `first` if they fit there, else an inner
/// node with the children in pair `first`.
#[derive(Clone, Copy, Debug)]
struct TreeNode {
    bounds: Aabb,
    first: u32,
    count: u32,
}

impl TreeNode {
    const NOTHING: Self = Self {
        bounds: Aabb::EMPTY,
        first: 0,
        count: 0,
    };

    /// The node above two nodes.
    #[inline]
    fn above(nodes: &[Self; 2], pair: u32) -> Self {
        let [left, right] = nodes;
        Self {
            bounds: left.bounds.union(&right.bounds),
            first: pair,
            count: left.count + right.count,
        }
    }

    #[inline]
    fn is_leaf(&self) -> bool {
        self.count <= LEAF_FACES as u32
    }
}

/// Two siblings share a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct SiblingNodes([TreeNode; 2]);

/// A face while a tree is built.
#[derive(Clone, Copy, Debug)]
struct Item {
    middle: [f32; 3],
    face: FaceId,
}

/// Bounding volume tree over the faces of one [`TriMesh`].
#[derive(Clone, Debug)]
pub struct FaceTree {
    origin: Point3<f64>,
    root: TreeNode,
    pairs: Vec<SiblingNodes>,
    /// node above each pair (2 · pair + side), or [`ROOT`]; in a free pair the next free one
    parents: Vec<u32>,
    /// faces of the leaves; in a free leaf the next free one
    leaf_faces: Vec<[FaceId; LEAF_FACES]>,
    /// leaf (2 · pair + side, or [`ROOT`]) of each face, [`NONE`] for faces not in the tree
    leaf_of_face: Vec<u32>,
    free_pair: u32,
    free_leaf: u32,
    /// buffer of the faces of a rebuild
    items: Vec<Item>,
    /// buffer of the leaf order of a rebuild
    lefts: Vec<u32>,
    /// number of insertions and removals, which tells a plan whether it is still valid
    edits: u64,
    /// number of edits and of refits after motions of unknown length
    changes: u64,
    /// sum over all other refits of the most by which their boxes widened, m; tells stored nearby
    /// leaves whether they are still valid
    widened: f64,
}

impl FaceTree {
    /// Number of levels; visits every node.
    pub fn depth(&self) -> usize {
        let (mut deepest, mut stack) = (1, vec![(&self.root, 1)]);
        while let Some((node, level)) = stack.pop() {
            deepest = deepest.max(level);
            if !node.is_leaf() {
                stack.extend(
                    self.pairs[node.first as usize]
                        .0
                        .iter()
                        .map(|child| (child, level + 1)),
                );
            }
        }
        deepest
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.pairs.capacity() * size_of::<SiblingNodes>()
            + (self.parents.capacity() + self.leaf_of_face.capacity() + self.lefts.capacity())
                * size_of::<u32>()
            + self.leaf_faces.capacity() * size_of::<[FaceId; LEAF_FACES]>()
            + self.items.capacity() * size_of::<Item>()
    }

    #[inline]
    fn node(&self, at: u32) -> &TreeNode {
        if at == ROOT {
            &self.root
        } else {
            &self.pairs[at as usize / 2].0[at as usize % 2]
        }
    }

    #[inline]
    fn node_mut(&mut self, at: u32) -> &mut TreeNode {
        if at == ROOT {
            &mut self.root
        } else {
            &mut self.pairs[at as usize / 2].0[at as usize % 2]
        }
    }

    #[inline]
    fn faces_of(&self, leaf: &TreeNode) -> &[FaceId] {
        &self.leaf_faces[leaf.first as usize][..leaf.count as usize]
    }

    /// The box around some faces.
    #[inline]
    fn bounds_of(&self, mesh: &TriMesh, faces: &[FaceId]) -> Aabb {
        Aabb::around(mesh, &self.origin, faces.iter().copied())
    }
}
