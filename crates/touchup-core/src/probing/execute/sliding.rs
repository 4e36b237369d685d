//! After the touches: the ball slides over all of what they found, for the mesh.

use nalgebra::Unit;

use super::ending::{Ending, ProbedSlide};
use super::feature_probing::FeatureProbing;
use super::links::Clearance;
use super::prober::Prober;
use super::route::may_slide;
use super::world::{Phase, distance};
use crate::probing::arm::SlideTarget;
use crate::probing::plan::{Slide, Station};

impl Prober<'_> {
    /// Slides along each path in turn, as long as there is time. What cannot be slid over is recorded with its reason.
    pub(super) fn slide_over(&mut self, slides: Vec<Slide>, probing: &mut FeatureProbing) -> Result<(), Ending> {
        for slide in slides {
            let held_back = |why: String| ProbedSlide { slide: slide.clone(), record: None, refused: Some(why) };
            if probing.seconds() > self.params.limits.time {
                probing.slides.push(held_back("the time is spent".to_owned()));
                continue;
            }
            let slid = self.slide(&slide, probing);
            probing.slides.push(match slid {
                Ok(probed) => probed,
                Err(ending) if ending.is_of_one() => held_back(ending.why()),
                Err(ending) => return Err(ending),
            });
        }
        Ok(())
    }

    fn slide(&mut self, slide: &Slide, probing: &mut FeatureProbing) -> Result<ProbedSlide, Ending> {
        may_slide(self.cell, &self.params.limits, &probing.rotation, slide, &probing.out.joints)?;
        self.reach(&slide.above(0), probing, &mut true)?;
        let in_b = |station: &Station| Station {
            centre: self.cell.pose_bo * station.centre,
            normal: Unit::new_normalize(self.cell.pose_bo.rotation * station.normal.into_inner()),
        };
        let target = SlideTarget {
            rotation: probing.rotation,
            stations: slide.stations.iter().map(in_b).collect(),
            lift: slide.lift,
            give: self.params.pattern.ball_radius,
        };
        self.world.enter(Phase::Slide);
        let mut reached = None;
        let touch = &self.params.touch;
        let mut watched = self.watched();
        let slid = watched.slide(&target, touch, &mut reached);
        probing.keep(&watched);
        if let Some(station) = reached {
            self.leave_from(slide, station, probing);
        }
        Ok(ProbedSlide { slide: slide.clone(), record: Some(slid?), refused: None })
    }

    /// The retraction is straight up from where the slide ended.
    fn leave_from(&self, slide: &Slide, station: usize, probing: &mut FeatureProbing) {
        let above = slide.above(station);
        probing.is_inside(slide.lifted(station), above);
        let clear = distance(&*self.world);
        // where nothing says that it is clear there, it goes back to where it came from
        let shaft = self.cell.shaft(&probing.rotation);
        let clearance = Clearance { tool: &self.cell.tool, shaft, distance: &clear };
        let Ok(place) = clearance.entry(&above) else { return };
        if let Ok(joints) = self.cell.check(&self.params.limits, &probing.rotation, &place, &probing.out.joints) {
            (probing.out.place, probing.out.joints) = (place, joints);
        }
    }
}
