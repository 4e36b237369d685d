//! Extreme inputs: the outcome, and the right answer derived independently of the code.

mod face;
mod mesh;

use std::fmt::Display;

use super::{Chapter, Table};

/// One extreme.
#[derive(Clone, Debug, PartialEq)]
pub struct Extreme {
    /// the input
    pub fed: String,
    /// the outcome
    pub came_out: String,
    /// the right answer, and why
    pub right_answer: String,
    /// whether the outcome is the right answer
    pub is_right: bool,
}

/// All of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremes {
    /// on one face, then on meshes
    pub rows: Vec<Extreme>,
}

/// The outcome in words, and whether it is right; an error where none would be.
type CaseOutcome<E> = Result<(String, bool), E>;

fn extreme<E: Display>(fed: &str, right_answer: &str, outcome: CaseOutcome<E>) -> Extreme {
    let (came_out, is_right) = outcome.unwrap_or_else(|error| (format!("refused: {error}"), false));
    Extreme { fed: fed.to_owned(), came_out, right_answer: right_answer.to_owned(), is_right }
}

/// What should be refused with a certain error.
fn refused<T, E: Display>(result: Result<T, E>, is_right: impl Fn(&E) -> bool) -> CaseOutcome<E> {
    Ok(result.map_or_else(|error| (format!("refused: {error}"), is_right(&error)), |_| ("taken".to_owned(), false)))
}

/// Feeds all extremes.
pub fn extremes() -> Extremes {
    Extremes { rows: [face::rows(), mesh::rows()].concat() }
}

impl Extremes {
    /// Those with a wrong answer.
    pub fn wrong(&self) -> impl Iterator<Item = &Extreme> {
        self.rows.iter().filter(|row| !row.is_right)
    }

    /// The table and its text.
    pub fn chapter(&self) -> Chapter {
        let wrong: Vec<&str> = self.wrong().map(|row| row.fed.as_str()).collect();
        let verdict = if wrong.is_empty() {
            format!("All {} extremes got the right answer.", self.rows.len())
        } else {
            format!("MISSED: {} of {} extremes got a wrong answer: {}.", wrong.len(), self.rows.len(), wrong.join("; "))
        };
        Chapter { title: "Extremes".to_owned(), text: vec![verdict], figures: vec![], tables: vec![self.table()] }
    }

    /// One line for each.
    pub fn table(&self) -> Table {
        Table::of(
            "extremes",
            "Extremes",
            "Each answer was checked by the program that made this report. f_max 10 N, h_min 0.5 mm, delta 5, alpha 0.1 m/(N s) unless \
             stated otherwise; a ball of 1.5 mm on triangles of 2 mm.",
            &self.rows,
        )
        .column("fed", |row| row.fed.as_str())
        .column("came out", |row| row.came_out.as_str())
        .column("right answer, and why", |row| row.right_answer.as_str())
        .column("verdict", |row| if row.is_right { "right" } else { "WRONG" })
        .table
    }
}
