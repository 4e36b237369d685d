//! Counts of runs, altogether and on a grid of two quantities.

use std::ops::Range;

use serde::Serialize;

use super::face_runs::RunEnding;

/// Columns and rows of a map.
const CELLS: usize = 12;

/// Share of stable runs over two quantities; what lies beyond the rim counts in its cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShareMap {
    /// middles of the columns, rising
    pub xs: Vec<f64>,
    /// middles of the rows, rising
    pub ys: Vec<f64>,
    /// row by row; `None` where nothing was run
    pub shares: Vec<Option<f64>>,
}

impl ShareMap {
    /// The upper end of the last column up to which every run was stable.
    pub(super) fn stable_up_to(&self) -> Option<f64> {
        let is_stable = |column: &usize| {
            self.shares.iter().skip(*column).step_by(self.xs.len()).all(|share| share.is_none_or(|share| share == 1.0))
        };
        let columns = (0..self.xs.len()).take_while(is_stable).count();
        let half = (self.xs.get(1)? / self.xs.first()?).sqrt();
        Some(self.xs.get(columns.checked_sub(1)?)? * half)
    }

    /// The lower end of the first row from which on every run was stable.
    pub(super) fn stable_from(&self) -> Option<f64> {
        let rows = self.shares.chunks(self.xs.len()).rev();
        let stable = rows.take_while(|row| row.iter().all(|share| share.is_none_or(|share| share == 1.0))).count();
        let half = (self.ys.get(1)? / self.ys.first()?).sqrt();
        Some(self.ys.iter().rev().take(stable).next_back()? / half)
    }
}

/// Counts on logarithmic axes.
pub(super) struct Grid {
    x: Range<f64>,
    y: Range<f64>,
    runs: [[usize; 2]; CELLS * CELLS],
}

impl Grid {
    /// Between these powers of ten.
    pub fn new(x: Range<f64>, y: Range<f64>) -> Self {
        Self { x, y, runs: [[0; 2]; CELLS * CELLS] }
    }

    pub fn add(&mut self, x: f64, y: f64, is_stable: bool) {
        let at = |value: f64, range: &Range<f64>| {
            let share = (value.log10() - range.start) / (range.end - range.start);
            ((share * CELLS as f64).max(0.0) as usize).min(CELLS - 1)
        };
        self.runs[at(y, &self.y) * CELLS + at(x, &self.x)][usize::from(is_stable)] += 1;
    }

    pub fn shares(self) -> ShareMap {
        let middles = |range: &Range<f64>| {
            let width = (range.end - range.start) / CELLS as f64;
            (0..CELLS).map(|i| 10f64.powf(range.start + (i as f64 + 0.5) * width)).collect()
        };
        let share = |&[faulty, stable]: &[usize; 2]| {
            let all = faulty + stable;
            (all > 0).then(|| stable as f64 / all as f64)
        };
        ShareMap { xs: middles(&self.x), ys: middles(&self.y), shares: self.runs.iter().map(share).collect() }
    }
}

/// How runs ended.
#[derive(Default)]
pub(super) struct Counts {
    endings: Vec<(RunEnding, usize)>,
}

impl Counts {
    pub fn add(&mut self, ending: RunEnding) {
        match self.endings.iter_mut().find(|(known, _)| *known == ending) {
            Some((_, count)) => *count += 1,
            None => self.endings.push((ending, 1)),
        }
    }

    pub fn stable_share(&self) -> f64 {
        let all: usize = self.endings.iter().map(|(_, count)| count).sum();
        let stable: usize =
            self.endings.iter().filter(|(end, _)| *end == RunEnding::Stable).map(|(_, count)| count).sum();
        stable as f64 / all.max(1) as f64
    }

    /// The most frequent first.
    pub fn endings(mut self) -> Vec<(RunEnding, usize)> {
        self.endings.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        self.endings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_counted_in_their_cell_and_those_beyond_at_the_rim() {
        let mut grid = Grid::new(0.0..12.0, 0.0..12.0);
        grid.add(10f64.powf(3.5), 10f64.powf(2.5), true);
        grid.add(10f64.powf(3.4), 10f64.powf(2.6), false);
        grid.add(1e-9, 1e99, true);
        let map = grid.shares();
        assert_eq!(map.shares[2 * CELLS + 3], Some(0.5));
        assert_eq!(map.shares[11 * CELLS], Some(1.0));
        assert_eq!(map.shares.iter().flatten().count(), 2);
        // columns 0, 1, 2 hold nothing that is not stable
        assert!((map.stable_up_to().unwrap().log10() - 3.0).abs() < 1e-12);
        // and so do rows 3 to 11
        assert!((map.stable_from().unwrap().log10() - 3.0).abs() < 1e-12);
    }
}
