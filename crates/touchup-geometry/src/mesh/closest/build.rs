//! Builds the tree over a mesh, or rebuilds it over the few faces below a node.
//!
//! The faces are first sorted into the order of the leaves; then the nodes above them follow, both
//! sides at the same time as soon as their sizes are known.

use std::slice;
use std::sync::atomic::{AtomicU32, Ordering};

use nalgebra::Point3;

use super::aabb::{Aabb, greater, lesser};
use super::{FaceTree, Item, LEAF_FACES, NONE, ROOT, SiblingNodes, TreeNode};
use crate::mesh::{FaceId, SerialWorkers, Task, TriMesh, Workers};
use crate::numeric::largest;

/// Smallest share (1/4) on either side of a split at the middle; else the split is by count.
const SMALLEST_SHARE: usize = 4;
/// Up to this number, items are halved by count to fill two leaves: 3 bytes less for a face, with
/// queries as fast.
const FULL_LEAVES: usize = 2 * LEAF_FACES;
/// Smallest number of faces worth a thread.
const LEAST_FORKED: usize = 20_000;

impl FaceTree {
    /// Builds the tree; O(F log F).
    pub fn new(mesh: &TriMesh) -> Self {
        Self::new_by(mesh, &SerialWorkers)
    }

    /// [`Self::new`] by `workers`; the tree does not depend on them.
    pub fn new_by(mesh: &TriMesh, workers: &dyn Workers) -> Self {
        let [lo, hi] = mesh.bounds();
        let origin = if mesh.positions().is_empty() {
            Point3::origin()
        } else {
            nalgebra::center(&lo, &hi)
        };
        let mut items: Vec<Item> = mesh
            .faces()
            .map(|(face, _)| Item::of(mesh, face, &origin))
            .collect();
        // two pieces for each worker, as pieces differ in size
        let forks = if workers.count() > 1 {
            usize::BITS - workers.count().leading_zeros()
        } else {
            0
        };
        let order = LeafOrder::arrange(&mut items, forks, workers);
        let count = order.pairs();
        let (mut pairs, mut parents, mut leaf_faces) = (Vec::new(), Vec::new(), Vec::new());
        let mut leaf_of_face: Vec<AtomicU32> = Vec::new();
        // the job of a face writes its entry
        let blank = |slots| (0..slots).map(|_| AtomicU32::new(NONE)).collect();
        workers.run(vec![
            Box::new(|| pairs = vec![SiblingNodes([TreeNode::NOTHING; 2]); count]),
            Box::new(|| {
                (parents, leaf_faces) = (
                    vec![NONE; count],
                    vec![[FaceId(NONE); LEAF_FACES]; count + 1],
                );
                leaf_of_face = blank(mesh.face_slots());
            }),
        ]);
        let places = SubtreeSlices {
            pairs: &mut pairs,
            parents: &mut parents,
            leaf_faces: &mut leaf_faces,
            leaf_of_face: &leaf_of_face,
            first_pair: 0,
            first_leaf: 0,
        };
        let root = order.grow(&items, &Boxes { mesh, origin }, places, ROOT, workers);
        Self {
            origin,
            root,
            pairs,
            parents,
            leaf_faces,
            leaf_of_face: leaf_of_face
                .into_iter()
                .map(AtomicU32::into_inner)
                .collect(),
            free_pair: NONE,
            free_leaf: NONE,
            items: Vec::new(),
            lefts: Vec::new(),
            edits: 0,
            changes: 0,
            widened: 0.0,
        }
    }

    /// Rebuilds the subtree of node `at`, from the faces below `nodes` and an optional added face.
    pub(super) fn rebuild(
        &mut self,
        mesh: &TriMesh,
        at: u32,
        nodes: &[TreeNode],
        added: Option<FaceId>,
    ) {
        let (mut items, mut lefts) = (
            std::mem::take(&mut self.items),
            std::mem::take(&mut self.lefts),
        );
        nodes
            .iter()
            .for_each(|&node| self.take_apart(mesh, node, &mut items));
        items.extend(added.map(|face| Item::of(mesh, face, &self.origin)));
        arrange(&mut items, &mut lefts);
        let boxes = Boxes {
            mesh,
            origin: self.origin,
        };
        *self.node_mut(at) = grow(&items, &mut lefts.iter(), &boxes, self, at);
        items.clear();
        lefts.clear();
        (self.items, self.lefts) = (items, lefts);
    }

