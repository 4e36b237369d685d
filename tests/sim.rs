//! Known surfaces, scanner and stylus, from outside.

use std::collections::HashMap;
use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use touchup::mesh::TriMesh;
use touchup::sim::{
    Lines, MeshSurface, Moment, PathParams, Peaks, Plate, Region, ScannerParams, SensorParams, SimError, Stroke,
    StylusParams, Surface, Touch, TruthShape, add_vertex_noise, measure_badness, plan_demo, plan_mesh, push_ball,
    raster, scan, touch,
};
use touchup::touch::{Message, StampedPose, StampedWrench};

/// Corner points of all faces.
fn triangles(mesh: &TriMesh) -> Vec<[Point3<f64>; 3]> {
    mesh.faces().map(|(face, _)| mesh.triangle(face)).collect()
}

/// Volume by the divergence theorem.
fn volume(mesh: &TriMesh) -> f64 {
    triangles(mesh).iter().map(|[a, b, c]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0).sum()
}

/// Distance from a point to a triangle, from the plane when the foot is inside and else from the three sides.
fn distance_to_triangle(p: &Point3<f64>, t: &[Point3<f64>; 3]) -> f64 {
    let normal = (t[1] - t[0]).cross(&(t[2] - t[0])).normalize();
    let sides = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    if sides.iter().all(|(a, b)| normal.dot(&(b - a).cross(&(p - a))) >= 0.0) {
        return normal.dot(&(p - t[0])).abs();
    }
    let to_side = |(a, b): &(Point3<f64>, Point3<f64>)| {
        let s = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (p - (a + (b - a) * s)).norm()
    };
    sides.iter().map(to_side).fold(f64::MAX, f64::min)
}

/// How often the mesh winds around a point: 1 inside, 0 outside [solid angles].
fn winding_number(p: &Point3<f64>, mesh: &[[Point3<f64>; 3]]) -> f64 {
    let solid_angle = |t: &[Point3<f64>; 3]| {
        let [a, b, c] = t.map(|x| x - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let down = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(down)
    };
    mesh.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}

fn around(surface: &dyn Surface, margin: f64) -> impl Strategy<Value = Point3<f64>> {
    let b = surface.bounds().grown(margin);
    (b.min.x..b.max.x, b.min.y..b.max.y, b.min.z..b.max.z).prop_map(|(x, y, z)| Point3::new(x, y, z))
}

#[test]
fn plate_mesh_is_closed_outward_and_has_one_tunnel() {
    let plate = Plate::default();
    let mesh = plate.mesh(10e-6).unwrap();
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for (_, c) in mesh.faces() {
        (0..3).for_each(|i| *edges.entry((c[i].0, c[(i + 1) % 3].0)).or_default() += 1);
    }
    assert!(edges.iter().all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1)));
    let euler = mesh.vertex_count() as i64 - edges.len() as i64 / 2 + mesh.face_count() as i64;
    // V − E + F = 2 − 2 · tunnels
    assert_eq!(euler, 0);
    assert!(mesh.positions().iter().all(|p| plate.signed_distance(p).abs() < 1e-15));
    assert!(mesh.faces().all(|(f, _)| mesh.double_area_normal(f).norm() > 1e-12), "no face without area");
}

#[test]
fn plate_volume_converges_to_the_closed_form() {
    let plate = Plate::default();
    // by hand, mm³: 60·50·12 + 20·50·9, + π 5² 4 − π 4² 12 − π 3² 8 − (π 3² + 14·6) 5
    let by_hand = (60. * 50. * 12. + 20. * 50. * 9. + PI * (100. - 192. - 72. - 45.) - 420.) * 1e-9;
    assert!((plate.volume() - by_hand).abs() < 1e-15);
    let error = |chord: f64| (volume(&plate.mesh(chord).unwrap()) - by_hand).abs();
    // curved walls of 2π (3·8 + 4·12 + 5·4 + 3·5) mm²; the area between chord and arc is less than chord error · arc
    let walls = 2.0 * PI * 107e-6;
    assert!(error(40e-6) < walls * 40e-6 && error(10e-6) < error(40e-6) / 3.0, "{} {}", error(40e-6), error(10e-6));
}

