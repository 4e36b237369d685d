//! The chapter of the report.

use super::{
    Cost, LARGEST_RATIO, LAW_UP_TO, LEAST_REPLAY_PER_S, LogLaw, PartCost, PerSample, READING, ReplaySpeed, SeldomCost,
    SizeCost, StageCost,
};
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Spread, Table, TableCell};

/// A time within this of the law is no more than the law.
const NO_MORE: f64 = 1.05;
/// A difference of whole pushes below this share of a push cannot be distinguished from noise.
const DISCERNIBLE: f64 = 0.02;

impl Cost {
    /// As it is printed.
    pub fn chapter(&self) -> Chapter {
        Chapter {
            title: "Cost of each stage".to_owned(),
            text: [self.size_text(), self.ratio_text(), self.part_text(), self.replay_text(), self.count_text()]
                .into_iter()
                .flatten()
                .collect(),
            figures: vec![self.size_figure()],
            tables: vec![
                self.size_table(),
                self.part_table(),
                self.stage_table(),
                self.seldom_table(),
                self.replay_table(),
            ],
        }
    }

    fn size_figure(&self) -> Figure {
        let series = |name: &str, time: fn(&SizeCost) -> &PerSample| {
            let marks =
                self.sizes.iter().map(|size| Mark { x: (size.faces as f64).into(), y: time(size).time_ns.times(1e-3) });
            Series { name: name.to_owned(), stroke: LineStroke::Joined, marks: marks.collect() }
        };
        let law = |name: &str, law: Option<LogLaw>| {
            let law = law?;
            let marks = self
                .sizes
                .iter()
                .map(|size| Mark { x: (size.faces as f64).into(), y: (law.at(size.faces) * 1e-3).into() });
            Some(Series { name: name.to_owned(), stroke: LineStroke::Dashed, marks: marks.collect() })
        };
        let mut curves = vec![
            series("hand-written loop", |size| &size.minimal),
            series("cheapest scene", |size| &size.barest),
            series("default scene, scan of 1 mm edges", |size| &size.default_larger),
            series("default scene, scan of 0.3 m", |size| &size.default_finer),
        ];
        curves.extend(law("law of the cheapest scene", self.barest_law));
        curves.extend(law("law of the default scene, 1 mm edges", self.default_law));
        Figure {
            id: "push_time_by_faces".to_owned(),
            title: "One push against the size of the scan".to_owned(),
            caption: format!(
                "Median and p10–p90 of blocks of samples, all cases in turns. Dashed: t = a + b ln F, fitted to the scans of \
                 up to {LAW_UP_TO} faces. What lies above it is the cache; where a scan of one size gets finer, more \
                 vertices move with each touch.",
            ),
            x: Axis::log("faces of the scan", "faces"),
            y: Axis::log("time of one push, µs", "push_us"),
            drawing: Drawing::Curves(curves),
        }
    }

    fn size_text(&self) -> Option<String> {
        let (first, last) = (self.sizes.first()?, self.sizes.last()?);
        let more = last.faces as f64 / first.faces as f64;
        let line = |name: &str, law: Option<LogLaw>, time: fn(&SizeCost) -> &PerSample| {
            let (from, to) = (time(first).time_ns.median, time(last).time_ns.median);
            let expected = law.map_or(String::new(), |law| {
                let times = to / law.at(last.faces);
                let verdict = if times <= NO_MORE {
                    "no more than the logarithm says".to_owned()
                } else {
                    format!("beyond the logarithm, with {:.0} MB of mesh and tree", last.bytes() * 1e-6)
                };
                format!(" ({times:.2} times what the logarithmic law of the small scans foretells: {verdict})")
            });
            format!("{name} {:.2} µs instead of {:.2} µs{expected}", to * 1e-3, from * 1e-3)
        };
        Some(format!(
            "On a scan of {more:.0} times the faces ({} instead of {}) the cheapest scene takes {}; {}. A scan that grows \
             finer and not larger is another matter: the region that follows the ball then holds {:.0} vertices instead of \
             {:.0}, and the default scene takes {:.1} µs instead of {:.1} µs.",
            last.faces,
            first.faces,
            line("", self.barest_law, |size| &size.barest).trim_start(),
            line("the default scene, with edges of 1 mm on both,", self.default_law, |size| &size.default_larger),
            last.moved_finer,
            first.moved_finer,
            last.default_finer.time_ns.median * 1e-3,
            first.default_finer.time_ns.median * 1e-3,
        ))
    }

