//! Features of the simulated plate, measured by touches, against the drawing: errors, and whether
//! they agree with the stated uncertainties.
//!
//! `TOUCHUP_FULL=1` runs all seeds; `--nocapture` or `--show-output` shows the numbers.

use nalgebra::{Point3, Vector3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use touchup::features::{Feature, FeatureKind, FittedTo, MeasuredValue, detect};
use touchup::mesh::{FaceTree, TriMesh};
use touchup::reconstruct::{CalibrationParams, Patcher, PatcherParams};
use touchup::sim::{Plate, StylusParams, TruthFeature, TruthShape};
use touchup::stylus::ProbedPoint;

use crate::full::either;
use crate::plate_stream::{PlateStream, contacts_of, plate_stream};

const MM: f64 = 1e3;

fn seeds() -> u64 {
    either(4, 50)
}

/// Error of the configured stylus: radius, m, and stiffness, as a share. The calibration says 2 µm
/// and 2 %.
#[derive(Clone, Copy, Debug, Default)]
struct CalibrationOffset {
    radius: f64,
    stiffness: f64,
}

/// The plate of one seed, scanned and touched as in the demo, up to a share of its contacts; the touches.
fn touched(seed: u64, off: CalibrationOffset, share: f64) -> (TriMesh, Vec<ProbedPoint>) {
    let stylus = StylusParams::default();
    assert_eq!(
        (stylus.friction, stylus.sensor.pose_noise),
        (0.15, 0.05e-3),
        "the demo has changed"
    );
    let (
        PlateStream {
            scan,
            noise,
            samples,
        },
        _,
    ) = plate_stream(&stylus, seed);
    let (radius, stiffness) = (
        stylus.radius + off.radius,
        stylus.stiffness * (1.0 + off.stiffness),
    );
    let mut params = PatcherParams::new(radius, Some(stiffness), noise);
    params.uncertainty.as_mut().unwrap().calibration = CalibrationParams {
        radius: 2e-6,
        place: 0.0,
        stiffness_share: 0.02,
    };
    let mut patcher = Patcher::new(params).unwrap();
    let contacts = contacts_of(radius, Some(stiffness), &samples);
    contacts[..(share * contacts.len() as f64) as usize]
        .iter()
        .for_each(|contact| patcher.push(contact));
    patcher.flush();
    let mesh = patcher.patched(&scan, &FaceTree::new(&scan)).unwrap().mesh;
    (mesh, patcher.probed().to_vec())
}

/// Its features after all touches.
fn found(seed: u64, off: CalibrationOffset) -> Vec<Feature> {
    let (mesh, touches) = touched(seed, off, 1.0);
    detect(&mesh, &touches).features
}

/// The scan smears the untouched rims of the plate, and is too high there: beside the touched
/// region is a step. Of 50 plates one has a shaft there today (seed 49), the permitted maximum.
#[test]
fn a_smeared_rim_beside_what_was_touched_is_no_shaft() {
    let (seeds, most) = either((vec![1, 12, 35], 0), ((1..=50).collect(), 1));
    let has_shaft = |seed: &u64| {
        let features = found(*seed, CalibrationOffset::default());
        features
            .iter()
            .any(|feature| feature.kind == FeatureKind::Cylinder)
    };
    let wrong: Vec<u64> = seeds.into_iter().filter(has_shaft).collect();
    assert!(wrong.len() <= most, "{wrong:?}");
}

/// With few touches small differences decide: the order of the faces must play no part.
#[test]
fn features_do_not_depend_on_how_the_mesh_is_numbered() {
    let (mesh, touches) = touched(7, CalibrationOffset::default(), 0.25);
    let features = detect(&mesh, &touches).features;
    let mut random = Pcg64::seed_from_u64(7);
    for _ in 0..either(4, 20) {
        let mut vertices: Vec<u32> = (0..mesh.vertex_slots() as u32).collect();
        vertices.shuffle(&mut random);
        let mut positions = mesh.positions().to_vec();
        let mut number = vec![0; vertices.len()];
        for (new, &old) in vertices.iter().enumerate() {
            positions[new] = mesh.positions()[old as usize];
            number[old as usize] = new as u32;
        }
        let mut faces: Vec<_> = mesh
            .faces()
            .map(|(_, corners)| corners.map(|corner| number[corner.0 as usize]))
            .collect();
        faces.shuffle(&mut random);
        faces
            .iter_mut()
            .for_each(|corners| corners.rotate_left(random.random_range(0..3)));
        let other = TriMesh::new(positions, faces).unwrap();
        assert!(detect(&other, &touches).features == features);
    }
    assert!(
        features
            .iter()
            .any(|feature| feature.kind == FeatureKind::Boss),
        "what was touched by then"
    );
}

/// Errors of one dimension of one feature, and its standard uncertainty, seed by seed; mm or
/// degrees.
struct Row {
    name: String,
    /// at most, by the issue
    bound: Option<f64>,
    errors: Vec<f64>,
    stds: Vec<f64>,
}

impl Row {
    fn normalised(&self) -> impl Iterator<Item = f64> {
        self.errors
            .iter()
            .zip(&self.stds)
            .map(|(error, std)| error / std)
    }

    fn worst(&self) -> f64 {
        self.errors
            .iter()
            .map(|error| error.abs())
            .fold(0.0, f64::max)
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    values.for_each(|x| (sum, count) = (sum + x * x, count + 1.0));
    f64::sqrt(sum / count)
}

/// All numbers of all features.
#[derive(Default)]
struct Table {
    rows: Vec<Row>,
    /// holes said to go through that are blind, or the reverse
    wrongly_through: usize,
}

impl Table {
    fn add(&mut self, name: String, bound: Option<f64>, error: f64, std: Option<f64>) {
        let std = std.unwrap_or_else(|| panic!("{name}: it does not say how well it is known"));
        assert!(std > 0.0 && std.is_finite(), "{name}: {std}");
        if self.rows.iter().all(|row| row.name != name) {
            self.rows.push(Row {
                name: name.clone(),
                bound,
                errors: Vec::new(),
                stds: Vec::new(),
            });
        }
        let row = self.rows.iter_mut().find(|row| row.name == name).unwrap();
        row.errors.push(error);
        row.stds.push(std);
    }

    fn print(&self) {
        println!(
            "{:22} {:>8} {:>8} {:>8} {:>10} {:>10}   mm, degrees",
            "", "mean", "rms", "max", "median std", "rms of z"
        );
        for row in &self.rows {
            let Row {
                name, errors, stds, ..
            } = row;
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            let mut stds = stds.clone();
            stds.sort_by(f64::total_cmp);
            println!(
                "{name:22} {mean:8.4} {:8.4} {:8.4} {:10.4} {:10.2}",
                rms(errors.iter().copied()),
                row.worst(),
                stds[stds.len() / 2],
                rms(row.normalised())
            );
        }
    }
}

/// Distance across `axis`, m.
fn across(off: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
    off.cross(axis).norm()
}

fn kind_of(truth: &TruthFeature) -> Option<FeatureKind> {
    match truth.shape {
        TruthShape::Hole { .. } => Some(FeatureKind::Hole),
        TruthShape::Slot { .. } => Some(FeatureKind::Slot),
        TruthShape::Boss { .. } => Some(FeatureKind::Boss),
        TruthShape::Step { .. } => None,
    }
}

/// Compares one feature with the drawing.
#[expect(clippy::too_many_lines)]
fn compare(table: &mut Table, truth: &TruthFeature, feature: &Feature) {
    let name = truth.name;
    assert_eq!(feature.fitted_to, FittedTo::Touches, "{name}");
    let mut number =
        |what: &str, truth: f64, measured: &Option<MeasuredValue<f64>>, bound: Option<f64>| {
            let measured = measured
                .as_ref()
                .unwrap_or_else(|| panic!("{name} has no {what}"));
            let std = measured.std.map(|std| std * MM);
            table.add(
                format!("{name}, {what}"),
                bound,
                (measured.value - truth) * MM,
                std,
            );
        };
    const BOUND: Option<f64> = Some(0.05);
    match truth.shape {
        TruthShape::Hole {
            diameter,
            depth,
            through,
        } => {
            number("diameter", diameter, &feature.diameter, BOUND);
            // if the ball came down to a floor
            if feature
                .depth
                .as_ref()
                .is_some_and(|depth| depth.std.is_some())
            {
                number("depth", depth, &feature.depth, None);
                assert_eq!(feature.through, Some(through), "{name}");
            }
            table.wrongly_through += usize::from(feature.through == Some(!through));
        }
        TruthShape::Boss { diameter, height } => {
            number("diameter", diameter, &feature.diameter, BOUND);
            if feature
                .depth
                .as_ref()
                .is_some_and(|depth| depth.std.is_some())
            {
                number("height", height, &feature.depth, None);
            }
        }
        TruthShape::Slot {
            width,
            length,
            depth,
            direction,
        } => {
            number("width", width, &feature.width, BOUND);
            number("length", length, &feature.length, None);
            // if the ball touched its floor
            if feature
                .depth
                .as_ref()
                .is_some_and(|depth| depth.std.is_some())
            {
                number("depth", depth, &feature.depth, None);
            }
            assert_eq!(feature.through, Some(false), "{name}");
            let off = feature
                .direction
                .unwrap()
                .cross(&direction)
                .norm()
                .asin()
                .to_degrees();
            assert!(off < 0.5, "{name}: its direction is off by {off}°");
        }
        TruthShape::Step { .. } => unreachable!("a step is an edge"),
    }
    let off = across(&(feature.centre.value - truth.centre), &truth.axis) * MM;
    table.add(
        format!("{name}, centre"),
        BOUND,
        off,
        feature.centre.std.map(|std| std * MM),
    );
    let axis = feature.axis.as_ref().unwrap();
    assert!(
        axis.value.dot(&truth.axis) > 0.0,
        "{name}: it opens to the other side"
    );
    let off = axis.value.cross(&truth.axis).norm().asin().to_degrees();
    table.add(
        format!("{name}, axis"),
        Some(0.5),
        off,
        axis.std.map(f64::to_degrees),
    );
}

/// The one feature of a true one's kind near it.
fn of_truth<'a>(truth: &TruthFeature, kind: FeatureKind, features: &'a [Feature]) -> &'a Feature {
    let near =
        |feature: &&Feature| across(&(feature.centre.value - truth.centre), &truth.axis) < 1.5e-3;
    let mut found = features
        .iter()
        .filter(|feature| feature.kind == kind)
        .filter(near);
    found
        .next()
        .unwrap_or_else(|| panic!("the {} was not found", truth.name))
}

