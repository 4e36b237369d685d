//! An edge from one flag: its side with the ground, then both faces beside it, in turn across the
//! edge.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::hole::numbers;
use crate::plan::error::ExploreError;
use crate::plan::measuring::{CandidateTouch, Measuring, SurfaceRequest};
use crate::plan::pattern::{PatternStep, TouchPattern};
use crate::plan::search::ROUGH;
use crate::plan::search_context::{PatternParams, RING, SearchContext, TouchPlan, TouchResult};
use crate::plan::slide::{RimStation, Slide};
use touchup_features::features::Feature;
use touchup_features::features::fit::{Fit, FitParams, Freedom, Observation, Plane};
use touchup_geometry::numeric::mean;
use touchup_method::reconstruct::KnownSurface;

/// Depth below the top that is beyond the edge, over the ball's radius.
const BEYOND: f64 = 0.8;
/// Places on the high side, back from the flag and along the edge, over the radius of the ring.
const MORE: [[f64; 2]; 4] = [[0.5, -0.9], [0.5, 0.9], [1.3, -0.6], [1.3, 0.6]];
/// Distances back from the flag that replace a place beside the part; along the edge equal steps to
/// both sides.
const ELSEWHERE: [f64; 4] = [0.5, 0.8, 1.1, 1.4];
/// Share of the farthest low touch beyond which a touch is of the ground.
const CLEAR: f64 = 0.7;
/// Distance of a touch of the ground farther out, over the ball's radius, if the low touches are
/// high enough to be on the rim.
const FARTHER: f64 = 2.0;
/// Depth of the search for the ground, over the ball's radius.
const GROUND: f64 = 4.0;
/// Distance of the ball above the ground, m.
const OFF_GROUND: f64 = 0.3e-3;
/// First touches of the side, for the direction of the edge.
const FIRST: usize = 3;
/// Maximum number of tries for these.
const MOST_FIRST: usize = 6;
/// Their distance along the edge, over the radius around the flag.
const SPREAD: f64 = 1.0;
/// Shares of this distance, tried in turn if the edge ends before it.
const NEARER: [f64; 4] = [1.0, 0.75, 0.5, 0.25];
/// Reach of touches along the edge to either side, over the same radius.
const REACH: f64 = 2.0;
/// Candidate places along the edge.
const ALONG: usize = 9;
/// Least and largest distance of touches of the top from the edge, over the ball's radius.
const TOP: [f64; 2] = [0.7, 4.0];
/// Reach of slides over the top, over the ball's radius.
const BACK: f64 = 3.0;
/// Lean above which a face is another surface, rad.
const LEAN: f64 = 0.1;
/// Minimum number of touches for a credible face.
const LEAST: usize = 4;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum EdgePhase {
    /// sorting of places around the flag into high and low
    #[default]
    Ring,
    Top,
    /// an equal surface all around
    NoEdge,
    /// beyond the low places, which may have been on the rim
    Ground,
    Side,
    Both,
}

#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct EdgePattern {
    phase: EdgePhase,
    tried: usize,
    /// places tried from above, in F
    seen: Vec<(Point3<f64>, Option<Observation>)>,
    top: Measuring,
    side: Measuring,
    /// out over the edge, in F
    over: Vector3<f64>,
    /// height of the ground beyond, in F
    ground_z: f64,
    is_top_next: bool,
}

impl EdgePattern {
    pub(crate) fn new() -> Self {
        Self {
            over: Vector3::x(),
            ground_z: f64::NEG_INFINITY,
            is_top_next: true,
            ..Self::default()
        }
    }

    fn along(&self) -> Vector3<f64> {
        Vector3::z().cross(&self.over)
    }

    fn ring(params: &PatternParams) -> f64 {
        params.flag_radius + params.ball_radius
    }

    /// Records a touch from above, also a miss.
    fn record(&mut self, context: &SearchContext, touch: &PatternStep) {
        // end of the search
        let lowest = || context.in_f(&touch.planned.end());
        if touch.result != TouchResult::Unclear {
            self.seen
                .push((touch.place.unwrap_or_else(lowest), touch.observation));
        }
        self.tried += 1;
    }

