//! Cost of each stage, with and without each optional part, and for scans of every size.

mod chapter;
mod log_law;
mod minimal;
mod parry;
mod pushes;
mod recordings;
mod replay;
mod stages;
mod turns;

use super::Effort;
use super::error::MeasureResult;
pub use log_law::LogLaw;
pub use minimal::MinimalLoop;
pub use parry::ParryLoop;
pub use pushes::{BAREST, PartCost, SizeCost};
pub use recordings::RecordingCost;
pub use replay::{READING, ReplaySpeed};
pub use stages::{SeldomCost, StageCost};
pub use turns::PerSample;
use turns::Timing;

/// Limit on the run time of the cheapest scene, relative to the hand-written loop.
pub const LARGEST_RATIO: f64 = 1.05;

/// Least speed of a replay, samples/s.
pub const LEAST_REPLAY_PER_S: f64 = 500_000.0;

/// Largest size in the fit of the law, which the larger ones are compared with, faces.
pub const LAW_UP_TO: usize = 105_000;

/// All cost measurements.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// recordings refined by the default scene, on scans of one size
    pub by_edge: Vec<RecordingCost>,
    /// recordings refined by the default scene, on scans of equal edges, their faces rising
    pub by_faces: Vec<RecordingCost>,
    /// the cheapest push, by size of the scan, rising
    pub sizes: Vec<SizeCost>,
    /// t = a + b ln F of the cheapest scene, for scans of 10k to 100k faces
    pub barest_law: Option<LogLaw>,
    /// whole pushes with and without each optional part
    pub parts: Vec<PartCost>,
    /// stages by themselves
    pub stages: Vec<StageCost>,
    /// occasional work, not at each sample
    pub seldom: Vec<SeldomCost>,
    /// recordings read and refined
    pub replays: Vec<ReplaySpeed>,
}

fn timing_of(effort: Effort) -> Timing {
    effort.choose(
        Timing {
            warm: 3_000,
            blocks: 15,
            block: 400,
        },
        Timing {
            warm: 20_000,
            blocks: 40,
            block: 1_000,
        },
    )
}

/// Measures all costs.
///
/// # Errors
/// [`MeasureError`](crate::error::MeasureError).
pub fn cost(effort: Effort, progress: &mut dyn FnMut(&str)) -> MeasureResult<Cost> {
    let by_edge = recordings::by_edge(effort, progress)?;
    let by_faces = recordings::by_faces(effort, progress)?;
    let sizes: &[usize] = effort.choose(
        &[10_000, 30_000, 100_000],
        &[
            10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000, 2_000_000, 5_000_000,
        ],
    );
    let timing = timing_of(effort);
    let at_size = |&faces: &usize| {
        progress(&format!("cost: the cheapest push on {faces} faces"));
        pushes::size_cost(faces, timing)
    };
    let sizes = sizes.iter().map(at_size).collect::<Result<Vec<_>, _>>()?;
    let (mut parts, mut stages, mut seldom) = (Vec::new(), Vec::new(), Vec::new());
    for &faces in effort.choose(
        &[10_000, 100_000][..],
        &[10_000, 100_000, 1_000_000, 5_000_000],
    ) {
        progress(&format!("cost: parts and stages on {faces} faces"));
        // eight refiners at once: on the largest scans they would take 5 GB
        if faces <= 1_000_000 {
            parts.extend(pushes::part_costs(faces, timing)?);
        }
        stages.extend(stages::stage_costs(faces, timing)?);
    }
    for &faces in effort.choose(&[10_000][..], &[10_000, 100_000, 1_000_000]) {
        progress(&format!("cost: patch and features on {faces} faces"));
        seldom.extend(stages::seldom_costs(faces, effort.choose(20, 100))?);
    }
    let (count, repeats) = effort.choose((30_000, 3), (300_000, 7));
    progress("cost: replay on 1,000,000 faces");
    let mut replays =
        replay::replay_speeds((1_000_000, pushes::side_of(1_000_000)), count, repeats)?;
    replays.extend(replay::replay_speeds(
        (1_000_000, touchup_sim::wavy::SIDE),
        count,
        repeats,
    )?);
    let known = sizes.iter().filter(|size| size.faces <= LAW_UP_TO);
    let known: Vec<_> = known
        .map(|size| (size.faces, size.barest.time_ns.median))
        .collect();
    Ok(Cost {
        by_edge,
        by_faces,
        barest_law: LogLaw::fit(&known),
        sizes,
        parts,
        stages,
        seldom,
        replays,
    })
}