#[test]
fn plate_distances_worked_by_hand() {
    let plate = Plate::default();
    let mm = |x: f64, y: f64, z: f64| plate.signed_distance(&(Point3::new(x, y, z) * 1e-3)) * 1e3;
    let cases = [
        (mm(5., 5., 14.), 2.0),                    // above the top
        (mm(5., 5., 11.), -1.0),                   // below the top
        (mm(70., 20., 10.), 1.0),                  // above the lower step
        (mm(61., 20., 11.), 1.0),                  // beside the riser
        (mm(63., 20., 16.), 5.0),                  // off the step's edge: 3, 4, 5
        (mm(16., 36., 6.), 4.0),                   // on the axis of the through-hole
        (mm(16., 36., 15.), 5.0),                  // above it: the rim is 4 aside and 3 below
        (mm(32., 34., 4.5), 0.5),                  // above the floor of the blind hole
        (mm(32., 34., 3.0), -1.0),                 // below it
        (mm(25., 14., 9.5), 2.5),                  // in the slot, nearest the floor
        (mm(34., 14., 9.5), 1.0),                  // in its rounded end
        (mm(47., 25., 17.0), 1.0),                 // above the boss
        (mm(53., 25., 13.5), 1.0),                 // beside it
        (mm(47., 25., 12.0), -4.0),                // inside, where the boss stands
        (mm(56., 25., 19.0), 5.0),                 // off its rim: 4 aside, 3 above
        (mm(-3., -4., -12.), 13.0),                // off a corner
        (mm(59., 25., 8.), -(1f64 + 1f64).sqrt()), // below the inner corner of the step
    ];
    for (i, (found, expected)) in cases.iter().enumerate() {
        assert!((found - expected).abs() < 1e-9, "case {i}: {found} instead of {expected}");
    }
}

#[test]
fn plate_features_are_those_of_the_drawing() {
    let plate = Plate::default();
    for feature in plate.features() {
        match feature.shape {
            TruthShape::Hole { diameter, depth, through } => {
                let floor = feature.centre - feature.axis * depth;
                assert_eq!(plate.signed_distance(&floor) > 1e-4, through, "{}", feature.name);
                let side = feature.centre + Vector3::x() * (diameter / 2.0) - feature.axis * (depth / 2.0);
                assert!(plate.signed_distance(&side).abs() < 1e-15);
            }
            TruthShape::Slot { width, length, depth, direction } => {
                let middle = feature.centre - feature.axis * (depth / 2.0);
                let end = middle + direction * (length / 2.0);
                let side = middle + direction.cross(&feature.axis) * (width / 2.0);
                assert!([end, side].iter().all(|p| plate.signed_distance(p).abs() < 1e-15));
            }
            TruthShape::Boss { diameter, height } => {
                let rim = feature.centre + feature.axis * height + Vector3::y() * (diameter / 2.0);
                assert!(plate.signed_distance(&rim).abs() < 1e-15);
            }
            TruthShape::Step { height, length, direction } => {
                let end = feature.centre + direction * (length / 2.0) - feature.axis * height;
                assert!(plate.signed_distance(&end).abs() < 1e-15);
            }
        }
    }
}

/// Largest distance of the fine plate mesh below from the plate, m.
const CHORD: f64 = 1e-6;

fn check_against_mesh(plate: &Plate, mesh: &[[Point3<f64>; 3]], p: Point3<f64>) -> Result<(), TestCaseError> {
    let signed = plate.signed_distance(&p);
    let brute = mesh.iter().map(|t| distance_to_triangle(&p, t)).fold(f64::MAX, f64::min);
    prop_assert!((signed.abs() - brute).abs() <= CHORD, "{signed} against {brute}");
    if brute > 2.0 * CHORD {
        prop_assert_eq!(signed < 0.0, winding_number(&p, mesh) > 0.5);
    }
    let closest = plate.closest(&p);
    prop_assert!(plate.signed_distance(&closest.point).abs() < 1e-15);
    prop_assert!((closest.normal.norm() - 1.0).abs() < 1e-12);
    // out of the material on one side, into it on the other
    let off = closest.normal * 1e-7;
    prop_assert!(plate.signed_distance(&(closest.point + off)) >= -1e-12);
    // the distance grows as fast as one moves along `outward`
    let outward = plate.outward(&p);
    prop_assert!((outward.norm() - 1.0).abs() < 1e-12);
    let back = p - outward * (signed * 0.5);
    prop_assert!((plate.signed_distance(&back) - signed * 0.5).abs() < 1e-12);
    Ok(())
}

#[test]
fn plate_distance_is_that_of_its_fine_mesh() {
    let plate = Plate::default();
    let mesh = triangles(&plate.mesh(CHORD).unwrap());
    proptest!(ProptestConfig::with_cases(3000), |(p in around(&plate, 5e-3))| check_against_mesh(&plate, &mesh, p)?);
}

/// Closest distance to the graph of `peaks` over ever finer grids around the best node.
fn brute_peaks(peaks: &Peaks, p: &Point3<f64>) -> f64 {
    let far = |x: f64, y: f64| (Point3::new(x, y, peaks.height(x, y)) - p).norm();
    let best = |cx: f64, cy: f64, half: f64, n: i32| {
        let at = |c: f64, i: i32| c + half * f64::from(i) / f64::from(n);
        let nodes = (-n..=n).flat_map(|i| (-n..=n).map(move |j| (i, j)));
        nodes.map(|(i, j)| (at(cx, i), at(cy, j))).min_by(|a, b| far(a.0, a.1).total_cmp(&far(b.0, b.1))).unwrap()
    };
    let (mut x, mut y) = best(0.0, 0.0, 0.030, 150);
    let mut half = 0.4e-3;
    while half > 1e-9 {
        (x, y) = best(x, y, half, 4);
        half /= 2.0;
    }
    far(x, y)
}

