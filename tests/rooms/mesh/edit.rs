//! A mesh and its tree while faces come and go: against brute force, and over long sessions.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3, vector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use touchup::mesh::{
    BoxQuery, FaceId, FaceTree, NearbyLeaves, RefitPlan, TriMesh, VertexId, triangle,
};

use crate::common::{grid, within};

// ---- expected content of the mesh

/// The same mesh as plain lists, edited beside the one under test.
#[derive(Default)]
struct Ledger {
    faces: BTreeMap<u32, [u32; 3]>,
    vertices: BTreeMap<u32, Point3<f64>>,
}

impl Ledger {
    fn of(mesh: &TriMesh) -> Self {
        let faces = mesh
            .faces()
            .map(|(face, corners)| (face.0, corners.map(|v| v.0)))
            .collect();
        let vertices = (0..).zip(mesh.positions().iter().copied()).collect();
        Self { faces, vertices }
    }

    /// Recounts every star and compares.
    fn check(&self, mesh: &TriMesh) {
        assert_eq!(
            (mesh.face_count(), mesh.vertex_count()),
            (self.faces.len(), self.vertices.len())
        );
        let listed = self
            .faces
            .iter()
            .map(|(&face, corners)| (FaceId(face), corners.map(VertexId)));
        assert!(mesh.faces().eq(listed));
        let mut stars: BTreeMap<u32, Vec<FaceId>> =
            self.vertices.keys().map(|&v| (v, vec![])).collect();
        for (&face, corners) in &self.faces {
            corners
                .iter()
                .for_each(|v| stars.entry(*v).or_default().push(FaceId(face)));
        }
        for vertex in (0..mesh.vertex_slots() as u32).map(VertexId) {
            let mut star = mesh.star(vertex).to_vec();
            star.sort_unstable();
            assert_eq!(
                star,
                stars.remove(&vertex.0).unwrap_or_default(),
                "around {vertex:?}"
            );
            assert_eq!(
                mesh.has_vertex(vertex),
                self.vertices.contains_key(&vertex.0)
            );
            if let Some(position) = self.vertices.get(&vertex.0) {
                assert_eq!(mesh.position(vertex), *position);
            }
        }
    }

    fn any_face(&self, rng: &mut Pcg64) -> Option<u32> {
        let from = within(rng, 0.0, 1.0 + f64::from(*self.faces.last_key_value()?.0)) as u32;
        self.faces.range(from..).next().map(|(&face, _)| face)
    }

    fn any_vertex(&self, rng: &mut Pcg64) -> Option<u32> {
        let from = within(
            rng,
            0.0,
            1.0 + f64::from(*self.vertices.last_key_value()?.0),
        ) as u32;
        self.vertices
            .range(from..)
            .next()
            .map(|(&vertex, _)| vertex)
    }
}

// ---- the mesh alone

/// Splits a face in three about a new vertex, or takes out a vertex with its faces and closes the
/// gap as a fan.
fn replace_some(mesh: &mut TriMesh, ledger: &mut Ledger, rng: &mut Pcg64, most: usize) {
    let remove = |mesh: &mut TriMesh, ledger: &mut Ledger, face: u32| {
        assert!(mesh.remove_face(FaceId(face)) && ledger.faces.remove(&face).is_some());
    };
    let add = |mesh: &mut TriMesh, ledger: &mut Ledger, corners: [u32; 3]| {
        let face = mesh.add_face(corners.map(VertexId)).unwrap();
        assert_eq!(
            ledger.faces.insert(face.0, corners),
            None,
            "an id that was in use"
        );
    };
    if ledger.faces.len() < most {
        let Some(face) = ledger.any_face(rng) else {
            return;
        };
        let [a, b, c] = ledger.faces[&face];
        let middle = mesh.barycentre(FaceId(face));
        remove(mesh, ledger, face);
        let vertex = mesh.add_vertex(middle).unwrap().0;
        assert_eq!(
            ledger.vertices.insert(vertex, middle),
            None,
            "an id that was in use"
        );
        [[a, b, vertex], [b, c, vertex], [c, a, vertex]]
            .into_iter()
            .for_each(|corners| add(mesh, ledger, corners));
    } else {
        let Some(vertex) = ledger.any_vertex(rng) else {
            return;
        };
        let star = mesh.star(VertexId(vertex)).to_vec();
        let mut rim: Vec<_> = star
            .iter()
            .flat_map(|face| ledger.faces[&face.0])
            .filter(|&v| v != vertex)
            .collect();
        rim.sort_unstable();
        rim.dedup();
        assert_eq!(mesh.remove_vertex(VertexId(vertex)), star.is_empty());
        star.iter().for_each(|face| remove(mesh, ledger, face.0));
        mesh.remove_vertex(VertexId(vertex));
        ledger.vertices.remove(&vertex);
        rim.windows(3)
            .for_each(|corners| add(mesh, ledger, [corners[0], corners[1], corners[2]]));
    }
}

