use std::fs;

use super::*;
use touchup_features::conformity::ToleranceLimits;

fn read(name: &str, text: &str) -> Result<Vec<NominalRecord>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    read_nominal(&path)
        .map_err(|error| error.to_string().replace(&path.display().to_string(), name))
}

const HEADER: &str = "name,kind,quantity,nominal_mm,tolerance_mm,lower_deviation_mm,upper_deviation_mm,center_x_mm,center_y_mm,center_z_mm";

fn refused(row: &str) -> String {
    read("n.csv", &format!("# drawing 7\n{HEADER}\n{row}\n")).unwrap_err()
}

#[test]
fn a_table_says_tolerances_in_three_ways() {
    let text = format!(
        "{HEADER}\nbore,hole,diameter_mm,8,0.02,,,16,36,12\nfit,hole,diameter_mm,6,,-0.03,0.01,32,34,12\n\
         depth,hole,depth_mm,8,,0,,32,34,12\nround,hole,roundness_mm,,0.03,,,16,36,12\nwidth,slot,width_mm,6,,,,25,14,12\n"
    );
    let records = read("n.csv", &text).unwrap();
    let limits = |lower, upper| NominalTolerance::Limits(ToleranceLimits { lower, upper });
    let tolerances: Vec<_> = records.iter().map(NominalRecord::tolerance).collect();
    let expected = [
        limits(Some(8.0 - 0.02), Some(8.0 + 0.02)),
        limits(Some(6.0 - 0.03), Some(6.0 + 0.01)),
        limits(Some(8.0), None),
        limits(None, Some(0.03)),
        NominalTolerance::General,
    ];
    assert_eq!(tolerances, expected);
    assert_eq!(records[1].center_mm, Some([32.0, 34.0, 12.0]));
}

#[test]
fn limits_have_the_decimals_of_the_drawing() {
    let text = format!(
        "{HEADER}\na,hole,diameter_mm,6.1,,-0.03,0.07,1,0,0\nb,hole,diameter_mm,6.3,0.05,,,2,0,0\n\
         \"c, (\"\"fit\"\")\",hole,diameter_mm,1.005,0.1,,,3,0,0\n"
    );
    let limits = |text: &str| -> Vec<String> {
        let records = read("n.csv", text).unwrap();
        let texts = records.iter().map(|record| match record.tolerance() {
            NominalTolerance::Limits(ToleranceLimits {
                lower: Some(lower),
                upper: Some(upper),
            }) => format!("{} {lower} {upper}", record.name),
            other => format!("{other:?}"),
        });
        texts.collect()
    };
    let expected = ["a 6.07 6.17", "b 6.25 6.35", "c, (\"fit\") 0.905 1.105"];
    assert_eq!(limits(&text), expected);
    // the same from a spreadsheet with decimal commas
    let quoted = text.replace("c, (", "c| (").replace(',', ";");
    let other = quoted.replace(['.', '|'], ",");
    assert_eq!(
        limits(&format!("\u{feff}{}", other.replace('\n', "\r\n"))),
        expected
    );
}

/// Rows with one mistake each, and a part of its message.
const MISTAKES: &[(&str, &str)] = &[
    (
        "a,hole,diameter_mm,NaN,0.1,,,,,",
        "n.csv, line 3: nominal_mm is \"NaN\" and must be a number",
    ),
    (
        "a,hole,diameter_mm,8,,0.1,-0.1,,,",
        "a: lower_deviation_mm 0.1 is not below upper_deviation_mm -0.1: exchange them",
    ),
    (
        "a,bore,diameter_mm,8,0.1,,,,,",
        "there is no kind \"bore\": take one of hole, slot",
    ),
    (
        "a,hole,diameter,8,0.1,,,,,",
        "there is no quantity \"diameter\": take one of diameter_mm",
    ),
    (
        "a,hole,diameter_mm,,0.1,,,,,",
        "needs a nominal value: fill in nominal_mm",
    ),
    (
        "a,hole,diameter_mm,8,-0.1,,,,,",
        "tolerance_mm must be above 0",
    ),
    (
        "a,hole,diameter_mm,8,0.1,-0.1,,,,",
        "give tolerance_mm, or limit deviations, not both",
    ),
    (
        "a,hole,diameter_mm,8,0.1,,,16,,12",
        "go together: fill in all three or none",
    ),
    (
        "a,hole,cone_angle_deg,90,1,,,,,",
        "cone_angle_deg is in deg: put the number into nominal_deg",
    ),
    (
        "a,hole,position_mm,,0.1,,,,,",
        "position_mm needs the nominal centre",
    ),
    (
        "a,hole,roundness_mm,,,-0.1,0.1,,,",
        "roundness_mm cannot be below 0",
    ),
    (
        "a,hole,roundness_mm,1,0.1,,,,,",
        "the nominal value of roundness_mm is 0",
    ),
    (
        "a,hole,distance_mm,10,0.1,,,,,",
        "distance_mm needs a datum",
    ),
    (
        "a,hole,width_mm,10,0.1,,,,,",
        "a: a hole has no width_mm: take one of diameter_mm, depth_mm",
    ),
    (",hole,diameter_mm,8,0.1,,,,,", "name is empty"),
    ("a,hole,diameter_mm,8,0,1,,,,,", "11 values for 10 columns"),
];

