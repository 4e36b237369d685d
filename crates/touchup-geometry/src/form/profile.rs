//! The longest undulations of noisy points, by weighted least squares.
//!
//! Raw points are as far apart as the noise of the outermost ones: the more points, the wider. The
//! deviation is therefore a sum of few terms, long undulations like those left by a filter of ISO
//! 12181 or 12781, and only of terms that stand out of the noise: each step adds the term that
//! explains most. Points of one group share their error and weigh as one; the residuals of all
//! terms together give the size of the errors.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Point3};
use rand::SeedableRng;
use rand::distr::Distribution;
use rand_distr::StandardNormal;

use crate::numeric::distinct;

/// An estimate and its standard uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// m or rad
    pub value: f64,
    /// m or rad
    pub std: f64,
}

/// A measured point of a surface for its form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FormPoint {
    /// on the surface, m, in O
    pub point: Point3<f64>,
    /// standard deviation along the normal, m, > 0
    pub sigma: f64,
    /// points of one group share their error
    pub group: u32,
}

/// A deviation and the contribution of each term at its place.
pub(super) struct DesignRow {
    pub terms: Vec<f64>,
    /// m
    pub value: f64,
    pub sigma: f64,
    pub group: u32,
}

/// Probability of finding a block of terms in noise alone.
const BY_CHANCE: f64 = 0.01;
/// Probability of finding a block by chance beside others: a real deviation seldom has one term.
const MORE_BY_CHANCE: f64 = 0.05;
/// Least square share of a term outside of the others.
const LEAST_SHARE: f64 = 0.1;
/// Least square share of a term of the reference, for which a short arc suffices.
const LEAST_REFERENCE: f64 = 1e-7;
/// Least number of groups for each term.
const GROUPS_PER_TERM: usize = 3;
/// Number of spare groups from which the residuals give the size of the errors; with fewer, errors
/// are no less than stated.
const SPARE_GROUPS: usize = 20;
/// Draws of the errors, in pairs of opposite sign: their spread is known to 7 %.
const PAIRS: usize = 50;
/// Seed of the draws: the same points give the same numbers.
const SEED: u64 = 12181;

/// Terms fitted to points.
pub(super) struct Profile {
    /// candidate blocks of terms, in their order
    pub sought: Vec<usize>,
    /// blocks that stand out of the noise
    pub found: Vec<usize>,
    blocks: Vec<Range<usize>>,
    /// of all terms; 0 for terms not found
    coefficients: DVector<f64>,
    /// for the terms found: columns whose products with independent normal numbers are errors of
    /// the coefficients
    root: DMatrix<f64>,
    /// smallest length of the first term of each block that would be found, m; 0 for other blocks
    /// than candidates
    least_found: Vec<f64>,
    /// root mean square of the terms not found together, beyond noise, m
    hidden: f64,
}

/// Rows with their weights, which groups share.
struct WeightedRows<'a> {
    rows: &'a [DesignRow],
    /// 1/m²
    weights: Vec<f64>,
    /// group of each row, from 0
    group: Vec<usize>,
    groups: usize,
}

impl<'a> WeightedRows<'a> {
    /// - `count`: number of terms of each row.
    /// - returns: `None` if a number is not finite, or a standard deviation is not positive.
    fn of(rows: &'a [DesignRow], count: usize) -> Option<Self> {
        let names = distinct(rows.iter().map(|row| row.group));
        let group: Vec<usize> = rows
            .iter()
            .map(|row| names.partition_point(|&name| name < row.group))
            .collect();
        let mut in_group = vec![0.0; names.len()];
        group.iter().for_each(|&g| in_group[g] += 1.0);
        let weight = |(row, &g): (&DesignRow, &usize)| 1.0 / (row.sigma * row.sigma * in_group[g]);
        let weights: Vec<f64> = rows.iter().zip(&group).map(weight).collect();
        let is_finite =
            |row: &DesignRow| row.value.is_finite() && row.terms.iter().all(|x| x.is_finite());
        let is_sound = rows
            .iter()
            .all(|row| row.terms.len() == count && is_finite(row))
            && weights.iter().all(|w| w.is_finite() && *w > 0.0);
        is_sound.then_some(Self {
            rows,
            weights,
            group,
            groups: names.len(),
        })
    }

