//! Deviation of meshes from the true part: closed forms, regions, pictures, and the verb.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;
use touchup::align::{IcpParams, icp};
use touchup::compare::{
    CompareError, CompareParams, Comparison, IndexedMesh, Picture, PictureLabel, PicturePanel,
    PictureParams, Regions, Summary, SupportRegion, cloud_distances, colour_of, compare,
    deviations, draw_picture, sample_surface, surface_area, tilts,
};
use touchup::io::mesh_file::{
    MeshUnit, VertexColumn, read_mesh, read_vertex_columns, write_mesh, write_mesh_with,
};
use touchup::io::png::write_png;
use touchup::mesh::{FaceTree, SerialWorkers, Task, TriMesh, Workers};
use touchup::sim::wavy;

/// A square of 20 mm at a height, in 2 × `cells`² triangles, normals up.
fn square(cells: u32, height: f64) -> TriMesh {
    let row = cells + 1;
    let at = |i: u32| 20e-3 * f64::from(i) / f64::from(cells);
    let positions = (0..row * row)
        .map(|i| Point3::new(at(i % row), at(i / row), height))
        .collect();
    let faces = (0..cells * cells).flat_map(|i| {
        let a = i / cells * row + i % cells;
        [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]
    });
    TriMesh::new(positions, faces.collect()).unwrap()
}

/// A cube of 10 mm, its lower corner at `at` (m), normals outside.
fn cube(at: Vector3<f64>) -> TriMesh {
    let corner = |i: u32| {
        Point3::from(
            at + Vector3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into()) * 10e-3,
        )
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    TriMesh::new((0..8).map(corner).collect(), faces).unwrap()
}

/// The icosahedron with corners at `radius` about the origin.
fn icosahedron(radius: f64) -> TriMesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (a, b) in [
        (1.0, golden),
        (-1.0, golden),
        (1.0, -golden),
        (-1.0, -golden),
    ] {
        positions.extend([
            Point3::new(0.0, a, b),
            Point3::new(a, b, 0.0),
            Point3::new(b, 0.0, a),
        ]);
    }
    let positions: Vec<_> = positions
        .iter()
        .map(|p| Point3::from(p.coords.normalize() * radius))
        .collect();
    let near = |a: usize, b: usize| (positions[a] - positions[b]).norm() < 1.1 * radius;
    let mut faces = Vec::new();
    for (a, b, c) in (0..12).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c))))
    {
        if near(a, b) && near(b, c) && near(c, a) {
            let [p, q, r] = [a, b, c].map(|i| positions[i].coords);
            let outward = (q - p).cross(&(r - p)).dot(&p) > 0.0;
            faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
        }
    }
    assert_eq!(faces.len(), 20);
    TriMesh::new(positions, faces).unwrap()
}

fn compared(mesh: &TriMesh, truth: &TriMesh, params: &CompareParams) -> Comparison {
    let trees = [mesh, truth].map(FaceTree::new);
    let shapes = [
        IndexedMesh {
            mesh,
            tree: &trees[0],
        },
        IndexedMesh {
            mesh: truth,
            tree: &trees[1],
        },
    ];
    compare(
        shapes[0],
        shapes[1],
        Regions::Unknown,
        params,
        &SerialWorkers,
    )
    .unwrap()
}

/// A tetrahedron is so sharp that a place beside an edge or a corner may be behind one of its
/// faces: it is outside all the same.
#[test]
fn beside_sharp_edges_and_corners_outside_is_outside() {
    let corners = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let positions: Vec<_> = corners
        .iter()
        .map(|&corner| Point3::from(corner) * 10e-3)
        .collect();
    let mesh = TriMesh::new(
        positions.clone(),
        vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
    )
    .unwrap();
    let tree = FaceTree::new(&mesh);
    let normal = |face: usize| -Vector3::from(corners[[3, 2, 1, 0][face]]).normalize();
    assert!(
        mesh.faces()
            .enumerate()
            .all(|(at, (face, _))| (mesh.normal(face) - normal(at)).norm() < 1e-12)
    );
    let mut places = Vec::new();
    for (a, b) in (0..4).flat_map(|a| (0..a).map(move |b| (a, b))) {
        let middle = nalgebra::center(&positions[a], &positions[b]);
        // the two faces at that edge are those that lack one of the other corners
        let beside: Vec<_> = (0..4)
            .filter(|&face| [3, 2, 1, 0][face] != a && [3, 2, 1, 0][face] != b)
            .collect();
        for share in [0.1, 0.5, 0.9] {
            let out = normal(beside[0]) * share + normal(beside[1]) * (1.0 - share);
            places.push((middle + out * 1e-3, out.norm() * 1e-3));
        }
    }
    places.extend(
        positions
            .iter()
            .map(|corner| (corner * 1.1, corner.coords.norm() * 0.1)),
    );
    let points: Vec<_> = places.iter().map(|(place, _)| *place).collect();
    for (found, (place, expected)) in deviations(&points, &mesh, &tree, &SerialWorkers)
        .unwrap()
        .iter()
        .zip(&places)
    {
        assert!(
            (found - expected).abs() < 1e-12,
            "{found} and not {expected} m at {place}"
        );
    }
}

