//! A small map that keeps the order of insertion, as long as no key is removed, so that iteration
//! never depends on hashing.

/// A key of a [`CellTable`].
pub trait Key: Copy + Eq {
    /// 64 bits that differ for different keys as often as possible, not necessarily mixed.
    fn bits(&self) -> u64;
}

impl Key for u32 {
    #[inline]
    fn bits(&self) -> u64 {
        u64::from(*self)
    }
}

/// Open addressing with linear probing over a list of entries in order of insertion.
#[derive(Clone, Debug)]
pub struct CellTable<K, V> {
    entries: Vec<(K, V)>,
    /// index into `entries`, [`EMPTY`] without one; a power of two, at most half full
    slots: Vec<u32>,
}

/// A slot without an entry.
const EMPTY: u32 = u32::MAX;
/// Initial number of slots.
const FIRST_ROOM: usize = 16;

impl<K, V> Default for CellTable<K, V> {
    fn default() -> Self {
        Self {
            entries: Vec::new(),
            slots: vec![EMPTY; FIRST_ROOM],
        }
    }
}

impl<K: Key, V> CellTable<K, V> {
    /// Number of keys.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether the table is empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Forgets all keys.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.slots.truncate(FIRST_ROOM);
        self.slots.fill(EMPTY);
    }

    /// Keys and values in order of insertion.
    pub fn iter(&self) -> impl Iterator<Item = (K, &V)> + '_ {
        self.entries.iter().map(|(key, value)| (*key, value))
    }

    /// The `at`-th key inserted, with its value.
    #[inline]
    pub fn entry(&self, at: u32) -> &(K, V) {
        &self.entries[at as usize]
    }

    /// Fibonacci hashing: the high bits of a product are well mixed.
    #[inline]
    fn first_slot(&self, key: &K) -> usize {
        let hash = key.bits().wrapping_mul(0x9e37_79b9_7f4a_7c15);
        (hash >> (u64::BITS - self.slots.len().trailing_zeros())) as usize
    }

    #[inline]
    fn slot(&self, key: &K) -> usize {
        let mask = self.slots.len() - 1;
        let mut at = self.first_slot(key);
        while self.slots[at] != EMPTY && self.entries[self.slots[at] as usize].0 != *key {
            at = (at + 1) & mask;
        }
        at
    }

    /// Index of `key` in order of insertion.
    #[inline]
    pub(crate) fn index_of(&self, key: &K) -> Option<u32> {
        let entry = self.slots[self.slot(key)];
        (entry != EMPTY).then_some(entry)
    }

    /// Whether the table holds `key`.
    #[inline]
    pub(crate) fn contains(&self, key: &K) -> bool {
        self.slots[self.slot(key)] != EMPTY
    }

    /// The value of `key`.
    #[inline]
    pub fn get(&self, key: &K) -> Option<&V> {
        self.index_of(key).map(|at| &self.entries[at as usize].1)
    }

    /// Mutable value of `key`.
    #[inline]
    pub(crate) fn get_mut(&mut self, key: &K) -> Option<&mut V> {
        self.index_of(key)
            .map(|at| &mut self.entries[at as usize].1)
    }

    /// Mutable value of the `at`-th key inserted.
    #[inline]
    pub(crate) fn value_mut(&mut self, at: u32) -> &mut V {
        &mut self.entries[at as usize].1
    }

    /// Inserts `key` with the value of `make` unless present; returns its index and whether it is
    /// new.
    #[inline]
    pub fn insert_with(&mut self, key: K, make: impl FnOnce() -> V) -> (u32, bool) {
        let slot = self.slot(&key);
        if self.slots[slot] != EMPTY {
            return (self.slots[slot], false);
        }
        let at = self.entries.len() as u32;
        self.slots[slot] = at;
        self.entries.push((key, make()));
        if 2 * self.entries.len() > self.slots.len() {
            self.grow();
        }
        (at, true)
    }

    /// Mutable value of `key`; inserts the default if absent.
    #[inline]
    pub(crate) fn get_or_default(&mut self, key: K) -> &mut V
    where
        V: Default,
    {
        let (at, _) = self.insert_with(key, V::default);
        self.value_mut(at)
    }

    /// Sets the value of `key`.
    pub fn insert(&mut self, key: K, value: V) {
        if let Some(known) = self.get_mut(&key) {
            *known = value;
        } else {
            self.insert_with(key, || value);
        }
    }

    /// Removes `key`; the key inserted last takes its number. Returns its value.
    pub(crate) fn remove(&mut self, key: &K) -> Option<V> {
        let slot = self.slot(key);
        let at = self.slots[slot];
        if at == EMPTY {
            return None;
        }
        self.vacate(slot);
        let last = self.entries.len() as u32 - 1;
        if at != last {
            let of_last = self.slot(&self.entries[last as usize].0);
            self.slots[of_last] = at;
        }
        Some(self.entries.swap_remove(at as usize).1)
    }

    /// Empties a slot, and moves displaced entries nearer to their first slots.
    fn vacate(&mut self, mut hole: usize) {
        let mask = self.slots.len() - 1;
        let mut at = hole;
        loop {
            at = (at + 1) & mask;
            if self.slots[at] == EMPTY {
                break;
            }
            let wanted = self.first_slot(&self.entries[self.slots[at] as usize].0);
            // the entry may move back to the hole unless its first slot lies behind it
            if (at.wrapping_sub(wanted) & mask) >= (at.wrapping_sub(hole) & mask) {
                self.slots[hole] = self.slots[at];
                hole = at;
            }
        }
        self.slots[hole] = EMPTY;
    }

    fn grow(&mut self) {
        self.slots = vec![EMPTY; 2 * self.slots.len()];
        for at in 0..self.entries.len() {
            let slot = self.slot(&self.entries[at].0);
            self.slots[slot] = at as u32;
        }
    }
}

