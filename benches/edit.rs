//! Cost of replacing faces: 300 by 600 in a spot of 5 mm, and back, in mesh and tree, again and
//! again.
//!
//! Each round takes the 300 faces nearest to the middle of the spot, one after another, and splits
//! each in two at the middle of its longest edge; the next round undoes it. After that the spot
//! moves on. Queries run on the edited tree and on a rebuilt one. Figures are per face, from an own
//! sorted list. Each edit runs three times and its least time counts, free of other load of the
//! machine.
//!
//! `cargo bench --bench edit [-- FACES…]`

use std::hint::black_box;
use std::time::Instant;

use nalgebra::Point3;
use touchup::mesh::{BoxQuery, FaceId, FaceTree, TriMesh, VertexId};
use touchup::sim::wavy::{SIDE, height, wavy_plate};

/// Half the side of the spot, m.
const HALF_SPOT: f64 = 2.5e-3;
/// Faces replaced at once.
const REPLACED: usize = 300;
const SPOTS: usize = 20;
const ROUNDS_PER_SPOT: usize = 50;
const REPEATS: usize = 3;

fn percentile(sorted: &[u64], share: f64) -> u64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

fn report(name: &str, mut times: Vec<u64>) {
    times.sort_unstable();
    println!(
        "  {name:28} median {:>7} ns  p99 {:>7} ns  p99.9 {:>7} ns  max {:>8} ns",
        percentile(&times, 0.5),
        percentile(&times, 0.99),
        percentile(&times, 0.999),
        times[times.len() - 1]
    );
}

/// The timed operations.
#[derive(Default)]
struct Times {
    insert: Vec<u64>,
    remove: Vec<u64>,
    mesh: Vec<u64>,
    replace: Vec<u64>,
}

impl Times {
    /// Keeps the lesser of two for each edit.
    fn take_lesser(&mut self, other: Self) {
        let pairs = [
            (&mut self.insert, other.insert),
            (&mut self.remove, other.remove),
            (&mut self.mesh, other.mesh),
            (&mut self.replace, other.replace),
        ];
        for (times, others) in pairs {
            times
                .iter_mut()
                .zip(others)
                .for_each(|(time, other)| *time = other.min(*time));
        }
    }
}

fn timed<T>(times: &mut Vec<u64>, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = black_box(work());
    times.push(start.elapsed().as_nanos() as u64);
    result
}

fn remove(mesh: &mut TriMesh, tree: &mut FaceTree, faces: &[FaceId], times: &mut Times) {
    for &face in faces {
        assert!(timed(&mut times.remove, || tree.remove(mesh, face)));
        timed(&mut times.mesh, || mesh.remove_face(face));
    }
}

fn insert(
    mesh: &mut TriMesh,
    tree: &mut FaceTree,
    corners: [VertexId; 3],
    times: &mut Times,
) -> FaceId {
    let face = timed(&mut times.mesh, || mesh.add_face(corners)).expect("the corners are there");
    assert!(timed(&mut times.insert, || tree.insert(mesh, face)));
    face
}

/// The same as [`remove`] and [`insert`], timed as a whole: the delay of one push.
fn replace(
    mesh: &mut TriMesh,
    tree: &mut FaceTree,
    old: &[FaceId],
    new: &[[VertexId; 3]],
    made: &mut Vec<FaceId>,
) {
    made.clear();
    for &face in old {
        tree.remove(mesh, face);
        mesh.remove_face(face);
    }
    for &corners in new {
        let face = mesh.add_face(corners).expect("the corners are there");
        tree.insert(mesh, face);
        made.push(face);
    }
}

/// Middle of spot `i`, spread over the plate.
fn spot(i: usize) -> Point3<f64> {
    let (x, y) = (
        0.1 + 0.8 * (i as f64 * 0.618).fract(),
        0.1 + 0.8 * (i as f64 * 0.414).fract(),
    );
    Point3::new(x * SIDE, y * SIDE, height(x * SIDE, y * SIDE))
}

fn nearest_faces(mesh: &TriMesh, tree: &FaceTree, middle: &Point3<f64>, query: &mut BoxQuery) {
    let half = nalgebra::Vector3::repeat(HALF_SPOT);
    tree.faces_in_box(&(middle - half), &(middle + half), query);
    let far = |face: &FaceId| (mesh.barycentre(*face) - middle).norm_squared();
    query
        .faces
        .sort_unstable_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)));
    query.faces.truncate(REPLACED);
}

