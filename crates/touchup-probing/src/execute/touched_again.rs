//! Repeated touches of references.

use nalgebra::{Point3, UnitQuaternion};

use super::ending::{Ending, ReferenceTouch};
use super::feature_probing::{FeatureProbing, LineGuard};
use super::reference::{MOVED, ReferenceContact};
use crate::arm::ProbeError;
use crate::plan::{TouchPlan, TouchResult};

/// Standard deviations beyond which a contact is touched once more: by chance three in a thousand.
const DOUBTFUL: f64 = 3.0;
/// Touches of a contact that seems to have moved. [`MOVED`] deviations of the mean of three are 5.7
/// of one touch, as four of the first difference are.
const LOOKS: usize = 3;

const DOING: &str = "touching a reference again";

impl FeatureProbing<'_, '_> {
    /// Touches all references again, except unreachable ones, and ones with an unclear contact now.
    ///
    /// # Errors
    /// [`ProbeError::Displaced`] if a reference has moved; as any touch.
    pub(crate) fn touch_references(&mut self) -> Result<(), Ending> {
        let (flag, rotation) = (self.flag, self.rotation);
        let own = self.prober.params.pattern.touch_sigma;
        self.prober
            .references
            .keep(flag, &rotation, &self.touches, own);
        let references = self.prober.references.kept.clone();
        let mut again = Vec::new();
        for reference in &references {
            match self.touch_reference(reference) {
                Ok(touched) => again.extend(touched),
                Err(ending) if ending.is_of_one() => {}
                Err(ending) => return Err(ending),
            }
        }
        self.go_on_with(&rotation)?;
        if !again.is_empty() {
            self.verified = self.touches.len();
            self.prober.references.good = Some((flag, self.verified));
        }
        self.references = again;
        Ok(())
    }

    /// Shift of a reference, the mean of several touches after a doubtful one; `None` for an unclear
    /// contact.
    fn touch_reference(
        &mut self,
        reference: &ReferenceContact,
    ) -> Result<Option<ReferenceTouch>, Ending> {
        self.go_on_with(&reference.rotation)?;
        let own = self.prober.params.pattern.touch_sigma;
        let (plans, mut touched) = (reference.plans(), None);
        let (mut plans, mut sum, mut count) = (&plans[..], 0.0, 0.0);
        for _ in 0..LOOKS {
            let Some((centre, sigma)) = self.look_at(reference, &mut plans)? else {
                continue;
            };
            let off = (centre - reference.centre).dot(&reference.planned.direction);
            (sum, count) = (sum + off, count + 1.0);
            let mean = ReferenceTouch {
                flag: reference.flag,
                index: reference.index,
                off: sum / count,
                sigma: (reference.sigma.hypot(own)).hypot(sigma.hypot(own) / f64::sqrt(count)),
            };
            touched = Some(mean);
            if mean.off.abs() <= DOUBTFUL * mean.sigma {
                return Ok(touched);
            }
        }
        match touched {
            Some(mean) if mean.off.abs() <= MOVED * mean.sigma => Ok(touched),
            Some(mean) if count > 1.0 => Err(self.displaced(reference, shifted(&mean))),
            // one contact beside unclear ones is unclear as well
            _ => Ok(None),
        }
    }

    /// Touches a reference once: centre of the ball, m in O, and uncertainty of the curve, m; `None`
    /// for an unclear contact.
    ///
    /// - `plans`: for this touch and later ones; a plan that does not meet the contact is dropped.
    ///
    /// # Errors
    /// [`ProbeError::Displaced`] after the last plan, and at once after an obstacle on a fast link.
    fn look_at(
        &mut self,
        reference: &ReferenceContact,
        plans: &mut &[TouchPlan],
    ) -> Result<Option<(Point3<f64>, f64)>, Ending> {
        while let [planned, others @ ..] = *plans {
            let how = match self.go_and_touch(planned) {
                Ok((TouchResult::At { centre, sigma }, _)) => return Ok(Some((centre, sigma))),
                Ok((TouchResult::Unclear, _)) => return Ok(None),
                Ok((TouchResult::Nothing, _)) => {
                    format!("is not met within {:.1} mm", planned.search * 1e3)
                }
                // the first path was free, another one need not be
                Err(ending) if ending.is_of_one() && !others.is_empty() => {
                    *plans = others;
                    continue;
                }
                Err(Ending::Stopped(ProbeError::Obstacle { .. })) => {
                    return Err(self.displaced(reference, "is met before its stand-off".to_owned()));
                }
                Err(ending) => return Err(ending),
            };
            if others.is_empty() {
                return Err(self.displaced(reference, how));
            }
            *plans = others;
        }
        Ok(None)
    }

    fn displaced(&self, reference: &ReferenceContact, how: String) -> Ending {
        let (flag, touches) = self
            .prober
            .references
            .good
            .unwrap_or((reference.flag, reference.index + 1));
        Ending::Stopped(ProbeError::Displaced {
            doing: DOING,
            reference: format!("touch {} of feature {}", reference.index, reference.flag),
            how,
            since: format!("touch {} of feature {flag}", touches.saturating_sub(1)),
        })
    }

    /// Goes out into free air, to go on with another orientation.
    fn go_on_with(&mut self, rotation: &UnitQuaternion<f64>) -> Result<(), Ending> {
        if self.rotation != *rotation {
            self.go_out("going up out of the feature", LineGuard::Out)?;
            // turning the wrist loads its sensor
            (self.rotation, self.is_zeroed) = (*rotation, false);
        }
        Ok(())
    }
}

/// Size and side of a shift.
fn shifted(touched: &ReferenceTouch) -> String {
    let (off_mm, most_mm) = (touched.off * 1e3, MOVED * touched.sigma * 1e3);
    let (off_mm, side) = (off_mm.abs(), if off_mm > 0.0 { "deeper" } else { "higher" });
    format!(
        "is {off_mm:.3} mm {side} along its search than it was (within ± {most_mm:.3} mm it would be the same)"
    )
}
