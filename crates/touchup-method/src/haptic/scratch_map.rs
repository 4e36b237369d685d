//! A scratch map that numbers ids in order of insertion, clears in no time and stays in the nearest
//! cache.

use std::hint::select_unpredictable;

/// Open addressing with linear probing. Entries of older stamps count as empty.
#[derive(Clone, Debug, Default)]
pub(super) struct ScratchMap {
    /// length: a power of two, at most half full
    entries: Vec<Entry>,
    stamp: u32,
    len: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// stamp in the upper half, key in the lower
    tag: u64,
    number: u32,
}

/// Initial room: a one-ring region has 37 faces and twice as many edges.
const FIRST_ROOM: usize = 256;

impl ScratchMap {
    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        if self.entries.is_empty() {
            self.entries.resize(FIRST_ROOM, Entry::default());
        }
        self.len = 0;
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.entries.fill(Entry::default());
            self.stamp = 1;
        }
    }

    #[inline]
    fn tag(&self, key: u32) -> u64 {
        u64::from(self.stamp) << 32 | u64::from(key)
    }

    /// Slot of `key`, or the slot for inserting it. Fibonacci hashing: the high bits of a product
    /// are well mixed.
    #[inline]
    fn slot(&self, key: u32) -> usize {
        let (tag, mask) = (self.tag(key), self.entries.len() - 1);
        let mut at = (u64::from(key).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        // another key of this stamp: tags that differ only in the lower half. One branch, seldom
        // taken: the presence of the key itself is unpredictable
        while (self.entries[at].tag ^ tag).wrapping_sub(1) < u64::from(u32::MAX) {
            at = (at + 1) & mask;
        }
        at
    }

    /// The number of `key`.
    #[inline]
    pub(crate) fn of(&self, key: u32) -> Option<u32> {
        let entry = self.entries[self.slot(key)];
        (entry.tag == self.tag(key)).then_some(entry.number)
    }

    /// Numbers of `keys`; new keys get the next ones.
    #[inline]
    pub(crate) fn number<const N: usize>(&mut self, keys: [u32; N]) -> [u32; N] {
        let mut len = self.len;
        let numbers = keys.map(|key| {
            let at = self.slot(key);
            let entry = self.entries[at];
            let (tag, is_new) = (self.tag(key), entry.tag != self.tag(key));
            let number = select_unpredictable(is_new, len as u32, entry.number);
            self.entries[at] = Entry { tag, number };
            len += usize::from(is_new);
            number
        });
        self.len = len;
        if 2 * len > self.entries.len() {
            self.grow();
        }
        numbers
    }

    /// Takes back the numbers of `keys`, which must be the last ones.
    pub(crate) fn take_back<const N: usize>(&mut self, keys: [u32; N]) {
        for key in keys.into_iter().rev() {
            let at = self.slot(key);
            self.entries[at] = Entry::default();
        }
        self.len -= N;
    }

    /// Number of keys.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Makes room for `count` keys.
    pub(crate) fn reserve(&mut self, count: usize) {
        while self.entries.len() < 2 * count {
            self.grow();
        }
    }

    fn grow(&mut self) {
        let room = (2 * self.entries.len()).max(FIRST_ROOM);
        let old = std::mem::replace(&mut self.entries, vec![Entry::default(); room]);
        for entry in old
            .into_iter()
            .filter(|entry| entry.tag >> 32 == u64::from(self.stamp))
        {
            let at = self.slot(entry.tag as u32);
            self.entries[at] = entry;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_what_was_put_in_and_nothing_older() {
        let mut scratch_map = ScratchMap::default();
        for round in 0..3u32 {
            scratch_map.clear();
            for key in 0..1000u32 {
                assert_eq!(scratch_map.number([key * 4096 + round; 2]), [key; 2]);
                assert_eq!(scratch_map.number([key * 4096 + round; 2]), [key; 2]);
            }
            assert_eq!(scratch_map.len(), 1000);
            scratch_map.number([3, 4]);
            scratch_map.take_back([3, 4]);
            assert_eq!(
                (scratch_map.of(3), scratch_map.of(4), scratch_map.len()),
                (None, None, 1000)
            );
            for key in 0..1000u32 {
                assert_eq!(scratch_map.of(key * 4096 + round), Some(key));
                assert_eq!(scratch_map.of(key * 4096 + round + 1), None);
            }
        }
    }
}
