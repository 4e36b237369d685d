//! A comparison as JSON in mm, and as a table.

use std::fmt;
use std::path::Path;

use nalgebra::Vector3;

use super::alignment::AlignmentReport;
use crate::cli::{counted, reported};
use touchup_features::compare::{
    Comparison, Histogram, RegionComparison, Summary, SupportRegion, TiltSummary,
};
use touchup_geometry::mesh::TriMesh;

reported! {
    /// Output of `--json`.
    pub(in crate::cli) struct CompareReport, pub fn of(
        shapes: [(&Path, &TriMesh); 2],
        aligned: Option<AlignmentReport>,
        scanned: Option<&Comparison>,
        refined: &Comparison
    ) {
        mesh: ShapeReport = ShapeReport::of(shapes[0].0, shapes[0].1),
        truth: ShapeReport = ShapeReport::of(shapes[1].0, shapes[1].1),
        alignment?: AlignmentReport = aligned,
        /// The scan, with --before.
        before?: ComparisonReport = scanned.map(ComparisonReport::of),
        /// The mesh.
        after: ComparisonReport = ComparisonReport::of(refined),
    }
}

reported! {
    struct ShapeReport, fn of(path: &Path, mesh: &TriMesh) {
        file: String = path.display().to_string(),
        vertices: usize = mesh.vertex_count(),
        faces: usize = mesh.face_count(),
        /// Sides of its bounding box.
        size_mm: [f64; 3] = (diagonal(mesh) * 1e3).into(),
    }
}

/// Diagonal of the bounding box from its lowest to its highest corner, m.
pub(super) fn diagonal(mesh: &TriMesh) -> Vector3<f64> {
    let [low, high] = mesh.bounds();
    high - low
}

/// Output of `--json` for one mesh as `after`, as JSON.
pub fn comparison_json(comparison: &Comparison) -> serde_json::Value {
    serde_json::to_value(ComparisonReport::of(comparison))
        .expect("finite numbers and names alone cannot fail")
}

reported! {
    /// Output of `--json` for one mesh.
    struct ComparisonReport, fn of(comparison: &Comparison) {
        /// Density of the sample points on each surface.
        density_per_mm2: f64 = comparison.density * 1e-6,
        /// Share of the true surface without counterpart on the mesh: never scanned, or missing.
        unseen_share: f64 = comparison.unseen,
        /// All, touched, guessed, untouched, if present.
        regions: Vec<DeviationRow> = comparison.regions.iter().map(DeviationRow::of).collect(),
    }
}

reported! {
    struct DeviationRow, fn of(part: &RegionComparison) {
        region: &'static str = name_of(part.region),
        mesh_to_truth: Option<SummaryReport> = part.mesh_to_truth.as_ref().map(SummaryReport::of),
        truth_to_mesh: Option<SummaryReport> = part.truth_to_mesh.as_ref().map(SummaryReport::of),
        vertices_to_truth: Option<SummaryReport> = part.vertices_to_truth.as_ref().map(SummaryReport::of),
        cloud_to_truth: Option<SummaryReport> = part.cloud_to_truth.as_ref().map(SummaryReport::without_sign),
        truth_to_cloud: Option<SummaryReport> = part.truth_to_cloud.as_ref().map(SummaryReport::without_sign),
        normals: Option<NormalsReport> = part.tilt.as_ref().map(NormalsReport::of),
        /// Of `mesh_to_truth`.
        histogram: HistogramReport = HistogramReport::of(&part.histogram),
        /// Share of `mesh_to_truth` within --tolerance-mm.
        within_tolerance_share?: f64 = part.within_tolerance,
    }
}

reported! {
    /// Distances; all but `bias_mm` without sign.
    struct SummaryReport, fn of(summary: &Summary) {
        points: usize = summary.points,
        mean_mm: f64 = summary.mean * 1e3,
        rms_mm: f64 = summary.rms * 1e3,
        median_mm: f64 = summary.median * 1e3,
        p95_mm: f64 = summary.p95 * 1e3,
        p99_mm: f64 = summary.p99 * 1e3,
        max_mm: f64 = summary.max * 1e3,
        /// `None` for clouds, which have no sides.
        bias_mm?: f64 = Some(summary.bias * 1e3),
    }
}

impl SummaryReport {
    fn without_sign(summary: &Summary) -> Self {
        Self {
            bias_mm: None,
            ..Self::of(summary)
        }
    }
}

reported! {
    struct NormalsReport, fn of(tilt: &TiltSummary) {
        median_deg: f64 = tilt.median.to_degrees(),
        p95_deg: f64 = tilt.p95.to_degrees(),
        /// Share of the area, more than 90 degrees off.
        flipped_share: f64 = tilt.flipped,
    }
}