#[test]
fn a_million_replacements_leave_storage_bounded_and_stars_exact() {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut mesh = grid(10, 1.0, |_, _| 0.0);
    let mut ledger = Ledger::of(&mesh);
    let mut early = 0;
    for round in 0..1_000_000 {
        // up and down between 200 and 400 faces
        let most = if round / 500 % 2 == 0 { 400 } else { 200 };
        replace_some(&mut mesh, &mut ledger, &mut rng, most);
        if round % 10_000 == 0 {
            ledger.check(&mesh);
        }
        if round == 100_000 {
            early = mesh.bytes();
        }
    }
    ledger.check(&mesh);
    // 700 faces and 400 vertices would take 36 kB: 12 bytes for a face, 24 + 12 for a vertex, 16
    // for a face in a star
    assert!(mesh.bytes() < 100_000, "{} bytes", mesh.bytes());
    // an array that doubles once more may, as the largest number of faces ever is a matter of
    // chance
    assert!(
        mesh.bytes() <= 2 * early,
        "{} bytes, after a tenth of the edits {early}",
        mesh.bytes()
    );
}

// ---- the tree

/// Squared distance from `p` to each face, by the closest point of one triangle (which has tests of
/// its own).
fn distances(mesh: &TriMesh, p: &Point3<f64>) -> Vec<(f64, FaceId)> {
    let far = |face| (triangle::closest_point(p, &mesh.triangle(face)).0 - p).norm_squared();
    mesh.faces().map(|(face, _)| (far(face), face)).collect()
}

/// Distance of `p` from a face along its normal, m.
fn squareness(mesh: &TriMesh, p: &Point3<f64>, face: FaceId) -> f64 {
    (p - triangle::closest_point(p, &mesh.triangle(face)).0)
        .dot(&mesh.normal(face))
        .abs()
}

/// Every kind of query against brute force.
fn check_queries(
    mesh: &TriMesh,
    tree: &FaceTree,
    p: &Point3<f64>,
    nearby: &mut NearbyLeaves,
    rng: &mut Pcg64,
) {
    let near = distances(mesh, p);
    let wanted = near
        .iter()
        .map(|(distance, _)| *distance)
        .fold(f64::INFINITY, f64::min);
    let Some(hit) = tree.closest(mesh, p, f64::INFINITY) else {
        return assert!(near.is_empty());
    };
    let scale = mesh
        .positions()
        .iter()
        .map(|x| x.coords.amax())
        .fold(p.coords.amax(), f64::max);
    let rounding = 256.0 * f64::EPSILON * scale;
    assert!(
        (hit.distance_squared.sqrt() - wanted.sqrt()).abs() <= rounding,
        "{p}: {hit:?}, nearest {wanted}"
    );
    assert!(
        (triangle::closest_point(p, &mesh.triangle(hit.face)).0 - p).norm()
            <= wanted.sqrt() + rounding
    );
    // among faces that are surely equally near, none that p lies clearly more squarely above
    let square = squareness(mesh, p, hit.face);
    for (_, face) in near
        .iter()
        .filter(|(distance, _)| *distance == hit.distance_squared)
    {
        let other = squareness(mesh, p, *face);
        assert!(
            other <= square && (other < square || hit.face <= *face),
            "{p}: {face:?} before {:?}",
            hit.face
        );
    }
    let hint = near[within(rng, 0.0, near.len() as f64) as usize].1;
    for hint in [hint, hit.face, hit.face] {
        assert_eq!(
            tree.closest_nearby(mesh, p, hint, f64::INFINITY, nearby),
            Some(hit)
        );
    }

    let middle = tree
        .closest_barycentre(mesh, p, f64::INFINITY)
        .expect("a face is there");
    let nearest = mesh
        .faces()
        .map(|(f, _)| (mesh.barycentre(f) - p).norm())
        .fold(f64::INFINITY, f64::min);
    assert!((middle.distance_squared.sqrt() - nearest).abs() <= rounding);
    assert_eq!(middle.point, mesh.barycentre(middle.face));
}