    /// Variance of the errors over the stated one, by the residuals of the groups.
    fn excess(&self, choice: &TermSelection, solution: &DVector<f64>) -> f64 {
        let (mut of_group, mut weight_of_group) = (vec![0.0; self.groups], vec![0.0; self.groups]);
        for ((row, &w), &g) in self.rows.iter().zip(&self.weights).zip(&self.group) {
            let fitted: f64 = choice
                .terms
                .iter()
                .zip(solution.iter())
                .map(|(&term, x)| row.terms[term] * x)
                .sum();
            of_group[g] += w * (row.value - fitted);
            weight_of_group[g] += w;
        }
        let spare = self.groups.saturating_sub(choice.terms.len()).max(1);
        let square: f64 = of_group
            .iter()
            .zip(&weight_of_group)
            .map(|(sum, w)| sum * sum / w)
            .sum();
        let least = if spare < SPARE_GROUPS {
            1.0
        } else {
            f64::MIN_POSITIVE
        };
        (square / spare as f64).max(least)
    }
}

/// Some terms and the inverse of their information.
#[derive(Clone)]
struct TermSelection {
    terms: Vec<usize>,
    inverse: DMatrix<f64>,
}

/// Contribution of a block to a choice.
struct BlockContribution {
    information: DMatrix<f64>,
    right: DVector<f64>,
    /// least share of a term outside of the terms of the choice
    share: f64,
}

impl BlockContribution {
    /// Decrease of the squares of the residuals by the block.
    fn gain(&self) -> f64 {
        self.information
            .clone()
            .cholesky()
            .map_or(0.0, |cholesky| self.right.dot(&cholesky.solve(&self.right)))
    }
}

/// Weighted normal equations over all terms.
struct Sums {
    information: DMatrix<f64>,
    right: DVector<f64>,
    weight: f64,
}

impl Sums {
    fn of(weighted: &WeightedRows, count: usize) -> Self {
        let (information, right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut sums = Self {
            information,
            right,
            weight: weighted.weights.iter().sum(),
        };
        for (row, &w) in weighted.rows.iter().zip(&weighted.weights) {
            let terms = DVector::from_column_slice(&row.terms);
            sums.information.ger(w, &terms, &terms, 1.0);
            sums.right.axpy(w * row.value, &terms, 1.0);
        }
        sums
    }

    fn choice(&self, terms: Vec<usize>) -> Option<TermSelection> {
        let count = terms.len();
        let entry = |i: usize, j: usize| self.information[(terms[i], terms[j])];
        let scale = DVector::from_fn(count, |i, _| {
            entry(i, i).max(f64::MIN_POSITIVE).sqrt().recip()
        });
        let scaled = DMatrix::from_fn(count, count, |i, j| entry(i, j) * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        Some(TermSelection {
            terms,
            inverse: DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]),
        })
    }

    /// A choice and a block.
    fn with(&self, choice: &TermSelection, block: &Range<usize>) -> Option<TermSelection> {
        self.choice(choice.terms.iter().copied().chain(block.clone()).collect())
    }

    fn solution(&self, TermSelection { terms, inverse }: &TermSelection) -> DVector<f64> {
        inverse * DVector::from_fn(terms.len(), |i, _| self.right[terms[i]])
    }

    /// Squares of the values less the squares of the residuals.
    fn explained(&self, choice: &TermSelection) -> f64 {
        choice
            .terms
            .iter()
            .zip(self.solution(choice).iter())
            .map(|(&term, x)| self.right[term] * x)
            .sum()
    }

    fn own(&self, block: &Range<usize>, choice: &TermSelection) -> BlockContribution {
        let TermSelection { terms, inverse } = choice;
        let between = DMatrix::from_fn(terms.len(), block.len(), |i, j| {
            self.information[(terms[i], block.start + j)]
        });
        let inside = self
            .information
            .view((block.start, block.start), (block.len(), block.len()))
            .into_owned();
        let information = &inside - between.tr_mul(&(inverse * &between));
        let right =
            self.right.rows(block.start, block.len()) - between.tr_mul(&self.solution(choice));
        let share = |j: usize| information[(j, j)] / inside[(j, j)].max(f64::MIN_POSITIVE);
        let share = (0..block.len()).map(share).fold(1.0, f64::min);
        BlockContribution {
            information,
            right,
            share,
        }
    }