/// Two faces for each: cut at the middle of the longest edge.
fn halves(mesh: &mut TriMesh, old: &[FaceId], vertices: &mut Vec<VertexId>) -> Vec<[VertexId; 3]> {
    let mut new = Vec::with_capacity(2 * old.len());
    for &face in old {
        let (c, t) = (mesh.corners(face), mesh.triangle(face));
        let length = |i: usize| (t[(i + 1) % 3] - t[i]).norm_squared();
        let i = (0..3)
            .max_by(|&a, &b| length(a).total_cmp(&length(b)))
            .unwrap_or(0);
        let middle = nalgebra::center(&t[i], &t[(i + 1) % 3]);
        let vertex = mesh.add_vertex(middle).expect("there is room");
        vertices.push(vertex);
        new.extend([
            [c[i], vertex, c[(i + 2) % 3]],
            [vertex, c[(i + 1) % 3], c[(i + 2) % 3]],
        ]);
    }
    new
}

fn queries(mesh: &TriMesh, tree: &FaceTree) -> Vec<u64> {
    let mut least = vec![u64::MAX; 200 * SPOTS];
    for _ in 0..REPEATS {
        let mut times = Vec::new();
        for i in 0..least.len() {
            let offset = |share: f64| HALF_SPOT * (2.0 * (i as f64 * share).fract() - 1.0);
            let p = spot(i % SPOTS) + nalgebra::vector![offset(0.7548), offset(0.5698), 0.2e-3];
            timed(&mut times, || tree.closest(mesh, &p, 0.01));
        }
        least
            .iter_mut()
            .zip(times)
            .for_each(|(least, time)| *least = time.min(*least));
    }
    least
}

/// Edits spot after spot.
fn session(mesh: &mut TriMesh, tree: &mut FaceTree) -> Times {
    let (mut times, mut query, mut made, mut vertices) =
        (Times::default(), BoxQuery::default(), vec![], vec![]);
    for round in 0..SPOTS * ROUNDS_PER_SPOT {
        nearest_faces(mesh, tree, &spot(round / ROUNDS_PER_SPOT), &mut query);
        let old = query.faces.clone();
        let old_corners: Vec<_> = old.iter().map(|&face| mesh.corners(face)).collect();
        let new = halves(mesh, &old, &mut vertices);
        if round % 2 == 0 {
            remove(mesh, tree, &old, &mut times);
            made = new
                .iter()
                .map(|&corners| insert(mesh, tree, corners, &mut times))
                .collect();
        } else {
            timed(&mut times.replace, || {
                replace(mesh, tree, &old, &new, &mut made)
            });
        }
        // the last round of a spot keeps its edit
        if round % ROUNDS_PER_SPOT + 1 < ROUNDS_PER_SPOT {
            let finer = made.clone();
            replace(mesh, tree, &finer, &old_corners, &mut made);
            vertices
                .drain(..)
                .for_each(|vertex| assert!(mesh.remove_vertex(vertex)));
        }
        vertices.clear();
    }
    times
}

fn bench(faces: usize) {
    let plate = wavy_plate(faces).expect("it can be counted");
    let built = FaceTree::new(&plate);
    // a copy takes no more than it needs
    let bytes = (plate.clone().bytes(), built.clone().bytes());
    println!(
        "{faces} faces: depth {}, mesh and tree {bytes:?} bytes",
        built.depth()
    );
    let (mut mesh, mut tree, mut times) = (plate.clone(), built.clone(), Times::default());
    for repeat in 0..REPEATS {
        (mesh, tree) = (plate.clone(), built.clone());
        let room = 2 * REPLACED * (SPOTS + 1);
        mesh.reserve(room, room)
            .and_then(|()| tree.reserve(room))
            .expect("there is memory");
        let new = session(&mut mesh, &mut tree);
        if repeat == 0 {
            times = new
        } else {
            times.take_lesser(new)
        }
    }
    report("FaceTree::insert", times.insert);
    report("FaceTree::remove", times.remove);
    report("TriMesh, a face more or less", times.mesh);
    report("300 faces by 600", times.replace);
    let start = Instant::now();
    let rebuilt = FaceTree::new(&mesh);
    let took = start.elapsed().as_millis();
    println!(
        "  after: depth {}, mesh and tree {:?} bytes",
        tree.depth(),
        (mesh.bytes(), tree.bytes())
    );
    report("closest, edited tree", queries(&mesh, &tree));
    report("closest, rebuilt tree", queries(&mesh, &rebuilt));
    println!(
        "  rebuilding takes {took} ms and gives depth {}",
        rebuilt.depth()
    );
}

fn main() {
    let mut sizes: Vec<usize> = std::env::args()
        .filter_map(|word| word.parse().ok())
        .collect();
    if sizes.is_empty() {
        sizes = vec![10_000, 1_000_000];
    }
    sizes.into_iter().for_each(bench);
}