/// The faces in a box: none is missing, none comes twice, and none is far.
fn check_box(
    mesh: &TriMesh,
    tree: &FaceTree,
    a: &Point3<f64>,
    b: &Point3<f64>,
    query: &mut BoxQuery,
) {
    let (lo, hi) = (a.inf(b), a.sup(b));
    tree.faces_in_box(&lo, &hi, query);
    let mut found = query.faces.clone();
    found.sort_unstable();
    assert!(
        found.windows(2).all(|pair| pair[0] != pair[1])
            && found.iter().all(|&face| mesh.has_face(face))
    );
    for (face, _) in mesh.faces() {
        let [low, high] = [Point3::inf, Point3::sup]
            .map(|f| mesh.triangle(face).into_iter().reduce(|p, q| f(&p, &q)));
        let meets = low
            .zip(high)
            .is_some_and(|(l, h)| (0..3).all(|i| l[i] <= hi[i] && h[i] >= lo[i]));
        assert!(
            !meets || found.binary_search(&face).is_ok(),
            "{face:?} is missing"
        );
    }
}

fn point(rng: &mut Pcg64, scale: f64) -> Point3<f64> {
    Point3::from(vector![0, 1, 2].map(|_| scale * within(rng, -1.0, 1.0)))
}

#[derive(Clone, Copy, Debug)]
enum Edit {
    /// a face over three vertices that are there
    Insert,
    /// a face with three vertices of its own
    InsertAway,
    Remove,
    /// many at one place
    RemoveNear,
    Move,
    /// by a plan made before other faces came or went
    MovePlanned,
    Query,
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    use Edit::*;
    let one = prop::sample::select(vec![
        Insert,
        Insert,
        InsertAway,
        Remove,
        Remove,
        RemoveNear,
        Move,
        MovePlanned,
        Query,
    ]);
    prop::collection::vec(one, 1..160)
}

/// Mesh and tree, edited together.
struct Edited {
    mesh: TriMesh,
    tree: FaceTree,
    ledger: Ledger,
    scale: f64,
    plan: RefitPlan,
    /// the vertex of the plan and the number of its faces then
    planned: Option<(VertexId, Vec<FaceId>)>,
    nearby: NearbyLeaves,
}

impl Edited {
    fn new(cells: u32, scale: f64, rng: &mut Pcg64) -> Self {
        let edge = 2.0 * scale / f64::from(cells);
        let mesh = grid(cells, edge, |_, _| within(rng, -0.2 * scale, 0.2 * scale));
        let (tree, ledger) = (FaceTree::new(&mesh), Ledger::of(&mesh));
        let (plan, nearby) = (RefitPlan::default(), NearbyLeaves::default());
        Self {
            mesh,
            tree,
            ledger,
            scale,
            plan,
            planned: None,
            nearby,
        }
    }

    fn insert(&mut self, corners: [u32; 3]) {
        let Ok(face) = self.mesh.add_face(corners.map(VertexId)) else {
            return;
        };
        assert_eq!(self.ledger.faces.insert(face.0, corners), None);
        assert!(!self.tree.has(face) && self.tree.insert(&self.mesh, face) && self.tree.has(face));
        assert!(!self.tree.insert(&self.mesh, face), "twice");
    }

