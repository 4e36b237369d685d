//! A comparison as JSON in mm, and as a table.

use std::fmt;

use serde::Serialize;

use super::alignment::Alignment;
use super::{CompareReport, ShapeReport};
use crate::cli::counted;
use crate::compare::{Comparison, Histogram, RegionComparison, Summary, SupportRegion, TiltSummary};

/// What `--json` prints of one mesh.
#[derive(Debug, Serialize)]
pub(super) struct ComparisonReport {
    /// points spread over each surface
    density_per_mm2: f64,
    /// of the true surface, which the mesh does not show: never scanned, or missing
    unseen_share: f64,
    /// all, touched, guessed, untouched, where present
    regions: Vec<DeviationRow>,
}

#[derive(Debug, Serialize)]
struct DeviationRow {
    region: &'static str,
    mesh_to_truth: Option<SummaryReport>,
    truth_to_mesh: Option<SummaryReport>,
    vertices_to_truth: Option<SummaryReport>,
    cloud_to_truth: Option<SummaryReport>,
    truth_to_cloud: Option<SummaryReport>,
    normals: Option<NormalsReport>,
    /// of `mesh_to_truth`
    histogram: HistogramReport,
    /// of `mesh_to_truth`, within --tolerance-mm
    #[serde(skip_serializing_if = "Option::is_none")]
    within_tolerance_share: Option<f64>,
}

/// Distances; all but `bias_mm` without sign.
#[derive(Debug, Serialize)]
struct SummaryReport {
    points: usize,
    mean_mm: f64,
    rms_mm: f64,
    median_mm: f64,
    p95_mm: f64,
    p99_mm: f64,
    max_mm: f64,
    /// not of clouds, which have no sides
    #[serde(skip_serializing_if = "Option::is_none")]
    bias_mm: Option<f64>,
}

#[derive(Debug, Serialize)]
struct NormalsReport {
    median_deg: f64,
    p95_deg: f64,
    /// of the area, more than 90 degrees off
    flipped_share: f64,
}

#[derive(Debug, Serialize)]
struct HistogramReport {
    from_mm: f64,
    bin_mm: f64,
    counts: Vec<usize>,
    below: usize,
    above: usize,
}

impl ComparisonReport {
    pub fn of(comparison: &Comparison) -> Self {
        let regions = comparison.regions.iter().map(DeviationRow::of).collect();
        Self { density_per_mm2: comparison.density * 1e-6, unseen_share: comparison.unseen, regions }
    }
}

impl DeviationRow {
    fn of(part: &RegionComparison) -> Self {
        let report = |summary: &Option<Summary>| summary.as_ref().map(SummaryReport::of);
        let unsigned = |summary| report(summary).map(|report| SummaryReport { bias_mm: None, ..report });
        let Histogram { from, width, counts, below, above } = &part.histogram;
        Self {
            region: name_of(part.region),
            mesh_to_truth: report(&part.mesh_to_truth),
            truth_to_mesh: report(&part.truth_to_mesh),
            vertices_to_truth: report(&part.vertices_to_truth),
            cloud_to_truth: unsigned(&part.cloud_to_truth),
            truth_to_cloud: unsigned(&part.truth_to_cloud),
            normals: part.tilt.map(|TiltSummary { median, p95, flipped }| NormalsReport {
                median_deg: median.to_degrees(),
                p95_deg: p95.to_degrees(),
                flipped_share: flipped,
            }),
            histogram: HistogramReport {
                from_mm: from * 1e3,
                bin_mm: width * 1e3,
                counts: counts.clone(),
                below: *below,
                above: *above,
            },
            within_tolerance_share: part.within_tolerance,
        }
    }
}

impl SummaryReport {
    fn of(summary: &Summary) -> Self {
        let Summary { points, mean, rms, median, p95, p99, max, bias } = *summary;
        let [mean_mm, rms_mm, median_mm, p95_mm, p99_mm, max_mm, bias_mm] =
            [mean, rms, median, p95, p99, max, bias].map(|x| x * 1e3);
        Self { points, mean_mm, rms_mm, median_mm, p95_mm, p99_mm, max_mm, bias_mm: Some(bias_mm) }
    }
}

fn name_of(region: Option<SupportRegion>) -> &'static str {
    match region {
        None => "all",
        Some(SupportRegion::Touched) => "touched",
        Some(SupportRegion::Guessed) => "guessed",
        Some(SupportRegion::Untouched) => "untouched",
    }
}

/// The numbers of a picture: of the touched part where there is one, else of all.
pub(super) fn shown(comparison: &Comparison) -> Option<&RegionComparison> {
    let touched = comparison.regions.iter().find(|part| part.region == Some(SupportRegion::Touched));
    touched.or(comparison.regions.first())
}

/// Caption of a picture: the deviation, the share within tolerance, and what the colours clip.
pub(super) fn note(comparison: &Comparison, tolerance_mm: Option<f64>) -> String {
    let Some(part) = shown(comparison) else { return String::new() };
    let Some(Summary { mean, p95, .. }) = part.mesh_to_truth else { return String::new() };
    let (name, [mean, p95]) = (name_of(part.region), [mean, p95].map(|x| x * 1e3));
    let within = part.within_tolerance.zip(tolerance_mm);
    let within = within.map(|(share, mm)| format!("; {:.1} % within ±{mm} mm", share * 100.0));
    let Histogram { counts, below, above, .. } = &part.histogram;
    let beyond = (below + above) as f64 / (below + above + counts.iter().sum::<usize>()).max(1) as f64;
    let within = within.unwrap_or_default();
    format!("{name}: mean {mean:.3}, p95 {p95:.3} mm{within}; beyond the colours {:.1} %", beyond * 100.0)
}

