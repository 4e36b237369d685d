//! Insertion and removal of faces: the tree stays exact, tight and shallow, and no edit costs more
//! than the path to the root.
//!
//! A new face goes down the path on which the boxes grow least. On the path back up each box
//! becomes the union of the two below it. A node with too small a share of its faces on one side is
//! rebuilt if it has few faces; else one of the two grandchildren on the heavy side moves to the
//! light side. Faces have no order in the tree, so one such step always suffices.

use super::aabb::Aabb;
use super::{FaceTree, NONE, ROOT, TreeNode};
use crate::mesh::{FaceId, MeshError, TriMesh};

/// Smallest share of a node's faces on each side (1/5). It is less than a split leaves at first
/// (1/4), which puts many edits between two repairs, and at most 1/3, or a grandchild would not
/// suffice. The depth is at most log(2^31 / 5) / log(5 / 4) + 2 = 91 levels.
const SMALLEST_SHARE: u64 = 5;
/// Largest rebuild in faces, one or two µs. Above it, both sides joined by [`FaceTree::lean`] are
/// large enough for an inner node and close enough in size; nine faces would do.
const MOST_REBUILT: u32 = 16;

impl FaceTree {
    /// Adds a face of `mesh`; call it after [`TriMesh::add_face`]. O(log F).
    ///
    /// Every face in the tree must still be in the mesh. Returns false if the mesh lacks the face
    /// or the tree already has it. Full arrays double, which copies them once and takes
    /// milliseconds on a large mesh: see [`Self::reserve`].
    pub fn insert(&mut self, mesh: &TriMesh, face: FaceId) -> bool {
        if !mesh.has_face(face) || self.has(face) {
            return false;
        }
        if self.leaf_of_face.len() <= face.0 as usize {
            self.leaf_of_face.resize(face.0 as usize + 1, NONE);
        }
        let bounds = self.bounds_of(mesh, &[face]);
        let at = self.leaf_for(&bounds, self.above_neighbour(mesh, face, &bounds));
        let leaf = *self.node(at);
        if let Some(place) = self.leaf_faces[leaf.first as usize].get_mut(leaf.count as usize) {
            *place = face;
            self.leaf_of_face[face.0 as usize] = at;
            *self.node_mut(at) = TreeNode {
                bounds: leaf.bounds.union(&bounds),
                count: leaf.count + 1,
                ..leaf
            };
        } else {
            self.rebuild(mesh, at, &[leaf], Some(face));
        }
        self.rebalance(mesh, at);
        true
    }

    /// Removes a face; call it before [`TriMesh::remove_face`], as it measures the neighbouring
    /// faces. O(log F).
    ///
    /// Every other face in the tree must still be in the mesh. Returns whether the tree had the
    /// face.
    pub fn remove(&mut self, mesh: &TriMesh, face: FaceId) -> bool {
        if !self.has(face) {
            return false;
        }
        let at = std::mem::replace(&mut self.leaf_of_face[face.0 as usize], NONE);
        let mut leaf = *self.node(at);
        leaf.count -= 1;
        let faces = &mut self.leaf_faces[leaf.first as usize];
        if let Some(place) = faces.iter().position(|&other| other == face) {
            faces.swap(place, leaf.count as usize);
        }
        leaf.bounds = self.bounds_of(mesh, self.faces_of(&leaf));
        *self.node_mut(at) = leaf;
        self.rebalance(mesh, at);
        true
    }

    /// Whether a face is in the tree.
    pub fn has(&self, face: FaceId) -> bool {
        self.leaf_of_face
            .get(face.0 as usize)
            .is_some_and(|&leaf| leaf != NONE)
    }

    /// Makes room for `faces` more faces; inserting them then allocates nothing.
    ///
    /// # Errors
    /// [`MeshError::TooMany`] if memory is short.
    pub fn reserve(&mut self, faces: usize) -> Result<(), MeshError> {
        let short = |_| MeshError::TooMany {
            what: "faces",
            count: faces,
        };
        self.leaf_of_face.try_reserve(faces).map_err(short)?;
        self.parents.try_reserve(faces / 2).map_err(short)?;
        self.pairs.try_reserve(faces / 2).map_err(short)?;
        self.leaf_faces.try_reserve(faces / 2).map_err(short)?;
        self.items
            .try_reserve(MOST_REBUILT as usize + 1)
            .map_err(short)?;
        self.lefts.try_reserve(MOST_REBUILT as usize).map_err(short)
    }

