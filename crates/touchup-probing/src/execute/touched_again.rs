//! Repeated touches of references.

use nalgebra::UnitQuaternion;

use super::ending::{Ending, ReferenceTouch};
use super::feature_probing::{FeatureProbing, LineGuard};
use super::reference::ReferenceContact;
use crate::arm::ProbeError;
use crate::plan::TouchResult;

/// Standard deviations beyond which a contact has moved: by chance once in ten thousand.
const MOVED: f64 = 4.0;
/// Touches of a contact that seems to have moved.
const LOOKS: usize = 2;

const DOING: &str = "touching a reference again";

impl FeatureProbing<'_, '_> {
    /// Touches all references again, except unreachable ones, and ones with an unclear contact now.
    ///
    /// # Errors
    /// [`ProbeError::Displaced`] if a reference has moved; as any touch.
    pub(crate) fn touch_references(&mut self) -> Result<(), Ending> {
        let (flag, rotation) = (self.flag, self.rotation);
        self.prober.references.keep(flag, &rotation, &self.touches);
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

    /// Shift of a reference; `None` for an unclear contact.
    fn touch_reference(
        &mut self,
        reference: &ReferenceContact,
    ) -> Result<Option<ReferenceTouch>, Ending> {
        let ReferenceContact {
            flag,
            index,
            planned,
            centre,
            ..
        } = *reference;
        self.go_on_with(&reference.rotation)?;
        let (mut sum, mut count) = (0.0, 0.0);
        for _ in 0..LOOKS {
            let (result, _) = match self.go_and_touch(&planned) {
                // the path was clear at the first touch
                Err(Ending::Stopped(ProbeError::Obstacle { .. })) => {
                    return Err(self.displaced(reference, "is met before its stand-off".to_owned()));
                }
                touched => touched?,
            };
            let (at, sigma) = match result {
                TouchResult::At { centre, sigma } => (centre, sigma),
                TouchResult::Unclear => continue,
                TouchResult::Nothing => {
                    let far_mm = planned.search * 1e3;
                    let how = format!("is not met within {far_mm:.1} mm");
                    return Err(self.displaced(reference, how));
                }
            };
            (sum, count) = (sum + (at - centre).dot(&planned.direction), count + 1.0);
            let own = self.prober.params.pattern.touch_sigma;
            let touched = ReferenceTouch {
                flag,
                index,
                off: sum / count,
                sigma: (reference.sigma.hypot(own)).hypot(sigma.hypot(own) / f64::sqrt(count)),
            };
            if touched.off.abs() <= MOVED * touched.sigma {
                return Ok(Some(touched));
            }
            if count as usize == LOOKS {
                let (off_mm, most_mm) = (touched.off * 1e3, MOVED * touched.sigma * 1e3);
                let (off_mm, side) = (off_mm.abs(), if off_mm > 0.0 { "deeper" } else { "higher" });
                let how = format!(
                    "is {off_mm:.3} mm {side} along its search than it was (within ± {most_mm:.3} mm it would be the same)"
                );
                return Err(self.displaced(reference, how));
            }
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
