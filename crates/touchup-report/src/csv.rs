//! The numbers behind figures and tables as comma-separated values: every number to its last digit, nothing where there is none.

use super::figure::{Drawing, Figure, Panel, Series, Spread, Table, TableCell};

/// The numbers of a figure, a line for each mark or cell.
pub fn of_figure(figure: &Figure) -> String {
    let (x, y) = (&figure.x.column, &figure.y.column);
    match &figure.drawing {
        Drawing::Curves(series) => of_curves(series, x, y),
        Drawing::Maps { share_of, panels } => of_maps(panels, x, y, share_of),
    }
}

/// The cells of a table; a column with spreads has two more behind it.
pub fn of_table(table: &Table) -> String {
    let spreads: Vec<bool> = (0..table.heads.len())
        .map(|column| table.rows.iter().any(|row| matches!(row.get(column), Some(TableCell::Spread(_)))))
        .collect();
    let heads = table.heads.iter().zip(&spreads).flat_map(|(head, has_spread)| {
        let more = if *has_spread { vec![format!("{head}, p10"), format!("{head}, p90")] } else { Vec::new() };
        std::iter::once(head.clone()).chain(more)
    });
    let mut lines = line(heads.map(|head| quoted(&head)));
    for row in &table.rows {
        lines += &line(row.iter().zip(&spreads).flat_map(|(cell, has_spread)| values(cell, *has_spread)));
    }
    lines
}

fn of_curves(series: &[Series], x: &str, y: &str) -> String {
    let columns = [x, y].map(|name| [name.to_owned(), format!("{name}_p10"), format!("{name}_p90")]);
    let mut lines = line(std::iter::once("series".to_owned()).chain(columns.into_iter().flatten()));
    for series in series {
        for mark in &series.marks {
            let numbers = [mark.x, mark.y].into_iter().flat_map(Spread::numbers).map(number);
            lines += &line(std::iter::once(quoted(&series.name)).chain(numbers));
        }
    }
    lines
}

fn of_maps(panels: &[Panel], x: &str, y: &str, share_of: &str) -> String {
    let heads = ["panel", x, y, &format!("share of {share_of}")].map(quoted);
    let mut lines = line(heads);
    for panel in panels {
        let cells = panel.ys.iter().flat_map(|y| panel.xs.iter().map(move |x| (x, y)));
        for ((x, y), share) in cells.zip(&panel.shares) {
            let share = share.map(number).unwrap_or_default();
            lines += &line([quoted(&panel.name), number(*x), number(*y), share]);
        }
    }
    lines
}

fn values(cell: &TableCell, has_spread: bool) -> Vec<String> {
    let mut values = match cell {
        TableCell::Text(text) => vec![quoted(text)],
        TableCell::Number(value) => vec![number(*value)],
        TableCell::Spread(spread) => spread.numbers().map(number).to_vec(),
        TableCell::Empty => vec![String::new()],
    };
    values.resize(if has_spread { 3 } else { 1 }, String::new());
    values
}

/// To the last digit; empty where it is none.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}

fn quoted(text: &str) -> String {
    let needs_quotes = text.contains([',', '"', '\n', '\r']);
    if needs_quotes { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn line(values: impl IntoIterator<Item = String>) -> String {
    values.into_iter().collect::<Vec<_>>().join(",") + "\n"
}
