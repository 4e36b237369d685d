//! Mesh files from outside: other programs' files, broken files, round trips.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use touchup::io::mesh_file::{MeshFile, MeshFileError, MeshOrPoints, MeshUnit, VertexColumn};
use touchup::io::mesh_file::{read_appearance, read_mesh, read_mesh_or_points};
use touchup::io::mesh_file::{read_vertex_columns, write_mesh, write_mesh_with};
use touchup::mesh::{FaceId, SerialWorkers, Texture, TriMesh, VertexColours, VertexId, repair};

use crate::allocations::largest_request;
use crate::shared::shared;
use MeshUnit::{Inch, Metre, Millimetre};

/// Divergence theorem, from the middle of the first face so that a far offset does no harm.
fn volume(mesh: &TriMesh) -> f64 {
    let anchor = mesh.barycentre(FaceId(0));
    mesh.faces()
        .map(|(f, _)| (mesh.barycentre(f) - anchor).dot(&mesh.double_area_normal(f)) / 6.0)
        .sum()
}

/// Result of reading a file.
enum Gives {
    /// vertices, faces, boundary edges, boundary loops, non-manifold edges
    Mesh(MeshUnit, [usize; 5]),
    /// end of the message
    Error(&'static str),
}

/// Meshes: read by trimesh without processing, vertices equal to 9 decimals merged, non-finite,
/// zero-area and repeated faces left out, edges counted with numpy, loops with scipy's connected
/// components. `made_huge_offset_utm.stl`: in exact fractions, since its triangles are near
/// rounding. Files that trimesh could not read there (`*quadknot*`, `*singlevn*`, `*blender_uv*`):
/// counted by hand from their headers (closed quads cut in two).
#[rustfmt::skip]
const NASTY: [(&str, Gives); 54] = {
    use Gives::{Error, Mesh};
    [
        ("assimp_OBJ_box_UTF16BE.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_OBJ_box_without_lineending.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_OBJ_cube_with_vertexcolors.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_OBJ_number_formats.obj", Error("line 11: expected three coordinates with a decimal point, found 'v 1e+2 2.e+1 3.1+e2'")),
        ("assimp_OBJ_regr_3429812.obj", Mesh(Metre, [4, 2, 4, 1, 0])),
        ("assimp_OBJ_testmixed.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_PLY_cube.ply", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_PLY_cube_binary_starts_with_nl.ply", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("assimp_PLY_issue623.ply", Error("line 14: expected a number, found 'the end of the line'")),
        ("assimp_PLY_points.ply", Error("no face in it, only 4 vertices: make a triangle mesh of it first")),
        ("assimp_STL_Spider_binary.stl", Mesh(Metre, [722, 1312, 72, 6, 0])),
        ("assimp_STL_triangle_with_empty_solid.stl", Mesh(Metre, [3, 1, 3, 1, 0])),
        ("assimp_invalid_OutOfMemory.off", Error("not a kind of mesh or point cloud known here: convert it to .ply, .stl, .obj, .pcd, .xyz or .e57")),
        ("assimp_invalid_empty.obj", Error("byte 0: expected a mesh, found the end of the file")),
        ("assimp_invalid_malformed.obj", Error("line 23: a face uses vertex 12, but there are only 8 vertices")),
        ("libigl_cube_with_fold.ply", Mesh(Metre, [26, 48, 0, 0, 0])),
        ("libigl_truck.obj", Mesh(Metre, [2956, 4770, 1388, 144, 54])),
        ("made_ascii_comma_decimal_junk.stl", Error("line 5: expected a number, found '1,0'")),
        ("made_big_endian_double.ply", Mesh(Inch, [1722, 3476, 0, 0, 0])),
        ("made_count_too_big.stl", Error("byte 5084: the header announces 4294967295 triangles, which take 214748364750 bytes, but 5000 follow: the file is damaged or cut short, export it again")),
        ("made_crlf_negative_quads.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("made_flipped_30pct.stl", Mesh(Inch, [1722, 3476, 0, 0, 0])),
        ("made_huge_offset_utm.stl", Mesh(Millimetre, [1648, 3322, 14, 4, 0])),
        ("made_nan_inf_coords.stl", Mesh(Inch, [1722, 3474, 6, 2, 0])),
        ("made_truncated_mid_record.stl", Error("byte 50107: the header announces 3476 triangles, which take 173800 bytes, but 50023 follow: the file is damaged or cut short, export it again")),
        ("made_zero_bytes.stl", Error("byte 0: expected a mesh, found the end of the file")),
        ("manifold_hull-body.obj", Mesh(Millimetre, [2736, 5460, 0, 0, 0])),
        ("manifold_self_intersectA.obj", Mesh(Metre, [8582, 17160, 0, 0, 0])),
        ("meshlab_many_small_holes.ply", Mesh(Metre, [2004, 3524, 556, 32, 0])),
        ("numpystl_stl_ascii_HalfDonut.stl", Mesh(Metre, [144, 288, 0, 0, 0])),
        ("numpystl_stl_binary_CubeInvalidUnicode.stl", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("numpystl_stl_binary_StarWithEmptyHeader.stl", Mesh(Metre, [36, 68, 0, 0, 0])),
        ("stlio_bunny_99.stl", Mesh(Metre, [54, 99, 7, 1, 0])),
        ("tobj_empty_name_triangle.obj", Mesh(Metre, [3, 1, 3, 1, 0])),
        ("tobj_lines.obj", Error("no face in it, only 3 vertices: make a triangle mesh of it first")),
        ("tobj_quad_colored_merge.obj", Mesh(Metre, [4, 2, 4, 1, 0])),
        ("trimesh_7_8ths_cube.stl", Mesh(Millimetre, [14, 24, 0, 0, 0])),
        ("trimesh_cube_blender_uv.ply", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("trimesh_empty.obj", Error("no face in it, only 0 vertices: make a triangle mesh of it first")),
        ("trimesh_empty.stl", Error("no face in it, only 0 vertices: make a triangle mesh of it first")),
        ("trimesh_emptyIO_obj_wireframe.obj", Error("no face in it, only 8 vertices: make a triangle mesh of it first")),
        ("trimesh_emptyIO_ply_empty_bin.ply", Error("no face in it, only 0 vertices: make a triangle mesh of it first")),
        ("trimesh_emptyIO_ply_points_bin.ply", Error("no face in it, only 8 vertices: make a triangle mesh of it first")),
        ("trimesh_emptyIO_stl_empty_bin.stl", Error("no face in it, only 0 vertices: make a triangle mesh of it first")),
        ("trimesh_groups.obj", Mesh(Metre, [1156, 2308, 0, 0, 0])),
        ("trimesh_joined_tetrahedra.obj", Mesh(Metre, [5, 7, 0, 0, 3])),
        ("trimesh_mirror.ply", Mesh(Metre, [143, 286, 0, 0, 0])),
        ("trimesh_nancolor.obj", Mesh(Metre, [8, 12, 0, 0, 0])),
        ("trimesh_not_convex.obj", Mesh(Metre, [44, 96, 0, 0, 12])),
        ("trimesh_obj_with_no_face_in_chunk.obj", Mesh(Metre, [3, 1, 3, 1, 0])),
        ("trimesh_points_emptyface.ply", Error("no face in it, only 1024 vertices: make a triangle mesh of it first")),
        ("trimesh_quadknot.obj", Mesh(Millimetre, [1440, 2880, 0, 0, 0])),
        ("trimesh_singlevn.obj", Mesh(Millimetre, [4, 2, 4, 1, 0])),
        ("trimesh_two_objects_mixed_case_names.stl", Mesh(Metre, [16, 24, 0, 0, 0])),
    ]
};

#[test]
fn every_nasty_file_gives_the_known_mesh_or_one_clear_line() {
    let Some(folder) = shared("nasty") else {
        return;
    };
    for (name, gives) in &NASTY {
        let path = folder.join(name);
        match gives {
            Gives::Mesh(unit, wanted) => {
                let MeshFile { mesh, repair: r } =
                    read_mesh(&path, *unit).unwrap_or_else(|e| panic!("{e}"));
                let got = [
                    mesh.vertex_count(),
                    mesh.face_count(),
                    r.boundary_edges,
                    r.boundary_loops,
                    r.non_manifold_edges,
                ];
                assert_eq!(got, *wanted, "{name}: {r}");
                assert!(
                    r.boundary_edges + r.non_manifold_edges > 0 || volume(&mesh) > 0.0,
                    "{name} is inside out"
                );
            }
            Gives::Error(wanted) => {
                let message = read_mesh(&path, Metre).unwrap_err().to_string();
                assert!(
                    message.contains(name) && message.ends_with(wanted),
                    "{message}"
                );
                assert!(
                    !message.contains('\n') && !message.contains('\r'),
                    "{message}"
                );
            }
        }
    }
}

#[test]
fn no_nasty_file_was_forgotten() {
    let Some(folder) = shared("nasty") else {
        return;
    };
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let mut known: Vec<_> = NASTY.iter().map(|(name, _)| *name).collect();
    known.sort();
    assert_eq!(names, known);
}

#[test]
fn flipped_facets_come_out_as_the_part_they_were_made_from() {
    let (Some(nasty), Some(parts)) = (shared("nasty"), shared("parts/permissive")) else {
        return;
    };
    let part = read_mesh(&parts.join("trimesh_featuretype.STL"), Inch).unwrap();
    let flipped = read_mesh(&nasty.join("made_flipped_30pct.stl"), Inch).unwrap();
    assert_eq!(
        (part.repair.flipped_faces, part.mesh.face_count()),
        (0, 3476)
    );
    assert!((900..1200).contains(&flipped.repair.flipped_faces));
    for (face, _) in part.mesh.faces() {
        assert_eq!(
            part.mesh.barycentre(face).map(|x| x as f32),
            flipped.mesh.barycentre(face).map(|x| x as f32)
        );
        assert!(part.mesh.normal(face).dot(&flipped.mesh.normal(face)) > 0.999);
    }
}

/// Counts of closed parts, from the index of the data (trimesh).
#[test]
fn real_parts_come_out_watertight() {
    let Some(parts) = shared("parts/permissive") else {
        return;
    };
    let closed = [
        ("trimesh_plate_holes.STL", Millimetre, 618, 1252, 1),
        ("trimesh_octagonal_pocket.stl", Metre, 1631, 3262, 1),
        ("trimesh_idler_riser.STL", Inch, 782, 1572, 1),
        ("trimesh_counter.unitsmm.STL", Millimetre, 41837, 83750, 6),
        ("trimesh_fandisk.obj", Metre, 2877, 5750, 1),
        ("crs_ee2.stl", Metre, 284, 584, 1),
        ("crs_ee3.stl", Metre, 521, 1062, 1),
        ("godel_Tool_Mounting_Plate.STL", Metre, 11261, 22578, 7),
    ];
    for (name, unit, vertices, faces, bodies) in closed {
        let MeshFile { mesh, repair: r } = read_mesh(&parts.join(name), unit).unwrap();
        assert_eq!(
            (mesh.vertex_count(), mesh.face_count(), r.boundary_edges),
            (vertices, faces, 0),
            "{name}: {r}"
        );
        assert_eq!(
            (r.components, r.non_manifold_edges),
            (bodies, 0),
            "{name}: {r}"
        );
        assert!(volume(&mesh) > 0.0);
    }
}

/// A closed wavy ball, off centre, with coordinates that use all their digits.
fn ball() -> TriMesh {
    let (rings, sectors) = (12u32, 17u32);
    let mut positions = vec![Vector3::z(), -Vector3::z()];
    for ring in 1..rings {
        let (sin, cos) = (f64::from(ring) * std::f64::consts::PI / f64::from(rings)).sin_cos();
        positions.extend((0..sectors).map(|s| {
            let (y, x) = (f64::from(s) * std::f64::consts::TAU / f64::from(sectors)).sin_cos();
            Vector3::new(sin * x, sin * y, cos) * (1.0 + 0.1 * (5.0 * x).sin())
        }));
    }
    let at = |ring: u32, sector: u32| 2 + (ring - 1) * sectors + sector % sectors;
    let mut faces = Vec::new();
    for s in 0..sectors {
        faces.push([0, at(1, s), at(1, s + 1)]);
        faces.push([1, at(rings - 1, s + 1), at(rings - 1, s)]);
        for r in 1..rings - 1 {
            faces.push([at(r, s), at(r + 1, s), at(r + 1, s + 1)]);
            faces.push([at(r, s), at(r + 1, s + 1), at(r, s + 1)]);
        }
    }
    let shift = Vector3::new(0.3, -1.0 / 3.0, 7e-3);
    let positions = positions
        .into_iter()
        .map(|p| Point3::from(p * 0.05 + shift))
        .collect();
    repair(positions, faces).unwrap().0
}

fn corners_of(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    mesh.faces().map(|(face, _)| mesh.triangle(face)).collect()
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let ball = ball();
    // roundings of half a unit in the last place: none in metres, two in other units, one to f32
    // (and its unit)
    let bounds = [
        ("ply", 0.0, 2.0 * f64::EPSILON),
        ("obj", 0.0, 2.0 * f64::EPSILON),
        ("stl", 6e-8, 6.1e-8),
    ];
    for (extension, in_metres, in_others) in bounds {
        for (unit, bound) in [
            (Metre, in_metres),
            (Millimetre, in_others),
            (Inch, in_others),
        ] {
            let path = folder.path().join(format!("ball.{extension}"));
            write_mesh(&path, &ball, unit).unwrap();
            let MeshFile { mesh, repair } = read_mesh(&path, unit).unwrap();
            assert_eq!(
                (mesh.vertex_count(), mesh.face_count()),
                (ball.vertex_count(), ball.face_count())
            );
            assert_eq!(
                (
                    repair.flipped_faces,
                    repair.boundary_edges,
                    repair.components
                ),
                (0, 0, 1)
            );
            for (read, written) in corners_of(&mesh)
                .as_flattened()
                .iter()
                .zip(corners_of(&ball).as_flattened())
            {
                for (a, b) in read.coords.iter().zip(written.coords.iter()) {
                    assert!(
                        (a - b).abs() <= bound * b.abs(),
                        "{extension} in {unit}: {a} for {b}"
                    );
                }
            }
            let first = std::fs::read(&path).unwrap();
            write_mesh(&path, &ball, unit).unwrap();
            assert_eq!(
                first,
                std::fs::read(&path).unwrap(),
                "same mesh, same bytes"
            );
        }
    }
}

#[test]
fn ply_keeps_the_order_and_leaves_out_what_was_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Ball.PLY");
    let mut ball = ball();
    write_mesh(&path, &ball, Metre).unwrap();
    assert_eq!(
        read_mesh(&path, Metre).unwrap().mesh.positions(),
        ball.positions()
    );
    // the pole loses all its faces and goes with them
    for face in ball.star(VertexId(0)).to_vec() {
        ball.remove_face(face);
    }
    write_mesh(&path, &ball, Metre).unwrap();
    let MeshFile { mesh, repair } = read_mesh(&path, Metre).unwrap();
    assert_eq!(mesh.positions(), &ball.positions()[1..]);
    assert_eq!(
        (
            mesh.face_count(),
            repair.unused_vertices,
            repair.boundary_loops
        ),
        (ball.face_count(), 0, 1)
    );
}

/// By hand: 4 vertices of three doubles and one float each follow the header; the one without a
/// face drops out.
#[test]
fn columns_are_properties_of_the_vertices_in_ply() {
    let p = [[0.0, 0.0], [1.0, 0.0], [9.0, 9.0], [0.0, 1.0], [1.0, 1.0]]
        .map(|[x, y]| Point3::new(x, y, 0.0));
    let mesh = TriMesh::new(p.into(), vec![[0, 1, 3], [1, 4, 3]]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let column = VertexColumn {
        name: "touched",
        values: vec![0.0, 0.5, 9.0, 1.0, 0.25].into(),
    };
    write_mesh_with(&path, &mesh, &[column], None, Metre).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    assert!(
        String::from_utf8_lossy(&bytes[..body])
            .contains("property double z\nproperty float touched\nelement face 2")
    );
    let value =
        |row: usize| f32::from_le_bytes(bytes[body + 28 * row + 24..][..4].try_into().unwrap());
    assert_eq!([0, 1, 2, 3].map(value), [0.0, 0.5, 1.0, 0.25]);
    let read = read_mesh(&path, Metre).unwrap().mesh;
    assert_eq!(
        (read.vertex_count(), corners_of(&read)),
        (4, corners_of(&mesh))
    );
}

/// A square of two triangles, the second one with an image of its own.
const TEXTURED_PLY: &str = "\
    ply\nformat ascii 1.0\ncomment TextureFile a b.png\ncomment TextureFile sub/c.png\nelement vertex 4\n\
    property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n\
    property list uchar float texcoord\nproperty int texnumber\nend_header\n\
    0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n1 1 0 255 0 128\n\
    3 0 1 2 6 0 0 1 0 0 1 0\n3 1 3 2 6 .25 .5 .5 .5 .25 .75 1\n";

/// The same as the other kind of file.
const TEXTURED_OBJ: &str = "\
    mtllib m.mtl\nv 0 0 0 .004 .008 .012\nv 1 0 0 .016 .02 .024\nv 0 1 0 .027 .031 .035\nv 1 1 0 1 0 .5\n\
    vt 0 0\nvt 1 0\nvt 0 1\nvt .25 .5\nvt .5 .5\nvt .25 .75\nusemtl x\nf 1/1 2/2 3/3\nusemtl y\nf 2/4 4/5 3/6\n";

/// Colours and corners by hand.
#[test]
fn colours_and_textures_come_back_from_either_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("in.ply"), TEXTURED_PLY).unwrap();
    std::fs::write(at("in.obj"), TEXTURED_OBJ).unwrap();
    std::fs::write(
        at("m.mtl"),
        "newmtl x\nmap_Kd a b.png\nnewmtl y\nmap_Kd sub/c.png\n",
    )
    .unwrap();
    let colours = vec![[1, 2, 3], [4, 5, 6], [7, 8, 9], [255, 0, 128]];
    let corners = vec![
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        [[0.25, 0.5], [0.5, 0.5], [0.25, 0.75]],
    ];
    let images = vec![at("a b.png"), at("sub/c.png")];
    let texture = Texture {
        corners,
        shown: vec![0, 1],
        images,
    };
    let check = |name: &str| {
        let appearance = read_appearance(&at(name), Metre)
            .unwrap()
            .expect("it says how it looks");
        let mesh = read_mesh(&at(name), Metre).unwrap().mesh;
        assert_eq!(
            appearance.colours_at(mesh.positions(), &SerialWorkers),
            Some(VertexColours::Rgb(colours.clone())),
            "{name}"
        );
        assert_eq!(
            appearance.texture_on(&mesh, mesh.positions(), &SerialWorkers),
            Some(texture.clone()),
            "{name}"
        );
        mesh
    };
    check("in.obj");
    let mesh = check("in.ply");
    let columns = VertexColumn::of_colours(VertexColours::Rgb(colours.clone()));
    for name in ["out.ply", "out.obj"] {
        write_mesh_with(&at(name), &mesh, &columns, Some(&texture), Metre).unwrap();
        check(name);
    }
    assert!(
        std::fs::read_to_string(at("out.mtl"))
            .unwrap()
            .contains("map_Kd sub/c.png")
    );
    // elsewhere the images have their whole names
    std::fs::create_dir(at("sub")).unwrap();
    write_mesh_with(&at("sub/out.ply"), &mesh, &columns, Some(&texture), Metre).unwrap();
    check("sub/out.ply");
    let text = std::fs::read(at("sub/out.ply")).unwrap();
    assert!(String::from_utf8_lossy(&text).contains("TextureFile c.png\n"));
}

/// The content decides for each reader: the header of PCD, with one point by hand.
#[test]
fn points_under_the_name_of_a_mesh_have_neither_appearance_nor_columns() {
    let folder = tempfile::tempdir().unwrap();
    let triangle = TriMesh::new(
        vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ],
        vec![[0, 1, 2]],
    )
    .unwrap();
    for name in ["part.ply", "part.obj", "part.stl", "part.pcd", "part"] {
        let path = folder.path().join(name);
        let header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n";
        std::fs::write(&path, format!("{header}DATA ascii\n1 2 3\n")).unwrap();
        let MeshOrPoints::Points(cloud) = read_mesh_or_points(&path, Metre).unwrap() else {
            panic!("{name} was read as a mesh");
        };
        assert_eq!(cloud.positions, [Point3::new(1.0, 2.0, 3.0)], "{name}");
        assert!(read_appearance(&path, Metre).unwrap().is_none(), "{name}");
        let columns = read_vertex_columns(&path, Metre, &triangle, ["x"]).unwrap();
        assert_eq!(columns, [None], "{name}");
    }
}

#[test]
fn colours_are_bytes_or_shares_and_all_vertices_have_one_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let mesh = read_mesh(&path, Metre).unwrap().mesh;
        read_appearance(&path, Metre)
            .unwrap()
            .and_then(|look| look.colours_at(mesh.positions(), &SerialWorkers))
    };
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let tail = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let of = |kind: &str| {
        format!(
            "{head}property {kind} red\nproperty {kind} green\nproperty {kind} blue\nproperty {kind} alpha\n{tail}"
        )
    };
    let shares = of("float") + "0 0 0 0 .5 1 1\n1 0 0 .2 .4 .6 .8\n0 1 0 1 1 1 0\n3 0 1 2\n";
    let expected = VertexColours::Rgba(vec![
        [0, 128, 255, 255],
        [51, 102, 153, 204],
        [255, 255, 255, 0],
    ]);
    assert_eq!(read("shares.ply", &shares), Some(expected));
    let obj = |last: &str| format!("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0{last}\nf 1 2 3\n");
    assert_eq!(read("some.obj", &obj("")), None);
    let expected = VertexColours::Rgb(vec![[255, 0, 0], [0, 255, 0], [0, 0, 255]]);
    assert_eq!(read("all.obj", &obj(" 0 0 1")), Some(expected));
    // beyond the range of a colour
    let beyond = of("float") + "0 0 0 -1 2 nan 1\n1 0 0 0 0 0 1\n0 1 0 0 0 0 1\n3 0 1 2\n";
    let expected = VertexColours::Rgba(vec![[0, 255, 0, 255], [0, 0, 0, 255], [0, 0, 0, 255]]);
    assert_eq!(read("beyond.ply", &beyond), Some(expected));
}

