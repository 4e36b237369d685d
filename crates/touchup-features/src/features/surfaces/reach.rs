//! Connected contacts.

use super::contacts::Contacts;
use super::cost::Costs;
use crate::features::segmentation::primitive::Primitive;

/// Visits of contacts from neighbour to neighbour.
pub(super) struct ContactReach<'a> {
    contacts: &'a Contacts,
    seen: Vec<u32>,
    round: u32,
}

impl<'a> ContactReach<'a> {
    pub(super) fn over(contacts: &'a Contacts) -> Self {
        Self {
            contacts,
            seen: vec![0; contacts.all.len()],
            round: 0,
        }
    }

    /// The seeds and all contacts that follow from neighbour to neighbour.
    ///
    /// - `is_next`: whether the second one follows from the first.
    pub(super) fn from(&mut self, seeds: Vec<u32>, is_next: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        self.round += 1;
        let mut found = seeds;
        found
            .iter()
            .for_each(|&at| self.seen[at as usize] = self.round);
        let mut next = 0;
        while next < found.len() {
            let at = found[next];
            next += 1;
            for &other in &self.contacts.beside[at as usize] {
                let seen = &mut self.seen[other as usize];
                if *seen != self.round && is_next(at, other) {
                    *seen = self.round;
                    found.push(other);
                }
            }
        }
        found
    }

    /// The seeds and all connected contacts with a value, each with it.
    pub(super) fn with_value<V>(
        &mut self,
        seeds: &[u32],
        value: impl Fn(u32) -> Option<V>,
    ) -> Vec<(u32, V)> {
        self.round += 1;
        let mut front = seeds.to_vec();
        front
            .iter()
            .for_each(|&at| self.seen[at as usize] = self.round);
        let mut found = Vec::new();
        while let Some(at) = front.pop() {
            let Some(value) = value(at) else {
                continue;
            };
            found.push((at, value));
            for &other in &self.contacts.beside[at as usize] {
                let seen = &mut self.seen[other as usize];
                if *seen != self.round {
                    *seen = self.round;
                    front.push(other);
                }
            }
        }
        found
    }

    /// Explained shares of all contacts of a surface, or at its edge, that are connected with seeds.
    pub(super) fn support(
        &mut self,
        costs: &Costs,
        primitive: &Primitive,
        seeds: &[u32],
    ) -> Vec<(u32, f64)> {
        self.with_value(seeds, |at| costs.explained_with_edge(primitive, at))
    }
}