    fn remove(&mut self, face: u32) {
        assert!(self.tree.remove(&self.mesh, FaceId(face)));
        assert!(!self.tree.remove(&self.mesh, FaceId(face)), "twice");
        assert!(self.mesh.remove_face(FaceId(face)));
        self.ledger.faces.remove(&face);
    }

    fn move_vertex(&mut self, vertex: VertexId, rng: &mut Pcg64) {
        let there = match within(rng, 0.0, 3.0) as u32 {
            0 => point(rng, self.scale),
            1 => self.mesh.position(VertexId(0)),
            _ => self.mesh.position(vertex) + Vector3::repeat(0.01 * self.scale),
        };
        self.mesh.set_position(vertex, there);
        self.ledger.vertices.insert(vertex.0, there);
    }

    fn edit(&mut self, edit: Edit, rng: &mut Pcg64) {
        let vertices = self.mesh.vertex_slots() as f64;
        let mut any = || VertexId(within(rng, 0.0, vertices) as u32);
        match edit {
            Edit::Insert => {
                let corners = [any().0, any().0, any().0];
                self.insert(corners);
            }
            Edit::InsertAway => {
                let size = self.scale * 10f64.powf(within(rng, -4.0, 1.0));
                let middle = point(rng, self.scale);
                let corners = [0, 1, 2].map(|_| {
                    let p = middle + point(rng, size).coords;
                    let vertex = self.mesh.add_vertex(p).unwrap().0;
                    self.ledger.vertices.insert(vertex, p);
                    vertex
                });
                self.insert(corners);
            }
            Edit::Remove => {
                if let Some(face) = self.ledger.any_face(rng) {
                    self.remove(face);
                }
            }
            Edit::RemoveNear => {
                let mut near = distances(&self.mesh, &point(rng, self.scale));
                near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                near.truncate(near.len() / 3);
                near.iter().for_each(|(_, face)| self.remove(face.0));
            }
            Edit::Move => {
                let vertex = any();
                self.move_vertex(vertex, rng);
                self.tree.refit(&self.mesh, self.mesh.star(vertex));
            }
            Edit::MovePlanned => self.move_planned(rng),
            Edit::Query => {}
        }
    }

    /// Uses the plan of an earlier call if the star of its vertex is still the same, and makes the
    /// next one.
    fn move_planned(&mut self, rng: &mut Pcg64) {
        if let Some((vertex, faces)) = self.planned.take()
            && self.mesh.star(vertex) == faces
        {
            self.move_vertex(vertex, rng);
            // once far, then a little, within the margin and beyond it
            let margin = within(rng, 0.0, 0.02) * self.scale;
            self.tree
                .refit_planned(&self.mesh, &mut self.plan, f64::INFINITY, margin);
            for _ in 0..4 {
                let step = point(rng, 0.5 * margin).coords;
                let there = self.mesh.position(vertex) + step;
                self.mesh.set_position(vertex, there);
                self.ledger.vertices.insert(vertex.0, there);
                self.tree.refit_planned(
                    &self.mesh,
                    &mut self.plan,
                    step.norm() * (1.0 + f64::EPSILON),
                    margin,
                );
            }
        }
        let vertex = VertexId(within(rng, 0.0, self.mesh.vertex_slots() as f64) as u32);
        self.tree.plan(self.mesh.star(vertex), &mut self.plan);
        self.planned = Some((vertex, self.mesh.star(vertex).to_vec()));
    }

    fn check(&mut self, rng: &mut Pcg64, query: &mut BoxQuery) {
        let at_vertex =
            self.mesh.position(VertexId(
                within(rng, 0.0, self.mesh.vertex_slots() as f64) as u32
            ));
        for p in [
            point(rng, self.scale),
            point(rng, 20.0 * self.scale),
            at_vertex,
        ] {
            check_queries(&self.mesh, &self.tree, &p, &mut self.nearby, rng);
        }
        let (a, b) = (point(rng, self.scale), point(rng, self.scale));
        check_box(&self.mesh, &self.tree, &a, &b, query);
    }
}

