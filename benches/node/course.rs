//! The course of a run over DDS, second by second: plots of lag and memory, and a table.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use touchup::io::machine::{COMMIT, describe_machine};
use touchup::live::{Latencies, Quantiles};
use touchup_report::document::Report;
use touchup_report::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Table};

/// Largest wanted delay from a touch to its display, ms.
const WANTED_MS: f64 = 50.0;

/// Median, 99 % and the longest of some times, ms.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Times {
    pub median: f64,
    pub p99: f64,
    pub longest: f64,
}

impl Times {
    pub fn of(latencies: &Latencies) -> Option<Self> {
        let Quantiles {
            median, p99, max, ..
        } = latencies.quantiles();
        let [median, p99, longest] = [median, p99, max].map(|ns| ns as f64 * 1e-6);
        (max > 0).then_some(Self {
            median,
            p99,
            longest,
        })
    }
}

/// Answer times at the sensors.
#[derive(Debug, Serialize, Deserialize)]
pub struct Answers {
    /// time of the first sample, ns since 1970, a whole second
    pub begin_ns: i64,
    /// for each second the unanswered samples, and the times of the answers to the others
    pub seconds: Vec<(u64, Option<Times>)>,
}

/// Displayed changes at the viewer.
#[derive(Debug, Serialize, Deserialize)]
pub struct Drawn {
    /// by the second, since 1970
    pub seconds: BTreeMap<i64, SecondDrawn>,
}

/// Displayed changes of one second.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct SecondDrawn {
    /// from a sample that moves a vertex to the vertex at the viewer
    pub drawn: Option<Times>,
    /// age of the touches in the patch of the mesh, from the node's diagnostics; its renewals and
    /// late renewals up to now
    pub shown: Option<(Times, [u64; 2])>,
}

/// All observations of one second.
#[derive(Clone, Copy, Debug)]
struct Second {
    unanswered: u64,
    answer: Option<Times>,
    drawn: Option<Times>,
    shown: Option<(Times, [u64; 2])>,
    /// memory of the node at its end, MB
    memory: Option<f64>,
}

/// Which of its times.
type TimesOf = fn(&Second) -> Option<Times>;

/// The run, second by second.
///
/// - `memory`: of the node, MB, each value with its time, ns since 1970.
fn seconds(answers: &Answers, drawn: &Drawn, memory: &[(i64, f64)]) -> Vec<Second> {
    let first = answers.begin_ns / 1_000_000_000;
    let second = |(&(unanswered, answer), at): (&(u64, Option<Times>), i64)| {
        let seen = drawn.seconds.get(&at);
        let before = memory.partition_point(|(at_ns, _)| *at_ns <= (at + 1) * 1_000_000_000);
        let memory = before.checked_sub(1).map(|last| memory[last].1);
        let (drawn, shown) = (
            seen.and_then(|seen| seen.drawn),
            seen.and_then(|seen| seen.shown),
        );
        Second {
            unanswered,
            answer,
            drawn,
            shown,
            memory,
        }
    };
    answers.seconds.iter().zip(first..).map(second).collect()
}

/// Writes plots and table into `folder`.
///
/// - `memory`: of the node, MB, each value with its time, ns since 1970.
pub fn write(folder: &Path, faces: usize, answers: &Answers, drawn: &Drawn, memory: &[(i64, f64)]) {
    let seconds = seconds(answers, drawn, memory);
    let (figures, tables) = (
        vec![lag(faces, &seconds), usage(&seconds)],
        vec![table(&seconds)],
    );
    let report = Report {
        machine: describe_machine(),
        commit: COMMIT.to_owned(),
        command: format!("cargo bench --bench node -- dds {faces} {}", seconds.len()),
        chapters: vec![Chapter::of(
            "The node in real time",
            Vec::new(),
            figures,
            tables,
        )],
        ..Report::default()
    };
    std::fs::create_dir_all(folder).expect("the folder can be made");
    for file in report.files().expect("each name is there once") {
        std::fs::write(folder.join(file.name), file.bytes).expect("there is room in the folder");
    }
}