fn few() -> CompareParams {
    CompareParams {
        samples: 5_000,
        ..Default::default()
    }
}

#[test]
fn parallel_planes_are_as_far_apart_as_they_are() {
    let truth = square(1, 0.0);
    for (height, side) in [(0.3e-3, 1.0), (-0.3e-3, -1.0)] {
        let found = compared(&square(7, height), &truth, &few());
        let all = &found.regions[0];
        for summary in [
            &all.mesh_to_truth,
            &all.truth_to_mesh,
            &all.vertices_to_truth,
        ] {
            let Summary {
                mean,
                rms,
                median,
                p95,
                p99,
                max,
                bias,
                ..
            } = summary.clone().unwrap();
            for size in [mean, rms, median, p95, p99, max] {
                assert!((size - 0.3e-3).abs() < 1e-15, "{summary:?}");
            }
            assert!(
                (bias - side * 0.3e-3).abs() < 1e-15,
                "above is too much, below too little: {summary:?}"
            );
        }
        let tilt = all.tilt.unwrap();
        assert_eq!((tilt.median, tilt.p95, tilt.flipped), (0.0, 0.0, 0.0));
        assert_eq!(
            all.histogram.counts.iter().sum::<usize>() + all.histogram.above,
            all.mesh_to_truth.clone().unwrap().points
        );
        assert_eq!(found.unseen, 0.0);
    }
}

#[test]
fn a_mesh_inside_out_is_flipped_and_shows_nothing() {
    let truth = square(3, 0.0);
    let mut mesh = square(3, 0.1e-3);
    let faces: Vec<_> = mesh.faces().map(|(face, _)| face).collect();
    faces[..9].iter().for_each(|&face| mesh.flip_face(face));
    let found = compared(&mesh, &truth, &few());
    let tilt = found.regions[0].tilt.unwrap();
    // half of the area, within its rounding
    assert!(
        (tilt.flipped - 0.5).abs() < 1e-12 && (tilt.p95 - std::f64::consts::PI).abs() < 1e-12,
        "{tilt:?}"
    );
    assert!((found.unseen - 0.5).abs() < 0.01, "{}", found.unseen);
}

#[test]
fn a_ball_of_facets_has_the_distances_of_its_facets() {
    let (inner, outer) = (8e-3, 10e-3);
    let truth = icosahedron(inner);
    let tree = FaceTree::new(&truth);
    let above_corners = icosahedron(outer);
    for deviation in deviations(above_corners.positions(), &truth, &tree, &SerialWorkers).unwrap() {
        assert!((deviation - (outer - inner)).abs() < 1e-16, "{deviation}");
    }
    // the radius of the ball inside an icosahedron over that around it: √((5 + 2√5) / 15)
    let in_radius = inner * ((5.0 + 2.0 * 5.0_f64.sqrt()) / 15.0).sqrt();
    let above_facets: Vec<_> = truth
        .faces()
        .map(|(face, _)| Point3::from(truth.barycentre(face).coords.normalize() * outer))
        .collect();
    for deviation in deviations(&above_facets, &truth, &tree, &SerialWorkers).unwrap() {
        assert!(
            (deviation - (outer - in_radius)).abs() < 1e-16,
            "{deviation}"
        );
    }
    let centre = deviations(&[Point3::origin()], &truth, &tree, &SerialWorkers).unwrap()[0];
    assert!((centre + in_radius).abs() < 1e-16, "{centre}");
}

