//! The chapter of the report.

use super::{
    Cost, LARGEST_RATIO, LAW_UP_TO, LEAST_REPLAY_PER_S, PartCost, READING, RecordingCost,
    ReplaySpeed, SizeCost,
};
use crate::{Axis, Chapter, Figure, Mark, Series, Spread, Table};
use itertools::Itertools;
use touchup_document::number::three_digits;
use touchup_sim::wavy::RADIUS;

/// Largest ratio of a time to the law that still counts as the law.
const NO_MORE: f64 = 1.05;
/// Differences of whole pushes below this share of a push drown in noise.
const DISCERNIBLE: f64 = 0.02;
/// Method of the recordings, below their figures.
const HOW: &str = "The default scene over a recording at 1 kHz: quantiles of the pushes, and all from the scan in memory to the mesh with \
                   its patch, divided by the samples. parry3d: the median of its tree of boxes brought up to date after the vertices \
                   within one radius of the tip moved, and of one closest face; what finds and moves them is not counted, and neither is \
                   the rest of a push.";

impl Cost {
    /// Chapter of the report.
    pub fn chapter(&self) -> Chapter {
        let texts = [
            self.recording_text(),
            self.size_text(),
            self.ratio_text(),
            self.part_text(),
            self.replay_text(),
            Some(self.count_text()),
        ];
        let figures = vec![
            self.edge_figure(),
            self.faces_figure(),
            self.cheapest_figure(),
        ];
        let text = texts.into_iter().flatten().collect();
        Chapter::of("Cost of each stage", text, figures, self.tables())
    }

    fn edge_figure(&self) -> Figure {
        let axis = Axis::log("edge length of the scan, mm", "edge_mm");
        let curves = recording_curves(&self.by_edge, "", |recording| recording.edge * 1e3);
        let faces = self.by_edge.first().map_or(0, |recording| recording.faces);
        recording_figure("push_time_by_edge", axis, curves)
            .title(format!(
                "A recording refined, against the edge length of the scan; {faces} faces"
            ))
            .caption(format!(
                "Edges of a thirtieth to two radii of the tip, {:.1} mm. {HOW}",
                RADIUS * 1e3
            ))
    }

    fn faces_figure(&self) -> Figure {
        let curves = self
            .by_faces
            .chunk_by(|a, b| a.edge == b.edge)
            .flat_map(|recordings| {
                let edge = format!(", {:.2} mm", recordings[0].edge * 1e3);
                recording_curves(recordings, &edge, |recording| recording.faces as f64)
            });
        recording_figure(
            "push_time_by_faces",
            Axis::log("faces of the scan", "faces"),
            curves,
        )
        .title("A recording refined, against the faces of the scan, on edges of two lengths")
        .caption(HOW)
    }

    fn cheapest_figure(&self) -> Figure {
        let marks = |time: &dyn Fn(&SizeCost) -> Spread| {
            let mark = |size: &SizeCost| Mark::at(size.faces as f64, time(size).times(1e-3));
            self.sizes.iter().map(mark).collect_vec()
        };
        let law = self.barest_law.map(|law| {
            Series::dashed(
                "law of the cheapest scene",
                marks(&|size| law.at(size.faces).into()),
            )
        });
        let curves = [
            Series::joined("hand-written loop", marks(&|size| size.minimal.time_ns)),
            Series::joined("the loop, keeping", marks(&|size| size.keeping.time_ns)),
            Series::joined("cheapest scene", marks(&|size| size.barest.time_ns)),
        ];
        Figure::curves("cheapest_push_by_faces", curves.into_iter().chain(law))
            .title("The cheapest push against the size of the scan")
            .axes(Axis::log("faces of the scan", "faces"), Axis::log("time of one push, µs", "push_us"))
            .caption(format!(
                "Median and p10–p90 of blocks of samples, all cases in turns. Dashed: t = a + b ln F, fitted to the \
                 scans of up to {LAW_UP_TO} faces. What lies above it is the cache.",
            ))
    }