impl<K: Key, V> FromIterator<(K, V)> for CellTable<K, V> {
    fn from_iter<I: IntoIterator<Item = (K, V)>>(pairs: I) -> Self {
        let mut table = Self::default();
        for (key, value) in pairs {
            table.insert(key, value);
        }
        table
    }
}

impl<K: Key> FromIterator<K> for CellTable<K, ()> {
    fn from_iter<I: IntoIterator<Item = K>>(keys: I) -> Self {
        keys.into_iter().map(|key| (key, ())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_what_was_put_in_in_that_order() {
        let mut table = CellTable::default();
        for round in 0..2 {
            table.clear();
            for i in 0..1000i32 {
                assert_eq!(
                    table.insert_with([i % 7 - 3, -i, 1000 * i], || i),
                    (i as u32, true)
                );
                assert_eq!(
                    table.insert_with([i % 7 - 3, -i, 1000 * i], || -1),
                    (i as u32, false)
                );
            }
            assert!(
                table.iter().map(|(_, &value)| value).eq(0..1000),
                "round {round}"
            );
            assert_eq!(table.get(&[-3, -7, 7000]), Some(&7));
            assert_eq!(table.get(&[-3, -7, 7001]), None);
            table.insert([-3, -7, 7000], 8);
            assert_eq!((table.get(&[-3, -7, 7000]), table.len()), (Some(&8), 1000));
        }
    }

    /// Compared with the standard library's map, for keys with many shared first slots.
    #[test]
    fn what_was_taken_out_is_gone_and_the_rest_stays() {
        let mut table = CellTable::default();
        let mut map = std::collections::BTreeMap::new();
        let mut state = 7u64;
        for step in 0..20_000u32 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let key = [(state >> 40) as i32 % 12, (state >> 50) as i32 % 9, 0];
            if state >> 63 == 0 {
                assert_eq!(table.remove(&key), map.remove(&key), "step {step}");
            } else {
                table.insert(key, step);
                map.insert(key, step);
            }
            assert_eq!(table.len(), map.len());
        }
        let mut rest: Vec<_> = table.iter().map(|(key, value)| (key, *value)).collect();
        rest.sort_unstable();
        assert!(rest.into_iter().eq(map));
        assert!((0..12).all(|x| {
            (0..9).all(|y| table.get(&[x, y, 0]).is_some() == table.contains(&[x, y, 0]))
        }));
    }
}