    /// Parts the touches into high and low, and finds the direction over the edge; returns whether
    /// there are both.
    fn part(&mut self, context: &mut SearchContext) -> bool {
        let ring = || self.seen.iter().take(RING + 1).map(|(place, _)| place);
        context.height = ring()
            .map(|p| context.below(p))
            .fold(f64::NEG_INFINITY, f64::max);
        let is_low = |p: &&Point3<f64>| {
            context.height - context.below(p) > BEYOND * context.params.ball_radius
        };
        let (low, high): (Vec<_>, Vec<_>) = ring().partition(is_low);
        let middle = |places: &[&Point3<f64>]| {
            mean(
                places
                    .iter()
                    .map(|place| Vector3::new(place.x, place.y, 0.0)),
            )
        };
        let over = (middle(&low) - middle(&high))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::x);
        // nearer to the edge the ball may hang on it
        let far = |p: &Point3<f64>| p.coords.dot(&over);
        let farthest = low.iter().map(|place| far(place)).fold(0.0, f64::max);
        let ground = low
            .iter()
            .filter(|place| far(place) > CLEAR * farthest)
            .map(|place| context.below(place));
        let (ground_z, has_both) = (
            ground.fold(f64::NEG_INFINITY, f64::max),
            !low.is_empty() && !high.is_empty(),
        );
        (self.over, self.ground_z) = (over, ground_z);
        has_both
    }

    fn take_ring(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.record(context, touch);
        if self.tried > RING {
            self.tried = 0;
            self.phase = if self.part(context) {
                EdgePhase::Top
            } else {
                EdgePhase::NoEdge
            };
        }
    }

    /// Takes more on the high side: too few of the ring may lie on it to determine its normal.
    fn take_top(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        self.record(context, touch);
        if self.tried < MORE.len() {
            return;
        }
        self.tried = 0;
        let before = context.pose_of;
        let mut top: Vec<Observation> = self
            .seen
            .iter()
            .filter_map(|(_, observation)| *observation)
            .collect();
        if context.level(&mut top, false, &mut []) {
            self.seen
                .iter_mut()
                .for_each(|(place, _)| *place = context.in_f(&(before * *place)));
        }
        let has_both = self.part(context);
        context.height = top
            .iter()
            .map(|o| context.below(&context.in_f(&o.point)))
            .sum::<f64>()
            / top.len().max(1) as f64;
        self.top.observations = top;
        self.phase = match (has_both, self.depths(context)) {
            (false, _) => EdgePhase::NoEdge,
            (true, Ok(_)) => EdgePhase::Side,
            (true, Err(_)) => EdgePhase::Ground,
        };
    }

    /// A ball on the rim is less than its radius beyond the edge; farther out by more is the
    /// ground.
    fn take_ground(&mut self, context: &SearchContext, touch: &PatternStep) {
        if touch.result != TouchResult::Unclear {
            self.ground_z = context.below(
                &touch
                    .place
                    .unwrap_or_else(|| context.in_f(&touch.planned.end())),
            );
        }
        self.phase = EdgePhase::Side;
    }

    /// Depths of touches of the side below the top, m: highest and deepest.
    fn depths(&self, context: &SearchContext) -> Result<[f64; 2], ExploreError> {
        context.above_ground("edge", self.ground_z, OFF_GROUND)
    }

    /// Side through its contacts: z out of the material, x along the edge.
    fn side_plane(&self, context: &SearchContext) -> Plane {
        let points: Vec<_> = self
            .side
            .observations
            .iter()
            .map(|o| context.in_f(&o.point))
            .collect();
        let mean = mean(points.iter().map(|p| p.coords));
        // a least-squares line along the edge: metres over it per metre along it
        let (mut sxx, mut sxy) = (0.0, 0.0);
        for p in &points {
            let d = p.coords - mean;
            let (x, y) = (d.dot(&self.along()), d.dot(&self.over));
            (sxx, sxy) = (sxx + x * x, sxy + x * y);
        }
        let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
        let out = (self.over - self.along() * slope).normalize();
        let x = out.cross(&Vector3::z());
        let origin = mean - out * context.params.ball_radius;
        let origin = Vector3::new(origin.x, origin.y, context.height);
        plane(context, origin, [x, out.cross(&x), out])
    }

    fn top_plane(&self, context: &SearchContext) -> Plane {
        // x is over the edge, so that its leans are along and across the edge
        let at = context.in_f(&self.side_plane(context).point());
        plane(context, at.coords, [self.over, self.along(), Vector3::z()])
    }

    /// Top and side.
    fn fitted(&self, context: &SearchContext) -> Result<[Fit<Plane>; 2], ExploreError> {
        if self.phase != EdgePhase::Both {
            return Err(ExploreError::NotDone {
                touches: context.touches,
            });
        }
        let params = FitParams::default();
        let top = self.top.fitted(&self.top_plane(context), &params)?;
        let side = self.side.fitted(&self.side_plane(context), &params)?;
        Ok([top, side])
    }

    /// Request for the top, with y along the edge, or for the side, with x along it.
    fn wanted(params: &PatternParams, lean: Freedom) -> SurfaceRequest {
        // within the reach of its touches
        SurfaceRequest::of_plane(params, &[lean], REACH * params.flag_radius, LEAN, 0)
    }

    fn places(params: &PatternParams) -> impl Iterator<Item = f64> + '_ {
        (0..ALONG)
            .map(|at| (at as f64 / (ALONG - 1) as f64 * 2.0 - 1.0) * REACH * params.flag_radius)
    }

    fn possible_top(&self, context: &SearchContext, top: &Plane) -> Vec<CandidateTouch> {
        let PatternParams {
            ball_radius,
            clearance,
            ..
        } = context.params;
        let at = |along: f64, back: f64| {
            let point = top.pose_of * Point3::new(-back * ball_radius, along, 0.0);
            let planned = context.down(&context.in_f(&point), clearance + ball_radius + ROUGH);
            CandidateTouch {
                point,
                travel: clearance,
                planned,
            }
        };
        context.on_part(
            Self::places(&context.params).flat_map(|along| TOP.map(|back| at(along, back))),
        )
    }

    fn possible_side(
        &self,
        context: &SearchContext,
        side: &Plane,
        deep: f64,
    ) -> Vec<CandidateTouch> {
        let PatternParams {
            ball_radius,
            clearance,
            ..
        } = context.params;
        let at = |along: f64, depth: f64| {
            let point = side.pose_of * Point3::new(along, 0.0, 0.0) - context.out() * depth;
            let from = context.in_f(&(point + side.normal() * (ball_radius + clearance)));
            let direction = context.pose_of.inverse_transform_vector(&-side.normal());
            CandidateTouch {
                point,
                travel: clearance,
                planned: context.sideways(&from, depth, &direction, 2.0 * clearance),
            }
        };
        context.on_part(
            Self::places(&context.params)
                .flat_map(|along| [0.5 * deep, deep].map(|depth| at(along, depth))),
        )
    }

    /// Next touch of the top or of the side, by the larger gain.
    fn next_of_both(&mut self, context: &SearchContext, deep: f64) -> Option<TouchPlan> {
        let (top, side) = (self.top_plane(context), self.side_plane(context));
        let [of_top, of_side] =
            [Freedom::TiltY, Freedom::TiltX].map(|lean| Self::wanted(&context.params, lean));
        let of_top = self
            .top
            .best(&top, &of_top, self.possible_top(context, &top));
        let of_side = self
            .side
            .best(&side, &of_side, self.possible_side(context, &side, deep));
        let gain =
            |best: &Option<(CandidateTouch, f64)>| best.as_ref().map_or(0.0, |(_, gain)| *gain);
        self.is_top_next = gain(&of_top) >= gain(&of_side);
        let (chosen, measuring) = if self.is_top_next {
            (of_top, &mut self.top)
        } else {
            (of_side, &mut self.side)
        };
        chosen.map(|(possible, _)| measuring.aim(&possible))
    }
}

