//! Unscanned regions: they follow the touches, and nothing appears beyond.

use nalgebra::{Point3, Vector3};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{Patcher, PatcherParams};
use touchup::stylus::Sample;

use crate::plate_stream::contacts_of;
use crate::reconstruct::accuracy::{sample, sheet};

const RADIUS_MM: f64 = 1.5;

/// A ball slides over the square from 15 to 25 mm of the plane z = `height_mm`, in lines 1 mm
/// apart, from above (1) or from below (-1).
fn raster(height_mm: f64, side: f64) -> Vec<Sample> {
    let at = |i: usize| {
        let (line, along) = ((i / 400) as f64, (i % 400) as f64 / 40.0);
        let x = if (i / 400).is_multiple_of(2) {
            15.0 + along
        } else {
            25.0 - along
        };
        sample(
            i,
            [x, 15.0 + line, height_mm + side * RADIUS_MM],
            2.0 * side,
        )
    };
    (0..4400).map(at).collect()
}

fn refined(scan: &TriMesh, samples: &[Sample]) -> TriMesh {
    let mut patcher = Patcher::new(PatcherParams::new(RADIUS_MM * 1e-3, None, 0.1e-3)).unwrap();
    contacts_of(RADIUS_MM * 1e-3, None, samples)
        .iter()
        .for_each(|contact| patcher.push(contact));
    patcher.flush();
    patcher.patched(scan, &FaceTree::new(scan)).unwrap().mesh
}

/// Largest distance of the raster's plane from the mesh, 1 mm inside its ends, mm.
fn off_plane(mesh: &TriMesh, height_mm: f64) -> f64 {
    let tree = FaceTree::new(mesh);
    let places =
        (0..=16).flat_map(|i| (0..=16).map(move |j| [i, j].map(|i| 16.0 + f64::from(i) * 0.5)));
    let distance = |[x, y]: [f64; 2]| {
        let p = Point3::new(x, y, height_mm) * 1e-3;
        tree.closest(mesh, &p, f64::INFINITY)
            .unwrap()
            .distance_squared
            .sqrt()
            * 1e3
    };
    places.map(distance).fold(0.0, f64::max)
}

/// The scan of the upper face of a part of 10 mm, with touches on its lower face.
#[test]
fn nothing_is_beyond_a_back_that_was_touched() {
    const BACK_MM: f64 = -10.0;
    let mesh = refined(&sheet(), &raster(BACK_MM, -1.0));
    let off = off_plane(&mesh, BACK_MM);
    let is_below_it =
        |p: &Point3<f64>| [p.x, p.y].iter().all(|x| (16e-3..24e-3).contains(x)) && p.z < -5e-3;
    let corners = mesh
        .faces()
        .flat_map(|(face, _)| mesh.triangle(face))
        .filter(is_below_it);
    let lowest = corners.map(|p| p.z * 1e3).fold(0.0, f64::min);
    println!("off by {off:.3} mm, down to {lowest:.3} mm");
    assert!(off < 0.05 && lowest > BACK_MM - 0.05, "{off} {lowest} mm");
}

/// A sheet with an opening of 14 mm × 14 mm, its walls scanned down to 1 mm.
fn opened() -> TriMesh {
    let (sheet, is_in) = (sheet(), |x: f64| (13e-3..27e-3).contains(&x));
    let is_left = |corners: &[Point3<f64>; 3]| {
        let middle = (corners[0].coords + corners[1].coords + corners[2].coords) / 3.0;
        !(is_in(middle.x) && is_in(middle.y))
    };
    let faces = sheet
        .faces()
        .filter(|(face, _)| is_left(&sheet.triangle(*face)));
    let mut faces: Vec<[u32; 3]> = faces
        .map(|(_, corners)| corners.map(|corner| corner.0))
        .collect();
    let mut positions = sheet.positions().to_vec();
    // around the opening, counter-clockwise seen from above
    let number = |[column, row]: [u32; 2]| row * 21 + column;
    let side = |from: [u32; 2], step: [i32; 2]| {
        (0..6).map(move |i| [0, 1].map(|axis| from[axis].wrapping_add_signed(step[axis] * i)))
    };
    let rim: Vec<u32> = [
        ([7, 7], [1, 0]),
        ([13, 7], [0, 1]),
        ([13, 13], [-1, 0]),
        ([7, 13], [0, -1]),
    ]
    .into_iter()
    .flat_map(|(from, step)| side(from, step).map(number))
    .collect();
    let first = positions.len() as u32;
    positions.extend(
        rim.iter()
            .map(|&at| sheet.positions()[at as usize] - Vector3::z() * 1e-3),
    );
    for i in 0..rim.len() as u32 {
        let next = (i + 1) % rim.len() as u32;
        let [a, b, c, d] = [rim[i as usize], rim[next as usize], first + next, first + i];
        faces.extend([[a, b, c], [a, c, d]]);
    }
    TriMesh::new(positions, faces).unwrap()
}

#[test]
fn a_floor_below_a_scan_that_ends_more_than_four_radii_away_is_kept() {
    let scan = opened();
    for depth_mm in [6.5, 6.9] {
        let off = off_plane(&refined(&scan, &raster(-depth_mm, 1.0)), -depth_mm);
        println!("{depth_mm} mm deep: off by {off:.3} mm");
        assert!(off < 0.05, "{depth_mm} mm deep: {off} mm");
    }
}
