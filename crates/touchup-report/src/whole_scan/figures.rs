//! Figures and tables of whole scans.

use super::{CaseResult, MethodResult, RefineMethod, ScanResult, TouchedError, WholeScan};
use crate::{Axis, Figure, LineStroke, Mark, Series, Spread, Table};
use itertools::Itertools;
use touchup_document::number::range;

/// Points of a law's curve.
const STEPS: usize = 12;

/// A method's quantity on an axis: its label, its column and the value, all on a logarithmic scale.
type AxisQuantity = (
    &'static str,
    &'static str,
    fn(&MethodResult, &TouchedError) -> Spread,
);

const TOTAL: AxisQuantity = ("total run time, s", "total_s", |result, _| result.total_s);
const PER_SAMPLE: AxisQuantity = ("time per sample, µs", "time_per_sample_us", |result, _| {
    result.per_sample_us
});
const MEAN: AxisQuantity = ("mean surface error, mm", "mean_error_mm", |_, error| {
    error.mean_mm().into()
});
const P95: AxisQuantity = ("surface error p95, mm", "p95_error_mm", |_, error| {
    error.p95_mm().into()
});
const NORMAL: AxisQuantity = ("mean normal error, deg", "normal_error_deg", |_, error| {
    error.normal_mean_deg.into()
});

/// Figures with a mark for each method: id, title, horizontal and vertical quantity.
const BY_METHOD: [(&str, &str, [AxisQuantity; 2]); 3] = [
    (
        "error_total",
        "Mean surface error against total run time",
        [TOTAL, MEAN],
    ),
    (
        "p95_sample",
        "Surface error, 95th percentile, against time per sample",
        [PER_SAMPLE, P95],
    ),
    (
        "normal_sample",
        "Mean normal error against time per sample",
        [PER_SAMPLE, NORMAL],
    ),
];

fn axis((label, column, _): AxisQuantity) -> Axis {
    Axis::log(label, column)
}

impl WholeScan {
    pub(super) fn figures(&self) -> Vec<Figure> {
        let figures = self.cases.iter().flat_map(|case| self.figures_of(case));
        figures.collect()
    }

    fn figures_of(&self, case: &CaseResult) -> Vec<Figure> {
        let by_method = |scan| BY_METHOD.map(|figure| self.by_method(case, scan, figure));
        let over_scans = [self.regions_and_densities(case), self.error_over_edge(case)];
        let by_method = case.main().map(by_method).into_iter().flatten();
        by_method
            .chain(over_scans)
            .chain(self.gaussian_cost(case))
            .collect()
    }

    /// Source of the times.
    fn repeats(&self) -> String {
        format!(
            "Median of {} runs in turns, bars from p10 to p90; what takes longer than {} s was run once.",
            self.repeats, self.slow_s
        )
    }

    /// One mark for each method on the main scan, and a dashed line at the error of the scan, as
    /// wide as the marks.
    fn by_method(
        &self,
        case: &CaseResult,
        scan: &ScanResult,
        (id, title, [x, y]): (&str, &str, [AxisQuantity; 2]),
    ) -> Figure {
        let mark = |result: &MethodResult, error: &TouchedError| {
            Mark::at(x.2(result, error), y.2(result, error))
        };
        let one = |result: &MethodResult| {
            let marks = [mark(result, &result.error?)];
            Some(Series::new(&result.name, LineStroke::Marks, marks))
        };
        let mut series = scan.methods.iter().filter_map(one).collect_vec();
        let marks = series.iter().flat_map(|series| &series.marks);
        let xs = range(marks.map(|mark| mark.x.median));
        series.extend(xs.zip(scan.methods.first()).map(|((low, high), any)| {
            let at = |x: f64| Mark::at(x, y.2(any, &scan.before));
            Series::dashed("unrefined scan", [low, high].map(at))
        }));
        Figure::curves(format!("whole_scan_{id}_{}", file_name(&case.name)), series)
            .title(format!("{title}, {}", case.name))
            .axes(axis(x), axis(y))
            .caption(format!(
                "Errors where the part was touched. {} Down and to the left is better; dashed: the unrefined scan. \
                 For the Gaussian process a sample is a touch that it keeps.",
                self.repeats()
            ))
    }

    /// The robust mode over the sizes of its region, and three methods over the edges of the scan.
    fn regions_and_densities(&self, case: &CaseResult) -> Figure {
        let mark =
            |result: &MethodResult| Some(Mark::at(result.per_sample_us, result.error?.mean_mm()));
        let scans = by_edge(case);
        let edges = scans
            .iter()
            .map(|scan| format!("{:.1}", scan.edge_mm))
            .join(", ");
        let regions = case.main().map(|scan| {
            let is_robust =
                |result: &&MethodResult| matches!(result.method, RefineMethod::Robust(_));
            let robust = scan.methods.iter().filter(is_robust);
            let name = "robust: handle, one ring, 0.5, 1, 2 tip radii";
            Series::joined(name, robust.filter_map(mark))
        });
        let methods = RefineMethod::BY_DENSITY
            .into_iter()
            .filter(|_| case.scans.len() > 1);
        let densities = methods.map(|method| {
            let marks = scans.iter().filter_map(|scan| mark(scan.of(method)?));
            Series::joined(format!("{}: edges of {edges} mm", method.name()), marks)
        });
        let (id, name) = (file_name(&case.name), &case.name);
        Figure::curves(
            format!("whole_scan_regions_{id}"),
            regions.into_iter().chain(densities),
        )
        .title(format!(
            "Mean surface error over region sizes and mesh densities, {name}"
        ))
        .axes(axis(PER_SAMPLE), axis(MEAN))
        .caption(format!(
            "Each line in the order of its name. {}",
            self.repeats()
        ))
    }

