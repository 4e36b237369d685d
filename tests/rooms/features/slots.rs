//! Slots: their lengths by what was touched, and slots that belong together.

use nalgebra::{Point3, Vector3};
use touchup::features::{Feature, FeatureKind, FittedTo, detect};
use touchup::mesh::{TriMesh, repair};
use touchup::sim::{Plate, TruthShape};
use touchup::stylus::ProbedPoint;

const RADIUS: f64 = 1.5e-3;

fn touch(point: Point3<f64>, normal: Vector3<f64>, number: usize) -> ProbedPoint {
    ProbedPoint {
        point,
        normal,
        centre: point + normal * RADIUS,
        radius: RADIUS,
        sigma: 0.02e-3,
        weight: 1.0,
        calibration: 2e-6,
        place: 0.0,
        stroke: number as u32,
        stamp_ns: number as i64 * 1_000_000_000,
        is_rejected: false,
    }
}

fn slots(mesh: &TriMesh, touches: &[ProbedPoint]) -> Vec<Feature> {
    let found = detect(mesh, touches).features.into_iter();
    found.filter(|f| f.kind == FeatureKind::Slot).collect()
}

/// The slot of the drawn plate, with touches on the middle third of its walls: its ends may be
/// anywhere beyond. With touches all around each end its length is that of the drawing.
#[test]
fn a_touched_slot_has_a_length_between_touched_ends() {
    let plate = Plate::default();
    let mesh = plate.mesh(5e-6).unwrap();
    let all = plate.features().into_iter();
    let (centre, truth) = all
        .map(|truth| (truth.centre, truth.shape))
        .find(|(_, shape)| matches!(shape, TruthShape::Slot { .. }))
        .unwrap();
    let TruthShape::Slot {
        width,
        length,
        depth,
        direction,
    } = truth
    else {
        panic!("a slot")
    };
    let across = Vector3::z().cross(&direction);
    let straight = length - width;
    let mut places = Vec::new();
    for i in 0..60 {
        let share = f64::from(i % 20) / 19.0 - 0.5;
        let down = Vector3::z() * (depth * (0.3 + 0.1 * f64::from(i % 4)));
        for side in [across, -across] {
            let beside = centre + direction * (share * straight);
            places.push((beside + side * (width / 2.0 + 2e-3), Vector3::z()));
            let wall = centre + direction * (share * straight / 3.0) + side * (width / 2.0);
            places.push((wall - down, -side));
        }
    }
    let of_walls = places.len();
    for i in 0..60 {
        let (sine, cosine) = (f64::from(i % 30) / 29.0 * std::f64::consts::PI).sin_cos();
        let end = direction * if i < 30 { 1.0 } else { -1.0 };
        let out = end * sine + across * cosine;
        let down = Vector3::z() * (depth * (0.3 + 0.1 * f64::from(i % 4)));
        places.push((
            centre + end * (straight / 2.0) + out * (width / 2.0) - down,
            -out,
        ));
    }
    let numbered = places.iter().enumerate();
    let touches: Vec<ProbedPoint> = numbered.map(|(at, &(p, n))| touch(p, n, at)).collect();
    let one = |touches: &[ProbedPoint]| {
        let found = slots(&mesh, touches);
        let [slot] = &found[..] else {
            panic!("{} slots", found.len())
        };
        assert_eq!(slot.fitted_to, FittedTo::Touches);
        assert!((slot.width.as_ref().unwrap().value - width).abs() < 1e-6);
        slot.length.clone()
    };
    assert_eq!(one(&touches[..of_walls]), None);
    let known = one(&touches).expect("both ends were touched");
    assert!(
        (known.value - length).abs() < 5e-6 && known.std.is_some(),
        "{known:?}"
    );
    let drawn = slots(&mesh, &[]);
    let drawn = drawn[0].length.as_ref().expect("of the drawing");
    assert!((drawn.value - length).abs() < 1e-6);
}

/// A bar of 60 mm with a T-slot: a neck of 8 mm, 5 mm deep, and a room of 16 × 6 mm below it. Each side
/// of the room is a slot of 6 mm that opens in a wall of the neck. Beside it a slot by itself.
#[test]
fn a_t_slot_and_its_undercuts_are_one_group() {
    let outline = [
        [-25.0, 0.0],
        [40.0, 0.0],
        [40.0, 20.0],
        [30.0, 20.0],
        [30.0, 10.0],
        [20.0, 10.0],
        [20.0, 20.0],
        [4.0, 20.0],
        [4.0, 15.0],
        [8.0, 15.0],
        [8.0, 9.0],
        [-8.0, 9.0],
        [-8.0, 15.0],
        [-4.0, 15.0],
        [-4.0, 20.0],
        [-25.0, 20.0],
    ];
    let found = slots(&bar(&outline, 60.0), &[]);
    let of_width = |mm: f64| -> Vec<&Feature> {
        let is_wide = |f: &&Feature| (f.width.as_ref().unwrap().value * 1e3 - mm).abs() < 1e-6;
        found.iter().filter(is_wide).collect()
    };
    let (necks, undercuts, alone) = (of_width(8.0), of_width(6.0), of_width(10.0));
    assert_eq!((necks.len(), undercuts.len(), alone.len()), (1, 2, 1));
    assert!(necks[0].group.is_some() && alone[0].group.is_none());
    assert!(undercuts.iter().all(|one| one.group == necks[0].group));
}

/// The bar along x with this outline in y and z, counter-clockwise seen against x, mm; its length, mm.
fn bar(outline: &[[f64; 2]], length: f64) -> TriMesh {
    let count = outline.len() as u32;
    let ends = [0.0, length].into_iter();
    let corners = ends.flat_map(|x| {
        outline
            .iter()
            .map(move |&[y, z]| Point3::new(x, y, z) * 1e-3)
    });
    let corners: Vec<Point3<f64>> = corners.collect();
    let caps = touchup::mesh::triangulate(&corners[count as usize..]).unwrap();
    let mut faces = Vec::new();
    for i in 0..count {
        let next = (i + 1) % count;
        faces.push([i, next + count, i + count]);
        faces.push([i, next, next + count]);
    }
    for [a, b, c] in caps {
        faces.push([a + count, b + count, c + count]);
        faces.push([a, c, b]);
    }
    repair(corners, faces).unwrap().0
}