#[test]
fn peaks_distance_is_the_smallest_on_a_dense_grid() {
    let peaks = Peaks::default();
    proptest!(ProptestConfig::with_cases(300), |(p in around(&peaks, 4e-3))| {
        let signed = peaks.signed_distance(&p);
        let brute = brute_peaks(&peaks, &p);
        // the grid may miss the best of several dips, never beat it
        prop_assert!(signed.abs() <= brute + 1e-12, "{} > {}", signed.abs(), brute);
        let closest = peaks.closest(&p);
        prop_assert!((peaks.height(closest.point.x, closest.point.y) - closest.point.z).abs() < 1e-15);
        prop_assert!(((p - closest.point).norm() - signed.abs()).abs() < 1e-15);
        if signed.abs() > 1e-5 {
            prop_assert!((p - closest.point).normalize().dot(&closest.normal) * signed.signum() > 1.0 - 1e-9);
        }
        prop_assert_eq!(signed > 0.0, p.z > peaks.height(p.x, p.y));
    });
}

#[test]
fn peaks_has_the_size_of_the_paper() {
    let peaks = Peaks::default();
    let mesh = peaks.mesh(0.25e-3).unwrap();
    let heights = mesh.positions().iter().map(|p| p.z);
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), z| (z.min(l), z.max(h)));
    assert!((high - low - 0.020).abs() < 1e-5, "{low} {high}");
    // MATLAB: peaks at the origin of the formula is 3/e − 1/(3e) = 0.981 of a range of 14.657
    let middle = (8.106_213_589 - 6.551_133_333) / 2.0;
    let origin = (3.0 / std::f64::consts::E - 1.0 / (3.0 * std::f64::consts::E) - middle) * 0.020 / 14.657_346_922;
    assert!((peaks.height(0.0, 0.0) - origin).abs() < 1e-11);
}

#[test]
fn noisy_peaks_keep_their_faces_and_have_the_stated_noise() {
    let truth = Peaks::default().mesh(1e-3).unwrap();
    assert_eq!((truth.vertex_count(), truth.face_count()), (51 * 51, 2 * 50 * 50));
    assert!(truth.faces().all(|(f, _)| truth.normal(f).z > 0.0));
    let mut noisy = truth.clone();
    add_vertex_noise(&mut noisy, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), 1);
    assert!(truth.faces().eq(noisy.faces()));
    let moved: Vec<_> = truth.positions().iter().zip(noisy.positions()).map(|(a, b)| b - a).collect();
    let n = moved.len() as f64;
    let mean = moved.iter().sum::<Vector3<f64>>() / n;
    // five standard errors
    let bound = 5.0 * 3e-3 / n.sqrt();
    assert!((mean - Vector3::new(0.0, 0.0, 2e-3)).amax() < bound);
    let variance = moved.iter().map(|v| (v - mean).component_mul(&(v - mean))).sum::<Vector3<f64>>() / n;
    assert!((variance.map(f64::sqrt) - Vector3::repeat(3e-3)).amax() < bound);
    let mut other = truth.clone();
    add_vertex_noise(&mut other, 3e-3, &Vector3::new(0.0, 0.0, 2e-3), 2);
    assert_ne!(noisy.positions(), other.positions());
}

fn demo_touch(params: &StylusParams, seed: u64) -> Touch {
    let plate = Plate::default();
    touch(&plate, &plan_demo(&plate, &PathParams::default()).unwrap(), params, seed).unwrap()
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

fn split(messages: &[Message]) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let (mut poses, mut wrenches) = (Vec::new(), Vec::new());
    for message in messages {
        match message {
            Message::Pose(pose) => poses.push(*pose),
            Message::Wrench(wrench) => wrenches.push(*wrench),
        }
    }
    (poses, wrenches)
}

#[test]
fn ball_never_enters_the_part_and_force_stays_in_the_friction_cone() {
    let plate = Plate::default();
    let params = StylusParams::default();
    let touched = demo_touch(&params, 3);
    let cone = (params.friction.powi(2) + 1.0).sqrt().recip();
    let mut seen = [0; 4];
    for m in &touched.moments {
        let centre = Point3::from(m.pose_ot.translation.vector);
        let gap = plate.signed_distance(&centre) - params.radius;
        assert!(gap > -1e-9, "{gap} at {}", m.t);
        seen[m.contacts.len().min(3)] += 1;
        assert_eq!(m.contacts.is_empty(), m.force_o.norm() == 0.0);
        for c in &m.contacts {
            assert!(plate.signed_distance(&c.point).abs() < 1e-12);
            let off = (centre - c.point).norm() - params.radius;
            assert!(off.abs() < 1e-9, "{off} {:?}", m.contacts);
        }
        if let [only] = m.contacts[..] {
            assert!(m.force_o.dot(&only.normal) >= m.force_o.norm() * cone - 1e-12);
        }
    }
    // one contact mostly, two in corners and at rims
    println!("contacts at once: {seen:?}");
    assert!(seen[1] > 20_000 && seen[2] > 500, "{seen:?}");
}

