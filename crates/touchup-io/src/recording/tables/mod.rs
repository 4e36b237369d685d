//! Recordings as tables of numbers.

pub mod columns;
pub mod number_table;
pub mod units;
