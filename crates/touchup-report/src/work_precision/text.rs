//! The results as a chapter, with its text.

use super::{FaceCase, IntegratorRun, Method, PAPER_H_MIN_M, TILTS_DEG, WorkPrecision};
use crate::{Axis, Chapter, Figure, Mark, Series, Spread, Table};
use itertools::Itertools;
use touchup_document::number::{range, three_digits};

/// Requested accuracy, m: the resolution of a sensor, a thousandth of that, and nearly exact.
const LEVELS_M: [(f64, &str); 3] = [(1e-6, "1 µm"), (1e-9, "1 nm"), (1e-12, "1 pm")];
/// Stiffnesses with figures of their own.
const SHOWN_H_MINS_M: [f64; 2] = [PAPER_H_MIN_M, 1e-9];
/// Methods that can do a whole sample in one step.
const EXACT: [Method; 2] = [Method::Lie, Method::DriftCorrected];

impl WorkPrecision {
    /// Chapter 1 of the report.
    pub fn chapter(&self) -> Chapter {
        let is_shown = |case: &&FaceCase| SHOWN_H_MINS_M.contains(&case.h_min_m);
        let shown = self.cases.iter().filter(is_shown);
        let figures = shown.flat_map(|case| self.error_figures(case));
        let figures = figures.chain(TILTS_DEG.map(|tilt| self.stiffness_figure(tilt)));
        let tables = vec![self.ranking_table(), self.one_step_table()];
        Chapter::of(
            "Work-precision of one face",
            self.text(),
            figures.collect(),
            tables,
        )
    }

    /// Conclusion for a practitioner.
    pub fn verdict(&self) -> Vec<String> {
        let steps = EXACT
            .iter()
            .filter_map(|method| self.worst_step(*method))
            .join(" ");
        vec![format!(
            "Integrator. {steps} {}",
            self.wins_and_losses(LEVELS_M[0])
        )]
    }

    fn text(&self) -> Vec<String> {
        let setting = format!(
            "One face is held against one sample: 2 N for 5 ms, the tip 0.5 mm above the plane of the face and 0.5 mm beside \
             its barycentre, with the paper's α, β and δ and f_max 10 N. The smaller h_min, the stiffer the equations. The \
             error is the distance of the barycentre at the end from a reference of another kind (collocation of order 13 in \
             numbers of 32 digits, in the plane of normal and force, halved until it agrees with itself to {}). A time is that of the whole sample, \
             the median of {} repeats of many solves. One Jacobian counts as four evaluations, one flow that is solved \
             exactly as one.",
            three_digits(1e-17),
            self.repeats
        );
        let solvers = "The implicit solver is RODAS 4(3), L-stable, written for this report: the crate diffsol would bring a \
                       hundred more crates along for four unknowns. Every integrator gets the same right-hand side and the \
                       same compiler.";
        let missing = self.without_reference.iter();
        let missing =
            missing.map(|name| format!("No reference was found for {name}: not measured."));
        [setting, solvers.to_owned()]
            .into_iter()
            .chain(EXACT.iter().filter_map(|method| self.worst_step(*method)))
            .chain(LEVELS_M.map(|level| self.wins_and_losses(level)))
            .chain(self.explicit_limits())
            .chain(self.flow_cost())
            .chain(missing)
            .collect()
    }

    /// Time and largest error of a single step over all cases, with and without tilt.
    fn worst_step(&self, method: Method) -> Option<String> {
        let step = |case| Some((case, *FaceCase::curve(case, method)?.one_step()?));
        let steps = self.cases.iter().filter_map(step).collect_vec();
        let slowest = steps.iter().map(|(_, run)| run.time_s);
        let slowest = time(slowest.max_by(|a, b| a.median.total_cmp(&b.median))?);
        let [straight, tilted] = TILTS_DEG.map(|tilt| {
            let tilted = steps.iter().filter(|(case, _)| case.tilt_deg == tilt);
            tilted.max_by(|a, b| a.1.error_m.total_cmp(&b.1.error_m))
        });
        let ((straight_case, straight), (case, tilted)) = (straight?, tilted?);
        let without_friction = if straight.error_m <= straight_case.floor_m {
            "is as exact as the reference can resolve, whatever h_min".to_owned()
        } else {
            format!("is off by at most {}", length(straight.error_m))
        };
        let (name, tilt) = (method.name(), TILTS_DEG[1]);
        let [most, h_min] = [tilted.error_m, case.h_min_m].map(length);
        Some(format!(
            "One step \"{name}\" over the whole sample takes at most {slowest}; without friction it {without_friction}; \
             with the force tilted by {tilt}° it is off by at most {most} (at h_min {h_min})."
        ))
    }

