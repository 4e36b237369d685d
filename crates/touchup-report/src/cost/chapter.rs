//! The chapter of the report.

use super::{
    Cost, LARGEST_RATIO, LAW_UP_TO, LEAST_REPLAY_PER_S, LogLaw, PartCost, PerSample, READING, ReplaySpeed, SizeCost,
};
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Spread, Table};

/// A time within this of the law is no more than the law.
const NO_MORE: f64 = 1.05;
/// A difference of whole pushes below this share of a push cannot be distinguished from noise.
const DISCERNIBLE: f64 = 0.02;

impl Cost {
    /// As it is printed.
    pub fn chapter(&self) -> Chapter {
        let texts = [self.size_text(), self.ratio_text(), self.part_text(), self.replay_text()];
        let text = texts.into_iter().flatten().chain([self.count_text()]).collect();
        Chapter::of("Cost of each stage", text, vec![self.size_figure()], self.tables())
    }

    fn size_figure(&self) -> Figure {
        let curve = |name: &str, stroke: LineStroke, time: &dyn Fn(&SizeCost) -> Spread| {
            let marks = self.sizes.iter().map(|size| Mark::at(size.faces as f64, time(size).times(1e-3)));
            Series::new(name, stroke, marks)
        };
        let series =
            |name, time: fn(&SizeCost) -> &PerSample| curve(name, LineStroke::Joined, &|size| time(size).time_ns);
        let law = |name, law: Option<LogLaw>| {
            law.map(|law| curve(name, LineStroke::Dashed, &|size| law.at(size.faces).into()))
        };
        let mut curves = vec![
            series("hand-written loop", |size| &size.minimal),
            series("cheapest scene", |size| &size.barest),
            series("default scene, scan of 1 mm edges", |size| &size.default_larger),
            series("default scene, scan of 0.3 m", |size| &size.default_finer),
        ];
        curves.extend(law("law of the cheapest scene", self.barest_law));
        curves.extend(law("law of the default scene, 1 mm edges", self.default_law));
        Figure::of("push_time_by_faces", Drawing::Curves(curves))
            .title("One push against the size of the scan")
            .axes(Axis::log("faces of the scan", "faces"), Axis::log("time of one push, µs", "push_us"))
            .caption(format!(
                "Median and p10–p90 of blocks of samples, all cases in turns. Dashed: t = a + b ln F, fitted to the \
                 scans of up to {LAW_UP_TO} faces. What lies above it is the cache; where a scan of one size gets \
                 finer, more vertices move with each touch.",
            ))
    }

    fn size_text(&self) -> Option<String> {
        let (first, last) = (self.sizes.first()?, self.sizes.last()?);
        let more = last.faces as f64 / first.faces as f64;
        let grown = |law: Option<LogLaw>, time: fn(&SizeCost) -> &PerSample| {
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
            format!("{:.2} µs instead of {:.2} µs{expected}", to * 1e-3, from * 1e-3)
        };
        let barest = grown(self.barest_law, |size| &size.barest);
        let default = grown(self.default_law, |size| &size.default_larger);
        let [[few, short], [many, long]] =
            [first, last].map(|size| [size.moved_finer, size.default_finer.time_ns.median * 1e-3]);
        Some(format!(
            "On a scan of {more:.0} times the faces ({} instead of {}) the cheapest scene takes {barest}; the default scene, with \
             edges of 1 mm on both, {default}. A scan that grows finer and not larger is another matter: the region that follows \
             the ball then holds {many:.0} vertices instead of {few:.0}, and the default scene takes {long:.1} µs instead of \
             {short:.1} µs.",
            last.faces, first.faces
        ))
    }

