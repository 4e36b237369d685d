//! Coverage as a chapter of the report.

use super::{Coverage, CoverageKind, HONEST, KindInWorld, SIGMAS_95};
use crate::table::not_run;
use crate::{Axis, Chapter, Figure, LineStroke, Mark, Series, Table, TableCell};
use itertools::Itertools;
use touchup_document::number::three_digits;
use touchup_sim::SimWorld;

/// Marks of a cumulative curve, and its end.
const MARKS: usize = 60;
const LARGEST_SCORE: f64 = 6.0;
/// Half the number of Simpson intervals per unit of the normal density's argument.
const PARTS: usize = 20;

impl Coverage {
    /// Chapter of the report.
    pub fn chapter(&self) -> Chapter {
        let text = std::iter::once(self.introduction()).chain(not_run(&self.failed));
        let is_of_feature = |kind: CoverageKind| !kind.is_of_vertices();
        let figures = vec![
            self.figure("coverage_rms"),
            self.curves(
                "coverage_vertices",
                "vertices",
                CoverageKind::is_of_vertices,
            ),
            self.curves("coverage_features", "features", is_of_feature),
        ];
        let title = "Coverage: errors over stated uncertainties";
        Chapter::of(title, text.collect(), figures, vec![self.table()])
    }

    fn introduction(&self) -> String {
        format!(
            "A plate with two holes, a slot, a boss and a step, scanned and touched in the simulated worlds {}, seeds {} to {} of each. \
             A world draws tip, bending, clocks, tare, friction, sensors, scan and hand; the program is told what a calibration leaves, \
             and that uncertainty with it. Seed by seed the hand goes around in the holes, into none, half around, and a third of the way. \
             Error over stated standard deviation has a root mean square of 1 where the statement holds; 0.8 to 1.25 is demanded, and \
             93 % of the vertices within 1.96 standard deviations, at edges and rims 90 %. The root mean square of n numbers is itself known to 1/√(2n).",
            self.params
                .worlds
                .iter()
                .map(|world| world.name())
                .join(", "),
            self.params.seeds.start(),
            self.params.seeds.end(),
        )
    }

    /// Violations of the demands, a line each.
    pub fn outside(&self) -> Vec<String> {
        let line = |of: &KindInWorld| {
            let rms = three_digits(of.rms_score()?);
            let within = of.share_within().map_or(String::new(), |share| {
                format!(", {:.0} % within", share * 100.0)
            });
            let (kind, world, count) = (of.kind.name(), of.world.name(), of.count());
            Some(format!("{kind} in {world} ({rms}{within}, n {count})"))
        };
        let outside = self.kinds.iter().filter(|of| of.holds() == Some(false));
        outside.filter_map(line).collect()
    }

    fn table(&self) -> Table {
        let percent = |share: Option<f64>| share.map(|share| share * 100.0);
        Table::of("coverage", "Error over stated standard deviation", &self.kinds)
            .column("world", |of| of.world.name())
            .column("number", |of| of.kind.name())
            .column("n", KindInWorld::count)
            .column("mean error, mm", |of| of.mean_error().map(|error| error * 1e3))
            .column("rms of error / std", KindInWorld::rms_score)
            .column("within 1.96 std, %", |of| percent(of.share_within()))
            .column("bounds", |of| of.bounds()[0])
            .column("of them contradicted", |of| of.bounds()[1])
            .column("verdict", |of| match of.holds() {
                None => TableCell::Empty,
                Some(true) => TableCell::from("holds"),
                Some(false) => TableCell::from("OUTSIDE"),
            })
            .caption(
                "Signed distance of vertices to the true surface; numbers of features against the drawing. n: those with a stated standard \
                 deviation; positions count once for each direction across the axis. A bound is contradicted where the truth is below \
                 it by more than 1.96 of its standard deviations.",
            )
    }

    /// Root mean square of each kind, one series a world.
    fn figure(&self, id: &str) -> Figure {
        let worlds = self.params.worlds.iter().map(|&world| {
            let mark =
                |of: &KindInWorld| Some(Mark::at(of.kind as usize as f64 + 1.0, of.rms_score()?));
            Series::new(
                world.name(),
                LineStroke::Marks,
                self.of(world).filter_map(mark),
            )
        });
        let ends = [0.5, CoverageKind::ALL.len() as f64 + 0.5];
        let band = HONEST
            .map(|level| Series::dashed(three_digits(level), ends.map(|x| Mark::at(x, level))));
        let mut names = (1..)
            .zip(CoverageKind::ALL)
            .map(|(i, kind)| format!("{i} {}", kind.name()));
        Figure::curves(id, worlds.chain(band))
            .title("Root mean square of error over stated standard deviation")
            .axes(
                Axis::linear("kind of number", "kind"),
                Axis::log("rms of error / stated std", "rms_score"),
            )
            .caption(format!(
                "Dashed: the demanded band. Kinds: {}.",
                names.join(", ")
            ))
    }

    /// Share of the numbers within a multiple of the standard deviation.
    fn curves(&self, id: &str, what: &str, is_meant: fn(CoverageKind) -> bool) -> Figure {
        let at = |i: usize| LARGEST_SCORE * i as f64 / MARKS as f64;
        let worlds = self.params.worlds.iter().filter_map(|&world| {
            let of = self.of(world).filter(|of| is_meant(of.kind));
            let scores = of.flat_map(KindInWorld::scores).map(f64::abs);
            let scores = scores.sorted_by(f64::total_cmp).collect_vec();
            let share =
                |x: f64| scores.partition_point(|score| *score <= x) as f64 / scores.len() as f64;
            let marks = (0..=MARKS).map(|i| Mark::at(at(i), share(at(i))));
            (!scores.is_empty()).then(|| Series::joined(world.name(), marks))
        });
        let scaled = HONEST.into_iter().chain([1.0]).map(|factor| {
            let marks = (0..=MARKS).map(|i| Mark::at(at(i), normal_within(at(i) / factor)));
            Series::dashed(format!("normal, rms {}", three_digits(factor)), marks)
        });
        Figure::curves(id, worlds.chain(scaled))
            .title(format!("Share of {what} within so many stated standard deviations"))
            .axes(Axis::linear("|error| / stated std", "score"), Axis::linear("share", "share"))
            .caption(format!(
                "Dashed: normal distributions whose root mean square is 0.8, 1 and 1.25 of what is stated; 95 % are within {SIGMAS_95}."
            ))
    }

    fn of(&self, world: SimWorld) -> impl Iterator<Item = &KindInWorld> {
        self.kinds.iter().filter(move |of| of.world == world)
    }
}

/// Share of a normal distribution within ± x standard deviations: integral of its density by
/// Simpson's rule.
fn normal_within(x: f64) -> f64 {
    let parts = 2 * PARTS * (1 + x as usize);
    let density = |t: f64| (-t * t / 2.0).exp() * (2.0 / std::f64::consts::PI).sqrt();
    let weight = |i: usize| match i {
        _ if i == 0 || i == parts => 1.0,
        _ if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let step = x / parts as f64;
    let sum: f64 = (0..=parts)
        .map(|i| weight(i) * density(i as f64 * step))
        .sum();
    sum * step / 3.0
}
