//! The report from outside: its chapters, its page, and the program.

mod command;
mod cost;
mod coverage;
mod extremes;
mod mistakes;
mod page;
mod stability;
mod whole_scan;
mod work_precision;

use touchup_report::allocations::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[path = "../../../../tests/common/full.rs"]
mod full;
