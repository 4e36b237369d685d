//! The longest undulations of noisy points, by weighted least squares.
//!
//! Raw points are as far apart as the noise of the outermost ones: the more points, the wider. So the deviation is a sum of few terms, long
//! undulations as a filter of ISO 12181 or 12781 leaves them, and only terms that stand out of the noise are part of it: they are taken up one
//! after another, each time the one that explains most. Points of one group share their error and weigh as one; how large the errors are the
//! residuals of all terms together say.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::distr::Distribution;
use rand_distr::StandardNormal;

use crate::numeric::distinct;

/// What is known of a number: the best estimate and its standard uncertainty.
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
    pub point: nalgebra::Point3<f64>,
    /// standard deviation along the normal, m, > 0
    pub sigma: f64,
    /// points of one group share their error
    pub group: u32,
}

/// A deviation and what each term would add to it there.
pub(super) struct Row {
    pub terms: Vec<f64>,
    /// m
    pub value: f64,
    pub sigma: f64,
    pub group: u32,
}

/// Probability that a block of terms is found where there is none …
const BY_CHANCE: f64 = 0.01;
/// … and one more beside others: a deviation that is there is seldom of one term.
const MORE_BY_CHANCE: f64 = 0.05;
/// A term is looked for when so much of it, squared, is not in the others.
const LEAST_SHARE: f64 = 0.1;
/// … and of the reference, for which a short arc suffices.
const LEAST_REFERENCE: f64 = 1e-7;
/// Groups for each term, at least.
const GROUPS_PER_TERM: usize = 3;
/// From so many spare groups on the residuals say how large the errors are; with fewer these are no less than stated.
const SPARE_GROUPS: usize = 20;
/// Draws of the errors, in pairs of opposite sign: their spread is known to 7 %.
const PAIRS: usize = 50;
/// Of the draws: the same points give the same numbers.
const SEED: u64 = 12181;

/// Terms fitted to points.
pub(super) struct Profile {
    /// blocks of terms that were looked for, in their order
    pub sought: Vec<usize>,
    /// those that stand out of the noise
    pub found: Vec<usize>,
    blocks: Vec<Range<usize>>,
    /// of all terms; 0 where not found
    coefficients: DVector<f64>,
    /// of terms found: columns whose products with independent normal numbers are errors of the coefficients
    root: DMatrix<f64>,
    /// least length of the first term of each block at which it is found, m; 0 where it was not sought
    least_found: Vec<f64>,
    /// root mean square of what the terms that are not found hold together beyond noise, m
    hidden: f64,
}

/// Weighted normal equations over all terms.
struct Sums {
    information: DMatrix<f64>,
    right: DVector<f64>,
    weight: f64,
}

impl Sums {
    fn of(rows: &[Row], weights: &[f64], count: usize) -> Self {
        let mut sums = Self {
            information: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
            weight: weights.iter().sum(),
        };
        for (row, &w) in rows.iter().zip(weights) {
            let terms = DVector::from_column_slice(&row.terms);
            sums.information.ger(w, &terms, &terms, 1.0);
            sums.right.axpy(w * row.value, &terms, 1.0);
        }
        sums
    }

