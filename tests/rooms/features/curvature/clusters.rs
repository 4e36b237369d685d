//! Clusters against parts with creases that one can count by hand.

use touchup::features::k_means;
use touchup::features::{Bend, ClusterParams, PaperParams, clusters, paper_clusters};

use super::*;

/// A ring 4 mm thick between two outlines of `count` corners, given as radius over angle.
fn ring(count: u32, outer: impl Fn(f64) -> f64, inner: impl Fn(f64) -> f64) -> TriMesh {
    let mut positions = Vec::new();
    for i in 0..count {
        let angle = TAU * f64::from(i) / f64::from(count);
        let at = |r: f64, z: f64| Point3::new(r * angle.cos(), r * angle.sin(), z);
        let (o, i) = (outer(angle), inner(angle));
        positions.extend([at(o, 0.0), at(o, 4.0 * MM), at(i, 4.0 * MM), at(i, 0.0)]);
    }
    // around the section: outer wall, top, inner wall, bottom
    let quad = |i: u32, j: u32| {
        [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| i % count * 4 + j % 4)
    };
    let quads = (0..count).flat_map(|i| (0..4).map(move |j| (i, j)));
    let faces = quads
        .map(|(i, j)| quad(i, j))
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    TriMesh::new(positions, faces.collect()).unwrap()
}

/// Radius of a square of half side `a` about the origin.
fn square(a: f64) -> impl Fn(f64) -> f64 {
    move |angle| a / angle.cos().abs().max(angle.sin().abs())
}

fn found(mesh: &TriMesh) -> Vec<(Bend, Point3<f64>)> {
    let clusters = clusters(mesh, &curvature(mesh), &ClusterParams::default());
    clusters
        .iter()
        .map(|cluster| (cluster.bend.unwrap(), cluster.center))
        .collect()
}

fn count(mesh: &TriMesh) -> [usize; 2] {
    let found = found(mesh);
    [Bend::Convex, Bend::Concave].map(|bend| found.iter().filter(|(b, _)| *b == bend).count())
}

#[test]
fn creases_are_counted_whatever_the_density_and_the_unit() {
    let (round, wide) = (|_: f64| 10.0 * MM, |_: f64| 20.0 * MM);
    let cases = [
        // four rims
        ("round in round", ring(24, wide, round), [4, 0]),
        // the outline of a box hangs together, two rims
        (
            "round in square",
            ring(24, square(20.0 * MM), round),
            [3, 0],
        ),
        // two outer and two inner rims; four upright edges inside
        ("square in round", ring(24, wide, square(10.0 * MM)), [4, 4]),
    ];
    for (name, mesh, wanted) in cases {
        let finer = subdivided(&mesh, |p| p);
        let positions = mesh
            .positions()
            .iter()
            .map(|p| Point3::from(p.coords * 1e3))
            .collect();
        let in_mm = TriMesh::new(positions, faces_of(&mesh)).unwrap();
        for (how, other) in [
            ("", &mesh),
            ("finer", &finer),
            ("finest", &subdivided(&finer, |p| p)),
            ("in mm", &in_mm),
        ] {
            assert_eq!(count(other), wanted, "{name} {how}");
        }
        for ((bend, center), (same, fine)) in found(&mesh).iter().zip(found(&finer)) {
            assert!(*bend == same && (center - fine).norm() < 1e-12, "{name}");
        }
    }
}

#[test]
fn a_rim_with_a_gap_is_one_cluster() {
    // a cut 20 µm wide through half of the ring: the diagonal of its box is 57 mm, near is 57 µm
    let mesh = ring(24, |_| 20.0 * MM, |_| 10.0 * MM);
    let faces: Vec<_> = faces_of(&mesh);
    let moved: Vec<_> = mesh
        .positions()
        .iter()
        .map(|p| p + Vector3::new(0.0, 0.0, 4.02 * MM))
        .collect();
    let both: Vec<_> = mesh.positions().iter().chain(&moved).copied().collect();
    let shift = mesh.vertex_slots() as u32;
    let twice = faces
        .iter()
        .copied()
        .chain(faces.iter().map(|f| f.map(|v| v + shift)))
        .collect();
    let stacked = TriMesh::new(both, twice).unwrap();
    // eight rims, two pairs of them 20 µm apart
    assert_eq!(count(&stacked), [6, 0]);
}

