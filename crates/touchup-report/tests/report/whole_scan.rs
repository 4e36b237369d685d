//! Parts 2 and 3 of the report: the baselines against closed forms, the fits against known laws,
//! errors against cases worked by hand, and one quick run from end to end.

use nalgebra::{Isometry3, Point3, Vector3};
use touchup_features::compare::TouchedRegion;
use touchup_geometry::mesh::{FaceTree, TriMesh, VertexId};
use touchup_method::stylus::{CompensatorParams, Sample, TipParams, Wrench};
use touchup_report::convergence::{
    OneFaceRun, OneFaceSample, Rule, convergence, fit_decay, straight_line,
};
use touchup_report::error::MeasureError;
use touchup_report::whole_scan::{
    ContactSculptor, GaussianParams, GaussianProcess, GaussianSurface, GivenPart, RefineMethod,
    TouchedError, whole_scan,
};
use touchup_report::{Drawing, Effort, TableCell};

/// A square sheet of `cells` × `cells` squares of 1 mm at height `z` (m), looking up.
fn sheet(cells: u32, z: f64) -> TriMesh {
    let row = cells + 1;
    let at = |i: u32| f64::from(i) * 1e-3;
    let positions = (0..row * row)
        .map(|k| Point3::new(at(k % row), at(k / row), z))
        .collect();
    let squares = (0..cells * cells).map(|k| k % cells + k / cells * row);
    let faces = squares.flat_map(|a| [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
    TriMesh::new(positions, faces.collect()).unwrap()
}

#[test]
fn a_gaussian_process_without_noise_goes_through_its_data() {
    let params = GaussianParams {
        amplitude: 0.7e-3,
        length: 2e-3,
        noise: 0.0,
    };
    let points: Vec<_> = (0..12)
        .map(|i| Point3::new(1.1e-3 * f64::from(i), 0.3e-3 * f64::from(i % 3), 0.0))
        .collect();
    let values: Vec<_> = (0..12).map(|i| 1e-3 * (0.9 * f64::from(i)).sin()).collect();
    let process = GaussianProcess::fit(params, &points, &values).unwrap();
    for (point, value) in points.iter().zip(&values) {
        // K has a condition of some 10³ here
        assert!(
            (process.mean(point) - value).abs() < 1e-3 * 1e-10,
            "{point}"
        );
    }
    // far from all data the mean is that of the prior
    assert!(process.mean(&Point3::new(1.0, 0.0, 0.0)).abs() < 1e-300);
}

/// (K + σ²) w = v for two points, solved by Cramer's rule: K = s² [1 c; c 1].
#[test]
fn two_points_are_fitted_as_by_hand() {
    let params = GaussianParams {
        amplitude: 2.0,
        length: 1e-3,
        noise: 0.5,
    };
    let points = [Point3::origin(), Point3::new(1e-3, 0.0, 0.0)];
    let process = GaussianProcess::fit(params, &points, &[3.0, -1.0]).unwrap();
    let (diagonal, beside) = (4.0 + 0.25, 4.0 * (-0.5f64).exp());
    let determinant = diagonal * diagonal - beside * beside;
    let weights = [
        (3.0 * diagonal + beside) / determinant,
        (-diagonal - 3.0 * beside) / determinant,
    ];
    let k = |d: f64| 4.0 * (-d * d / 2.0).exp();
    for x in [-0.7, 0.0, 0.4, 1.0, 2.5] {
        let expected = k(x) * weights[0] + k(x - 1.0) * weights[1];
        assert!(
            (process.mean(&Point3::new(x * 1e-3, 0.0, 0.0)) - expected).abs() < 1e-13,
            "{x}"
        );
    }
}

#[test]
fn two_exact_values_in_one_place_have_no_gaussian_process() {
    let params = GaussianParams {
        amplitude: 1.0,
        length: 1e-3,
        noise: 0.0,
    };
    assert!(GaussianProcess::fit(params, &[Point3::origin(); 2], &[1.0, 2.0]).is_none());
    let scan = sheet(4, 0.0);
    let mut surface = GaussianSurface::new(&scan, params);
    let contact = Point3::new(2e-3, 2e-3, 0.3e-3);
    assert!(surface.push(contact));
    let before = surface.mesh().positions().to_vec();
    assert!(!surface.push(contact), "the second one is refused");
    assert_eq!(surface.mesh().positions(), before);
}

/// One touch at height h above a vertex: the vertex moves to t = h exp(−(t − h)²/2ℓ²), and far ones
/// stay.
#[test]
fn the_implicit_surface_goes_through_a_touch() {
    let scan = sheet(40, 0.0);
    let (height, length) = (0.2e-3, 2e-3);
    let mut surface = GaussianSurface::new(
        &scan,
        GaussianParams {
            amplitude: 1e-3,
            length,
            noise: 0.0,
        },
    );
    assert!(surface.push(Point3::new(20e-3, 20e-3, height)));
    let mesh = surface.mesh();
    let z = |i: u32, j: u32| mesh.position(VertexId(i + 41 * j)).z;
    assert!((z(20, 20) - height).abs() < 1e-9, "{}", z(20, 20));
    // 2 mm aside: one length, so about exp(−1/2) of it; the height changes that by less than h²/2ℓ²
    // = 0.5 %
    assert!(
        (z(22, 20) / height - (-0.5f64).exp()).abs() < 0.005,
        "{}",
        z(22, 20)
    );
    assert_eq!(z(40, 20), 0.0);
}

#[test]
fn contact_points_pull_the_mesh_through_themselves() {
    let radius = 1.5e-3;
    let scan = sheet(20, 0.4e-3);
    let mut sculptor = ContactSculptor::new(&scan, radius, 2e-3);
    // a ball on z = 0, inside a face, on an edge and on a vertex
    for (x, y) in [(5.3e-3, 5.2e-3), (12.5e-3, 9e-3), (15e-3, 15e-3)] {
        let contact = sculptor.push(&Point3::new(x, y, radius)).unwrap();
        assert!((contact - Point3::new(x, y, 0.0)).norm() < 1e-15);
        let hit = FaceTree::new(&sculptor.mesh)
            .closest(&sculptor.mesh, &contact, 1.0)
            .unwrap();
        assert!(hit.distance_squared.sqrt() < 1e-15, "{x} {y}");
    }
    let moved = sculptor.mesh;
    let (before, after) = (scan.positions(), moved.positions());
    for (a, b) in before.iter().zip(after) {
        let far = |(x, y): (f64, f64)| (a.x - x).hypot(a.y - y) > 2.5e-3;
        if [(5.3e-3, 5.2e-3), (12.5e-3, 9e-3), (15e-3, 15e-3)]
            .into_iter()
            .all(far)
        {
            assert_eq!(a, b, "beyond the reach nothing moves");
        }
    }
}

#[test]
fn an_even_offset_is_the_error_in_both_directions() {
    let (truth, mesh) = (sheet(20, 0.0), sheet(20, 0.3e-3));
    let tree = FaceTree::new(&truth);
    let touched = (0..100).map(|i| Point3::new(5e-3 + 0.1e-3 * f64::from(i), 10e-3, 0.0));
    let region = TouchedRegion::of(touched);
    let error = TouchedError::of(&mesh, &truth, &tree, &region).unwrap();
    for mm in [
        error.mean_mm(),
        error.p95_mm(),
        error.part_to_mesh_mean_mm,
        error.mesh_to_part_mean_mm,
    ] {
        assert!((mm - 0.3).abs() < 1e-12, "{error:?}");
    }
    assert!(error.normal_mean_deg < 1e-6 && error.normal_p95_deg < 1e-6);
}

/// Each raised line of vertices makes two of fifty strips lean: 4 % of the area are no part of the
/// 95th percentile, 8 % are.
#[test]
fn the_95th_percentile_of_the_normals_is_that_of_the_area() {
    let (cells, edge, slope) = (50, 1e-3, 0.05f64);
    let (truth, lean_deg) = (sheet(cells, 0.0), slope.atan().to_degrees());
    let at = |i: u32| f64::from(i) * edge / 2.0;
    let everywhere =
        (0..=2 * cells).flat_map(|i| (0..=2 * cells).map(move |j| Point3::new(at(i), at(j), 0.0)));
    let region = TouchedRegion::of(everywhere);
    for (raised, expected_deg) in [(vec![12], 0.0), (vec![12, 30], lean_deg)] {
        let mut mesh = truth.clone();
        for vertex in (0..(cells + 1) * (cells + 1))
            .filter(|vertex| raised.contains(&(vertex % (cells + 1))))
            .map(VertexId)
        {
            mesh.set_position(
                vertex,
                mesh.position(vertex) + Vector3::z() * (slope * edge),
            );
        }
        let error = TouchedError::of(&mesh, &truth, &FaceTree::new(&truth), &region).unwrap();
        assert!(
            (error.normal_p95_deg - expected_deg).abs() < 1e-6,
            "{error:?}"
        );
        // points of the mesh lie at random over it
        let mean_deg = lean_deg * 2.0 * raised.len() as f64 / f64::from(cells);
        assert!(
            (error.normal_mean_deg / mean_deg - 1.0).abs() < 0.1,
            "{error:?}"
        );
    }
}

/// z = 0.01 x over the truth z = 0: from mesh to part the distance at x is 0.01 x, the tilt is atan
/// 0.01 everywhere.
#[test]
fn a_tilt_is_measured_where_it_was_touched() {
    let truth = sheet(20, 0.0);
    let mut mesh = truth.clone();
    for vertex in (0..21 * 21).map(VertexId) {
        let p = mesh.position(vertex);
        mesh.set_position(vertex, Point3::new(p.x, p.y, 0.01 * p.x));
    }
    let region =
        TouchedRegion::of((0..=100).map(|i| Point3::new(10e-3, 5e-3 + 0.1e-3 * f64::from(i), 0.0)));
    let error = TouchedError::of(&mesh, &truth, &FaceTree::new(&truth), &region).unwrap();
    // the touched region is x = 10 ± 1 mm; points of the mesh lie at random over it, so that their
    // mean has an error of a few %
    assert!((error.mesh_to_part_mean_mm - 0.1).abs() < 2e-3, "{error:?}");
    // perpendicular to the tilted mesh: 0.1 cos(atan 0.01)
    assert!(
        (error.part_to_mesh_mean_mm - 0.1 / 1.0001f64.sqrt()).abs() < 1e-9,
        "{error:?}"
    );
    assert!(
        (error.normal_mean_deg - 0.01f64.atan().to_degrees()).abs() < 1e-6,
        "{error:?}"
    );
}

#[test]
fn each_law_is_known_again() {
    let sweeps = (1..=10).map(f64::from);
    let power: Vec<f64> = sweeps.clone().map(|sweep| 0.8 * sweep.powf(-0.7)).collect();
    let decay = fit_decay(&power).unwrap();
    assert!(
        (decay.power.slope + 0.7).abs() < 1e-12 && (decay.power.offset.exp() - 0.8).abs() < 1e-12
    );
    assert!((decay.power.r_squared.unwrap() - 1.0).abs() < 1e-12);
    assert!(
        decay.exponential.r_squared.unwrap() < 0.95,
        "and the other law is not it"
    );

    let exponential: Vec<f64> = sweeps.map(|sweep| 2.4 * (-0.3 * sweep).exp()).collect();
    let decay = fit_decay(&exponential).unwrap();
    assert!(
        (decay.exponential.slope + 0.3).abs() < 1e-12
            && (decay.exponential.offset.exp() - 2.4).abs() < 1e-12
    );
    assert!((decay.exponential.r_squared.unwrap() - 1.0).abs() < 1e-12);
    assert!(decay.power.r_squared.unwrap() < 0.95);
    assert!((decay.at(4.0)[0] - exponential[3]).abs() < 1e-12);
}

#[test]
fn what_cannot_be_fitted_is_not() {
    assert_eq!(fit_decay(&[1.0]), None);
    assert_eq!(fit_decay(&[1.0, 0.0, 0.5]), None, "no logarithm");
    assert_eq!(fit_decay(&[1.0, f64::NAN]), None);
    assert_eq!(straight_line(&[(1.0, 2.0), (1.0, 3.0)]), None);
    // all alike: a line, but nothing to explain
    assert_eq!(fit_decay(&[0.5; 4]).unwrap().power.r_squared, None);
    // y = 1, 2, 2 at x = 0, 1, 2: slope 1/2, offset 7/6, residual 1/6 of 2/3
    let line = straight_line(&[(0.0, 1.0), (1.0, 2.0), (2.0, 2.0)]).unwrap();
    assert!((line.slope - 0.5).abs() < 1e-15 && (line.offset - 7.0 / 6.0).abs() < 1e-15);
    assert!(
        (line.r_squared.unwrap() - 0.75).abs() < 1e-15
            && (line.left - (1.0f64 / 18.0).sqrt()).abs() < 1e-15
    );
}

/// A sheet that lies 0.4 mm too high, and a rigid ball that slides over the true one.
fn given() -> GivenPart {
    let radius = 1.5e-3;
    let samples = (0..12_000_i64).map(|i| {
        let (line, along) = (i / 1000, (i % 1000) as f64 * 0.012e-3);
        let x = if line % 2 == 0 {
            4e-3 + along
        } else {
            16e-3 - along
        };
        let pose_ot = Isometry3::translation(x, 4e-3 + line as f64 * 1e-3, radius);
        let wrench = Wrench {
            force: Vector3::new(0.0, 0.0, 2.0),
            torque: Vector3::zeros(),
        };
        Sample {
            stamp_ns: i * 1_000_000,
            pose_ot,
            wrench,
        }
    });
    GivenPart {
        name: "a sheet".to_owned(),
        scan: sheet(20, 0.4e-3),
        truth: sheet(20, 0.0),
        samples: samples.collect(),
        tip: TipParams {
            radius,
            stiffness: None,
        },
        compensator: CompensatorParams::default(),
        scan_noise: 0.3e-3,
    }
}

const QUICK: Effort = Effort { is_quick: true };

#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn whole_scans_are_measured_and_reported() {
    let (given, mut lines) = (given(), 0);
    let begun = std::time::Instant::now();
    let found = whole_scan(QUICK, Some(&given), &mut |line| {
        lines += 1;
        println!("{:7.2} {line}", begun.elapsed().as_secs_f64());
    })
    .unwrap();
    println!("{:7.2} done", begun.elapsed().as_secs_f64());
    let names: Vec<_> = found.cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names, ["peaks", "plate", "a sheet"]);
    assert!(lines > 3 * RefineMethod::ALL.len());
    for case in &found.cases {
        let scan = case.main().unwrap();
        assert_eq!(
            scan.methods
                .iter()
                .map(|result| result.method)
                .collect::<Vec<_>>(),
            RefineMethod::ALL
        );
        for result in scan.methods.iter().filter(|result| !result.is_sound()) {
            assert!(
                !result.remarks.is_empty(),
                "{}: {} says why",
                case.name,
                result.name
            );
        }
        for result in case.scans.iter().flat_map(|scan| &scan.methods) {
            println!(
                "{:8} {:35} {:7.3} mm {:7.3} mm {:6.1} deg {:9.3} µs {:8.3} s {:?}",
                case.name,
                result.name,
                result.mean_mm(),
                result.error.map_or(f64::NAN, |error| error.p95_mm()),
                result.error.map_or(f64::NAN, |error| error.normal_mean_deg),
                result.per_sample_us.median,
                result.total_s.median,
                result.remarks,
            );
        }
        let best = scan.best().unwrap();
        assert!(
            scan.methods
                .iter()
                .all(|result| !result.is_sound() || result.mean_mm() >= best.mean_mm())
        );
        assert!(
            scan.front()
                .iter()
                .any(|result| result.mean_mm() == best.mean_mm())
        );
    }
    let sheet = found.cases[2].main().unwrap();
    assert!(
        (sheet.before.mean_mm() - 0.4).abs() < 1e-9,
        "{:?}",
        sheet.before
    );
    // each contact point also pulls down the surface behind it, which the ball does not reach again
    assert!(sheet.of(RefineMethod::ContactPoints).unwrap().mean_mm() < 0.4);
    for method in [
        RefineMethod::HAPTIC,
        RefineMethod::Patch,
        RefineMethod::GaussianProcess,
    ] {
        assert!(
            sheet.of(method).unwrap().mean_mm() < 0.1,
            "{method:?}: an even offset is no difficulty"
        );
    }
    let chapter = found.chapter();
    chapter.text.iter().for_each(|text| println!("{text}\n"));
    check_chapter(&chapter);
    let rows = &chapter.tables[0].rows;
    let scans: usize = found.cases.iter().map(|case| case.scans.len()).sum();
    let methods: usize = found
        .cases
        .iter()
        .flat_map(|case| &case.scans)
        .map(|scan| scan.methods.len())
        .sum();
    assert_eq!(rows.len(), scans + methods, "nothing is left out");
}