/// Interval of the root mean square of `count` normalised errors of standard deviation 1 in 99.8 %
/// of cases: quantiles of χ² by Wilson and Hilferty's cube (six have 0.05 and 3.78 as mean squares;
/// Abramowitz & Stegun, table 26.8, 0.06 and 3.74).
fn stated_over(count: usize) -> [f64; 2] {
    let spread = 2.0 / (9.0 * count as f64);
    [-3.09, 3.09].map(|z| (1.0 - spread + z * spread.sqrt()).max(0.0).powf(1.5))
}

#[test]
#[expect(clippy::too_many_lines)]
fn touched_features_are_found_within_their_stated_uncertainty() {
    let truths = Plate::default().features();
    let mut table = Table::default();
    let mut others = Vec::new();
    for seed in 1..=seeds() {
        // one and a half times the deviation of the calibration, each sign in turn: no draws of the
        // model under test
        let sign = |bit: u64| if seed >> bit & 1 == 0 { 1.5 } else { -1.5 };
        let features = found(
            seed,
            CalibrationOffset {
                radius: sign(0) * 2e-6,
                stiffness: sign(1) * 0.02,
            },
        );
        let count = |kind: FeatureKind| {
            features
                .iter()
                .filter(|feature| feature.kind == kind)
                .count()
        };
        let counts = [
            FeatureKind::Hole,
            FeatureKind::Slot,
            FeatureKind::Pocket,
            FeatureKind::Boss,
        ]
        .map(count);
        if counts != [2, 1, 0, 1] {
            let all = features
                .iter()
                .map(|feature| (feature.kind, feature.centre.value))
                .collect::<Vec<_>>();
            others.push(format!(
                "seed {seed}: {counts:?} holes, slots, pockets, bosses: {all:?}"
            ));
        }
        for (truth, kind) in truths
            .iter()
            .filter_map(|truth| Some((truth, kind_of(truth)?)))
        {
            compare(&mut table, truth, of_truth(truth, kind, &features));
        }
    }
    table.print();
    assert!(others.is_empty(), "{}", others.join("\n"));
    for row in &table.rows {
        let (name, z) = (&row.name, rms(row.normalised()));
        assert!(
            row.bound.is_none_or(|bound| row.worst() < bound),
            "{name} is off by {}",
            row.worst()
        );
        // few errors determine a standard deviation no better than χ² allows; touches reach the
        // floor in few seeds
        let count = row.errors.len();
        // widths in every seed, a depth if the ball touched the floor
        assert!(
            count == seeds() as usize || name.ends_with("depth"),
            "{name}: measured in {count} seeds"
        );
        let [low, high] = if count < 50 {
            stated_over(count)
        } else {
            [1.0; 2]
        };
        assert!(
            (0.5 * low..=2.0 * high).contains(&z),
            "{name}: rms of error over uncertainty {z}"
        );
    }
    let all = rms(table.rows.iter().flat_map(Row::normalised));
    println!(
        "all: {all:.2}; wrongly through or blind: {} of {} holes",
        table.wrongly_through,
        2 * seeds()
    );
    assert!(
        (0.5..=2.0).contains(&all),
        "rms of error over uncertainty {all}"
    );
    // an untouched floor is not known
    assert_eq!(table.wrongly_through, 0);
}

