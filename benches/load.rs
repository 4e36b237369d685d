//! Reading a mesh file of a million triangles, with repair and adjacency; and of five million with
//! the tree over its faces: `cargo bench --bench load`.

use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use nalgebra::Point3;
use tempfile::TempDir;
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::mesh::{FaceTree, TriMesh, repair};
use touchup::threads::Threads;

/// Quads of 1 mm in a row, and rows, of a wavy sheet of a million triangles.
const MILLION: [u32; 2] = [1000, 500];
/// The same for five million triangles.
const FIVE_MILLION: [u32; 2] = [2000, 1250];

fn main() {
    divan::main();
}

fn sheet([columns, rows]: [u32; 2]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let point = |i: u32, j: u32| {
        let (x, y) = (f64::from(i) * 1e-3, f64::from(j) * 1e-3);
        Point3::new(x, y, 0.02 * (17.0 * x).sin() * (23.0 * y).cos())
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
    (positions, faces)
}

/// The sheet as a file, read once and compared.
fn file(name: &str, quads: [u32; 2]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    let (positions, faces) = sheet(quads);
    let counts = (positions.len(), faces.len());
    if name == "single.ply" {
        write_single(&path, &positions, &faces);
    } else {
        let mesh = TriMesh::new(positions, faces).expect("the sheet is sound");
        write_mesh(&path, &mesh, MeshUnit::Metre).expect("room for the file");
    }
    let read = read_mesh(&path, MeshUnit::Metre).expect("the file just written");
    assert_eq!((read.mesh.vertex_count(), read.mesh.face_count()), counts);
    assert_eq!(
        (
            read.repair.components,
            read.repair.boundary_loops,
            read.repair.flipped_faces
        ),
        (1, 1, 0)
    );
    (folder, path)
}

/// Coordinates as `float`, the commonest layout of PLY files.
fn write_single(path: &PathBuf, positions: &[Point3<f64>], faces: &[[u32; 3]]) {
    let mut out = BufWriter::new(File::create(path).expect("a temporary file"));
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        faces.len(),
    );
    let mut put = |bytes: &[u8]| out.write_all(bytes).expect("room for the file");
    put(header.as_bytes());
    positions.iter().for_each(|p| {
        p.coords
            .iter()
            .for_each(|x| put(&(*x as f32).to_le_bytes()))
    });
    for face in faces {
        put(&[3]);
        face.iter().for_each(|v| put(&v.to_le_bytes()));
    }
    drop(out);
}

/// `single.ply`: as most programs write it; `double.ply`, `.stl`, `.obj`: as this one does.
#[divan::bench(args = ["single.ply", "double.ply", "binary.stl", "text.obj"], sample_count = 10)]
fn load(bencher: divan::Bencher, name: &str) {
    let (_folder, path) = file(name, MILLION);
    bencher.bench_local(|| read_mesh(black_box(&path), MeshUnit::Metre).expect("read before"));
}

/// Five million triangles, and the tree over them.
#[divan::bench(args = ["single.ply", "binary.stl"], sample_count = 10)]
fn load_to_tree(bencher: divan::Bencher, name: &str) {
    let (_folder, path) = file(name, FIVE_MILLION);
    bencher.bench_local(|| {
        let read = read_mesh(black_box(&path), MeshUnit::Metre).expect("read before");
        FaceTree::new_by(&read.mesh, &Threads)
    });
}

/// The part of it that checks, welds, orients and builds the adjacency.
#[divan::bench(sample_count = 10)]
fn repair_only(bencher: divan::Bencher) {
    bencher
        .with_inputs(|| sheet(MILLION))
        .bench_local_values(|(positions, faces)| repair(positions, faces).expect("sound"));
}

/// `tobj` on `text.obj`, for comparison.
#[divan::bench(sample_count = 5)]
fn tobj_only(bencher: divan::Bencher) {
    let (_folder, path) = file("text.obj", MILLION);
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    bencher.bench_local(|| tobj::load_obj(black_box(&path), &options).expect("read before"));
}