#[test]
fn a_shifted_cube_is_off_where_it_sticks_out() {
    let truth = cube(Vector3::zeros());
    let mesh = cube(Vector3::x() * 1e-3);
    let found = compared(&mesh, &truth, &few());
    for (p, deviation) in mesh.positions().iter().zip(&found.vertex_deviations) {
        let expected = if p.x > 10e-3 { 1e-3 } else { 0.0 };
        assert!((deviation - expected).abs() < 1e-16, "{p}: {deviation}");
    }
    let summary = found.regions[0].mesh_to_truth.clone().unwrap();
    assert!((summary.max - 1e-3).abs() < 1e-15, "{summary:?}");
    // integrals over the faces, mm²·mm: the one in front 100 · 1; the four at its sides ∫₀¹ x dx ·
    // 10 each; behind, at a depth of 1, a pyramid's frustum ∫ min(1, distance to the rim) = (100 +
    // 10 · 8 + 64) / 3 · 1 below zero
    let [front, sides, behind] = [100.0, 4.0 * 5.0, -(100.0 + 80.0 + 64.0) / 3.0];
    let expected = (front + sides + behind) / 600.0 * 1e-3;
    assert!(
        (summary.bias - expected).abs() < 0.01e-3,
        "{} instead of {expected}",
        summary.bias
    );
}

#[test]
fn samples_are_even_and_come_again() {
    let mesh = square(5, 0.0);
    let density = 1e4 / surface_area(&mesh);
    let samples = sample_surface(&mesh, density, 9);
    assert!(samples.len().abs_diff(10_000) <= 1, "{}", samples.len());
    assert_eq!(samples, sample_surface(&mesh, density, 9));
    assert_ne!(samples, sample_surface(&mesh, density, 10));
    // four quarters of 2500, which cut faces: a deviation of five times the root
    for quarter in 0..4 {
        let is_in = |p: &Point3<f64>| (p.x > 10e-3) as u8 + 2 * (p.y > 10e-3) as u8 == quarter;
        let count = samples.iter().filter(|sample| is_in(&sample.point)).count();
        assert!(count.abs_diff(2500) < 250, "{count}");
    }
    for sample in &samples {
        let [a, b, c] = mesh.triangle(sample.face);
        let parts =
            [(b, c), (c, a), (a, b)].map(|(s, e)| (s - sample.point).cross(&(e - sample.point)).z);
        assert!(
            parts.iter().all(|part| *part >= -1e-18),
            "outside of its face: {sample:?}"
        );
        let nearest = mesh.corners(sample.face)[parts
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .unwrap()
            .0];
        assert_eq!(sample.corner, nearest);
    }
}

#[test]
fn regions_are_separated_and_looked_up_for_the_scan() {
    let truth = square(1, 0.0);
    // as after a touch: the left half fits, the right half is 0.5 mm too high
    let mut mesh = square(20, 0.0);
    let mut regions = vec![SupportRegion::Touched; mesh.vertex_slots()];
    for (at, region) in regions.iter_mut().enumerate() {
        let vertex = touchup::mesh::VertexId(at as u32);
        let p = mesh.position(vertex);
        if p.x > 10.5e-3 {
            mesh.set_position(vertex, Point3::new(p.x, p.y, 0.5e-3));
            *region = SupportRegion::Untouched;
        }
    }
    let scan = square(20, 0.5e-3);
    let trees = [&mesh, &truth, &scan].map(FaceTree::new);
    let [after, part, before] =
        [(&mesh, 0), (&truth, 1), (&scan, 2)].map(|(mesh, at)| IndexedMesh {
            mesh,
            tree: &trees[at],
        });
    let own = compare(after, part, Regions::Own(&regions), &few(), &SerialWorkers).unwrap();
    let through = compare(
        before,
        part,
        Regions::Of(after, &regions),
        &few(),
        &SerialWorkers,
    )
    .unwrap();
    for found in [&own, &through] {
        let names: Vec<_> = found.regions.iter().map(|part| part.region).collect();
        assert_eq!(
            names,
            [
                None,
                Some(SupportRegion::Touched),
                Some(SupportRegion::Untouched)
            ]
        );
        let points = |at: usize| found.regions[at].mesh_to_truth.clone().unwrap().points;
        assert_eq!(points(0), points(1) + points(2));
        // the border lies between the columns at 10 and 11 mm
        assert!(
            (points(1) as f64 / points(0) as f64 - 0.525).abs() < 0.02,
            "{}",
            points(1)
        );
    }
    let touched = own.regions[1].vertices_to_truth.clone().unwrap();
    assert!(
        touched.max < 1e-17 && touched.points == 11 * 21,
        "{touched:?}"
    );
    let was = through.regions[1].mesh_to_truth.clone().unwrap();
    assert!((was.mean - 0.5e-3).abs() < 1e-15, "{was:?}");
    let same = own.regions[1].truth_to_mesh.clone().unwrap().points;
    assert_eq!(
        through.regions[1].truth_to_mesh.clone().unwrap().points,
        same,
        "the same true places before and after"
    );
}

