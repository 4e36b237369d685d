//! Queries in close succession: they keep the leaves around the last query, and visit them without
//! a descent from the root.

use nalgebra::Point3;

use super::query::{SearchState, is_less_square, surface_hit};
use super::{FaceHit, FaceTree, ROOT, STACK};
use crate::mesh::triangle::{closest_point, longest_edge_squared};
use crate::mesh::{FaceId, TriMesh};

/// Factor of the reach of a query with a hint over the distance to the hinted face.
const HINT_WIDTH: f64 = 1.0 + 1e-6;
/// Maximum number of stored leaves: checking the boxes of more takes as long as a descent from the
/// root.
const MOST_LEAVES: usize = 64;
/// Distance beyond a query up to which leaves are stored, in longest edges of the hinted face.
const EDGES_BEYOND: f64 = 0.7;

/// The leaves of one tree that meet a ball, for [`FaceTree::closest_nearby`].
#[derive(Clone, Debug)]
pub struct NearbyLeaves {
    leaves: Vec<u32>,
    centre: Point3<f64>,
    /// m; negative if nothing is stored
    radius: f64,
    /// `changes` and `widened` of the tree at the time of storing
    changes: u64,
    widened: f64,
    /// face with too many leaves around it
    crowded: Option<FaceId>,
}

impl Default for NearbyLeaves {
    fn default() -> Self {
        let leaves = Vec::with_capacity(MOST_LEAVES);
        Self {
            leaves,
            centre: Point3::origin(),
            radius: -1.0,
            changes: 0,
            widened: 0.0,
            crowded: None,
        }
    }
}

impl FaceTree {
    /// [`Self::closest`] of a point likely near `hint` and near the last query with `nearby`: the
    /// same answer, sooner.
    ///
    /// - `nearby`: for this tree alone.
    pub fn closest_nearby(
        &self,
        mesh: &TriMesh,
        p: &Point3<f64>,
        hint: FaceId,
        reach: f64,
        nearby: &mut NearbyLeaves,
    ) -> Option<FaceHit> {
        let triangle = mesh.triangle(hint);
        // a little farther, to include the hint itself; a touching point still has some reach
        let known =
            (p - closest_point(p, &triangle).0).norm() * HINT_WIDTH + f64::MIN_POSITIVE.sqrt();
        let reach = reach.min(known);
        // a box not met at that time can be met now by at most the widening of all boxes since
        let away = (p - nearby.centre).norm() + (self.widened - nearby.widened);
        let is_kept = nearby.changes == self.changes && away + reach <= nearby.radius;
        if !is_kept {
            let is_crowded = nearby.crowded == Some(hint);
            let beyond = EDGES_BEYOND * longest_edge_squared(&triangle).sqrt();
            if is_crowded || !self.keep_near(p, reach + beyond, nearby) {
                nearby.crowded = Some(hint);
                return self.closest(mesh, p, reach);
            }
        }
        let mut found = SearchState::new(self, p, reach);
        for &leaf in &nearby.leaves {
            let leaf = self.node(leaf);
            if leaf.bounds.distance_squared(&found.q) <= found.far {
                let faces = self.faces_of(leaf);
                found.take(
                    faces,
                    |face, limit| surface_hit(mesh, p, face, limit),
                    |a, b| is_less_square(mesh, p, a, b),
                );
            }
        }
        found.best
    }

