//! Convergence as a chapter of the report.

use super::{Convergence, Decay, MeshErrors, Rule, SweepRun};
use crate::number::range;
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Table};

/// Points of a drawn law between two sweeps.
const STEPS: usize = 8;

impl Convergence {
    /// As a part of the report.
    pub fn chapter(&self) -> Chapter {
        let mut text = vec![self.introduction()];
        text.extend(Rule::ALL.into_iter().map(|rule| self.verdict(rule)));
        text.extend(self.failed.iter().map(|reason| format!("Not run: {reason}.")));
        let figures = Rule::ALL.map(|rule| self.figure(rule)).into();
        Chapter::of("Convergence from sweep to sweep", text, figures, vec![self.table()])
    }

    fn introduction(&self) -> String {
        format!(
            "The paper's experiment (Sec 4.3, Fig 11): peaks of 50 x 50 x 20 mm, each vertex off by 3 mm (standard \
             deviation of each coordinate) and 2 mm too high, {} sweeps at most. The published rule is led over every face \
             for 20 s by the paper's guided stylus; the robust mode goes over the square in one raster of a 1.5 mm ball with \
             friction. Both laws are fitted to the logarithm of the mean error from sweep 1 on, so that their R² can be \
             compared.",
            self.sweeps
        )
    }

    /// Result of the runs of one rule.
    fn verdict(&self, rule: Rule) -> String {
        let runs: Vec<&SweepRun> = self.of(rule).collect();
        let converged: Vec<&SweepRun> = runs.iter().copied().filter(|run| run.has_converged()).collect();
        let blown_up = runs.iter().filter(|run| run.has_blown_up).count();
        let (name, fewer, all) = (capitalised(rule.name()), converged.len(), runs.len());
        let mut text =
            format!("{name}: {fewer} of {all} scans ended with less error than they began with, {blown_up} blew up.");
        if let Some((least, most)) = range(
            converged.iter().filter_map(|run| Some(run.errors.last()?.distance_mm / run.errors.first()?.distance_mm)),
        ) {
            let (least, most, sweeps) = (least * 100.0, most * 100.0, self.sweeps);
            text += &format!(
                " Where it converged, {least:.1} to {most:.1} % of the mean error is left after {sweeps} sweeps."
            );
        }
        let (wins, fits) = self.power_wins(rule);
        let mean = |r_squared: fn(&Decay) -> Option<f64>| {
            let all: Vec<f64> = runs.iter().filter_map(|run| r_squared(run.decay.as_ref()?)).collect();
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        if let (Some(power), Some(exponential)) =
            (mean(|decay| decay.power.r_squared), mean(|decay| decay.exponential.r_squared))
        {
            let exponents = runs.iter().filter_map(|run| Some(-run.decay?.power.slope));
            let (least, most) = range(exponents).unwrap_or_default();
            text += &format!(
                " The power law fits better in {wins} of {fits} scans; mean R² {power:.3} for the power law (exponent \
                 {least:.2} to {most:.2}) and {exponential:.3} for the exponential of the paper."
            );
        }
        text
    }

    fn figure(&self, rule: Rule) -> Figure {
        let series = self.of(rule).flat_map(|run| {
            let name = format!("scan {}", run.seed);
            let marks = run.errors.iter().enumerate().map(|(sweep, error)| Mark::at(sweep as f64, error.distance_mm));
            let measured = Series::new(&name, LineStroke::Marks, marks);
            let laws = run.decay.iter().flat_map(|decay| drawn(decay, &name, run.errors.len() - 1)).collect::<Vec<_>>();
            [measured].into_iter().chain(laws)
        });
        let (id, measure) = match rule {
            Rule::Paper => ("convergence_published", "face by face, as the paper measures"),
            Rule::Robust => ("convergence_robust", "from the faces' middles to the surface"),
        };
        Figure::of(id, Drawing::Curves(series.collect()))
            .title(format!("Mean distance error from sweep to sweep, {}", rule.name()))
            .axes(Axis::linear("sweep", "sweep"), Axis::log("mean distance error, mm", "distance_error_mm"))
            .caption(format!(
                "Marks: measured {measure}; sweep 0 is the scan. Dashed: both laws, fitted from sweep 1 on. A \
                 straight line is an exponential. One run of each scan: the same samples give the same mesh to the \
                 last bit."
            ))
    }

    fn table(&self) -> Table {
        let error_at = |sweep: usize| move |run: &SweepRun| Some(run.errors.get(sweep)?.distance_mm);
        let last = |of: fn(&MeshErrors) -> f64| move |run: &SweepRun| run.errors.last().map(of);
        Table::of("convergence", "Sweeps and fits", &self.runs)
            .column("rule", |run| run.rule.name())
            .column("scan", |run| run.seed as f64)
            .column("edge, mm", |run| run.edge_mm)
            .column("sweeps", |run| run.errors.len().saturating_sub(1))
            .column("error before, mm", error_at(0))
            .column("after 1 sweep, mm", error_at(1))
            .column("at the end, mm", last(|error| error.distance_mm))
            .column("normals before, deg", |run| Some(run.errors.first()?.normal_deg))
            .column("normals at the end, deg", last(|error| error.normal_deg))
            .column("flipped at the end", last(|error| error.flipped as f64))
            .column("power law: exponent", |run| Some(-run.decay?.power.slope))
            .column("power law: R²", |run| run.decay?.power.r_squared)
            .column("exponential: rate a sweep", |run| Some(-run.decay?.exponential.slope))
            .column("exponential: R²", |run| run.decay?.exponential.r_squared)
            .column("remark", |run| run.ended.as_deref())
            .caption(
                "Mean distance and mean angle of the faces; R² of the logarithm of the error, from sweep 1 on. A scan \
                 that blew up has no fit, and ends where its error was twice that of its start.",
            )
    }
}

/// Both laws, from sweep 1 to the last.
fn drawn(decay: &Decay, name: &str, sweeps: usize) -> [Series; 2] {
    let at = |step: usize| 1.0 + step as f64 / STEPS as f64;
    [("exponential", 0), ("power law", 1)].map(|(law, which)| {
        let marks = (0..=STEPS * (sweeps - 1)).map(at).map(|sweep| Mark::at(sweep, decay.at(sweep)[which]));
        Series::new(format!("{name}, {law}"), LineStroke::Dashed, marks)
    })
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
