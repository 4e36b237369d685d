//! Variances of unknowns whose observations share their errors.

use nalgebra::{SMatrix, SVector};

/// Information of unknowns, and scores of groups of observations, in the order of time.
pub(super) struct GroupedScores<const N: usize> {
    pub information: SMatrix<f64, N, N>,
    /// gradients of the cost by each group
    pub scores: Vec<SVector<f64, N>>,
}

impl<const N: usize> GroupedScores<N> {
    /// Variances of the unknowns, and the mean share by which they exceed those of independent
    /// observations: of these, or of independent groups of groups, whichever is largest (batch
    /// means: errors that wander slowly are the same in neighbours).
    ///
    /// - `unknowns`: number of the first ones that are free.
    pub(super) fn variances(&self, unknowns: usize) -> Option<(SVector<f64, N>, f64)> {
        let inverse = self.information.cholesky()?.inverse();
        let independent = inverse.diagonal();
        let lengths = (0..).map(|power| 1 << power);
        // twice the unknowns
        let fewest = 2 * unknowns;
        let lengths = lengths.take_while(|length| self.scores.len() >= fewest * length);
        let of_groups = lengths.map(|length: usize| {
            let groups = self.scores.chunks(length);
            let spare = groups.len() as f64 / (groups.len() - unknowns) as f64;
            let scores = groups.map(|group| inverse * group.iter().sum::<SVector<f64, N>>());
            scores
                .map(|score| score.component_mul(&score))
                .sum::<SVector<f64, N>>()
                * spare
        });
        let variances = of_groups.fold(independent, |most, of| most.sup(&of));
        let alike = variances.component_div(&independent);
        let alike = alike.rows(0, unknowns).mean();
        Some((variances, alike))
    }
}
