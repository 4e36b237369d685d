//! Contacts that are touched again: whether tip, part and arm are still where they were.
//!
//! Touches agree with each other wherever they are off together, so a bent tip, a part that slipped
//! and an arm that drifted show in none of them alone. A contact says where the part is along its
//! search; so the earliest contacts of up to three independent directions are kept, over all
//! features that are probed one after the other, and touched again after each feature and after
//! each collision.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::ending::{Ending, ProbedTouch};
use super::feature_probing::{FeatureProbing, LineGuard};
use crate::probing::arm::{OnsetVerdict, ProbeError, TouchOutcome};
use crate::probing::plan::{TouchPlan, TouchResult};

/// The contacts that are touched again, and when the last of them was where it had been.
#[derive(Clone, Debug, Default)]
pub struct References {
    kept: Vec<Reference>,
    /// number of the feature, and its touches until then
    good: Option<(u32, usize)>,
}

/// A contact that is touched again.
#[derive(Clone, Debug)]
struct Reference {
    /// number of the feature, and of the touch in it from 0 on
    flag: u32,
    index: usize,
    /// in O
    planned: TouchPlan,
    /// of the tip in B
    rotation: UnitQuaternion<f64>,
    /// of the ball, m in O
    centre: Point3<f64>,
    /// of its curve, m
    sigma: f64,
    /// the part of its direction that those before it do not have, unit vector in O
    axis: Vector3<f64>,
}

/// A contact that was touched again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceTouch {
    /// number of the feature that it was touched for first
    pub flag: u32,
    /// which touch of that feature, from 0 on
    pub index: usize,
    /// how much farther along its search it is than it was, m
    pub off: f64,
    /// standard uncertainty of that, m
    pub sigma: f64,
}

/// A contact is kept where this share of its direction is none of those that are kept.
const INDEPENDENT: f64 = 0.5;
/// The part pushes back along the search within 18° (cosine): on a slope the ball may slip.
const SQUARE: f64 = 0.95;
/// Beyond so many standard deviations a contact has moved: once in ten thousand it has not.
const MOVED: f64 = 4.0;
/// A contact that seems to have moved is touched once more.
const LOOKS: usize = 2;

const DOING: &str = "touching a reference again";

impl References {
    /// Keeps the contacts of a feature whose direction is new.
    ///
    /// - `rotation`: that it is touched with, of the tip in B.
    fn keep(&mut self, flag: u32, rotation: &UnitQuaternion<f64>, touches: &[ProbedTouch]) {
        for (index, touch) in touches.iter().enumerate() {
            let Some((centre, sigma)) = square_contact(touch) else {
                continue;
            };
            let direction = touch.planned.direction.into_inner();
            // after Gram and Schmidt, so that there are three at most
            let new = self
                .kept
                .iter()
                .fold(direction, |new, one| new - one.axis * new.dot(&one.axis));
            if new.norm() > INDEPENDENT {
                self.kept.push(Reference {
                    flag,
                    index,
                    planned: touch.planned,
                    rotation: *rotation,
                    centre,
                    sigma,
                    axis: new.normalize(),
                });
            }
        }
    }
}

/// The ball's centre at a contact that repeats, m in O, and the uncertainty of its curve, m.
fn square_contact(touch: &ProbedTouch) -> Option<(Point3<f64>, f64)> {
    let record = touch.record.as_ref()?;
    let TouchOutcome::Contact { onset, force_b, .. } = &record.outcome else {
        return None;
    };
    let is_square = -force_b.dot(&record.target.direction) > SQUARE * force_b.norm();
    (is_square && onset.verdict == OnsetVerdict::Clean)
        .then_some(onset.sigma)
        .and_then(|sigma| Some((touch.centre?, sigma)))
}

impl FeatureProbing<'_, '_> {
    /// Touches all references again. One that cannot be reached any more is left out, as is one
    /// whose contact is unclear now.
    ///
    /// # Errors
    /// [`ProbeError::Displaced`] where one is not where it was; as any touch.
    pub fn touch_references(&mut self) -> Result<(), Ending> {
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

    /// How far it is from where it was; `None` where its contact is unclear.
    fn touch_reference(&mut self, reference: &Reference) -> Result<Option<ReferenceTouch>, Ending> {
        let Reference {
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
                // the path was clear when it was touched first
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

    fn displaced(&self, reference: &Reference, how: String) -> Ending {
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

    /// Out into free air, from where it goes on with another orientation.
    fn go_on_with(&mut self, rotation: &UnitQuaternion<f64>) -> Result<(), Ending> {
        if self.rotation != *rotation {
            self.go_out("going up out of the feature", LineGuard::Out)?;
            // turning the wrist loads its sensor
            (self.rotation, self.is_zeroed) = (*rotation, false);
        }
        Ok(())
    }
}
