//! The page: one HTML file without scripts or external resources.

use std::io;

use maud::{Markup, html};
use touchup_document::number::{fixed, signed};
use touchup_document::{document, picture_address, table};

use super::report::{MovedVertices, WhatIfReport};
use touchup_features::compare::{
    Displacement, PartView, PicturePanel, PictureParams, Rgb, draw_part,
};
use touchup_geometry::mesh::TriMesh;
use touchup_io::png::png_bytes;
use touchup_session::sweep::{COVERAGE as K, FeatureChange, JobResult, NumberChange, WhatIf};

/// Width of a picture, pixels.
const WIDTH: u32 = 1000;
/// Colour of unmoved places.
const STILL: Rgb = [222, 225, 230];
/// Thresholds of the colours, in ±; each with the inward and the outward colour. The colour-blind
/// tell them apart.
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
    let title = title(report);
    let body = html! {
        main {
            h1 { (title) }
            (verdict(report))
            (keys(report))
            h2 { "Where the surface moved" }
            (legend())
            div.pictures {
                (figure("A", &a.mesh, &found.of_a, &report.vertices_a, report)?)
                @if let (Some(of_b), Some(vertices)) = (&found.of_b, &report.vertices_b) {
                    (figure("B", &b.mesh, of_b, vertices, report)?)
                }
            }
            (features(report))
            (how(report))
        }
    };
    Ok(document(&title, CSS, &body))
}

