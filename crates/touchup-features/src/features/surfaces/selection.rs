//! The surfaces that together explain the most contacts at their prices: facility location, greedy
//! with removal.

use super::cost::{Costs, SurfaceRegion};
use super::reach::ContactReach;

/// The best and the second best share of a contact, with their proposals.
type BestTwo = [(f64, usize); 2];

/// The shares of contacts that a proposal explains, and its price.
struct Offer {
    support: Vec<(u32, f64)>,
    price: f64,
}

impl Offer {
    /// Gain if it joins others.
    fn added(&self, best: &[BestTwo]) -> f64 {
        let more = |&(contact, share): &(u32, f64)| (share - best[contact as usize][0].0).max(0.0);
        self.support.iter().map(more).sum::<f64>() - self.price
    }

    /// Loss if it leaves the others.
    ///
    /// - `own`: its number.
    fn lost(&self, own: usize, best: &[BestTwo]) -> f64 {
        let less = |&(contact, _): &(u32, f64)| match best[contact as usize] {
            [(first, number), (second, _)] if number == own => first - second,
            _ => 0.0,
        };
        self.support.iter().map(less).sum::<f64>() - self.price
    }
}

fn best_of(offers: &[Offer], chosen: &[usize], count: usize) -> Vec<BestTwo> {
    let mut best = vec![[(0.0, usize::MAX); 2]; count];
    for &at in chosen {
        for &(contact, share) in &offers[at].support {
            let best = &mut best[contact as usize];
            if share > best[0].0 {
                *best = [(share, at), best[0]];
            } else if share > best[1].0 {
                best[1] = (share, at);
            }
        }
    }
    best
}

/// The chosen ones of some proposals, each with the contacts that it explains best.
pub(super) fn selected(
    costs: &Costs,
    reach: &mut ContactReach,
    proposals: &[SurfaceRegion],
) -> Vec<SurfaceRegion> {
    let offer = |region: &SurfaceRegion| Offer {
        support: reach.support(costs, &region.shape.primitive, &region.contacts),
        price: Costs::price(&region.shape, region.contacts.len()),
    };
    let offers: Vec<Offer> = proposals.iter().map(offer).collect();
    let count = costs.contacts.all.len();
    let mut chosen: Vec<usize> = Vec::new();
    let mut best = best_of(&offers, &chosen, count);
    for _ in 0..2 * proposals.len() {
        let others = (0..offers.len()).filter(|at| !chosen.contains(at));
        let next = others
            .map(|at| (at, offers[at].added(&best)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((next, _)) = next.filter(|(_, gain)| *gain > 0.0) else {
            break;
        };
        chosen.push(next);
        best = best_of(&offers, &chosen, count);
        // those that are not worth their price any more
        while let Some(worst) = worst_of(&offers, &chosen, &best) {
            chosen.retain(|&at| at != worst);
            best = best_of(&offers, &chosen, count);
        }
    }
    let region = |&at: &usize| {
        let shape = proposals[at].shape;
        let is_own = |contact: u32| {
            best[contact as usize][0].1 == at && costs.misfit(&shape.primitive, contact).is_some()
        };
        let support = offers[at].support.iter().map(|(contact, _)| *contact);
        costs.region(shape, support.filter(|&contact| is_own(contact)).collect())
    };
    chosen.iter().map(region).collect()
}

fn worst_of(offers: &[Offer], chosen: &[usize], best: &[BestTwo]) -> Option<usize> {
    let lost = chosen.iter().map(|&at| (at, offers[at].lost(at, best)));
    let worst = lost.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (worst.1 < 0.0).then_some(worst.0)
}
