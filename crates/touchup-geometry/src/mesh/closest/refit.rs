//! Refits the boxes after vertices moved.

use super::{FaceTree, NONE, ROOT, STACK};
use crate::mesh::{FaceId, TriMesh};

/// Marks a pair already in a plan; pair numbers are below it.
const SEEN: u32 = 1 << 31;

/// The boxes of one tree that depend on certain faces: leaves, and the pairs above them from the
/// root down.
#[derive(Clone, Debug, Default)]
pub struct RefitPlan {
    faces: Vec<FaceId>,
    leaves: Vec<u32>,
    pairs: Vec<u32>,
    /// distance that corners of the faces may still move before one could leave its box, m
    room: f64,
    /// edit count of the tree at the time of planning
    edits: u64,
}

impl RefitPlan {
    /// A plan with room for `faces` faces.
    pub fn with_room(faces: usize) -> Self {
        // the paths to the root add about one level for each halving of the mesh
        let pairs = Vec::with_capacity(2 * faces + STACK);
        Self {
            faces: Vec::with_capacity(faces),
            leaves: Vec::with_capacity(faces),
            pairs,
            room: 0.0,
            edits: 0,
        }
    }

    /// Drops the remaining room in the boxes, as others may have moved the faces.
    #[inline]
    pub fn spend(&mut self) {
        self.room = 0.0;
    }
}

impl FaceTree {
    /// Makes the tree exact again after the corners of `faces` moved; repeated faces are allowed.
    pub fn refit(&mut self, mesh: &TriMesh, faces: &[FaceId]) {
        let mut plan = RefitPlan::default();
        self.plan(faces, &mut plan);
        self.refit_planned(mesh, &mut plan, f64::INFINITY, 0.0);
    }

    /// Plans the boxes that depend on `faces`, for [`Self::refit_planned`]; skips faces not in the
    /// tree.
    pub fn plan(&mut self, faces: &[FaceId], plan: &mut RefitPlan) {
        plan.faces.clear();
        plan.faces.extend_from_slice(faces);
        self.renew(plan);
    }

    /// Makes the tree exact again after the corners of the planned faces moved; renews a plan made
    /// before faces were inserted or removed.
    ///
    /// - `displacement`: largest motion of a corner since the last call with this plan, m; infinite
    ///   if unknown. If others moved corners in between, and refitted the tree, call
    ///   [`RefitPlan::spend`] first.
    /// - `margin`: extra width of the boxes, m. They stay as they are until corners may have left
    ///   them: a query stays exact and visits few more faces.
    #[inline]
    pub fn refit_planned(
        &mut self,
        mesh: &TriMesh,
        plan: &mut RefitPlan,
        displacement: f64,
        margin: f64,
    ) {
        if displacement <= plan.room && plan.edits == self.edits {
            plan.room -= displacement;
        } else {
            self.fit(mesh, plan, margin);
            if displacement.is_finite() {
                self.widened += displacement + margin;
            } else {
                self.changes += 1;
            }
        }
    }

    fn fit(&mut self, mesh: &TriMesh, plan: &mut RefitPlan, margin: f64) {
        if plan.edits != self.edits {
            self.renew(plan);
        }
        for &leaf in &plan.leaves {
            let node = *self.node(leaf);
            let bounds = self.bounds_of(mesh, self.faces_of(&node));
            self.node_mut(leaf).bounds = if margin > 0.0 {
                bounds.grown(margin)
            } else {
                bounds
            };
        }
        for &pair in plan.pairs.iter().rev() {
            let [left, right] = &self.pairs[pair as usize].0;
            let bounds = left.bounds.union(&right.bounds);
            self.node_mut(self.parents[pair as usize]).bounds = bounds;
        }
        plan.room = margin;
    }

    fn renew(&mut self, plan: &mut RefitPlan) {
        let RefitPlan {
            faces,
            leaves,
            pairs,
            room,
            edits,
        } = plan;
        (*room, *edits) = (0.0, self.edits);
        leaves.clear();
        leaves.extend(
            faces
                .iter()
                .filter_map(|face| self.leaf_of_face.get(face.0 as usize)),
        );
        leaves.dedup();
        leaves.sort_unstable();
        leaves.dedup();
        if leaves.last() == Some(&NONE) {
            leaves.pop();
        }
        pairs.clear();
        for &leaf in leaves.iter() {
            // the path up ends at the path of an earlier leaf, so parents come before children
            let (known, mut at) = (pairs.len(), leaf);
            while at != ROOT && self.parents[at as usize / 2] & SEEN == 0 {
                pairs.push(at / 2);
                let above = &mut self.parents[at as usize / 2];
                at = std::mem::replace(above, *above | SEEN);
            }
            pairs[known..].reverse();
        }
        pairs
            .iter()
            .for_each(|&pair| self.parents[pair as usize] &= !SEEN);
    }
}