    fn recording_text(&self) -> Option<String> {
        let ends = |of: fn(&RecordingCost) -> f64| {
            let all = self.by_edge.iter().chain(&self.by_faces);
            let order = |a: &&RecordingCost, b: &&RecordingCost| of(a).total_cmp(&of(b));
            // of equal ones the first is the least, and the last is the most
            let ends = [all.clone().min_by(order)?, all.max_by(order)?];
            Some(ends.map(|recording| {
                let (faces, edge_mm) = (recording.faces, recording.edge * 1e3);
                (
                    three_digits(of(recording)),
                    format!("{faces} faces, edges of {edge_mm:.2} mm"),
                )
            }))
        };
        let [(least, fastest), (most, slowest)] = ends(|one| us(one.push.median))?;
        let [_, (p999, longest)] = ends(|one| us(one.push.p999))?;
        let [(share, coarse), (times, fine)] =
            ends(|one| one.peer.median as f64 / one.push.median.max(1) as f64)?;
        Some(format!(
            "A push of the default scene, its patch made at the end, takes {least} µs ({fastest}) to {most} µs ({slowest}) in the median \
             and at most {p999} µs in p99.9 ({longest}). The index of parry3d alone, brought up to date after the vertices within one \
             radius of the tip were moved and asked for one closest face, takes {share} ({coarse}) to {times} times ({fine}) a whole push; \
             what finds and moves these vertices is not counted, and a push does more: it filters, gates, solves the dynamics, carves and \
             guards. The libraries from PyPI are measured with --peers.",
        ))
    }

    fn size_text(&self) -> Option<String> {
        let (first, last) = (self.sizes.first()?, self.sizes.last()?);
        let [from, to] = [first, last].map(|size| size.barest.time_ns.median);
        let expected = self.barest_law.map_or(String::new(), |law| {
            let (times, megabytes) = (to / law.at(last.faces), last.bytes() * 1e-6);
            let verdict = if times <= NO_MORE {
                "no more than the logarithm says".to_owned()
            } else {
                format!("beyond the logarithm, with {megabytes:.0} MB of mesh and tree")
            };
            format!(" ({times:.2} times what the logarithmic law of the small scans foretells: {verdict})")
        });
        let (faces, instead, more) = (
            last.faces,
            first.faces,
            last.faces as f64 / first.faces as f64,
        );
        let [from, to] = [from, to].map(|ns| ns * 1e-3);
        Some(format!(
            "On a scan of {more:.0} times the faces ({faces} instead of {instead}) the cheapest scene takes {to:.2} µs instead \
             of {from:.2} µs{expected}."
        ))
    }

    fn ratio_text(&self) -> Option<String> {
        let largest = |ratio: fn(&SizeCost) -> Spread| {
            self.sizes
                .iter()
                .map(|size| ratio(size).median)
                .max_by(f64::total_cmp)
        };
        let worst = largest(|size| size.barest_to_minimal)?;
        let keeping = largest(|size| size.barest_to_keeping)?;
        let verdict = if worst <= LARGEST_RATIO {
            "within"
        } else {
            "this misses"
        };
        Some(format!(
            "A part that a scene says is off costs nothing: the cheapest scene takes at most {worst:.3} times as long as the loop \
             that is written by hand, on the same samples in turns; {verdict} the {LARGEST_RATIO} that is allowed. Against the same \
             loop made to keep what it looked up, as the refiner does (which boxes to bring up to date, with a margin, and what \
             is near), it is {keeping:.3} times.",
        ))
    }

    fn part_text(&self) -> Option<String> {
        let faces = self.parts.iter().map(|part| part.faces).max()?;
        let parts = self.parts.iter().filter(|part| part.faces == faces);
        let mut parts = parts.map(
            |PartCost {
                 part,
                 cost_ns,
                 without,
                 ..
             }| {
                let is_lost = cost_ns.median.abs() < DISCERNIBLE * without.time_ns.median;
                let noise = if is_lost { " (within the noise)" } else { "" };
                format!("{part} {:+.0} ns{noise}", cost_ns.median)
            },
        );
        Some(format!(
            "What the parts cost, as the difference of whole pushes with and without them on {faces} faces: {}.",
            parts.join(", ")
        ))
    }

    /// Slowest replay of the scenes that move the mesh, samples/s.
    pub fn slowest_replay_per_s(&self) -> Option<f64> {
        let moving = self.replays.iter().filter(|replay| replay.scene != READING);
        let speeds = moving.map(|replay| replay.samples_per_s.median);
        speeds.min_by(f64::total_cmp)
    }

