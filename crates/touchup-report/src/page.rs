//! The report as one self-contained page of HTML.

use maud::{Markup, html};
use touchup_document::number::three_digits;
use touchup_document::{ChartSize, Looks, document};

use super::document::Report;
use super::table::{Chapter, Table, TableCell};

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
    let (looks, provenance) = (Looks::of(report.figures()), report.provenance());
    let chapters = || report.chapters.iter().zip(1..);
    let body = html! {
        h1 { "touchup: what it does, how exactly, and what it costs" }
        table.head {
            tr { td { "machine" } td { (report.machine) } }
            tr { td { "commit" } td { code { (report.commit) } } }
            tr { td { "command" } td { code { (report.command) } } }
            tr { td { "date" } td { (report.date) } }
            tr {
                td { "numbers" }
                td { a href="report.json" { "report.json" } ", and a CSV for every figure and table" }
            }
            tr {
                td { "times" }
                td { "median; bars and small numbers are the 10th and 90th percentile of the repeats" }
            }
        }
        h2 id="summary" { "Verdict" }
        div.verdict {
            @if let Some(advice) = &report.advice { (table(advice)) }
            @for paragraph in &report.verdict { p { (paragraph) } }
        }
        h2 { "Contents" }
        ol { @for (chapter, n) in chapters() { li { a href={ "#chapter" (n) } { (chapter.title) } } } }
        @for (chapter, n) in chapters() { (self::chapter(n, chapter, &looks, &provenance)) }
    };
    document("touchup: measured", STYLE, &body)
}

fn chapter(number: i32, chapter: &Chapter, looks: &Looks, provenance: &str) -> Markup {
    html! {
        h2 id={ "chapter" (number) } { (number) ". " (chapter.title) }
        @for paragraph in &chapter.text { p { (paragraph) } }
        @for figure in &chapter.figures {
            figure id=(figure.id) {
                (figure.svg(looks, ChartSize::PAGE, provenance))
                figcaption.caption {
                    (figure.caption) " " (file(&figure.id, "csv")) " " (file(&figure.id, "svg"))
                }
            }
        }
        @for one in &chapter.tables { (table(one)) }
    }
}

fn file(id: &str, ending: &str) -> Markup {
    html! { a href={ (id) "." (ending) } { (id) "." (ending) } }
}

fn table(table: &Table) -> Markup {
    html! {
        h3 id=(table.id) { (table.title) }
        div.wide {
            table.numbers {
                tr { @for head in &table.heads { th { (head) } } }
                @for row in &table.rows { tr { @for one in row { (cell(one)) } } }
            }
        }
        p.caption { (table.caption) " " (file(&table.id, "csv")) }
    }
}

fn cell(cell: &TableCell) -> Markup {
    match cell {
        TableCell::Text(text) => html! { td { (text) } },
        TableCell::Number(value) => html! { td.n { (three_digits(*value)) } },
        TableCell::Spread(spread) => {
            let [median, p10, p90] = spread.numbers().map(three_digits);
            html! { td.n { (median) span.spread { (p10) " – " (p90) } } }
        }
        TableCell::Empty => html! { td {} },
    }
}
