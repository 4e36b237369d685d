//! The table of parameters in the code against the one in docs/ros.md and the file
//! config/node.yaml: three times the same, written three times.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use touchup::ros::parameters::{
    PARAMETERS, ParameterDescriptor, ParameterDomain, ParameterValue, Settable,
};

/// In every node, so in neither of the two files.
const EVERYWHERE: &str = "use_sim_time";

fn read(file: &str) -> String {
    fs::read_to_string(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(file)).unwrap()
}

/// A row of the table in docs/ros.md: name, type, default, range, live, meaning.
fn row(declared: &ParameterDescriptor) -> [String; 6] {
    let range = match declared.allowed {
        ParameterDomain::Double(_, from, to) => format!("{from} to {to}"),
        ParameterDomain::OneOf(_, words) => words.join(", "),
        ParameterDomain::Bool(_) | ParameterDomain::String(_) | ParameterDomain::SampleType(_) => {
            String::new()
        }
    };
    let default = declared.default_value();
    let live = match declared.settable {
        Settable::AtStart => "no",
        Settable::Live => "yes",
        Settable::OnlyToFalse => "to false",
    };
    let type_name = default.type_name().to_owned();
    [
        declared.name.into(),
        type_name,
        default.to_string(),
        range,
        live.into(),
        declared.description.into(),
    ]
}

fn documented() -> Vec<[String; 6]> {
    let text = read("docs/ros.md");
    let (_, table) = text.split_once("| name | type | default |").unwrap();
    let rows = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    rows.map(|line| {
        let cells: Vec<_> = line
            .trim_matches('|')
            .split('|')
            .map(|cell| cell.replace('`', "").trim().into())
            .collect();
        cells.try_into().unwrap()
    })
    .collect()
}

#[test]
fn the_table_is_that_of_the_documentation() {
    let declared = PARAMETERS
        .iter()
        .filter(|declared| declared.name != EVERYWHERE);
    // "a file", "a folder" and "a type" give the meaning of a word, not its range
    let documented = documented().into_iter().map(|mut row| {
        row[3] = row[3]
            .replace("a file", "")
            .replace("a folder", "")
            .replace("a type", "");
        row
    });
    assert_eq!(
        declared.map(row).collect::<Vec<_>>(),
        documented.collect::<Vec<_>>()
    );
}

#[test]
fn the_file_has_every_parameter_with_its_default() {
    type File = BTreeMap<String, BTreeMap<String, BTreeMap<String, String>>>;
    let file: File = serde_saphyr::from_str(&read("config/node.yaml")).unwrap();
    let in_file = &file["/**"]["ros__parameters"];
    let declared = PARAMETERS
        .iter()
        .filter(|declared| declared.name != EVERYWHERE);
    let defaults: BTreeMap<_, _> = declared
        .map(|one| (one.name.to_owned(), one.default_value().to_string()))
        .collect();
    assert_eq!(*in_file, defaults);
}

#[test]
fn every_default_is_allowed() {
    for declared in PARAMETERS {
        assert_eq!(
            declared.check(&declared.default_value()),
            Ok(declared.default_value())
        );
    }
    assert_eq!(
        PARAMETERS[0].default_value(),
        ParameterValue::String(String::new())
    );
}