reported! {
    struct HistogramReport, fn of(histogram: &Histogram) {
        from_mm: f64 = histogram.from * 1e3,
        bin_mm: f64 = histogram.width * 1e3,
        counts: Vec<usize> = histogram.counts.clone(),
        below: usize = histogram.below,
        above: usize = histogram.above,
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

/// Numbers for a picture: of the touched part if any, else of all.
pub(super) fn shown(comparison: &Comparison) -> Option<&RegionComparison> {
    let touched = comparison
        .regions
        .iter()
        .find(|part| part.region == Some(SupportRegion::Touched));
    touched.or(comparison.regions.first())
}

/// Caption of a picture: deviation, share within tolerance, and share beyond the colours.
pub(super) fn note(comparison: &Comparison, tolerance_mm: Option<f64>) -> String {
    let Some(part) = shown(comparison) else {
        return String::new();
    };
    let Some(Summary { mean, p95, .. }) = part.mesh_to_truth else {
        return String::new();
    };
    let (name, [mean, p95]) = (name_of(part.region), [mean, p95].map(|x| x * 1e3));
    let within = part.within_tolerance.zip(tolerance_mm);
    let within = within.map(|(share, mm)| format!("; {:.1} % within ±{mm} mm", share * 100.0));
    let Histogram {
        counts,
        below,
        above,
        ..
    } = &part.histogram;
    let beyond =
        (below + above) as f64 / (below + above + counts.iter().sum::<usize>()).max(1) as f64;
    let within = within.unwrap_or_default();
    format!(
        "{name}: mean {mean:.3}, p95 {p95:.3} mm{within}; beyond the colours {:.1} %",
        beyond * 100.0
    )
}

const HEAD: &str = "                            mean      rms   median      p95      p99      max     bias    points";

impl CompareReport {
    /// Sizes of both, points of the alignment, and the table of all distances.
    pub(super) fn details(&self) -> String {
        let size = |(what, shape): (&str, &ShapeReport)| {
            let ([x, y, z], faces) = (shape.size_mm, counted(shape.faces, "face", "faces"));
            format!(
                "{what:5} {}: {faces}, {x:.1} x {y:.1} x {z:.1} mm",
                shape.file
            )
        };
        let mut lines = vec![size(("mesh", &self.mesh)), size(("truth", &self.truth))];
        lines.extend(self.alignment.as_ref().and_then(AlignmentReport::details));
        lines.push(format!(
            "distances in mm; bias +: too much material; {:.2} points/mm2",
            self.after.density_per_mm2
        ));
        lines.push(HEAD.to_owned());
        match &self.before {
            Some(before) => lines.push(format!("before\n{before}\nafter\n{}", self.after)),
            None => lines.push(self.after.to_string()),
        }
        lines.join("\n")
    }
}

/// Verdict: deviation of the mesh, of the touched part if known, and of the mesh before; then the
/// alignment.
impl fmt::Display for CompareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = [("touched", "where touched"), ("all", "over all")];
        let shown = |(region, place)| Some((region, place, self.after.row(region)?));
        match places.into_iter().find_map(shown) {
            None => writeln!(f, "the mesh shows nothing of the true surface")?,
            Some((
                region,
                place,
                (
                    row,
                    SummaryReport {
                        mean_mm, p95_mm, ..
                    },
                ),
            )) => {
                let before = self.before.as_ref().and_then(|before| before.row(region));
                write!(
                    f,
                    "the mesh is off by {mean_mm:.3} mm on average {place}, 95 % within {p95_mm:.3} mm"
                )?;
                if let Some((
                    _,
                    SummaryReport {
                        mean_mm, p95_mm, ..
                    },
                )) = before
                {
                    write!(
                        f,
                        "; before: mean {mean_mm:.3} mm, 95 % within {p95_mm:.3} mm"
                    )?;
                }
                let before = before.map_or(String::new(), |(row, _)| {
                    format!("; before: {}", row.worst())
                });
                writeln!(f, "\n{}{before}", row.worst())?;
            }
        }
        write!(
            f,
            "the mesh shows {:.1} % of the true surface",
            (1.0 - self.after.unseen_share) * 100.0
        )?;
        self.alignment
            .iter()
            .try_for_each(|alignment| write!(f, "\n{alignment}"))
    }
}

impl ComparisonReport {
    /// Row of a region and its distances to the truth, if any.
    fn row(&self, region: &str) -> Option<(&DeviationRow, &SummaryReport)> {
        let row = self.regions.iter().find(|row| row.region == region)?;
        Some((row, row.mesh_to_truth.as_ref()?))
    }
}

impl DeviationRow {
    /// Acceptance figures of a part.
    fn worst(&self) -> String {
        let errors = self.mesh_to_truth.as_ref();
        let errors = errors.map(|errors| {
            format!(
                "rms {:.3} mm, at most {:.3} mm",
                errors.rms_mm, errors.max_mm
            )
        });
        let within = self
            .within_tolerance_share
            .map(|share| format!("{:.1} % in tolerance", share * 100.0));
        errors
            .into_iter()
            .chain(within)
            .collect::<Vec<_>>()
            .join(", ")
    }
}

impl fmt::Display for ComparisonReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            &self
                .regions
                .iter()
                .map(DeviationRow::to_string)
                .collect::<Vec<_>>()
                .join("\n"),
        )
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
        for (what, summary) in rows
            .iter()
            .filter_map(|(what, summary)| Some((what, (*summary).as_ref()?)))
        {
            writeln!(f, "{region:9} {what:14} {summary}")?;
            region = "";
        }
        if let Some(share) = self.within_tolerance_share {
            writeln!(f, "{region:9} in tolerance   {:.2} %", share * 100.0)?;
        }
        match &self.normals {
            Some(NormalsReport {
                median_deg,
                p95_deg,
                flipped_share,
            }) => write!(
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
        for x in [
            self.mean_mm,
            self.rms_mm,
            self.median_mm,
            self.p95_mm,
            self.p99_mm,
            self.max_mm,
        ] {
            write!(f, "{x:9.4}")?;
        }
        match self.bias_mm {
            Some(bias_mm) => write!(f, "{bias_mm:+9.4}{:10}", self.points),
            None => write!(f, "{:9}{:10}", "", self.points),
        }
    }
}