    fn error_over_edge(&self, case: &CaseResult) -> Figure {
        let scans = by_edge(case);
        let mark = |scan: &ScanResult, error: TouchedError| Mark::at(scan.edge_mm, error.mean_mm());
        let methods = RefineMethod::BY_DENSITY.into_iter().map(|method| {
            let marks = scans
                .iter()
                .filter_map(|scan| Some(mark(scan, scan.of(method)?.error?)));
            Series::joined(method.name(), marks)
        });
        let before = scans.iter().map(|scan| mark(scan, scan.before));
        let all = methods.chain([Series::dashed("unrefined scan", before)]);
        Figure::curves(format!("whole_scan_density_{}", file_name(&case.name)), all)
            .title(format!("Mean surface error over the density of the scan, {}", case.name))
            .axes(Axis::log("mean edge of the scan, mm", "edge_mm"), axis(MEAN))
            .caption("The same samples on scans with shorter and longer edges. The errors are the same in every run.")
    }

    /// Cost of a touch for the Gaussian process, with the haptic update for comparison.
    fn gaussian_cost(&self, case: &CaseResult) -> Option<Figure> {
        let cost = case.gaussian.as_ref()?;
        let &(last, at_last) = cost.marks.last()?;
        let contacts = cost.contacts as f64;
        let at = |count: f64| at_last.median * (count / last).powf(cost.exponent);
        let step = |i: usize| last * (contacts / last).max(1.0).powf(i as f64 / STEPS as f64);
        let measured = cost
            .marks
            .iter()
            .map(|&(count, time)| Mark::at(count, time));
        let law = (0..=STEPS).map(step).map(|n| Mark::at(n, at(n)));
        let law_name = format!("extrapolated, n^{:.2}", cost.exponent);
        let first = cost.marks.first().map_or(1.0, |mark| mark.0);
        let others = [RefineMethod::HAPTIC, RefineMethod::Patch]
            .into_iter()
            .filter_map(|method| {
                let result = case.main()?.of(method)?;
                let marks = [first, contacts].map(|n| Mark::at(n, result.per_sample_us.median));
                Some(Series::dashed(method.name(), marks))
            });
        let series = [
            Series::joined("Gaussian process, refitted", measured),
            Series::dashed(law_name, law),
        ];
        Some(
            Figure::curves(format!("whole_scan_gaussian_{}", file_name(&case.name)), series.into_iter().chain(others))
                .title(format!("Time for one more touch over the touches kept, {}", case.name))
                .axes(
                    Axis::log("touches kept", "touches"),
                    Axis::log("time for one more touch, µs", "time_per_touch_us"),
                )
                .caption(
                    "Marks: medians of groups of touches in the first run, bars from p10 to p90 within the group. \
                     Dashed: the power law through the larger half of them, up to all contacts there were, and the \
                     mean time per sample of two other methods.",
                ),
        )
    }

    pub(super) fn table(&self) -> Table {
        let scans = self
            .cases
            .iter()
            .flat_map(|case| case.scans.iter().map(move |scan| (case, scan)));
        let rows = scans.flat_map(|(case, scan)| {
            let results = std::iter::once(None).chain(scan.methods.iter().map(Some));
            results.map(move |result| (case, scan, result))
        });
        type Row<'a> = (&'a CaseResult, &'a ScanResult, Option<&'a MethodResult>);
        // without a method: the original scan
        let error =
            |(_, scan, result): Row| result.map_or(Some(scan.before), |result| result.error);
        Table::of("whole_scan", "All methods on all scans", rows)
            .column("part", |(case, ..)| case.name.as_str())
            .column("edge, mm", |(_, scan, _)| scan.edge_mm)
            .column("method", |(.., result)| result.map_or("unrefined scan", |result| &result.name))
            .column("mean error, mm", |row| error(row).map(|error| error.mean_mm()))
            .column("p95 error, mm", |row| error(row).map(|error| error.p95_mm()))
            .column("part to mesh mean, mm", |row| error(row).map(|error| error.part_to_mesh_mean_mm))
            .column("mesh to part mean, mm", |row| error(row).map(|error| error.mesh_to_part_mean_mm))
            .column("mean normal error, deg", |row| error(row).map(|error| error.normal_mean_deg))
            .column("p95 normal error, deg", |row| error(row).map(|error| error.normal_p95_deg))
            .column("total, s", |(.., result)| Some(result?.total_s))
            .column("per sample, µs", |(.., result)| Some(result?.per_sample_us))
            .column("after the last sample, ms", |(.., result)| Some(result?.end_ms))
            .column("samples", |(.., result)| Some(result?.samples))
            .column("runs", |(.., result)| Some(result?.runs))
            .column("cut back, %", |(.., result)| Some(result?.cut_back_share * 100.0))
            .column("remark", |(.., result)| Some(result?.remarks.join("; ")).filter(|remark| !remark.is_empty()))
            .caption(format!(
                "Errors where the part was touched; mean and p95 error are the worse of both directions. Time per \
                 sample has the work after the last sample in it, shared out. Total time begins with the scan in \
                 memory. {}",
                self.repeats()
            ))
    }
}

/// The scans of a case, the finest first.
pub(super) fn by_edge(case: &CaseResult) -> Vec<&ScanResult> {
    let scans = case.scans.iter();
    scans
        .sorted_by(|a, b| a.edge_mm.total_cmp(&b.edge_mm))
        .collect()
}

/// A name with the characters of a file name.
fn file_name(name: &str) -> String {
    let letter = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '_'
        }
    };
    name.chars().map(letter).collect()
}
