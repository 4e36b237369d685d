//! Figures and tables of whole scans.

use super::{CaseResult, MethodResult, RefineMethod, ScanResult, TouchedError, WholeScan};
use crate::{Axis, Drawing, Figure, LineStroke, Mark, Series, Table};

/// Points of a drawn law.
const STEPS: usize = 12;

fn time_axis() -> Axis {
    Axis::log("time per sample, µs", "time_per_sample_us")
}

impl WholeScan {
    pub(super) fn figures(&self) -> Vec<Figure> {
        self.cases.iter().flat_map(|case| self.figures_of(case)).collect()
    }

    fn figures_of(&self, case: &CaseResult) -> Vec<Figure> {
        let mut figures = Vec::new();
        if let Some(scan) = case.main() {
            let mean = Axis::log("mean surface error, mm", "mean_error_mm");
            let p95 = Axis::log("surface error p95, mm", "p95_error_mm");
            let normal = Axis::log("mean normal error, deg", "normal_error_deg");
            let total = Axis::log("total run time, s", "total_s");
            let figure = |id, title, axes, of: fn(&MethodResult, &TouchedError) -> Mark| {
                self.methods((case, scan), (id, title), axes, of)
            };
            figures = vec![
                figure("error_total", "Mean surface error against total run time", [total, mean], |result, error| {
                    Mark::at(result.total_s, error.mean_mm())
                }),
                figure(
                    "p95_sample",
                    "Surface error, 95th percentile, against time per sample",
                    [time_axis(), p95],
                    |result, error| Mark::at(result.per_sample_us, error.p95_mm()),
                ),
                figure(
                    "normal_sample",
                    "Mean normal error against time per sample",
                    [time_axis(), normal],
                    |result, error| Mark::at(result.per_sample_us, error.normal_mean_deg),
                ),
            ];
        }
        figures.extend([self.regions_and_densities(case), self.error_over_edge(case)]);
        figures.extend(self.gaussian_cost(case));
        figures
    }

    /// How the times were come by.
    fn repeats(&self) -> String {
        format!(
            "Median of {} runs in turns, bars from p10 to p90; what takes longer than {} s was run once.",
            self.repeats, self.slow_s
        )
    }

    /// One mark for each method on the main scan.
    fn methods(
        &self,
        (case, scan): (&CaseResult, &ScanResult),
        (id, title): (&str, &str),
        [x, y]: [Axis; 2],
        of: fn(&MethodResult, &TouchedError) -> Mark,
    ) -> Figure {
        let one =
            |result: &MethodResult| Some(Series::new(&result.name, LineStroke::Marks, [of(result, &result.error?)]));
        let mut series: Vec<Series> = scan.methods.iter().filter_map(one).collect();
        series.extend(as_it_came(&series, scan, of));
        Figure {
            id: format!("whole_scan_{id}_{}", file_name(&case.name)),
            title: format!("{title}, {}", case.name),
            caption: format!(
                "Errors where the part was touched. {} Down and to the left is better; dashed: the unrefined scan. For the \
                 Gaussian process a sample is a touch that it keeps.",
                self.repeats()
            ),
            x,
            y,
            drawing: Drawing::Curves(series),
        }
    }

    /// The robust mode over the sizes of its region, and three methods over the edges of the scan.
    fn regions_and_densities(&self, case: &CaseResult) -> Figure {
        let mark = |result: &MethodResult| Some(Mark::at(result.per_sample_us, result.error?.mean_mm()));
        let mut series = Vec::new();
        if let Some(scan) = case.main() {
            let robust = scan.methods.iter().filter(|result| matches!(result.method, RefineMethod::Robust(_)));
            let name = "robust: handle, one ring, 0.5, 1, 2 tip radii";
            series.push(Series::new(name, LineStroke::Joined, robust.filter_map(mark)));
        }
        for method in RefineMethod::BY_DENSITY.into_iter().filter(|_| case.scans.len() > 1) {
            let scans = by_edge(case);
            let edges: Vec<String> = scans.iter().map(|scan| format!("{:.1}", scan.edge_mm)).collect();
            let name = format!("{}: edges of {} mm", method.name(), edges.join(", "));
            let marks = scans.into_iter().filter_map(|scan| mark(scan.of(method)?));
            series.push(Series::new(name, LineStroke::Joined, marks));
        }
        Figure {
            id: format!("whole_scan_regions_{}", file_name(&case.name)),
            title: format!("Mean surface error over region sizes and mesh densities, {}", case.name),
            caption: format!("Each line in the order of its name. {}", self.repeats()),
            x: time_axis(),
            y: Axis::log("mean surface error, mm", "mean_error_mm"),
            drawing: Drawing::Curves(series),
        }
    }

    fn error_over_edge(&self, case: &CaseResult) -> Figure {
        let series = |name: String, stroke: LineStroke, of: &dyn Fn(&ScanResult) -> Option<TouchedError>| {
            let marks = by_edge(case).into_iter().filter_map(|scan| Some(Mark::at(scan.edge_mm, of(scan)?.mean_mm())));
            Series::new(name, stroke, marks)
        };
        let mut all: Vec<Series> = RefineMethod::BY_DENSITY
            .into_iter()
            .map(|method| series(method.name(), LineStroke::Joined, &|scan| scan.of(method)?.error))
            .collect();
        all.push(series("unrefined scan".to_owned(), LineStroke::Dashed, &|scan| Some(scan.before)));
        Figure {
            id: format!("whole_scan_density_{}", file_name(&case.name)),
            title: format!("Mean surface error over the density of the scan, {}", case.name),
            caption: "The same samples on scans with shorter and longer edges. The errors are the same in every run."
                .to_owned(),
            x: Axis::log("mean edge of the scan, mm", "edge_mm"),
            y: Axis::log("mean surface error, mm", "mean_error_mm"),
            drawing: Drawing::Curves(all),
        }
    }

