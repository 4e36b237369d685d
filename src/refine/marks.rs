//! A small map from ids to numbers that is forgotten in no time and stays in the nearest cache.

/// Open addressing with linear probing. Entries of older stamps count as empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Marks {
    /// (stamp, key, value); a power of two, at most half full
    entries: Vec<(u32, u64, u32)>,
    stamp: u32,
    len: usize,
}

/// Room at the start: a one-ring region has 37 faces and twice as many edges.
const FIRST_ROOM: usize = 256;

impl Marks {
    /// Forgets everything.
    pub fn clear(&mut self) {
        if self.entries.is_empty() {
            self.entries.resize(FIRST_ROOM, (0, 0, 0));
        }
        self.len = 0;
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.entries.fill((0, 0, 0));
            self.stamp = 1;
        }
    }

    /// Where `key` is, or where it would go. Fibonacci hashing: the high bits of a product are well mixed.
    #[inline]
    fn slot(&self, key: u64) -> usize {
        let mask = self.entries.len() - 1;
        let mut at = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        while self.entries[at].0 == self.stamp && self.entries[at].1 != key {
            at = (at + 1) & mask;
        }
        at
    }

    /// The number of `key`.
    #[inline]
    pub fn of(&self, key: impl Into<u64>) -> Option<u32> {
        let (stamp, _, value) = self.entries[self.slot(key.into())];
        (stamp == self.stamp).then_some(value)
    }

    /// Gives `key` the number `value` unless it has one; returns the one it had.
    #[inline]
    pub fn insert(&mut self, key: impl Into<u64>, value: u32) -> Option<u32> {
        let key = key.into();
        let at = self.slot(key);
        if self.entries[at].0 == self.stamp {
            return Some(self.entries[at].2);
        }
        self.entries[at] = (self.stamp, key, value);
        self.len += 1;
        if 2 * self.len > self.entries.len() {
            self.grow();
        }
        None
    }

    /// Makes room for `count` keys.
    pub fn reserve(&mut self, count: usize) {
        while self.entries.len() < 2 * count {
            self.grow();
        }
    }

    fn grow(&mut self) {
        let room = (2 * self.entries.len()).max(FIRST_ROOM);
        let old = std::mem::replace(&mut self.entries, vec![(0, 0, 0); room]);
        for entry in old.into_iter().filter(|entry| entry.0 == self.stamp) {
            let at = self.slot(entry.1);
            self.entries[at] = entry;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_what_was_put_in_and_nothing_older() {
        let mut marks = Marks::default();
        for round in 0..3u32 {
            marks.clear();
            for key in 0..1000u32 {
                assert_eq!(marks.insert(key * 4096 + round, key), None);
                assert_eq!(marks.insert(key * 4096 + round, 7), Some(key));
            }
            for key in 0..1000u32 {
                assert_eq!(marks.of(key * 4096 + round), Some(key));
                assert_eq!(marks.of(key * 4096 + round + 1), None);
            }
        }
    }
}