    /// The terms of the reference that the points determine.
    fn reference(&self, count: usize) -> Option<TermSelection> {
        let mut choice = TermSelection {
            terms: Vec::new(),
            inverse: DMatrix::zeros(0, 0),
        };
        for term in 0..count {
            let is_there = self.information[(term, term)] > 0.0;
            if is_there && self.own(&(term..term + 1), &choice).share > LEAST_REFERENCE {
                choice = self.with(&choice, &(term..term + 1))?;
            }
        }
        Some(choice)
    }

    /// Numbers of the blocks behind the reference that this number of groups carries, and all terms
    /// that the points distinguish.
    fn sought(
        &self,
        blocks: &[Range<usize>],
        reference: &TermSelection,
        groups: usize,
    ) -> Option<(Vec<usize>, TermSelection)> {
        let first = blocks.first().map_or(0, |block| block.start);
        let is_carried =
            |block: &Range<usize>| groups >= first + GROUPS_PER_TERM * (block.end - first);
        let (mut all, mut sought) = (reference.clone(), Vec::new());
        for (number, block) in blocks
            .iter()
            .enumerate()
            .take_while(|(_, block)| is_carried(block))
        {
            if self.own(block, reference).share > LEAST_SHARE {
                sought.push(number);
            }
            let own = self.own(block, &all);
            if own.share > LEAST_SHARE && own.information.cholesky().is_some() {
                all = self.with(&all, block)?;
            }
        }
        Some((sought, all))
    }

    /// Numbers of the blocks that stand out of the noise, and their terms with those of the
    /// reference.
    fn found(
        &self,
        blocks: &[Range<usize>],
        sought: &[usize],
        reference: &TermSelection,
        excess: f64,
    ) -> Option<(Vec<usize>, TermSelection)> {
        let (mut choice, mut found) = (reference.clone(), Vec::new());
        loop {
            let rest = sought.iter().filter(|number| !found.contains(*number));
            let gains = rest.filter_map(|&number| {
                let own = self.own(&blocks[number], &choice);
                (own.share > LEAST_SHARE).then(|| (number, own.gain()))
            });
            let limit = limit(
                sought.len(),
                if found.is_empty() {
                    BY_CHANCE
                } else {
                    MORE_BY_CHANCE
                },
            ) * excess;
            let best = gains
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, gain)| *gain > limit);
            let Some((best, _)) = best else { break };
            found.push(best);
            choice = self.with(&choice, &blocks[best])?;
        }
        found.sort_unstable();
        Some((found, choice))
    }
}

/// Sum of two squares of normal numbers exceeded with `chance` in one of `trials` trials: it is
/// more than x with probability exp(−x/2).
fn limit(trials: usize, chance: f64) -> f64 {
    2.0 * (trials.max(1) as f64 / chance).ln()
}

impl Profile {
    /// - `reference`: number of first terms that are the reference, which is no deviation.
    /// - `blocks`: terms found together or not at all, behind the reference, the longest
    ///   undulations first.
    /// - returns: `None` if the points do not determine the reference.
    pub(crate) fn of(
        rows: &[DesignRow],
        reference: usize,
        blocks: Vec<Range<usize>>,
    ) -> Option<Self> {
        let count = blocks.last().map_or(reference, |last| last.end);
        let weighted =
            WeightedRows::of(rows, count).filter(|weighted| weighted.groups >= reference + 2)?;
        let sums = Sums::of(&weighted, count);
        let reference = sums.reference(reference)?;
        let (sought, all) = sums.sought(&blocks, &reference, weighted.groups)?;
        let excess = weighted.excess(&all, &sums.solution(&all));
        let (found, choice) = sums.found(&blocks, &sought, &reference, excess)?;

        let mut least_found = vec![0.0; blocks.len()];
        for &number in &sought {
            let own = sums.own(&blocks[number], &reference).information[(0, 0)];
            least_found[number] = (limit(sought.len(), BY_CHANCE) * excess / own).sqrt();
        }
        let left = (sums.explained(&all) - sums.explained(&choice)).max(0.0) / excess;
        let rest = all.terms.len().saturating_sub(choice.terms.len()) as f64;
        // noise alone has the mean `rest` and scatters by √(2 rest) about it: a quarter of that is
        // no evidence
        let beyond = (left - rest - (rest / 8.0).sqrt()).max(0.0);
        let (mut coefficients, solution) = (DVector::zeros(count), sums.solution(&choice));
        let lower = (&choice.inverse * excess).cholesky()?.unpack();
        let mut root = DMatrix::zeros(count, choice.terms.len());
        for (i, &term) in choice.terms.iter().enumerate() {
            coefficients[term] = solution[i];
            root.row_mut(term).copy_from(&lower.row(i));
        }
        let hidden = (beyond * excess / sums.weight).sqrt();
        Some(Self {
            sought,
            found,
            blocks,
            coefficients,
            root,
            least_found,
            hidden,
        })
    }

