//! The integrators of the report: their orders, their counts, and their reference, against closed
//! forms.

use nalgebra::Vector3;
use touchup_method::haptic::FaceState;
use touchup_report::document::Report;
use touchup_report::work_precision::{
    Method, PAPER_H_MIN_M, Problem, SolverSetting, WorkPrecision,
};
use touchup_report::{Drawing, Effort, TableCell};

fn reference(problem: &Problem) -> Option<FaceState> {
    problem.held().reference().map(|found| found.face)
}

/// A sample without friction at about half of f_max, so that u = h/h_min + δ has an elementary
/// solution at exactly half.
fn at_half_of_f_max(h_min_m: f64, from: f64) -> Problem {
    Problem {
        h_min_m,
        arm: Vector3::new(0.0, 0.0, h_min_m * (from - 5.0)),
        force: Vector3::new(0.0, 0.0, 5.0),
        normal: Vector3::z(),
        dt_s: 2e-3,
    }
}

/// du/dT = −tanh(u/2)/2 at half of f_max: sinh(u/2) falls by e^(−T/4), T = α f_max t / h_min.
fn travel_at_half(problem: &Problem, from: f64) -> f64 {
    let scaled = 0.1 * 10.0 * problem.dt_s / problem.h_min_m;
    let to = 2.0 * ((from / 2.0).sinh() * (-scaled / 4.0).exp()).asinh();
    (from - to) * problem.h_min_m
}

#[test]
fn the_reference_agrees_with_the_closed_form_however_stiff() {
    for h_min_m in [1e-3, 0.5e-3, 1e-4, 1e-6, 1e-9] {
        for from in [3.0, -2.0, 0.1] {
            let problem = at_half_of_f_max(h_min_m, from);
            let found = reference(&problem).unwrap().b.z;
            // the report relies on 1e-12 of h_min
            let off = (found - travel_at_half(&problem, from)).abs() / h_min_m;
            assert!(
                off < 1e-12,
                "h_min {h_min_m} from {from}: off by {off} of h_min"
            );
        }
    }
}

#[test]
fn the_reference_turns_the_normal_by_the_impulse_applied() {
    // tan(θ/2) falls by e^(−β|F|J), J = F·n t − s/α while n hardly turns; a tiny dt of a deep tip
    // holds it fast here
    let tilt: f64 = 0.6;
    let problem = Problem {
        h_min_m: PAPER_H_MIN_M,
        arm: Vector3::new(0.0, 0.0, -1.0),
        force: 2.0 * Vector3::new(tilt.sin(), 0.0, tilt.cos()),
        normal: Vector3::z(),
        dt_s: 0.05,
    };
    // a metre deep the face answers f_max to rounding all the time: J = f_max t
    let left = 2.0 * ((tilt / 2.0).tan() * (-0.1 * 2.0 * 10.0 * 0.05f64).exp()).atan();
    let n = reference(&problem).unwrap().n;
    let angle = n.cross(&problem.force).norm().atan2(n.dot(&problem.force));
    assert!((angle - left).abs() < 1e-12, "{angle} is not {left}");
}

/// Errors at two settings, and the order they make: the slope over halved steps.
fn order(method: Method, problem: &Problem, steps: usize) -> f64 {
    let right = reference(problem).unwrap();
    let error = |steps| {
        let end = method
            .solve(problem, SolverSetting::Steps(steps))
            .unwrap()
            .face;
        (end.b - right.b).norm() / problem.h_min_m + (end.n - right.n).norm()
    };
    (error(steps) / error(2 * steps)).log2()
}

#[test]
fn each_integrator_has_its_order() {
    let mild = Problem {
        dt_s: 20e-3,
        ..Problem::of(1e-3, 0.35)
    };
    for (method, steps, expected) in [
        (Method::Euler, 256, 1.0),
        (Method::RungeKutta, 64, 4.0),
        (Method::Lie, 16, 1.0),
        (Method::DriftCorrected, 16, 2.0),
    ] {
        let order = order(method, &mild, steps);
        assert!((order - expected).abs() < 0.15, "{method:?}: {order}");
    }
}

#[test]
fn an_adaptive_solver_gets_a_digit_for_its_evaluations() {
    // with order p the error falls as evaluations^−p: over six decades of tolerance the slope is
    // near that of the higher result
    let mild = Problem {
        dt_s: 20e-3,
        ..Problem::of(1e-3, 0.35)
    };
    let right = reference(&mild).unwrap();
    for (method, low, high) in [(Method::DormandPrince, 4.3, 6.2), (Method::Rodas, 3.3, 5.0)] {
        let [coarse, fine] = [1e-5, 1e-11].map(|relative| {
            let solved = method
                .solve(&mild, SolverSetting::RelativeTolerance(relative))
                .unwrap();
            ((solved.face.b - right.b).norm(), solved.evaluations as f64)
        });
        let order = (coarse.0 / fine.0).ln() / (fine.1 / coarse.1).ln();
        assert!(
            (low..high).contains(&order),
            "{method:?}: {order}, {coarse:?} {fine:?}"
        );
    }
}