    fn replay_text(&self) -> Option<String> {
        let mut replays = self.replays.iter().map(|replay| {
            let ReplaySpeed {
                scene,
                edge_mm,
                samples_per_s: Spread { median, .. },
                ..
            } = replay;
            let verdict = match *median >= LEAST_REPLAY_PER_S {
                _ if scene == READING => String::new(),
                true => format!(" (holds {LEAST_REPLAY_PER_S:.0})"),
                false => format!(" (misses {LEAST_REPLAY_PER_S:.0})"),
            };
            format!(
                "{median:.0} samples per second, scene {scene}, edges of {edge_mm:.2} mm{verdict}"
            )
        });
        let faces = self.replays.first()?.faces;
        Some(format!(
            "A recording is replayed by one thread, from the file to the moved mesh of {faces} faces: {}.",
            replays.join("; ")
        ))
    }

    fn count_text(&self) -> String {
        let default = self
            .parts
            .iter()
            .filter(|part| part.is_default)
            .map(|part| &part.with);
        let pushes = self.sizes.iter().map(|size| &size.barest).chain(default);
        let bound = match pushes
            .filter_map(|push| push.allocations)
            .max_by(f64::total_cmp)
        {
            None => {
                return "This program does not count allocations, so their columns are empty."
                    .to_owned();
            }
            Some(0.0) => "never asks".to_owned(),
            Some(most) => format!("asks {most:.2e} times"),
        };
        format!(
            "A push that is warm {bound} for memory, counted by the allocator itself over every timed push."
        )
    }

    fn tables(&self) -> Vec<Table> {
        vec![
            recording_table("recordings_by_edge", "A recording refined, by edge length of the scan", &self.by_edge),
            recording_table("recordings_by_faces", "A recording refined, by faces of the scan", &self.by_faces),
            Table::of("push_by_faces", "The cheapest push, by size of the scan", &self.sizes)
                .column("faces", |size| size.faces)
                .column("hand-written loop, ns", |size| size.minimal.time_ns)
                .column("cheapest scene, ns", |size| size.barest.time_ns)
                .column("cheapest / loop", |size| size.barest_to_minimal)
                .column("loop that keeps, ns", |size| size.keeping.time_ns)
                .column("cheapest / keeping loop", |size| size.barest_to_keeping)
                .column("allocations", |size| size.barest.allocations)
                .column("mesh, bytes/face", |size| size.mesh_bytes_per_face)
                .column("tree, bytes/face", |size| size.tree_bytes_per_face)
                .column("tree built, ms", |size| size.tree_build_ms)
                .caption("On a plate of 0.3 m. Memory is counted from what mesh and tree own."),
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

fn us(ns: u64) -> f64 {
    ns as f64 * 1e-3
}

/// Pushes, the whole, and the peer, against `x`.
///
/// - `more`: suffix of each name.
fn recording_curves(
    recordings: &[RecordingCost],
    more: &str,
    x: impl Fn(&RecordingCost) -> f64,
) -> [Series; 5] {
    let curve = |name: &str, time_us: fn(&RecordingCost) -> f64| {
        let marks = recordings.iter().map(|one| Mark::at(x(one), time_us(one)));
        Series::joined(format!("{name}{more}"), marks)
    };
    [
        curve("push, median", |one| us(one.push.median)),
        curve("push, p99", |one| us(one.push.p99)),
        curve("push, p99.9", |one| us(one.push.p999)),
        curve("end to end", |one| one.whole_us),
        curve("index of parry3d", |one| us(one.peer.median)),
    ]
}

fn recording_figure(id: &str, x: Axis, curves: impl IntoIterator<Item = Series>) -> Figure {
    Figure::curves(id, curves).axes(x, Axis::log("time per sample, µs", "sample_us"))
}

fn recording_table(id: &str, title: &str, recordings: &[RecordingCost]) -> Table {
    Table::of(id, title, recordings)
        .column("edge, mm", |one| one.edge * 1e3)
        .column("faces", |one| one.faces)
        .column("samples", |one| one.samples)
        .column("push, median, µs", |one| us(one.push.median))
        .column("push, p99, µs", |one| us(one.push.p99))
        .column("push, p99.9, µs", |one| us(one.push.p999))
        .column("until the first push, ms", |one| one.begin_ms)
        .column("patch at the end, ms", |one| one.patch_ms)
        .column("end to end, µs per sample", |one| one.whole_us)
        .column("parry3d, median, µs", |one| us(one.peer.median))
        .column("parry3d, p99, µs", |one| us(one.peer.p99))
        .column("parry3d, p99.9, µs", |one| us(one.peer.p999))
        .column("vertices moved for parry3d", |one| one.peer_moves)
        .caption(HOW)
}