impl Edited {
    /// A rebuilt tree names the same faces, even at places with several nearest ones.
    fn check_against_new_tree(&self, rng: &mut Pcg64) {
        let rebuilt = FaceTree::new(&self.mesh);
        for (face, corners) in self.mesh.faces().step_by(97) {
            let [a, b] = [
                self.mesh.position(corners[0]),
                self.mesh.position(corners[1]),
            ];
            let off = self.mesh.normal(face) * within(rng, 0.0, 0.01 * self.scale);
            for p in [
                a,
                a + off,
                nalgebra::center(&a, &b) + off,
                point(rng, self.scale),
            ] {
                assert_eq!(
                    self.tree.closest(&self.mesh, &p, 1.0),
                    rebuilt.closest(&self.mesh, &p, 1.0),
                    "{p}"
                );
            }
        }
    }
}

proptest! {
    #[test]
    fn queries_are_those_of_brute_force_while_faces_come_go_and_move(
        edits in edits(),
        cells in 1u32..8,
        scale in prop::sample::select(vec![1e-6, 0.1, 1e4]),
        seed: u64,
    ) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut edited = Edited::new(cells, scale, &mut rng);
        let mut query = BoxQuery::default();
        for edit in edits {
            edited.edit(edit, &mut rng);
            if let Edit::Query = edit {
                edited.check(&mut rng, &mut query);
            }
        }
        edited.ledger.check(&edited.mesh);
        edited.check(&mut rng, &mut query);
    }
}

/// A face that moves by small steps, and the boxes refitted after it.
#[derive(Default)]
struct Pushed {
    face: Option<FaceId>,
    plan: RefitPlan,
}

impl Pushed {
    fn push(
        &mut self,
        face: FaceId,
        mesh: &mut TriMesh,
        tree: &mut FaceTree,
        step: Vector3<f64>,
        margin: f64,
    ) {
        let corners = mesh.corners(face);
        if self.face.replace(face) != Some(face) {
            let faces: Vec<_> = corners
                .iter()
                .flat_map(|&vertex| mesh.star(vertex))
                .copied()
                .collect();
            tree.plan(&faces, &mut self.plan);
        }
        corners
            .into_iter()
            .for_each(|vertex| mesh.set_position(vertex, mesh.position(vertex) + step));
        tree.refit_planned(mesh, &mut self.plan, step.norm() * (1.0 + 1e-9), margin);
    }
}

/// Cached neighbours must stay valid while the mesh moves below the point and beside it, and faces
/// come and go.
#[test]
fn a_walk_over_a_mesh_that_moves_finds_what_a_search_from_the_root_finds() {
    const EDGE: f64 = 1e-3;
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        // of the order of margins, so that neither holds for ever nor never
        let stride = EDGE * 10f64.powf(within(&mut rng, -3.0, 0.3));
        let push = EDGE * 10f64.powf(within(&mut rng, -4.0, -0.5));
        let margin = EDGE * [0.0, 0.05, 0.3][seed as usize % 3];
        let mut mesh = grid(40, EDGE, |_, _| within(&mut rng, -0.2 * EDGE, 0.2 * EDGE));
        let (mut tree, mut nearby) = (FaceTree::new(&mesh), NearbyLeaves::default());
        let (mut below, mut beside) = (Pushed::default(), Pushed::default());
        let (mut p, mut last) = (Point3::new(0.0, 0.0, 0.1 * EDGE), FaceId(0));
        for step in 0..600 {
            let wanted = tree.closest(&mesh, &p, f64::INFINITY);
            assert_eq!(
                tree.closest_nearby(&mesh, &p, last, f64::INFINITY, &mut nearby),
                wanted,
                "step {step} at {p}"
            );
            last = wanted.expect("there are faces").face;
            below.push(
                last,
                &mut mesh,
                &mut tree,
                point(&mut rng, push).coords,
                margin,
            );
            if step % 3 == 0 {
                let side = p + point(&mut rng, 4.0 * EDGE).coords;
                let face = tree
                    .closest(&mesh, &side, f64::INFINITY)
                    .expect("there are faces")
                    .face;
                // towards the point, so that boxes come to it that were away
                let step = (p - mesh.barycentre(face)) * within(&mut rng, 0.0, 0.3);
                beside.plan.spend();
                beside.push(face, &mut mesh, &mut tree, step, margin);
                below.plan.spend();
            }
            if step % 50 == 49 {
                let corners = mesh.corners(last);
                assert!(tree.remove(&mesh, last) && mesh.remove_face(last));
                last = mesh.add_face(corners).expect("it was there");
                assert!(tree.insert(&mesh, last));
            }
            p += point(&mut rng, stride).coords;
        }
    }
}