    /// The fastest integrator for an error: wins of an exact step, and the factor of its losses.
    fn wins_and_losses(&self, (error_m, name): (f64, &str)) -> String {
        let outcomes = self
            .cases
            .iter()
            .map(|case| FastestSolvers::of(case, error_m));
        let (won, others): (Vec<_>, Vec<_>) = outcomes.partition(FastestSolvers::is_won);
        let (won_count, all) = (won.len(), self.cases.len());
        let (lost, unreached): (Vec<_>, Vec<_>) = others
            .into_iter()
            .partition(|outcome| outcome.other.is_some());
        let faster = range(won.iter().filter_map(FastestSolvers::factor));
        let faster = faster.map_or(String::new(), |(least, most)| {
            let ([least, most], h_mins) = ([least, most].map(three_digits), h_mins(&won));
            format!(", {least} to {most} times as fast as the best solver ({h_mins})")
        });
        let alone = won.iter().filter(|outcome| outcome.other.is_none()).count();
        let alone = where_any(alone, |alone| {
            format!("; in {alone} of them nothing else gets there")
        });
        let names = lost
            .iter()
            .filter_map(|outcome| Some(outcome.other?.0.name()));
        let names = names.sorted_unstable().dedup().join(" or ");
        let slower = range(
            lost.iter()
                .filter_map(|outcome| Some(1.0 / outcome.factor()?)),
        );
        let slower = slower.map_or(String::new(), |(_, most)| {
            format!(", by at most {} times", three_digits(most))
        });
        let never = lost
            .iter()
            .filter(|outcome| outcome.exact.is_none())
            .count();
        let never = where_any(never, |never| {
            format!("; in {never} of them no exact step gets there")
        });
        let losses = where_any(lost.len(), |count| {
            format!(
                " In {count} it is not ({}): {names} wins{slower}{never}.",
                h_mins(&lost)
            )
        });
        let nothing = where_any(unreached.len(), |count| {
            format!(" In {count} nothing gets there.")
        });
        format!(
            "To be within {name}, an exact step is the fastest in {won_count} of {all} cases{faster}{alone}.{losses}{nothing}"
        )
    }

    /// Largest stiffness at which the explicit solvers are of use.
    fn explicit_limits(&self) -> Option<String> {
        let fastest = |method: Method, error_m: f64| {
            let reaches = |case: &FaceCase| case.curve(method)?.cheapest(error_m).map(|_| ());
            let failing = self.cases.iter().filter(|case| reaches(case).is_none());
            let failing = failing.map(|case| case.h_min_m).collect_vec();
            let (name, count) = (method.name(), failing.len());
            range(failing).map_or(format!("{name} gets there everywhere"), |(_, mildest)| {
                format!(
                    "{name} misses {count} cases, the mildest at h_min {}",
                    length(mildest)
                )
            })
        };
        let mut lines = LEVELS_M[..2].iter().map(|(error_m, name)| {
            let explicit = [Method::Euler, Method::RungeKutta, Method::DormandPrince];
            format!(
                "{name}: {}",
                explicit.map(|method| fastest(method, *error_m)).join(", ")
            )
        });
        let last = |case: &FaceCase| Some(case.curve(Method::Euler)?.points.last()?.evaluations);
        let steps = self.cases.iter().filter_map(last).max()?;
        Some(format!(
            "Explicit solvers, with up to {steps} steps a sample. Within {}. The expected force is bounded, so \
             steps that are too coarse do not run away: they rattle around the answer.",
            lines.join(". Within ")
        ))
    }

