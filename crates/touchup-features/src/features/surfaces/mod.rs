//! Surfaces that contacts show, each contact on one of them: contacts as evidence, proposals, the
//! cheapest selection of these, and one surface for each contact (PEARL, Isack and Boykov 2012).

mod claim;
mod contact;
mod contacts;
mod cost;
mod guess;
mod noise;
mod proposals;
mod reach;
mod selection;
mod settle;
mod shape;
mod touched_surface;

use crate::features::segmentation::primitive::Primitive;
use crate::features::segmentation::segment::FeltPlace;
use contacts::Contacts;
use cost::{Costs, SurfaceRegion};
use proposals::Proposals;
use reach::ContactReach;
use selection::selected;
use settle::Settling;
use touched_surface::TouchedSurface;
use touchup_method::stylus::ProbedPoint;

pub(in crate::features) use claim::{BESIDE_CONTACTS, claim};

/// Minimum gain of a surface whose edges show the walls beside it.
const LAND_GAIN: f64 = 20.0;
/// Radii of a fillet, concave or convex, that is no wider than the path of the ball around an edge,
/// in its own.
const CORNER: f64 = 1.05;
const ROUNDED_EDGE: f64 = 0.3;

/// All surfaces that touches show.
pub(crate) fn touched_surfaces(touches: &[ProbedPoint]) -> Vec<TouchedSurface> {
    let contacts = Contacts::of(touches);
    if contacts.all.is_empty() {
        return Vec::new();
    }
    let costs = Costs::of(&contacts);
    let mut proposals = Proposals::over(costs, Vec::new(), Vec::new());
    proposals.grow(|_| true);
    let axes = proposals.axes.clone();
    let regions = settled(proposals);
    let borders = borders(&costs, &regions);
    let contacts = contacts.with_edges(touches, &borders);
    let costs = Costs::of(&contacts);
    let mut proposals = Proposals::over(costs, regions, axes);
    proposals.grow(|contact| contact.land.is_some());
    let regions = settled(proposals);
    let surface = |region: SurfaceRegion| {
        let of_contact = |&at: &u32| contacts.all[at as usize].places(touches);
        let mut felt: Vec<FeltPlace> = region.contacts.iter().flat_map(of_contact).collect();
        felt.sort_by_key(|felt| felt.touch);
        TouchedSurface {
            primitive: region.shape.primitive,
            felt,
        }
    };
    let is_wide = |region: &SurfaceRegion| match &region.shape.primitive {
        Primitive::Cylinder(c) if c.concave => c.radius > CORNER * contacts.radius,
        Primitive::Cylinder(c) => c.radius > ROUNDED_EDGE * contacts.radius,
        _ => true,
    };
    regions.into_iter().filter(is_wide).map(surface).collect()
}

/// The chosen and settled ones of all proposals.
fn settled(proposals: Proposals) -> Vec<SurfaceRegion> {
    let Proposals {
        costs,
        mut reach,
        regions,
        axes,
        ..
    } = proposals;
    let settling = Settling { costs, axes: &axes };
    settling.settled(selected(&costs, &mut reach, &regions))
}

/// Surfaces with walls beside them, each with the contacts that lean over its edges.
fn borders(costs: &Costs, regions: &[SurfaceRegion]) -> Vec<(Primitive, Vec<u32>)> {
    let mut reach = ContactReach::over(costs.contacts);
    let is_land = |region: &&SurfaceRegion| {
        let is_outside = match &region.shape.primitive {
            Primitive::Plane(_) => true,
            Primitive::Cylinder(c) => !c.concave && c.radius > costs.contacts.radius,
            Primitive::Cone(_) | Primitive::Sphere(_) => false,
        };
        is_outside && region.gain > LAND_GAIN
    };
    let border = |region: &SurfaceRegion| {
        let surface = region.shape.primitive;
        let support = reach.support(costs, &surface, &region.contacts).into_iter();
        let leaning = support.filter(|(at, _)| costs.misfit(&surface, *at).is_none());
        (surface, leaning.map(|(at, _)| at).collect())
    };
    regions.iter().filter(is_land).map(border).collect()
}

#[cfg(test)]
mod tests;