#[test]
fn what_touches_nothing_is_refused() {
    let mut given = given();
    given
        .samples
        .iter_mut()
        .for_each(|sample| sample.pose_ot.translation.z += 0.1);
    let refused = whole_scan(QUICK, Some(&given), &mut |_| {});
    assert!(
        matches!(
            refused,
            Err(MeasureError::NothingTouched {
                samples: 12_000,
                ..
            })
        ),
        "{refused:?}"
    );
}

#[test]
#[ignore = "a slow proof"]
fn convergence_is_measured_and_reported() {
    let found = convergence(QUICK, &mut |_| {});
    assert!(found.failed.is_empty());
    for rule in [Rule::Paper, Rule::Robust] {
        assert_eq!(found.of(rule).count(), 2);
    }
    // the paper's own figure: 2.4 mm before, about 0.55 mm after the first sweep
    let paper = found.of(Rule::Paper).next().unwrap();
    assert!(
        (paper.errors[0].distance_mm - 2.4).abs() < 0.1
            && (paper.errors[1].distance_mm - 0.55).abs() < 0.3
    );
    let chapter = found.chapter();
    chapter.text.iter().for_each(|text| println!("{text}\n"));
    check_chapter(&chapter);
    assert_eq!(chapter.tables[0].rows.len(), found.runs.len());
    check_one_face(&found.one_face);
}

