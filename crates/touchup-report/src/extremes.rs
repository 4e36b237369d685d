//! Extreme inputs: the outcome, and the right answer derived independently of the code.

mod case;
mod face;
mod mesh;

use super::{Chapter, Table};
pub use case::Extreme;
use itertools::Itertools;

/// All extremes.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremes {
    /// rows on one face, then on meshes
    pub rows: Vec<Extreme>,
}

/// Feeds all extremes.
pub fn extremes() -> Extremes {
    Extremes {
        rows: [face::rows(), mesh::rows()].concat(),
    }
}

impl Extremes {
    /// Extremes with a wrong answer.
    pub fn wrong(&self) -> impl Iterator<Item = &Extreme> {
        self.rows.iter().filter(|row| !row.is_right)
    }

    /// The table and its text.
    pub fn chapter(&self) -> Chapter {
        let (wrong, all) = (self.wrong().count(), self.rows.len());
        let verdict = match self.wrong().map(|row| &row.fed).join("; ") {
            names if wrong > 0 => {
                format!("MISSED: {wrong} of {all} extremes got a wrong answer: {names}.")
            }
            _ => format!("All {all} extremes got the right answer."),
        };
        Chapter::of("Extremes", vec![verdict], vec![], vec![self.table()])
    }

    /// One line for each extreme.
    pub fn table(&self) -> Table {
        Table::of("extremes", "Extremes", &self.rows)
            .column("fed", |row| row.fed.as_str())
            .column("came out", |row| row.came_out.as_str())
            .column("right answer, and why", |row| row.right_answer.as_str())
            .column("verdict", |row| if row.is_right { "right" } else { "WRONG" })
            .caption(
                "Each answer was checked by the program that made this report. f_max 10 N, h_min 0.5 mm, delta 5, \
                 alpha 0.1 m/(N s) unless stated otherwise; a ball of 1.5 mm on triangles of 2 mm.",
            )
    }
}