#[test]
fn what_is_no_number_or_no_mesh_is_refused() {
    let mesh = square(1, 0.0);
    let tree = FaceTree::new(&mesh);
    let bad = [Point3::origin(), Point3::new(0.0, f64::INFINITY, 0.0)];
    assert_eq!(
        deviations(&bad, &mesh, &tree, &SerialWorkers),
        Err(CompareError::NotFinite { point: 1 })
    );
    assert_eq!(
        cloud_distances(&bad, &bad[..1], &SerialWorkers),
        Err(CompareError::NotFinite { point: 1 })
    );
    let empty = TriMesh::new(vec![Point3::origin()], vec![]).unwrap();
    let nothing = FaceTree::new(&empty);
    assert_eq!(
        deviations(&bad[..1], &empty, &nothing, &SerialWorkers),
        Err(CompareError::NoFaces)
    );
    assert_eq!(tilts(&mesh, &empty, &nothing), Err(CompareError::NoFaces));
    let shapes = [
        IndexedMesh {
            mesh: &mesh,
            tree: &tree,
        },
        IndexedMesh {
            mesh: &empty,
            tree: &nothing,
        },
    ];
    for (mesh, truth) in [
        (shapes[0], shapes[1]),
        (shapes[1], shapes[0]),
        (shapes[1], shapes[1]),
    ] {
        assert_eq!(
            compare(mesh, truth, Regions::Unknown, &few(), &SerialWorkers),
            Err(CompareError::NoFaces)
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The common place of both does not matter.
    #[test]
    fn a_motion_of_both_changes_nothing(
        shift in prop::array::uniform3(-0.5..0.5f64), turn in prop::array::uniform3(-2.0..2.0f64),
    ) {
        let frame = Isometry3::new(shift.into(), turn.into());
        let moved = |mesh: &TriMesh| TriMesh::new(
            mesh.positions().iter().map(|p| frame * p).collect(),
            mesh.faces().map(|(_, corners)| corners.map(|v| v.0)).collect(),
        ).unwrap();
        let (mesh, truth) = (cube(Vector3::new(0.2e-3, -0.4e-3, 1.1e-3)), icosahedron(9e-3));
        let params = CompareParams { samples: 2_000, range: Some(5e-3), ..Default::default() };
        let [here, there] = [compared(&mesh, &truth, &params), compared(&moved(&mesh), &moved(&truth), &params)];
        let numbers = |found: &Comparison| -> Vec<f64> {
            let all = &found.regions[0];
            let summaries = [&all.mesh_to_truth, &all.truth_to_mesh, &all.vertices_to_truth, &all.cloud_to_truth, &all.truth_to_cloud];
            summaries.into_iter().flat_map(|summary| {
                let Summary { mean, rms, median, p95, p99, max, bias, .. } = summary.clone().unwrap();
                [mean, rms, median, p95, p99, max, bias]
            }).collect()
        };
        for (a, b) in numbers(&here).iter().zip(numbers(&there)) {
            // rounding of coordinates of 0.5 m is 1e-16 m
            prop_assert!((a - b).abs() < 1e-14, "{} {}", a, b);
        }
    }
}

/// A square in one colour on each half.
fn picture_of(deviations: &[f64], mesh: &TriMesh, panels: usize) -> Picture {
    let panel = PicturePanel {
        deviations,
        title: "a panel",
        note: "its note",
        ..PicturePanel::of(mesh)
    };
    let from = Some(Vector3::z());
    let params = PictureParams {
        title: "a title",
        width: 800,
        from,
        ..PictureParams::default()
    };
    draw_picture(&vec![panel; panels], &params)
}

fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let at = 3 * (y * picture.size[0] + x) as usize;
    picture.pixels[at..at + 3].try_into().unwrap()
}

#[test]
fn a_picture_shows_too_much_in_red_on_the_side_where_it_is() {
    let mesh = square(2, 0.0);
    let sides: Vec<_> = mesh
        .positions()
        .iter()
        .map(|p| {
            if p.x < 9e-3 {
                -9.0
            } else if p.x > 11e-3 {
                9.0
            } else {
                0.0
            }
        })
        .collect();
    let picture = picture_of(&sides, &mesh, 1);
    let [width, height] = picture.size;
    assert_eq!(
        (width, picture.pixels.len()),
        (800, 3 * (width * height) as usize)
    );
    let [left, right] = [width * 5 / 16, width * 11 / 16].map(|x| pixel(&picture, x, height / 2));
    assert!(
        left[2] > left[0] + 40,
        "blue where there is too little: {left:?}"
    );
    assert!(
        right[0] > right[2] + 40,
        "red where there is too much: {right:?}"
    );
    // the bar of colours has both its ends, clear of light and shade
    for end in [colour_of(-1.0, 1.0), colour_of(1.0, 1.0)] {
        let near = |p: &[u8]| p.iter().zip(end).all(|(a, b)| a.abs_diff(b) < 6);
        assert!(
            picture.pixels.chunks(3).filter(|p| near(p)).count() >= 20,
            "{end:?}"
        );
    }
    assert_eq!(picture, picture_of(&sides, &mesh, 1), "the same again");
}

/// A label stands at its place, in the box beside it the colours of paper and ink.
#[test]
fn a_label_marks_its_place() {
    let mesh = square(2, 0.0);
    let flat = vec![0.0; mesh.vertex_slots()];
    let panel = PicturePanel {
        deviations: &flat,
        ..PicturePanel::of(&mesh)
    };
    let draw = |labels: &[PictureLabel]| {
        let from = Some(Vector3::z());
        draw_picture(
            &[panel],
            &PictureParams {
                width: 800,
                from,
                labels,
                ..PictureParams::default()
            },
        )
    };
    // the middle of the square is the middle of its panel
    let label = PictureLabel {
        place: Point3::new(10e-3, 10e-3, 0.0),
        text: "hole Ø8.00".to_owned(),
    };
    let [bare, labelled] = [draw(&[]), draw(&[label])];
    assert_eq!(bare.size, labelled.size);
    let changed: Vec<[u32; 2]> = (0..bare.size[0])
        .flat_map(|x| (0..bare.size[1]).map(move |y| [x, y]))
        .filter(|[x, y]| pixel(&bare, *x, *y) != pixel(&labelled, *x, *y))
        .collect();
    let is_ink = |[x, y]: &&[u32; 2]| pixel(&labelled, *x, *y).iter().all(|&c| c < 60);
    let place = changed
        .iter()
        .filter(is_ink)
        .map(|[x, _]| *x)
        .min()
        .unwrap();
    assert!(
        place.abs_diff(bare.size[0] / 2) < 8,
        "the dot is the leftmost ink: {place}"
    );
    assert!(changed.len() > 1000, "a name is written: {}", changed.len());
}

#[test]
fn two_panels_stand_side_by_side_and_none_is_no_panic() {
    let mesh = square(2, 0.0);
    let flat = vec![0.0; mesh.vertex_slots()];
    let two = picture_of(&flat, &mesh, 2);
    let white = |x: u32| pixel(&two, x, two.size[1] / 3);
    assert_eq!(white(200), white(600), "both panels show the same");
    assert_eq!(white(400), [255; 3], "paper between them");
    assert_eq!(picture_of(&[], &mesh, 0).size[0], 800);
    assert_eq!(picture_of(&[f64::NAN; 9], &mesh, 1).size[0], 800);
}

#[test]
fn a_png_holds_the_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let pixels: Vec<u8> = (0..60).collect();
    write_png(&path, [5, 4], &pixels).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(fs::read(&path).unwrap()))
        .read_info()
        .unwrap();
    let mut read = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut read).unwrap();
    assert_eq!((frame.width, frame.height, read), (5, 4, pixels.clone()));
    assert!(write_png(&path, [6, 4], &pixels).is_err());
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "nothing is left over"
    );
}

