//! Surfaces that may explain contacts, grown from seeds.

use nalgebra::Vector3;

use super::contact::ContactCell;
use super::cost::{Costs, SurfaceRegion};
use super::guess::guesses_around;
use super::reach::ContactReach;
use super::shape::{KINDS, TouchedShape};
use crate::features::fit::SurfaceModel;
use crate::features::segmentation::facets::NONE;
use crate::features::segmentation::primitive::Primitive;

/// Cosine of the lean between neighbours of one surface: 40°.
const ALIKE: f64 = 0.77;
/// Cosine of the maximum turn to a known axis: 10°; at an edge, whose land may be round: 25°.
const HELD: f64 = 0.985;
const HELD_AT_EDGE: f64 = 0.906;
/// Cosine between different known axes, and their maximum number.
const SAME_AXIS: f64 = 0.9986;
const MOST_AXES: usize = 12;
/// Sizes of the surroundings of a seed, in radii of the ball.
const SURROUNDINGS: [f64; 3] = [2.5, 5.0, 10.0];
/// Size of the surroundings in which shapes compete, in radii of the ball.
const LOCAL: f64 = 8.0;
/// Maximum number of contacts in a first fit, and of those that compare two surfaces.
const MOST_GUESSED: usize = 80;
const MOST_COMPARED: usize = 16;
/// Minimum number of contacts of a surface.
pub(super) const LEAST_CONTACTS: usize = 8;
/// Minimum number of neighbours of a good seed.
const LEAST_NEIGHBOURS: usize = 4;
/// Growth that goes on, and maximum number of its rounds around a seed, and over the part.
const GROWTH: f64 = 1.02;
const ROUNDS: usize = 4;
const SPREADS: usize = 3;
/// Minimum share of a region that a known surface explains as well.
const AS_WELL: f64 = 0.95;

/// Proposals until now.
pub(super) struct Proposals<'a> {
    pub costs: Costs<'a>,
    pub reach: ContactReach<'a>,
    pub regions: Vec<SurfaceRegion>,
    /// whether a proposal, or its edge, explains a contact
    is_explained: Vec<bool>,
    /// axes and normals of the proposals
    pub axes: Vec<Vector3<f64>>,
}

/// A region around a seed, with contacts at its edge.
struct SeedRegion {
    region: SurfaceRegion,
    at_edge: Vec<u32>,
}

impl<'a> Proposals<'a> {
    pub(super) fn over(
        costs: Costs<'a>,
        regions: Vec<SurfaceRegion>,
        axes: Vec<Vector3<f64>>,
    ) -> Self {
        let mut is_explained = vec![false; costs.contacts.all.len()];
        let known = regions.iter().flat_map(|region| &region.contacts);
        known.for_each(|&at| is_explained[at as usize] = true);
        Self {
            reach: ContactReach::over(costs.contacts),
            costs,
            regions,
            is_explained,
            axes,
        }
    }

    /// Adds the surfaces around all seeds that none of the known ones explains.
    pub(super) fn grow(&mut self, is_seed: impl Fn(&ContactCell) -> bool) {
        let contacts = self.costs.contacts;
        let mut is_tried = vec![false; contacts.all.len()];
        for seed in self.seeds() {
            let own = &contacts.all[seed as usize];
            if self.is_explained[seed as usize] || is_tried[seed as usize] || !is_seed(own) {
                continue;
            }
            is_tried[seed as usize] = true;
            for &other in &contacts.beside[seed as usize] {
                let apart = contacts.all[other as usize].point - own.point;
                is_tried[other as usize] |= apart.norm() < contacts.radius;
            }
            let mut found = self.around(seed);
            let Some(best) = found.pop() else {
                continue;
            };
            let edge = best.at_edge.iter();
            edge.for_each(|&at| self.is_explained[at as usize] = true);
            let best = self.spread(best.region);
            let own = best.contacts.iter();
            own.for_each(|&at| self.is_explained[at as usize] = true);
            match &best.shape.primitive {
                Primitive::Plane(plane) => self.add_axis(plane.normal()),
                Primitive::Cylinder(cylinder) => self.add_axis(cylinder.axis()),
                Primitive::Cone(_) | Primitive::Sphere(_) => {}
            }
            self.regions.push(best);
            for other in found {
                let other = self.spread(other.region);
                self.regions.push(other);
            }
        }
    }

