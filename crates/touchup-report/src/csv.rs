//! The numbers behind figures and tables as comma-separated values: every number to its last digit,
//! nothing where there is none.

use super::figure::{Drawing, Figure, Table, TableCell};

/// Columns of a head: of a number or words, and of a spread.
const ALONE: usize = 1;
const WITH_SPREAD: usize = 3;

/// The numbers of a figure, a line for each mark or cell.
pub fn of_figure(figure: &Figure) -> String {
    let (x, y) = (&figure.x.column, &figure.y.column);
    match &figure.drawing {
        Drawing::Curves(series) => {
            let marks = series
                .iter()
                .flat_map(|series| series.marks.iter().map(move |mark| (&series.name, mark)));
            let rows =
                marks.map(|(name, mark)| vec![name.as_str().into(), mark.x.into(), mark.y.into()]);
            lines(
                &[("series", ALONE), (x, WITH_SPREAD), (y, WITH_SPREAD)],
                "_",
                rows,
            )
        }
        Drawing::Maps { share_of, panels } => {
            let rows = panels.iter().flat_map(|panel| {
                let cells = panel
                    .ys
                    .iter()
                    .flat_map(|y| panel.xs.iter().map(move |x| [*x, *y]))
                    .zip(&panel.shares);
                cells.map(|([x, y], share)| {
                    vec![
                        panel.name.as_str().into(),
                        x.into(),
                        y.into(),
                        (*share).into(),
                    ]
                })
            });
            lines(
                &["panel", x, y, &format!("share of {share_of}")].map(|head| (head, ALONE)),
                "",
                rows,
            )
        }
    }
}

/// The cells of a table; a column with spreads has two more behind it.
pub fn of_table(table: &Table) -> String {
    let heads = table.heads.iter().enumerate().map(|(column, head)| {
        let has_spread = table
            .rows
            .iter()
            .any(|row| matches!(row.get(column), Some(TableCell::Spread(_))));
        (head.as_str(), if has_spread { WITH_SPREAD } else { ALONE })
    });
    lines(&heads.collect::<Vec<_>>(), ", ", table.rows.iter().cloned())
}

/// Heads, and a line for each row.
///
/// - `heads`: each with how many columns it has; those of a spread are named after it and
///   `separator`.
fn lines(
    heads: &[(&str, usize)],
    separator: &str,
    rows: impl Iterator<Item = Vec<TableCell>>,
) -> String {
    let names = heads.iter().flat_map(|&(head, columns)| {
        let names = [
            head.to_owned(),
            format!("{head}{separator}p10"),
            format!("{head}{separator}p90"),
        ];
        names.map(|name| quoted(&name)).into_iter().take(columns)
    });
    let cells = rows.map(|row| {
        line(
            row.iter()
                .zip(heads)
                .flat_map(|(cell, (_, columns))| values(cell, *columns)),
        )
    });
    line(names) + &cells.collect::<String>()
}

fn values(cell: &TableCell, columns: usize) -> Vec<String> {
    let mut values = match cell {
        TableCell::Text(text) => vec![quoted(text)],
        TableCell::Number(value) => vec![number(*value)],
        TableCell::Spread(spread) => spread.numbers().map(number).to_vec(),
        TableCell::Empty => vec![String::new()],
    };
    values.resize(columns, String::new());
    values
}

/// To the last digit; empty where it is none.
fn number(value: f64) -> String {
    if value.is_finite() {
        format!("{value:?}")
    } else {
        String::new()
    }
}

fn quoted(text: &str) -> String {
    let needs_quotes = text.contains([',', '"', '\n', '\r']);
    if needs_quotes {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn line(values: impl IntoIterator<Item = String>) -> String {
    values.into_iter().collect::<Vec<_>>().join(",") + "\n"
}