#[test]
fn columns_come_back_by_vertex_through_repair() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    // no face uses vertex 0, 2 is 1 again, -0 is 0
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float touched\nproperty float x\nproperty float y\n\
                property uchar red\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                9 5 5 200 5\n0.5 -0 0 1 0\n8 0 0 2 0\n1 40 0 3 0\n0 40 30 4 0\n0.25 0 30 5 0\n3 1 3 4\n3 2 4 5\n";
    fs::write(&path, text).unwrap();
    let unit = MeshUnit::Millimetre;
    let mesh = read_mesh(&path, unit).unwrap().mesh;
    let [touched, red, none] =
        read_vertex_columns(&path, unit, &mesh, ["touched", "red", "sigma_mm"]).unwrap();
    assert_eq!((touched.unwrap(), none), (vec![0.5, 1.0, 0.0, 0.25], None));
    assert_eq!(red.unwrap(), [1.0, 3.0, 4.0, 5.0]);

    let colours = [
        ("red", vec![0u8, 127, 255, 3]),
        ("green", vec![9; 4]),
        ("blue", vec![1, 2, 3, 4]),
    ];
    let mut columns: Vec<_> = colours
        .iter()
        .map(|(name, values)| VertexColumn {
            name,
            values: values.clone().into(),
        })
        .collect();
    columns.push(VertexColumn {
        name: "deviation_mm",
        values: vec![0.5f32, -0.25, 0.0, 1e-3].into(),
    });
    let path = folder.path().join("b.ply");
    write_mesh_with(&path, &mesh, &columns, None, unit).unwrap();
    let again = read_mesh(&path, unit).unwrap().mesh;
    let written = fs::read(&path).unwrap();
    assert!(
        String::from_utf8_lossy(&written[..400])
            .contains("property uchar red\nproperty uchar green\nproperty uchar blue")
    );
    let [red, deviation] =
        read_vertex_columns(&path, unit, &again, ["red", "deviation_mm"]).unwrap();
    assert_eq!(
        (red.unwrap(), deviation.unwrap()),
        (vec![0.0, 127.0, 255.0, 3.0], vec![0.5, -0.25, 0.0, 1e-3])
    );
}

