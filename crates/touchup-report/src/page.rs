//! The report as one self-contained page of HTML.

use super::document::Report;
use super::figure::{Chapter, Figure, Spread, Table, TableCell};
use super::number::three_digits;
use super::plot::{Looks, escaped, svg};

const STYLE: &str = "\
body{font:16px/1.55 system-ui,'DejaVu Sans',Arial,sans-serif;color:#222;background:#fff;max-width:900px;margin:2em auto;\
padding:0 1em}
h1{font-size:1.7em;margin-bottom:.2em}h2{font-size:1.3em;margin-top:2.4em;border-bottom:1px solid #ccc}
h3{font-size:1.05em;margin:2em 0 .4em}
.head{color:#555;font-size:.9em;border-collapse:collapse}.head td{padding:0 1em 0 0;vertical-align:top}
.head code{overflow-wrap:anywhere}
.verdict{background:#f3f7fb;border-left:4px solid #0072b2;padding:.4em 1.2em}
figure{margin:2em 0}figure svg{max-width:100%;height:auto;border:1px solid #e2e2e2}
.caption{font-size:.88em;color:#444;margin:.3em 0 0}
.wide{overflow-x:auto}table.numbers{border-collapse:collapse;font-size:.86em;font-variant-numeric:tabular-nums}
.numbers th,.numbers td{padding:.25em .7em;border-bottom:1px solid #e2e2e2;text-align:left;vertical-align:top}
.numbers th{border-bottom:2px solid #888}.numbers td.n{text-align:right;white-space:nowrap}
.spread{color:#777;font-size:.88em;display:block}";

/// Head, verdict, contents, chapters.
pub(super) fn html(report: &Report) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>touchup: measured</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n\
         <h1>touchup: what it does, how exactly, and what it costs</h1>\n"
    );
    page += &head(report);
    let advice = report.advice.as_ref().map_or_else(String::new, table);
    let verdict = text(&report.verdict);
    page += &format!(
        "<h2 id=\"summary\">Verdict</h2>\n<div class=\"verdict\">\n{advice}{verdict}</div>\n"
    );
    page += &contents(&report.chapters);
    let (looks, provenance) = (report.looks(), report.provenance());
    for (number, chapter) in report.chapters.iter().enumerate() {
        page += &self::chapter(number, chapter, &looks, &provenance);
    }
    page + "</body>\n</html>\n"
}

fn head(report: &Report) -> String {
    let lines = [
        ("machine", escaped(&report.machine)),
        (
            "commit",
            format!("<code>{}</code>", escaped(&report.commit)),
        ),
        (
            "command",
            format!("<code>{}</code>", escaped(&report.command)),
        ),
        ("date", escaped(&report.date)),
        (
            "numbers",
            "<a href=\"report.json\">report.json</a>, and a CSV for every figure and table"
                .to_owned(),
        ),
        (
            "times",
            "median; bars and small numbers are the 10th and 90th percentile of the repeats"
                .to_owned(),
        ),
    ];
    let lines = lines.map(|(name, value)| format!("<tr><td>{name}</td><td>{value}</td></tr>\n"));
    format!("<table class=\"head\">\n{}</table>\n", lines.concat())
}

fn contents(chapters: &[Chapter]) -> String {
    let line = |(number, chapter): (usize, &Chapter)| {
        format!(
            "<li><a href=\"#{}\">{}</a></li>\n",
            anchor(number),
            escaped(&chapter.title)
        )
    };
    let lines: String = chapters.iter().enumerate().map(line).collect();
    format!("<h2>Contents</h2>\n<ol>\n{lines}</ol>\n")
}

fn anchor(number: usize) -> String {
    format!("chapter{}", number + 1)
}

fn chapter(number: usize, chapter: &Chapter, looks: &Looks, provenance: &str) -> String {
    let title = format!(
        "<h2 id=\"{}\">{}. {}</h2>\n",
        anchor(number),
        number + 1,
        escaped(&chapter.title)
    );
    let figures: String = chapter
        .figures
        .iter()
        .map(|figure| self::figure(figure, looks, provenance))
        .collect();
    let tables: String = chapter.tables.iter().map(table).collect();
    title + &text(&chapter.text) + &figures + &tables
}

fn text(paragraphs: &[String]) -> String {
    paragraphs
        .iter()
        .map(|paragraph| format!("<p>{}</p>\n", escaped(paragraph)))
        .collect()
}

fn figure(figure: &Figure, looks: &Looks, provenance: &str) -> String {
    let (id, caption) = (&figure.id, escaped(&figure.caption));
    format!(
        "<figure id=\"{id}\">\n{}<figcaption class=\"caption\">{caption} <a href=\"{id}.csv\">{id}.csv</a> \
         <a href=\"{id}.svg\">{id}.svg</a></figcaption>\n</figure>\n",
        svg(figure, looks, provenance)
    )
}

fn table(table: &Table) -> String {
    let (id, title, caption) = (&table.id, escaped(&table.title), escaped(&table.caption));
    let heads: String = table
        .heads
        .iter()
        .map(|head| format!("<th>{}</th>", escaped(head)))
        .collect();
    let row =
        |row: &Vec<TableCell>| format!("<tr>{}</tr>\n", row.iter().map(cell).collect::<String>());
    let rows: String = table.rows.iter().map(row).collect();
    format!(
        "<h3 id=\"{id}\">{title}</h3>\n<div class=\"wide\"><table class=\"numbers\">\n<tr>{heads}</tr>\n{rows}</table></div>\n\
         <p class=\"caption\">{caption} <a href=\"{id}.csv\">{id}.csv</a></p>\n"
    )
}

fn cell(cell: &TableCell) -> String {
    match cell {
        TableCell::Text(text) => format!("<td>{}</td>", escaped(text)),
        TableCell::Number(value) => format!("<td class=\"n\">{}</td>", three_digits(*value)),
        TableCell::Spread(Spread { median, p10, p90 }) => {
            let ends = format!("{} – {}", three_digits(*p10), three_digits(*p90));
            format!(
                "<td class=\"n\">{}<span class=\"spread\">{ends}</span></td>",
                three_digits(*median)
            )
        }
        TableCell::Empty => "<td></td>".to_owned(),
    }
}
