//! One surface for each contact: surfaces merge, become simpler, part and give up contacts until
//! each explains its own at the least cost.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::cost::{Costs, SurfaceRegion};
use super::guess::guesses;
use super::proposals::{LEAST_CONTACTS, labels};
use super::shape::TouchedShape;
use crate::features::fit::SurfaceModel;
use crate::features::segmentation::facets::NONE;
use crate::features::segmentation::primitive::Primitive;
use touchup_geometry::numeric::{distinct, tangent_basis};

/// Number of rounds, and of updates of the labels in each.
const ROUNDS: usize = 3;
const UPDATES: usize = 2;
/// Cost of neighbours of other surfaces, of all neighbours, and of an edge, in the maximum squared
/// misfit.
const UNLIKE: f64 = 0.5;
const OF_EDGE: f64 = 0.25;
/// Label of contacts at an edge.
const EDGE: u32 = NONE - 1;
/// Gaps between the two strips of a cylinder that may be two planes, rad: 40°; minimum share of its
/// contacts that these explain as well.
const PARTED: f64 = 0.7;
const AS_WELL: f64 = 0.97;
/// Maximum distance of most contacts of a region from a surface that it may join, in the maximum
/// misfit, and number of those that are examined.
const JOINED: f64 = 4.0;
const MOST_JOINED: usize = 16;
/// Cosine of their maximum lean: 40°.
const ALIKE: f64 = 0.77;
/// Cosine of the maximum turn to a known axis: 10°.
const HELD: f64 = 0.985;
/// Maximum number of contacts in a fit of two regions, of each.
const MOST_OF_TWO: usize = 150;

/// Settles surfaces over contacts.
pub(super) struct Settling<'a> {
    pub costs: Costs<'a>,
    /// axes that surfaces may share
    pub axes: &'a [Vector3<f64>],
}