#[test]
fn places_and_names_that_cannot_be_written_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str| write_mesh(&folder.path().join(name), &ball(), Metre).unwrap_err();
    assert!(matches!(
        refusal("ball.off"),
        MeshFileError::UnknownFormat { .. }
    ));
    let message = refusal("missing/ball.ply").to_string();
    assert!(
        message.contains("there is no folder") && message.contains("make it first"),
        "{message}"
    );
    assert!(std::fs::read_dir(&folder).unwrap().next().is_none());
}

/// Reads `content` under this name.
fn read_text(name: &str, content: &[u8]) -> Result<MeshFile, MeshFileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    read_mesh(&path, Metre)
}

#[test]
fn ply_variants_are_read() {
    let vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let face = "element face 1\nproperty list uchar int vertex_index\n";
    let count = |content: &str| read_text("a.ply", content.as_bytes()).map(|m| m.mesh.face_count());
    let plain = format!(
        "ply\nformat ascii 1.0\nobj_info x\n{header}{face}end_header\n{vertices}4 0 1 2 3\n"
    );
    assert_eq!(count(&plain).unwrap(), 2);
    assert_eq!(count(&plain.replace('\n', "\r\n")).unwrap(), 2);
    assert_eq!(count(&plain.replace('\n', "\r")).unwrap(), 2);
    let between = format!(
        "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nproperty list int float k\n{header}\
         element edge 2\nproperty int a\nproperty int b\nelement face 1\nproperty uchar flags\n\
         property list ushort uint vertex_indices\nproperty list uchar float uv\nend_header\n\
         1.5 2 3 4\n{vertices}0 1\n\n1 2\n7 4 0 1 2 3 1 0.5"
    );
    assert_eq!(count(&between).unwrap(), 2);
    let strips = format!(
        "ply\nformat ascii 1.0\n{header}element tristrips 1\nproperty list int int vertex_indices\nend_header\n{vertices}\
         8 0 1 3 2 -1 0 1 2\n"
    );
    let MeshFile { mesh, repair } = read_text("a.ply", strips.as_bytes()).unwrap();
    // faces 013, 312 and 012, the last upside down
    assert_eq!(
        (
            mesh.face_count(),
            repair.boundary_edges,
            repair.flipped_faces
        ),
        (3, 3, 1)
    );
    let refusal = |content: &str| count(content).unwrap_err().to_string();
    assert!(
        refusal(&plain.replace("4 0 1 2 3", "4 0 1 2"))
            .ends_with("line 15: expected a number, found 'the end of the line'")
    );
    assert!(
        refusal(&plain.replace("4 0 1 2 3", "4 0 1 2 3 9"))
            .ends_with("expected the end of the line, found '9'")
    );
    assert!(
        refusal(&plain.replace("4 0 1 2 3", "3 0 1 -2"))
            .ends_with("expected a vertex number, found '-2'")
    );
    assert!(
        refusal(&plain.replace("4 0 1 2 3", "3 0 1 4"))
            .ends_with("face 0 uses vertex 4, but there are only 4 vertices")
    );
    assert!(
        refusal(&plain.replace("vertex 4", "vertex 4000000000")).contains("4000000000 vertex rows")
    );
    assert!(
        refusal(&plain.replace("float z", "float w"))
            .ends_with("line 4: expected a vertex with x, y and z, found 'no property z'")
    );
    assert!(refusal(&plain.replace("end_header", "end")).contains("line 10: expected format"));
}