    /// Cost of a flow in evaluations.
    fn flow_cost(&self) -> Option<String> {
        let is_meant =
            |case: &&FaceCase| case.h_min_m == PAPER_H_MIN_M && case.tilt_deg == TILTS_DEG[1];
        let case = self.cases.iter().find(is_meant)?;
        let per_count = |method| {
            let last = case.curve(method)?.points.last()?;
            Some(last.time_s.times(1.0 / last.evaluations as f64))
        };
        let (flow, evaluation) = (per_count(Method::Lie)?, per_count(Method::RungeKutta)?);
        let ratio = flow.median / evaluation.median;
        let which = if ratio > 1.0 { "flatters" } else { "wrongs" };
        let (flow, evaluation, times) = (time(flow), time(evaluation), three_digits(ratio));
        Some(format!(
            "One exact flow with its rotation takes {flow}, one evaluation of the right-hand side within RK4 {evaluation}: {times} \
             times as much. By so much the picture over evaluations {which} the exact steps; the one over time does not."
        ))
    }

    /// Error over time, and over evaluations.
    fn error_figures(&self, case: &FaceCase) -> [Figure; 2] {
        let caption = format!(
            "Lower left is better. Bars: p10–p90 of {} repeats. Errors at the lower edge are as small as the reference can resolve.",
            self.repeats
        );
        let time = Axis::log("time for the sample, µs", "time_us");
        let counted = "The same runs by what is counted instead of timed: no spread, the counts repeat exactly.";
        let label = "evaluations of the right-hand side, or exact flows";
        let evaluations = Axis::log(label, "evaluations");
        let count = |point: &IntegratorRun| (point.evaluations as f64).into();
        [
            case.figure("time", &caption, time, |point| point.time_s.times(1e6)),
            case.figure("evaluations", counted, evaluations, count),
        ]
    }

    /// Time to the first level over h_min.
    fn stiffness_figure(&self, tilt_deg: f64) -> Figure {
        let (error_m, name) = LEVELS_M[0];
        let series = Method::ALL.map(|method| {
            let cases = self.cases.iter().filter(|case| case.tilt_deg == tilt_deg);
            let marks = cases.filter_map(|case| {
                let point = case.curve(method)?.cheapest(error_m)?;
                Some(Mark::at(1e3 * case.h_min_m, point.time_s.times(1e6)))
            });
            Series::joined(method.name(), marks)
        });
        let (id, force) = force(tilt_deg);
        Figure::curves(format!("work_precision_stiffness_{id}"), series)
            .title(format!("Time to be within {name}, {force}"))
            .axes(Axis::log("h_min, mm", "h_min_mm"), Axis::log("time for the sample, µs", "time_us"))
            .caption(format!(
                "The cheapest setting from which on every finer one is within {name} too; a curve ends where there is \
                 none among those tried. The paper's h_min is {} mm.",
                three_digits(1e3 * PAPER_H_MIN_M)
            ))
    }

    fn ranking_table(&self) -> Table {
        let at_levels =
            |case| LEVELS_M.map(|(error_m, name)| (case, name, FaceCase::ranking(case, error_m)));
        let rankings = self.cases.iter().flat_map(at_levels).collect_vec();
        let table = Table::of(
            "work_precision_fastest",
            "Fastest integrator for an error",
            &rankings,
        )
        .column("h_min, mm", |(case, ..)| 1e3 * case.h_min_m)
        .column("tilt, °", |(case, ..)| case.tilt_deg)
        .column("within", |(_, name, _)| *name)
        .column("fastest", |(.., ranking)| {
            ranking.first().map_or("none", |(method, _)| method.name())
        });
        let times = Method::ALL.into_iter().fold(table, |table, wanted| {
            table.column(format!("{}, µs", wanted.name()), |(.., ranking)| {
                let (_, point) = ranking.iter().find(|(method, _)| *method == wanted)?;
                Some(point.time_s.times(1e6))
            })
        });
        times.caption("Time for the sample; empty: not reached with any setting that was tried.")
    }

    fn one_step_table(&self) -> Table {
        let table = Table::of(
            "work_precision_one_step",
            "The whole sample in one exact step",
            &self.cases,
        )
        .column("h_min, mm", |case| 1e3 * case.h_min_m)
        .column("tilt, °", |case| case.tilt_deg)
        .column("travel, mm", |case| 1e3 * case.travel_m);
        let methods = ["Lie", "drift-corrected"].into_iter().zip(EXACT);
        let steps = methods.fold(table, |table, (name, method)| {
            let step = |case: &FaceCase| case.curve(method)?.one_step().copied();
            table
                .column(format!("{name}: error, mm"), |case| {
                    Some(1e3 * step(case)?.error_m)
                })
                .column(format!("{name}: normal, °"), |case| {
                    Some(step(case)?.normal_error.to_degrees())
                })
                .column(format!("{name}: time, µs"), |case| {
                    Some(step(case)?.time_s.times(1e6))
                })
        });
        steps.caption(
            "Travel: how far the face moves in the exact solution. Without tilt the one step is the exact solution.",
        )
    }
}