    /// Inverse of the information of some terms.
    fn inverse(&self, terms: &[usize]) -> Option<DMatrix<f64>> {
        let chosen = DMatrix::from_fn(terms.len(), terms.len(), |i, j| self.information[(terms[i], terms[j])]);
        let scale = DVector::from_fn(terms.len(), |i, _| chosen[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
        let scaled = DMatrix::from_fn(terms.len(), terms.len(), |i, j| chosen[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        Some(DMatrix::from_fn(terms.len(), terms.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }

    fn solution(&self, terms: &[usize], inverse: &DMatrix<f64>) -> DVector<f64> {
        inverse * DVector::from_fn(terms.len(), |i, _| self.right[terms[i]])
    }

    /// What a block adds to some terms: its own information, its own right side, and the least share of a term that is its own.
    fn own(&self, block: &Range<usize>, terms: &[usize], inverse: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>, f64) {
        let between = DMatrix::from_fn(terms.len(), block.len(), |i, j| self.information[(terms[i], block.start + j)]);
        let inside = self.information.view((block.start, block.start), (block.len(), block.len())).into_owned();
        let own = &inside - between.tr_mul(&(inverse * &between));
        let solution = self.solution(terms, inverse);
        let right = self.right.rows(block.start, block.len()) - between.tr_mul(&solution);
        let share = (0..block.len()).map(|j| own[(j, j)] / inside[(j, j)].max(f64::MIN_POSITIVE)).fold(1.0, f64::min);
        (own, right, share)
    }
}

/// How much the residuals lose, in squares, by a block.
fn gain(own: &DMatrix<f64>, right: &DVector<f64>) -> f64 {
    own.clone().cholesky().map_or(0.0, |cholesky| right.dot(&cholesky.solve(right)))
}

impl Profile {
    /// - `reference`: how many of the first terms are the reference, which is no deviation.
    /// - `blocks`: terms that are found together or not at all, behind the reference, the longest undulations first.
    /// - returns: `None` where the points do not determine the reference.
    pub fn of(rows: &[Row], reference: usize, blocks: Vec<Range<usize>>) -> Option<Self> {
        let count = blocks.last().map_or(reference, |last| last.end);
        let names = distinct(rows.iter().map(|row| row.group));
        let group: Vec<usize> = rows.iter().map(|row| names.partition_point(|&name| name < row.group)).collect();
        let mut in_group = vec![0.0; names.len()];
        group.iter().for_each(|&g| in_group[g] += 1.0);
        let weights: Vec<f64> =
            rows.iter().zip(&group).map(|(row, &g)| 1.0 / (row.sigma * row.sigma * in_group[g])).collect();
        let is_sound = rows.iter().zip(&weights).all(|(row, w)| {
            row.value.is_finite()
                && w.is_finite()
                && *w > 0.0
                && row.terms.len() == count
                && row.terms.iter().all(|x| x.is_finite())
        });
        if !is_sound || names.len() < reference + 2 {
            return None;
        }
        let sums = Sums::of(rows, &weights, count);

        let mut of_reference: Vec<usize> = Vec::new();
        let mut inverse = DMatrix::zeros(0, 0);
        for term in 0..reference {
            let (.., share) = sums.own(&(term..term + 1), &of_reference, &inverse);
            if sums.information[(term, term)] > 0.0 && share > LEAST_REFERENCE {
                of_reference.push(term);
                inverse = sums.inverse(&of_reference)?;
            }
        }

        // what is no reference is sought; all that the points can tell apart says how large the errors are
        let (mut all, mut all_inverse, mut sought) = (of_reference.clone(), inverse.clone(), Vec::new());
        for (number, block) in blocks.iter().enumerate() {
            if names.len() < reference + GROUPS_PER_TERM * (block.end - reference) {
                break;
            }
            if sums.own(block, &of_reference, &inverse).2 > LEAST_SHARE {
                sought.push(number);
            }
            let (own, _, share) = sums.own(block, &all, &all_inverse);
            if share > LEAST_SHARE && own.cholesky().is_some() {
                all.extend(block.clone());
                all_inverse = sums.inverse(&all)?;
            }
        }
        let full = sums.solution(&all, &all_inverse);
        let (mut of_group, mut weight_of_group) = (vec![0.0; names.len()], vec![0.0; names.len()]);
        for ((row, &w), &g) in rows.iter().zip(&weights).zip(&group) {
            let fitted: f64 = all.iter().zip(full.iter()).map(|(&term, x)| row.terms[term] * x).sum();
            of_group[g] += w * (row.value - fitted);
            weight_of_group[g] += w;
        }
        let spare = names.len() - all.len();
        let square: f64 =
            of_group.iter().zip(&weight_of_group).map(|(sum, w)| sum * sum / w).sum::<f64>() / spare as f64;
        let excess = if spare < SPARE_GROUPS { square.max(1.0) } else { square.max(f64::MIN_POSITIVE) };

        // of squares of two normal numbers more than x come by chance with probability exp(−x/2)
        let limit_by = |chance: f64| 2.0 * (sought.len().max(1) as f64 / chance).ln() * excess;
        let limit = limit_by(BY_CHANCE);
        let mut least_found = vec![0.0; blocks.len()];
        for &number in &sought {
            let (own, ..) = sums.own(&blocks[number], &of_reference, &inverse);
            least_found[number] = (limit / own[(0, 0)]).sqrt();
        }
        let (mut terms, mut found) = (of_reference.clone(), Vec::new());
        loop {
            let rest = sought.iter().filter(|number| !found.contains(*number));
            let gains = rest.filter_map(|&number| {
                let (own, right, share) = sums.own(&blocks[number], &terms, &inverse);
                (share > LEAST_SHARE).then(|| (number, gain(&own, &right)))
            });
            let limit = if found.is_empty() { limit } else { limit_by(MORE_BY_CHANCE) };
            let Some((best, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, gain)| *gain > limit) else {
                break;
            };
            found.push(best);
            terms.extend(blocks[best].clone());
            inverse = sums.inverse(&terms)?;
        }
        found.sort_unstable();
        let solution = sums.solution(&terms, &inverse);
        let explained = |terms: &[usize], x: &DVector<f64>| -> f64 {
            terms.iter().zip(x.iter()).map(|(&t, x)| sums.right[t] * x).sum()
        };
        let left = (explained(&all, &full) - explained(&terms, &solution)).max(0.0) / excess;
        let rest = (all.len() - terms.len()) as f64;
        let beyond = (left - rest - (rest / 8.0).sqrt()).max(0.0);
        let mut coefficients = DVector::zeros(count);
        terms.iter().zip(solution.iter()).for_each(|(&term, x)| coefficients[term] = *x);
        let lower = (inverse * excess).cholesky()?.unpack();
        let mut root = DMatrix::zeros(count, terms.len());
        terms.iter().enumerate().for_each(|(i, &term)| root.row_mut(term).copy_from(&lower.row(i)));
        Some(Self {
            sought,
            found,
            blocks,
            coefficients,
            root,
            least_found,
            hidden: (beyond * excess / sums.weight).sqrt(),
        })
    }

    /// Sizes of the deviation that some blocks make, each without the bias of noise.
    ///
    /// Noise makes any size larger. What it adds is found by adding errors, as large as those of the coefficients, once more \[Efron and
    /// Tibshirani 1993, ch. 10\], and taken off; their spread is the uncertainty. Where no block was found the size is 0, and its
    /// uncertainty the root mean square of a size that is equally likely anything up to the least that would have been found.
    ///
    /// - `places`: terms at the places at which the deviation is taken, all that was touched and nothing else.
    /// - `sizes`: of deviations at these, m.
    /// - returns: `None` where no block was sought.
    pub fn sizes<const S: usize>(
        &self,
        blocks: impl Fn(usize) -> bool,
        places: &[Vec<f64>],
        sizes: impl Fn(&[f64]) -> Option<[f64; S]>,
    ) -> Option<[Estimate; S]> {
        let of = |numbers: &[usize]| -> Vec<usize> {
            numbers.iter().filter(|number| blocks(**number)).flat_map(|&number| self.blocks[number].clone()).collect()
        };
        let field = |terms: &[usize], x: &DVector<f64>| -> Vec<f64> {
            places.iter().map(|place| terms.iter().map(|&term| place[term] * x[term]).sum()).collect()
        };
        let terms = of(&self.found);
        if terms.is_empty() {
            return self.least_sizes(&blocks, places, sizes);
        }
        let here = sizes(&field(&terms, &self.coefficients))?;
        let mut rng = rand_pcg::Pcg64::seed_from_u64(SEED);
        let mut sums = [[0.0; 2]; S];
        for _ in 0..PAIRS {
            let normal = DVector::from_fn(self.root.ncols(), |_, _| StandardNormal.sample(&mut rng));
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
            Estimate { value: (here[i] - bias).max(0.0), std: (variance + 2.0 * self.hidden * self.hidden).sqrt() }
        }))
    }

    /// Sizes where nothing was found.
    fn least_sizes<const S: usize>(
        &self,
        blocks: &impl Fn(usize) -> bool,
        places: &[Vec<f64>],
        sizes: impl Fn(&[f64]) -> Option<[f64; S]>,
    ) -> Option<[Estimate; S]> {
        let of_block = |&number: &usize| {
            let (term, length) = (self.blocks[number].start, self.least_found[number]);
            sizes(&places.iter().map(|place| place[term] * length).collect::<Vec<f64>>())
        };
        let each: Option<Vec<[f64; S]>> = self.sought.iter().filter(|number| blocks(**number)).map(of_block).collect();
        let each = each.filter(|each| !each.is_empty())?;
        let mean_square = |i: usize| each.iter().map(|sizes| sizes[i] * sizes[i]).sum::<f64>() / each.len() as f64;
        // of what is equally likely between 0 and a the mean square is a²/3
        Some(std::array::from_fn(|i| Estimate { value: 0.0, std: (mean_square(i) / 3.0).sqrt() }))
    }

    /// Whether something of a block was looked for.
    pub fn has_sought(&self, blocks: impl Fn(usize) -> bool) -> bool {
        self.sought.iter().any(|number| blocks(*number))
    }
}