#[test]
fn obj_variants_are_read() {
    let read = |content: &[u8]| {
        read_text("a.obj", content).map(|m| {
            (
                m.mesh.vertex_count(),
                m.mesh.face_count(),
                m.repair.unused_vertices,
            )
        })
    };
    // colours on some vertices only, with alpha, a weight, a comment in Latin-1, indices of normals
    // that are not there
    let odd = b"# \xe9t\xe9\no a\nv 0 0 0 1 0 0\nv 1 0 0\n v 2 2 0 2\r\ng b\nv 0 1 0 1 0 0 1\nv 9 9 9\nusemtl x\nf 1//7 2//7 3//7 4//7";
    assert_eq!(read(odd).unwrap(), (4, 2, 1));
    let MeshFile { mesh, .. } = read_text("a.obj", odd).unwrap();
    assert_eq!(
        mesh.position(VertexId(2)),
        Point3::new(1.0, 1.0, 0.0),
        "divided by its weight"
    );
    let refusal = |content: &str| read(content.as_bytes()).unwrap_err().to_string();
    assert!(
        refusal("v 0 0 0\nv 1 0 0\nv 0 1\nf 1 2 3").contains("line 3: expected three coordinates")
    );
    assert!(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 x").contains("line 5: expected a face"));
    assert!(
        refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 -4")
            .ends_with("line 5: a face uses vertex -4, but there are only 3 vertices")
    );
    assert!(
        refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf\nf 1 2 0")
            .contains("line 4: expected numbers of vertices")
    );
}

/// A prism of this height over an outline, in m, with its two ends as one polygon each that begins
/// at corner `first`: OBJ, PLY, and ASCII STL.
fn prism(outline: &[[f64; 2]], height: f64, first: usize) -> [(&'static str, String); 3] {
    let count = outline.len();
    let corners: Vec<[f64; 3]> = [0.0, height]
        .iter()
        .flat_map(|&z| outline.iter().map(move |&[x, y]| [x, y, z - 0.2 * x]))
        .collect();
    let from_first = |at: usize| (first + at) % count;
    let mut faces: Vec<Vec<usize>> = vec![
        (0..count).rev().map(from_first).collect(),
        (0..count).map(|at| count + from_first(at)).collect(),
    ];
    faces.extend((0..count).map(|at| {
        let next = (at + 1) % count;
        vec![at, next, count + next, count + at]
    }));
    let words = |corner: [f64; 3]| corner.map(|x| x.to_string()).join(" ");
    let mut obj: String = corners
        .iter()
        .map(|&p| format!("v {}\n", words(p)))
        .collect();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement face {}\nproperty list uchar int vertex_indices\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        faces.len(),
        corners.len()
    );
    let mut stl = String::from("solid\n");
    for face in &faces {
        let names =
            |by: usize| -> String { face.iter().map(|at| format!(" {}", at + by)).collect() };
        obj += &format!("f{}\n", names(1));
        ply += &format!("{}{}\n", face.len(), names(0));
        let loops: String = face
            .iter()
            .map(|&at| format!("vertex {}\n", words(corners[at])))
            .collect();
        stl += &format!("facet normal 0 0 0\nouter loop\n{loops}endloop\nendfacet\n");
    }
    ply += &corners
        .iter()
        .map(|&p| format!("{}\n", words(p)))
        .collect::<String>();
    [("prism.obj", obj), ("prism.ply", ply), ("prism.stl", stl)]
}

/// An L, a comb, a spiral, and a frame with a cut from its opening to its rim, each with its area.
#[rustfmt::skip]
const OUTLINES: [(&[[f64; 2]], f64); 4] = [
    (&[[0., 0.], [4., 0.], [4., 1.], [1., 1.], [1., 3.], [0., 3.]], 6.0),
    (&[
        [0., 0.], [7., 0.], [7., 4.], [6., 4.], [6., 1.], [5., 1.], [5., 4.], [4., 4.],
        [4., 1.], [3., 1.], [3., 4.], [2., 4.], [2., 1.], [1., 1.], [1., 4.], [0., 4.],
    ], 19.0),
    (&[
        [0., 0.], [5., 0.], [5., 5.], [1., 5.], [1., 2.], [3., 2.], [3., 3.], [2., 3.],
        [2., 4.], [4., 4.], [4., 1.], [0., 1.],
    ], 15.0),
    (&[
        [0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [3., 3.],
        [3., 1.], [1., 1.],
    ], 12.0),
];

/// Each begun at every corner: closed, and with the volume of area times height. That no triangle
/// lies outside shows the area of the surface, twice that of the outline besides the sides.
#[test]
fn polygons_of_any_shape_are_divided_within_their_outline() {
    for (outline, area) in OUTLINES {
        for first in 0..outline.len() {
            for (name, text) in prism(outline, 0.5, first) {
                let MeshFile { mesh, .. } = read_text(name, text.as_bytes()).unwrap();
                let found = volume(&mesh);
                assert!(
                    (found - 0.5 * area).abs() < 1e-6,
                    "{name} from {first}: {found}"
                );
                let ends: f64 = mesh
                    .faces()
                    .map(|(face, _)| mesh.double_area_normal(face))
                    .map(|normal| normal.z.abs() / 2.0)
                    .sum();
                // sides are upright
                assert!(
                    (ends - 2.0 * area).abs() < 1e-6,
                    "{name} from {first}: {ends}"
                );
            }
        }
    }
}

#[test]
fn a_polygon_whose_sides_cross_is_refused_with_its_place() {
    let bow = [[0., 0.], [4., 0.], [0., 3.], [4., 3.], [5., 1.]];
    for (name, text) in prism(&bow, 0.5, 0) {
        let error = read_text(name, text.as_bytes()).unwrap_err().to_string();
        let line = 1 + text
            .lines()
            .position(|line| match name {
                "prism.obj" => line.starts_with("f "),
                "prism.ply" => line.starts_with("5 "),
                _ => line == "endfacet",
            })
            .unwrap();
        let wanted =
            format!("line {line}: the sides of a polygon cross: export the mesh in triangles");
        assert!(error.ends_with(&wanted), "{error}");
    }
}

#[test]
fn lines_that_go_on_are_joined_and_the_next_have_their_numbers() {
    let text = "v 0 0 \\\n0\nv 1 0 0\r\nv 0 \\\r\n 1 \\\n0\nf 1 2 \\\n3\n# to \\\nbe passed over\n";
    let file = read_text("a.obj", text.as_bytes()).unwrap();
    assert_eq!((file.mesh.vertex_count(), file.mesh.face_count()), (3, 1));
    let error = read_text("a.obj", format!("{text}f 1 2 9\n").as_bytes()).unwrap_err();
    let wanted = "line 11: a face uses vertex 9, but there are only 3 vertices";
    assert!(error.to_string().ends_with(wanted), "{error}");
}

#[test]
fn stl_with_more_than_its_header_announces_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.stl");
    write_mesh(&path, &ball(), Metre).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let (faces, len) = (ball().face_count(), bytes.len());
    bytes.push(0);
    std::fs::write(&path, &bytes).unwrap();
    let message = read_mesh(&path, Metre).unwrap_err().to_string();
    let wanted = format!(
        "byte {len}: the header announces {faces} triangles, which take {} bytes, but {} follow",
        50 * faces,
        50 * faces + 1
    );
    assert!(message.contains(&wanted), "{message}");
}

#[test]
fn the_content_decides_where_the_name_lies() {
    let folder = tempfile::tempdir().unwrap();
    for (written, named) in [
        ("a.ply", "b.stl"),
        ("a.stl", "b.obj"),
        ("a.STL", "b.ply"),
        ("a.ply", "b.scan"),
    ] {
        let (written, named) = (folder.path().join(written), folder.path().join(named));
        write_mesh(&written, &ball(), Metre).unwrap();
        std::fs::rename(&written, &named).unwrap();
        assert_eq!(
            read_mesh(&named, Metre).unwrap().mesh.face_count(),
            ball().face_count()
        );
    }
    // a binary file whose header begins like an ASCII one
    let path = folder.path().join("solid.stl");
    write_mesh(&path, &ball(), Metre).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[..19].copy_from_slice(b"solid a facet of it");
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(
        read_mesh(&path, Metre).unwrap().mesh.face_count(),
        ball().face_count()
    );
}

#[test]
fn the_unit_must_fit_the_size_and_the_offset_does_not_matter() {
    let triangle = |side: f64, offset: f64| {
        let obj = format!(
            "v {0:?} {0:?} 0\nv {1:?} {0:?} 0\nv {0:?} {1:?} 0\nf 1 2 3\n",
            offset,
            offset + side
        );
        read_text("a.obj", obj.as_bytes())
            .map(|m| m.mesh.face_count())
            .map_err(|e| e.to_string())
    };
    assert_eq!(triangle(0.1, 0.0), Ok(1));
    assert_eq!(triangle(0.1, 1e6), Ok(1));
    assert!(
        triangle(100.0, 0.0)
            .unwrap_err()
            .ends_with("probably in millimetres, try --mesh-unit mm")
    );
    assert!(triangle(1e-5, 0.0).unwrap_err().contains("too small"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// A mesh or one line that names the file, and no allocation out of proportion to the file.
    #[test]
    fn damaged_files_never_panic(kind in 0usize..5, cut in 0.0..1.3f64, flips in prop::collection::vec((any::<prop::sample::Index>(), 0u8..8), 0..6)) {
        let folder = tempfile::tempdir().unwrap();
        let name = ["a.ply", "a.stl", "a.obj", "ascii.ply", "ascii.stl"][kind];
        let path = folder.path().join(name);
        let mut bytes = match kind {
            3 => b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_vec(),
            4 => b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n".to_vec(),
            _ => {
                write_mesh(&path, &ball(), Metre).unwrap();
                std::fs::read(&path).unwrap()
            }
        };
        bytes.truncate((cut * bytes.len() as f64) as usize);
        if !bytes.is_empty() {
            for (at, bit) in flips {
                // half of the damage hits the headers in the first 400 bytes
                let len = if bit % 2 == 0 { bytes.len().min(400) } else { bytes.len() };
                let at = at.index(len);
                bytes[at] ^= 1 << bit;
            }
        }
        std::fs::write(&path, &bytes).unwrap();
        let (outcome, largest) = largest_request(|| read_mesh(&path, Metre));
        // 24 bytes of position for the 3 bytes of the shortest row, and the smallest size of the
        // tables
        prop_assert!(largest <= 16 * bytes.len() + 4096, "{largest} bytes at once");
        match outcome {
            Ok(MeshFile { mesh, .. }) => prop_assert!(mesh.face_count() > 0),
            Err(error) => {
                let message = error.to_string();
                prop_assert!(message.contains(name) && !message.contains('\n'), "{}", message);
            }
        }
    }
}

/// By the definitions of 1959: an inch is 25.4 mm.
#[test]
fn units_are_as_long_as_they_are_defined() {
    assert_eq!(
        [Metre, Millimetre, Inch].map(|unit| unit.metres()),
        [1.0, 0.001, 0.0254]
    );
}