    /// Stores the leaves that meet the ball around `p`; returns whether they are few enough.
    fn keep_near(&self, p: &Point3<f64>, radius: f64, nearby: &mut NearbyLeaves) -> bool {
        let ball = SearchState::new(self, p, radius);
        (nearby.radius, nearby.crowded) = (-1.0, None);
        nearby.leaves.clear();
        let mut stack = [ROOT; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (at, node) = (stack[depth], self.node(stack[depth]));
            if node.is_leaf() {
                if nearby.leaves.len() == MOST_LEAVES {
                    return false;
                }
                nearby.leaves.push(at);
                continue;
            }
            for (side, child) in (0..).zip(&self.pairs[node.first as usize].0) {
                stack[depth] = 2 * node.first + side;
                depth += usize::from(child.bounds.distance_squared(&ball.q) <= ball.far);
            }
        }
        (nearby.centre, nearby.radius, nearby.changes, nearby.widened) =
            (*p, radius, self.changes, self.widened);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of 1 m, two triangles each.
    fn plane(squares: u32) -> TriMesh {
        let n = squares + 1;
        let positions = (0..n * n)
            .map(|i| Point3::new(f64::from(i % n), f64::from(i / n), 0.0))
            .collect();
        let corners = (0..squares * squares).map(|i| i / squares * n + i % squares);
        let faces = corners
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        TriMesh::new(positions, faces).unwrap()
    }

    #[test]
    fn leaves_are_kept_as_long_as_the_point_stays_near_and_no_box_can_have_come_near() {
        let mut mesh = plane(20);
        let (mut tree, mut nearby) = (FaceTree::new(&mesh), NearbyLeaves::default());
        let ask = |tree: &FaceTree, mesh: &TriMesh, x: f64, nearby: &mut NearbyLeaves| {
            let p = Point3::new(x, 10.3, 0.01);
            let hit = tree.closest_nearby(mesh, &p, FaceId(420), f64::INFINITY, nearby);
            assert_eq!(hit, tree.closest(mesh, &p, f64::INFINITY));
            nearby.centre.x
        };
        let corner = mesh.corners(FaceId(420))[0];
        assert_eq!(mesh.position(corner), Point3::new(10.0, 10.0, 0.0));
        assert_eq!(ask(&tree, &mesh, 10.4, &mut nearby), 10.4);
        assert_eq!(
            ask(&tree, &mesh, 10.8, &mut nearby),
            10.4,
            "0.4 m away, 0.7 longest edges of 1.41 m are kept"
        );
        assert!(
            (4..=MOST_LEAVES).contains(&nearby.leaves.len()),
            "{} leaves",
            nearby.leaves.len()
        );
        // 0.6 m of the 0.99 m remain, enough for a motion by 0.3 m with a margin of 0.2 m
        let mut plan = crate::mesh::RefitPlan::default();
        tree.plan(mesh.star(corner), &mut plan);
        mesh.set_position(corner, Point3::new(10.0, 10.0, 0.3));
        tree.refit_planned(&mesh, &mut plan, 0.3, 0.2);
        assert_eq!(ask(&tree, &mesh, 10.5, &mut nearby), 10.4);
        // 0.2 m more stay within the margin, and are free
        mesh.set_position(corner, Point3::new(10.0, 10.0, 0.1));
        tree.refit_planned(&mesh, &mut plan, 0.2, 0.2);
        assert_eq!(ask(&tree, &mesh, 10.5, &mut nearby), 10.4);
        mesh.set_position(corner, Point3::new(10.0, 10.0, -0.3));
        tree.refit_planned(&mesh, &mut plan, 0.4, 0.2);
        assert_eq!(
            ask(&tree, &mesh, 10.5, &mut nearby),
            10.5,
            "1.1 m of 0.99 m are used up"
        );
        tree.refit(&mesh, mesh.star(corner));
        assert_eq!(
            ask(&tree, &mesh, 10.6, &mut nearby),
            10.6,
            "by an unknown margin"
        );
        assert_eq!(ask(&tree, &mesh, 11.9, &mut nearby), 11.9, "too far away");
    }

    #[test]
    fn where_too_many_leaves_are_near_the_answer_is_the_same_and_nothing_is_kept() {
        let corners = vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ];
        let mesh = TriMesh::new(corners, vec![[0, 1, 2]; 1000]).unwrap();
        let (tree, mut nearby) = (FaceTree::new(&mesh), NearbyLeaves::default());
        for i in 0..4 {
            let p = Point3::new(0.2, 0.2, 0.1 * f64::from(i));
            let hit = tree.closest_nearby(&mesh, &p, FaceId(7), f64::INFINITY, &mut nearby);
            assert_eq!(hit.map(|hit| hit.face), Some(FaceId(0)), "the smallest id");
            assert!(
                nearby.radius < 0.0
                    && nearby.leaves.capacity() == MOST_LEAVES
                    && nearby.crowded == Some(FaceId(7))
            );
        }
        assert_eq!(
            tree.closest_nearby(
                &mesh,
                &Point3::new(0.2, 0.2, 9.0),
                FaceId(7),
                1.0,
                &mut nearby
            ),
            None
        );
    }
}
