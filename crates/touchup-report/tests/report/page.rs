//! The files of a report: well formed, without invalid numbers, and with every digit in the
//! CSV.

use serde_json::Value;
use touchup_report::document::Report;
use touchup_report::files::{OutputFile, ReportError};
use touchup_report::{
    Axis, Chapter, Drawing, Figure, LineStroke, Mark, Panel, Series, Spread, Table, TableCell,
};

const HOSTILE: &str = "a < b & \"c\" > 'd' \u{1}";

fn mark(x: f64, y: f64) -> Mark {
    Mark {
        x: Spread {
            median: x,
            p10: 0.9 * x,
            p90: 1.2 * x,
        },
        y: Spread::from(y),
    }
}

fn curves(id: &str, log: bool, series: Vec<Series>) -> Figure {
    let axis = |label, column| {
        if log {
            Axis::log(label, column)
        } else {
            Axis::linear(label, column)
        }
    };
    Figure {
        id: id.to_owned(),
        title: HOSTILE.to_owned(),
        caption: HOSTILE.to_owned(),
        x: axis("time, <µs>", "time_us"),
        y: axis("error, mm", "error_mm"),
        drawing: Drawing::Curves(series),
    }
}

fn series(name: &str, marks: &[(f64, f64)]) -> Series {
    Series {
        name: name.to_owned(),
        stroke: LineStroke::Joined,
        marks: marks.iter().map(|(x, y)| mark(*x, *y)).collect(),
    }
}

/// Everything that a figure or table may hold, sane and not.
#[expect(clippy::too_many_lines)]
fn report() -> Report {
    let bad = [
        (0.0, -1.0),
        (f64::NAN, 1.0),
        (1.0, f64::INFINITY),
        (1e-300, 1e300),
        (2.0, 3.0),
    ];
    let many = (0..12)
        .map(|i| series(&format!("{HOSTILE} with a long name, number {i}"), &bad))
        .collect();
    let maps = Figure {
        drawing: Drawing::Maps {
            share_of: "stable runs".to_owned(),
            panels: vec![
                Panel {
                    name: "a, b".to_owned(),
                    xs: vec![1e-3, 1e-2, 1e-1],
                    ys: vec![1.0, 2.0],
                    shares: vec![
                        Some(0.0),
                        Some(1.0),
                        None,
                        Some(1.0 / 3.0),
                        Some(f64::NAN),
                        Some(7.0)
                    ],
                };
                5
            ],
        },
        ..curves("maps", true, Vec::new())
    };
    let empty_maps = Figure {
        drawing: Drawing::Maps {
            share_of: String::new(),
            panels: Vec::new(),
        },
        ..curves("no_maps", false, Vec::new())
    };
    let table = Table {
        id: "table".to_owned(),
        title: HOSTILE.to_owned(),
        caption: String::new(),
        heads: [
            "name".to_owned(),
            "push, µs".to_owned(),
            "error, mm".to_owned(),
        ]
        .to_vec(),
        rows: vec![
            vec![
                "a,\"b\"".into(),
                Spread {
                    median: 0.1 + 0.2,
                    p10: 1e-7,
                    p90: 5e22,
                }
                .into(),
                (1.0 / 3.0).into(),
            ],
            vec![TableCell::Empty, TableCell::Empty, f64::NAN.into()],
        ],
    };
    Report {
        machine: HOSTILE.to_owned(),
        commit: "0123456789ab".to_owned(),
        command: "touchup-report --out <x>".to_owned(),
        date: "2026-01-01 00:00 UTC".to_owned(),
        advice: Some(Table {
            id: "verdict".to_owned(),
            ..table.clone()
        }),
        verdict: vec![HOSTILE.to_owned()],
        chapters: vec![Chapter {
            title: HOSTILE.to_owned(),
            text: vec![HOSTILE.to_owned()],
            figures: vec![
                curves("log", true, many),
                curves(
                    "linear",
                    false,
                    vec![series("one", &[(0.1 + 0.2, 1.0 / 3.0), (1e-7, 5e22)])],
                ),
                curves("nothing", true, Vec::new()),
                maps,
                empty_maps,
            ],
            tables: vec![table],
        }],
    }
}