    /// The lowest node that encloses both a box and a face beside it: no node above it grows by the
    /// box, and it is quicker to find than from the root.
    fn above_neighbour(&self, mesh: &TriMesh, face: FaceId, bounds: &Aabb) -> u32 {
        let beside = mesh
            .corners(face)
            .into_iter()
            .flat_map(|vertex| mesh.star(vertex));
        let mut at = beside
            .copied()
            .find(|&other| self.has(other))
            .map_or(ROOT, |other| self.leaf_of_face[other.0 as usize]);
        while at != ROOT && !self.node(at).bounds.encloses(bounds) {
            at = self.parents[at as usize / 2];
        }
        at
    }

    /// The leaf below `at` on the path along which the boxes grow least by `bounds`.
    fn leaf_for(&self, bounds: &Aabb, mut at: u32) -> u32 {
        let mut node = self.node(at);
        while !node.is_leaf() {
            let children = &self.pairs[node.first as usize].0;
            let [left, right] = children.each_ref().map(|child| {
                let area = child.bounds.union(bounds).half_area();
                (area - child.bounds.half_area(), area)
            });
            let side = usize::from(right < left);
            (at, node) = (2 * node.first + side as u32, &children[side]);
        }
        at
    }

    /// Updates the nodes above `at` after a change below it.
    fn rebalance(&mut self, mesh: &TriMesh, mut at: u32) {
        self.edits += 1;
        self.changes += 1;
        // a local copy: writing a node and reading it again at once is slow
        let mut node = *self.node(at);
        while at != ROOT {
            let pair = at / 2;
            let sibling = self.pairs[pair as usize].0[1 - at as usize % 2];
            at = self.parents[pair as usize];
            let (count, lesser) = (node.count + sibling.count, node.count.min(sibling.count));
            let above = TreeNode {
                bounds: node.bounds.union(&sibling.bounds),
                first: pair,
                count,
            };
            *self.node_mut(at) = above;
            let is_lopsided = u64::from(lesser) * SMALLEST_SHARE < u64::from(count);
            if above.is_leaf() || (is_lopsided && count <= MOST_REBUILT) {
                self.give_pair_back(pair);
                self.rebuild(mesh, at, &[node, sibling], None);
                node = *self.node(at);
                continue;
            }
            if is_lopsided {
                self.lean(pair);
            }
            node = above;
        }
    }

    /// Moves one of the two grandchildren on the heavy side of a pair to the light side.
    ///
    /// ```text
    /// heavy(a, b), light  ->  a, (b, light)
    /// ```
    fn lean(&mut self, pair: u32) {
        let children = self.pairs[pair as usize].0;
        let heavy = usize::from(children[1].count > children[0].count);
        let light = children[1 - heavy];
        let inner = children[heavy].first;
        let grandchildren = self.pairs[inner as usize].0;
        let joined = grandchildren.map(|node| node.bounds.union(&light.bounds));
        let larger = usize::from(grandchildren[1].count > grandchildren[0].count);
        // the smaller one can always move; the larger one only if the staying one and the light one
        // are both large enough
        let (goes, stays) = (grandchildren[larger].count, grandchildren[1 - larger].count);
        let share = |part: u32, whole: u32| u64::from(part) * SMALLEST_SHARE >= u64::from(whole);
        let may_choose =
            share(stays, goes + stays + light.count) && share(light.count, goes + light.count);
        let over = if may_choose && joined[larger].half_area() < joined[1 - larger].half_area() {
            larger
        } else {
            1 - larger
        };
        let count = grandchildren[over].count + light.count;
        self.place(2 * pair + heavy as u32, grandchildren[1 - over]);
        self.place(2 * inner + 1 - over as u32, light);
        self.place(
            2 * pair + 1 - heavy as u32,
            TreeNode {
                bounds: joined[over],
                first: inner,
                count,
            },
        );
    }