impl TouchPattern for EdgePattern {
    fn next(&mut self, context: &mut SearchContext) -> Result<Option<TouchPlan>, ExploreError> {
        let PatternParams {
            ball_radius: ball,
            clearance,
            flag_radius,
            ..
        } = context.params;
        let (ring, from_above) = (
            Self::ring(&context.params),
            clearance + GROUND * ball + ROUGH,
        );
        Ok(Some(match self.phase {
            EdgePhase::NoEdge => {
                return Err(ExploreError::NoEdge {
                    radius_mm: ring * 1e3,
                });
            }
            EdgePhase::Ring => context.ring(self.tried, ring, from_above),
            EdgePhase::Ground => context.down(
                &Point3::from(self.over * (ring + FARTHER * ball)),
                from_above,
            ),
            EdgePhase::Top => {
                let place = |[back, along]: [f64; 2]| {
                    Point3::from((self.along() * along - self.over * back) * ring)
                };
                let others =
                    ELSEWHERE.map(|back| ELSEWHERE.map(|along| place([back, 1.2 * along - 0.9])));
                let place = context.over_part(self.tried, &MORE.map(place), others.as_flattened());
                context.down(&place, from_above)
            }
            EdgePhase::Side if self.tried >= MOST_FIRST => {
                let (walls, reach_mm) = (self.side.observations.len(), 2e3 * (ring + ball));
                return Err(ExploreError::NoWall {
                    kind: "edge",
                    walls,
                    asked: self.tried,
                    reach_mm,
                });
            }
            EdgePhase::Side => {
                // inward from beyond the edge
                let (along, beyond) = (
                    [0.0, SPREAD, -SPREAD][self.tried % FIRST] * flag_radius,
                    ring + ball,
                );
                // nearer to the flag if the edge ends before
                let high = |along: f64| Point3::from(self.along() * along - self.over * ring);
                let along = NEARER
                    .map(|share| share * along)
                    .into_iter()
                    .find(|along| context.is_over_part(&high(*along)));
                let from = Point3::from(self.over * beyond + self.along() * along.unwrap_or(0.0));
                context.sideways(&from, self.depths(context)?[1], &-self.over, 2.0 * beyond)
            }
            EdgePhase::Both => return Ok(self.next_of_both(context, self.depths(context)?[1])),
        }))
    }

