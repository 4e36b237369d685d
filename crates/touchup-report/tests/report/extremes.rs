//! The extremes of the report: each has its right answer from another reason than the code.

use touchup_report::extremes::extremes;

#[test]
fn every_extreme_gets_the_right_answer() {
    let measured = extremes();
    for row in &measured.rows {
        println!(
            "{} | {} | {} | {}",
            row.is_right, row.fed, row.came_out, row.right_answer
        );
    }
    let wrong: Vec<&str> = measured.wrong().map(|row| row.fed.as_str()).collect();
    assert_eq!(wrong, Vec::<&str>::new());
    assert_eq!(measured.table().rows.len(), measured.rows.len());
}