#[test]
fn each_mistake_in_a_row_is_said_with_its_line_and_what_to_do() {
    for &(row, expected) in MISTAKES {
        let found = refused(row);
        assert!(
            found.contains(expected) && found.contains("line 3"),
            "{row}: {found}"
        );
    }
}

#[test]
fn what_is_there_twice_is_refused() {
    let names = refused("a,hole,diameter_mm,8,0.1,,,,,\na,slot,width_mm,8,0.1,,,,,");
    assert_eq!(
        names,
        "n.csv, line 4: the name \"a\" is that of line 3: give each its own"
    );
    let quantities = refused("a,hole,diameter_mm,8,0.1,,,1,2,3\nb,hole,diameter_mm,9,0.1,,,1,2,3");
    assert!(
        quantities.contains("line 4: diameter_mm of this feature has its tolerance in line 3"),
        "{quantities}"
    );
}

#[test]
fn a_file_that_is_no_table_of_nominal_values_is_named() {
    assert!(read("n.csv", "").unwrap_err().starts_with("n.csv"));
    assert!(
        read("n.csv", "name,kind,quantity\n")
            .unwrap_err()
            .contains("it has no characteristic")
    );
    let unknown = read("n.csv", "name,kind,quantity,nominal_inch\n").unwrap_err();
    assert!(
        unknown.contains("no column is called \"nominal_inch\""),
        "{unknown}"
    );
    let missing = read(
        "n.csv",
        "name,quantity,nominal_mm,tolerance_mm\na,diameter_mm,8,1\n",
    )
    .unwrap_err();
    assert!(missing.contains("column kind is missing"), "{missing}");
    let json = read(
        "n.json",
        "{\"characteristics\": [{\"name\": \"a\", \"kind\": \"hole\"}]}",
    )
    .unwrap_err();
    assert!(json.contains("missing field `quantity`"), "{json}");
    let json = read(
        "n.json",
        "{\"characteristics\": [{\"name\": \"a\", \"kind\": \"hole\", \"quantity\": \"x_mm\", \"tol\": 1}]}",
    );
    assert!(json.unwrap_err().contains("unknown field `tol`"));
}

#[test]
fn what_is_written_is_read_again_as_table_and_as_json() {
    let datum = DatumRecord {
        kind: "plane".to_owned(),
        center_mm: Some([1.0, 2.0, 12.0]),
        feature: None,
    };
    let base = NominalRecord {
        kind: "hole".to_owned(),
        center_mm: Some([0.1, -2.0, 1e-3]),
        ..NominalRecord::default()
    };
    let record = |name: &str, quantity: &str| NominalRecord {
        name: name.to_owned(),
        quantity: quantity.to_owned(),
        ..base.clone()
    };
    let records = [
        NominalRecord {
            nominal_mm: Some(8.0),
            tolerance_mm: Some(0.1),
            ..record("#1, \"fit\"; 2\" pipe\nbelow & < 9", "diameter_mm")
        },
        NominalRecord {
            nominal_deg: Some(90.0),
            lower_deviation_deg: Some(-1.0),
            axis: Some([0.0, -0.6, 0.8]),
            ..record("cone", "cone_angle_deg")
        },
        NominalRecord {
            upper_deviation_mm: Some(0.05),
            datum: Some(datum),
            ..record("square", "perpendicularity_mm")
        },
        NominalRecord {
            center_mm: None,
            feature: Some(3),
            nominal_mm: Some(1.0),
            ..record("by number", "depth_mm")
        },
    ];
    let folder = tempfile::tempdir().unwrap();
    for name in ["n.csv", "n.json"] {
        let path = folder.path().join(name);
        write_nominal(&path, &records, &["a comment"]).unwrap();
        let again = read_nominal(&path).unwrap();
        assert_eq!(again, records, "{name}");
    }
}