fn touchup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

fn parts_of(output: &Output) -> (i32, &str, &str) {
    let text = |bytes| std::str::from_utf8(bytes).unwrap();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// A plate of 20 mm as truth, and one 0.25 mm above it as mesh, in mm.
fn plates(folder: &Path) -> [String; 2] {
    [("mesh.ply", 0.25e-3), ("truth.stl", 0.0)].map(|(name, height)| {
        let path = folder.join(name);
        write_mesh(&path, &square(4, height), MeshUnit::Millimetre).unwrap();
        path.to_str().unwrap().to_owned()
    })
}

#[test]
#[expect(clippy::too_many_lines)]
fn compare_prints_numbers_and_writes_picture_and_colours() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, truth] = plates(folder.path());
    let [picture, coloured] =
        ["a.png", "a.ply"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    let files = [
        "--picture",
        &picture,
        "--coloured",
        &coloured,
        "--before",
        &mesh,
        "--samples",
        "1000",
    ];
    let output = touchup(&[&["compare", &mesh, &truth, "--json"][..], &files].concat());
    let (code, out, err) = parts_of(&output);
    assert_eq!((code, err), (0, ""));
    let report: serde_json::Value = serde_json::from_str(out).unwrap();
    for what in ["before", "after"] {
        let all = &report[what]["regions"][0];
        assert_eq!(all["region"], "all");
        for distance in [
            "mean_mm",
            "rms_mm",
            "median_mm",
            "p95_mm",
            "p99_mm",
            "max_mm",
            "bias_mm",
        ] {
            let found = all["mesh_to_truth"][distance].as_f64().unwrap();
            assert!((found - 0.25).abs() < 1e-9, "{distance}: {found}");
        }
        assert_eq!(all["normals"]["flipped_share"], 0.0);
        assert!(
            all["cloud_to_truth"].get("bias_mm").is_none(),
            "a cloud has no sides"
        );
    }
    // all of it is 0.25 mm off
    for (tolerance, share) in [("0.3", 1.0), ("0.2", 0.0)] {
        let output = touchup(&[
            "compare",
            &mesh,
            &truth,
            "--json",
            "--samples",
            "1000",
            "--tolerance-mm",
            tolerance,
        ]);
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(
            report["after"]["regions"][0]["within_tolerance_share"], share,
            "{tolerance}"
        );
    }
    let png = fs::read(&picture).unwrap();
    assert_eq!(
        (
            &png[1..4],
            u32::from_be_bytes(png[16..20].try_into().unwrap())
        ),
        (&b"PNG"[..], 1600)
    );
    let again = read_mesh(Path::new(&coloured), MeshUnit::Millimetre)
        .unwrap()
        .mesh;
    let [deviation] = read_vertex_columns(
        Path::new(&coloured),
        MeshUnit::Millimetre,
        &again,
        ["deviation_mm"],
    )
    .unwrap();
    assert_eq!(deviation.unwrap(), vec![0.25; 25]);

    let output = touchup(&[
        "compare",
        &mesh,
        &truth,
        "--samples",
        "1000",
        "--align",
        "icp",
    ]);
    let (code, out, err) = parts_of(&output);
    assert_eq!(code, 0);
    assert!(err.contains("3 motions leave the mesh"), "{err}");
    assert!(
        out.contains("aligned by icp") && out.contains("not determined") && !out.contains("rounds"),
        "{out}"
    );
}

