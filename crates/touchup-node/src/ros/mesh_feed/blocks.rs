//! Values by id in blocks: versions share the blocks that are equal.

use std::sync::Arc;

/// Number of values in a block: 10 kB of vertices.
const OF_A_BLOCK: usize = 256;

/// Values by id. A copy shares all blocks, and a change copies only its block. Blocks without any
/// change are absent.
#[derive(Clone, Debug)]
pub(super) struct Blocks<T>(Vec<Option<Arc<[T; OF_A_BLOCK]>>>);

impl<T: Copy> Blocks<T> {
    /// Without any change.
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// The value of an id; `None` in a block without any change.
    pub fn get(&self, id: u32) -> Option<T> {
        let block = self.0.get(id as usize / OF_A_BLOCK)?.as_ref()?;
        Some(block[id as usize % OF_A_BLOCK])
    }

    /// The value of an id, for a change.
    ///
    /// - `initial`: the values of a block without any change.
    pub fn get_mut(&mut self, id: u32, initial: impl Fn(u32) -> T) -> &mut T {
        let at = id as usize / OF_A_BLOCK;
        if at >= self.0.len() {
            self.0.resize(at + 1, None);
        }
        let first = (at * OF_A_BLOCK) as u32;
        let block = self.0[at].get_or_insert_with(|| {
            Arc::new(std::array::from_fn(|within| initial(first + within as u32)))
        });
        &mut Arc::make_mut(block)[id as usize % OF_A_BLOCK]
    }

    /// Ids and values of all blocks with changes.
    pub fn changed(&self) -> impl Iterator<Item = (u32, T)> + '_ {
        let blocks = (0u32..).step_by(OF_A_BLOCK).zip(&self.0);
        let blocks = blocks.filter_map(|(first, block)| Some((first, block.as_deref()?)));
        blocks.flat_map(|(first, block)| (first..).zip(block.iter().copied()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_copies_its_block_alone_and_no_earlier_copy() {
        let double = |id| 2 * id;
        let mut values = Blocks::new();
        for id in [3, 700, 701] {
            *values.get_mut(id, double) += 1;
        }
        let before = values.clone();
        *values.get_mut(700, double) = 0;
        let of = |values: &Blocks<u32>| [3, 4, 256, 700, 701, 5000].map(|id| values.get(id));
        let [three, four, last] = [Some(7), Some(8), Some(1403)];
        assert_eq!(of(&before), [three, four, None, Some(1401), last, None]);
        assert_eq!(of(&values), [three, four, None, Some(0), last, None]);
        let is_shared = |at: usize| match [&before.0[at], &values.0[at]] {
            [Some(before), Some(now)] => Some(Arc::ptr_eq(before, now)),
            _ => None,
        };
        assert_eq!([0, 1, 2].map(is_shared), [Some(true), None, Some(false)]);
        let ids: Vec<u32> = values.changed().map(|(id, _)| id).collect();
        assert_eq!(ids, (0..256).chain(512..768).collect::<Vec<_>>());
        assert!(
            before
                .changed()
                .all(|(id, value)| Some(value) == before.get(id))
        );
    }
}
