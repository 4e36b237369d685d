//! The practitioner's questions, answered by the measurements: which mode, step and region, at
//! which rate, what it costs, and where it fails.

use super::convergence::{Convergence, Rule};
use super::cost::{Cost, RecordingCost};
use super::coverage::Coverage;
use super::extremes::Extremes;
use super::mistakes::{LEAST_NAMED, Mistakes};
use super::peers::{Peers, PeersAtSize};
use super::stability::{Integrator, Stability};
use super::whole_scan::{CaseResult, MethodResult, RefineMethod, ScanResult, WholeScan};
use crate::{Table, TableCell};
use touchup_page::number::three_digits;

/// Method and region, step, rate and limits, each with its reason and its cost; `None` where no
/// method made any scan better.
#[expect(clippy::too_many_lines)]
pub fn advice(
    scans: &WholeScan,
    stability: Option<&Stability>,
    cost: Option<&Cost>,
) -> Option<Table> {
    let best = by_part(scans, ScanResult::best);
    let slowest_us = best
        .iter()
        .map(|choice| choice.result.per_sample_us.median)
        .reduce(f64::max)?;
    let [us, percent, rate] = [slowest_us, 0.1 * slowest_us, 1e6 / slowest_us].map(three_digits);
    let mut answer = format!(
        "up to {us} µs per sample: at 1 kHz {percent} % of one core, which keeps up with {rate} samples per second"
    );
    if let Some(recording) = cost.and_then(|cost| cost.by_faces.last()) {
        let answer_us = recording.push.median as f64 * 1e-3;
        answer += &format!(
            "; the haptic update answers in {} µs, the patch follows",
            three_digits(answer_us)
        );
    }
    let mut rows = vec![[
        "method and region".to_owned(),
        one_or_each(&best),
        errors(&best),
        answer,
    ]];
    let haptic = by_part(scans, ScanResult::best_haptic);
    if let Some(us) = haptic
        .iter()
        .map(|choice| choice.result.per_sample_us.median)
        .reduce(f64::max)
    {
        let cost = format!("up to {} µs per sample", three_digits(us));
        rows.push([
            "haptic update alone".to_owned(),
            one_or_each(&haptic),
            errors(&haptic),
            cost,
        ]);
    }
    if stability.is_some_and(Stability::is_default_stable) {
        rows.push(["step of the face", "lie", "stable in every run", ""].map(str::to_owned));
    }
    let mut fails = Vec::new();
    if let Some(quality) = stability
        .and_then(Stability::default_stable_from_quality)
        .filter(|quality| *quality > 0.0)
    {
        fails.push(format!(
            "triangles narrower than {} of their length",
            three_digits(quality)
        ));
    }
    let of_patch = |scan: &ScanResult| {
        scan.of(RefineMethod::Patch)
            .is_some_and(|patch| !patch.is_sound())
    };
    for case in &scans.cases {
        fails.extend(case.scans.iter().filter(|scan| of_patch(scan)).map(|scan| {
            format!(
                "{} in edges of {} mm, where the patch made it worse",
                case.name,
                three_digits(scan.edge_mm)
            )
        }));
    }
    if !fails.is_empty() {
        rows.push([
            "not for".to_owned(),
            fails.join("; "),
            "measured below".to_owned(),
            String::new(),
        ]);
    }
    Some(Table {
        id: "verdict".to_owned(),
        title: "What to take".to_owned(),
        caption: "Of the parts that were measured here.".to_owned(),
        heads: ["question", "use this", "because", "cost"]
            .map(str::to_owned)
            .to_vec(),
        rows: rows
            .into_iter()
            .map(|row| row.map(TableCell::Text).to_vec())
            .collect(),
    })
}

/// The method chosen on a part.
struct MethodChoice<'a> {
    part: &'a str,
    result: &'a MethodResult,
    /// mean error of the scan, mm
    before_mm: f64,
}

/// The method on each part where there is one.
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

