//! The practitioner's questions, answered by the measurements: mode, step and region, rate, cost,
//! and limits.

use super::convergence::{Convergence, Rule};
use super::cost::{Cost, RecordingCost};
use super::coverage::Coverage;
use super::extremes::Extremes;
use super::mistakes::{LEAST_NAMED, Mistakes};
use super::peers::{Peers, PeersAtSize};
use super::stability::{Integrator, Stability};
use super::whole_scan::{CaseResult, MethodResult, RefineMethod, ScanResult, WholeScan};
use crate::Table;
use itertools::Itertools;
use touchup_document::number::three_digits;

/// Method and region, step, rate and limits, each with its reason and its cost; `None` if no method
/// improved any scan.
pub fn advice(
    scans: &WholeScan,
    stability: Option<&Stability>,
    cost: Option<&Cost>,
) -> Option<Table> {
    let best = by_part(scans, ScanResult::best);
    let slowest_us = slowest_us(&best)?;
    let [us, percent, rate] = [slowest_us, 0.1 * slowest_us, 1e6 / slowest_us].map(three_digits);
    let answer = cost
        .and_then(|cost| cost.by_faces.last())
        .map_or(String::new(), |recording| {
            let us = three_digits(recording.push.median as f64 * 1e-3);
            format!("; the haptic update answers in {us} µs, the patch follows")
        });
    let best_cost = format!(
        "up to {us} µs per sample: at 1 kHz {percent} % of one core, which keeps up with {rate} samples per second{answer}"
    );
    let mut rows = vec![[
        "method and region".to_owned(),
        one_or_each(&best),
        errors(&best),
        best_cost,
    ]];
    let haptic = by_part(scans, ScanResult::best_haptic);
    rows.extend(self::slowest_us(&haptic).map(|us| {
        let cost = format!("up to {} µs per sample", three_digits(us));
        [
            "haptic update alone".to_owned(),
            one_or_each(&haptic),
            errors(&haptic),
            cost,
        ]
    }));
    if stability.is_some_and(Stability::is_default_stable) {
        rows.push(["step of the face", "lie", "stable in every run", ""].map(str::to_owned));
    }
    let fails = failures(scans, stability);
    if !fails.is_empty() {
        rows.push(["not for", &fails, "measured below", ""].map(str::to_owned));
    }
    Some(
        Table::of("verdict", "What to take", &rows)
            .column("question", |[question, ..]| question.as_str())
            .column("use this", |[_, answer, ..]| answer.as_str())
            .column("because", |[.., reason, _]| reason.as_str())
            .column("cost", |[.., cost]| cost.as_str())
            .caption("Of the parts that were measured here."),
    )
}

fn failures(scans: &WholeScan, stability: Option<&Stability>) -> String {
    let quality = stability.and_then(Stability::default_stable_from_quality);
    let narrow = quality.filter(|quality| *quality > 0.0).map(|quality| {
        format!(
            "triangles narrower than {} of their length",
            three_digits(quality)
        )
    });
    let is_worse = |scan: &&ScanResult| {
        scan.of(RefineMethod::Patch)
            .is_some_and(|patch| !patch.is_sound())
    };
    let worse = scans.cases.iter().flat_map(|case| {
        case.scans.iter().filter(is_worse).map(|scan| {
            let (name, mm) = (&case.name, three_digits(scan.edge_mm));
            format!("{name} in edges of {mm} mm, where the patch made it worse")
        })
    });
    narrow.into_iter().chain(worse).join("; ")
}

fn slowest_us(choices: &[MethodChoice<'_>]) -> Option<f64> {
    let times = choices
        .iter()
        .map(|choice| choice.result.per_sample_us.median);
    times.reduce(f64::max)
}

/// The method chosen on a part.
struct MethodChoice<'a> {
    part: &'a str,
    result: &'a MethodResult,
    /// mean error of the scan, mm
    before_mm: f64,
}

/// The chosen method of each part, if any.
fn by_part<'a>(
    scans: &'a WholeScan,
    result: impl Fn(&'a ScanResult) -> Option<&'a MethodResult>,
) -> Vec<MethodChoice<'a>> {
    let choice = |case: &'a CaseResult| {
        let scan = case.main()?;
        Some(MethodChoice {
            part: &case.name,
            result: result(scan)?,
            before_mm: scan.before.mean_mm(),
        })
    };
    scans.cases.iter().filter_map(choice).collect()
}