/// Fig 6 and 7: b* stays on the line of n*(0), the distance falls before the angle, and both come
/// to zero.
fn check_one_face(runs: &[OneFaceRun]) {
    assert_eq!(runs.len(), 3);
    for run in runs {
        let [first, last] = [&run.samples[0], &run.samples[run.samples.len() - 1]];
        let tenth = |error: fn(&OneFaceSample) -> f64| run.time_to_share(0.1, error).unwrap();
        // a face that leans more draws the tip farther aside, so that the distance waits longer for
        // the angle
        assert!(
            tenth(|sample| sample.distance_mm) < 0.9 * tenth(|sample| sample.normal_deg),
            "{}",
            run.tilt_deg
        );
        assert!(
            last.distance_mm < 1e-6 && last.normal_deg < 1e-3,
            "{last:?}"
        );
        // along n*(0): aside by as much as the tangent of its lean
        let step = [0, 1, 2].map(|i| last.barycentre_mm[i] - first.barycentre_mm[i]);
        let aside = step[0].hypot(step[1]);
        assert!(
            (aside - step[2].abs() * run.tilt_deg.to_radians().tan()).abs() < 1e-9,
            "{step:?}"
        );
    }
}

/// Tables are as wide as their heads, figures have marks, and no two have one name.
fn check_chapter(chapter: &touchup_report::Chapter) {
    for table in &chapter.tables {
        assert!(
            table.rows.iter().all(|row| row.len() == table.heads.len()),
            "{}",
            table.id
        );
        let numbers = table.rows.iter().flatten().filter_map(|cell| match cell {
            TableCell::Number(number) => Some(*number),
            TableCell::Spread(spread) => Some(spread.median),
            _ => None,
        });
        assert!(numbers.into_iter().all(f64::is_finite), "{}", table.id);
    }
    let mut ids: Vec<_> = chapter.figures.iter().map(|figure| &figure.id).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), chapter.figures.len());
    for figure in &chapter.figures {
        let Drawing::Curves(series) = &figure.drawing else {
            panic!("{} is no set of curves", figure.id)
        };
        assert!(
            !series.is_empty() && series.iter().all(|series| !series.marks.is_empty()),
            "{}",
            figure.id
        );
    }
}