fn course(name: &str, seconds: &[Second], value: impl Fn(&Second) -> Option<f64>) -> Series {
    let marks = seconds
        .iter()
        .zip(1..)
        .filter_map(|(second, at)| Some(Mark::at(f64::from(at), value(second)?)));
    Series::new(name, LineStroke::Course, marks)
}

fn lag(faces: usize, seconds: &[Second]) -> Figure {
    let shown = |second: &Second| Some(second.shown?.0);
    let end = seconds.len() as f64;
    let series = vec![
        course("answer, median", seconds, |second| {
            Some(second.answer?.median)
        }),
        course("answer, 99 %", seconds, |second| Some(second.answer?.p99)),
        course("answer, longest", seconds, |second| {
            Some(second.answer?.longest)
        }),
        course("patch, median", seconds, |second| {
            Some(shown(second)?.median)
        }),
        course("patch, 99 %", seconds, |second| Some(shown(second)?.p99)),
        course("patch, longest", seconds, |second| {
            Some(shown(second)?.longest)
        }),
        course("viewer, 99 %", seconds, |second| Some(second.drawn?.p99)),
        Series::new(
            "50 ms",
            LineStroke::Dashed,
            [0.0, end].map(|at| Mark::at(at, WANTED_MS)),
        ),
    ];
    Figure::of("live_lag", Drawing::Curves(series))
        .title(format!("The node on a scan of {faces} faces at 1 kHz: from a touch to what comes of it"))
        .axes(Axis::linear("time, s", "time_s"), Axis::log("time from the touch in each second, ms", "lag_ms"))
        .caption(
            "Answer: from a sample to its haptic mismatch, there and back over DDS. Patch: age of the touches that the patch in the \
             mesh shows. Viewer: from a sample that moves a vertex to the marker that draws it there.",
        )
}

fn usage(seconds: &[Second]) -> Figure {
    let unanswered: u64 = seconds.iter().map(|second| second.unanswered).sum();
    let [renewals, late] = seconds
        .iter()
        .rev()
        .find_map(|second| Some(second.shown?.1))
        .unwrap_or_default();
    let title = format!(
        "Memory of the node; {unanswered} of {} samples not answered, {late} of {renewals} renewals late",
        1000 * seconds.len()
    );
    // from 0, so that a flat series looks flat
    let floor = Series::new(
        "0",
        LineStroke::Dashed,
        [0.0, seconds.len() as f64].map(|at| Mark::at(at, 0.0)),
    );
    let memory = course("memory", seconds, |second| second.memory);
    Figure::of("live_memory", Drawing::Curves(vec![memory, floor]))
        .title(title)
        .axes(
            Axis::linear("time, s", "time_s"),
            Axis::linear("memory, MB", "memory_mb"),
        )
        .caption("Resident memory of the process, the scan in it.")
}

fn table(seconds: &[Second]) -> Table {
    let second = |at: usize| &seconds[at];
    let mut table = Table::of("live_seconds", "Second by second", 0..seconds.len())
        .column("time, s", |at| at + 1)
        .column("samples not answered", |at| second(at).unanswered as usize);
    let parts: [(&str, TimesOf); 3] = [
        ("answer", |second| second.answer),
        ("patch", |second| Some(second.shown?.0)),
        ("viewer", |second| second.drawn),
    ];
    for (name, times) in parts {
        table = table
            .column(format!("{name}, median, ms"), |at| {
                Some(times(second(at))?.median)
            })
            .column(format!("{name}, 99 %, ms"), |at| {
                Some(times(second(at))?.p99)
            })
            .column(format!("{name}, longest, ms"), |at| {
                Some(times(second(at))?.longest)
            });
    }
    let counts = |at: usize| Some(second(at).shown?.1);
    table
        .column("renewals so far", |at| Some(counts(at)?[0] as usize))
        .column("… late", |at| Some(counts(at)?[1] as usize))
        .column("memory, MB", |at| second(at).memory)
        .caption(
            "What sensors and viewer saw in each second, and the memory of the node at its end.",
        )
}
