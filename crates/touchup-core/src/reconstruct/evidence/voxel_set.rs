//! A voxel set: one thing is kept for each key, in cubes; strokes of them can be undone.

use crate::reconstruct::field::lattice::LatticeNode;
use crate::reconstruct::incremental::history::History;
use crate::reconstruct::table::{CellTable, Key};

/// Cubes kept for undoing: some tens of MB.
const MOST_KEPT: usize = 2000;

/// The things of one cube; `None` where there are none.
type Bucket<T> = Option<Vec<T>>;

/// Things that have a key, by the cubes they are in.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct VoxelSet<K, T> {
    /// whether a thing with this key is there
    is_kept: CellTable<K, bool>,
    bins: CellTable<LatticeNode, Vec<T>>,
    history: History<LatticeNode, Bucket<T>>,
}

impl<K: Key, T: Copy> Default for VoxelSet<K, T> {
    fn default() -> Self {
        Self { is_kept: CellTable::default(), bins: CellTable::default(), history: History::new(MOST_KEPT) }
    }
}

impl<K: Key, T: Copy> VoxelSet<K, T> {
    /// Puts a thing into a cube, unless one with its key is there; returns whether it did.
    pub fn add(&mut self, key: K, bin: LatticeNode, thing: T) -> bool {
        let (at, _) = self.is_kept.insert_with(key, || false);
        if std::mem::replace(self.is_kept.value_mut(at), true) {
            return false;
        }
        self.note(bin);
        let (at, _) = self.bins.insert_with(bin, Vec::new);
        self.bins.value_mut(at).push(thing);
        true
    }

    /// Takes out of a cube what `stays` does not hold, and gives it to `each`.
    pub fn retain(
        &mut self,
        bin: LatticeNode,
        key: impl Fn(&T) -> K,
        stays: impl Fn(&T) -> bool,
        mut each: impl FnMut(&T),
    ) {
        if self.get(&bin).iter().all(&stays) {
            return;
        }
        self.note(bin);
        let Self { is_kept, bins, .. } = self;
        let Some(things) = bins.get_mut(&bin) else { return };
        things.retain(|thing| {
            let stays = stays(thing);
            if !stays {
                is_kept.insert(key(thing), false);
                each(thing);
            }
            stays
        });
    }

    /// What is in a cube.
    #[inline]
    pub fn get(&self, bin: &LatticeNode) -> &[T] {
        self.bins.get(bin).map_or(&[], Vec::as_slice)
    }

    /// All things, cube by cube.
    pub fn iter(&self) -> impl Iterator<Item = &T> + '_ {
        self.bins.iter().flat_map(|(_, things)| things)
    }

    fn note(&mut self, bin: LatticeNode) {
        let Self { history, bins, .. } = self;
        history.note(bin, || bins.get(&bin).cloned());
    }

    /// Begins a stroke, which can be undone.
    pub fn begin_stroke(&mut self) {
        self.history.begin();
    }

    /// How many strokes can be undone.
    pub fn strokes(&self) -> usize {
        self.history.len()
    }

    /// Undoes the last stroke.
    pub fn undo(&mut self, key: impl Fn(&T) -> K) -> bool {
        self.exchange(|history, swap| history.undo(swap), key)
    }

    /// Does again what was undone last.
    pub fn redo(&mut self, key: impl Fn(&T) -> K) -> bool {
        self.exchange(|history, swap| history.redo(swap), key)
    }

    fn exchange(
        &mut self,
        act: impl FnOnce(&mut History<LatticeNode, Bucket<T>>, &mut dyn FnMut(LatticeNode, &mut Bucket<T>)) -> bool,
        key: impl Fn(&T) -> K,
    ) -> bool {
        let mut history = std::mem::replace(&mut self.history, History::new(MOST_KEPT));
        let has_changed = act(&mut history, &mut |bin, past| self.swap(bin, past, &key));
        self.history = history;
        has_changed
    }

    /// Exchanges the things of a cube with those that were kept; cubes inserted last go first.
    fn swap(&mut self, bin: LatticeNode, past: &mut Bucket<T>, key: &impl Fn(&T) -> K) {
        let before = past.take();
        let there = match (before.is_some(), self.bins.get_mut(&bin)) {
            (true, Some(things)) => Some(std::mem::take(things)),
            (true, None) => None,
            (false, _) => self.bins.remove(&bin),
        };
        there.iter().flatten().for_each(|thing| self.is_kept.insert(key(thing), false));
        if let Some(before) = before {
            before.iter().for_each(|thing| self.is_kept.insert(key(thing), true));
            self.bins.insert(bin, before);
        }
        *past = there;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubes of ten numbers each.
    fn state(set: &VoxelSet<u32, u32>) -> Vec<u32> {
        set.iter().copied().collect()
    }

    #[test]
    fn strokes_with_things_that_come_and_go_are_undone_and_redone() {
        let bin = |x: u32| [(x / 10) as i32, 0, 0];
        let mut set = VoxelSet::<u32, u32>::default();
        let mut states = vec![state(&set)];
        for (come, go) in [(vec![1, 11, 2, 1], vec![]), (vec![3, 25], vec![1, 11]), (vec![11, 1, 40], vec![2, 25])] {
            set.begin_stroke();
            for &x in &come {
                set.add(x, bin(x), x);
            }
            for &x in &go {
                set.retain(bin(x), |&thing| thing, |&thing| thing != x, |&gone| assert_eq!(gone, x));
            }
            states.push(state(&set));
        }
        assert_eq!(states[1..], [vec![1, 2, 11], vec![2, 3, 25], vec![3, 1, 11, 40]]);
        for expected in states.iter().rev().skip(1) {
            assert!(set.undo(|&thing| thing));
            assert_eq!(state(&set), *expected);
        }
        assert!(!set.undo(|&thing| thing));
        for expected in &states[1..] {
            assert!(set.redo(|&thing| thing));
            assert_eq!(state(&set), *expected);
        }
        assert!(!set.add(40, bin(40), 40) && set.add(2, bin(2), 2), "what is kept is known");
    }
}