#[test]
fn demo_lasts_a_minute_and_looks_like_a_hand() {
    let touched = demo_touch(&StylusParams::default(), 1);
    let n = touched.moments.len() as f64;
    assert!((45.0..90.0).contains(&(n * 1e-3)), "{n} ms");
    let mut forces: Vec<_> = touched.moments.iter().map(|m| m.force_o.norm()).filter(|f| *f > 0.0).collect();
    let share = forces.len() as f64 / n;
    let [p5, p50, p99] = [0.05, 0.5, 0.99].map(|q| quantile(&mut forces, q));
    println!("{n} ms, contact {share:.3}, force {p5:.2} {p50:.2} {p99:.2}");
    assert!((0.6..0.95).contains(&share));
    assert!((2.0..3.0).contains(&p50) && p99 < 4.2);
    let tilt = |m: &Moment| (m.pose_ot.rotation * Vector3::z()).angle(&Vector3::z()).to_degrees();
    let mut tilts: Vec<_> = touched.moments.iter().map(tilt).collect();
    assert!((3.0..9.0).contains(&quantile(&mut tilts, 0.5)) && quantile(&mut tilts, 1.0) < 25.0);
    let path: Vec<_> = touched.moments.iter().map(|m| m.pose_ot.translation.vector).collect();
    let mut speeds: Vec<_> = path.windows(2).map(|w| (w[1] - w[0]).norm() * 1e3).collect();
    assert!(quantile(&mut speeds, 1.0) < 0.11, "{}", quantile(&mut speeds, 1.0));
}

#[test]
fn demo_feels_every_feature_and_leaves_the_far_end() {
    let plate = Plate::default();
    let touched = demo_touch(&StylusParams::default(), 1);
    let felt = |test: &dyn Fn(&Point3<f64>) -> bool| {
        touched.moments.iter().flat_map(|m| &m.contacts).filter(|c| test(&c.point)).count()
    };
    for f in plate.features() {
        let radius = match f.shape {
            TruthShape::Hole { diameter, .. } | TruthShape::Boss { diameter, .. } => diameter / 2.0,
            TruthShape::Slot { length, .. } => length / 2.0,
            TruthShape::Step { .. } => continue,
        };
        let inside = |p: &Point3<f64>| (p - f.centre).xy().norm() < radius + 1e-6 && (p.z - f.centre.z).abs() > 1e-3;
        println!("{}: {} contacts inside", f.name, felt(&inside));
        assert!(felt(&inside) > 500, "{}", f.name);
    }
    assert!(felt(&|p| p.x > 0.0605 && (p.z - 9e-3).abs() < 1e-6) > 500, "the step's tread");
    assert_eq!(felt(&|p| p.x > 0.07), 0, "the far end stays untouched");
}

#[test]
fn stream_has_the_stated_rates_noise_and_faults() {
    let params = StylusParams::default();
    let touched = demo_touch(&params, 5);
    let (mut poses, mut wrenches) = split(&touched.messages);
    let seconds = touched.moments.len() as f64 * 1e-3;
    let swapped = wrenches.windows(2).filter(|w| w[1].stamp_ns < w[0].stamp_ns).count() as f64 / wrenches.len() as f64;
    // an exponential delay of 0.4 ms overtakes the next of 1 ms later in e^(−2.5)/2 = 4 % of cases, late ones on top
    assert!((0.03..0.06).contains(&swapped), "{swapped}");
    poses.sort_by_key(|p| p.stamp_ns);
    wrenches.sort_by_key(|w| w.stamp_ns);
    for (count, rate) in [(poses.len(), 500.0), (wrenches.len(), 1000.0)] {
        let kept = count as f64 / (seconds * rate);
        assert!((0.97..0.998).contains(&kept), "{kept}");
    }
    let gaps: Vec<_> = wrenches.windows(2).map(|w| (w[1].stamp_ns - w[0].stamp_ns) as f64 * 1e-9).collect();
    let silent = gaps.iter().filter(|g| **g > 4.5e-3).count();
    assert!((1..20).contains(&silent), "{silent}");
    assert!(gaps.iter().all(|g| *g > 0.0 && *g < 0.2));
    // residuals against the truth at the same tick
    let moment = |stamp: i64, late: f64| {
        let tick = (((stamp - params.sensor.start_ns) as f64 * 1e-9 - late) / 1e-3).round().max(0.0) as usize;
        &touched.moments[tick.min(touched.moments.len() - 1)]
    };
    let shift = |p: &StampedPose| {
        let m = moment(p.stamp_ns, 0.0);
        p.pose_ot.translation.vector - (m.pose_ot.translation.vector - m.force_o / params.stiffness)
    };
    let rms = (poses.iter().map(|p| shift(p).norm_squared()).sum::<f64>() / (3.0 * poses.len() as f64)).sqrt();
    assert!((rms / 0.05e-3 - 1.0).abs() < 0.03, "{rms}");
    let turn = |p: &StampedPose| p.pose_ot.rotation.angle_to(&moment(p.stamp_ns, 0.0).pose_ot.rotation);
    let turned = (poses.iter().map(|p| turn(p).powi(2)).sum::<f64>() / (3.0 * poses.len() as f64)).sqrt();
    assert!((turned.to_degrees() / 0.1 - 1.0).abs() < 0.03, "{turned}");
    let excess = |w: &StampedWrench| {
        let m = moment(w.stamp_ns, params.sensor.wrench_clock);
        w.wrench.force - m.pose_ot.rotation.inverse() * m.force_o
    };
    let forces: Vec<_> = wrenches.iter().map(excess).collect();
    // between successive residuals the slow bias cancels: √2 times the noise is left
    let n = 3.0 * (forces.len() - 1) as f64;
    let noise = (forces.windows(2).map(|f| (f[1] - f[0]).norm_squared()).sum::<f64>() / (2.0 * n)).sqrt();
    assert!((noise / 0.05 - 1.0).abs() < 0.05, "{noise}");
    let bias = (forces.iter().map(|f| f.norm_squared()).sum::<f64>() / n - noise * noise).sqrt();
    assert!((0.02..0.09).contains(&bias), "{bias}");
}