    fn add_axis(&mut self, axis: Vector3<f64>) {
        let is_new = |other: &Vector3<f64>| other.dot(&axis).abs() < SAME_AXIS;
        if self.axes.len() < MOST_AXES && self.axes.iter().all(is_new) {
            self.axes.push(axis);
        }
    }

    /// Contacts, the flattest surroundings first.
    fn seeds(&self) -> Vec<u32> {
        let contacts = self.costs.contacts;
        let turned = |at: usize| {
            let (own, near) = (&contacts.all[at].normal, &contacts.beside[at]);
            let turn = |&other: &u32| 1.0 - own.dot(&contacts.all[other as usize].normal);
            if near.len() < LEAST_NEIGHBOURS {
                2.0
            } else {
                near.iter().map(turn).sum::<f64>() / near.len() as f64
            }
        };
        let mut seeds: Vec<(f64, u32)> = (0..contacts.all.len())
            .map(|at| (turned(at), at as u32))
            .collect();
        seeds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        seeds.into_iter().map(|(_, at)| at).collect()
    }

    /// Unexplained contacts connected with a seed within a distance, m; around an edge those of
    /// edges.
    fn surroundings(&mut self, seed: u32, reach: f64) -> Vec<u32> {
        let contacts = self.costs.contacts;
        let from = &contacts.all[seed as usize];
        let is_explained = &self.is_explained;
        self.reach.from(vec![seed], |before, at| {
            let (one, other) = (&contacts.all[before as usize], &contacts.all[at as usize]);
            !is_explained[at as usize]
                && (from.land.is_none() || other.land.is_some())
                && (other.point - from.point).norm() < reach
                && one.normal.dot(&other.normal) > ALIKE
        })
    }

    /// The best region of each kind of shape around a seed, the best one last.
    fn around(&mut self, seed: u32) -> Vec<SeedRegion> {
        let radius = self.costs.contacts.radius;
        let mut best: [Option<SeedRegion>; KINDS] = Default::default();
        let mut before = 0;
        for size in SURROUNDINGS {
            let around = self.surroundings(seed, size * radius);
            if around.len() < LEAST_CONTACTS || around.len() == before {
                continue;
            }
            before = around.len();
            for shape in self.shapes(seed, &around) {
                let Some(grown) = self.grown(shape, seed, &around) else {
                    continue;
                };
                let best = &mut best[shape.kind()];
                let gain = best.as_ref().map_or(0.0, |best| best.region.gain);
                if grown.region.gain > gain && !self.is_known(&grown.region) {
                    *best = Some(grown);
                }
            }
        }
        let mut found: Vec<SeedRegion> = best.into_iter().flatten().collect();
        found.sort_by(|a, b| a.region.gain.total_cmp(&b.region.gain));
        found
    }

    /// The best shape of each kind for contacts around a seed.
    fn shapes(&self, seed: u32, around: &[u32]) -> Vec<TouchedShape> {
        let costs = &self.costs;
        let seed = &costs.contacts.all[seed as usize];
        let near = costs.some(around, MOST_GUESSED);
        let step = around.len().div_ceil(MOST_GUESSED);
        let mut best: [Option<(f64, TouchedShape)>; KINDS] = [None; KINDS];
        let tried = |guess: &Primitive| {
            if seed.land.is_some() {
                let own = TouchedShape {
                    primitive: *guess,
                    is_held: true,
                };
                let held = TouchedShape::held(guess, &self.axes, HELD_AT_EDGE);
                return held.into_iter().chain([own]).collect::<Vec<_>>();
            }
            let held = TouchedShape::held(guess, &self.axes, HELD);
            [TouchedShape::free(*guess)]
                .into_iter()
                .chain(held)
                .collect()
        };
        let guesses = guesses_around(seed, &near, &self.axes);
        for shape in guesses.iter().flat_map(tried) {
            let Some(shape) = shape.fitted(&near, costs.near) else {
                continue;
            };
            let sampled = around.iter().step_by(step);
            let explained = sampled.map(|&at| costs.explained(&shape.primitive, at));
            let gain = explained.sum::<f64>() * step as f64 - Costs::price(&shape, around.len());
            let best = &mut best[shape.kind()];
            if best.is_none_or(|(best, _)| gain > best) {
                *best = Some((gain, shape));
            }
        }
        best.into_iter().flatten().map(|(_, shape)| shape).collect()
    }

