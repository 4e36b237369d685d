//! A voxel set: one element per key, in cubes, with stroke undo.

use crate::reconstruct::history::{Direction, History};
use crate::reconstruct::lattice::LatticeNode;
use crate::reconstruct::table::{CellTable, Key};

/// Maximum number of cubes for undo: some tens of MB.
const MOST_KEPT: usize = 2000;

/// The elements of one cube; `None` without any.
type Bucket<T> = Option<Vec<T>>;

/// An element of a voxel set, which holds one per key.
pub(in crate::reconstruct) trait VoxelElement: Copy {
    /// a small cell, and other distinctions between its elements
    type Key: Key;
    /// Key for small cells of edge `cell` (m).
    fn key(&self, cell: f64) -> Self::Key;
}

/// Elements by their cubes.
#[derive(Clone, Debug)]
pub(in crate::reconstruct) struct VoxelSet<T: VoxelElement> {
    cell: f64,
    /// whether the set holds an element with this key
    is_kept: CellTable<T::Key, bool>,
    bins: CellTable<LatticeNode, Vec<T>>,
    history: History<LatticeNode, Bucket<T>>,
}

impl<T: VoxelElement> VoxelSet<T> {
    /// An empty set, with small cells of edge `cell` (m).
    pub(crate) fn new(cell: f64) -> Self {
        Self {
            cell,
            is_kept: CellTable::default(),
            bins: CellTable::default(),
            history: History::new(MOST_KEPT),
        }
    }

    /// Adds an element to a cube, unless its key is present; returns whether it did.
    pub(crate) fn add(&mut self, bin: LatticeNode, thing: T) -> bool {
        if std::mem::replace(self.is_kept.get_or_default(thing.key(self.cell)), true) {
            return false;
        }
        self.note(bin);
        self.bins.get_or_default(bin).push(thing);
        true
    }

    /// Removes elements that fail `stays` from a cube, and passes them to `each`.
    pub(crate) fn retain(
        &mut self,
        bin: LatticeNode,
        stays: impl Fn(&T) -> bool,
        mut each: impl FnMut(&T),
    ) {
        if self.get(&bin).iter().all(&stays) {
            return;
        }
        self.note(bin);
        let Some(things) = self.bins.get_mut(&bin) else {
            return;
        };
        things.retain(|thing| {
            let stays = stays(thing);
            if !stays {
                self.is_kept.insert(thing.key(self.cell), false);
                each(thing);
            }
            stays
        });
    }

    /// The elements of a cube.
    #[inline]
    pub(crate) fn get(&self, bin: &LatticeNode) -> &[T] {
        self.bins.get(bin).map_or(&[], Vec::as_slice)
    }

    /// All elements, cube by cube.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> + '_ {
        self.bins.iter().flat_map(|(_, things)| things)
    }

    fn note(&mut self, bin: LatticeNode) {
        self.history.note(bin, || self.bins.get(&bin).cloned());
    }

    /// Begins an undoable stroke.
    pub(crate) fn begin_stroke(&mut self) {
        self.history.begin();
    }

    /// Number of undoable strokes.
    pub(crate) fn strokes(&self) -> usize {
        self.history.len()
    }

    /// Undoes the last stroke, or redoes the last undone one; returns whether there was one.
    pub(crate) fn exchange(&mut self, direction: Direction) -> bool {
        let mut history = std::mem::replace(&mut self.history, History::new(MOST_KEPT));
        let has_changed = history.exchange(direction, |bin, past| self.swap(bin, past));
        self.history = history;
        has_changed
    }

    /// Exchanges the elements of a cube with the kept ones; cubes inserted last go first.
    fn swap(&mut self, bin: LatticeNode, past: &mut Bucket<T>) {
        let before = past.take();
        let there = if before.is_some() {
            self.bins.get_mut(&bin).map(std::mem::take)
        } else {
            self.bins.remove(&bin)
        };
        there
            .iter()
            .flatten()
            .for_each(|thing| self.is_kept.insert(thing.key(self.cell), false));
        if let Some(before) = before {
            before
                .iter()
                .for_each(|thing| self.is_kept.insert(thing.key(self.cell), true));
            self.bins.insert(bin, before);
        }
        *past = there;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl VoxelElement for u32 {
        type Key = u32;
        fn key(&self, _: f64) -> u32 {
            *self
        }
    }

    /// Cubes of ten numbers each.
    fn state(set: &VoxelSet<u32>) -> Vec<u32> {
        set.iter().copied().collect()
    }

    #[test]
    fn strokes_with_things_that_come_and_go_are_undone_and_redone() {
        let bin = |x: u32| [(x / 10) as i32, 0, 0];
        let mut set = VoxelSet::<u32>::new(1.0);
        let mut states = vec![state(&set)];
        for (come, go) in [
            (vec![1, 11, 2, 1], vec![]),
            (vec![3, 25], vec![1, 11]),
            (vec![11, 1, 40], vec![2, 25]),
        ] {
            set.begin_stroke();
            for &x in &come {
                set.add(bin(x), x);
            }
            for &x in &go {
                set.retain(bin(x), |&thing| thing != x, |&gone| assert_eq!(gone, x));
            }
            states.push(state(&set));
        }
        assert_eq!(
            states[1..],
            [vec![1, 2, 11], vec![2, 3, 25], vec![3, 1, 11, 40]]
        );
        for expected in states.iter().rev().skip(1) {
            assert!(set.exchange(Direction::Undo));
            assert_eq!(state(&set), *expected);
        }
        assert!(!set.exchange(Direction::Undo));
        for expected in &states[1..] {
            assert!(set.exchange(Direction::Redo));
            assert_eq!(state(&set), *expected);
        }
        assert!(
            !set.add(bin(40), 40) && set.add(bin(2), 2),
            "what is kept is known"
        );
    }
}