#[test]
fn ideal_stream_is_the_truth_in_order() {
    let params = StylusParams { friction: 0.0, sensor: SensorParams::ideal(), ..StylusParams::default() };
    let touched = demo_touch(&params, 2);
    let (poses, wrenches) = split(&touched.messages);
    assert_eq!(wrenches.len(), touched.moments.len());
    for (i, (w, m)) in wrenches.iter().zip(&touched.moments).enumerate() {
        assert_eq!(w.stamp_ns, params.sensor.start_ns + i as i64 * 1_000_000);
        assert!((m.pose_ot.rotation * w.wrench.force - m.force_o).norm() < 1e-12);
    }
    for (i, p) in poses.iter().enumerate() {
        let m = &touched.moments[2 * i];
        // the ball's centre is where a tip that bends by F/k puts it
        let centre = p.pose_ot.translation.vector + m.force_o / 20e3;
        assert!((centre - m.pose_ot.translation.vector).norm() < 1e-15);
        assert_eq!(p.stamp_ns, params.sensor.start_ns + 2 * i as i64 * 1_000_000);
    }
}

#[test]
fn same_seed_same_stream() {
    let params = StylusParams::default();
    let (a, b, c) = (demo_touch(&params, 7), demo_touch(&params, 7), demo_touch(&params, 8));
    assert!(a == b && a != c);
}

#[test]
fn ball_comes_to_rest_where_geometry_says() {
    let plate = Plate::default();
    let mm = |x: f64, y: f64, z: f64| Point3::new(x, y, z) * 1e-3;
    let rest = |from, to| push_ball(&plate, &from, &to, 1.5e-3);
    // onto the top
    let (x, c) = rest(mm(5., 5., 13.55), mm(5.02, 5., 13.45));
    assert!((x - mm(5.02, 5., 13.5)).norm() < 1e-12 && c.len() == 1 && (c[0].held_back - 0.05e-3).abs() < 1e-12);
    // into the inner corner of the step: tread and riser
    let (x, c) = rest(mm(61.52, 20., 10.52), mm(61.45, 20., 10.48));
    assert!((x - mm(61.5, 20., 10.5)).norm() < 1e-12 && c.len() == 2);
    // over the edge of the step: on the circle about the edge, towards where it was pushed
    let (edge, to) = (mm(60., 20., 12.), mm(60.9, 20., 13.1));
    let (x, c) = rest(mm(61.0, 20., 13.2), to);
    let expected = edge + (to - edge).normalize() * 1.5e-3;
    assert!((x - expected).norm() < 1e-11 && c.len() == 1 && (c[0].point - edge).norm() < 1e-11);
    // against the wall of the through-hole
    let (axis, to) = (mm(16., 36., 6.), mm(18.6, 36.1, 6.));
    let (x, _) = rest(mm(18.4, 36., 6.), to);
    assert!((x - (axis + (to - axis).normalize() * 2.5e-3)).norm() < 1e-11);
    // nothing in the way
    let (x, c) = rest(mm(5., 5., 20.), mm(5., 5., 19.9));
    assert!(x == mm(5., 5., 19.9) && c.is_empty());
}