    /// Lists the faces below a node and frees its pairs and leaves.
    fn take_apart(&mut self, mesh: &TriMesh, node: TreeNode, items: &mut Vec<Item>) {
        if node.is_leaf() {
            items.extend(
                self.faces_of(&node)
                    .iter()
                    .map(|&face| Item::of(mesh, face, &self.origin)),
            );
            self.give_leaf_back(node.first);
        } else {
            let SiblingNodes([left, right]) = self.pairs[node.first as usize];
            self.take_apart(mesh, left, items);
            self.take_apart(mesh, right, items);
            self.give_pair_back(node.first);
        }
    }

    pub(super) fn give_pair_back(&mut self, pair: u32) {
        self.parents[pair as usize] = std::mem::replace(&mut self.free_pair, pair);
    }

    fn give_leaf_back(&mut self, leaf: u32) {
        self.leaf_faces[leaf as usize][0] = FaceId(std::mem::replace(&mut self.free_leaf, leaf));
    }
}

impl Item {
    fn of(mesh: &TriMesh, face: FaceId, origin: &Point3<f64>) -> Self {
        let middle = mesh.barycentre(face) - origin;
        Self {
            middle: [middle.x as f32, middle.y as f32, middle.z as f32],
            face,
        }
    }
}

/// Source of the boxes around faces.
struct Boxes<'a> {
    mesh: &'a TriMesh,
    origin: Point3<f64>,
}

impl Boxes<'_> {
    #[inline]
    fn around(&self, faces: impl Iterator<Item = FaceId>) -> Aabb {
        Aabb::around(self.mesh, &self.origin, faces)
    }
}

/// Storage of the nodes.
trait NodeStore {
    /// Allocates a pair of nodes below the node `above`.
    fn take_pair(&mut self, above: u32) -> u32;

    /// Writes a pair of nodes.
    fn put_pair(&mut self, pair: u32, nodes: SiblingNodes);

    /// Stores the faces of the leaf `at`, and returns their place.
    fn put_leaf(&mut self, items: &[Item], at: u32) -> u32;
}

/// Free places are used first.
impl NodeStore for FaceTree {
    fn take_pair(&mut self, above: u32) -> u32 {
        let pair = self.free_pair;
        if pair != NONE {
            self.free_pair = std::mem::replace(&mut self.parents[pair as usize], above);
            return pair;
        }
        self.pairs.push(SiblingNodes([TreeNode::NOTHING; 2]));
        self.parents.push(above);
        self.pairs.len() as u32 - 1
    }

    fn put_pair(&mut self, pair: u32, nodes: SiblingNodes) {
        self.pairs[pair as usize] = nodes;
    }

    fn put_leaf(&mut self, items: &[Item], at: u32) -> u32 {
        let leaf = match self.free_leaf {
            NONE => {
                self.leaf_faces.push([FaceId(NONE); LEAF_FACES]);
                self.leaf_faces.len() as u32 - 1
            }
            leaf => {
                self.free_leaf = self.leaf_faces[leaf as usize][0].0;
                leaf
            }
        };
        for (place, item) in self.leaf_faces[leaf as usize].iter_mut().zip(items) {
            *place = item.face;
            self.leaf_of_face[item.face.0 as usize] = at;
        }
        leaf
    }
}

/// The places of the nodes below one node, in order from the top down, left before right.
struct SubtreeSlices<'a> {
    pairs: &'a mut [SiblingNodes],
    parents: &'a mut [u32],
    leaf_faces: &'a mut [[FaceId; LEAF_FACES]],
    leaf_of_face: &'a [AtomicU32],
    /// first of these pairs in the whole tree
    first_pair: u32,
    /// first of these leaves in the whole tree
    first_leaf: u32,
}

/// The unused rest of some [`SubtreeSlices`].
struct PlacesLeft<'a> {
    all: SubtreeSlices<'a>,
    pairs: u32,
    leaves: u32,
}

