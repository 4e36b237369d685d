//! Validity of stated uncertainties: parts of known truth, touched in named worlds, and the error
//! of each number over its stated standard deviation.
//!
//! A world draws its truth from a seed; the program learns the part of it that a calibration leaves
//! ([`SimWorld`]). Scan and recording stay in memory, and pass through the engine and the feature
//! search of `touchup refine`.

mod case;
mod kind;
mod stated;
mod text;
mod truth;

use std::ops::RangeInclusive;

pub use kind::CoverageKind;
use stated::SIGMAS_95;
pub use stated::StatedNumber;

use super::Effort;
use touchup_sim::SimWorld;

/// Extent of the runs.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageParams {
    /// worlds, in this order
    pub worlds: Vec<SimWorld>,
    /// seeds of each world
    pub seeds: RangeInclusive<u64>,
    /// longest time of the rasters over the part, s
    pub longest: f64,
}

impl CoverageParams {
    /// One seed of two worlds, or twenty of all.
    pub fn of(effort: Effort) -> Self {
        Self {
            worlds: SimWorld::ALL[..effort.choose(2, SimWorld::ALL.len())].to_vec(),
            seeds: 1..=effort.choose(1, 20),
            longest: effort.choose(20.0, 60.0),
        }
    }
}

/// The numbers of one kind in one world, over all seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct KindInWorld {
    /// world
    pub world: SimWorld,
    /// kind
    pub kind: CoverageKind,
    /// the numbers
    pub numbers: Vec<StatedNumber>,
}

/// Errors over stated standard deviations, by world and kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// extent of the runs
    pub params: CoverageParams,
    /// each kind that occurs in each world
    pub kinds: Vec<KindInWorld>,
    /// failed cases, in words
    pub failed: Vec<String>,
}

/// Acceptable root mean square of error over stated standard deviation.
pub const HONEST: [f64; 2] = [0.8, 1.25];

impl KindInWorld {
    fn scores(&self) -> impl Iterator<Item = f64> {
        self.numbers.iter().filter_map(StatedNumber::score)
    }

    /// Count of numbers with a stated standard deviation, without bounds.
    pub fn count(&self) -> usize {
        self.scores().count()
    }

    /// Mean error, m.
    pub fn mean_error(&self) -> Option<f64> {
        mean(
            self.numbers
                .iter()
                .filter(|number| number.score().is_some())
                .map(|number| number.error),
        )
    }

    /// Root mean square of error over stated standard deviation; 1 for a correct statement.
    pub fn rms_score(&self) -> Option<f64> {
        mean(self.scores().map(|score| score * score)).map(f64::sqrt)
    }

    /// Share of the numbers within 1.96 stated standard deviations of the truth.
    pub fn share_within(&self) -> Option<f64> {
        mean(
            self.scores()
                .map(|score| f64::from(u8::from(score.abs() <= SIGMAS_95))),
        )
    }

    /// Number of lower bounds, and number of bounds that the truth contradicts.
    pub fn bounds(&self) -> [usize; 2] {
        let bounds = || self.numbers.iter().filter(|number| number.is_at_least);
        [
            bounds().count(),
            bounds().filter(|bound| bound.contradicts()).count(),
        ]
    }

    /// Whether the statements meet the demand; `None` without statements.
    pub fn holds(&self) -> Option<bool> {
        let rms = self.rms_score()?;
        let is_enough = self
            .kind
            .least_within()
            .is_none_or(|least| self.share_within() >= Some(least));
        Some((HONEST[0]..=HONEST[1]).contains(&rms) && is_enough)
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Runs each seed of each world.
pub fn coverage(params: CoverageParams, progress: &mut dyn FnMut(&str)) -> Coverage {
    let (mut kinds, mut failed) = (Vec::new(), Vec::new());
    for &world in &params.worlds {
        let mut of_world = CoverageKind::ALL.map(|kind| KindInWorld {
            world,
            kind,
            numbers: Vec::new(),
        });
        for seed in params.seeds.clone() {
            progress(&format!("coverage: {}, seed {seed}", world.name()));
            match case::run(world, seed, params.longest) {
                Ok(found) => found
                    .into_iter()
                    .for_each(|(kind, number)| of_world[kind as usize].numbers.push(number)),
                Err(error) => failed.push(format!("{}, seed {seed}: {error}", world.name())),
            }
        }
        kinds.extend(
            of_world
                .into_iter()
                .filter(|of_kind| !of_kind.numbers.is_empty()),
        );
    }
    Coverage {
        params,
        kinds,
        failed,
    }
}