#[test]
fn senseless_stylus_settings_are_refused() {
    let plate = Plate::default();
    let path = |z: f64| vec![Stroke { points: vec![Point3::new(0.01, 0.01, z)], speed: 0.05, press: None }];
    let with = |radius: f64| StylusParams { radius, ..StylusParams::default() };
    let run = |path: &[Stroke], params: &StylusParams| touch(&plate, path, params, 0).unwrap_err();
    assert!(matches!(run(&path(0.02), &with(f64::NAN)), SimError::BadParameter { .. }));
    assert!(matches!(run(&path(0.02), &with(-1.0)), SimError::BadParameter { .. }));
    assert!(matches!(run(&path(0.011), &with(1.5e-3)), SimError::StartsInside { .. }));
    assert_eq!(run(&[], &with(1.5e-3)), SimError::EmptyPath);
    assert!(matches!(run(&path(f64::NAN), &with(1.5e-3)), SimError::BadParameter { .. }));
    let base = StylusParams::default();
    for params in [
        StylusParams { stiffness: 1e-300, ..base },
        StylusParams { stiffness: 3.9, ..base },
        StylusParams { friction: 1e300, ..base },
        StylusParams { force_range: [1.0, 1e4], ..base },
        StylusParams { stray: 1e9, ..base },
        StylusParams { sensor: SensorParams { pose_noise: 1e9, ..base.sensor }, ..base },
        StylusParams { sensor: SensorParams { lost: 1.1, ..base.sensor }, ..base },
    ] {
        let told = run(&path(0.02), &params).to_string();
        assert!(told.len() < 120, "{told}");
    }
    // 4 N bend this one by 1 m, which is allowed
    touch(&plate, &path(0.02), &StylusParams { stiffness: 4.0, ..base }, 0).unwrap();
}

#[test]
fn senseless_paths_are_refused() {
    let plate = Plate::default();
    let base = PathParams::default();
    let far = |x: f64| Region {
        frame_ov: nalgebra::Isometry3::identity(),
        low: nalgebra::Point2::origin(),
        high: nalgebra::Point2::new(x, 0.01),
        floor: 0.0,
        clear: 0.02,
    };
    for pitch in [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-300, 0.9e-7] {
        let params = PathParams { pitch, ..base };
        assert!(matches!(raster(&far(0.01), Lines::AlongX, &params), Err(SimError::BadParameter { .. })), "{pitch}");
        assert!(plan_demo(&plate, &params).is_err(), "{pitch}");
    }
    for x in [-0.01, f64::NAN, f64::INFINITY] {
        assert!(matches!(raster(&far(x), Lines::AlongX, &base), Err(SimError::BadParameter { .. })), "{x}");
    }
    let view = -Vector3::z_axis();
    for params in [PathParams { pitch: f64::NAN, ..base }, PathParams { longest: 0.0, ..base }] {
        assert!(matches!(plan_mesh(&plate, &plate.bounds(), &view, &params), Err(SimError::BadParameter { .. })));
    }
    // lines every 2 mm of 10 mm: six, of two ends each
    assert_eq!(raster(&far(0.02), Lines::AlongX, &base).unwrap()[1].points.len(), 12);
}

#[test]
fn points_and_edges_that_are_no_numbers_end_in_no_panic() {
    let mesh = Plate::default().mesh(0.2e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let p = Point3::new(0.01, x, 0.01);
        assert!(surface.signed_distance(&p).is_nan() && surface.closest(&p).point.x.is_nan());
        assert!(surface.outward(&p).x.is_nan());
        let mut near = Vec::new();
        surface.near(&p, 1e-3, &mut near);
        assert!(near.is_empty());
    }
    for edge in [f64::NAN, f64::INFINITY, 0.0, -1e-3, 1e-300, 0.8e-6, 24.9e-6] {
        assert!(matches!(Peaks::default().mesh(edge), Err(SimError::BadParameter { .. })), "{edge}");
    }
}

