//! A copy that follows the journal of a mesh ends equal to it, after any edits.

use std::collections::BTreeMap;

use nalgebra::Point3;
use proptest::prelude::*;
use touchup::mesh::{Changes, FaceId, TriMesh, VertexId};

/// One edit; numbers count modulo the current counts.
#[derive(Clone, Debug)]
enum Edit {
    Move(usize, f64),
    AddVertex(f64),
    AddFace([usize; 3]),
    RemoveFace(usize),
    RemoveVertex(usize),
    Flip(usize),
    Take(usize),
}

fn edit() -> impl Strategy<Value = Edit> {
    let at = 0usize..1000;
    prop_oneof![
        (at.clone(), -1.0..1.0).prop_map(|(v, x)| Edit::Move(v, x)),
        (-1.0..1.0).prop_map(Edit::AddVertex),
        [at.clone(), at.clone(), at.clone()].prop_map(Edit::AddFace),
        at.clone().prop_map(Edit::RemoveFace),
        at.clone().prop_map(Edit::RemoveVertex),
        at.prop_map(Edit::Flip),
        (1usize..4).prop_map(Edit::Take),
    ]
}

/// A copy that follows the reported changes alone.
#[derive(Debug, Default, PartialEq)]
struct Copy {
    vertices: BTreeMap<u32, Point3<f64>>,
    faces: BTreeMap<u32, [VertexId; 3]>,
}

impl Copy {
    fn of(mesh: &TriMesh) -> Self {
        let ids = (0..mesh.vertex_slots() as u32).filter(|&v| mesh.has_vertex(VertexId(v)));
        Self {
            vertices: ids.map(|v| (v, mesh.position(VertexId(v)))).collect(),
            faces: mesh
                .faces()
                .map(|(face, corners)| (face.0, corners))
                .collect(),
        }
    }

    fn take(&mut self, mesh: &TriMesh, changes: &Changes) {
        for &vertex in &changes.vertices {
            match mesh.has_vertex(vertex) {
                true => drop(self.vertices.insert(vertex.0, mesh.position(vertex))),
                false => drop(self.vertices.remove(&vertex.0)),
            }
        }
        for &face in &changes.faces {
            match mesh.has_face(face) {
                true => drop(self.faces.insert(face.0, mesh.corners(face))),
                false => drop(self.faces.remove(&face.0)),
            }
        }
    }
}

fn square() -> TriMesh {
    let p = |x, y| Point3::new(x, y, 0.0);
    TriMesh::new(
        vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)],
        vec![[0, 1, 2], [0, 2, 3]],
    )
    .unwrap()
}

proptest! {
    #[test]
    fn a_copy_by_the_journal_is_the_mesh(edits in proptest::collection::vec(edit(), 1..200)) {
        let mut mesh = square();
        let mut copy = Copy::of(&mesh);
        mesh.watch();
        let mut changes = Changes::default();
        for edit in edits {
            let vertex = |at: usize| VertexId((at % mesh.vertex_slots()) as u32);
            let face = |at: usize| FaceId((at % mesh.face_slots()) as u32);
            match edit {
                Edit::Move(at, x) if mesh.has_vertex(vertex(at)) => mesh.set_position(vertex(at), Point3::new(x, x, x)),
                Edit::AddVertex(x) => drop(mesh.add_vertex(Point3::new(x, 0.0, 0.0)).unwrap()),
                Edit::AddFace(at) => drop(mesh.add_face(at.map(vertex))),
                Edit::RemoveFace(at) => drop(mesh.remove_face(face(at))),
                Edit::RemoveVertex(at) => drop(mesh.remove_vertex(vertex(at))),
                Edit::Flip(at) if mesh.has_face(face(at)) => mesh.flip_face(face(at)),
                Edit::Take(most) => {
                    changes.clear();
                    mesh.take_changes(most, &mut changes);
                    prop_assert!(changes.vertices.len() <= most && changes.faces.len() <= most);
                    copy.take(&mesh, &changes);
                }
                _ => {}
            }
        }
        changes.clear();
        prop_assert!(mesh.take_changes(usize::MAX, &mut changes));
        let mut ids = changes.vertices.clone();
        ids.sort();
        ids.dedup();
        prop_assert_eq!(ids.len(), changes.vertices.len(), "each once");
        copy.take(&mesh, &changes);
        prop_assert_eq!(copy, Copy::of(&mesh));
        changes.clear();
        prop_assert!(mesh.take_changes(usize::MAX, &mut changes) && changes == Changes::default(), "reported once");
    }
}

#[test]
fn without_watching_nothing_is_recorded() {
    let mut mesh = square();
    mesh.set_position(VertexId(0), Point3::origin());
    let mut changes = Changes::default();
    assert!(mesh.take_changes(usize::MAX, &mut changes) && changes == Changes::default());
}

/// As many vertices as one call takes, and more faces than that: the answer is incomplete until it
/// has reported those, too.
#[test]
fn it_is_not_all_while_faces_are_left() {
    let mut mesh = square();
    mesh.watch();
    mesh.set_position(VertexId(0), Point3::origin());
    mesh.flip_face(FaceId(0));
    mesh.flip_face(FaceId(1));
    let mut changes = Changes::default();
    assert!(
        !mesh.take_changes(1, &mut changes),
        "a face is left: {changes:?}"
    );
    assert_eq!((changes.vertices.len(), changes.faces.len()), (1, 1));
    assert!(mesh.take_changes(1, &mut changes));
    assert_eq!((changes.vertices.len(), changes.faces.len()), (1, 2));
}
