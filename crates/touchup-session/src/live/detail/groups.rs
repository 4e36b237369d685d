//! Ids by group.

/// Ids by group, contiguous per group.
#[derive(Debug)]
pub(super) struct Groups {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl Groups {
    /// - `group_of`: the group of each id below `count`, if any.
    pub fn new(groups: usize, count: usize, group_of: impl Fn(u32) -> Option<u32>) -> Self {
        let mut starts = vec![0u32; groups + 1];
        (0..count as u32)
            .filter_map(&group_of)
            .for_each(|group| starts[group as usize + 1] += 1);
        (0..groups).for_each(|group| starts[group + 1] += starts[group]);
        let (mut next, mut ids) = (starts.clone(), vec![0; starts[groups] as usize]);
        for id in 0..count as u32 {
            if let Some(group) = group_of(id) {
                ids[next[group as usize] as usize] = id;
                next[group as usize] += 1;
            }
        }
        Self { starts, ids }
    }

    pub fn of(&self, group: u32) -> &[u32] {
        &self.ids[self.starts[group as usize] as usize..self.starts[group as usize + 1] as usize]
    }
}
