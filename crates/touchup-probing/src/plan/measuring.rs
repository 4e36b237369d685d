//! Contacts of one surface, and its next touch by the largest gain.

use nalgebra::{Matrix3, Point3, Vector3};

use super::design::{Candidate, Knowledge, TargetUncertainties};
use super::error::ExploreError;
use super::pattern::PatternStep;
use super::search_context::{
    ExpectedTravel, FeatureQuantity, PatternParams, SearchContext, TouchPlan, TouchResult,
};
use touchup_features::features::fit::{
    Fit, FitParams, Freedom, Observation, Plane, SurfaceModel, fit,
};

/// A candidate touch: its place on the surface, and its plan.
pub(super) struct CandidateTouch {
    /// place on the surface, m in O
    pub point: Point3<f64>,
    /// travel of the ball's centre from the start of the search, m
    pub travel: f64,
    pub planned: TouchPlan,
}

/// Depth behind a touched wall at which the scan has to have a part, m.
const BEHIND: f64 = 0.3e-3;

impl SearchContext {
    /// Candidates for which the scan has a part: all around a touch from above, behind a touched
    /// wall.
    pub(crate) fn on_part(
        &self,
        possible: impl IntoIterator<Item = CandidateTouch>,
    ) -> Vec<CandidateTouch> {
        let is_part = |p: &CandidateTouch| {
            let (behind, radius) = if self.is_down(&p.planned) {
                (0.0, self.params.ball_radius)
            } else {
                (BEHIND, 0.0)
            };
            self.outline.is_part(
                &(p.point + p.planned.direction.into_inner() * behind),
                radius,
            )
        };
        possible.into_iter().filter(is_part).collect()
    }
}

/// Request for a surface, and prior of it before any touch.
pub(super) struct SurfaceRequest {
    pub before: Knowledge,
    pub asked: TargetUncertainties,
    pub fit: FitParams,
    /// minimum number of touches for a credible surface
    pub least: usize,
    pub params: PatternParams,
}

impl SurfaceRequest {
    /// Request for a plane.
    ///
    /// - `leans`: leans that count, as far as `reach` from its middle, m; `most`: lean above which
    ///   it is another surface, rad.
    pub(crate) fn of_plane(
        params: &PatternParams,
        leans: &[Freedom],
        reach: f64,
        most: f64,
        least: usize,
    ) -> Self {
        let (asked, sigma) = (TargetUncertainties::default(), params.sigma);
        let asked = match params.quantity {
            FeatureQuantity::Axis => asked.each(leans, sigma),
            FeatureQuantity::Position => asked.each(&[Freedom::Z], sigma),
            _ => asked.each(&[Freedom::Z], sigma).each(leans, sigma / reach),
        };
        let (before, fit) = (
            Knowledge::before::<Plane>(params.flag_radius, most),
            FitParams::default(),
        );
        Self {
            before,
            asked,
            fit,
            least,
            params: *params,
        }
    }

    /// Covariance of a surface after its touches.
    fn known<'a, M: SurfaceModel>(
        &self,
        surface: &M,
        touches: impl Iterator<Item = &'a Observation>,
    ) -> Knowledge {
        touches.fold(self.before.clone(), |known, o| {
            // the ball's centre lies on the same normal as its contact
            known.with(
                surface,
                &Candidate {
                    point: o.point,
                    sigma: o.sigma,
                },
            )
        })
    }
}

/// Touches of one surface.
#[derive(Clone, Debug, Default)]
pub(super) struct Measuring {
    pub observations: Vec<Observation>,
    /// places without a contact, or without a clear one
    dead: Vec<Point3<f64>>,
    aimed: Option<Point3<f64>>,
}

/// Maximum share of touches off the surface.
const MOST_REFUSED: f64 = 0.2;
/// Misfits beyond the unknowns of their displacement, for an agreement.
const AGREEING: usize = 2;
/// Distance of misfits that agree, in their standard deviations.
const WITHIN: f64 = 2.0;
/// Minimum share of the misfits' normals in a direction that they determine.
const SHARE: f64 = 0.2;
/// Radius around a place without contact in which no touch follows, m.
const DEAD: f64 = 0.2e-3;

