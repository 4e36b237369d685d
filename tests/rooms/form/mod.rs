//! Form of noisy points over many seeds: off by no more and no less than its uncertainty.

mod flat_form;
mod round_form;
