//! Numbers behind figures and tables as comma-separated values: every number to its last digit,
//! empty if not finite.

use touchup_document::figure::{Drawing, Figure};

use super::table::{Table, TableCell};

/// The numbers of a figure, a line for each mark or cell.
pub fn of_figure(figure: &Figure) -> String {
    let (x, y) = (&figure.x.column, &figure.y.column);
    match &figure.drawing {
        Drawing::Curves(series) => {
            let rows = series.iter().flat_map(|series| {
                let cells = |x, y| vec![series.name.as_str().into(), x, y];
                series
                    .marks
                    .iter()
                    .map(move |mark| cells(mark.x.into(), mark.y.into()))
            });
            lines(&[("series", false), (x, true), (y, true)], "_", rows)
        }
        Drawing::Maps { share_of, panels } => {
            let rows = panels.iter().flat_map(|panel| {
                let xs = || panel.xs.iter();
                let places = panel
                    .ys
                    .iter()
                    .flat_map(move |y| xs().map(move |x| [*x, *y]));
                places.zip(&panel.shares).map(|([x, y], share)| {
                    vec![
                        panel.name.as_str().into(),
                        x.into(),
                        y.into(),
                        (*share).into(),
                    ]
                })
            });
            let share = format!("share of {share_of}");
            lines(&["panel", x, y, &share].map(|head| (head, false)), "", rows)
        }
    }
}

/// The cells of a table; a column with spreads has two more behind it.
pub fn of_table(table: &Table) -> String {
    let is_spread = |cell: Option<&TableCell>| matches!(cell, Some(TableCell::Spread(_)));
    let heads = table.heads.iter().enumerate().map(|(column, head)| {
        let has_spread = table.rows.iter().any(|row| is_spread(row.get(column)));
        (head.as_str(), has_spread)
    });
    lines(&heads.collect::<Vec<_>>(), ", ", table.rows.iter().cloned())
}

/// Heads, and a line for each row.
///
/// - `heads`: each with whether it has a spread; `separator` ends the head in its column names.
fn lines(
    heads: &[(&str, bool)],
    separator: &str,
    rows: impl Iterator<Item = Vec<TableCell>>,
) -> String {
    let width = |has_spread: bool| if has_spread { 3 } else { 1 };
    let names = heads.iter().flat_map(|&(head, has_spread)| {
        let ends = ["p10", "p90"].map(|end| format!("{head}{separator}{end}"));
        let names = std::iter::once(head.to_owned()).chain(ends);
        names.take(width(has_spread))
    });
    let mut writer = csv::Writer::from_writer(Vec::new());
    // a vector takes all bytes
    let _ = writer.write_record(names);
    for row in rows {
        let values = row.iter().zip(heads).flat_map(|(cell, (_, has_spread))| {
            let mut values = values(cell);
            values.resize(width(*has_spread), String::new());
            values
        });
        let _ = writer.write_record(values);
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn values(cell: &TableCell) -> Vec<String> {
    match cell {
        TableCell::Text(text) => vec![text.clone()],
        TableCell::Number(value) => vec![number(*value)],
        TableCell::Spread(spread) => spread.numbers().map(number).to_vec(),
        TableCell::Empty => vec![String::new()],
    }
}

fn number(value: f64) -> String {
    if value.is_finite() {
        format!("{value:?}")
    } else {
        String::new()
    }
}
