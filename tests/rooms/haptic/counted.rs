//! Counts of random cases by their result, so that a property cannot hold vacuously.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// Result of one random case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// a number that another one would not pass for
    Value,
    /// no nonsense, and no more: the effect is below a rounding of its operand, or beyond the
    /// largest number
    Little,
    /// the code refused it, and a predicate of the test allowed that
    Refused,
}

/// Number of cases for each result.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub values: u32,
    pub little: u32,
    pub refused: u32,
}

impl Counts {
    fn add(mut self, shown: Shown) -> Self {
        match shown {
            Shown::Value => self.values += 1,
            Shown::Little => self.little += 1,
            Shown::Refused => self.refused += 1,
        }
        self
    }
}

/// Tries a property, which panics if it fails, on `cases` cases; prints and returns the counts of
/// their results.
#[track_caller]
pub fn tried<S: Strategy>(
    name: &str,
    cases: u32,
    strategy: S,
    property: impl Fn(S::Value) -> Shown,
) -> Counts
where
    S::Value: Clone,
{
    let counts = Cell::new(Counts::default());
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let outcome = TestRunner::new(config).run(&strategy, |case| {
        counts.set(counts.get().add(property(case)));
        Ok(())
    });
    if let Err(failure) = outcome {
        panic!("{name}: {failure}");
    }
    println!("{name}: {:?}", counts.get());
    counts.get()
}