fn text(files: &[OutputFile], name: &str) -> String {
    let file = files
        .iter()
        .find(|file| file.name == name)
        .unwrap_or_else(|| panic!("no {name}"));
    String::from_utf8(file.bytes.clone()).unwrap()
}

/// Tags in order, respecting quotes; fails on anything that XML forbids.
fn assert_balanced(xml: &str, name: &str) {
    let mut open: Vec<String> = Vec::new();
    let mut rest = xml;
    while let Some(at) = rest.find('<') {
        let between = &rest[..at];
        assert!(!between.contains('>'), "{name}: a bare > in {between:?}");
        let mut quoted = false;
        let length = rest[at..].find(|c| {
            quoted ^= c == '"';
            c == '>' && !quoted
        });
        let tag = &rest[at + 1..at + length.unwrap_or_else(|| panic!("{name}: a tag without end"))];
        assert!(!tag.contains('<'), "{name}: {tag}");
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(closed), "{name}");
        } else if !tag.ends_with('/') && !tag.starts_with('!') && !tag.starts_with("meta ") {
            open.push(tag.split_whitespace().next().unwrap().to_owned());
        }
        rest = &rest[at + tag.len() + 2..];
    }
    assert!(open.is_empty(), "{name}: {open:?} not closed");
    for part in xml.split('&').skip(1) {
        let is_entity = ["amp;", "lt;", "gt;", "quot;"]
            .iter()
            .any(|entity| part.starts_with(entity));
        assert!(
            is_entity,
            "{name}: a bare & before {:?}",
            part.chars().take(20).collect::<String>()
        );
    }
    assert!(!xml.contains('\u{1}'), "{name}: a control character");
}

#[test]
fn pictures_and_page_are_well_formed_and_every_coordinate_is_a_number_on_the_picture() {
    let files = report().files().unwrap();
    for file in files
        .iter()
        .filter(|file| file.name.ends_with(".svg") || file.name.ends_with(".html"))
    {
        let text = text(&files, &file.name);
        assert_balanced(&text, &file.name);
        for wrong in ["NaN", "inf\"", "inf,", "-inf"] {
            assert!(!text.contains(wrong), "{}: {wrong}", file.name);
        }
        for attribute in [
            " x=\"",
            " y=\"",
            " x1=\"",
            " x2=\"",
            " y1=\"",
            " y2=\"",
            " cx=\"",
            " cy=\"",
            " width=\"",
        ] {
            for rest in text.split(attribute).skip(1) {
                let value: f64 = rest.split('"').next().unwrap().parse().unwrap();
                assert!(
                    (0.0..2000.0).contains(&value),
                    "{}: {attribute}{value}",
                    file.name
                );
            }
        }
    }
}

/// The colours that a legend gives to each name: the text follows its mark.
fn colours_by_name(svg: &str, name: &str) -> Vec<String> {
    let at = svg
        .find(&format!(">{name}</text>"))
        .unwrap_or_else(|| panic!("no {name}"));
    let mark = svg[..at]
        .rfind("fill=\"#")
        .or_else(|| svg[..at].rfind("stroke=\"#"))
        .unwrap();
    let stroke = svg[..at].rfind("stroke=\"#").unwrap();
    [mark, stroke]
        .map(|from| svg[from..].split('"').nth(1).unwrap().to_owned())
        .to_vec()
}

