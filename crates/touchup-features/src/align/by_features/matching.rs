//! The features explained by a motion, and the motion that explains them best.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3, Vector6};

use super::alternative::FeaturesParams;
use super::landmark::Landmark;
use touchup_geometry::numeric::{mean, moved_by_twist};

/// Both sets of features, and their possible matches.
pub(super) struct Matching {
    pub source: Vec<Landmark>,
    pub target: Vec<Landmark>,
    /// features of the target that may match each feature of the source
    like: Vec<Vec<usize>>,
    /// m
    pub tolerance: f64,
    /// middle of the features of the source
    pub middle: Point3<f64>,
    /// half their extent, m: the arm of a turn
    pub lever: f64,
}

/// Rounds of least squares: the explained features change little.
const ROUNDS: usize = 4;

impl Matching {
    /// - `size`: of the target, m: the unit of the tolerances
    pub(crate) fn new(
        source: Vec<Landmark>,
        target: Vec<Landmark>,
        params: &FeaturesParams,
        size: f64,
    ) -> Self {
        let partners = |own: &Landmark| {
            (0..target.len())
                .filter(|&i| own.is_like(&target[i], params))
                .collect()
        };
        let like = source.iter().map(partners).collect();
        let middle = Point3::from(mean(source.iter().map(|own| own.place.coords)));
        let lever = source
            .iter()
            .map(|own| (own.place - middle).norm())
            .fold(0.0, f64::max);
        Self {
            source,
            target,
            like,
            tolerance: params.tolerance * size,
            middle,
            lever: lever.max(size / 8.0),
        }
    }

    /// Whether two landmarks could be one.
    pub(crate) fn is_like(&self, own: usize, theirs: usize) -> bool {
        self.like[own].binary_search(&theirs).is_ok()
    }

    /// Number of comparisons for one motion.
    pub(crate) fn cost(&self) -> usize {
        self.like.iter().map(Vec::len).sum::<usize>() + self.source.len()
    }

    /// The best partner of each feature and its misfit; at most 1 means explained.
    pub(crate) fn partners(&self, motion: &Isometry3<f64>) -> Vec<Option<(usize, f64)>> {
        (0..self.source.len())
            .map(|own| self.partner(motion, own))
            .collect()
    }

    fn partner(&self, motion: &Isometry3<f64>, own: usize) -> Option<(usize, f64)> {
        let misfit = |&theirs: &usize| {
            (
                theirs,
                self.source[own].misfit(motion, &self.target[theirs], self.tolerance),
            )
        };
        self.like[own]
            .iter()
            .map(misfit)
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Sum of the weights of the explained features, decreasing with their misfits.
    pub(crate) fn score(&self, motion: &Isometry3<f64>) -> f64 {
        let part = |own: usize| match self.partner(motion, own) {
            Some((_, misfit)) if misfit <= 1.0 => self.source[own].weight() * (1.0 - 0.25 * misfit),
            _ => 0.0,
        };
        (0..self.source.len()).map(part).sum()
    }

    /// Distance between the features moved by two motions, m.
    pub(crate) fn apart(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        (a * self.middle - b * self.middle).norm() + self.lever * a.rotation.angle_to(&b.rotation)
    }

    /// Least squares over the features that a motion explains.
    pub(crate) fn refined(&self, start: &Isometry3<f64>) -> Isometry3<f64> {
        let mut motion = *start;
        for _ in 0..ROUNDS {
            let Some(better) = self.step(&motion) else {
                return motion;
            };
            motion = better;
        }
        motion
    }

    fn step(&self, motion: &Isometry3<f64>) -> Option<Isometry3<f64>> {
        let centre = motion * self.middle;
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        let mut add = |held: &Matrix3<f64>,
                       arm: &Vector3<f64>,
                       shifts: f64,
                       offset: &Vector3<f64>,
                       weight: f64| {
            // a small turn θ moves the arm by θ × arm, in units of the lever
            let mut rows = nalgebra::Matrix3x6::zeros();
            rows.fixed_columns_mut::<3>(0).copy_from(&(held * shifts));
            rows.fixed_columns_mut::<3>(3)
                .copy_from(&(held * -arm.cross_matrix() / self.lever));
            normal += rows.transpose() * rows * weight;
            right -= rows.transpose() * (held * offset) * weight;
        };
        for (own, partner) in self.partners(motion).into_iter().enumerate() {
            let Some((theirs, _)) = partner.filter(|(_, misfit)| *misfit <= 1.0) else {
                continue;
            };
            let (own, theirs) = (&self.source[own], &self.target[theirs]);
            let weight = own.weight() * own.trust(theirs, self.tolerance);
            let place = motion * own.place;
            add(
                &own.held(theirs),
                &(place - centre),
                1.0,
                &(place - theirs.place),
                weight,
            );
            if let Some((axis, onto)) = own.axis.zip(theirs.axis) {
                let axis = motion * axis;
                // a tenth of the extent: about the length of a feature along its axis
                let arm = 0.1 * self.lever;
                let offset = axis * arm - onto * (arm * axis.dot(&onto).signum());
                add(&Matrix3::identity(), &(axis * arm), 0.0, &offset, weight);
            }
        }
        // a direction without constraint stays
        normal += Matrix6::identity() * (normal.diagonal().max() * 1e-9).max(f64::MIN_POSITIVE);
        let twist = normal.cholesky()?.solve(&right);
        let (shift, turn) = (
            twist.fixed_rows::<3>(0).into_owned(),
            twist.fixed_rows::<3>(3) / self.lever,
        );
        twist
            .iter()
            .all(|x| x.is_finite())
            .then(|| moved_by_twist(motion, &centre, &shift, &turn))
    }
}