impl Measuring {
    /// Takes a touch that aimed at this surface.
    pub(crate) fn take(&mut self, touch: &PatternStep) {
        let aimed = self.aimed.take();
        match (touch.result, aimed) {
            (TouchResult::At { .. }, _) => self.observations.extend(touch.observation),
            (_, Some(aimed)) => self.dead.push(aimed),
            (_, None) => {}
        }
    }

    /// Refuses the last contact, which belongs to another surface.
    pub(crate) fn refuse_last(&mut self, touch: &PatternStep) {
        if self.observations.last() == touch.observation.as_ref()
            && self.observations.pop().is_some()
        {
            self.dead.push(touch.planned.from);
        }
    }

    /// Largest standard uncertainty of the requested numbers, m or rad in proportion to the
    /// requested one of each, by the touches on one surface, and stretched if they differ from it
    /// beyond their own uncertainty.
    ///
    /// `None` for too few touches, for touches that do not fix a number, or for more than
    /// [`MOST_REFUSED`] of them off the surface.
    pub(crate) fn uncertainty<M: SurfaceModel>(
        &self,
        guess: &M,
        wanted: &SurfaceRequest,
    ) -> Option<f64> {
        if self.observations.len() < wanted.least {
            return None;
        }
        let fit = fit(guess, &self.observations, &wanted.fit).ok()?;
        let refused = fit.used.iter().filter(|used| !**used).count() as f64;
        if !wanted.asked.is_fixed_by(&fit)
            || refused > MOST_REFUSED * self.observations.len() as f64
        {
            return None;
        }
        let kept = self
            .observations
            .iter()
            .zip(&fit.used)
            .filter(|(_, used)| **used)
            .map(|(o, _)| o);
        let share = wanted.known(guess, kept).worst(&wanted.asked);
        Some(
            share
                * (fit.chi_squared / fit.degrees.max(1) as f64)
                    .sqrt()
                    .max(1.0)
                * wanted.params.sigma,
        )
    }

    /// Surface through the contacts.
    ///
    /// # Errors
    /// [`ExploreError::TwoSurfaces`] if the contacts that it leaves out agree; as [`fit`].
    pub(crate) fn fitted<M: SurfaceModel>(
        &self,
        guess: &M,
        params: &FitParams,
    ) -> Result<Fit<M>, ExploreError> {
        let found = fit(guess, &self.observations, params)?;
        // walls that lean more than expected are no second surface
        let leaning = FitParams {
            axis_sigma: None,
            ..*params
        };
        match fit(&found.surface, &self.observations, &leaning) {
            Ok(free) if free.degrees >= AGREEING => self.agreeing(&free).map_or(Ok(found), Err),
            _ => Ok(found),
        }
    }

    /// Error for contacts that a fit leaves out, if they are off its surface alike.
    fn agreeing<M: SurfaceModel>(&self, fit: &Fit<M>) -> Option<ExploreError> {
        let off: Vec<_> = self
            .observations
            .iter()
            .zip(&fit.used)
            .filter(|(_, used)| !**used)
            .map(|(o, _)| {
                let (distance, normal) = fit.surface.distance_and_normal(&o.point);
                let std = fit.std_at(&o.point).unwrap_or(0.0);
                (distance - o.offset, normal, o.sigma.hypot(std))
            })
            .collect();
        let how = lying_together(&off)?;
        let numbers = |is_used| {
            let all = self.observations.iter().zip(&fit.used);
            all.filter(move |(_, used)| **used == is_used)
                .map(|(o, _)| o.group)
        };
        let first = numbers(false).min()?;
        Some(ExploreError::TwoSurfaces {
            misfits: off.len(),
            of: self.observations.len(),
            how,
            since: (numbers(true).max()? < first).then(|| first - 1),
        })
    }

    /// Touch with the largest gain for the requested numbers, and its gain.
    pub(crate) fn best<M: SurfaceModel>(
        &self,
        surface: &M,
        wanted: &SurfaceRequest,
        possible: Vec<CandidateTouch>,
    ) -> Option<(CandidateTouch, f64)> {
        let known = wanted.known(surface, self.observations.iter());
        let is_alive =
            |p: &CandidateTouch| self.dead.iter().all(|dead| (dead - p.point).norm() > DEAD);
        let candidate = |p: &CandidateTouch| Candidate {
            point: p.point,
            sigma: wanted.params.touch_sigma,
        };
        let possible = possible.into_iter().filter(is_alive);
        let (mut chosen, gain) = known.best(surface, possible, candidate, &wanted.asked)?;
        let sigma = known.sigma_at(surface, &chosen.point);
        chosen.planned.expected = Some(ExpectedTravel {
            travel: chosen.travel,
            sigma,
        });
        Some((chosen, gain))
    }

