//! Convergence as a chapter of the report.

use super::{Convergence, Decay, MeshErrors, OneFaceRun, OneFaceSample, Rule, SweepRun};
use crate::table::not_run;
use crate::{Axis, Chapter, Figure, LineStroke, Mark, Series, Table};
use itertools::Itertools;
use touchup_document::number::range;

/// Errors of one face below this value are roundings.
const DRAWN_FROM: f64 = 1e-12;
/// Points of a law's curve between two sweeps.
const STEPS: usize = 8;

impl Convergence {
    /// Chapter of the report.
    pub fn chapter(&self) -> Chapter {
        let text = std::iter::once(self.introduction())
            .chain(Rule::ALL.map(|rule| self.verdict(rule)))
            .chain(not_run(&self.failed))
            .chain(self.one_face.iter().map(one_face_text));
        let mut figures = Rule::ALL.map(|rule| self.figure(rule)).to_vec();
        if !self.one_face.is_empty() {
            figures.extend([
                self.one_face_paths(),
                self.one_face_distances(),
                self.one_face_normals(),
            ]);
        }
        let title = "Convergence from sweep to sweep, and of one face";
        Chapter::of(title, text.collect(), figures, vec![self.table()])
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
        let runs = self.of(rule).collect_vec();
        let converged = runs.iter().filter(|run| run.has_converged());
        let blown_up = runs.iter().filter(|run| run.has_blown_up).count();
        let (name, fewer, all) = (
            capitalised(rule.name()),
            converged.clone().count(),
            runs.len(),
        );
        let mut text = format!(
            "{name}: {fewer} of {all} scans ended with less error than they began with, {blown_up} blew up."
        );
        let left = converged.filter_map(|run| {
            Some(run.errors.last()?.distance_mm / run.errors.first()?.distance_mm)
        });
        if let Some((least, most)) = range(left) {
            let (least, most, sweeps) = (least * 100.0, most * 100.0, self.sweeps);
            text += &format!(
                " Where it converged, {least:.1} to {most:.1} % of the mean error is left after {sweeps} sweeps."
            );
        }
        let (wins, fits) = self.power_wins(rule);
        let mean = |r_squared: fn(&Decay) -> Option<f64>| {
            let all = runs.iter().filter_map(|run| r_squared(run.decay.as_ref()?));
            let all = all.collect_vec();
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        let power = mean(|decay| decay.power.r_squared);
        if let Some((power, exponential)) = power.zip(mean(|decay| decay.exponential.r_squared)) {
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
            let marks = (0..).zip(&run.errors);
            let marks = marks.map(|(sweep, error)| Mark::at(f64::from(sweep), error.distance_mm));
            let laws = run
                .decay
                .iter()
                .flat_map(|decay| drawn(decay, &name, run.errors.len() - 1));
            [Series::new(&name, LineStroke::Marks, marks)]
                .into_iter()
                .chain(laws)
                .collect_vec()
        });
        let (id, measure) = match rule {
            Rule::Paper => ("published", "face by face, as the paper measures"),
            Rule::Robust => ("robust", "from the faces' middles to the surface"),
        };
        Figure::curves(format!("convergence_{id}"), series)
            .title(format!("Mean distance error from sweep to sweep, {}", rule.name()))
            .axes(Axis::linear("sweep", "sweep"), Axis::log("mean distance error, mm", "distance_error_mm"))
            .caption(format!(
                "Marks: measured {measure}; sweep 0 is the scan. Dashed: both laws, fitted from sweep 1 on. A \
                 straight line is an exponential. One run of each scan: the same samples give the same mesh to the \
                 last bit."
            ))
    }

