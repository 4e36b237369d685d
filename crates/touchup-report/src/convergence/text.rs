//! Convergence as a chapter of the report.

use super::{Convergence, Decay, Law, MeshErrors, Rule, SweepRun};
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Table, TableCell};

/// Points of a drawn law between two sweeps.
const STEPS: usize = 8;

impl Rule {
    fn name(self) -> &'static str {
        match self {
            Self::Paper => "published rule",
            Self::Robust => "robust mode",
        }
    }
}

impl Convergence {
    /// As a part of the report.
    pub fn chapter(&self) -> Chapter {
        let mut text = vec![self.introduction()];
        text.extend([Rule::Paper, Rule::Robust].into_iter().map(|rule| self.verdict(rule)));
        text.extend(self.failed.iter().map(|reason| format!("Not run: {reason}.")));
        Chapter {
            title: "Convergence from sweep to sweep".to_owned(),
            text,
            figures: vec![self.figure(Rule::Paper), self.figure(Rule::Robust)],
            tables: vec![self.table()],
        }
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
        let mut text = format!(
            "{}: {} of {} scans ended with less error than they began with, {blown_up} blew up.",
            capitalised(rule.name()),
            converged.len(),
            runs.len()
        );
        let shares: Vec<f64> = converged.iter().filter_map(|run| share_left(run)).collect();
        if let Some((least, most)) = range(&shares) {
            text += &format!(
                " Where it converged, {:.1} to {:.1} % of the mean error is left after {} sweeps.",
                least * 100.0,
                most * 100.0,
                self.sweeps
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
            let exponents: Vec<f64> = runs.iter().filter_map(|run| Some(run.decay?.power.rate)).collect();
            let (least, most) = range(&exponents).unwrap_or_default();
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
            let mark =
                |(sweep, error): (usize, &MeshErrors)| Mark { x: (sweep as f64).into(), y: error.distance_mm.into() };
            let measured = Series {
                name: name.clone(),
                stroke: LineStroke::Marks,
                marks: run.errors.iter().enumerate().map(mark).collect(),
            };
            let laws = run.decay.iter().flat_map(|decay| drawn(decay, &name, run.errors.len() - 1)).collect::<Vec<_>>();
            [measured].into_iter().chain(laws)
        });
        let (id, measure) = match rule {
            Rule::Paper => ("convergence_published", "face by face, as the paper measures"),
            Rule::Robust => ("convergence_robust", "from the faces' middles to the surface"),
        };
        Figure {
            id: id.to_owned(),
            title: format!("Mean distance error from sweep to sweep, {}", rule.name()),
            caption: format!(
                "Marks: measured {measure}; sweep 0 is the scan. Dashed: both laws, fitted from sweep 1 on. A straight line \
                 is an exponential. One run of each scan: the same samples give the same mesh to the last bit."
            ),
            x: Axis::linear("sweep", "sweep"),
            y: Axis::log("mean distance error, mm", "distance_error_mm"),
            drawing: Drawing::Curves(series.collect()),
        }
    }

    fn table(&self) -> Table {
        let heads = [
            "rule",
            "scan",
            "edge, mm",
            "sweeps",
            "error before, mm",
            "after 1 sweep, mm",
            "at the end, mm",
            "normals before, deg",
            "normals at the end, deg",
            "flipped at the end",
            "power law: exponent",
            "power law: R²",
            "exponential: rate a sweep",
            "exponential: R²",
            "remark",
        ];
        Table {
            id: "convergence".to_owned(),
            title: "Sweeps and fits".to_owned(),
            caption:
                "Mean distance and mean angle of the faces; R² of the logarithm of the error, from sweep 1 on. A scan \
                      that blew up has no fit, and ends where its error was twice that of its start."
                    .to_owned(),
            heads: heads.map(str::to_owned).to_vec(),
            rows: self.runs.iter().map(row).collect(),
        }
    }
}

fn row(run: &SweepRun) -> Vec<TableCell> {
    let number =
        |error: Option<&MeshErrors>, of: fn(&MeshErrors) -> f64| error.map_or(TableCell::Empty, |e| of(e).into());
    let (first, second, last) = (run.errors.first(), run.errors.get(1), run.errors.last());
    let distance = |error: &MeshErrors| error.distance_mm;
    let law = |of: fn(&Decay) -> Law| {
        run.decay.as_ref().map(of).map_or([TableCell::Empty, TableCell::Empty], |law| {
            [law.rate.into(), law.r_squared.map_or(TableCell::Empty, TableCell::from)]
        })
    };
    let mut cells = vec![
        run.rule.name().into(),
        (run.seed as f64).into(),
        run.edge_mm.into(),
        (run.errors.len().saturating_sub(1) as f64).into(),
        number(first, distance),
        number(second, distance),
        number(last, distance),
        number(first, |error| error.normal_deg),
        number(last, |error| error.normal_deg),
        number(last, |error| error.flipped as f64),
    ];
    cells.extend(law(|decay| decay.power));
    cells.extend(law(|decay| decay.exponential));
    cells.push(run.ended.clone().map_or(TableCell::Empty, TableCell::from));
    cells
}

/// Both laws, from sweep 1 to the last.
fn drawn(decay: &Decay, name: &str, sweeps: usize) -> [Series; 2] {
    let at = |step: usize| 1.0 + step as f64 / STEPS as f64;
    [("exponential", 0), ("power law", 1)].map(|(law, which)| {
        let steps = (0..=STEPS * (sweeps - 1)).map(at);
        let marks = steps.map(|sweep| Mark { x: sweep.into(), y: decay.at(sweep)[which].into() }).collect();
        Series { name: format!("{name}, {law}"), stroke: LineStroke::Dashed, marks }
    })
}

/// The share of the error that is left at the end.
fn share_left(run: &SweepRun) -> Option<f64> {
    Some(run.errors.last()?.distance_mm / run.errors.first()?.distance_mm)
}

fn range(values: &[f64]) -> Option<(f64, f64)> {
    let least = values.iter().copied().reduce(f64::min)?;
    Some((least, values.iter().copied().reduce(f64::max)?))
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