/// Largest depth over this many faces: a side holds a fifth or more of the faces of a node, and
/// five are the fewest over two leaves.
fn most_levels(faces: usize) -> usize {
    (faces as f64 / 5.0).log(1.25).max(0.0) as usize + 2
}

/// Spots that move over the mesh: each cuts faces in two and joins them again, and some cuts stay.
#[test]
fn a_long_session_leaves_the_tree_shallow_small_and_exact() {
    let mut rng = Pcg64::seed_from_u64(8);
    let mut edited = Edited::new(60, 0.1, &mut rng);
    let (mut query, mut bytes, mut most) = (BoxQuery::default(), vec![], [0; 2]);
    for round in 0..3_000 {
        let middle = point(&mut rng, 0.1);
        let lo = Point3::new(middle.x - 0.01, middle.y - 0.01, -1.0);
        let hi = Point3::new(middle.x + 0.01, middle.y + 0.01, 1.0);
        edited.tree.faces_in_box(&lo, &hi, &mut query);
        let near: Vec<u32> = query.faces.iter().map(|face| face.0).take(200).collect();
        if edited.ledger.faces.len() < 10_000 {
            for face in near {
                let ([a, b, c], p) = (
                    edited.ledger.faces[&face],
                    edited.mesh.barycentre(FaceId(face)),
                );
                edited.remove(face);
                let vertex = edited.mesh.add_vertex(p).unwrap().0;
                edited.ledger.vertices.insert(vertex, p);
                [[a, b, vertex], [b, c, vertex], [c, a, vertex]]
                    .into_iter()
                    .for_each(|corners| edited.insert(corners));
            }
        } else {
            near.iter().for_each(|&face| edited.remove(face));
            let Edited { mesh, ledger, .. } = &mut edited;
            ledger
                .vertices
                .retain(|&vertex, _| !mesh.remove_vertex(VertexId(vertex)));
        }
        most = [
            most[0].max(edited.ledger.faces.len()),
            most[1].max(edited.ledger.vertices.len()),
        ];
        let levels = edited.tree.depth();
        assert!(
            levels <= most_levels(edited.ledger.faces.len()),
            "{levels} levels, round {round}"
        );
        if round % 200 == 0 {
            edited.ledger.check(&edited.mesh);
            edited.check(&mut rng, &mut query);
            edited.check_against_new_tree(&mut rng);
            bytes.push(edited.tree.bytes() + edited.mesh.bytes());
        }
    }
    let [faces, vertices] = most;
    assert!(
        faces < 11_000 && vertices < 9_000,
        "the session stays small: {most:?}"
    );
    let last = bytes[bytes.len() - 1];
    // at a vertex 36 bytes and a block of 8 faces; in the mesh 12 bytes for a face, in the tree 4;
    // 68 for a pair of nodes and 16 for a leaf, of which there are at most half as many as faces;
    // all arrays grow by doubling
    assert!(
        last < 2 * (vertices * (36 + 32) + faces * (12 + 4 + (68 + 16) / 2)),
        "{last} bytes for {most:?}"
    );
}
