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
use touchup_report::{Table, TableCell};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[path = "../../../../tests/common/full.rs"]
mod full;

/// A table in the form of Markdown, with this many digits after the point.
fn markdown(table: &Table, digits: usize) -> String {
    let in_words = |cell: &TableCell| match cell {
        TableCell::Text(text) => text.clone(),
        TableCell::Number(number) => format!("{number:.digits$}"),
        TableCell::Spread(spread) => format!("{:.digits$}", spread.median),
        TableCell::Empty => String::new(),
    };
    let rows = table
        .rows
        .iter()
        .map(|row| row.iter().map(in_words).collect());
    let rule = vec!["---".to_owned(); table.heads.len()];
    [table.heads.clone(), rule]
        .into_iter()
        .chain(rows)
        .map(|cells: Vec<String>| format!("| {} |\n", cells.join(" | ")))
        .collect()
}