fn shown(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Null => "left out".to_owned(),
        serde_json::Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A question about the one key that differs.
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

fn verdict(report: &WhatIfReport) -> Markup {
    let vertices = report.vertices_b.as_ref().unwrap_or(&report.vertices_a);
    let MovedVertices {
        vertices: all,
        moved,
        farthest_mm,
        farthest_plus_minus_mm,
        ..
    } = *vertices;
    let farthest = farthest_mm.map(|mm| format!("{} mm", signed(mm, 3)));
    let largest = match (&farthest, farthest_plus_minus_mm) {
        (_, Some(known)) => format!("is the largest displacement, known to ± {known:.3} mm"),
        (Some(farthest), None) => format!("the farthest moves by {farthest}"),
        (None, None) => "no vertex moves".to_owned(),
    };
    let is_alone = |one: &&FeatureChange| one.id_a.is_none() || one.id_b.is_none();
    let alone = report.features.iter().filter(is_alone).count();
    let (both, features) = (report.features_moved - alone, report.features.len());
    html! {
        div.tiles {
            div {
                b { (format!("{:.1} %", 100.0 * moved as f64 / all.max(1) as f64)) }
                span { "of the vertices move by more than their ±: " (moved) " of " (all) }
            }
            div { b { (farthest.as_deref().unwrap_or("–")) } span { (largest) } }
            div {
                b { (both) " of " (features) }
                span { "features have a number that moves by more than its ±" }
            }
            div { b { (alone) } span { "features are found in one result alone" } }
        }
    }
}

fn keys(report: &WhatIfReport) -> Markup {
    let heads = [("Input", ""), ("A", &*report.a), ("B", &report.b)];
    let heads = heads.map(|(head, name)| html! { (head) " " span.small { (name) } });
    let rows = report.keys.iter().map(|(key, [a, b])| {
        html! { td { code { (key) } } td { (shown(a)) } td { (shown(b)) } }
    });
    html! {
        @if report.keys.is_empty() {
            p { "Scan, recording, scene and version are the same in both." }
        } @else {
            h2 { "What differs" }
            (table("keys", heads, rows))
        }
    }
}

fn legend() -> Markup {
    let ends = ["1 to 2 ±", "2 to 4 ±", "over 4 ±"];
    let steps = || STEPS.into_iter().zip(ends);
    let inwards = steps().rev().map(|((_, colour, _), text)| (colour, text));
    let outwards = steps().map(|((.., colour), text)| (colour, text));
    let css = |[r, g, b]: Rgb| format!("background:#{r:02x}{g:02x}{b:02x}");
    html! {
        p.legend {
            em { "← inwards, less material" }
            @for (colour, text) in inwards.chain([(STILL, "within ±")]).chain(outwards) {
                span { i style=(css(colour)) {} (text) }
            }
            em { "outwards, more material →" }
        }
    }
}

fn figure(
    name: &str,
    mesh: &TriMesh,
    displaced: &[Displacement],
    vertices: &MovedVertices,
    report: &WhatIfReport,
) -> io::Result<Markup> {
    let MovedVertices {
        vertices, moved, ..
    } = vertices;
    let paint: Vec<Rgb> = displaced.iter().map(colour_at).collect();
    let weights = displaced
        .iter()
        .map(|one| f64::from(u8::from(one.is_moved(K))));
    let weights: Vec<f64> = weights.collect();
    let params = PictureParams {
        width: WIDTH,
        weights: (*moved > 0).then_some(&*weights),
        ..PictureParams::default()
    };
    let panel = PicturePanel {
        paint: Some(&paint),
        ..PicturePanel::of(mesh)
    };
    let PartView { picture, .. } = draw_part(&panel, &params, &[]);
    let png = png_bytes(picture.size, &picture.pixels)?;
    let [width, height] = picture.size;
    let (which, against) = match (&report.vertices_b, name) {
        (None, _) => ("Both have the same vertices; this is A", "B"),
        (Some(_), "A") => ("The mesh of A", "B"),
        (Some(_), _) => ("The mesh of B", "A"),
    };
    Ok(html! {
        figure {
            img src=(picture_address(&png)) width=(width) height=(height)
                alt={ "mesh " (name) " in the colours of what moved" };
            figcaption {
                strong { (name) "." } " " (which) ": " (moved) " of " (vertices) " vertices lie off the surface of "
                (against) " by more than ±."
            }
        }
    })
}

fn features(report: &WhatIfReport) -> Markup {
    let (moved, still): (Vec<_>, Vec<_>) = report.features.iter().partition(|one| one.is_moved());
    let of = |features: &[&FeatureChange]| {
        let heads = [
            "Feature",
            "Where, mm",
            "Number",
            "A",
            "B",
            "Change",
            "±",
            "",
        ];
        let rows = features.iter().flat_map(|feature| rows(feature));
        html! { div.scroll { (table("features", heads, rows)) } }
    };
    html! {
        h2 { "Features" }
        @if moved.is_empty() {
            p { "No number of a feature moves by more than its ±, and both results find the same features." }
        } @else {
            (of(&moved))
        }
        @if !still.is_empty() {
            details { summary { (still.len()) " features that do not move" } (of(&still)) }
        }
    }
}

fn rows(feature: &FeatureChange) -> Vec<Markup> {
    let FeatureChange {
        kind,
        id_a,
        id_b,
        center_mm,
        numbers,
    } = feature;
    let place = center_mm.map(|place| place.map(|mm| format!("{mm:.1}").replace('-', "−")));
    let place = place.map_or("–".to_owned(), |place| place.join(", "));
    let begin =
        html! { td { strong { (kind) " " (id_a.or(*id_b).unwrap_or_default()) } } td { (place) } };
    let chip = |text: &str| html! { span.chip { (text) } };
    let alone = match (id_a, id_b) {
        (Some(_), None) => Some("found in A alone"),
        (None, Some(_)) => Some("found in B alone"),
        _ => None,
    };
    if let Some(alone) = alone {
        return vec![html! { (begin) @for _ in 0..5 { td {} } td { (chip(alone)) } }];
    }
    let row = |(at, number): (usize, &NumberChange)| {
        let NumberChange {
            name,
            a,
            b,
            change,
            plus_minus,
            moved,
        } = number;
        let (what, unit) = in_words(name);
        let value = |value: &Option<f64>| value.map_or("–".to_owned(), |value| fixed(value, 3));
        let change = if a.is_some() {
            signed(*change, 3)
        } else {
            fixed(*change, 3)
        };
        let known = plus_minus.map_or("not known".to_owned(), |known| fixed(known, 3));
        let cells = [what, value(a), value(b), format!("{change} {unit}"), known];
        html! {
            // the first line has the feature's name and place
            @if at == 0 { (begin) } @else { td {} td {} }
            @for cell in cells {
                td { @if *moved { (cell) } @else { span.still { (cell) } } }
            }
            td { @if *moved { (chip("moves")) } }
        }
    };
    numbers.iter().enumerate().map(row).collect()
}

/// Name of a number without its unit, and the unit.
fn in_words(name: &str) -> (String, &'static str) {
    let (what, unit) = match name.rsplit_once('_') {
        Some((what, "mm")) => (what, "mm"),
        Some((what, "deg")) => (what, "°"),
        _ => (name, ""),
    };
    let what = if what == "center" { "place" } else { what };
    (what.replace('_', " "), unit)
}

fn how(report: &WhatIfReport) -> Markup {
    html! {
        h2 { "How this is measured" }
        p.small {
            @if report.vertices_b.is_some() {
                "The results have different vertices. So each vertex of A is compared with the nearest place of the \
                surface of B, and each of B with that of A."
            } @else {
                "Both results have the same vertices and faces: each vertex is compared with itself, along its normal \
                in A."
            }
            " A place moves where it lies farther off than ±; "
            @if report.vertices_a.is_sigma_known {
                "± is the larger of both results there, at k = 2 standard deviations"
            } @else {
                "neither scene has uncertainty: no ± is known, and every vertex that lies elsewhere counts as moved"
            }
            ". A feature is the same in both where its kind is, its axis within 30° and its place within 1.5 mm. The \
            place of a hole, slot, pocket or boss is compared across its axis, that of a plane along its normal."
        }
    }
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
