//! Stroke undo: old values by key, so that undo and redo restore strokes bit by bit.

use std::collections::VecDeque;

use crate::reconstruct::table::{CellTable, Key};

/// Maximum number of undoable strokes.
const MOST_STROKES: usize = 64;

/// The stroke to exchange with the state in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reconstruct) enum Direction {
    /// the latest stroke that counts
    Undo,
    /// the stroke undone last
    Redo,
}

/// Old values by key, stroke by stroke.
///
/// Undo and redo both swap kept and current values.
#[derive(Clone, Debug)]
pub(crate) struct History<K, V> {
    done: VecDeque<Vec<(K, V)>>,
    undone: Vec<Vec<(K, V)>>,
    /// the keys of the current stroke
    noted: CellTable<K, ()>,
    /// maximum number of values
    room: usize,
    kept: usize,
}

impl<K: Key, V> History<K, V> {
    /// Keeps at most `room` values; the oldest strokes go first.
    pub(crate) fn new(room: usize) -> Self {
        Self {
            done: VecDeque::new(),
            undone: Vec::new(),
            noted: CellTable::default(),
            room,
            kept: 0,
        }
    }

    /// Begins a stroke, which ends the redo of undone ones.
    pub(crate) fn begin(&mut self) {
        self.noted.clear();
        self.kept -= self
            .undone
            .drain(..)
            .map(|stroke| stroke.len())
            .sum::<usize>();
        self.done.push_back(Vec::new());
        self.forget();
    }

    /// Keeps the value of `key` before its first change in this stroke. Before the first stroke
    /// nothing is kept; a stroke beyond the limit cannot be undone, nor can earlier ones.
    pub(crate) fn note(&mut self, key: K, before: impl FnOnce() -> V) {
        let Some(stroke) = self.done.back_mut() else {
            return;
        };
        if self.noted.insert_with(key, || ()).1 {
            stroke.push((key, before()));
            self.kept += 1;
            if self.kept > self.room {
                self.forget();
            }
        }
    }

    fn forget(&mut self) {
        while self.kept > self.room || self.done.len() > MOST_STROKES {
            let Some(oldest) = self.done.pop_front() else {
                return;
            };
            self.kept -= oldest.len();
        }
    }

    /// Number of undoable strokes.
    pub(crate) fn len(&self) -> usize {
        self.done.len()
    }

    /// Whether there is no undoable stroke.
    pub(crate) fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    /// [`Self::undo`] or [`Self::redo`].
    pub(in crate::reconstruct) fn exchange(
        &mut self,
        direction: Direction,
        swap: impl FnMut(K, &mut V),
    ) -> bool {
        match direction {
            Direction::Undo => self.undo(swap),
            Direction::Redo => self.redo(swap),
        }
    }

    /// Undoes the last stroke, the last change first: `swap` exchanges kept and current values.
    /// Returns whether there was one.
    pub(crate) fn undo(&mut self, mut swap: impl FnMut(K, &mut V)) -> bool {
        let Some(mut stroke) = self.done.pop_back() else {
            return false;
        };
        stroke
            .iter_mut()
            .rev()
            .for_each(|(key, value)| swap(*key, value));
        self.undone.push(stroke);
        self.noted.clear();
        true
    }

    /// Redoes the last undone stroke. Returns whether there was one.
    pub(crate) fn redo(&mut self, mut swap: impl FnMut(K, &mut V)) -> bool {
        let Some(mut stroke) = self.undone.pop() else {
            return false;
        };
        stroke.iter_mut().for_each(|(key, value)| swap(*key, value));
        self.noted = stroke.iter().map(|(key, _)| *key).collect();
        self.done.push_back(stroke);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(history: &mut History<u32, i32>, values: &mut [i32], key: u32, value: i32) {
        history.note(key, || values[key as usize]);
        values[key as usize] = value;
    }

    #[test]
    fn strokes_go_and_come_back() {
        let (mut history, mut values) = (History::new(100), [0; 3]);
        write(&mut history, &mut values, 0, 7);
        let mut states = vec![values];
        for stroke in 1..4 {
            history.begin();
            for key in [0, stroke as u32 % 3, 0] {
                write(&mut history, &mut values, key, 10 * stroke + key as i32);
            }
            states.push(values);
        }
        for state in states.iter().rev().skip(1) {
            assert!(history.undo(|key, value| std::mem::swap(&mut values[key as usize], value)));
            assert_eq!(values, *state);
        }
        assert!(
            !history.undo(|_, _| ()),
            "what came before the first stroke stays"
        );
        for state in &states[1..] {
            assert!(history.redo(|key, value| std::mem::swap(&mut values[key as usize], value)));
            assert_eq!(values, *state);
        }
        assert!(history.undo(|key, value| std::mem::swap(&mut values[key as usize], value)));
        history.begin();
        assert!(!history.redo(|_, _| ()), "something else was done since");
    }

    #[test]
    fn memory_is_bounded() {
        let mut history = History::new(10);
        for stroke in 0..1000u32 {
            history.begin();
            (0..4).for_each(|i| history.note(4 * stroke + i, || ()));
        }
        assert_eq!((history.len(), history.kept), (2, 8));
        history.begin();
        (0..11).for_each(|i| history.note(i, || ()));
        assert!(
            history.is_empty() && history.kept == 0,
            "too long to be kept"
        );
        (0..11).for_each(|i| history.note(100 + i, || ()));
        assert_eq!(history.kept, 0, "nor its remainder");
    }
}