    fn ratio_text(&self) -> Option<String> {
        let largest =
            |ratio: fn(&SizeCost) -> Spread| self.sizes.iter().map(|size| ratio(size).median).max_by(f64::total_cmp);
        let (worst, keeping) = (largest(|size| size.barest_to_minimal)?, largest(|size| size.barest_to_keeping)?);
        Some(format!(
            "A part that a scene says is off costs nothing: the cheapest scene takes at most {worst:.3} times as long as the loop \
             that is written by hand, on the same samples in turns; {} the {LARGEST_RATIO} that is allowed. Against the same \
             loop made to keep what it looked up, as the refiner does (which boxes to bring up to date, with a margin, and what \
             is near), it is {keeping:.3} times.",
            if worst <= LARGEST_RATIO { "within" } else { "this misses" }
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

    fn count_text(&self) -> String {
        let pushes = self.sizes.iter().flat_map(|size| [&size.barest, &size.default_finer, &size.default_larger]);
        let Some(most) = pushes.filter_map(|push| push.allocations).max_by(f64::total_cmp) else {
            return "This program does not count allocations, so their columns are empty.".to_owned();
        };
        let bound = if most == 0.0 { "never asks".to_owned() } else { format!("asks {most:.2e} times") };
        format!("A push that is warm {bound} for memory, counted by the allocator itself over every timed push.")
    }

    fn tables(&self) -> Vec<Table> {
        vec![
            Table::of("push_by_faces", "A push, by size of the scan", &self.sizes)
                .column("faces", |size| size.faces)
                .column("hand-written loop, ns", |size| size.minimal.time_ns)
                .column("cheapest scene, ns", |size| size.barest.time_ns)
                .column("cheapest / loop", |size| size.barest_to_minimal)
                .column("loop that keeps, ns", |size| size.keeping.time_ns)
                .column("cheapest / keeping loop", |size| size.barest_to_keeping)
                .column("default, 1 mm edges, ns", |size| size.default_larger.time_ns)
                .column("default, 0.3 m, ns", |size| size.default_finer.time_ns)
                .column("vertices moved at 0.3 m", |size| size.moved_finer)
                .column("allocations", |size| size.default_larger.allocations)
                .column("mesh, bytes/face", |size| size.mesh_bytes_per_face)
                .column("tree, bytes/face", |size| size.tree_bytes_per_face)
                .column("tree built, ms", |size| size.tree_build_ms)
                .caption(
                    "Cheapest scene and hand-written loop on a plate of 0.3 m; the default scene without patch, on a \
                     plate of edges of 1 mm and on the one of 0.3 m. Memory is counted from what mesh and tree own.",
                ),
            Table::of("push_by_part", "A push with and without each optional part", &self.parts)
                .column("part", |part| part.part.as_str())
                .column("faces", |part| part.faces)
                .column("by default", |part| if part.is_default { "yes" } else { "no" })
                .column("push with it, ns", |part| part.with.time_ns)
                .column("push without it, ns", |part| part.without.time_ns)
                .column("cost, ns", |part| part.cost_ns)
                .column("allocations with it", |part| part.with.allocations)
                .column("bytes asked for with it", |part| part.with.allocated_bytes)
                .caption(
                    "The default scene without patch on a scan of edges of 1 mm, switched in one part. The cost is \
                     the difference block by block; a negative one says that the work of the rest grows without the \
                     part.",
                ),
            Table::of("stages", "Stages by themselves, per sample", &self.stages)
                .column("stage", |stage| stage.stage.as_str())
                .column("faces", |stage| stage.faces)
                .column("time, ns", |stage| stage.per_sample.time_ns)
                .column("allocations", |stage| stage.per_sample.allocations)
                .column("bytes asked for", |stage| stage.per_sample.allocated_bytes)
                .caption(
                    "Each called alone over the samples of the slide, all in turns. What keeps the whole session \
                     (touches, recording) asks for memory as it grows. Deformation has no name of its own to be \
                     called by: it is what a push takes beyond these.",
                ),
            Table::of("seldom", "What is not done at each sample", &self.seldom)
                .column("work", |seldom| seldom.work.as_str())
                .column("faces", |seldom| seldom.faces)
                .column("time, ms", |seldom| seldom.time_ms)
                .caption("Beside the samples, on threads of their own."),
            Table::of("replay", "Replay by one thread", &self.replays)
                .column("scene", |replay| replay.scene.as_str())
                .column("faces", |replay| replay.faces)
                .column("edge, mm", |replay| replay.edge_mm)
                .column("samples", |replay| replay.samples)
                .column("samples/s", |replay| replay.samples_per_s)
                .caption("From the MCAP file to the moved mesh: decoding, synchronising, pushing."),
        ]
    }
}
