//! Tables and chapters of the report, as data.

use serde::Serialize;
use touchup_document::figure::{Figure, Spread};

/// One cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum TableCell {
    /// words
    Text(String),
    /// a number in the unit of its column, shown with three digits
    Number(f64),
    /// a median with its spread
    Spread(Spread),
    /// no content
    Empty,
}

/// Conversions into cells.
macro_rules! cells_of {
    ($($value:ty => $cell:expr,)*) => {$(
        impl From<$value> for TableCell {
            fn from(value: $value) -> Self {
                $cell(value)
            }
        }
    )*};
}

cells_of! {
    &str => |text: &str| Self::Text(text.to_owned()),
    String => Self::Text,
    f64 => Self::Number,
    usize => |count| Self::Number(count as f64),
    Spread => Self::Spread,
}

impl<T: Into<TableCell>> From<Option<T>> for TableCell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, T::into)
    }
}

/// A table with heads that carry their units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// file name of its CSV, without ending
    pub id: String,
    /// heading above the table
    pub title: String,
    /// text below the table
    pub caption: String,
    /// one per column, with the unit: "push, µs"
    pub heads: Vec<String>,
    /// one per line, each as long as `heads`
    pub rows: Vec<Vec<TableCell>>,
}

impl Table {
    /// Starts a table of these rows; columns follow one by one, the caption last.
    pub fn of<R: Copy>(id: &str, title: &str, rows: impl IntoIterator<Item = R>) -> TableOf<R> {
        let [id, title] = [id, title].map(str::to_owned);
        let rows: Vec<R> = rows.into_iter().collect();
        let cells = vec![Vec::new(); rows.len()];
        TableOf {
            rows,
            table: Self {
                id,
                title,
                caption: String::new(),
                heads: Vec::new(),
                rows: cells,
            },
        }
    }
}

/// A table that grows column by column.
pub struct TableOf<R> {
    rows: Vec<R>,
    table: Table,
}

impl<R: Copy> TableOf<R> {
    /// Adds a column: its head with the unit, and its value of each row.
    #[must_use]
    pub fn column<C: Into<TableCell>>(
        mut self,
        head: impl Into<String>,
        cell: impl Fn(R) -> C,
    ) -> Self {
        self.table.heads.push(head.into());
        for (cells, row) in self.table.rows.iter_mut().zip(&self.rows) {
            cells.push(cell(*row).into());
        }
        self
    }

    /// The table with the text below it.
    pub fn caption(self, caption: impl Into<String>) -> Table {
        Table {
            caption: caption.into(),
            ..self.table
        }
    }
}

/// One chapter of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Chapter {
    /// number and name
    pub title: String,
    /// procedure and result, a paragraph each, in plain words
    pub text: Vec<String>,
    /// pictures, in order
    pub figures: Vec<Figure>,
    /// tables, in order
    pub tables: Vec<Table>,
}

impl Chapter {
    /// A chapter of these parts, in order.
    pub fn of(title: &str, text: Vec<String>, figures: Vec<Figure>, tables: Vec<Table>) -> Self {
        Self {
            title: title.to_owned(),
            text,
            figures,
            tables,
        }
    }
}

/// A paragraph for each case that did not run.
pub(crate) fn not_run(reasons: &[String]) -> impl Iterator<Item = String> {
    reasons.iter().map(|reason| format!("Not run: {reason}."))
}
