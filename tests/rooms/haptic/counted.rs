//! Drawn cases that are counted by what they could show, so that a property cannot hold vacuously.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// What one drawn case could show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// a number that another one would not pass for
    Value,
    /// nothing but that it is no nonsense: what happens is below a rounding of what it happens to,
    /// or beyond the largest number
    Little,
    /// it was refused, and a predicate of the test allowed that
    Refused,
}

/// How many cases showed what.
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

/// Tries a property, which panics where it does not hold, on `cases` cases; prints and returns what
/// they showed.
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