    /// Sizes of the deviation of some blocks, each without the bias of noise.
    ///
    /// Noise makes any size larger. Adding errors, as large as those of the coefficients, once more
    /// gives its contribution \[Efron and Tibshirani 1993, ch. 10\], which is subtracted; the
    /// spread of these sizes is the uncertainty. If no block was found the size is 0, and its
    /// uncertainty the root mean square of a size that is equally likely anything up to the least
    /// detectable one.
    ///
    /// - `places`: terms at the places of the deviation, all touched parts and nothing else.
    /// - `sizes`: of deviations at these, m.
    /// - returns: `None` if no block was a candidate.
    pub(crate) fn sizes<const S: usize>(
        &self,
        blocks: impl Fn(usize) -> bool,
        places: &[Vec<f64>],
        sizes: impl Fn(&[f64]) -> Option<[f64; S]>,
    ) -> Option<[Estimate; S]> {
        let of = |numbers: &[usize]| -> Vec<usize> {
            numbers
                .iter()
                .filter(|number| blocks(**number))
                .flat_map(|&number| self.blocks[number].clone())
                .collect()
        };
        let field = |terms: &[usize], x: &DVector<f64>| -> Vec<f64> {
            places
                .iter()
                .map(|place| terms.iter().map(|&term| place[term] * x[term]).sum())
                .collect()
        };
        let terms = of(&self.found);
        if terms.is_empty() {
            return self.least_sizes(&blocks, places, sizes);
        }
        let here = sizes(&field(&terms, &self.coefficients))?;
        let mut rng = rand_pcg::Pcg64::seed_from_u64(SEED);
        let mut sums = [[0.0; 2]; S];
        for _ in 0..PAIRS {
            let normal =
                DVector::from_fn(self.root.ncols(), |_, _| StandardNormal.sample(&mut rng));
            let error = &self.root * normal;
            for moved in [&self.coefficients + &error, &self.coefficients - &error] {
                let drawn = sizes(&field(&terms, &moved))?;
                for (sum, off) in sums.iter_mut().zip((0..S).map(|i| drawn[i] - here[i])) {
                    *sum = [sum[0] + off, sum[1] + off * off];
                }
            }
        }
        let draws = 2.0 * PAIRS as f64;
        Some(std::array::from_fn(|i| {
            let bias = sums[i][0] / draws;
            let variance = (sums[i][1] / draws - bias * bias).max(0.0) * draws / (draws - 1.0);
            // a hidden part may raise the highest place and lower the lowest
            Estimate {
                value: (here[i] - bias).max(0.0),
                std: (variance + 2.0 * self.hidden * self.hidden).sqrt(),
            }
        }))
    }

    /// Sizes without any block found.
    fn least_sizes<const S: usize>(
        &self,
        blocks: &impl Fn(usize) -> bool,
        places: &[Vec<f64>],
        sizes: impl Fn(&[f64]) -> Option<[f64; S]>,
    ) -> Option<[Estimate; S]> {
        let of_block = |&number: &usize| {
            let (term, length) = (self.blocks[number].start, self.least_found[number]);
            sizes(
                &places
                    .iter()
                    .map(|place| place[term] * length)
                    .collect::<Vec<f64>>(),
            )
        };
        let each: Option<Vec<[f64; S]>> = self
            .sought
            .iter()
            .filter(|number| blocks(**number))
            .map(of_block)
            .collect();
        let each = each.filter(|each| !each.is_empty())?;
        let mean_square = |i: usize| {
            each.iter().map(|sizes| sizes[i] * sizes[i]).sum::<f64>() / each.len() as f64
        };
        // a uniform variable between 0 and a has the mean square a²/3
        Some(std::array::from_fn(|i| Estimate {
            value: 0.0,
            std: (mean_square(i) / 3.0).sqrt(),
        }))
    }

    /// Whether any of the blocks was a candidate.
    pub(crate) fn has_sought(&self, blocks: impl Fn(usize) -> bool) -> bool {
        self.sought.iter().any(|number| blocks(*number))
    }
}