    /// The region of a surface around a seed from some contacts on.
    fn grown(&mut self, mut shape: TouchedShape, seed: u32, around: &[u32]) -> Option<SeedRegion> {
        let costs = self.costs;
        let contacts = costs.contacts;
        let (from, local) = (contacts.all[seed as usize].point, LOCAL * contacts.radius);
        let mut region = around.to_vec();
        let mut at_edge = Vec::new();
        for _ in 0..ROUNDS {
            let primitive = &shape.primitive;
            region.retain(|&at| costs.misfit(primitive, at).is_some());
            if region.len() < LEAST_CONTACTS {
                return None;
            }
            let before = region.len();
            let is_on = |at: u32| {
                if (contacts.all[at as usize].point - from).norm() > local {
                    return None;
                }
                let is_on = costs.misfit(primitive, at).is_some();
                (is_on || costs.misfit_at_edge(primitive, at).is_some()).then_some(is_on)
            };
            let all = self.reach.with_value(&region, is_on);
            let (on, edge): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, is_on)| *is_on);
            region = on.into_iter().map(|(at, _)| at).collect();
            at_edge = edge.into_iter().map(|(at, _)| at).collect();
            shape = costs.refitted(&shape, &region)?;
            if region.len() as f64 <= GROWTH * before as f64 {
                break;
            }
        }
        let primitive = &shape.primitive;
        region.retain(|&at| costs.misfit(primitive, at).is_some());
        at_edge.retain(|&at| costs.misfit_at_edge(primitive, at).is_some());
        let edge = at_edge.iter();
        let edge = edge.filter_map(|&at| costs.misfit_at_edge(primitive, at));
        let edge = edge.map(Costs::score).sum::<f64>();
        let mut region = costs.region(shape, region);
        region.gain += edge;
        Some(SeedRegion { region, at_edge })
    }

    /// Whether a known surface with no more freedoms explains the contacts of a region as well.
    fn is_known(&self, region: &SurfaceRegion) -> bool {
        let step = region.contacts.len().div_ceil(MOST_COMPARED).max(1);
        let explained = |primitive: &Primitive| {
            let some = region.contacts.iter().step_by(step);
            some.map(|&at| self.costs.explained(primitive, at))
                .sum::<f64>()
        };
        let least = AS_WELL * explained(&region.shape.primitive);
        let freedoms = region.shape.freedoms();
        self.regions.iter().any(|known| {
            known.shape.freedoms() <= freedoms && explained(&known.shape.primitive) >= least
        })
    }

    /// The region with all contacts of its surface that are connected with it.
    fn spread(&mut self, region: SurfaceRegion) -> SurfaceRegion {
        let costs = self.costs;
        let SurfaceRegion {
            mut shape,
            mut contacts,
            ..
        } = region;
        for _ in 0..SPREADS {
            let all = self.reach.support(&costs, &shape.primitive, &contacts);
            let mut all: Vec<u32> = all.into_iter().map(|(at, _)| at).collect();
            all.retain(|&at| costs.misfit(&shape.primitive, at).is_some());
            let refitted = if all.len() < LEAST_CONTACTS {
                None
            } else {
                costs.refitted(&shape, &all)
            };
            let Some(refitted) = refitted else {
                break;
            };
            let is_settled = all.len() as f64 <= GROWTH * contacts.len() as f64;
            (shape, contacts) = (refitted, all);
            if is_settled {
                break;
            }
        }
        costs.region(shape, contacts)
    }
}

/// Labels of contacts by the numbers of their regions; [`NONE`]: of none.
pub(super) fn labels(count: usize, regions: &[SurfaceRegion]) -> Vec<u32> {
    let mut of = vec![NONE; count];
    for (number, region) in (0..).zip(regions) {
        region
            .contacts
            .iter()
            .for_each(|&at| of[at as usize] = number);
    }
    of
}
