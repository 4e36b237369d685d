//! Design of experiments: the touch that reduces the uncertainty of the requested number most.
//!
//! With the covariance C of a surface's freedoms, a touch with derivatives g of its distance and
//! deviation σ leaves C' = C − C g gᵀ C / (σ² + gᵀ C g), so a number that changes with the freedoms
//! as c loses (cᵀ C g)² / (σ² + gᵀ C g) of its variance \[Atkinson Donev 1992, c-optimality\].
//! Touches are chosen one after the other, each as if those before had been made.

use nalgebra::{Point3, SMatrix};

use crate::features::fit::{FREEDOMS, Fit, Freedom, Steps, Surface};

type InformationMatrix = SMatrix<f64, FREEDOMS, FREEDOMS>;

/// A touch that could be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Where the surface would be touched, m in O.
    pub point: Point3<f64>,
    /// Standard deviation along the normal, m.
    pub sigma: f64,
}

/// The requested numbers of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// For each number how it changes with the freedoms, over its requested deviation.
    by: Vec<Steps>,
    /// the same for numbers not requested that must not stay undetermined
    rest: Vec<Steps>,
}

/// A number not requested may have so many times the requested deviation.
const REST: f64 = 8.0;

impl Asked {
    /// One more number, that is to be known with a standard deviation of `sigma` (m or rad).
    pub fn and(mut self, by: &[(Freedom, f64)], sigma: f64) -> Self {
        let mut steps = Steps::zeros();
        by.iter()
            .for_each(|(freedom, x)| steps[*freedom as usize] += x / sigma);
        self.by.push(steps);
        self
    }

    /// Several more, each of one freedom.
    pub(super) fn each(self, freedoms: &[Freedom], sigma: f64) -> Self {
        freedoms
            .iter()
            .fold(self, |asked, freedom| asked.and(&[(*freedom, 1.0)], sigma))
    }

    /// Whether a fit fixes all requested numbers.
    pub(super) fn is_fixed_by<M: Surface>(&self, fit: &Fit<M>) -> bool {
        self.by.iter().all(|by| fit.std_of(by).is_some())
    }

    /// With all freedoms of a surface to be known roughly: a number comes of a fit, and a fit in
    /// which another one is open goes astray by its curvature.
    ///
    /// - `sigma`: requested of the numbers, m; `size`: of the surface, m, by which a lean counts.
    pub fn and_the_rest<M: Surface>(mut self, sigma: f64, size: f64) -> Self {
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

/// What is known of a surface's freedoms.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    covariance: InformationMatrix,
}

impl Knowledge {
    /// Before any touch: each freedom of the surface is known within `length` (m) or `angle` (rad),
    /// standard deviations.
    pub fn before<M: Surface>(length: f64, angle: f64) -> Self {
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

    /// With one more touch of the surface.
    pub fn with<M: Surface>(&self, surface: &M, touch: &Candidate) -> Self {
        let (_, g) = surface.derivatives(&touch.point);
        let cg = self.covariance * g;
        let covariance = self.covariance - cg * cg.transpose() / (touch.sigma.powi(2) + g.dot(&cg));
        // rounding must not make it lopsided
        Self {
            covariance: (covariance + covariance.transpose()) / 2.0,
        }
    }

    /// Standard deviation of the surface along its normal at a place of it, m.
    pub(crate) fn sigma_at<M: Surface>(&self, surface: &M, point: &Point3<f64>) -> f64 {
        let (_, g) = surface.derivatives(point);
        g.dot(&(self.covariance * g)).max(0.0).sqrt()
    }

    /// The largest of the deviations over the requested ones; at most 1 when all are met.
    pub fn worst(&self, asked: &Asked) -> f64 {
        let shares = asked
            .by
            .iter()
            .map(|c| c.dot(&(self.covariance * c)).max(0.0).sqrt());
        shares.fold(0.0, f64::max)
    }

    /// How much a touch would take from the sum over the requested numbers of (deviation /
    /// requested deviation)².
    pub fn gain<M: Surface>(&self, surface: &M, touch: &Candidate, asked: &Asked) -> f64 {
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

    /// The candidate with the largest gain, the first among equals, and its gain; `None` when none
    /// has a gain.
    ///
    /// - `touch`: that a candidate stands for.
    pub fn best<M: Surface, T>(
        &self,
        surface: &M,
        candidates: impl IntoIterator<Item = T>,
        touch: impl Fn(&T) -> Candidate,
        asked: &Asked,
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
