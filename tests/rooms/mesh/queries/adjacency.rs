//! Adjacency after any edits against that of a rebuilt mesh.

use super::*;

#[derive(Clone, Debug)]
enum Edit {
    AddVertex,
    AddFace([usize; 3]),
    Remove(usize),
    Flip(usize),
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let edit = prop_oneof![
        1 => Just(Edit::AddVertex),
        4 => any::<[usize; 3]>().prop_map(Edit::AddFace),
        4 => any::<usize>().prop_map(Edit::Remove),
        1 => any::<usize>().prop_map(Edit::Flip),
    ];
    prop::collection::vec(edit, 0..200)
}

proptest! {
    #[test]
    fn stars_are_those_of_a_rebuilt_mesh(edits in edits()) {
        let mut mesh = grid(3, 1.0, |_, _| 0.0);
        let mut faces: Vec<Option<[u32; 3]>> = mesh.faces().map(|(_, corners)| Some(corners.map(|v| v.0))).collect();
        for edit in edits {
            let vertices = mesh.vertex_count();
            match edit {
                Edit::AddVertex => prop_assert_eq!(mesh.add_vertex(Point3::origin()).unwrap().0 as usize, vertices),
                Edit::AddFace(corners) => {
                    let corners = corners.map(|at| (at % vertices) as u32);
                    let [a, b, c] = corners;
                    match mesh.add_face(corners.map(VertexId)) {
                        Ok(face) => {
                            faces.resize(faces.len().max(face.0 as usize + 1), None);
                            prop_assert_eq!(faces[face.0 as usize].replace(corners), None, "an id that was in use");
                        }
                        Err(_) => prop_assert!(a == b || b == c || c == a),
                    }
                }
                Edit::Remove(at) => {
                    let at = at % faces.len();
                    prop_assert_eq!(mesh.remove_face(FaceId(at as u32)), faces[at].take().is_some());
                }
                Edit::Flip(at) => {
                    let at = at % faces.len();
                    if let Some(corners) = &mut faces[at] {
                        mesh.flip_face(FaceId(at as u32));
                        corners.swap(1, 2);
                    }
                }
            }
        }
        let kept: Vec<_> = faces.iter().flatten().copied().collect();
        prop_assert_eq!(mesh.face_count(), kept.len());
        prop_assert_eq!(mesh.faces().map(|(_, corners)| corners.map(|v| v.0)).collect::<Vec<_>>(), kept.clone());
        prop_assert!(faces.iter().enumerate().all(|(id, face)| mesh.has_face(FaceId(id as u32)) == face.is_some()));
        let rebuilt = TriMesh::new(mesh.positions().to_vec(), kept).unwrap();
        let star = |mesh: &TriMesh, vertex| {
            let mut star: Vec<_> = mesh.star(vertex).iter().map(|&face| mesh.corners(face)).collect();
            star.sort_unstable();
            star
        };
        for vertex in (0..mesh.vertex_count() as u32).map(VertexId) {
            prop_assert_eq!(star(&mesh, vertex), star(&rebuilt, vertex));
        }
        // a tree over the remaining faces sees no removed face
        let tree = FaceTree::new(&mesh);
        if let Some(hit) = tree.closest(&mesh, &Point3::new(0.1, 0.2, 0.3), f64::INFINITY) {
            prop_assert!(mesh.has_face(hit.face));
        }
    }
}
