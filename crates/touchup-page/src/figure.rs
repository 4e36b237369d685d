//! Figures as data.

use serde::{Deserialize, Serialize};

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
    /// its ends; `None`: around the marks
    #[serde(skip)]
    pub ends: Option<[f64; 2]>,
}

impl Axis {
    fn of(label: &str, column: &str, scale: Scale) -> Self {
        let [label, column] = [label, column].map(str::to_owned);
        let ends = None;
        Self {
            label,
            column,
            scale,
            ends,
        }
    }

    /// An axis of equal differences.
    pub fn linear(label: &str, column: &str) -> Self {
        Self::of(label, column, Scale::Linear)
    }

    /// An axis of equal ratios.
    pub fn log(label: &str, column: &str) -> Self {
        Self::of(label, column, Scale::Log)
    }

    /// From one value to another, with numbers at both and in the middle.
    #[must_use]
    pub fn within(self, ends: [f64; 2]) -> Self {
        let ends = Some(ends);
        Self { ends, ..self }
    }
}

/// A value with its spread over repeats: the median, and a tenth of the repeats on either side. One
/// that was not repeated has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
        let last = values.len().checked_sub(1)? as f64;
        Some(
            [0.5, 0.1, 0.9]
                .map(|share| values[(last * share).round() as usize])
                .into(),
        )
    }

    /// All three times a factor that is not negative.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        self.numbers().map(|value| value * factor).into()
    }

    /// Median, 10th and 90th percentile.
    pub fn numbers(self) -> [f64; 3] {
        [self.median, self.p10, self.p90]
    }
}

impl From<[f64; 3]> for Spread {
    fn from([median, p10, p90]: [f64; 3]) -> Self {
        Self { median, p10, p90 }
    }
}

impl From<f64> for Spread {
    fn from(value: f64) -> Self {
        [value; 3].into()
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

impl Mark {
    /// At values with a spread or without.
    pub fn at(x: impl Into<Spread>, y: impl Into<Spread>) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LineStroke {
    /// marks, joined by a line
    Joined,
    /// marks alone
    Marks,
    /// a line without marks: a course of many values
    Course,
    /// a thin dashed line without marks: a model, a limit
    Dashed,
    /// dots alone: a cloud of many values
    Dots,
    /// a field from the 10th to the 90th percentile upward
    Band,
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

impl Series {
    /// Marks that a line joins in their order.
    pub fn joined(name: impl Into<String>, marks: impl IntoIterator<Item = Mark>) -> Self {
        Self::new(name, LineStroke::Joined, marks)
    }

    /// A model or a limit through marks in their order.
    pub fn dashed(name: impl Into<String>, marks: impl IntoIterator<Item = Mark>) -> Self {
        Self::new(name, LineStroke::Dashed, marks)
    }

    /// Of marks in the order in which they are joined.
    pub fn new(
        name: impl Into<String>,
        stroke: LineStroke,
        marks: impl IntoIterator<Item = Mark>,
    ) -> Self {
        Self {
            name: name.into(),
            stroke,
            marks: marks.into_iter().collect(),
        }
    }
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

impl Figure {
    /// Begins one with curves.
    pub fn curves(id: impl Into<String>, series: impl IntoIterator<Item = Series>) -> Self {
        Self::of(id, Drawing::Curves(series.into_iter().collect()))
    }

    /// Begins one with its drawing.
    pub fn of(id: impl Into<String>, drawing: Drawing) -> Self {
        Self {
            id: id.into(),
            title: String::new(),
            caption: String::new(),
            x: Axis::linear("", ""),
            y: Axis::linear("", ""),
            drawing,
        }
    }

    /// Above it.
    #[must_use]
    pub fn title(self, title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..self
        }
    }

    /// What is to the right, and what is upward.
    #[must_use]
    pub fn axes(self, x: Axis, y: Axis) -> Self {
        Self { x, y, ..self }
    }

    /// Below it.
    #[must_use]
    pub fn caption(self, caption: impl Into<String>) -> Self {
        Self {
            caption: caption.into(),
            ..self
        }
    }
}