#[test]
fn mesh_distance_is_the_smallest_over_its_faces_with_the_sign_of_the_winding_number() {
    let mesh = Plate::default().mesh(0.2e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    let faces = triangles(&mesh);
    proptest!(ProptestConfig::with_cases(2000), |(p in around(&surface, 5e-3))| {
        let signed = surface.signed_distance(&p);
        let brute = faces.iter().map(|t| distance_to_triangle(&p, t)).fold(f64::MAX, f64::min);
        prop_assert!((signed.abs() - brute).abs() < 1e-12, "{} against {}", signed, brute);
        prop_assert_eq!(signed < 0.0, winding_number(&p, &faces) > 0.5);
        let mut near = Vec::new();
        surface.near(&p, brute + 1e-3, &mut near);
        let nearest = near.iter().map(|s| (s.point - p).norm()).fold(f64::MAX, f64::min);
        prop_assert!((nearest - brute).abs() < 1e-12);
    });
}

#[test]
fn ball_slides_over_any_mesh_from_any_side() {
    let mesh = Plate::default().mesh(0.05e-3).unwrap();
    let surface = MeshSurface::new(&mesh).unwrap();
    for view in [-Vector3::z_axis(), Vector3::z_axis(), Vector3::x_axis()] {
        let params = PathParams { longest: 8.0, ..PathParams::default() };
        let path = plan_mesh(&surface, &surface.bounds(), &view, &params).unwrap();
        let touched = touch(&surface, &path, &StylusParams::default(), 4).unwrap();
        let contacts: usize = touched.moments.iter().filter(|m| !m.contacts.is_empty()).count();
        let share = contacts as f64 / touched.moments.len() as f64;
        println!("{} ms, {share:.2} in contact", touched.moments.len());
        assert!(share > 0.5);
        for m in &touched.moments {
            let centre = Point3::from(m.pose_ot.translation.vector);
            assert!(surface.signed_distance(&centre) > 1.5e-3 - 1e-9);
            assert!(m.contacts.iter().all(|c| surface.signed_distance(&c.point).abs() < 1e-9));
        }
        // the hand comes from where it looks from, and so does the force
        let towards = touched.moments.iter().map(|m| m.force_o).sum::<Vector3<f64>>().normalize();
        assert!(towards.dot(&view) < -0.8, "{towards}");
    }
}

/// Directed edges with how many faces use them.
fn directed_edges(mesh: &TriMesh) -> HashMap<(u32, u32), u32> {
    let mut edges = HashMap::new();
    for (_, c) in mesh.faces() {
        (0..3).for_each(|i| *edges.entry((c[i].0, c[(i + 1) % 3].0)).or_default() += 1);
    }
    edges
}

#[test]
fn scan_is_as_bad_as_those_of_an_independent_simulator() {
    let plate = Plate::default();
    let runs: Vec<_> = (1..=4)
        .map(|seed| {
            let mesh = scan(&plate, &ScannerParams { seed, ..ScannerParams::default() }).unwrap();
            measure_badness(&mesh, &plate, |_| true).unwrap()
        })
        .collect();
    let mean = |f: &dyn Fn(usize) -> f64| (0..runs.len()).map(f).sum::<f64>() / runs.len() as f64;
    // the cases' scans: edges 2.43 to 2.45 mm, mean distance 0.53 to 0.66, rms 0.65 to 0.92, p95 1.2 to 1.9, bias 0.33 to 0.45
    for (found, low, high) in [
        (mean(&|i| runs[i].edge_median), 2.2e-3, 2.6e-3),
        (mean(&|i| runs[i].mean), 0.5e-3, 0.62e-3),
        (mean(&|i| runs[i].rms), 0.6e-3, 0.85e-3),
        (mean(&|i| runs[i].p95), 1.1e-3, 1.7e-3),
        (mean(&|i| runs[i].bias), 0.25e-3, 0.4e-3),
        (mean(&|i| runs[i].faces as f64), 2000.0, 3200.0),
    ] {
        println!("{found}");
        assert!((low..high).contains(&found), "{found} is not between {low} and {high}");
    }
}

#[test]
fn scan_closes_the_small_holes_and_is_open_at_the_back() {
    let plate = Plate::default();
    let mesh = scan(&plate, &ScannerParams::default()).unwrap();
    for feature in
        plate.features().iter().filter(|f| matches!(f.shape, TruthShape::Hole { .. } | TruthShape::Slot { .. }))
    {
        // the axis meets a face near the opening: one whose three corners, seen along the axis, surround it
        let covers = |t: &[Point3<f64>; 3]| {
            let side = |a: &Point3<f64>, b: &Point3<f64>| (b - a).xy().perp(&(feature.centre - a).xy()) > 0.0;
            side(&t[0], &t[1]) && side(&t[1], &t[2]) && side(&t[2], &t[0])
        };
        let lid = triangles(&mesh).into_iter().find(covers).map(|t| (t[0].z + t[1].z + t[2].z) / 3.0);
        assert!(lid.is_some_and(|z| (z - feature.centre.z).abs() < 2e-3), "{}: {lid:?}", feature.name);
    }
    let edges = directed_edges(&mesh);
    let rim = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).count();
    assert!(rim > 60, "open at the back");
    assert!(!triangles(&mesh).iter().any(|t| (t[0].z + t[1].z + t[2].z) / 3.0 < -2e-3 || {
        let middle = (t[0].coords + t[1].coords + t[2].coords) / 3.0;
        middle.z < 0.5e-3 && (0.01..0.07).contains(&middle.x) && (0.01..0.04).contains(&middle.y)
    }));
    let closed = scan(&plate, &ScannerParams { open_back: false, ..ScannerParams::default() }).unwrap();
    let edges = directed_edges(&closed);
    let rim = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).count();
    assert_eq!(rim, 0, "closed");
}

