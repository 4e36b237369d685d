//! Slides of the ball after the touches, over the whole feature, for the mesh.

use nalgebra::Unit;

use super::ending::{Ending, ProbedSlide};
use super::feature_probing::FeatureProbing;
use super::links::Clearance;
use super::prober::Prober;
use super::world::{Phase, distance};
use crate::arm::SlideTarget;
use crate::plan::{Slide, Station};

impl FeatureProbing<'_, '_> {
    /// Slides along each path in turn, within the time limit. An impossible slide leaves a record
    /// with its reason.
    pub(crate) fn slide_over(&mut self, slides: Vec<Slide>) -> Result<(), Ending> {
        for slide in slides {
            let held_back = |why: String| ProbedSlide {
                slide: slide.clone(),
                record: None,
                refused: Some(why),
            };
            let slid = if self.is_spent() {
                Ok(held_back("the time is spent".to_owned()))
            } else {
                self.slide(&slide)
            };
            self.slides.push(match slid {
                Ok(probed) => probed,
                Err(ending) if ending.is_of_one() => held_back(ending.why()),
                Err(ending) => return Err(ending),
            });
        }
        Ok(())
    }

    fn slide(&mut self, slide: &Slide) -> Result<ProbedSlide, Ending> {
        let Prober { cell, params, .. } = *self.prober;
        self.prober
            .space()
            .may_slide(&self.rotation, slide, &self.out.joints)?;
        // zeroed by the touches before
        self.is_zeroed = true;
        self.reach(&slide.above(0))?;
        let in_b = |station: &Station| Station {
            centre: cell.pose_bo * station.centre,
            normal: Unit::new_normalize(cell.pose_bo.rotation * station.normal.into_inner()),
        };
        let target = SlideTarget {
            rotation: self.rotation,
            stations: slide.stations.iter().map(in_b).collect(),
            lift: slide.lift,
            give: params.pattern.ball_radius,
        };
        self.prober.world.enter(Phase::Slide);
        let mut watched = self.prober.watched();
        let slid = watched.slide(&target, &params.touch);
        let (seen, reached) = (watched.seen(), watched.reached);
        self.keep(seen);
        if let Some(station) = reached {
            self.leave_from(slide, station);
        }
        Ok(ProbedSlide {
            slide: slide.clone(),
            record: Some(slid?),
            refused: None,
        })
    }

    /// The retraction is straight up from the end of the slide.
    fn leave_from(&mut self, slide: &Slide, station: usize) {
        let above = slide.above(station);
        (self.from, self.entry) = (Some(slide.lifted(station)), Some(above));
        let space = self.prober.space();
        // without a clear place there, it goes back to its last place in free air
        let (tool, shaft) = (&space.cell.tool, space.cell.shaft(&self.rotation));
        let Ok(place) = Clearance {
            tool,
            shaft,
            distance: &distance(space.world),
        }
        .entry(&above) else {
            return;
        };
        if let Ok(joints) = space.check(&self.rotation, &place, &self.out.joints) {
            (self.out.place, self.out.joints) = (place, joints);
        }
    }
}
