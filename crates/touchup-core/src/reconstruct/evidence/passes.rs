//! Independent passes over a place: samples in one smoothing window share their noise.

/// One pass over a place, or several put together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::reconstruct) struct Pass {
    /// when the last of them began, ns
    pub began_ns: i64,
    /// sum of the weights of their contacts
    pub weight: f64,
    /// how many they are
    pub count: u32,
}

/// Passes remembered one by one; further ones are put to those.
const REMEMBERED: usize = 4;

/// The passes over one place. A pass ends after the length of a window: later contacts are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::reconstruct) struct IndependentPasses {
    slots: [Pass; REMEMBERED],
    count: u32,
}

impl IndependentPasses {
    /// Counts a contact of this weight; whether it is independent of those before.
    pub fn note(&mut self, stamp_ns: i64, weight: f64, window_ns: i64) -> bool {
        let newest = self.slots[(self.count.wrapping_sub(1)) as usize % REMEMBERED];
        let is_new = self.count == 0 || stamp_ns.saturating_sub(newest.began_ns) > window_ns;
        if is_new {
            self.count = self.count.saturating_add(1);
        }
        let slot = &mut self.slots[(self.count - 1) as usize % REMEMBERED];
        slot.weight += weight;
        if is_new {
            (slot.began_ns, slot.count) = (stamp_ns, slot.count.saturating_add(1));
        }
        is_new
    }

    /// How many passes.
    pub fn count(&self) -> u32 {
        self.count
    }

    pub fn iter(&self) -> impl Iterator<Item = &Pass> + '_ {
        self.slots.iter().take(self.count as usize)
    }
}
