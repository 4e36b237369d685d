//! Figures and tables of whole scans.

use super::{CaseResult, MethodResult, RefineMethod, ScanResult, TouchedError, WholeScan};
use crate::{Axis, Drawing, Figure, LineStroke, Mark, Series, Spread, Table, TableCell};

/// Points of a drawn law.
const STEPS: usize = 12;

/// A figure of one case: its name and its axes.
struct FigurePlan<'a> {
    id: &'a str,
    title: &'a str,
    x: Axis,
    y: Axis,
    of: fn(&MethodResult, &TouchedError) -> Mark,
}

fn time_axis() -> Axis {
    Axis::log("time per sample, µs", "time_per_sample_us")
}

impl WholeScan {
    pub(super) fn figures(&self) -> Vec<Figure> {
        self.cases.iter().flat_map(|case| self.figures_of(case)).collect()
    }

    fn figures_of(&self, case: &CaseResult) -> Vec<Figure> {
        let plans = [
            FigurePlan {
                id: "error_total",
                title: "Mean surface error against total run time",
                x: Axis::log("total run time, s", "total_s"),
                y: Axis::log("mean surface error, mm", "mean_error_mm"),
                of: |result, error| Mark { x: result.total_s, y: error.mean_mm().into() },
            },
            FigurePlan {
                id: "p95_sample",
                title: "Surface error, 95th percentile, against time per sample",
                x: time_axis(),
                y: Axis::log("surface error p95, mm", "p95_error_mm"),
                of: |result, error| Mark { x: result.per_sample_us, y: error.p95_mm().into() },
            },
            FigurePlan {
                id: "normal_sample",
                title: "Mean normal error against time per sample",
                x: time_axis(),
                y: Axis::log("mean normal error, deg", "normal_error_deg"),
                of: |result, error| Mark { x: result.per_sample_us, y: error.normal_mean_deg.into() },
            },
        ];
        let mut figures: Vec<Figure> = case
            .main()
            .map_or_else(Vec::new, |scan| plans.into_iter().map(|plan| self.methods(case, scan, plan)).collect());
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
    fn methods(&self, case: &CaseResult, scan: &ScanResult, plan: FigurePlan) -> Figure {
        let FigurePlan { id, title, x, y, of } = plan;
        let mut series: Vec<Series> = scan
            .methods
            .iter()
            .filter_map(|result| {
                let marks = vec![of(result, &result.error?)];
                Some(Series { name: result.name.clone(), stroke: LineStroke::Marks, marks })
            })
            .collect();
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
        let mark = |result: &MethodResult| Some(Mark { x: result.per_sample_us, y: result.error?.mean_mm().into() });
        let mut series = Vec::new();
        if let Some(scan) = case.main() {
            let robust = scan.methods.iter().filter(|result| matches!(result.method, RefineMethod::Robust(_)));
            series.push(Series {
                name: "robust: handle, one ring, 0.5, 1, 2 tip radii".to_owned(),
                stroke: LineStroke::Joined,
                marks: robust.filter_map(mark).collect(),
            });
        }
        for method in RefineMethod::BY_DENSITY.into_iter().filter(|_| case.scans.len() > 1) {
            let scans = by_edge(case);
            let edges: Vec<String> = scans.iter().map(|scan| format!("{:.1}", scan.edge_mm)).collect();
            series.push(Series {
                name: format!("{}: edges of {} mm", method.name(), edges.join(", ")),
                stroke: LineStroke::Joined,
                marks: scans.into_iter().filter_map(|scan| mark(scan.of(method)?)).collect(),
            });
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
        let mark = |scan: &ScanResult, error: &TouchedError| Mark { x: scan.edge_mm.into(), y: error.mean_mm().into() };
        let series = |name: String, stroke: LineStroke, of: &dyn Fn(&ScanResult) -> Option<TouchedError>| Series {
            name,
            stroke,
            marks: by_edge(case).into_iter().filter_map(|scan| Some(mark(scan, &of(scan)?))).collect(),
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
        let mut series = vec![
            Series {
                name: "Gaussian process, refitted".to_owned(),
                stroke: LineStroke::Joined,
                marks: cost.marks.iter().map(|&(count, time)| Mark { x: count.into(), y: time }).collect(),
            },
            Series {
                name: format!("extrapolated, n^{:.2}", cost.exponent),
                stroke: LineStroke::Dashed,
                marks: (0..=STEPS).map(step).map(|n| Mark { x: n.into(), y: at(n).into() }).collect(),
            },
        ];
        for method in [RefineMethod::HAPTIC, RefineMethod::Patch] {
            let Some(result) = case.main().and_then(|scan| scan.of(method)) else { continue };
            let time = result.per_sample_us.median;
            let ends = [cost.marks.first().map_or(1.0, |mark| mark.0), contacts];
            let marks = ends.iter().map(|&n| Mark { x: n.into(), y: time.into() }).collect();
            series.push(Series { name: method.name(), stroke: LineStroke::Dashed, marks });
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
        let heads = [
            "part",
            "edge, mm",
            "method",
            "mean error, mm",
            "p95 error, mm",
            "part to mesh mean, mm",
            "mesh to part mean, mm",
            "mean normal error, deg",
            "p95 normal error, deg",
            "total, s",
            "per sample, µs",
            "after the last sample, ms",
            "samples",
            "runs",
            "cut back, %",
            "remark",
        ];
        let rows = self.cases.iter().flat_map(|case| case.scans.iter().map(move |scan| (case, scan)));
        Table {
            id: "whole_scan".to_owned(),
            title: "All methods on all scans".to_owned(),
            caption: format!(
                "Errors where the part was touched; mean and p95 error are the worse of both directions. Time per sample \
                 has the work after the last sample in it, shared out. Total time begins with the scan in memory. {}",
                self.repeats()
            ),
            heads: heads.map(str::to_owned).to_vec(),
            rows: rows.flat_map(|(case, scan)| rows_of(case, scan)).collect(),
        }
    }
}

fn rows_of<'a>(case: &'a CaseResult, scan: &'a ScanResult) -> impl Iterator<Item = Vec<TableCell>> + 'a {
    let begin = move |name: &str| [case.name.as_str().into(), scan.edge_mm.into(), name.into()];
    let mut first = begin("unrefined scan").to_vec();
    first.extend(error_cells(Some(&scan.before)));
    first.resize(16, TableCell::Empty);
    let of_method = move |result: &MethodResult| {
        let mut cells = begin(&result.name).to_vec();
        cells.extend(error_cells(result.error.as_ref()));
        cells.extend([
            result.total_s.into(),
            result.per_sample_us.into(),
            result.end_ms.into(),
            (result.samples as f64).into(),
            (result.runs as f64).into(),
            (result.cut_back_share * 100.0).into(),
            if result.remarks.is_empty() { TableCell::Empty } else { result.remarks.join("; ").into() },
        ]);
        cells
    };
    [first].into_iter().chain(scan.methods.iter().map(of_method))
}

fn error_cells(error: Option<&TouchedError>) -> [TableCell; 6] {
    let number = |of: fn(&TouchedError) -> f64| error.map_or(TableCell::Empty, |error| of(error).into());
    [
        number(TouchedError::mean_mm),
        number(TouchedError::p95_mm),
        number(|error| error.part_to_mesh_mean_mm),
        number(|error| error.mesh_to_part_mean_mm),
        number(|error| error.normal_mean_deg),
        number(|error| error.normal_p95_deg),
    ]
}

/// A dashed line at the error of the scan, as wide as the marks.
fn as_it_came(series: &[Series], scan: &ScanResult, of: fn(&MethodResult, &TouchedError) -> Mark) -> Option<Series> {
    let xs = || series.iter().flat_map(|series| &series.marks).map(|mark| mark.x.median);
    let ends = [xs().reduce(f64::min)?, xs().reduce(f64::max)?];
    let Mark { y, .. } = of(scan.methods.first()?, &scan.before);
    let marks = ends.iter().map(|&x| Mark { x: Spread::from(x), y }).collect();
    Some(Series { name: "unrefined scan".to_owned(), stroke: LineStroke::Dashed, marks })
}

/// The scans of a case, the finest first.
fn by_edge(case: &CaseResult) -> Vec<&ScanResult> {
    let mut scans: Vec<&ScanResult> = case.scans.iter().collect();
    scans.sort_by(|a, b| a.edge_mm.total_cmp(&b.edge_mm));
    scans
}

/// A name with the characters of a file name.
fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}