impl Settling<'_> {
    pub(super) fn settled(&self, mut regions: Vec<SurfaceRegion>) -> Vec<SurfaceRegion> {
        for _ in 0..ROUNDS {
            self.merge(&mut regions);
            regions.iter_mut().for_each(|region| self.simplify(region));
            regions = regions
                .into_iter()
                .flat_map(|region| match self.strips(&region) {
                    Some(strips) => strips,
                    None => vec![region],
                })
                .collect();
            self.assign(&mut regions);
            self.prune(&mut regions);
        }
        self.merge(&mut regions);
        regions
    }

    /// Merges surfaces of which one explains both.
    fn merge(&self, regions: &mut Vec<SurfaceRegion>) {
        let mut at = 0;
        while at < regions.len() {
            let mut other = at + 1;
            while other < regions.len() {
                match self.joint(&regions[at], &regions[other]) {
                    Some(joint) => {
                        regions[at] = joint;
                        regions.swap_remove(other);
                        other = at + 1;
                    }
                    None => other += 1,
                }
            }
            at += 1;
        }
    }

    fn joint(&self, one: &SurfaceRegion, other: &SurfaceRegion) -> Option<SurfaceRegion> {
        let (large, small) = if one.gain < other.gain {
            (other, one)
        } else {
            (one, other)
        };
        let primitive = &large.shape.primitive;
        let some = self.costs.some(&small.contacts, MOST_JOINED);
        let on = some.iter().filter(|contact| {
            let (distance, normal) = primitive.distance_and_normal(&contact.centre);
            let is_alike = contact.land.is_some() || normal.dot(&contact.normal) > ALIKE;
            is_alike && (distance - contact.radius).abs() < JOINED * self.costs.near
        });
        if 2 * on.count() <= some.len() {
            return None;
        }
        let contacts = [large.contacts.as_slice(), &small.contacts].concat();
        let of_each = [large, small].map(|region| self.costs.some(&region.contacts, MOST_OF_TWO));
        let fitted = of_each.concat();
        let joint = [large, small].into_iter().filter_map(|start| {
            let shape = start.shape.refitted(&fitted, self.costs.near)?;
            Some((self.costs.gain(&shape, &contacts), shape))
        });
        let (gain, shape) = joint.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (gain > large.gain.max(0.0) + small.gain.max(0.0)).then_some(SurfaceRegion {
            shape,
            contacts,
            gain,
        })
    }

    /// Tries simpler shapes for a surface.
    fn simplify(&self, region: &mut SurfaceRegion) {
        let fitted = self.costs.some(&region.contacts, super::cost::MOST_FITTED);
        let mut shapes = vec![region.shape];
        if region.shape.primitive.plane().is_none() {
            let guesses = guesses(&fitted, self.axes).into_iter();
            shapes.extend(guesses.map(TouchedShape::free));
        }
        let held = |shape: &TouchedShape| TouchedShape::held(&shape.primitive, self.axes, HELD);
        let held: Vec<TouchedShape> = shapes.iter().flat_map(held).collect();
        for shape in shapes.iter().chain(&held) {
            let Some(shape) = shape.refitted(&fitted, self.costs.near) else {
                continue;
            };
            let gain = self.costs.gain(&shape, &region.contacts);
            if gain > region.gain {
                (region.shape, region.gain) = (shape, gain);
            }
        }
    }

    /// The planes of a cylinder whose contacts are in two strips: walls on both sides of a slot.
    fn strips(&self, region: &SurfaceRegion) -> Option<Vec<SurfaceRegion>> {
        let Primitive::Cylinder(cylinder) = &region.shape.primitive else {
            return None;
        };
        let [e, g] = tangent_basis(&cylinder.axis());
        let turn = |&at: &u32| {
            let v = self.costs.contacts.all[at as usize].point - cylinder.center();
            (v.dot(&g).atan2(v.dot(&e)), at)
        };
        let mut turns: Vec<(f64, u32)> = region.contacts.iter().map(turn).collect();
        turns.sort_by(|a, b| a.0.total_cmp(&b.0));
        let next = |i: usize| turns[(i + 1) % turns.len()].0;
        let is_gap = |&i: &usize| (next(i) - turns[i].0).rem_euclid(TAU) > PARTED;
        let gaps: Vec<usize> = (0..turns.len()).filter(is_gap).collect();
        let &[first, second] = gaps.as_slice() else {
            return None;
        };
        turns.rotate_left(first + 1);
        let (one, other) = turns.split_at(second - first);
        let strips = [one, other].map(|strip| {
            let contacts: Vec<u32> = strip.iter().map(|(_, at)| *at).collect();
            let shape = self.flat(&contacts)?;
            Some(self.costs.region(shape, contacts))
        });
        let [Some(one), Some(other)] = strips else {
            return None;
        };
        let explained = |region: &SurfaceRegion| {
            let contacts = region.contacts.iter();
            let explained = contacts.map(|&at| self.costs.explained(&region.shape.primitive, at));
            explained.sum::<f64>()
        };
        let is_flat = explained(&one) + explained(&other) > AS_WELL * explained(region);
        is_flat.then(|| vec![one, other])
    }

    /// The plane through contacts.
    fn flat(&self, contacts: &[u32]) -> Option<TouchedShape> {
        let fitted = self.costs.some(contacts, super::cost::MOST_FITTED);
        let guesses = guesses(&fitted, &[]);
        let plane = guesses.iter().find(|guess| guess.plane().is_some())?;
        let held = TouchedShape::held(plane, self.axes, HELD).into_iter();
        held.chain([TouchedShape::free(*plane)])
            .find_map(|shape| shape.refitted(&fitted, self.costs.near))
    }

    /// Gives each contact to the surface, or the edge, that explains it best beside its neighbours:
    /// iterated conditional modes.
    fn assign(&self, regions: &mut Vec<SurfaceRegion>) {
        let count = self.costs.contacts.all.len();
        let mut of = labels(count, regions);
        for _ in 0..UPDATES {
            of = (0..count)
                .map(|at| self.best_label(regions, &of, at))
                .collect();
        }
        regions
            .iter_mut()
            .for_each(|region| region.contacts.clear());
        for (at, &label) in (0..).zip(&of) {
            if label < EDGE {
                regions[label as usize].contacts.push(at);
            }
        }
        regions.retain_mut(|region| {
            let shape = if region.contacts.len() < LEAST_CONTACTS {
                None
            } else {
                self.costs.refitted(&region.shape, &region.contacts)
            };
            let Some(shape) = shape else {
                return false;
            };
            region.shape = shape;
            region.gain = self.costs.gain(&shape, &region.contacts);
            region.gain > 0.0
        });
    }

    fn best_label(&self, regions: &[SurfaceRegion], of: &[u32], at: usize) -> u32 {
        let neighbours = &self.costs.contacts.beside[at];
        let around = neighbours.iter().map(|&other| of[other as usize]);
        let mut around: Vec<u32> = around
            .chain([of[at]])
            .filter(|&label| label < EDGE)
            .collect();
        around.sort_unstable();
        let all = around.len() as f64;
        let mut best = (1.0, NONE);
        for alike in around.chunk_by(|a, b| a == b) {
            let primitive = &regions[alike[0] as usize].shape.primitive;
            let on = self.costs.misfit(primitive, at as u32);
            let unlike = UNLIKE * (1.0 - alike.len() as f64 / all);
            let at_edge = self.costs.misfit_at_edge(primitive, at as u32);
            let costs = [
                on.map(|misfit| (misfit * misfit + unlike, alike[0])),
                at_edge.map(|misfit| (misfit * misfit + OF_EDGE, EDGE)),
            ];
            for cost in costs.into_iter().flatten() {
                if cost.0 < best.0 {
                    best = cost;
                }
            }
        }
        best.1
    }

    /// Drops surfaces whose contacts other surfaces, and their edges, explain as well.
    fn prune(&self, regions: &mut Vec<SurfaceRegion>) {
        let mut of = labels(self.costs.contacts.all.len(), regions);
        let mut order: Vec<usize> = (0..regions.len()).collect();
        order.sort_by(|&a, &b| regions[a].gain.total_cmp(&regions[b].gain));
        for at in order {
            let region = &regions[at];
            let worth = |&contact: &u32| {
                let own = self.costs.explained(&region.shape.primitive, contact);
                let neighbours = &self.costs.contacts.beside[contact as usize];
                let others = neighbours.iter().map(|&other| of[other as usize]);
                let others = distinct(others.filter(|&label| label < EDGE && label != at as u32));
                let by_others = others.iter().filter_map(|&label| {
                    let primitive = &regions[label as usize].shape.primitive;
                    self.costs.explained_with_edge(primitive, contact)
                });
                (own - by_others.fold(0.0, f64::max)).max(0.0)
            };
            let price = Costs::price(&region.shape, region.contacts.len());
            if region.contacts.iter().map(worth).sum::<f64>() < price {
                for contact in std::mem::take(&mut regions[at].contacts) {
                    of[contact as usize] = NONE;
                }
            }
        }
        regions.retain(|region| !region.contacts.is_empty());
    }
}
