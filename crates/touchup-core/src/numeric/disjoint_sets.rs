//! Disjoint sets of numbers (union–find).

/// Sets of the numbers below a limit, each number at first alone. The lowest number of a set is its root.
#[derive(Clone, Debug)]
pub(crate) struct DisjointSets(Vec<u32>);

impl DisjointSets {
    pub fn of(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The number that names the set of another; halves the path as it goes.
    pub fn root(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            let above = self.0[self.0[number as usize] as usize];
            self.0[number as usize] = above;
            number = above;
        }
        number
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_leave_the_same_rest_end_in_one_set_named_by_the_rest() {
        let mut sets = DisjointSets::of(30);
        (0..27).rev().for_each(|number| sets.join(number + 3, number));
        assert!((0..30).all(|number| sets.root(number) == number % 3));
    }
}