/// The centre of the ball does not depend on the stated radius: a ball stated 20 µm too large, ten
/// times the deviation of the calibration, makes bores and slots 40 µm wider and bosses 40 µm
/// thinner, and their stated uncertainties do not show it.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn a_wrong_radius_goes_twice_into_every_width_and_is_not_in_its_uncertainty() {
    let off = 20e-6;
    let [right, wrong] = [0.0, off].map(|radius| {
        found(
            1,
            CalibrationOffset {
                radius,
                ..CalibrationOffset::default()
            },
        )
    });
    let (mut compared, mut outside) = (0, 0);
    for (truth, kind) in Plate::default()
        .features()
        .iter()
        .filter_map(|truth| Some((truth, kind_of(truth)?)))
    {
        let width = |features: &[Feature]| {
            let feature = of_truth(truth, kind, features);
            let width = if kind == FeatureKind::Slot {
                &feature.width
            } else {
                &feature.diameter
            };
            let width = width.as_ref().unwrap();
            (width.value, width.std.unwrap())
        };
        let true_width = match truth.shape {
            TruthShape::Hole { diameter, .. } | TruthShape::Boss { diameter, .. } => diameter,
            TruthShape::Slot { width, .. } => width,
            TruthShape::Step { .. } => unreachable!("a step is an edge"),
        };
        let (before, after) = (width(&right), width(&wrong));
        let expected = if kind == FeatureKind::Boss {
            -2.0 * off
        } else {
            2.0 * off
        };
        println!(
            "{}: {:.1} µm, {:.1} µm ± {:.1} µm of the drawing",
            truth.name,
            (after.0 - before.0) * 1e6,
            (after.0 - true_width) * 1e6,
            after.1 * 1e6
        );
        assert!(
            (after.0 - before.0 - expected).abs() < 6e-6,
            "{}: {} -> {}",
            truth.name,
            before.0,
            after.0
        );
        assert!(
            (after.1 / before.1 - 1.0).abs() < 0.2,
            "{}: ± {} -> {}",
            truth.name,
            before.1,
            after.1
        );
        compared += 1;
        outside += usize::from((after.0 - true_width).abs() > 2.0 * after.1);
    }
    assert!(
        compared == 4 && outside >= 3,
        "{outside} of {compared} outside of two standard deviations"
    );
}

