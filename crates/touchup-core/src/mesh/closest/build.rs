//! Builds the tree over a mesh, or rebuilds it over the few faces below a node.

use nalgebra::Point3;

use super::aabb::{Aabb, greater, lesser};
use super::{FaceTree, Item, LEAF_FACES, NONE, ROOT, SiblingNodes, TreeNode};
use crate::mesh::{FaceId, TriMesh};
use crate::numeric::largest;

/// A split at the middle is taken only if it leaves at least this share on either side (1/4).
const SMALLEST_SHARE: usize = 4;
/// So few are halved by count, to fill two leaves: 3 bytes less for a face, and queries are no slower.
const FULL_LEAVES: usize = 2 * LEAF_FACES;

impl FaceTree {
    /// Builds the tree; O(F log F).
    pub fn new(mesh: &TriMesh) -> Self {
        let ([lo, hi], faces) = (mesh.bounds(), mesh.face_count());
        let mut tree = Self {
            origin: if mesh.positions().is_empty() { Point3::origin() } else { nalgebra::center(&lo, &hi) },
            root: TreeNode { bounds: Aabb::EMPTY, first: 0, count: 0 },
            pairs: Vec::with_capacity(faces / 2),
            parents: Vec::with_capacity(faces / 2),
            leaf_faces: Vec::with_capacity(faces / 2 + 1),
            leaf_of_face: vec![NONE; mesh.face_slots()],
            free_pair: NONE,
            free_leaf: NONE,
            items: Vec::new(),
            edits: 0,
            changes: 0,
            widened: 0.0,
        };
        let mut items: Vec<Item> = mesh.faces().map(|(face, _)| tree.item(mesh, face)).collect();
        tree.root = tree.build(mesh, &mut items, ROOT);
        tree
    }

    /// Rebuilds the subtree of node `at`, from the faces below `nodes` and one face more if there is one to add.
    pub(super) fn rebuild(&mut self, mesh: &TriMesh, at: u32, nodes: &[TreeNode], added: Option<FaceId>) {
        let mut items = std::mem::take(&mut self.items);
        nodes.iter().for_each(|&node| self.take_apart(mesh, node, &mut items));
        items.extend(added.map(|face| self.item(mesh, face)));
        *self.node_mut(at) = self.build(mesh, &mut items, at);
        items.clear();
        self.items = items;
    }

    fn build(&mut self, mesh: &TriMesh, items: &mut [Item], at: u32) -> TreeNode {
        if items.len() <= LEAF_FACES {
            let first = self.take_leaf();
            for (place, item) in self.leaf_faces[first as usize].iter_mut().zip(items.iter()) {
                *place = item.face;
                self.leaf_of_face[item.face.0 as usize] = at;
            }
            let bounds = self.bounds_of(mesh, &self.leaf_faces[first as usize][..items.len()]);
            return TreeNode { bounds, first, count: items.len() as u32 };
        }
        let split = split(items);
        let pair = self.take_pair(at);
        let (left, right) = items.split_at_mut(split);
        let children = [self.build(mesh, left, 2 * pair), self.build(mesh, right, 2 * pair + 1)];
        self.pairs[pair as usize] = SiblingNodes(children);
        TreeNode { bounds: children[0].bounds.union(&children[1].bounds), first: pair, count: items.len() as u32 }
    }

    /// Lists the faces below a node and gives back what holds them.
    fn take_apart(&mut self, mesh: &TriMesh, node: TreeNode, items: &mut Vec<Item>) {
        if node.is_leaf() {
            items.extend(self.faces_of(&node).iter().map(|&face| self.item(mesh, face)));
            self.give_leaf_back(node.first);
        } else {
            let SiblingNodes([left, right]) = self.pairs[node.first as usize];
            self.take_apart(mesh, left, items);
            self.take_apart(mesh, right, items);
            self.give_pair_back(node.first);
        }
    }

    fn item(&self, mesh: &TriMesh, face: FaceId) -> Item {
        let middle = mesh.barycentre(face) - self.origin;
        Item { middle: [middle.x as f32, middle.y as f32, middle.z as f32], face }
    }

    fn take_pair(&mut self, above: u32) -> u32 {
        let pair = self.free_pair;
        if pair != NONE {
            self.free_pair = std::mem::replace(&mut self.parents[pair as usize], above);
            return pair;
        }
        let blank = TreeNode { bounds: Aabb::EMPTY, first: 0, count: 0 };
        self.pairs.push(SiblingNodes([blank; 2]));
        self.parents.push(above);
        self.pairs.len() as u32 - 1
    }

    pub(super) fn give_pair_back(&mut self, pair: u32) {
        self.parents[pair as usize] = std::mem::replace(&mut self.free_pair, pair);
    }

    fn take_leaf(&mut self) -> u32 {
        let leaf = self.free_leaf;
        if leaf != NONE {
            self.free_leaf = self.leaf_faces[leaf as usize][0].0;
            return leaf;
        }
        self.leaf_faces.push([FaceId(NONE); LEAF_FACES]);
        self.leaf_faces.len() as u32 - 1
    }

    fn give_leaf_back(&mut self, leaf: u32) {
        self.leaf_faces[leaf as usize][0] = FaceId(std::mem::replace(&mut self.free_leaf, leaf));
    }
}

/// Sorts the items into two groups and gives the size of the first: at the middle of the longest axis, or by count
/// where that would be lopsided.
fn split(items: &mut [Item]) -> usize {
    let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter() {
        for i in 0..3 {
            lo[i] = lesser(lo[i], item.middle[i]);
            hi[i] = greater(hi[i], item.middle[i]);
        }
    }
    let extent: [f32; 3] = std::array::from_fn(|i| hi[i] - lo[i]);
    let axis = largest(&extent);
    let left = if items.len() > FULL_LEAVES { part(items, axis, lo[axis] + extent[axis] / 2.0) } else { 0 };
    if left.min(items.len() - left) * SMALLEST_SHARE >= items.len() {
        return left;
    }
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| a.middle[axis].total_cmp(&b.middle[axis]).then(a.face.cmp(&b.face)));
    half
}

/// Sorts the items into those below `middle` along an axis and the others; gives the number of the first.
fn part(items: &mut [Item], axis: usize, middle: f32) -> usize {
    let mut left = 0;
    for i in 0..items.len() {
        if items[i].middle[axis] < middle {
            items.swap(left, i);
            left += 1;
        }
    }
    left
}
