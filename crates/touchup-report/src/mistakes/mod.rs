//! Findings for wrong input: recordings of named worlds, sound and with one mistake each, through
//! the checks of `touchup doctor`.
//!
//! A world draws its truth from a seed; the program learns the part of it that a calibration leaves
//! ([`SimWorld`]), in the scene that `touchup simulate --world` writes.

mod case;
mod checked;
mod text;

use std::ops::RangeInclusive;

pub use checked::{CheckedRecording, RightCount};

use super::Effort;
use touchup_sim::{INPUT_MISTAKES, SimWorld};

/// Extent of the runs.
#[derive(Clone, Debug, PartialEq)]
pub struct MistakesParams {
    /// worlds, in this order
    pub worlds: Vec<SimWorld>,
    /// seeds of each world, with each mistake
    pub seeds: RangeInclusive<u64>,
    /// number of further seeds without mistakes, as a multiple of the count of `seeds`
    pub more_sound: u64,
    /// longest time of the rasters over the part, s
    pub longest: f64,
}

impl MistakesParams {
    /// One seed of three worlds, or five of all and ten more without a mistake.
    pub fn of(effort: Effort) -> Self {
        Self {
            worlds: SimWorld::ALL[..effort.choose(3, SimWorld::ALL.len())].to_vec(),
            seeds: 1..=effort.choose(1, 5),
            more_sound: effort.choose(0, 2),
            longest: effort.choose(20.0, 60.0),
        }
    }
}

/// All recordings with their findings.
#[derive(Clone, Debug)]
pub struct Mistakes {
    /// extent of the runs
    pub params: MistakesParams,
    /// by world and seed, the sound one first
    pub checked: Vec<CheckedRecording>,
    /// failed recordings, in words
    pub failed: Vec<String>,
}

/// Demanded share of mistakes with the right cause.
pub const LEAST_NAMED: f64 = 0.95;

/// Checks each seed of each world, without a mistake and with each.
pub fn mistakes(params: MistakesParams, progress: &mut dyn FnMut(&str)) -> Mistakes {
    let (mut checked, mut failed) = (Vec::new(), Vec::new());
    let (first, last) = (*params.seeds.start(), *params.seeds.end());
    let more = params.more_sound.saturating_mul(last - first + 1);
    for &world in &params.worlds {
        for seed in first..=last.saturating_add(more) {
            progress(&format!("mistakes: {}, seed {seed}", world.name()));
            let made = if params.seeds.contains(&seed) {
                INPUT_MISTAKES
            } else {
                &[]
            };
            match case::run(world, seed, params.longest, made) {
                Ok(of_seed) => checked.extend(of_seed),
                Err(error) => failed.push(format!("{}, seed {seed}: {error}", world.name())),
            }
        }
    }
    Mistakes {
        params,
        checked,
        failed,
    }
}
