//! The page: one file of HTML without scripts, which asks for nothing outside of it.

use std::io;

use super::report::{MovedVertices, WhatIfReport};
use crate::compare::{Displacement, PartView, PicturePanel, PictureParams, Rgb, draw_part};
use crate::html::{base64, escaped, table};
use crate::io::png::png_bytes;
use crate::mesh::TriMesh;
use crate::sweep::{COVERAGE as K, FeatureChange, JobResult, NumberChange, WhatIf};

/// Of a picture, pixels.
const WIDTH: u32 = 1000;
/// What did not move.
const STILL: Rgb = [222, 225, 230];
/// Where the colours change, in ±; each with that of what went inwards and of what came outwards.
/// The colour-blind tell them apart.
const STEPS: [(f64, Rgb, Rgb); 3] = [
    (1.0, [146, 190, 224], [247, 186, 142]),
    (2.0, [64, 122, 188], [224, 112, 70]),
    (4.0, [18, 44, 108], [146, 22, 36]),
];

/// The colour of a place.
pub(super) fn colour_at(one: &Displacement) -> Rgb {
    let known = one.plus_minus(K);
    let ratio = if known > 0.0 {
        one.distance.abs() / known
    } else {
        f64::INFINITY
    };
    let step = STEPS
        .iter()
        .rev()
        .find(|(from, ..)| one.is_moved(K) && ratio > *from);
    step.map_or(STILL, |(_, inwards, outwards)| {
        if one.distance < 0.0 {
            *inwards
        } else {
            *outwards
        }
    })
}

/// The whole page.
pub(super) fn page(
    report: &WhatIfReport,
    [a, b]: [&JobResult; 2],
    found: &WhatIf,
) -> io::Result<String> {
    let mut pictures = figure("A", &a.mesh, &found.of_a, &report.vertices_a, report)?;
    if let (Some(of_b), Some(vertices)) = (&found.of_b, &report.vertices_b) {
        pictures += &figure("B", &b.mesh, of_b, vertices, report)?;
    }
    let title = title(report);
    let body = [
        format!("<h1>{}</h1>\n", escaped(&title)),
        verdict(report),
        keys(report),
        format!(
            "<h2>Where the surface moved</h2>\n{}<div class=\"pictures\">\n{pictures}</div>\n",
            legend()
        ),
        features(report),
        how(report),
    ];
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{}</title>\n<style>\n{CSS}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
        escaped(&title),
        body.concat()
    ))
}