    /// Writes a node and updates the parents of its children or faces.
    fn place(&mut self, at: u32, node: TreeNode) {
        *self.node_mut(at) = node;
        if node.is_leaf() {
            for &face in &self.leaf_faces[node.first as usize][..node.count as usize] {
                self.leaf_of_face[face.0 as usize] = at;
            }
        } else {
            self.parents[node.first as usize] = at;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::mesh::VertexId;

    /// Checks all numbers stored in the nodes from `at` down; returns the number of levels and of
    /// nodes.
    fn check(tree: &FaceTree, mesh: &TriMesh, at: u32, seen: &mut Vec<FaceId>) -> (usize, usize) {
        let node = *tree.node(at);
        if node.is_leaf() {
            let faces = tree.faces_of(&node);
            assert!(
                faces
                    .iter()
                    .all(|face| tree.leaf_of_face[face.0 as usize] == at),
                "faces know their leaf"
            );
            assert_eq!(node.bounds, tree.bounds_of(mesh, faces));
            assert!(node.count > 0 || at == ROOT);
            seen.extend_from_slice(faces);
            return (1, 1);
        }
        assert_eq!(tree.parents[node.first as usize], at);
        let [left, right] = tree.pairs[node.first as usize].0;
        assert_eq!(
            (node.bounds, node.count),
            (left.bounds.union(&right.bounds), left.count + right.count)
        );
        assert!(
            5 * left.count.min(right.count) >= node.count,
            "{} beside {}",
            left.count,
            right.count
        );
        let below = [0, 1].map(|side| check(tree, mesh, 2 * node.first + side, seen));
        (1 + below[0].0.max(below[1].0), 1 + below[0].1 + below[1].1)
    }

    /// Checks the whole tree; returns the number of levels.
    fn check_all(tree: &FaceTree, mesh: &TriMesh) -> usize {
        let mut seen = Vec::new();
        let (levels, nodes) = check(tree, mesh, ROOT, &mut seen);
        seen.sort_unstable();
        assert!(
            seen.iter().copied().eq(mesh.faces().map(|(face, _)| face)),
            "each face once"
        );
        let chain = |first: u32, next: &dyn Fn(u32) -> u32| {
            let there = |at: u32| Some(at).filter(|&at| at != NONE);
            std::iter::successors(there(first), |&at| there(next(at))).count()
        };
        let free_pairs = chain(tree.free_pair, &|pair| tree.parents[pair as usize]);
        let free_leaves = chain(tree.free_leaf, &|leaf| tree.leaf_faces[leaf as usize][0].0);
        assert_eq!(
            (tree.pairs.len(), tree.leaf_faces.len()),
            (nodes / 2 + free_pairs, nodes / 2 + 1 + free_leaves)
        );
        assert_eq!(levels, tree.depth());
        levels
    }

    /// A row of `count` triangles along x over the vertices of a strip.
    fn strip(count: u32) -> TriMesh {
        let positions = (0..count + 2)
            .map(|i| Point3::new(f64::from(i), f64::from(i % 2), 0.0))
            .collect();
        TriMesh::new(positions, (0..count).map(|i| [i, i + 1, i + 2]).collect()).unwrap()
    }

    /// The worst order for a tree without rebalancing: each face lies beyond the last.
    #[test]
    fn faces_inserted_in_a_row_leave_a_sound_and_shallow_tree() {
        let mut mesh = strip(1);
        let mut tree = FaceTree::new(&mesh);
        for i in 1..3_000u32 {
            let vertex = mesh
                .add_vertex(Point3::new(f64::from(i + 2), f64::from(i % 2), 0.0))
                .unwrap();
            let face = mesh
                .add_face([VertexId(vertex.0 - 2), VertexId(vertex.0 - 1), vertex])
                .unwrap();
            assert!(tree.insert(&mesh, face) && !tree.insert(&mesh, face));
            if i < 300 || i % 100 == 0 {
                let levels = check_all(&tree, &mesh);
                let most = (f64::from(i + 1) / 5.0).log(1.25).max(0.0) as usize + 2;
                assert!(levels <= most, "{levels} levels over {} faces", i + 1);
            }
        }
    }

    #[test]
    fn faces_removed_in_a_row_leave_a_sound_tree_until_none_is_left() {
        let mut mesh = strip(600);
        let mut tree = FaceTree::new(&mesh);
        for face in (0..600).map(FaceId) {
            assert!(tree.remove(&mesh, face) && !tree.remove(&mesh, face));
            mesh.remove_face(face);
            check_all(&tree, &mesh);
        }
        assert!(!tree.insert(&mesh, FaceId(0)), "not in the mesh");
        let face = mesh.add_face([0, 1, 2].map(VertexId)).unwrap();
        assert!(tree.insert(&mesh, face));
        check_all(&tree, &mesh);
        assert_eq!(
            tree.closest(&mesh, &Point3::origin(), 1.0)
                .map(|hit| hit.face),
            Some(face)
        );
    }
}
