//! Design of experiments: the touch that reduces the uncertainty of the requested number most.
//!
//! With the covariance C of a surface's freedoms, a touch with derivatives g of its distance and
//! deviation σ leaves C' = C − C g gᵀ C / (σ² + gᵀ C g), so a number that changes with the freedoms
//! as c loses (cᵀ C g)² / (σ² + gᵀ C g) of its variance \[Atkinson Donev 1992, c-optimality\]. The
//! choice is one touch after the other, each as if the earlier ones had been made.

use nalgebra::{Point3, SMatrix};

use touchup_features::features::fit::{FREEDOMS, Fit, Freedom, Steps, SurfaceModel};

type InformationMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;

/// A possible touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Place of the touch on the surface, m in O.
    pub point: Point3<f64>,
    /// Standard deviation along the normal, m.
    pub sigma: f64,
}

/// Requested standard deviations of the numbers of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TargetUncertainties {
    /// Derivatives of each number by the freedoms, over its requested deviation.
    by: Vec<Steps>,
    /// the same for other numbers, which must not stay undetermined
    rest: Vec<Steps>,
}

/// Allowed deviation of such a number, over the requested deviation.
const REST: f64 = 8.0;

impl TargetUncertainties {
    /// Adds a number with a requested standard deviation of `sigma` (m or rad).
    pub(crate) fn and(mut self, by: &[(Freedom, f64)], sigma: f64) -> Self {
        let mut steps = Steps::zeros();
        by.iter()
            .for_each(|(freedom, x)| steps[*freedom as usize] += x / sigma);
        self.by.push(steps);
        self
    }

    /// Adds several numbers, each of one freedom.
    pub(super) fn each(self, freedoms: &[Freedom], sigma: f64) -> Self {
        freedoms
            .iter()
            .fold(self, |asked, freedom| asked.and(&[(*freedom, 1.0)], sigma))
    }

    /// Whether a fit fixes all requested numbers.
    pub(super) fn is_fixed_by<M: SurfaceModel>(&self, fit: &Fit<M>) -> bool {
        self.by.iter().all(|by| fit.std_of(by).is_some())
    }

    /// Adds all freedoms of a surface with a rough request: a number comes from a fit, and a fit
    /// with another number open goes astray by its curvature.
    ///
    /// - `sigma`: requested of the numbers, m; `size`: of the surface, m, as the lever of a lean.
    pub(crate) fn and_the_rest<M: SurfaceModel>(mut self, sigma: f64, size: f64) -> Self {
        for freedom in Freedom::ALL
            .into_iter()
            .filter(|freedom| M::FREE[*freedom as usize])
        {
            let is_angle = matches!(freedom, Freedom::TiltX | Freedom::TiltY | Freedom::Turn);
            let lever = if is_angle { size } else { 1.0 };
            self.rest
                .push(Steps::ith(freedom as usize, lever / (REST * sigma)));
        }
        self
    }
}

/// Covariance of a surface's freedoms.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Knowledge {
    covariance: InformationMatrix,
}

impl Knowledge {
    /// Before any touch: standard deviations of `length` (m) or `angle` (rad) for each freedom of
    /// the surface.
    pub(crate) fn before<M: SurfaceModel>(length: f64, angle: f64) -> Self {
        let sigma = Freedom::ALL.map(|freedom| match freedom {
            _ if !M::FREE[freedom as usize] => 0.0,
            Freedom::TiltX | Freedom::TiltY | Freedom::Turn => angle,
            Freedom::Second if !M::SECOND_IS_LENGTH => angle,
            _ => length,
        });
        Self {
            covariance: InformationMatrix::from_diagonal(&Steps::from(
                sigma.map(|sigma| sigma * sigma),
            )),
        }
    }

    /// After one more touch of the surface.
    pub(crate) fn with<M: SurfaceModel>(&self, surface: &M, touch: &Candidate) -> Self {
        let (_, g) = surface.derivatives(&touch.point);
        let cg = self.covariance * g;
        let covariance = self.covariance - cg * cg.transpose() / (touch.sigma.powi(2) + g.dot(&cg));
        // symmetric in spite of rounding
        Self {
            covariance: (covariance + covariance.transpose()) / 2.0,
        }
    }

    /// Standard deviation of the surface along its normal at a place of it, m.
    pub(crate) fn sigma_at<M: SurfaceModel>(&self, surface: &M, point: &Point3<f64>) -> f64 {
        let (_, g) = surface.derivatives(point);
        g.dot(&(self.covariance * g)).max(0.0).sqrt()
    }

    /// Largest deviation over its request; at most 1 if all requests are met.
    pub(crate) fn worst(&self, asked: &TargetUncertainties) -> f64 {
        let shares = asked
            .by
            .iter()
            .map(|c| c.dot(&(self.covariance * c)).max(0.0).sqrt());
        shares.fold(0.0, f64::max)
    }

    /// Reduction by a touch of the sum over the requested numbers of (deviation / requested
    /// deviation)².
    pub(crate) fn gain<M: SurfaceModel>(
        &self,
        surface: &M,
        touch: &Candidate,
        asked: &TargetUncertainties,
    ) -> f64 {
        let (_, g) = surface.derivatives(&touch.point);
        let cg = self.covariance * g;
        let reduction: f64 = asked
            .by
            .iter()
            .chain(&asked.rest)
            .map(|c| c.dot(&cg).powi(2))
            .sum();
        reduction / (touch.sigma.powi(2) + g.dot(&cg))
    }

    /// Candidate with the largest gain, the first among equals, and its gain; `None` without a
    /// gain.
    ///
    /// - `touch`: of a candidate.
    pub(crate) fn best<M: SurfaceModel, T>(
        &self,
        surface: &M,
        candidates: impl IntoIterator<Item = T>,
        touch: impl Fn(&T) -> Candidate,
        asked: &TargetUncertainties,
    ) -> Option<(T, f64)> {
        let gain = |candidate: &T| self.gain(surface, &touch(candidate), asked);
        let gains = candidates
            .into_iter()
            .map(|candidate| (gain(&candidate), candidate));
        let best = gains
            .filter(|(gain, _)| *gain > 0.0)
            .reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.map(|(gain, candidate)| (candidate, gain))
    }
}

#[cfg(test)]
mod tests;
