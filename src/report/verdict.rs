//! What a practitioner asks, answered by what was measured: which mode, step and region, at which rate, what it costs, and where
//! it fails.

use super::cost::Cost;
use super::whole_scan::{CaseResult, Way, WayResult};
use super::{Convergence, Extremes, Integrator, Peers, Rule, Stability, WholeScan, three_digits};

/// Which way, and which region, on each part; and what failed there.
pub fn of_whole_scans(measured: &WholeScan) -> Vec<String> {
    measured.cases.iter().filter_map(of_case).collect()
}

fn of_case(case: &CaseResult) -> Option<String> {
    let scan = case.main()?;
    let told = |result: &WayResult| {
        format!(
            "{} ({} mm, {} µs per sample)",
            result.name,
            three_digits(result.mean_mm()),
            three_digits(result.per_sample_us.median)
        )
    };
    let mut text = format!("On {}, scanned {} mm off in the mean, ", case.name, three_digits(scan.before.mean_mm()));
    match scan.best() {
        Some(best) => text += &format!("take {}.", told(best)),
        None => text += "no way made the scan better.",
    }
    if let Some(haptic) = scan.best_haptic() {
        text += &format!(" Of the regions of the haptic update alone take {}.", told(haptic));
    }
    let failed: Vec<&str> = scan.ways.iter().filter(|way| !way.is_sound()).map(|way| way.name.as_str()).collect();
    if !failed.is_empty() {
        text += &format!(" Fails here (worse than the scan, or not at the end in time): {}.", failed.join("; "));
    }
    if let (Some(patch), true) = (scan.of(Way::Patch), case.duration_s > 0.0) {
        let rate = case.samples as f64 / case.duration_s;
        text += &format!(
            " At {} samples per second the patch takes {} % of one core.",
            three_digits(rate),
            three_digits(100.0 * rate * patch.per_sample_us.median * 1e-6)
        );
    }
    Some(text)
}

/// How many sweeps it takes, and how often the published rule blows up.
pub fn of_convergence(measured: &Convergence) -> Vec<String> {
    let of = |rule| {
        let runs: Vec<_> = measured.of(rule).collect();
        let blown_up = runs.iter().filter(|run| run.has_blown_up).count();
        (runs.len(), blown_up)
    };
    let ((paper, paper_up), (robust, robust_up)) = (of(Rule::Paper), of(Rule::Robust));
    vec![format!(
        "Swept over and over, the published rule blew up on {paper_up} of {paper} scans, the robust mode on {robust_up} of {robust}."
    )]
}

/// Which step to take, and where even that fails.
pub fn of_stability(measured: &Stability) -> Vec<String> {
    let share = |integrator| {
        let shares = measured.faces.iter().find(|shares| shares.integrator == integrator)?;
        Some(format!("{} {} % of {}", integrator.name(), three_digits(100.0 * shares.stable_share), shares.runs))
    };
    let others = Integrator::ALL.into_iter().filter(|&integrator| integrator != Integrator::Lie).filter_map(share);
    let mut text = format!(
        "Step: lie, the default, {} over twelve decades of every parameter; stable were {}. Its exact sub-flows are within {} of \
         their scale.",
        if measured.is_default_stable() { "was stable in every run" } else { "was NOT stable in every run" },
        share(Integrator::Lie).into_iter().chain(others).collect::<Vec<_>>().join(", "),
        three_digits(measured.largest_sub_flow_error())
    );
    text += &match measured.default_stable_from_quality() {
        Some(quality) => format!(
            " It fails on bad triangles: below an altitude of {} of the longest side, some updates are cut back or overshoot.",
            three_digits(quality)
        ),
        None => " On bad triangles it fails: presses were at fault at every quality that was tried.".to_owned(),
    };
    vec![text]
}

/// Whether what should not happen is met as it should be.
pub fn of_extremes(measured: &Extremes) -> Vec<String> {
    let wrong: Vec<&str> = measured.wrong().map(|extreme| extreme.fed.as_str()).collect();
    vec![match wrong.as_slice() {
        [] => "Every extreme that was fed came out right.".to_owned(),
        wrong => format!("Extremes that came out WRONG: {}.", wrong.join("; ")),
    }]
}

/// The sensor rate that one core keeps up with.
pub fn of_cost(measured: &Cost) -> Vec<String> {
    let Some(size) = measured.sizes.last() else { return Vec::new() };
    let push = size.default_larger.time_ns;
    let mut text = format!(
        "Rate: on {} faces one push of the default scene, its patch aside, takes {} µs (p90 {} µs); at 1 kHz that is {} % of one \
         core.",
        size.faces,
        three_digits(push.median * 1e-3),
        three_digits(push.p90 * 1e-3),
        three_digits(push.median * 1e-4)
    );
    if let Some(speed) = measured.slowest_replay_per_s() {
        text += &format!(" A recording is replayed with at least {} samples per second.", three_digits(speed));
    }
    vec![text]
}

/// How it stands against the libraries that others would use.
pub fn of_peers(measured: &Peers) -> Vec<String> {
    let at_size = |size: &super::peers::PeersAtSize| {
        Some(format!(
            "at {} faces a push is {} times faster than the fastest pipeline with an exact index, and {} times as fast as the \
             fastest closest-face query alone",
            size.faces,
            three_digits(size.pipeline_factor()?),
            three_digits(size.query_factor()?)
        ))
    };
    let told: Vec<String> = measured.sizes.iter().filter_map(at_size).collect();
    let promise = if measured.holds() { "Both promises hold" } else { "A promise is MISSED" };
    vec![format!("Against peers: {}. {promise}: 100 times, and faster than a query.", told.join("; "))]
}