impl NodeStore for PlacesLeft<'_> {
    fn take_pair(&mut self, above: u32) -> u32 {
        self.all.parents[self.pairs as usize] = above;
        self.pairs += 1;
        self.all.first_pair + self.pairs - 1
    }

    fn put_pair(&mut self, pair: u32, nodes: SiblingNodes) {
        self.all.pairs[(pair - self.all.first_pair) as usize] = nodes;
    }

    fn put_leaf(&mut self, items: &[Item], at: u32) -> u32 {
        for (place, item) in self.all.leaf_faces[self.leaves as usize]
            .iter_mut()
            .zip(items)
        {
            *place = item.face;
            self.all.leaf_of_face[item.face.0 as usize].store(at, Ordering::Relaxed);
        }
        self.leaves += 1;
        self.all.first_leaf + self.leaves - 1
    }
}

/// Number of items to the left of each inner node, from the top down, left before right.
enum LeafOrder {
    Whole(Vec<u32>),
    /// a node with an order for each side
    Forked(usize, Box<[LeafOrder; 2]>),
}

impl LeafOrder {
    /// Sorts the items into the order of the leaves.
    ///
    /// - `forks`: number of levels that split the items between two jobs.
    fn arrange(items: &mut [Item], forks: u32, workers: &dyn Workers) -> Self {
        if forks == 0 || items.len() < LEAST_FORKED {
            let mut lefts = Vec::with_capacity(items.len() / 2);
            arrange(items, &mut lefts);
            return Self::Whole(lefts);
        }
        let left = split(items);
        let (lower, upper) = items.split_at_mut(left);
        let mut sides = Box::new([const { Self::Whole(Vec::new()) }; 2]);
        let work = sides.iter_mut().zip([lower, upper]).map(|(side, items)| {
            Box::new(move || *side = Self::arrange(items, forks - 1, workers)) as Task<'_>
        });
        workers.run(work.collect());
        Self::Forked(left, sides)
    }

    /// Number of inner nodes.
    fn pairs(&self) -> usize {
        match self {
            Self::Whole(lefts) => lefts.len(),
            Self::Forked(_, sides) => 1 + sides[0].pairs() + sides[1].pairs(),
        }
    }

    /// Builds the node `at` over the sorted items, and the nodes below it.
    fn grow(
        &self,
        items: &[Item],
        boxes: &Boxes,
        places: SubtreeSlices,
        at: u32,
        workers: &dyn Workers,
    ) -> TreeNode {
        let (left, sides) = match self {
            Self::Whole(lefts) => {
                return grow(
                    items,
                    &mut lefts.iter(),
                    boxes,
                    &mut PlacesLeft {
                        all: places,
                        pairs: 0,
                        leaves: 0,
                    },
                    at,
                );
            }
            Self::Forked(left, sides) => (*left, sides),
        };
        let SubtreeSlices {
            pairs,
            parents,
            leaf_faces,
            leaf_of_face,
            first_pair: pair,
            first_leaf,
        } = places;
        let below = sides[0].pairs();
        let ((above, pairs), (parent, parents)) = (pairs.split_at_mut(1), parents.split_at_mut(1));
        let (pairs, parents) = (pairs.split_at_mut(below), parents.split_at_mut(below));
        let (leaf_faces, items) = (leaf_faces.split_at_mut(below + 1), items.split_at(left));
        let lower = SubtreeSlices {
            pairs: pairs.0,
            parents: parents.0,
            leaf_faces: leaf_faces.0,
            leaf_of_face,
            first_pair: pair + 1,
            first_leaf,
        };
        let upper = SubtreeSlices {
            pairs: pairs.1,
            parents: parents.1,
            leaf_faces: leaf_faces.1,
            leaf_of_face,
            first_pair: pair + 1 + below as u32,
            first_leaf: first_leaf + 1 + below as u32,
        };
        let mut nodes = [TreeNode::NOTHING; 2];
        let parts = [(items.0, lower, 2 * pair), (items.1, upper, 2 * pair + 1)];
        let work = nodes.iter_mut().zip(sides.iter()).zip(parts).map(
            |((node, side), (items, places, at))| {
                Box::new(move || *node = side.grow(items, boxes, places, at, workers)) as Task<'_>
            },
        );
        workers.run(work.collect());
        above[0] = SiblingNodes(nodes);
        parent[0] = at;
        TreeNode::above(&nodes, pair)
    }
}

/// Sorts the items into the order of the leaves, and lists the number of items to the left of each
/// inner node, from the top down, left before right.
fn arrange(items: &mut [Item], lefts: &mut Vec<u32>) {
    if items.len() <= LEAF_FACES {
        return;
    }
    let left = split(items);
    lefts.push(left as u32);
    let (lower, upper) = items.split_at_mut(left);
    arrange(lower, lefts);
    arrange(upper, lefts);
}