#[test]
fn scan_has_no_folds_crossings_slivers_or_crowded_edges() {
    let plate = Plate::default();
    for seed in 1..=5 {
        let mesh = scan(&plate, &ScannerParams { seed, ..ScannerParams::default() }).unwrap();
        assert!(directed_edges(&mesh).values().all(|n| *n == 1));
        let (mut against, mut near) = (0, Vec::new());
        for (face, _) in mesh.faces() {
            let t @ [a, b, c] = mesh.triangle(face);
            let angles = [(a, b, c), (b, c, a), (c, a, b)].map(|(p, q, r)| (q - p).angle(&(r - p)).to_degrees());
            assert!(angles.iter().all(|angle| *angle > 8.0), "{angles:?}");
            let middle = Point3::from((t[0].coords + t[1].coords + t[2].coords) / 3.0);
            // beside an edge either side will do
            near.clear();
            plate.near(&middle, plate.signed_distance(&middle).abs() + 1e-3, &mut near);
            against += u32::from(near.iter().all(|s| mesh.normal(face).dot(&s.normal) < 0.0));
        }
        assert_eq!(against, 0, "faces that look against the surface");
        // every edge against every face that it shares no vertex with
        let faces: Vec<_> = mesh.faces().collect();
        for &(f, corners) in &faces {
            let t = mesh.triangle(f);
            let (low, high) = (t[0].inf(&t[1]).inf(&t[2]), t[0].sup(&t[1]).sup(&t[2]));
            for &(_, other) in faces.iter().filter(|(_, o)| o.iter().all(|v| !corners.contains(v))) {
                for i in 0..3 {
                    let (p, q) = (mesh.position(other[i]), mesh.position(other[(i + 1) % 3]));
                    let apart = (0..3).any(|k| p[k].max(q[k]) < low[k] || p[k].min(q[k]) > high[k]);
                    assert!(apart || !pierces(&p, &q, &t), "seed {seed}: face {f:?} is crossed");
                }
            }
        }
    }
}

/// Whether a segment pierces a triangle, by the signs of the volumes it spans with the sides.
fn pierces(p: &Point3<f64>, q: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> bool {
    let volume =
        |x: &Point3<f64>, y: &Point3<f64>, z: &Point3<f64>, w: &Point3<f64>| (y - x).cross(&(z - x)).dot(&(w - x));
    let through = [(a, b), (b, c), (c, a)].map(|(x, y)| volume(p, q, x, y) > 0.0);
    volume(a, b, c, p) * volume(a, b, c, q) < 0.0 && through[0] == through[1] && through[1] == through[2]
}

#[test]
fn scan_of_a_mesh_is_that_of_its_surface_and_the_seed_decides() {
    let plate = Plate::default();
    let mesh = plate.mesh(10e-6).unwrap();
    let params = ScannerParams { edge: 4e-3, ..ScannerParams::default() };
    let (a, b) = (scan(&plate, &params).unwrap(), scan(&MeshSurface::new(&mesh).unwrap(), &params).unwrap());
    let [qa, qb] = [&a, &b].map(|m| measure_badness(m, &plate, |_| true).unwrap());
    assert!((qa.mean - qb.mean).abs() < 20e-6 && (qa.bias - qb.bias).abs() < 20e-6, "{qa:?} {qb:?}");
    let again = scan(&plate, &params).unwrap();
    assert!(a.positions() == again.positions() && a.faces().eq(again.faces()));
    assert!(scan(&plate, &ScannerParams { seed: 2, ..params }).unwrap().positions() != a.positions());
}

#[test]
fn perfect_scanner_sees_the_surface() {
    let peaks = Peaks::default();
    let params = ScannerParams {
        edge: 1e-3,
        noise: 0.0,
        bias: 0.0,
        rounding: 0.0,
        closes_holes_below: 0.0,
        misplaced: 0.0,
        misplaced_angle: 0.0,
        ..ScannerParams::default()
    };
    let quality = measure_badness(&scan(&peaks, &params).unwrap(), &peaks, |_| true).unwrap();
    // chords of 1 mm on a radius of at least 1.57 mm are off by less than 1²/(8 · 1.57) mm
    assert!(quality.p95 < 0.08e-3 && quality.mean < 0.02e-3, "{quality:?}");
}

#[test]
fn senseless_scanner_settings_are_refused() {
    let plate = Plate::default();
    let run = |params: ScannerParams| scan(&plate, &params).unwrap_err();
    let base = ScannerParams::default();
    assert!(matches!(run(ScannerParams { edge: 0.0, ..base }), SimError::BadParameter { .. }));
    assert!(matches!(run(ScannerParams { noise: f64::NAN, ..base }), SimError::BadParameter { .. }));
    assert!(matches!(run(ScannerParams { edge: 1e-6, ..base }), SimError::TooFine { .. }));
    let told = |params: ScannerParams| run(params).to_string();
    let (fine, noisy) = (told(ScannerParams { edge: 1e-6, ..base }), told(ScannerParams { noise: 1e300, ..base }));
    assert!(fine.contains("use longer edges") && !fine.contains("less of"), "{fine}");
    assert!(noisy.contains("use less of these three") && noisy.len() < 250, "{noisy}");
    let coarse = run(ScannerParams { edge: 0.03, ..base });
    assert!(matches!(coarse, SimError::TooCoarse { .. }) && coarse.to_string().contains("shorter"), "{coarse}");
}