/// The plate of the drawing with touches on the surface around the blind hole and on the upper 3 mm
/// of its wall: its depth stays open, and untouched numbers have no uncertainty beside touched
/// ones. Without touches the drawing is exact to its rounding.
#[test]
#[expect(clippy::too_many_lines)]
fn what_was_not_felt_is_a_bound_or_has_no_uncertainty() {
    let plate = Plate::default();
    let mesh = plate.mesh(5e-6).unwrap();
    let truth = plate
        .features()
        .into_iter()
        .find(|truth| truth.name.contains("blind"))
        .unwrap();
    let TruthShape::Hole {
        diameter,
        depth: drawn_depth,
        ..
    } = truth.shape
    else {
        panic!("a hole")
    };
    let (centre, top, radius) = (truth.centre, truth.centre.z, diameter / 2.0);
    let touch = |point: Point3<f64>, normal: Vector3<f64>, number: i64| ProbedPoint {
        point,
        normal,
        centre: point + normal * 1.5e-3,
        radius: 1.5e-3,
        sigma: 0.02e-3,
        weight: 1.0,
        calibration: 2e-6,
        place: 0.0,
        stroke: number as u32,
        stamp_ns: number * 1_000_000_000,
        is_rejected: false,
    };
    let felt = 3e-3;
    let mut touches = Vec::new();
    for i in 0..40 {
        let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 40.0).sin_cos();
        let at = |from_axis: f64, depth: f64| {
            Point3::new(
                centre.x + from_axis * cosine,
                centre.y + from_axis * sine,
                top - depth,
            )
        };
        let number = touches.len() as i64;
        touches.push(touch(at(radius + 2e-3, 0.0), Vector3::z(), number));
        let inward = -Vector3::new(cosine, sine, 0.0);
        touches.push(touch(
            at(radius, felt * f64::from(i % 4) / 3.0),
            inward,
            number + 1,
        ));
    }
    let of = |touches: &[ProbedPoint]| detect(&mesh, touches).features;
    let depth = |features: &[Feature]| {
        of_truth(&truth, FeatureKind::Hole, features)
            .depth
            .clone()
            .unwrap()
    };
    let drawn = depth(&of(&[]));
    assert!(!drawn.is_at_least && (drawn.value - drawn_depth).abs() < 1e-6 && drawn.std.is_some());
    let touched = of(&touches);
    let bound = depth(&touched);
    assert!(
        bound.is_at_least && bound.std.is_none() && (bound.value - felt).abs() < 0.05e-3,
        "{bound:?}"
    );
    for feature in touched
        .iter()
        .filter(|feature| feature.fitted_to == FittedTo::Mesh)
    {
        let axis = feature.axis.as_ref().and_then(|axis| axis.std);
        assert!(
            feature.centre.std.is_none() && axis.is_none(),
            "{feature:?}"
        );
    }
    // touches of neither end: the wall alone, from a third of its height on
    let of_wall = |touch: &&ProbedPoint| touch.normal.z == 0.0 && touch.point.z < top - 0.9e-3;
    let of_wall: Vec<ProbedPoint> = touches.iter().filter(of_wall).copied().collect();
    let bound = depth(&of(&of_wall));
    assert!(
        bound.is_at_least && (bound.value - 2.0 / 3.0 * felt).abs() < 0.05e-3,
        "{bound:?}"
    );
    let is_known =
        |feature: &&Feature| feature.fitted_to == FittedTo::Touches && feature.centre.std.is_some();
    assert_eq!(
        touched.iter().filter(is_known).count(),
        2,
        "the hole and the surface around it"
    );
}