    /// The largest of all sizes.
    pub fn worst_ratio(&self) -> Option<f64> {
        self.sizes.iter().map(|size| size.barest_to_minimal.median).max_by(f64::total_cmp)
    }

    fn ratio_text(&self) -> Option<String> {
        let worst = self.worst_ratio()?;
        let keeping = self.sizes.iter().map(|size| size.barest_to_keeping.median).max_by(f64::total_cmp)?;
        let is_within = worst <= LARGEST_RATIO;
        Some(format!(
            "What a scene does not name costs nothing: the cheapest scene takes at most {worst:.3} times as long as the loop \
             that is written by hand, on the same samples in turns; {} the {LARGEST_RATIO} that is allowed. Against the same \
             loop made to keep what it looked up, as the refiner does (which boxes to bring up to date, with a margin, and what \
             is near), it is {keeping:.3} times.",
            if is_within { "within" } else { "this misses" }
        ))
    }

    fn part_text(&self) -> Option<String> {
        let faces = self.parts.iter().map(|part| part.faces).max()?;
        let parts = self.parts.iter().filter(|part| part.faces == faces).map(|part| {
            let PartCost { part: name, cost_ns, without, .. } = part;
            let is_lost = cost_ns.median.abs() < DISCERNIBLE * without.time_ns.median;
            let noise = if is_lost { " (within the noise)" } else { "" };
            format!("{name} {:+.0} ns{noise}", cost_ns.median)
        });
        Some(format!(
            "What the parts cost, as the difference of whole pushes with and without them on {faces} faces: {}.",
            parts.collect::<Vec<_>>().join(", ")
        ))
    }

    /// Of the scenes that were replayed the slowest, samples/s.
    pub fn slowest_replay_per_s(&self) -> Option<f64> {
        let moving = self.replays.iter().filter(|replay| replay.scene != READING);
        let speeds = moving.map(|replay| replay.samples_per_s.median);
        speeds.min_by(f64::total_cmp)
    }

    fn replay_text(&self) -> Option<String> {
        let replays = self.replays.iter().map(|ReplaySpeed { scene, edge_mm, samples_per_s, .. }| {
            let verdict = match samples_per_s.median >= LEAST_REPLAY_PER_S {
                _ if scene == READING => String::new(),
                true => format!(" (holds {LEAST_REPLAY_PER_S:.0})"),
                false => format!(" (misses {LEAST_REPLAY_PER_S:.0})"),
            };
            format!("{:.0} samples per second, scene {scene}, edges of {edge_mm:.2} mm{verdict}", samples_per_s.median)
        });
        let faces = self.replays.first()?.faces;
        Some(format!(
            "A recording is replayed by one thread, from the file to the moved mesh of {faces} faces: {}.",
            replays.collect::<Vec<_>>().join("; ")
        ))
    }

    fn count_text(&self) -> Option<String> {
        let most = self
            .sizes
            .iter()
            .flat_map(|size| [&size.barest, &size.default_finer, &size.default_larger])
            .filter_map(|push| push.allocations)
            .max_by(f64::total_cmp);
        Some(match most {
            Some(most) => {
                let bound = if most == 0.0 { "never asks".to_owned() } else { format!("asks {most:.2e} times") };
                format!(
                    "A push that is warm {bound} for memory, counted by the allocator itself over every timed push."
                )
            }
            None => "This program does not count allocations, so their columns are empty.".to_owned(),
        })
    }