/// The fastest exact step and the fastest other solver that reach an error.
struct FastestSolvers {
    h_min_m: f64,
    exact: Option<(Method, IntegratorRun)>,
    other: Option<(Method, IntegratorRun)>,
}

impl FastestSolvers {
    fn of(case: &FaceCase, error_m: f64) -> Self {
        let ranking = case.ranking(error_m);
        let first = |is_exact| {
            let mut solvers = ranking.iter().copied();
            solvers.find(|(method, _)| method.is_exact() == is_exact)
        };
        Self {
            h_min_m: case.h_min_m,
            exact: first(true),
            other: first(false),
        }
    }

    /// Time of the other solver over time of the exact step; `None` if one of them fails.
    fn factor(&self) -> Option<f64> {
        Some(self.other?.1.time_s.median / self.exact?.1.time_s.median)
    }

    fn is_won(&self) -> bool {
        self.exact.is_some() && self.factor().is_none_or(|factor| factor >= 1.0)
    }
}

/// The text of a count, unless it is 0.
fn where_any(count: usize, text: impl Fn(usize) -> String) -> String {
    if count > 0 {
        text(count)
    } else {
        String::new()
    }
}

/// "h_min 1 nm to 1 µm".
fn h_mins(outcomes: &[FastestSolvers]) -> String {
    match range(outcomes.iter().map(|outcome| outcome.h_min_m)) {
        Some((low, high)) if low < high => format!("h_min {} to {}", length(low), length(high)),
        Some((low, _)) => format!("h_min {}", length(low)),
        None => String::new(),
    }
}

/// A length in the unit that leaves few zeros.
fn length(metres: f64) -> String {
    let units = [(1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"), (1e-12, "pm")];
    let fitting = units.into_iter().find(|(unit, _)| metres >= 0.1 * unit);
    let (unit, name) = fitting.unwrap_or(units[3]);
    format!("{} {name}", three_digits(metres / unit))
}

/// Median and ends, in the unit that leaves few zeros.
fn time(seconds: Spread) -> String {
    let is_short = seconds.median < 1e-7;
    let (unit, name) = if is_short {
        (1e-9, "ns")
    } else {
        (1e-6, "µs")
    };
    let [median, p10, p90] = seconds.numbers().map(|value| three_digits(value / unit));
    format!("{median} {name} ({p10}–{p90})")
}

impl FaceCase {
    fn figure(
        &self,
        over: &str,
        caption: &str,
        axis: Axis,
        x: fn(&IntegratorRun) -> Spread,
    ) -> Figure {
        let series = self.curves.iter().map(|curve| {
            let mark = |point: &IntegratorRun| Mark::at(x(point), 1e3 * point.error_m);
            Series::joined(curve.method.name(), curve.points.iter().map(mark))
        });
        let (id, force) = force(self.tilt_deg);
        let (nm, h_min) = ((self.h_min_m * 1e9).round(), length(self.h_min_m));
        Figure::curves(format!("work_precision_{over}_{nm}nm_{id}"), series)
            .title(format!(
                "Error at the end of one sample: h_min {h_min}, {force}"
            ))
            .axes(axis, Axis::log("error of the barycentre, mm", "error_mm"))
            .caption(format!("{caption}{}", self.gave_up()))
    }

    /// Integrators that gave up, and counts; empty if none did.
    fn gave_up(&self) -> String {
        let giving_up = self.curves.iter().filter(|curve| curve.gave_up > 0);
        let failures = giving_up.map(|curve| {
            let (name, gave_up) = (curve.method.name(), curve.gave_up);
            format!(
                "{name} gave up at {gave_up} of {} settings",
                gave_up + curve.points.len()
            )
        });
        let failures = failures.collect_vec();
        where_any(failures.len(), |_| format!(" {}.", failures.join("; ")))
    }
}

/// A force in the name of a file, and in words.
fn force(tilt_deg: f64) -> (&'static str, String) {
    if tilt_deg == 0.0 {
        ("straight", "no friction".to_owned())
    } else {
        (
            "tilted",
            format!("force tilted by {}°", three_digits(tilt_deg)),
        )
    }
}