#[test]
fn smooth_and_flat_meshes_have_none_and_a_tip_is_one() {
    assert_eq!(found(&icosphere(0.02, 3)), []);
    assert_eq!(found(&grid(10, 1e-3, |_, _| 0.0)), []);
    // a pit with walls of 31°: too blunt for a crease, 4 faces turn by less than 35° each
    let pit = grid(10, 1e-3, |x, y| -0.6 * (1e-3 - x.abs() - y.abs()).max(0.0));
    let c = curvature(&pit);
    let middle = &c[60];
    assert!(
        middle.integrated_mean < 0.0 && middle.defect > 0.6,
        "{middle:?}"
    );
    let params = ClusterParams {
        sharp_angle: 80f64.to_radians(),
        ..ClusterParams::default()
    };
    let found = clusters(&pit, &c, &params);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (found[0].bend, found[0].vertices.len()),
        (Some(Bend::Concave), 1)
    );
    assert!((found[0].center - Point3::new(0.0, 0.0, -0.6e-3)).norm() < 1e-15);
}

#[test]
fn k_means_finds_what_is_apart() {
    let middles = [
        [0.0, 0.0, 0.0],
        [10.0, 0.0, 0.0],
        [0.0, 10.0, 0.0],
        [0.0, 0.0, 10.0],
        [7.0, 7.0, 7.0],
    ];
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut sums = [Vector3::zeros(); 5];
        let points: Vec<_> = (0..500)
            .map(|i| {
                let p = Point3::from(middles[i % 5])
                    + Vector3::from_fn(|_, _| within(&mut rng, -1.0, 1.0));
                sums[i % 5] += p.coords / 100.0;
                p
            })
            .collect();
        let found = k_means(&points, 5, seed);
        assert_eq!(found, k_means(&points, 5, seed));
        for (i, label) in found.labels.iter().enumerate() {
            assert_eq!(*label, found.labels[i % 5], "seed {seed}");
            assert!((found.centers[*label as usize].coords - sums[i % 5]).norm() < 1e-12);
        }
    }
    let same = vec![Point3::new(1.0, 2.0, 3.0); 9];
    assert_eq!(
        k_means(&same, 4, 0).centers,
        [same[0]],
        "no more groups than places"
    );
    assert_eq!(
        (
            k_means(&[], 3, 0).centers.len(),
            k_means(&same, 0, 0).labels.len()
        ),
        (0, 0)
    );
}

#[test]
fn the_mode_of_the_paper_marks_by_curvature() {
    // five sharp bumps on a plate
    let at = [
        [-20.0, -20.0],
        [20.0, -20.0],
        [-20.0, 20.0],
        [20.0, 20.0],
        [0.0, 0.0],
    ];
    let bump = |x: f64, y: f64| {
        let height =
            |[a, b]: &[f64; 2]| 3.0 * (-((x / MM - a).powi(2) + (y / MM - b).powi(2)) / 2.0).exp();
        at.iter().map(height).sum::<f64>() * MM
    };
    let mesh = grid(120, 0.5 * MM, bump);
    let found = paper_clusters(&mesh, &curvature(&mesh), &PaperParams::default());
    assert_eq!(found.len(), 5);
    for [x, y] in at {
        let near = |c: &&touchup::features::Cluster| {
            (c.center.x / MM - x).hypot(c.center.y / MM - y) < 0.2
        };
        assert_eq!(found.iter().filter(near).count(), 1, "{x} {y}");
    }
    // marks the region in which K of the height field, (z_xx z_yy − z_xy²)/(1 + z_x² + z_y²)², is
    // above the threshold
    let marked: usize = found.iter().map(|c| c.vertices.len()).sum();
    let of_one =
        (-20..=20).flat_map(|i| (-20..=20).map(move |j| [i, j].map(|n| f64::from(n) * 0.5)));
    let gaussian = |[x, y]: [f64; 2]| {
        let z = 3.0 * (-(x * x + y * y) / 2.0).exp();
        z * z * ((x * x - 1.0) * (y * y - 1.0) - (x * y).powi(2))
            / (1.0 + z * z * (x * x + y * y)).powi(2)
    };
    let wanted = 5 * of_one.filter(|p| gaussian(*p).abs() > 0.3).count();
    assert!(marked.abs_diff(wanted) <= wanted / 5, "{marked} {wanted}");
    let flat = grid(10, 0.5 * MM, |_, _| 0.0);
    assert_eq!(
        paper_clusters(&flat, &curvature(&flat), &PaperParams::default()),
        []
    );
}