    /// Plan of the touch with the largest gain.
    pub(crate) fn next<M: SurfaceModel>(
        &mut self,
        surface: &M,
        wanted: &SurfaceRequest,
        possible: Vec<CandidateTouch>,
    ) -> Option<TouchPlan> {
        self.best(surface, wanted, possible)
            .map(|(best, _)| self.aim(&best))
    }

    /// Plans a touch of this surface.
    pub(crate) fn aim(&mut self, possible: &CandidateTouch) -> TouchPlan {
        self.aimed = Some(possible.point);
        possible.planned
    }
}

/// Common offset of contacts from a surface: equal along its normals, or by one displacement of it;
/// `None` without agreement.
///
/// - `off`: offset of each, m; the normal there, in O, and its standard deviation, m.
fn lying_together(off: &[(f64, Vector3<f64>, f64)]) -> Option<String> {
    let mean = off.iter().map(|(off, ..)| off).sum::<f64>() / off.len() as f64;
    let is_mean = |(off, _, sigma): &(f64, Vector3<f64>, f64)| (off - mean).abs() <= WITHIN * sigma;
    if off.len() > AGREEING && off.iter().all(is_mean) {
        let side = if mean > 0.0 { "outside of" } else { "below" };
        return Some(format!("{:.3} mm {side}", mean.abs() * 1e3));
    }
    let normals = off.iter().map(|(_, n, _)| n * n.transpose());
    let parts = normals.sum::<Matrix3<f64>>().symmetric_eigen();
    let pulls = off.iter().map(|(off, n, _)| n * *off).sum::<Vector3<f64>>();
    // few normals in a direction do not determine it
    let is_theirs = |axis: &usize| parts.eigenvalues[*axis] > SHARE * off.len() as f64;
    let axes: Vec<_> = (0..3).filter(is_theirs).collect();
    let by: Vector3<f64> = axes
        .iter()
        .map(|axis| {
            let direction = parts.eigenvectors.column(*axis);
            direction * (direction.dot(&pulls) / parts.eigenvalues[*axis])
        })
        .sum();
    let is_by =
        |(off, n, sigma): &(f64, Vector3<f64>, f64)| (off - n.dot(&by)).abs() <= WITHIN * sigma;
    let [x, y, z] = (by * 1e3).into();
    (off.len() >= axes.len() + AGREEING && off.iter().all(is_by))
        .then(|| format!("displaced by ({x:.3}, {y:.3}, {z:.3}) mm from"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals in µm with 10 µm each, by hand.
    #[test]
    fn misfits_that_agree_lie_together_and_those_that_scatter_do_not() {
        let together = |list: &[(f64, [f64; 2])]| {
            let off: Vec<_> = list
                .iter()
                .map(|(um, [x, y])| (um * 1e-6, Vector3::new(*x, *y, 0.0).normalize(), 10e-6))
                .collect();
            lying_together(&off)
        };
        let step = [
            (200.0, [1.0, 0.0]),
            (195.0, [0.0, 1.0]),
            (205.0, [-1.0, 0.0]),
        ];
        assert_eq!(together(&step).unwrap(), "0.200 mm outside of");
        let below = step.map(|(um, normal)| (-um, normal));
        assert_eq!(together(&below).unwrap(), "0.200 mm below");
        assert_eq!(together(&step[..2]), None, "two agree by chance");
        // displaced by 300 µm along x: 300 cos
        let slipped = [
            (300.0, [1.0, 0.0]),
            (-300.0, [-1.0, 0.0]),
            (0.0, [0.0, 1.0]),
            (212.1, [1.0, 1.0]),
        ];
        let by = together(&slipped).unwrap();
        assert!(by.starts_with("displaced by (0.300, "), "{by}");
        assert_eq!(
            together(&slipped[..3]),
            None,
            "three say nothing of two directions"
        );
        let scattered = [
            (300.0, [1.0, 0.0]),
            (250.0, [-1.0, 0.0]),
            (-200.0, [0.0, 1.0]),
            (90.0, [1.0, 1.0]),
        ];
        assert_eq!(together(&scattered), None);
        assert_eq!(together(&[]), None);
    }
}