    fn take(&mut self, context: &mut SearchContext, touch: &PatternStep) {
        match self.phase {
            EdgePhase::Ring | EdgePhase::NoEdge => self.take_ring(context, touch),
            EdgePhase::Top => self.take_top(context, touch),
            EdgePhase::Ground => self.take_ground(context, touch),
            EdgePhase::Side => {
                self.side.take(touch);
                self.tried += 1;
                if self.tried >= FIRST && self.side.observations.len() >= 2 {
                    self.over = context
                        .pose_of
                        .inverse_transform_vector(&self.side_plane(context).normal());
                    self.phase = EdgePhase::Both;
                }
            }
            EdgePhase::Both if self.is_top_next => {
                self.top.take(touch);
                let is_far = |p: Point3<f64>| {
                    (context.below(&p) - context.height).abs() > context.params.ball_radius
                };
                if touch.place.is_some_and(is_far) {
                    self.top.refuse_last(touch);
                }
            }
            EdgePhase::Both => self.side.take(touch),
        }
    }

    fn feature(&self, context: &SearchContext) -> Result<Option<Feature>, ExploreError> {
        let [top, side] = self.fitted(context)?;
        let along = |o: &Observation| context.in_f(&o.point).coords.dot(&self.along());
        let all = || {
            self.top
                .observations
                .iter()
                .chain(&self.side.observations)
                .map(along)
        };
        let ends = [
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        ];
        let start = context.in_f(&side.surface.point());
        let at = |along: f64| {
            context.pose_of * (start + self.along() * (along - start.coords.dot(&self.along())))
        };
        let touches = numbers([&self.top.observations, &self.side.observations]);
        Ok(Feature::edge([&top, &side], &ends.map(at), true, touches))
    }

    fn known_surfaces(&self, context: &SearchContext) -> Result<Vec<KnownSurface>, ExploreError> {
        let [top, side] = self.fitted(context)?;
        Ok(context.surfaces_of_edge([
            (&top, &self.top.observations),
            (&side, &self.side.observations),
        ]))
    }

    fn uncertainty(&self, context: &SearchContext) -> Option<f64> {
        if self.phase != EdgePhase::Both {
            return None;
        }
        let known = |measuring: &Measuring, plane: &Plane, lean: Freedom| {
            measuring.uncertainty(plane, &Self::wanted(&context.params, lean))
        };
        let of_top = known(&self.top, &self.top_plane(context), Freedom::TiltY)?;
        Some(of_top.max(known(
            &self.side,
            &self.side_plane(context),
            Freedom::TiltX,
        )?))
    }

    fn is_known(&self, context: &SearchContext) -> bool {
        self.is_fixed(context)
            && self
                .uncertainty(context)
                .is_some_and(|sigma| sigma <= context.params.sigma)
    }

    fn is_fixed(&self, context: &SearchContext) -> bool {
        let is_enough =
            self.top.observations.len() >= LEAST && self.side.observations.len() >= LEAST;
        is_enough && self.uncertainty(context).is_some()
    }

    fn slides(&self, context: &SearchContext) -> Vec<Slide> {
        let Ok(depths) = self.depths(context) else {
            return Vec::new();
        };
        let PatternParams {
            ball_radius,
            clearance,
            flag_radius,
            ..
        } = context.params;
        let to_f = context.pose_of.inverse() * self.side_plane(context).pose_of;
        let reach = REACH * flag_radius;
        let at = |share: f64| {
            (
                to_f * Point3::new(reach * (2.0 * share - 1.0), 0.0, 0.0),
                to_f.rotation * Vector3::z(),
            )
        };
        let (length, back) = (2.0 * reach, BACK * ball_radius);
        RimStation {
            at: &at,
            length,
            is_closed: false,
            back,
            depths,
            room: clearance,
        }
        .slides(context)
    }
}

/// Plane at a place of F with these axes.
fn plane(context: &SearchContext, origin: Vector3<f64>, axes: [Vector3<f64>; 3]) -> Plane {
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
    let in_f = Isometry3::from_parts(origin.into(), UnitQuaternion::from_rotation_matrix(&turn));
    Plane {
        pose_of: context.pose_of * in_f,
    }
}
