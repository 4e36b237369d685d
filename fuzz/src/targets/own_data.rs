//! Recordings of other makers: tables of numbers, by usual and by named columns, and ROS 1 bags.

use crate::{file, read_all};
use touchup_io::recording::{RecordingLayout, TableColumns, Topics, WrenchAxes};

/// Names of columns, one letter each.
fn names(letters: &str) -> Option<Vec<String>> {
    Some(letters.chars().map(String::from).collect())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let Some((kind, rest)) = data.split_first() else {
        return;
    };
    match kind % 3 {
        0 => read_all(&file("table.csv", rest), &Topics::default()),
        1 => {
            let in_mm = |letters: &str| {
                letters
                    .chars()
                    .map(|letter| format!("{letter} [mm]"))
                    .collect()
            };
            let columns = TableColumns {
                time: Some("t [s]".to_owned()),
                position: Some(in_mm("xyz")),
                orientation: Some(
                    "abc"
                        .chars()
                        .map(|letter| format!("{letter}_deg"))
                        .collect(),
                ),
                force: Some(
                    "uvw"
                        .chars()
                        .map(|letter| format!("{letter} (N)"))
                        .collect(),
                ),
                torque: names("uvw").filter(|_| kind % 2 == 0),
                wrench_axes: WrenchAxes::Tip,
            };
            read_all(
                &file("table.csv", rest),
                RecordingLayout {
                    columns,
                    ..RecordingLayout::default()
                },
            );
        }
        _ => read_all(&file("touch.bag", rest), &Topics::default()),
    }
}
