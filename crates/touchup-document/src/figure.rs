//! Figures as data.

use serde::{Deserialize, Serialize};

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// equal steps are equal differences
    Linear,
    /// equal steps are equal ratios; values must be above 0 to appear
    Log,
}

/// One axis of a figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// quantity and unit for a reader: "time per sample, µs"
    pub label: String,
    /// quantity and unit as a column head: `time_per_sample_us`
    pub column: String,
    /// linear or logarithmic
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

    /// A linear axis.
    pub fn linear(label: &str, column: &str) -> Self {
        Self::of(label, column, Scale::Linear)
    }

    /// A logarithmic axis.
    pub fn log(label: &str, column: &str) -> Self {
        Self::of(label, column, Scale::Log)
    }

    /// Fixed ends, with numbers at both and in the middle.
    #[must_use]
    pub fn within(self, ends: [f64; 2]) -> Self {
        let ends = Some(ends);
        Self { ends, ..self }
    }
}

/// A value with its spread over repeats: median, 10th and 90th percentile. A value without repeats
/// has no spread.
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
    /// Spread of measured values; `None` without values.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)? as f64;
        Some(
            [0.5, 0.1, 0.9]
                .map(|share| values[(last * share).round() as usize])
                .into(),
        )
    }

    /// Scales all three by a nonnegative factor.
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
    /// horizontal
    pub x: Spread,
    /// vertical
    pub y: Spread,
}

impl Mark {
    /// A mark at values with or without a spread.
    pub fn at(x: impl Into<Spread>, y: impl Into<Spread>) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
        }
    }
}

/// Style of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LineStroke {
    /// marks with a connecting line
    Joined,
    /// marks alone
    Marks,
    /// a line without marks, through a large number of values
    Course,
    /// a thin dashed line without marks: a model, a limit
    Dashed,
    /// dots alone: a cloud of a large number of values
    Dots,
    /// a vertical band from the 10th to the 90th percentile
    Band,
}

/// Marks that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// name in the legend and in the CSV
    pub name: String,
    /// style
    pub stroke: LineStroke,
    /// marks in drawing order
    pub marks: Vec<Mark>,
}

impl Series {
    /// Marks joined in their order.
    pub fn joined(name: impl Into<String>, marks: impl IntoIterator<Item = Mark>) -> Self {
        Self::new(name, LineStroke::Joined, marks)
    }

    /// A model or a limit through marks in their order.
    pub fn dashed(name: impl Into<String>, marks: impl IntoIterator<Item = Mark>) -> Self {
        Self::new(name, LineStroke::Dashed, marks)
    }

    /// A series of marks in drawing order.
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

/// One grid of a map: a share of 0 to 1 at each pair of values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Panel {
    /// name above it and in the CSV
    pub name: String,
    /// middles of the columns, in the unit of the axis, rising
    pub xs: Vec<f64>,
    /// middles of the rows, in the unit of the axis, rising
    pub ys: Vec<f64>,
    /// row by row, `ys.len() * xs.len()` of them; `None` without runs
    pub shares: Vec<Option<f64>>,
}

/// Content of a figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drawing {
    /// curves and marks in one frame
    Curves(Vec<Series>),
    /// coloured grids beside each other, with one colour scale
    Maps {
        /// whole of the share: "stable runs"
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
    /// heading
    pub title: String,
    /// text below the figure: content, number of repeats, points of interest
    pub caption: String,
    /// horizontal axis
    pub x: Axis,
    /// vertical axis
    pub y: Axis,
    /// content
    pub drawing: Drawing,
}

impl Figure {
    /// Starts a figure of curves.
    pub fn curves(id: impl Into<String>, series: impl IntoIterator<Item = Series>) -> Self {
        Self::of(id, Drawing::Curves(series.into_iter().collect()))
    }

    /// Starts a figure of any content.
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

    /// Sets the heading.
    #[must_use]
    pub fn title(self, title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..self
        }
    }

    /// Sets the horizontal and the vertical axis.
    #[must_use]
    pub fn axes(self, x: Axis, y: Axis) -> Self {
        Self { x, y, ..self }
    }

    /// Sets the caption.
    #[must_use]
    pub fn caption(self, caption: impl Into<String>) -> Self {
        Self {
            caption: caption.into(),
            ..self
        }
    }
}
