//! Sets: distinct things, connected things, disjoint sets of numbers (union–find).

/// Distinct things in rising order.
pub fn distinct<T: Ord>(things: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut distinct: Vec<T> = things.into_iter().collect();
    distinct.sort_unstable();
    distinct.dedup();
    distinct
}

/// Things in their order, without repeats of earlier ones.
pub fn without_repeats<T>(
    things: impl IntoIterator<Item = T>,
    is_same: impl Fn(&T, &T) -> bool,
) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for thing in things {
        if !kept.iter().any(|before| is_same(before, &thing)) {
            kept.push(thing);
        }
    }
    kept
}

/// `found`, then everything connected to it, the nearest first.
///
/// - `beside`: neighbours of one; `takes`: whether a neighbour belongs to them and is new.
pub fn flood<T: Copy, Beside: IntoIterator<Item = T>>(
    mut found: Vec<T>,
    beside: impl Fn(T) -> Beside,
    mut takes: impl FnMut(T) -> bool,
) -> Vec<T> {
    let mut at = 0;
    while let Some(&here) = found.get(at) {
        found.extend(beside(here).into_iter().filter(|&other| takes(other)));
        at += 1;
    }
    found
}

/// Sets of the numbers below a limit, at first one each. The lowest number of a set is its root.
#[derive(Clone, Debug)]
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// `count` sets of one number each.
    pub fn of(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Root of the set of a number; halves the path on the way.
    pub fn root(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            let above = self.0[self.0[number as usize] as usize];
            self.0[number as usize] = above;
            number = above;
        }
        number
    }

    /// Unites the sets of two numbers.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_a_line_ends_where_it_is_cut_and_comes_to_each_number_once() {
        let mut seen = [3].into_iter().collect::<std::collections::HashSet<i32>>();
        let found = flood(
            vec![3],
            |at| [at - 1, at + 1],
            |other| (1..6).contains(&other) && seen.insert(other),
        );
        assert_eq!(found, [3, 2, 4, 1, 5]);
        assert_eq!(distinct([3, 1, 3, 2, 1]), [1, 2, 3]);
        assert_eq!(
            without_repeats([3, 1, -3, 2, -1], |a: &i32, b| a.abs() == b.abs()),
            [3, 1, 2]
        );
    }

    #[test]
    fn numbers_that_leave_the_same_rest_end_in_one_set_named_by_the_rest() {
        let mut sets = DisjointSets::of(30);
        (0..27)
            .rev()
            .for_each(|number| sets.join(number + 3, number));
        assert!((0..30).all(|number| sets.root(number) == number % 3));
    }
}
