//! What a report shows: figures and tables, as data. How they look is the matter of [`super::plot`] and [`super::page`].

use serde::Serialize;

/// How an axis is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// equal steps are equal differences
    Linear,
    /// equal steps are equal ratios; values that are not above 0 are not shown
    Log,
}

/// One axis of a figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// quantity and unit, as a person reads them: "time per sample, µs"
    pub label: String,
    /// the same as the head of a column: `time_per_sample_us`
    pub column: String,
    /// how it is divided
    pub scale: Scale,
}

impl Axis {
    /// An axis of equal differences.
    pub fn linear(label: &str, column: &str) -> Self {
        Self { label: label.to_owned(), column: column.to_owned(), scale: Scale::Linear }
    }

    /// An axis of equal ratios.
    pub fn log(label: &str, column: &str) -> Self {
        Self { label: label.to_owned(), column: column.to_owned(), scale: Scale::Log }
    }
}

/// A value with its spread over repeats: the median, and a tenth of the repeats on either side. One that was not repeated has
/// none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// median, or the only value
    pub median: f64,
    /// 10th percentile
    pub p10: f64,
    /// 90th percentile
    pub p90: f64,
}

impl Spread {
    /// Of values that were measured; `None` where there are none.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get(((values.len().checked_sub(1)?) as f64 * share).round() as usize).copied();
        Some(Self { median: at(0.5)?, p10: at(0.1)?, p90: at(0.9)? })
    }

    /// All three times a factor that is not negative.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { median: self.median * factor, p10: self.p10 * factor, p90: self.p90 * factor }
    }
}

impl From<f64> for Spread {
    fn from(value: f64) -> Self {
        Self { median: value, p10: value, p90: value }
    }
}

/// One point of a series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// to the right
    pub x: Spread,
    /// upward
    pub y: Spread,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LineStroke {
    /// marks, joined by a line
    Joined,
    /// marks alone
    Marks,
    /// a thin dashed line without marks: a model, a limit
    Dashed,
}

/// Marks that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// in the legend, and in the CSV
    pub name: String,
    /// how it is drawn
    pub stroke: LineStroke,
    /// in the order in which they are joined
    pub marks: Vec<Mark>,
}

/// One cell grid of a map: a share of 0 to 1 at each pair of values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Panel {
    /// above it, and in the CSV
    pub name: String,
    /// middles of the columns, in the unit of the axis, rising
    pub xs: Vec<f64>,
    /// middles of the rows, in the unit of the axis, rising
    pub ys: Vec<f64>,
    /// row by row, `ys.len() * xs.len()` of them; `None` where nothing was run
    pub shares: Vec<Option<f64>>,
}

/// What a figure draws.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drawing {
    /// curves and marks in one frame
    Curves(Vec<Series>),
    /// coloured grids beside each other, with one scale of colours
    Maps {
        /// what the share is of: "stable runs"
        share_of: String,
        /// at least one
        panels: Vec<Panel>,
    },
}

/// A picture with the numbers behind it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// file name of its SVG and CSV, without ending: `work_precision_stiff`
    pub id: String,
    /// above it
    pub title: String,
    /// below it: what is shown, how many repeats, what to look at
    pub caption: String,
    /// to the right
    pub x: Axis,
    /// upward
    pub y: Axis,
    /// what is drawn
    pub drawing: Drawing,
}

/// One cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum TableCell {
    /// words
    Text(String),
    /// a number in the unit of its column, shown with three digits
    Number(f64),
    /// the median is shown, with its spread
    Spread(Spread),
    /// nothing to say
    Empty,
}

impl From<&str> for TableCell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for TableCell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for TableCell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<Spread> for TableCell {
    fn from(spread: Spread) -> Self {
        Self::Spread(spread)
    }
}

/// A table with heads that carry their units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// file name of its CSV, without ending
    pub id: String,
    /// above it
    pub title: String,
    /// below it
    pub caption: String,
    /// one a column, with the unit: "push, µs"
    pub heads: Vec<String>,
    /// one a line, each as long as `heads`
    pub rows: Vec<Vec<TableCell>>,
}

/// One part of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Chapter {
    /// its number and name
    pub title: String,
    /// what was done and what it says, a paragraph each, in plain words
    pub text: Vec<String>,
    /// pictures, in order
    pub figures: Vec<Figure>,
    /// tables, in order
    pub tables: Vec<Table>,
}