const HEAD: &str = "                            mean      rms   median      p95      p99      max     bias    points";

impl CompareReport {
    /// Sizes of both, how the alignment went, and the table of each way of measuring.
    pub(super) fn details(&self) -> String {
        let size = |(what, shape): (&str, &ShapeReport)| {
            let ([x, y, z], faces) = (shape.size_mm, counted(shape.faces, "face", "faces"));
            format!("{what:5} {}: {faces}, {x:.1} x {y:.1} x {z:.1} mm", shape.file)
        };
        let mut lines = vec![size(("mesh", &self.mesh)), size(("truth", &self.truth))];
        lines.extend(self.alignment.as_ref().and_then(Alignment::details));
        lines.push(format!("distances in mm; bias +: too much material; {:.2} points/mm2", self.after.density_per_mm2));
        lines.push(HEAD.to_owned());
        match &self.before {
            Some(before) => lines.push(format!("before\n{before}\nafter\n{}", self.after)),
            None => lines.push(self.after.to_string()),
        }
        lines.join("\n")
    }
}

/// The verdict: deviation of the mesh, of the touched part where known, and of the mesh before. Then the alignment.
impl fmt::Display for CompareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = [("touched", "where touched"), ("all", "over all")];
        let row = |(region, place)| Some((region, place, self.after.row(region)?));
        match places.into_iter().find_map(row) {
            None => writeln!(f, "the mesh shows nothing of the true surface")?,
            Some((region, place, after)) => {
                let before = self.before.as_ref().and_then(|before| before.row(region));
                let ErrorRow { mean_mm, p95_mm, .. } = after;
                write!(f, "the mesh is off by {mean_mm:.3} mm on average {place}, 95 % within {p95_mm:.3} mm")?;
                if let Some(ErrorRow { mean_mm, p95_mm, .. }) = before {
                    write!(f, "; before: mean {mean_mm:.3} mm, 95 % within {p95_mm:.3} mm")?;
                }
                write!(f, "\n{after}")?;
                before.iter().try_for_each(|before| write!(f, "; before: {before}"))?;
                writeln!(f)?;
            }
        }
        write!(f, "the mesh shows {:.1} % of the true surface", (1.0 - self.after.unseen_share) * 100.0)?;
        self.alignment.iter().try_for_each(|alignment| write!(f, "\n{alignment}"))
    }
}

/// What a user judges a region by.
#[derive(Clone, Copy)]
struct ErrorRow {
    mean_mm: f64,
    rms_mm: f64,
    p95_mm: f64,
    max_mm: f64,
    within_tolerance_share: Option<f64>,
}

impl ComparisonReport {
    /// Errors of a region against the truth, where it is there.
    fn row(&self, region: &str) -> Option<ErrorRow> {
        let row = self.regions.iter().find(|row| row.region == region)?;
        let SummaryReport { mean_mm, rms_mm, p95_mm, max_mm, .. } = *row.mesh_to_truth.as_ref()?;
        Some(ErrorRow { mean_mm, rms_mm, p95_mm, max_mm, within_tolerance_share: row.within_tolerance_share })
    }
}

impl fmt::Display for ErrorRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "rms {:.3} mm, at most {:.3} mm", self.rms_mm, self.max_mm)?;
        self.within_tolerance_share.iter().try_for_each(|share| write!(f, ", {:.1} % in tolerance", share * 100.0))
    }
}

impl fmt::Display for ComparisonReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, part) in self.regions.iter().enumerate() {
            if at > 0 {
                writeln!(f)?;
            }
            write!(f, "{part}")?;
        }
        Ok(())
    }
}

impl fmt::Display for DeviationRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = [
            ("mesh to truth", &self.mesh_to_truth),
            ("truth to mesh", &self.truth_to_mesh),
            ("vertices", &self.vertices_to_truth),
            ("cloud", &self.cloud_to_truth),
            ("truth to cloud", &self.truth_to_cloud),
        ];
        let mut region = self.region;
        for (what, summary) in rows.iter().filter_map(|(what, summary)| Some((what, (*summary).as_ref()?))) {
            writeln!(f, "{region:9} {what:14} {summary}")?;
            region = "";
        }
        if let Some(share) = self.within_tolerance_share {
            writeln!(f, "{region:9} in tolerance   {:.2} %", share * 100.0)?;
        }
        match &self.normals {
            Some(NormalsReport { median_deg, p95_deg, flipped_share }) => write!(
                f,
                "{region:9} normals        median {median_deg:.2}, p95 {p95_deg:.2} deg, flipped {:.3} %",
                flipped_share * 100.0
            ),
            None => write!(f, "{region:9} normals        none"),
        }
    }
}

impl fmt::Display for SummaryReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for x in [self.mean_mm, self.rms_mm, self.median_mm, self.p95_mm, self.p99_mm, self.max_mm] {
            write!(f, "{x:9.4}")?;
        }
        match self.bias_mm {
            Some(bias_mm) => write!(f, "{bias_mm:+9.4}{:10}", self.points),
            None => write!(f, "{:9}{:10}", "", self.points),
        }
    }
}