#[test]
fn compare_prints_a_verdict_and_with_v_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, truth] = plates(folder.path());
    let arguments = [
        "compare",
        &mesh,
        &truth,
        "--samples",
        "1000",
        "--tolerance-mm",
        "0.3",
        "--before",
        &mesh,
    ];
    let output = touchup(&arguments);
    let (code, verdict, err) = parts_of(&output);
    assert_eq!((code, err), (0, ""));
    let expected = "the mesh is off by 0.250 mm on average over all, 95 % within 0.250 mm; before: mean 0.250 mm, 95 % \
                    within 0.250 mm\nrms 0.250 mm, at most 0.250 mm, 100.0 % in tolerance; before: rms 0.250 mm, at most \
                    0.250 mm, 100.0 % in tolerance\nthe mesh shows 100.0 % of the true surface\n";
    assert_eq!(verdict, expected);
    let output = touchup(&[&arguments[..], &["-v"]].concat());
    let (code, out, err) = parts_of(&output);
    assert_eq!((code, err), (0, ""));
    for row in [
        "mesh to truth",
        "truth to mesh",
        "vertices",
        "normals",
        "32 faces, 20.0 x 20.0 x 0.0 mm",
        "points/mm2",
    ] {
        assert!(
            out.starts_with(verdict) && out.contains(row),
            "{row}: {out}"
        );
    }
}

#[test]
fn a_refined_mesh_is_reported_by_support() {
    let folder = tempfile::tempdir().unwrap();
    let [_, truth] = plates(folder.path());
    let path = folder.path().join("refined.ply");
    let mesh = square(4, 0.25e-3);
    let region_sizes = |columns: &[VertexColumn]| -> Vec<(String, u64)> {
        write_mesh_with(&path, &mesh, columns, None, MeshUnit::Millimetre).unwrap();
        let output = touchup(&[
            "compare",
            path.to_str().unwrap(),
            &truth,
            "--samples",
            "1000",
            "--json",
        ]);
        let (code, out, err) = parts_of(&output);
        assert_eq!((code, err), (0, ""));
        let report: serde_json::Value = serde_json::from_str(out).unwrap();
        let regions = report["after"]["regions"].as_array().unwrap().iter();
        let points =
            |part: &serde_json::Value| part["vertices_to_truth"]["points"].as_u64().unwrap();
        regions
            .map(|part| (part["region"].as_str().unwrap().to_owned(), points(part)))
            .collect()
    };
    // 3 from the scan, 10 touched, 7 guessed, 5 unreachable for the ball, which are guesses too
    let support: Vec<f32> = [(0.0, 3), (1.0, 10), (2.0, 7), (3.0, 5)]
        .iter()
        .flat_map(|&(n, times)| vec![n; times])
        .collect();
    let touched: Vec<f32> = [(0.0, 4), (1.0, 12), (0.5, 9)]
        .iter()
        .flat_map(|&(n, times)| vec![n; times])
        .collect();
    let column = |name, values: &Vec<f32>| VertexColumn {
        name,
        values: values.clone().into(),
    };
    let named = |counts: [u64; 4]| -> Vec<(String, u64)> {
        ["all", "touched", "guessed", "untouched"]
            .iter()
            .map(|name| (*name).to_owned())
            .zip(counts)
            .collect()
    };
    assert_eq!(
        region_sizes(&[column("touched", &touched), column("support", &support)]),
        named([25, 10, 12, 3])
    );
    assert_eq!(
        region_sizes(&[column("touched", &touched)]),
        named([25, 12, 9, 4])
    );
    assert_eq!(region_sizes(&[]), [("all".to_owned(), 25)]);
}