    /// What a touch costs the Gaussian process, and the haptic update beside it.
    fn gaussian_cost(&self, case: &CaseResult) -> Option<Figure> {
        let cost = case.gaussian.as_ref()?;
        let &(last, at_last) = cost.marks.last()?;
        let contacts = cost.contacts as f64;
        let at = |count: f64| at_last.median * (count / last).powf(cost.exponent);
        let step = |i: usize| last * (contacts / last).max(1.0).powf(i as f64 / STEPS as f64);
        let measured = cost.marks.iter().map(|&(count, time)| Mark::at(count, time));
        let law = (0..=STEPS).map(step).map(|n| Mark::at(n, at(n)));
        let law_name = format!("extrapolated, n^{:.2}", cost.exponent);
        let mut series = vec![
            Series::new("Gaussian process, refitted", LineStroke::Joined, measured),
            Series::new(law_name, LineStroke::Dashed, law),
        ];
        let first = cost.marks.first().map_or(1.0, |mark| mark.0);
        for method in [RefineMethod::HAPTIC, RefineMethod::Patch] {
            let Some(result) = case.main().and_then(|scan| scan.of(method)) else { continue };
            let marks = [first, contacts].map(|n| Mark::at(n, result.per_sample_us.median));
            series.push(Series::new(method.name(), LineStroke::Dashed, marks));
        }
        Some(Figure {
            id: format!("whole_scan_gaussian_{}", file_name(&case.name)),
            title: format!("Time for one more touch over the touches kept, {}", case.name),
            caption: "Marks: medians of groups of touches in the first run, bars from p10 to p90 within the group. Dashed: \
                      the power law through the larger half of them, up to all contacts there were, and the mean time per \
                      sample of two other methods."
                .to_owned(),
            x: Axis::log("touches kept", "touches"),
            y: Axis::log("time for one more touch, µs", "time_per_touch_us"),
            drawing: Drawing::Curves(series),
        })
    }

    pub(super) fn table(&self) -> Table {
        let scans = self.cases.iter().flat_map(|case| case.scans.iter().map(move |scan| (case, scan)));
        let rows = scans.flat_map(|(case, scan)| {
            let results = scan.methods.iter().map(Some);
            std::iter::once(None).chain(results).map(move |result| Row { case, scan, result })
        });
        Table::of(
            "whole_scan",
            "All methods on all scans",
            format!(
                "Errors where the part was touched; mean and p95 error are the worse of both directions. Time per sample \
                 has the work after the last sample in it, shared out. Total time begins with the scan in memory. {}",
                self.repeats()
            ),
            rows,
        )
        .column("part", |row| row.case.name.as_str())
        .column("edge, mm", |row| row.scan.edge_mm)
        .column("method", |row| row.result.map_or("unrefined scan", |result| &result.name))
        .column("mean error, mm", |row| row.error().map(|error| error.mean_mm()))
        .column("p95 error, mm", |row| row.error().map(|error| error.p95_mm()))
        .column("part to mesh mean, mm", |row| row.error().map(|error| error.part_to_mesh_mean_mm))
        .column("mesh to part mean, mm", |row| row.error().map(|error| error.mesh_to_part_mean_mm))
        .column("mean normal error, deg", |row| row.error().map(|error| error.normal_mean_deg))
        .column("p95 normal error, deg", |row| row.error().map(|error| error.normal_p95_deg))
        .column("total, s", |row| Some(row.result?.total_s))
        .column("per sample, µs", |row| Some(row.result?.per_sample_us))
        .column("after the last sample, ms", |row| Some(row.result?.end_ms))
        .column("samples", |row| Some(row.result?.samples))
        .column("runs", |row| Some(row.result?.runs))
        .column("cut back, %", |row| Some(row.result?.cut_back_share * 100.0))
        .column("remark", |row| Some(row.result?.remarks.join("; ")).filter(|remark| !remark.is_empty()))
        .table
    }
}

/// One method on one scan; `None`: the scan as it came.
#[derive(Clone, Copy)]
struct Row<'a> {
    case: &'a CaseResult,
    scan: &'a ScanResult,
    result: Option<&'a MethodResult>,
}

impl Row<'_> {
    fn error(&self) -> Option<TouchedError> {
        self.result.map_or(Some(self.scan.before), |result| result.error)
    }
}

/// A dashed line at the error of the scan, as wide as the marks.
fn as_it_came(series: &[Series], scan: &ScanResult, of: fn(&MethodResult, &TouchedError) -> Mark) -> Option<Series> {
    let xs = || series.iter().flat_map(|series| &series.marks).map(|mark| mark.x.median);
    let ends = [xs().reduce(f64::min)?, xs().reduce(f64::max)?];
    let Mark { y, .. } = of(scan.methods.first()?, &scan.before);
    Some(Series::new("unrefined scan", LineStroke::Dashed, ends.map(|x| Mark::at(x, y))))
}

/// The scans of a case, the finest first.
pub(super) fn by_edge(case: &CaseResult) -> Vec<&ScanResult> {
    let mut scans: Vec<&ScanResult> = case.scans.iter().collect();
    scans.sort_by(|a, b| a.edge_mm.total_cmp(&b.edge_mm));
    scans
}

/// A name with the characters of a file name.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}