fn shown(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Null => "left out".to_owned(),
        serde_json::Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A question where one key differs.
fn title(report: &WhatIfReport) -> String {
    let mut keys = report.keys.iter();
    match (keys.next(), keys.next()) {
        (Some((key, [a, b])), None) => {
            format!("What if {key} is {} instead of {}?", shown(b), shown(a))
        }
        (None, _) => "Two results of the same inputs".to_owned(),
        _ => format!("What if {} inputs change?", report.keys.len()),
    }
}

fn verdict(report: &WhatIfReport) -> String {
    let shown = report.vertices_b.as_ref().unwrap_or(&report.vertices_a);
    let share = 100.0 * shown.moved as f64 / shown.vertices.max(1) as f64;
    let farthest = shown
        .farthest_mm
        .map_or("no vertex moves".to_owned(), |mm| {
            format!("the farthest moves by {} mm", signed(mm))
        });
    let alone = report
        .features
        .iter()
        .filter(|one| one.id_a.is_none() || one.id_b.is_none())
        .count();
    let tile =
        |number: String, what: String| format!("<div><b>{number}</b><span>{what}</span></div>\n");
    let tiles = [
        tile(
            format!("{:.1} %", share),
            format!(
                "of the vertices move by more than their ±: {} of {}",
                shown.moved, shown.vertices
            ),
        ),
        tile(
            shown
                .farthest_mm
                .map_or("–".to_owned(), |mm| format!("{} mm", signed(mm))),
            shown.farthest_plus_minus_mm.map_or(farthest, |known| {
                format!("is the largest displacement, known to ± {known:.3} mm")
            }),
        ),
        tile(
            format!(
                "{} of {}",
                report.features_moved - alone,
                report.features.len()
            ),
            "features have a number that moves by more than its ±".to_owned(),
        ),
        tile(
            alone.to_string(),
            "features are found in one result alone".to_owned(),
        ),
    ];
    format!("<div class=\"tiles\">\n{}</div>\n", tiles.concat())
}

/// With the sign of mathematics.
fn signed(mm: f64) -> String {
    format!("{mm:+.3}").replace('-', "−")
}

fn plain(number: f64) -> String {
    format!("{number:.3}").replace('-', "−")
}

fn keys(report: &WhatIfReport) -> String {
    if report.keys.is_empty() {
        return "<p>Scan, recording, scene and version are the same in both.</p>\n".to_owned();
    }
    let row = |(key, [a, b]): (&String, &[serde_json::Value; 2])| {
        vec![
            format!("<code>{}</code>", escaped(key)),
            escaped(&shown(a)),
            escaped(&shown(b)),
        ]
    };
    let rows: Vec<_> = report.keys.iter().map(row).collect();
    let of =
        |name: &str, which: &str| format!("{which} <span class=\"small\">{}</span>", escaped(name));
    let head = ["Input".to_owned(), of(&report.a, "A"), of(&report.b, "B")];
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    format!("<h2>What differs</h2>\n{}", table("keys", &head, &rows))
}

fn css(colour: Rgb) -> String {
    let [r, g, b] = colour;
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn legend() -> String {
    let ends = ["1 to 2 ±", "2 to 4 ±", "over 4 ±"];
    let chip = |colour: Rgb, text: &str| {
        format!(
            "<span><i style=\"background:{}\"></i>{text}</span>",
            css(colour)
        )
    };
    let inwards = STEPS
        .iter()
        .zip(ends)
        .rev()
        .map(|((_, colour, _), text)| chip(*colour, text));
    let outwards = STEPS
        .iter()
        .zip(ends)
        .map(|((.., colour), text)| chip(*colour, text));
    let all: String = inwards
        .chain([chip(STILL, "within ±")])
        .chain(outwards)
        .collect();
    format!(
        "<p class=\"legend\"><em>← inwards, less material</em>{all}<em>outwards, more material →</em></p>\n"
    )
}

fn figure(
    name: &str,
    mesh: &TriMesh,
    displaced: &[Displacement],
    vertices: &MovedVertices,
    report: &WhatIfReport,
) -> io::Result<String> {
    let paint: Vec<Rgb> = displaced.iter().map(colour_at).collect();
    let weights: Vec<f64> = displaced
        .iter()
        .map(|one| if one.is_moved(K) { 1.0 } else { 0.0 })
        .collect();
    let panel = PicturePanel {
        paint: Some(&paint),
        ..PicturePanel::of(mesh)
    };
    let weights = (vertices.moved > 0).then_some(&*weights);
    let params = PictureParams {
        width: WIDTH,
        weights,
        ..PictureParams::default()
    };
    let PartView { picture, .. } = draw_part(&panel, &params, &[]);
    let png = base64(&png_bytes(picture.size, &picture.pixels)?);
    let [width, height] = picture.size;
    let MovedVertices {
        vertices, moved, ..
    } = vertices;
    let (which, against) = match (&report.vertices_b, name) {
        (None, _) => ("Both have the same vertices; this is A".to_owned(), "B"),
        (Some(_), "A") => ("The mesh of A".to_owned(), "B"),
        (Some(_), _) => ("The mesh of B".to_owned(), "A"),
    };
    Ok(format!(
        "<figure><img src=\"data:image/png;base64,{png}\" width=\"{width}\" height=\"{height}\" alt=\"mesh {name} in the colours of what moved\">\
         <figcaption><strong>{name}.</strong> {which}: {moved} of {vertices} vertices lie off the surface of {against} by more than ±.</figcaption></figure>\n"
    ))
}

fn features(report: &WhatIfReport) -> String {
    let (moved, still): (Vec<_>, Vec<_>) = report.features.iter().partition(|one| one.is_moved());
    let head = [
        "Feature",
        "Where, mm",
        "Number",
        "A",
        "B",
        "Change",
        "±",
        "",
    ];
    let shown = |features: &[&FeatureChange]| {
        let rows: Vec<_> = features.iter().flat_map(|feature| rows(feature)).collect();
        format!(
            "<div class=\"scroll\">{}</div>\n",
            table("features", &head, &rows)
        )
    };
    let first = match moved.len() {
        0 => "<p>No number of a feature moves by more than its ±, and both results find the same features.</p>\n"
            .to_owned(),
        _ => shown(&moved),
    };
    let rest = match still.len() {
        0 => String::new(),
        count => {
            format!(
                "<details><summary>{count} features that do not move</summary>\n{}</details>\n",
                shown(&still)
            )
        }
    };
    format!("<h2>Features</h2>\n{first}{rest}")
}

#[expect(clippy::too_many_lines)]
fn rows(feature: &FeatureChange) -> Vec<Vec<String>> {
    let id = feature.id_a.or(feature.id_b).unwrap_or_default();
    let name = format!("<strong>{} {id}</strong>", escaped(&feature.kind));
    let place = feature.center_mm.map_or("–".to_owned(), |place| {
        place
            .map(|mm| format!("{mm:.1}").replace('-', "−"))
            .join(", ")
    });
    let alone = match (feature.id_a, feature.id_b) {
        (Some(_), None) => Some("found in A alone"),
        (None, Some(_)) => Some("found in B alone"),
        _ => None,
    };
    if let Some(alone) = alone {
        let none = || String::new();
        return vec![vec![
            name,
            place,
            none(),
            none(),
            none(),
            none(),
            none(),
            chip(alone),
        ]];
    }
    let row = |(at, number): (usize, &NumberChange)| {
        let NumberChange {
            name: of,
            a,
            b,
            change,
            plus_minus,
            moved,
        } = number;
        let (what, unit) = in_words(of);
        let value = |value: &Option<f64>| value.map_or("–".to_owned(), plain);
        let cells = vec![
            if at == 0 { name.clone() } else { String::new() },
            if at == 0 {
                place.clone()
            } else {
                String::new()
            },
            what,
            value(a),
            value(b),
            format!(
                "{} {unit}",
                if a.is_some() {
                    signed(*change)
                } else {
                    plain(*change)
                }
            ),
            plus_minus.map_or("not known".to_owned(), plain),
            if *moved { chip("moves") } else { String::new() },
        ];
        // the feature keeps its name and place
        let soft = |(at, cell): (usize, String)| {
            if *moved || at < 2 {
                cell
            } else {
                format!("<span class=\"still\">{cell}</span>")
            }
        };
        cells.into_iter().enumerate().map(soft).collect()
    };
    feature.numbers.iter().enumerate().map(row).collect()
}

fn chip(text: &str) -> String {
    format!("<span class=\"chip\">{text}</span>")
}

/// A number without its unit, and its unit.
fn in_words(name: &str) -> (String, &'static str) {
    let (what, unit) = match name.rsplit_once('_') {
        Some((what, "mm")) => (what, "mm"),
        Some((what, "deg")) => (what, "°"),
        _ => (name, ""),
    };
    (
        if what == "center" {
            "place".to_owned()
        } else {
            what.replace('_', " ")
        },
        unit,
    )
}

fn how(report: &WhatIfReport) -> String {
    let of_sigma = if report.vertices_a.is_sigma_known {
        "± is the larger of both results there, at k = 2 standard deviations"
    } else {
        "neither scene has uncertainty: no ± is known, and every vertex that lies elsewhere counts as moved"
    };
    let of_vertices = if report.vertices_b.is_some() {
        "The results have different vertices. So each vertex of A is compared with the nearest place of the surface of B, and each of B \
         with that of A."
    } else {
        "Both results have the same vertices and faces: each vertex is compared with itself, along its normal in A."
    };
    format!(
        "<h2>How this is measured</h2>\n<p class=\"small\">{of_vertices} A place moves where it lies farther off than ±; {of_sigma}. A \
         feature is the same in both where its kind is, its axis within 30° and its place within 1.5 mm. The place of a hole, slot, pocket \
         or boss is compared across its axis, that of a plane along its normal.</p>\n"
    )
}

const CSS: &str = "\
* { box-sizing: border-box; }
html { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
body { margin: 0; background: #fff; color: #1d2129; font: 15px/1.5 system-ui, 'Helvetica Neue', Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 32px 24px 48px; }
h1 { font-size: 28px; line-height: 1.2; margin: 0 0 20px; letter-spacing: -.01em; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 36px 0 12px; padding-bottom: 6px; border-bottom: 2px solid #1d2129; break-after: avoid; }
p { margin: 0 0 10px; } .small { font-size: 13px; color: #4a5160; font-weight: 400; }
.tiles { display: grid; grid-template-columns: repeat(4, 1fr); gap: 14px; }
.tiles div { border: 1px solid #c9ced8; border-top: 4px solid #1d2129; border-radius: 4px; padding: 12px 14px; }
.tiles b { display: block; font-size: 24px; line-height: 1.2; white-space: nowrap; font-variant-numeric: tabular-nums; } .tiles span { font-size: 13px; color: #4a5160; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
th { text-align: left; font-weight: 600; color: #4a5160; border-bottom: 2px solid #1d2129; padding: 5px 8px; vertical-align: bottom; }
td { border-bottom: 1px solid #dfe3ea; padding: 5px 8px; vertical-align: top; } tr { break-inside: avoid; }
.keys { width: auto; min-width: 50%; } .keys th, .keys td { overflow-wrap: anywhere; } .keys td:nth-child(n+2) { font-weight: 600; }
.features td:nth-child(n+4):nth-child(-n+7), .features th:nth-child(n+4):nth-child(-n+7) { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.features td:nth-child(-n+3), .features td:last-child { white-space: nowrap; }
.still { color: #6b7280; }
code { font: 13px ui-monospace, monospace; }
.legend { display: flex; flex-wrap: wrap; gap: 6px 14px; align-items: center; font-size: 13px; color: #4a5160; }
.legend span { display: inline-flex; align-items: center; gap: 5px; color: #1d2129; } .legend em { font-style: normal; }
.legend i { display: inline-block; width: 22px; height: 14px; border: 1px solid #8a919e; border-radius: 2px; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 16px; }
figure { margin: 0; break-inside: avoid; } figure img { width: 100%; height: auto; border: 1px solid #c9ced8; border-radius: 4px; display: block; }
figcaption { font-size: 13px; color: #4a5160; margin-top: 6px; }
.chip { display: inline-block; font-size: 12px; font-weight: 700; padding: 1px 8px; border-radius: 3px; background: #fcefe6; color: #9a3d00; border: 1px solid #e6b48f; white-space: nowrap; }
details { margin-top: 14px; } summary { cursor: pointer; font-weight: 600; margin-bottom: 8px; }
.scroll { overflow-x: auto; }
@media (max-width: 760px) { .tiles { grid-template-columns: 1fr 1fr; } .pictures { grid-template-columns: 1fr; } }
";