    /// Fig 6.
    fn one_face_paths(&self) -> Figure {
        let series = self.one_face.iter().flat_map(|run| {
            let name = one_face_name(run);
            let path = |of: fn(&OneFaceSample) -> [f64; 3]| {
                run.samples
                    .iter()
                    .map(move |sample| Mark::at(of(sample)[0], of(sample)[2]))
            };
            [
                Series::joined(format!("{name}, b*"), path(|sample| sample.barycentre_mm)),
                Series::dashed(format!("{name}, tip"), path(|sample| sample.tip_mm)),
            ]
        });
        Figure::curves("one_face_path", series)
            .title("One face: barycentre and tip, seen from the side")
            .axes(Axis::linear("x, mm", "x_mm"), Axis::linear("z, mm", "z_mm"))
            .caption(
                "The paper's Fig 6: the true plane is z = 0. b* goes straight along n*(0), and comes to rest in the plane but not \
                 where the true barycentre is.",
            )
    }

    /// Fig 7, upper half.
    fn one_face_distances(&self) -> Figure {
        self.one_face_errors("one_face_distance", "distance error, mm", "distance_error_mm", |sample| {
            sample.distance_mm
        })
        .title("One face: distance between the planes")
        .caption("The paper's Fig 7: |(b* - b)·n|. The face passes the plane within half a second; while it leans, it draws the tip aside and \
                 rests off the plane, and comes back as the normal turns. Errors below 1e-12 are drawn there.")
    }

    /// Fig 7, lower half.
    fn one_face_normals(&self) -> Figure {
        self.one_face_errors("one_face_normal", "normal deviation, degrees", "normal_deg", |sample| sample.normal_deg)
            .title("One face: angle between the normals")
            .caption("The paper's Fig 7, as an angle: |n* x n| would be zero for a face that is turned over. It waits for the distance.")
    }

    fn one_face_errors(
        &self,
        id: &str,
        label: &str,
        column: &str,
        error: fn(&OneFaceSample) -> f64,
    ) -> Figure {
        let series = self.one_face.iter().map(|run| {
            let mark =
                |sample: &OneFaceSample| Mark::at(sample.time_s, error(sample).max(DRAWN_FROM));
            Series::dashed(one_face_name(run), run.samples.iter().map(mark))
        });
        Figure::curves(id, series).axes(Axis::linear("time, s", "time_s"), Axis::log(label, column))
    }

    fn table(&self) -> Table {
        let error_at =
            |sweep: usize| move |run: &SweepRun| Some(run.errors.get(sweep)?.distance_mm);
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

fn one_face_name(run: &OneFaceRun) -> String {
    format!("leaning {} degrees", run.tilt_deg)
}

/// Time at which each error is down to a tenth, and the residual at the end.
fn one_face_text(run: &OneFaceRun) -> String {
    let tenth = |error: fn(&OneFaceSample) -> f64| {
        let time_s = run.time_to_share(0.1, error);
        time_s.map_or("not within the run".to_owned(), |time_s| {
            format!("after {time_s:.2} s")
        })
    };
    let distance = tenth(|sample| sample.distance_mm);
    let normal = tenth(|sample| sample.normal_deg);
    let left = run.samples.last().map_or(String::new(), |last| {
        let OneFaceSample {
            time_s,
            distance_mm,
            normal_deg,
            ..
        } = last;
        format!("; after {time_s:.0} s {distance_mm:.1e} mm and {normal_deg:.1e} degrees are left")
    });
    format!(
        "One face, {}: the distance is down to a tenth for good {distance}, the angle {normal}{left}.",
        one_face_name(run)
    )
}

/// Curves of both laws, from sweep 1 to the last.
fn drawn(decay: &Decay, name: &str, sweeps: usize) -> [Series; 2] {
    let at = |step: usize| 1.0 + step as f64 / STEPS as f64;
    [("exponential", 0), ("power law", 1)].map(|(law, which)| {
        let marks = (0..=STEPS * (sweeps - 1))
            .map(at)
            .map(|sweep| Mark::at(sweep, decay.at(sweep)[which]));
        Series::dashed(format!("{name}, {law}"), marks)
    })
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
