//! Counts of runs, in total and on a grid of two quantities.

use std::ops::Range;

use super::face_runs::RunEnding;
use crate::Panel;

/// Columns and rows of a map.
const CELLS: usize = 12;

/// Share of stable runs over two quantities between powers of ten; runs beyond the rim count in its
/// cells.
///
/// - `runs`: both quantities of each, and its end.
pub(super) fn share_map(
    name: &str,
    [x, y]: [&Range<f64>; 2],
    runs: impl Iterator<Item = ([f64; 2], RunEnding)>,
) -> Panel {
    let at = |value: f64, range: &Range<f64>| {
        let share = (value.log10() - range.start) / (range.end - range.start);
        ((share * CELLS as f64).max(0.0) as usize).min(CELLS - 1)
    };
    let mut counts = [[0usize; 2]; CELLS * CELLS];
    for ([across, up], ending) in runs {
        counts[at(up, y) * CELLS + at(across, x)][usize::from(ending == RunEnding::Stable)] += 1;
    }
    let middles = |range: &Range<f64>| {
        let width = (range.end - range.start) / CELLS as f64;
        (0..CELLS)
            .map(|i| 10f64.powf(range.start + (i as f64 + 0.5) * width))
            .collect()
    };
    let shares = counts
        .map(|[faulty, stable]| (faulty + stable > 0).then(|| share(stable, faulty + stable)));
    Panel {
        name: name.to_owned(),
        xs: middles(x),
        ys: middles(y),
        shares: shares.to_vec(),
    }
}

fn is_stable(share: &Option<f64>) -> bool {
    share.is_none_or(|share| share == 1.0)
}

/// The upper end of the last column up to which every run was stable.
pub(super) fn stable_up_to(map: &Panel) -> Option<f64> {
    let width = map.xs.len();
    let columns = (0..width)
        .take_while(|column| {
            map.shares
                .iter()
                .skip(*column)
                .step_by(width)
                .all(is_stable)
        })
        .count();
    let half = (map.xs.get(1)? / map.xs.first()?).sqrt();
    Some(map.xs.get(columns.checked_sub(1)?)? * half)
}

/// The lower end of the first row from which on every run was stable.
pub(super) fn stable_from(map: &Panel) -> Option<f64> {
    let rows = map.shares.chunks(map.xs.len()).rev();
    let stable = rows.take_while(|row| row.iter().all(is_stable)).count();
    let half = (map.ys.get(1)? / map.ys.first()?).sqrt();
    Some(map.ys.iter().rev().take(stable).next_back()? / half)
}

/// Counts of the run endings; the first fault of a run counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EndingCounts([usize; RunEnding::ALL.len()]);

impl EndingCounts {
    pub(super) fn of(endings: impl IntoIterator<Item = RunEnding>) -> Self {
        let mut counts = Self::default();
        endings
            .into_iter()
            .for_each(|ending| counts.0[ending as usize] += 1);
        counts
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.0.iter().sum()
    }

    /// Number of runs with this ending.
    pub fn count(&self, ending: RunEnding) -> usize {
        self.0[ending as usize]
    }

    /// Share of stable runs.
    pub fn stable_share(&self) -> f64 {
        share(self.count(RunEnding::Stable), self.runs())
    }
}

pub(super) fn share(of: usize, all: usize) -> f64 {
    of as f64 / all.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_counted_in_their_cell_and_those_beyond_at_the_rim() {
        let runs = [
            ([10f64.powf(3.5), 10f64.powf(2.5)], RunEnding::Stable),
            ([10f64.powf(3.4), 10f64.powf(2.6)], RunEnding::Overshot),
            ([1e-9, 1e99], RunEnding::Stable),
        ];
        let map = share_map("map", [&(0.0..12.0), &(0.0..12.0)], runs.into_iter());
        assert_eq!(map.shares[2 * CELLS + 3], Some(0.5));
        assert_eq!(map.shares[11 * CELLS], Some(1.0));
        assert_eq!(map.shares.iter().flatten().count(), 2);
        // columns 0, 1, 2 hold stable runs alone
        assert!((stable_up_to(&map).unwrap().log10() - 3.0).abs() < 1e-12);
        // and rows 3 to 11 too
        assert!((stable_from(&map).unwrap().log10() - 3.0).abs() < 1e-12);
    }
}
