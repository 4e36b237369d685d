//! Points picked by hand, as comma-separated values, mm.
//!
//! `scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm`, and optionally `name` and
//! `sigma_mm` (standard deviation of the pair per axis). Form of tables: [`super::table`].

use std::path::Path;

use nalgebra::Point3;

use super::table::{Row, TableError, WantedColumns, read_table};
use touchup_features::align::PointPair;

const SCAN: [&str; 3] = ["scan_x_mm", "scan_y_mm", "scan_z_mm"];
const SPACE: [&str; 3] = ["space_x_mm", "space_y_mm", "space_z_mm"];
const NAME: &str = "name";
const SIGMA: &str = "sigma_mm";

/// Pairs as picked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairsFile {
    /// From the scan to space, m.
    pub pairs: Vec<PointPair>,
    /// Name of each; its place in the file, from 1 on, if it has no name.
    pub names: Vec<String>,
}

/// Reads pairs of points.
///
/// # Errors
/// [`TableError`], with the line.
pub fn read_pairs(path: &Path) -> Result<PairsFile, TableError> {
    let columns = WantedColumns {
        needed: &[SCAN, SPACE].concat(),
        numbers: &[SIGMA],
        texts: &[NAME],
    };
    pairs(path, read_table(path, columns)?)
}

/// Reads the points on the scan alone, each with itself; columns of space are ignored.
///
/// # Errors
/// [`TableError`], with the line.
pub fn read_scan_points(path: &Path) -> Result<PairsFile, TableError> {
    let columns = WantedColumns {
        needed: &SCAN,
        numbers: &[SIGMA],
        texts: &[&[NAME], &SPACE[..]].concat(),
    };
    let mut rows = read_table(path, columns)?;
    rows.iter_mut()
        .for_each(|row| row.needed.extend_from_within(..));
    pairs(path, rows)
}

fn pairs(path: &Path, rows: Vec<Row>) -> Result<PairsFile, TableError> {
    let mut file = PairsFile::default();
    for row in rows {
        let pair = pair(&row).map_err(|why| TableError::Line {
            path: path.to_owned(),
            line: row.line,
            why,
        })?;
        file.pairs.push(pair);
        file.names.push(
            row.texts[0]
                .clone()
                .unwrap_or_else(|| file.pairs.len().to_string()),
        );
    }
    Ok(file)
}

fn pair(row: &Row) -> Result<PointPair, String> {
    let sigma = row.numbers[0];
    if sigma.is_some_and(|sigma| sigma <= 0.0) {
        return Err(format!(
            "{SIGMA} must be more than 0; leave it empty where it is not known"
        ));
    }
    let point = |first: usize| Point3::from_slice(&row.needed[first..first + 3]) / 1e3;
    Ok(PointPair {
        from: point(0),
        to: point(3),
        sigma: sigma.map(|sigma| sigma / 1e3),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "scan_x_mm,scan_y_mm,scan_z_mm,space_x_mm,space_y_mm,space_z_mm";

    fn read(text: &str) -> Result<PairsFile, TableError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_pairs(file.path())
    }

    #[test]
    fn columns_are_taken_by_their_names() {
        let text = "\u{feff}# picked by hand\r\nname,space_x_mm,space_y_mm,space_z_mm,scan_z_mm,scan_y_mm,scan_x_mm,sigma_mm\r\n\r\n\
                    \"hole A\",4,5,6,3,2,1e0,0.5\r\n,4,5,-6, 3 ,2,1,\r\n";
        let PairsFile { pairs, names } = read(text).unwrap();
        assert_eq!(names, ["hole A", "2"]);
        let from = Point3::new(0.001, 0.002, 0.003);
        assert_eq!(
            pairs[0],
            PointPair {
                from,
                to: Point3::new(0.004, 0.005, 0.006),
                sigma: Some(0.0005)
            }
        );
        assert_eq!(
            pairs[1],
            PointPair {
                from,
                to: Point3::new(0.004, 0.005, -0.006),
                sigma: None
            }
        );
    }

    /// As saved by a spreadsheet with decimal commas.
    #[test]
    fn a_table_has_one_decimal_sign() {
        let text = "\u{feff}\"name\";\"scan_x_mm\";scan_y_mm;scan_z_mm;space_x_mm;space_y_mm;space_z_mm\r\n\
                    \"a; \"\"b\"\", c\";1;2,5;-3,25e0;4;5;\"6,5\"\r\n;;;;;;\r\n";
        let PairsFile { pairs, names } = read(text).unwrap();
        assert_eq!(names, ["a; \"b\", c"]);
        assert_eq!(pairs[0].from, Point3::new(0.001, 0.0025, -0.00325));
        assert_eq!(pairs[0].to, Point3::new(0.004, 0.005, 0.0065));
        let mixed = read(&text.replace("\r\n;;", "\r\n;1.5;")).unwrap_err();
        let wanted = "line 3: scan_x_mm is \"1.5\", and the decimals of this table have a comma";
        assert!(mixed.to_string().contains(wanted), "{mixed}");
    }

    #[test]
    fn errors_name_their_line() {
        let cases = [
            (String::new(), 1, "nothing in it"),
            ("# only this\n".into(), 1, "nothing in it"),
            ("scan_x_mm,scan_y_mm\n".into(), 1, "scan_z_mm is missing"),
            (HEADER.replace(',', ":"), 1, "set apart by commas"),
            (
                format!("{HEADER}\n1,2,3,4,5,\"6,5\"\n"),
                2,
                "space_z_mm is \"6,5\", and the decimals of this table have a point",
            ),
            (
                format!("{HEADER}\n1,2,3,4,5,6.5\n1,2,3,4,\"5,6\n").replace(',', ";"),
                3,
                "a quotation mark is not closed",
            ),
            (
                HEADER.replace("space_x_mm", "space_x_m"),
                1,
                "\"space_x_m\"",
            ),
            (format!("{HEADER},scan_x_mm"), 1, "twice"),
            (
                format!("{HEADER}\n1,2,3,4,5,6\n1,2,3,4,5\n"),
                3,
                "5 values for 6 columns",
            ),
            (
                format!("{HEADER}\n1,2,3,4,5,six\n"),
                2,
                "space_z_mm is \"six\"",
            ),
            (format!("{HEADER}\n1,2,3,4,5,nan\n"), 2, "must be a number"),
            (format!("{HEADER}\n\n1,2,3,1e999,5,6\n"), 3, "space_x_mm"),
            (
                format!("{HEADER},sigma_mm\n1,2,3,4,5,6,0\n"),
                2,
                "more than 0",
            ),
            (
                format!("{HEADER},sigma_mm\n1,2,3,4,5,6,x\n"),
                2,
                "sigma_mm is \"x\"",
            ),
        ];
        for (text, line, named) in cases {
            let message = read(&text).unwrap_err().to_string();
            assert!(
                message.contains(&format!("line {line}: ")) && message.contains(named),
                "{text}: {message}"
            );
        }
        assert!(matches!(
            read_pairs("no.csv".as_ref()),
            Err(TableError::Io(_))
        ));
    }
}