#[test]
fn without_friction_one_exact_step_is_the_solution_and_no_explicit_one_is() {
    for h_min_m in [1e-3, 1e-6, 1e-9] {
        let problem = at_half_of_f_max(h_min_m, 3.0);
        let right = travel_at_half(&problem, 3.0);
        for method in [Method::Lie, Method::DriftCorrected] {
            let end = method
                .solve(&problem, SolverSetting::Steps(1))
                .unwrap()
                .face;
            assert!((end.b.z - right).abs() < 1e-13 * h_min_m && end.n == Vector3::z());
        }
        let euler = method_error(Method::Euler, &problem, right);
        let runge_kutta = method_error(Method::RungeKutta, &problem, right);
        // eight decades above the bound for the exact ones
        assert!(
            euler > 1e-5 * h_min_m && runge_kutta > 1e-5 * h_min_m,
            "{euler} {runge_kutta}"
        );
    }
}

fn method_error(method: Method, problem: &Problem, right: f64) -> f64 {
    (method
        .solve(problem, SolverSetting::Steps(1))
        .unwrap()
        .face
        .b
        .z
        - right)
        .abs()
}

#[test]
fn an_implicit_solver_crosses_nine_decades_of_stiffness_and_an_explicit_one_gives_up() {
    let stiff = Problem::of(1e-9, 0.35);
    let right = reference(&stiff).unwrap();
    let solved = Method::Rodas
        .solve(&stiff, SolverSetting::RelativeTolerance(1e-6))
        .unwrap();
    assert!(
        (solved.face.b - right.b).norm() < 1e-8 && solved.evaluations < 5000,
        "{}",
        solved.evaluations
    );
    assert!(
        Method::DormandPrince
            .solve(&stiff, SolverSetting::RelativeTolerance(1e-6))
            .is_none()
    );
}

#[test]
fn evaluations_are_counted_as_by_hand() {
    let tilted = Problem::of(PAPER_H_MIN_M, 0.35);
    let straight = Problem::of(PAPER_H_MIN_M, 0.0);
    for (method, steps, problem, count) in [
        (Method::Euler, 7, &tilted, 7),
        (Method::RungeKutta, 5, &tilted, 20),
        (Method::Lie, 3, &tilted, 3),
        (Method::DriftCorrected, 3, &tilted, 9),
        (Method::DriftCorrected, 3, &straight, 3),
    ] {
        assert_eq!(
            method
                .solve(problem, SolverSetting::Steps(steps))
                .unwrap()
                .evaluations,
            count,
            "{method:?}"
        );
    }
    // a tolerance that everything meets: one step. Dormand–Prince has seven stages, the first of
    // them from before; RODAS six and one Jacobian of four columns
    for (method, count) in [(Method::DormandPrince, 7), (Method::Rodas, 10)] {
        let solved = method
            .solve(&tilted, SolverSetting::RelativeTolerance(1e9))
            .unwrap();
        assert_eq!(solved.evaluations, count, "{method:?}");
    }
}

#[test]
#[expect(clippy::too_many_lines)]
fn what_is_measured_becomes_a_chapter_with_the_same_numbers() {
    let mut lines = Vec::new();
    let measured = WorkPrecision::measure(Effort { is_quick: true }, &mut |line| {
        lines.push(line.to_owned())
    });
    assert_eq!(
        (
            measured.cases.len(),
            lines.len(),
            measured.without_reference.len()
        ),
        (8, 8, 0)
    );
    for case in &measured.cases {
        for (method, point) in case.ranking(1e-6) {
            let time = point.time_s;
            assert!(
                point.error_m <= 1e-6
                    && 0.0 < time.p10
                    && time.p10 <= time.median
                    && time.median <= time.p90
            );
            assert!(case.curve(method).unwrap().points.contains(&point));
        }
        // the claim of the method: without friction one step is exact; with a tilt Lie is not
        let lie = case.curve(Method::Lie).unwrap().one_step().unwrap().error_m;
        let corrected = case
            .curve(Method::DriftCorrected)
            .unwrap()
            .one_step()
            .unwrap()
            .error_m;
        if case.tilt_deg == 0.0 {
            assert!(
                lie <= 2e-12 * case.h_min_m.max(case.travel_m),
                "{lie} at {}",
                case.h_min_m
            );
        } else {
            assert!(
                lie > 1e-12 && corrected < lie,
                "{lie} {corrected} at {}",
                case.h_min_m
            );
        }
    }
    let chapter = measured.chapter();
    for figure in &chapter.figures {
        let Drawing::Curves(series) = &figure.drawing else {
            panic!("curves")
        };
        assert_eq!(series.len(), Method::ALL.len(), "{}", figure.id);
    }
    for table in &chapter.tables {
        assert!(
            table.rows.iter().all(|row| row.len() == table.heads.len()),
            "{}",
            table.id
        );
    }
    let fastest = &chapter.tables[0].rows[0][3];
    assert_eq!(
        *fastest,
        TableCell::from(measured.cases[0].ranking(1e-6)[0].0.name())
    );
    let report = Report {
        machine: String::new(),
        commit: String::new(),
        command: String::new(),
        date: String::new(),
        advice: None,
        verdict: measured.verdict(),
        chapters: vec![chapter],
    };
    report.files().unwrap();
}
