//! Coverage: the counts against cases worked by hand, and a run from end to end.

use touchup_report::coverage::{CoverageKind, CoverageParams, KindInWorld, StatedNumber, coverage};
use touchup_report::{Effort, TableCell};
use touchup_sim::SimWorld;

use crate::markdown;

fn number(error: f64, std: f64) -> StatedNumber {
    StatedNumber {
        error,
        std,
        is_at_least: false,
    }
}

fn of(kind: CoverageKind, numbers: Vec<StatedNumber>) -> KindInWorld {
    KindInWorld {
        world: SimWorld::Ur,
        kind,
        numbers,
    }
}

#[test]
fn scores_shares_and_bounds_are_as_counted_by_hand() {
    let bound = |error| StatedNumber {
        error,
        std: 1e-3,
        is_at_least: true,
    };
    let numbers = vec![
        number(3e-3, 1e-3),
        number(-4e-3, 4e-3),
        number(1e-3, 0.0),
        bound(1.9e-3),
        bound(2e-3),
        bound(-9e-3),
    ];
    let found = of(CoverageKind::HoleDepth, numbers);
    // 3 and −1 standard deviations; one number without, three bounds
    assert_eq!(found.count(), 2);
    assert!((found.mean_error().unwrap() + 0.5e-3).abs() < 1e-12);
    assert!((found.rms_score().unwrap() - 5f64.sqrt()).abs() < 1e-12);
    assert_eq!(found.share_within(), Some(0.5));
    assert_eq!(found.bounds(), [3, 1]);
    assert_eq!(found.holds(), Some(false));
    assert_eq!(of(CoverageKind::HoleDepth, vec![bound(0.0)]).holds(), None);
}

#[test]
fn vertices_hold_by_their_share_too() {
    // 8 of 100 at 2 standard deviations, the rest such that the root mean square is 1
    let rest = ((100.0f64 - 8.0 * 4.0) / 92.0).sqrt();
    let numbers = |outside: usize| {
        (0..100)
            .map(|i| number(if i < outside { 2.0 } else { rest } * 1e-3, 1e-3))
            .collect::<Vec<_>>()
    };
    for (kind, holds) in [
        (CoverageKind::PlaneVertex, false),
        (CoverageKind::EdgeVertex, true),
        (CoverageKind::RimVertex, true),
        (CoverageKind::HoleDiameter, true),
    ] {
        assert_eq!(of(kind, numbers(8)).holds(), Some(holds), "{}", kind.name());
    }
    assert_eq!(
        of(CoverageKind::PlaneVertex, numbers(7)).holds(),
        Some(true)
    );
}

#[test]
#[ignore = "a slow proof"]
fn coverage_is_measured_and_reported() {
    // the chapter itself has twenty seeds
    let params = CoverageParams {
        seeds: 1..=4,
        ..CoverageParams::of(Effort { is_quick: false })
    };
    let found = coverage(params.clone(), &mut |_| {});
    assert_eq!(found.failed, Vec::<String>::new());
    for &world in &params.worlds {
        let of = |kind| {
            found
                .kinds
                .iter()
                .find(|of| of.world == world && of.kind == kind)
                .map_or(0, KindInWorld::count)
        };
        for kind in [
            CoverageKind::PlaneVertex,
            CoverageKind::EdgeVertex,
            CoverageKind::RimVertex,
        ] {
            assert!(
                of(kind) > 10,
                "{}: {} of {}",
                world.name(),
                of(kind),
                kind.name()
            );
        }
        assert!(
            of(CoverageKind::HoleDiameter) > 0,
            "{} has no hole",
            world.name()
        );
    }
    let chapter = found.chapter();
    let table = &chapter.tables[0];
    assert_eq!(table.rows.len(), found.kinds.len());
    let verdicts = table
        .rows
        .iter()
        .filter(|row| row.last() == Some(&TableCell::from("OUTSIDE")))
        .count();
    assert_eq!(verdicts, found.outside().len());
    println!("{}\n\n{}", chapter.text[0], markdown(table, 3));
}