#[test]
fn a_method_has_one_colour_in_all_figures_and_two_of_one_figure_have_two() {
    let points = [(1.0, 1.0), (2.0, 3.0)];
    let names = [
        vec!["lie", "strang"],
        vec!["rk4", "strang", "dp5"],
        vec!["dp5", "lie"],
    ];
    let figure = |(at, names): (usize, &Vec<&str>)| {
        curves(
            &format!("figure{at}"),
            false,
            names.iter().map(|name| series(name, &points)).collect(),
        )
    };
    let figures = names.iter().enumerate().map(figure).collect();
    let files = Report {
        chapters: vec![Chapter {
            figures,
            ..Chapter::default()
        }],
        ..report()
    }
    .files()
    .unwrap();
    let colours =
        |at: usize, name: &str| colours_by_name(&text(&files, &format!("figure{at}.svg")), name);
    assert_eq!(colours(0, "strang"), colours(1, "strang"));
    assert_eq!(colours(0, "lie"), colours(2, "lie"));
    assert_eq!(colours(1, "dp5"), colours(2, "dp5"));
    for (at, names) in names.iter().enumerate() {
        let all: std::collections::BTreeSet<_> =
            names.iter().map(|name| colours(at, name)).collect();
        assert_eq!(all.len(), names.len(), "{names:?}");
    }
}

#[test]
fn a_page_needs_nothing_else() {
    let html = text(&report().files().unwrap(), "report.html");
    for outside in ["http:", "https:", "src=", "@import", "<script", "<link"] {
        let left = html.replace("http://www.w3.org/2000/svg", "");
        assert!(!left.contains(outside), "{outside}");
    }
    for linked in ["log.csv", "maps.csv", "table.csv", "report.json"] {
        assert!(html.contains(&format!("href=\"{linked}\"")), "{linked}");
    }
    let verdict = html.find("id=\"summary\"").unwrap();
    assert!(verdict < html.find("Contents").unwrap() && html.contains("0123456789ab"));
}

#[test]
fn numbers_come_back_from_the_csv_to_the_last_digit() {
    let files = report().files().unwrap();
    let linear = text(&files, "linear.csv");
    let lines: Vec<&str> = linear.lines().collect();
    assert_eq!(
        lines[0],
        "series,time_us,time_us_p10,time_us_p90,error_mm,error_mm_p10,error_mm_p90"
    );
    let numbers = |line: &str| {
        line.split(',')
            .skip(1)
            .map(|x| x.parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    };
    let (x, y) = (0.1 + 0.2, 1.0 / 3.0);
    assert_eq!(numbers(lines[1]), [x, 0.9 * x, 1.2 * x, y, y, y]);
    assert_eq!(numbers(lines[2])[3], 5e22);
    // a word in place of a number is an empty cell
    assert!(
        text(&files, "log.csv")
            .lines()
            .nth(2)
            .unwrap()
            .ends_with(",,,,1.0,1.0,1.0")
    );
    let table = text(&files, "table.csv");
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(
        lines[0],
        "name,\"push, µs\",\"push, µs, p10\",\"push, µs, p90\",\"error, mm\""
    );
    assert_eq!(
        lines[1],
        "\"a,\"\"b\"\"\",0.30000000000000004,1e-7,5e22,0.3333333333333333"
    );
    assert_eq!(lines[2], ",,,,");
    assert_eq!(
        text(&files, "maps.csv").lines().nth(3),
        Some("\"a, b\",0.1,1.0,")
    );
}

#[test]
fn the_json_holds_the_report() {
    let json: Value =
        serde_json::from_str(&text(&report().files().unwrap(), "report.json")).unwrap();
    assert_eq!(json["commit"], "0123456789ab");
    assert_eq!(
        json["chapters"][0]["tables"][0]["rows"][0][1]["median"].as_f64(),
        Some(0.1 + 0.2)
    );
    assert_eq!(
        json["chapters"][0]["figures"][1]["drawing"]["curves"][0]["marks"][0]["y"]["median"]
            .as_f64(),
        Some(1.0 / 3.0)
    );
}

#[test]
fn names_that_would_collide_or_leave_the_folder_are_refused() {
    let named = |id: &str| {
        let mut report = report();
        report.chapters[0].tables[0].id = id.to_owned();
        report.files()
    };
    for id in ["log", "report"] {
        assert!(matches!(named(id), Err(ReportError::SameName(_))), "{id}");
    }
    for id in ["", "../x", "a b", "A"] {
        assert!(matches!(named(id), Err(ReportError::BadName(_))), "{id}");
    }
}