    fn size_table(&self) -> Table {
        let rows = self.sizes.iter().map(|size| {
            vec![
                TableCell::Number(size.faces as f64),
                size.minimal.time_ns.into(),
                size.barest.time_ns.into(),
                size.barest_to_minimal.into(),
                size.keeping.time_ns.into(),
                size.barest_to_keeping.into(),
                size.default_larger.time_ns.into(),
                size.default_finer.time_ns.into(),
                size.moved_finer.into(),
                optional(size.default_larger.allocations),
                size.mesh_bytes_per_face.into(),
                size.tree_bytes_per_face.into(),
                size.tree_build_ms.into(),
            ]
        });
        table(
            "push_by_faces",
            "A push, by size of the scan",
            "Cheapest scene and hand-written loop on a plate of 0.3 m; the default scene without patch, on a plate of edges of \
             1 mm and on the one of 0.3 m. Memory is counted from what mesh and tree own.",
            &[
                "faces",
                "hand-written loop, ns",
                "cheapest scene, ns",
                "cheapest / loop",
                "loop that keeps, ns",
                "cheapest / keeping loop",
                "default, 1 mm edges, ns",
                "default, 0.3 m, ns",
                "vertices moved at 0.3 m",
                "allocations",
                "mesh, bytes/face",
                "tree, bytes/face",
                "tree built, ms",
            ],
            rows.collect(),
        )
    }

    fn part_table(&self) -> Table {
        let rows = self.parts.iter().map(|PartCost { part, faces, is_default, with, without, cost_ns }| {
            vec![
                part.as_str().into(),
                TableCell::Number(*faces as f64),
                if *is_default { "yes" } else { "no" }.into(),
                with.time_ns.into(),
                without.time_ns.into(),
                (*cost_ns).into(),
                optional(with.allocations),
                optional(with.allocated_bytes),
            ]
        });
        table(
            "push_by_part",
            "A push with and without each optional part",
            "The default scene without patch on a scan of edges of 1 mm, switched in one part. The cost is the difference block \
             by block; a negative one says that the work of the rest grows without the part.",
            &[
                "part",
                "faces",
                "by default",
                "push with it, ns",
                "push without it, ns",
                "cost, ns",
                "allocations with it",
                "bytes asked for with it",
            ],
            rows.collect(),
        )
    }

    fn stage_table(&self) -> Table {
        let rows = self.stages.iter().map(|StageCost { stage, faces, per_sample }| {
            vec![
                stage.as_str().into(),
                TableCell::Number(*faces as f64),
                per_sample.time_ns.into(),
                optional(per_sample.allocations),
                optional(per_sample.allocated_bytes),
            ]
        });
        table(
            "stages",
            "Stages by themselves, per sample",
            "Each called alone over the samples of the slide, all in turns. What keeps the whole session (touches, recording) \
             asks for memory as it grows. Deformation has no name of its own to be called by: it is what a push takes beyond \
             these.",
            &["stage", "faces", "time, ns", "allocations", "bytes asked for"],
            rows.collect(),
        )
    }

    fn seldom_table(&self) -> Table {
        let rows = self.seldom.iter().map(|SeldomCost { work, faces, time_ms }| {
            vec![work.as_str().into(), TableCell::Number(*faces as f64), (*time_ms).into()]
        });
        table(
            "seldom",
            "What is not done at each sample",
            "Beside the samples, on threads of their own.",
            &["work", "faces", "time, ms"],
            rows.collect(),
        )
    }

    fn replay_table(&self) -> Table {
        let rows = self.replays.iter().map(|ReplaySpeed { scene, faces, edge_mm, samples, samples_per_s }| {
            vec![
                scene.as_str().into(),
                TableCell::Number(*faces as f64),
                (*edge_mm).into(),
                TableCell::Number(*samples as f64),
                (*samples_per_s).into(),
            ]
        });
        table(
            "replay",
            "Replay by one thread",
            "From the MCAP file to the moved mesh: decoding, synchronising, pushing.",
            &["scene", "faces", "edge, mm", "samples", "samples/s"],
            rows.collect(),
        )
    }
}

fn optional(value: Option<f64>) -> TableCell {
    value.map_or(TableCell::Empty, TableCell::Number)
}

fn table(id: &str, title: &str, caption: &str, heads: &[&str], rows: Vec<Vec<TableCell>>) -> Table {
    let [id, title, caption] = [id, title, caption].map(str::to_owned);
    Table { id, title, caption, heads: heads.iter().map(|head| (*head).to_owned()).collect(), rows }
}

impl PerSample {
    /// Of a time alone.
    pub fn of_time(time_ns: Spread) -> Self {
        Self { time_ns, allocations: None, allocated_bytes: None }
    }
}