/// The method, where it is the same on every part, else each with its part.
fn one_or_each(choices: &[MethodChoice<'_>]) -> String {
    match choices {
        [first, others @ ..]
            if others
                .iter()
                .all(|choice| choice.result.method == first.result.method) =>
        {
            first.result.name.clone()
        }
        _ => join(choices, |choice| {
            format!("{} on {}", choice.result.name, choice.part)
        }),
    }
}

fn errors(choices: &[MethodChoice<'_>]) -> String {
    let error = |choice: &MethodChoice<'_>| {
        let [now, before] = [choice.result.mean_mm(), choice.before_mm].map(three_digits);
        format!("{}: {before} mm off before, {now} mm after", choice.part)
    };
    join(choices, error)
}

fn join(choices: &[MethodChoice<'_>], text: impl Fn(&MethodChoice<'_>) -> String) -> String {
    choices.iter().map(text).collect::<Vec<_>>().join("; ")
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
    let haptic = scan.best_haptic().map(describe);
    let failed = scan
        .methods
        .iter()
        .filter(|result| !result.is_sound())
        .map(|result| result.name.as_str());
    let failed = Some(failed.collect::<Vec<_>>().join("; ")).filter(|failed| !failed.is_empty());
    let patch = scan
        .of(RefineMethod::Patch)
        .filter(|_| case.duration_s > 0.0)
        .map(|patch| {
            let rate = case.samples as f64 / case.duration_s;
            let [rate, percent] =
                [rate, 100.0 * rate * patch.per_sample_us.median * 1e-6].map(three_digits);
            format!(" At {rate} samples per second the patch takes {percent} % of one core.")
        });
    let texts = [
        Some(format!(
            "On {}, scanned {} mm off in the mean, {best}.",
            case.name,
            three_digits(scan.before.mean_mm())
        )),
        haptic.map(|haptic| format!(" Of the regions of the haptic update alone take {haptic}.")),
        failed.map(|failed| {
            format!(" Fails here (worse than the scan, or not at the end in time): {failed}.")
        }),
        patch,
    ];
    Some(texts.into_iter().flatten().collect())
}

/// How many sweeps it takes, and how often the published rule blows up.
pub fn of_convergence(measured: &Convergence) -> Vec<String> {
    let [(paper, paper_up), (robust, robust_up)] = [Rule::Paper, Rule::Robust].map(|rule| {
        (
            measured.of(rule).count(),
            measured.of(rule).filter(|run| run.has_blown_up).count(),
        )
    });
    vec![format!(
        "Swept over and over, the published rule blew up on {paper_up} of {paper} scans, the robust mode on {robust_up} of {robust}."
    )]
}

/// Which stated uncertainties do not hold.
pub fn of_coverage(measured: &Coverage) -> Vec<String> {
    let outside = measured.outside();
    let judged = measured
        .kinds
        .iter()
        .filter(|of| of.holds().is_some())
        .count();
    let contradicted: usize = measured.kinds.iter().map(|of| of.bounds()[1]).sum();
    let mut text = format!(
        "Coverage: {} of {judged} kinds in their worlds are stated as well as is demanded",
        judged - outside.len()
    );
    text += &if outside.is_empty() {
        ".".to_owned()
    } else {
        format!("; OUTSIDE: {}.", outside.join("; "))
    };
    text += &format!(" Lower bounds that the truth contradicts: {contradicted}.");
    vec![text]
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

/// Which step to take, and where even that fails.
pub fn of_stability(measured: &Stability) -> Vec<String> {
    let share = |integrator| {
        let shares = measured
            .faces
            .iter()
            .find(|shares| shares.integrator == integrator)?;
        let stable = three_digits(100.0 * shares.endings.stable_share());
        Some(format!(
            "{integrator} {stable} % of {}",
            shares.endings.runs()
        ))
    };
    let others = Integrator::ALL
        .into_iter()
        .filter(|&integrator| integrator != Integrator::Lie)
        .filter_map(share);
    let mut text = format!(
        "Step: lie, the default, {} over twelve decades of every parameter; stable were {}. Its exact sub-flows are within {} of \
         their scale.",
        if measured.is_default_stable() {
            "was stable in every run"
        } else {
            "was NOT stable in every run"
        },
        share(Integrator::Lie)
            .into_iter()
            .chain(others)
            .collect::<Vec<_>>()
            .join(", "),
        three_digits(measured.largest_sub_flow_error())
    );
    text += &match measured.default_stable_from_quality() {
        Some(quality) => format!(
            " It fails on bad triangles: below an altitude of {} of the longest side, some updates are cut back or overshoot.",
            three_digits(quality)
        ),
        None => {
            " On bad triangles it fails: presses were at fault at every quality that was tried."
                .to_owned()
        }
    };
    vec![text]
}

/// Whether what should not happen is met as it should be.
pub fn of_extremes(measured: &Extremes) -> Vec<String> {
    let wrong: Vec<&str> = measured
        .wrong()
        .map(|extreme| extreme.fed.as_str())
        .collect();
    vec![match wrong.as_slice() {
        [] => "Every extreme that was fed came out right.".to_owned(),
        wrong => format!("Extremes that came out WRONG: {}.", wrong.join("; ")),
    }]
}

/// The sensor rate that one core keeps up with.
pub fn of_cost(measured: &Cost) -> Vec<String> {
    let Some(RecordingCost {
        faces, edge, push, ..
    }) = measured.by_faces.last()
    else {
        return Vec::new();
    };
    let [us, p999, percent] = [
        push.median as f64 * 1e-3,
        push.p999 as f64 * 1e-3,
        push.median as f64 * 1e-4,
    ];
    let [us, p999, percent, edge_mm] = [us, p999, percent, edge * 1e3].map(three_digits);
    let mut text = format!(
        "Rate: on {faces} faces with edges of {edge_mm} mm one push of the default scene, its patch made at the end, takes {us} µs \
         (p99.9 {p999} µs); at 1 kHz that is {percent} % of one core."
    );
    if let Some(speed) = measured.slowest_replay_per_s() {
        text += &format!(
            " A recording is replayed with at least {} samples per second.",
            three_digits(speed)
        );
    }
    vec![text]
}

/// Comparison with the libraries that others would use.
pub fn of_peers(measured: &Peers) -> Vec<String> {
    let at_size = |size: &PeersAtSize| {
        let [pipeline, query] = [size.pipeline_factor()?, size.query_factor()?].map(three_digits);
        Some(format!(
            "at {} faces a push is {pipeline} times faster than the fastest pipeline with an exact index, and {query} times as \
             fast as the fastest closest-face query alone",
            size.faces
        ))
    };
    let ratios: Vec<String> = measured.sizes.iter().filter_map(at_size).collect();
    let promise = if measured.holds() {
        "Both promises hold"
    } else {
        "A promise is MISSED"
    };
    vec![format!(
        "Against libraries from PyPI: {}. {promise}: 100 times, and faster than a query.",
        ratios.join("; ")
    )]
}

#[cfg(test)]
mod tests {
    use super::*;
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
