//! Results of whole scans, in words.

use super::figures::by_edge;
use super::{CaseResult, GaussianCost, MethodResult, Reach, RefineMethod, ScanResult, WholeScan};
use crate::Chapter;
use itertools::Itertools;

/// Differences below this share do not count.
const ALIKE: f64 = 0.02;

impl WholeScan {
    /// Chapter of the report.
    pub fn chapter(&self) -> Chapter {
        let mut text = vec![
            "Each method gets the same scan and the same samples, one thread. The surface error is measured where the part was \
             touched, from the part to the mesh and from the mesh to the part; the worse of the two counts. Two of the methods \
             are baselines of our own for what the paper names as alternatives: contact points alone pull the mesh through \
             the point under the ball, knowing of the force only that there is contact, and the Gaussian process is an exact \
             implicit surface over the scan that is refitted from nothing at each touch it keeps."
                .to_owned(),
        ];
        for case in &self.cases {
            text.extend(case.main().map(|scan| case.verdict(scan)));
            text.extend(case.main().and_then(failures));
            text.extend(case.densities());
            text.extend(case.gaussian.as_ref().map(|cost| case.gaussian_text(cost)));
        }
        Chapter::of(
            "Error against run time, whole scan",
            text,
            self.figures(),
            vec![self.table()],
        )
    }
}

/// Name, error and time of one method.
fn describe(result: &MethodResult) -> String {
    let normals = result.error.map_or_else(String::new, |error| {
        format!("normals {:.1} deg, ", error.normal_mean_deg)
    });
    let (mm, us) = (result.mean_mm(), result.per_sample_us.median);
    format!(
        "{} ({normals}{mm:.3} mm, {us:.2} µs per sample)",
        result.name
    )
}

impl CaseResult {
    /// The Pareto front over error and time.
    fn verdict(&self, scan: &ScanResult) -> String {
        let Self {
            name,
            samples,
            duration_s,
            ..
        } = self;
        let ScanResult {
            edge_mm,
            faces,
            before,
            ..
        } = scan;
        let [mean, p95, normals] = [before.mean_mm(), before.p95_mm(), before.normal_mean_deg];
        let mut text = format!(
            "{name}: {faces} faces with edges of {edge_mm:.1} mm, {samples} samples in {duration_s:.0} s of touching; the \
             unrefined scan is off by {mean:.3} mm (p95 {p95:.3} mm, normals {normals:.1} deg)."
        );
        text += &scan
            .best()
            .map_or(" No method reduced the error.".to_owned(), |best| {
                let (best, times) = (describe(best), mean / best.mean_mm());
                format!(" The least mean error has {best}: {times:.1} times less than the scan.")
            });
        let front = scan.front();
        if front.len() > 1 {
            let front = front.into_iter().map(describe).join(", ");
            text += &format!(
                " No other method is both faster and more accurate than one of these: {front}."
            );
        }
        if let Some(haptic) = scan.best_haptic() {
            let best = describe(haptic);
            text += &format!(" Of the regions of the haptic update alone the best is {best}.");
            text += &same_regions(scan);
            text += &against_contact_points(haptic, scan.of(RefineMethod::ContactPoints));
        }
        text
    }

    /// Effect of finer and coarser scans.
    fn densities(&self) -> Option<String> {
        let text = |method: RefineMethod| {
            let each = |scan: &ScanResult| {
                let result = scan.of(method)?;
                let (mm, us) = (result.mean_mm(), result.per_sample_us.median);
                let worse = if result.is_worse {
                    ", worse than the scan"
                } else {
                    ""
                };
                Some(format!(
                    "{mm:.3} mm in {us:.2} µs per sample at {:.1} mm{worse}",
                    scan.edge_mm
                ))
            };
            let all = by_edge(self).into_iter().rev().filter_map(each).join(", ");
            format!("{}: {all}", method.name())
        };
        let all = RefineMethod::BY_DENSITY.map(text).join("; ");
        (self.scans.len() > 1)
            .then(|| format!("{} over the edge length of the scan. {all}.", self.name))
    }

    fn gaussian_text(&self, cost: &GaussianCost) -> String {
        let GaussianCost {
            marks,
            exponent,
            contacts,
            ..
        } = cost;
        let last = marks.last().map(|(count, time)| (*count, time.median));
        let (count, time) = last.unwrap_or_default();
        format!(
            "{}: one more touch costs the Gaussian process {:.2} ms at {count:.0} touches, and that grows as n^{exponent:.2}. \
             With all {contacts} contacts it would be {} for each touch by the same law.",
            self.name,
            time * 1e-3,
            long_time(cost.at_all_contacts_us * 1e-6)
        )
    }
}

/// Seconds, minutes or hours.
fn long_time(seconds: f64) -> String {
    match seconds {
        ..1.0 => format!("{:.0} ms", seconds * 1e3),
        ..120.0 => format!("{seconds:.0} s"),
        ..7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.0} h", seconds / 3600.0),
    }
}

/// Benefit of force and normals.
fn against_contact_points(haptic: &MethodResult, points: Option<&MethodResult>) -> String {
    let Some(points) = points else {
        return String::new();
    };
    if !points.is_sound() {
        let remarks = points.remarks.join("; ");
        return format!(" Contact points alone did not do: {remarks}.");
    }
    let share = haptic.mean_mm() / points.mean_mm();
    let normals = haptic
        .error
        .zip(points.error)
        .map_or(String::new(), |(haptic, points)| {
            let [haptic, points] = [haptic, points].map(|error| error.normal_mean_deg);
            format!("; normals {haptic:.1} against {points:.1} deg")
        });
    let verdict = match share {
        _ if (share - 1.0).abs() < ALIKE => "is as good as",
        ..1.0 => "beats",
        _ => "loses to",
    };
    let [(mm, us), (points_mm, points_us)] =
        [haptic, points].map(|result| (result.mean_mm(), result.per_sample_us.median));
    format!(
        " There the haptic update {verdict} contact points alone: {mm:.3} against {points_mm:.3} mm in {us:.2} against \
         {points_us:.2} µs per sample{normals}."
    )
}

/// Regions so small that they contain only the handle.
fn same_regions(scan: &ScanResult) -> String {
    let Some(handle) = scan.of(RefineMethod::Robust(Reach::Handle)) else {
        return String::new();
    };
    let is_same =
        |result: &&MethodResult| result.method != handle.method && result.error == handle.error;
    let same = scan
        .methods
        .iter()
        .filter(is_same)
        .map(|result| &result.name)
        .join(", ");
    if same.is_empty() {
        return same;
    }
    format!(
        " With edges of {:.1} mm nothing but the handle moves with: {same}.",
        scan.edge_mm
    )
}

/// Methods that stopped early or made the scan worse.
fn failures(scan: &ScanResult) -> Option<String> {
    let failed = scan.methods.iter().filter(|result| !result.is_sound());
    let mut failed = failed.map(|result| format!("{}: {}", result.name, result.remarks.join("; ")));
    let failed = failed.join(". ");
    (!failed.is_empty()).then(|| format!("What did not do: {failed}."))
}