#[test]
fn a_wrong_unit_is_suspected_with_the_flag_that_helps() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, truth] = plates(folder.path());
    let (flag, output) = (
        "--truth-unit",
        touchup(&["compare", &mesh, &truth, "--truth-unit", "inch"]),
    );
    let (code, _, err) = parts_of(&output);
    assert_eq!(code, 0);
    assert!(
        err.contains("25.4 times smaller")
            && err.contains(&format!("try --mesh-unit inch or {flag} mm")),
        "{err}"
    );
    // 20 000 mm: no work-piece, and the flag is the one of the truth
    let output = touchup(&["compare", &mesh, &truth, "--truth-unit", "m"]);
    let (code, out, err) = parts_of(&output);
    assert_eq!((code, out), (3, ""));
    assert!(err.contains("try --truth-unit mm"), "{err}");
}

#[test]
fn bad_use_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let [mesh, truth] = plates(folder.path());
    let before = fs::read(&mesh).unwrap();
    for arguments in [
        &["--coloured", &mesh][..],
        &["--picture", "a.jpg"],
        &["--coloured", "a.stl"],
        &["--range-mm", "0"],
        &["--range-mm", "nan"],
        &["--samples", "3"],
        &["--view", "0,0,0"],
        &["--view", "1,2"],
        &["--align", "magic"],
    ] {
        let output = touchup(&[&["compare", &mesh, &truth][..], arguments].concat());
        let (code, out, err) = parts_of(&output);
        assert_eq!((code, out), (2, ""), "{arguments:?}: {err}");
    }
    assert_eq!(
        fs::read(&mesh).unwrap(),
        before,
        "an input is never written over"
    );
    let nowhere = touchup(&[
        "compare",
        &mesh,
        &truth,
        "--picture",
        "/no/such/place/a.png",
    ]);
    assert_eq!(parts_of(&nowhere).0, 1);
    let missing = touchup(&["compare", &mesh, "/no/such/part.stl"]);
    assert_eq!(parts_of(&missing).0, 3);
}

/// Runs pieces on this number of threads, each with its share.
struct SoMany(usize);

impl Workers for SoMany {
    fn count(&self) -> usize {
        self.0
    }

    fn run(&self, jobs: Vec<Task<'_>>) {
        std::thread::scope(|threads| jobs.into_iter().for_each(|job| drop(threads.spawn(job))));
    }
}

#[test]
fn any_number_of_threads_finds_the_same_to_the_last_bit() {
    let mesh = wavy::wavy_plate(20_000).unwrap();
    let tree = FaceTree::new(&mesh);
    let shape = IndexedMesh {
        mesh: &mesh,
        tree: &tree,
    };
    let points: Vec<Point3<f64>> = sample_surface(&mesh, 3e5, 1)
        .iter()
        .enumerate()
        .map(|(i, s)| s.point + Vector3::z() * 1e-6 * i as f64)
        .collect();
    assert!(points.len() > 20_000);
    let bits = |workers: &dyn Workers| -> Vec<u64> {
        deviations(&points, &mesh, &tree, workers)
            .unwrap()
            .into_iter()
            .map(f64::to_bits)
            .collect()
    };
    let start = Isometry3::identity();
    let register = |workers: &dyn Workers| {
        icp(
            &points,
            &mesh,
            &tree,
            &start,
            &IcpParams::default(),
            workers,
        )
    };
    let whole = |workers: &dyn Workers| compare(shape, shape, Regions::Unknown, &few(), workers);
    let (one, motion, all) = (
        bits(&SerialWorkers),
        register(&SerialWorkers),
        whole(&SerialWorkers),
    );
    // one by one, in the order given
    let by_hand = |p| {
        tree.closest(&mesh, p, f64::INFINITY)
            .unwrap()
            .distance_squared
            .sqrt()
            .to_bits()
    };
    assert!(
        points
            .iter()
            .zip(&one)
            .all(|(p, found)| by_hand(p) == found & (u64::MAX >> 1))
    );
    for workers in [
        &SoMany(2) as &dyn Workers,
        &SoMany(3),
        &touchup::threads::Threads,
    ] {
        assert!(bits(workers) == one && register(workers) == motion && whole(workers) == all);
    }
}
