//! Sets of faces, or vertices: one bit for each.

/// Numbers below a limit, each once.
pub(in crate::features) struct NumberSet(Vec<u64>);

impl NumberSet {
    pub(crate) fn below(limit: usize) -> Self {
        Self(vec![0; limit.div_ceil(64)])
    }

    #[inline]
    pub(crate) fn add(&mut self, number: u32) {
        self.0[number as usize / 64] |= 1 << (number % 64);
    }

    /// In ascending order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        let of_word = |(at, &word): (usize, &u64)| {
            let rest = |&word: &u64| Some(word & word.wrapping_sub(1));
            let words = std::iter::successors(Some(word), rest).take_while(|&word| word != 0);
            words.map(move |word| at as u32 * 64 + word.trailing_zeros())
        };
        self.0.iter().enumerate().flat_map(of_word)
    }
}

/// Fewer numbers than the limit divided by this are sorted one by one.
const FEW: usize = 64;

/// Sorts distinct numbers below `limit`.
pub(in crate::features) fn sort(numbers: &mut Vec<u32>, limit: usize) {
    if numbers.len() < limit / FEW {
        return numbers.sort_unstable();
    }
    let mut marks = NumberSet::below(limit);
    numbers.iter().for_each(|&number| marks.add(number));
    numbers.clear();
    numbers.extend(marks.iter());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_numbers_come_out_in_order() {
        for step in [1, 7, 1000] {
            // 1009 is prime: each number once
            let mut numbers: Vec<u32> = (0..1009).map(|i| i * 501 % 1009 * step).collect();
            let mut expected = numbers.clone();
            expected.sort_unstable();
            sort(&mut numbers, 1009 * step as usize);
            assert_eq!(numbers, expected);
        }
    }
}