/// The method, if it is the same on every part, else each with its part.
fn one_or_each(choices: &[MethodChoice<'_>]) -> String {
    match choices {
        [first, ..]
            if choices
                .iter()
                .map(|choice| choice.result.method)
                .all_equal() =>
        {
            first.result.name.clone()
        }
        _ => {
            let each = choices.iter();
            each.map(|choice| format!("{} on {}", choice.result.name, choice.part))
                .join("; ")
        }
    }
}

fn errors(choices: &[MethodChoice<'_>]) -> String {
    let errors = choices.iter().map(|choice| {
        let [now, before] = [choice.result.mean_mm(), choice.before_mm].map(three_digits);
        format!("{}: {before} mm off before, {now} mm after", choice.part)
    });
    errors.into_iter().join("; ")
}

/// The best method and region on each part, and the methods that failed there.
pub fn of_whole_scans(measured: &WholeScan) -> Vec<String> {
    measured.cases.iter().filter_map(of_case).collect()
}

fn of_case(case: &CaseResult) -> Option<String> {
    let scan = case.main()?;
    let describe = |result: &MethodResult| {
        let [mm, us] = [result.mean_mm(), result.per_sample_us.median].map(three_digits);
        format!("{} ({mm} mm, {us} µs per sample)", result.name)
    };
    let best = scan
        .best()
        .map_or("no method reduced the error".to_owned(), |best| {
            format!("take {}", describe(best))
        });
    let mut text = format!(
        "On {}, scanned {} mm off in the mean, {best}.",
        case.name,
        three_digits(scan.before.mean_mm())
    );
    if let Some(haptic) = scan.best_haptic().map(describe) {
        text += &format!(" Of the regions of the haptic update alone take {haptic}.");
    }
    let failed = scan.methods.iter().filter(|result| !result.is_sound());
    let failed = failed.map(|result| &result.name).join("; ");
    if !failed.is_empty() {
        text += &format!(" Fails here (worse than the scan, or not at the end in time): {failed}.");
    }
    if let Some(patch) = scan
        .of(RefineMethod::Patch)
        .filter(|_| case.duration_s > 0.0)
    {
        let rate = case.samples as f64 / case.duration_s;
        let percent = 100.0 * rate * patch.per_sample_us.median * 1e-6;
        let [rate, percent] = [rate, percent].map(three_digits);
        text += &format!(" At {rate} samples per second the patch takes {percent} % of one core.");
    }
    Some(text)
}

/// Counts of blow-ups under repeated sweeps, by rule.
pub fn of_convergence(measured: &Convergence) -> Vec<String> {
    let counts = [Rule::Paper, Rule::Robust].map(|rule| {
        let blown_up = measured.of(rule).filter(|run| run.has_blown_up).count();
        (measured.of(rule).count(), blown_up)
    });
    let [(paper, paper_up), (robust, robust_up)] = counts;
    vec![format!(
        "Swept over and over, the published rule blew up on {paper_up} of {paper} scans, the robust mode on {robust_up} of {robust}."
    )]
}

/// Stated uncertainties that do not hold.
pub fn of_coverage(measured: &Coverage) -> Vec<String> {
    let outside = measured.outside();
    let judged = measured
        .kinds
        .iter()
        .filter(|of| of.holds().is_some())
        .count();
    let contradicted: usize = measured.kinds.iter().map(|of| of.bounds()[1]).sum();
    let well = judged - outside.len();
    let outside = match outside.join("; ") {
        names if names.is_empty() => ".".to_owned(),
        names => format!("; OUTSIDE: {names}."),
    };
    vec![format!(
        "Coverage: {well} of {judged} kinds in their worlds are stated as well as is demanded{outside} Lower bounds that \
         the truth contradicts: {contradicted}."
    )]
}

/// Whether wrong input is named, and sound input is left alone.
pub fn of_mistakes(measured: &Mistakes) -> Vec<String> {
    let [made, sound] = measured.counts();
    let is_enough = made.right as f64 >= LEAST_NAMED * made.all as f64;
    vec![format!(
        "Mistakes: the cause of {} of {} wrong recordings is named, {} the {:.0} % demanded; {} alarms on {} sound ones.",
        made.right,
        made.all,
        if is_enough { "within" } else { "OUTSIDE" },
        100.0 * LEAST_NAMED,
        sound.all - sound.right,
        sound.all,
    )]
}

/// Recommended step, and its failures.
pub fn of_stability(measured: &Stability) -> Vec<String> {
    let share = |integrator: &Integrator| {
        let shares = measured
            .faces
            .iter()
            .find(|shares| shares.integrator == *integrator)?;
        let stable = three_digits(100.0 * shares.endings.stable_share());
        Some(format!(
            "{integrator} {stable} % of {}",
            shares.endings.runs()
        ))
    };
    let others = Integrator::ALL
        .iter()
        .filter(|integrator| **integrator != Integrator::Lie);
    let stable = [Integrator::Lie]
        .iter()
        .chain(others)
        .filter_map(share)
        .join(", ");
    let verdict = match measured.is_default_stable() {
        true => "was stable in every run",
        false => "was NOT stable in every run",
    };
    let error = three_digits(measured.largest_sub_flow_error());
    let fails = measured.default_stable_from_quality().map_or_else(
        || "On bad triangles it fails: presses were at fault at every quality that was tried.".to_owned(),
        |quality| {
            format!(
                "It fails on bad triangles: below an altitude of {} of the longest side, some updates are cut back or overshoot.",
                three_digits(quality)
            )
        },
    );
    vec![format!(
        "Step: lie, the default, {verdict} over twelve decades of every parameter; stable were {stable}. Its exact sub-flows \
         are within {error} of their scale. {fails}"
    )]
}

/// Whether extremes are handled correctly.
pub fn of_extremes(measured: &Extremes) -> Vec<String> {
    let wrong = measured.wrong().map(|extreme| &extreme.fed).join("; ");
    vec![match &*wrong {
        "" => "Every extreme that was fed came out right.".to_owned(),
        wrong => format!("Extremes that came out WRONG: {wrong}."),
    }]
}

/// The sensor rate that one core keeps up with.
pub fn of_cost(measured: &Cost) -> Vec<String> {
    let of_largest = |RecordingCost {
                          faces, edge, push, ..
                      }: &RecordingCost| {
        let (median, p999) = (push.median as f64, push.p999 as f64);
        let [us, p999, percent, edge_mm] =
            [median * 1e-3, p999 * 1e-3, median * 1e-4, edge * 1e3].map(three_digits);
        let replay = measured
            .slowest_replay_per_s()
            .map_or(String::new(), |speed| {
                format!(
                    " A recording is replayed with at least {} samples per second.",
                    three_digits(speed)
                )
            });
        format!(
            "Rate: on {faces} faces with edges of {edge_mm} mm one push of the default scene, its patch made at the end, takes {us} µs \
             (p99.9 {p999} µs); at 1 kHz that is {percent} % of one core.{replay}"
        )
    };
    measured
        .by_faces
        .last()
        .map(of_largest)
        .into_iter()
        .collect()
}

/// Comparison with libraries in common use.
pub fn of_peers(measured: &Peers) -> Vec<String> {
    let at_size = |size: &PeersAtSize| {
        let [pipeline, query] = [size.pipeline_factor()?, size.query_factor()?].map(three_digits);
        Some(format!(
            "at {} faces a push is {pipeline} times faster than the fastest pipeline with an exact index, and {query} times as \
             fast as the fastest closest-face query alone",
            size.faces
        ))
    };
    let ratios = measured.sizes.iter().filter_map(at_size).join("; ");
    let promise = match measured.holds() {
        true => "Both promises hold",
        false => "A promise is MISSED",
    };
    vec![format!(
        "Against libraries from PyPI: {ratios}. {promise}: 100 times, and faster than a query."
    )]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TableCell;
    use crate::whole_scan::{Reach, TouchedError};

    fn result(
        method: RefineMethod,
        name: &str,
        mean_mm: f64,
        per_sample_us: f64,
        is_worse: bool,
    ) -> MethodResult {
        let error = TouchedError {
            part_to_mesh_mean_mm: mean_mm,
            part_to_mesh_p95_mm: mean_mm,
            mesh_to_part_mean_mm: mean_mm,
            mesh_to_part_p95_mm: mean_mm,
            normal_mean_deg: 1.0,
            normal_p95_deg: 1.0,
        };
        MethodResult {
            method,
            name: name.to_owned(),
            error: Some(error),
            total_s: 1.0.into(),
            per_sample_us: per_sample_us.into(),
            end_ms: 0.0.into(),
            runs: 1,
            samples: 1000,
            cut_back_share: 0.0,
            is_worse,
            is_stopped: false,
            remarks: vec![],
        }
    }

    fn case(name: &str, scans: Vec<Vec<MethodResult>>) -> CaseResult {
        let before = TouchedError {
            part_to_mesh_mean_mm: 1.0,
            ..result(RefineMethod::Patch, "", 1.0, 1.0, false)
                .error
                .unwrap()
        };
        let scans = scans.into_iter().zip([3.0, 1.5]);
        let scans = scans
            .map(|(methods, edge_mm)| ScanResult {
                edge_mm,
                faces: 100,
                before,
                methods,
            })
            .collect();
        CaseResult {
            name: name.to_owned(),
            samples: 1000,
            duration_s: 1.0,
            scans,
            gaussian: None,
        }
    }

    /// Each row in one line.
    fn of(cases: Vec<CaseResult>) -> Option<Vec<String>> {
        let table = advice(
            &WholeScan {
                cases,
                repeats: 1,
                slow_s: 1.0,
            },
            None,
            None,
        )?;
        let text = |cell: &TableCell| match cell {
            TableCell::Text(text) => text.clone(),
            other => panic!("{other:?}"),
        };
        Some(
            table
                .rows
                .iter()
                .map(|row| row.iter().map(text).collect::<Vec<_>>().join(" | "))
                .collect(),
        )
    }

    #[test]
    fn what_is_best_everywhere_is_named_once_and_what_fails_is_listed() {
        let good = |us| result(RefineMethod::Patch, "patch", 0.01, us, false);
        let rows = of(vec![
            case(
                "peaks",
                vec![
                    vec![good(40.0)],
                    vec![result(RefineMethod::Patch, "patch", 2.0, 50.0, true)],
                ],
            ),
            case(
                "plate",
                vec![vec![
                    good(50.0),
                    result(
                        RefineMethod::Robust(Reach::TipRadii(2.0)),
                        "two radii",
                        0.3,
                        10.0,
                        false,
                    ),
                ]],
            ),
        ]);
        // the slower of the two: 50 µs are a twentieth of a millisecond
        let expected = [
            "method and region | patch | peaks: 1 mm off before, 0.01 mm after; plate: 1 mm off before, 0.01 mm after | up to 50 µs per \
             sample: at 1 kHz 5 % of one core, which keeps up with 20000 samples per second",
            "haptic update alone | two radii | plate: 1 mm off before, 0.3 mm after | up to 10 µs per sample",
            "not for | peaks in edges of 1.5 mm, where the patch made it worse | measured below | ",
        ];
        assert_eq!(rows.unwrap(), expected);
    }

    #[test]
    fn where_the_parts_differ_each_is_named_and_without_anything_good_nothing_is_said() {
        let patch = || result(RefineMethod::Patch, "patch", 0.01, 40.0, false);
        let paper = || {
            result(
                RefineMethod::Robust(Reach::TipRadii(1.0)),
                "one radius",
                0.005,
                8.0,
                false,
            )
        };
        let rows = of(vec![
            case("peaks", vec![vec![patch()]]),
            case("plate", vec![vec![patch(), paper()]]),
        ])
        .unwrap();
        assert!(
            rows[0].starts_with("method and region | patch on peaks; one radius on plate | "),
            "{rows:?}"
        );
        assert!(
            !rows.iter().any(|row| row.starts_with("not for")),
            "{rows:?}"
        );
        assert_eq!(
            of(vec![case(
                "peaks",
                vec![vec![result(RefineMethod::Patch, "patch", 3.0, 1.0, true)]]
            )]),
            None
        );
    }
}