/// Builds the node `at` over the sorted items, and the nodes below it.
fn grow(
    items: &[Item],
    lefts: &mut slice::Iter<u32>,
    boxes: &Boxes,
    store: &mut impl NodeStore,
    at: u32,
) -> TreeNode {
    let left = if items.len() <= LEAF_FACES {
        None
    } else {
        lefts.next()
    };
    let Some(&left) = left else {
        let bounds = boxes.around(items.iter().map(|item| item.face));
        return TreeNode {
            bounds,
            first: store.put_leaf(items, at),
            count: items.len() as u32,
        };
    };
    let pair = store.take_pair(at);
    let (lower, upper) = items.split_at(left as usize);
    let nodes = [
        grow(lower, lefts, boxes, store, 2 * pair),
        grow(upper, lefts, boxes, store, 2 * pair + 1),
    ];
    store.put_pair(pair, SiblingNodes(nodes));
    TreeNode::above(&nodes, pair)
}

/// Sorts the items into two groups and returns the size of the first. The split is at the middle of
/// the longest axis, or by count if that would be lopsided.
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
    let left = if items.len() > FULL_LEAVES {
        part(items, axis, lo[axis] + extent[axis] / 2.0)
    } else {
        0
    };
    if left.min(items.len() - left) * SMALLEST_SHARE >= items.len() {
        return left;
    }
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        a.middle[axis]
            .total_cmp(&b.middle[axis])
            .then(a.face.cmp(&b.face))
    });
    half
}

/// Sorts the items into those below `middle` along an axis and the others; returns the number of
/// the first.
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

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::mesh::workers::ReversedWorkers;

    /// A wavy sheet with columns closer and closer, which makes splits at the middle lopsided;
    /// without every seventh face.
    fn sheet(columns: u32, rows: u32) -> TriMesh {
        let point = |i: u32, j: u32| {
            let (x, y) = (
                (f64::from(i) / f64::from(columns)).powi(3),
                f64::from(j) * 0.01,
            );
            Point3::new(x, y, 0.1 * (9.0 * x + 7.0 * y).sin())
        };
        let positions = (0..=rows)
            .flat_map(|j| (0..=columns).map(move |i| point(i, j)))
            .collect();
        let quad = |i: u32, j: u32| {
            let [a, b] = [j * (columns + 1) + i, (j + 1) * (columns + 1) + i];
            [[a, a + 1, b + 1], [a, b + 1, b]]
        };
        let faces = (0..rows)
            .flat_map(|j| (0..columns).flat_map(move |i| quad(i, j)))
            .collect();
        let mut mesh = TriMesh::new(positions, faces).unwrap();
        (0..mesh.face_slots() as u32)
            .step_by(7)
            .for_each(|face| assert!(mesh.remove_face(FaceId(face))));
        mesh
    }

    #[test]
    fn the_tree_is_the_same_by_any_number_of_workers() {
        for mesh in [sheet(300, 250), sheet(1, 1), sheet(1, 0)] {
            let alone = FaceTree::new(&mesh);
            for workers in 1..6 {
                let tree = FaceTree::new_by(&mesh, &ReversedWorkers(workers));
                assert!(
                    format!("{tree:?}") == format!("{alone:?}"),
                    "{} faces by {workers}",
                    mesh.face_count()
                );
            }
        }
    }

    #[test]
    fn a_tree_by_several_workers_finds_what_a_look_at_every_face_finds() {
        let mesh = sheet(120, 150);
        assert!(mesh.face_count() > LEAST_FORKED);
        let tree = FaceTree::new_by(&mesh, &ReversedWorkers(3));
        for i in 0..40 {
            let p = Point3::new(0.025 * f64::from(i), 0.03 * f64::from(i), 0.05);
            let off = |face| {
                (crate::mesh::triangle::closest_point(&p, &mesh.triangle(face)).0 - p)
                    .norm_squared()
            };
            let nearest = mesh
                .faces()
                .map(|(face, _)| off(face))
                .fold(f64::INFINITY, f64::min);
            let hit = tree.closest(&mesh, &p, f64::INFINITY).unwrap();
            assert!(
                (hit.distance_squared - nearest).abs() <= 1e-12 * nearest,
                "point {i}"
            );
        }
    }
}
