//! Undo and redo of strokes of the haptic update alone, bit for bit.

use super::*;
use touchup::mesh::FaceTree;

/// The raster in six strokes, with pauses of 0.2 s.
fn strokes() -> Vec<Vec<Sample>> {
    let samples = raster(12e-3, 25, 0.15, &BALL, |_| 2.0);
    let length = samples.len().div_ceil(6);
    let pause = |stroke: usize| stroke as i64 * 200_000_000;
    let shifted = |(stroke, part): (usize, &[Sample])| {
        part.iter()
            .map(|sample| Sample {
                stamp_ns: sample.stamp_ns + pause(stroke),
                ..*sample
            })
            .collect()
    };
    samples.chunks(length).enumerate().map(shifted).collect()
}

#[test]
fn strokes_are_undone_and_redone_bit_for_bit_and_the_index_follows() {
    let mut refiner = Refiner::new(bumpy(3), RefineParams::robust(BALL)).unwrap();
    refiner.keep_strokes();
    let mut states = vec![refiner.mesh().positions().to_vec()];
    for stroke in strokes() {
        push_all(&mut refiner, &stroke);
        states.push(refiner.mesh().positions().to_vec());
    }
    assert!(
        states.windows(2).all(|pair| pair[0] != pair[1]),
        "each stroke moves something"
    );
    let check = |refiner: &Refiner, expected: &[Point3<f64>]| {
        assert_eq!(refiner.mesh().positions(), expected);
        let rebuilt = FaceTree::new(refiner.mesh());
        for p in expected
            .iter()
            .map(|p| p + Vector3::new(0.4e-3, 0.3e-3, 0.5e-3))
        {
            let found = refiner.closest_face(&p, 1.0).unwrap().distance_squared;
            assert_eq!(
                found,
                rebuilt
                    .closest(refiner.mesh(), &p, 1.0)
                    .unwrap()
                    .distance_squared
            );
        }
    };
    for expected in states.iter().rev().skip(1) {
        assert!(refiner.undo());
        check(&refiner, expected);
    }
    assert!(!refiner.undo());
    for expected in &states[1..4] {
        assert!(refiner.redo());
        check(&refiner, expected);
    }
    // a new stroke discards the redoable ones
    let mut last = strokes().pop().unwrap();
    last.iter_mut()
        .for_each(|sample| sample.stamp_ns += 10_000_000_000);
    push_all(&mut refiner, &last);
    assert!(!refiner.redo() && refiner.undo());
    check(&refiner, &states[3]);
}

#[test]
fn nothing_is_kept_without_a_request() {
    let mut refiner = Refiner::new(bumpy(3), RefineParams::robust(BALL)).unwrap();
    push_all(&mut refiner, &strokes()[0]);
    assert!(!refiner.undo() && !refiner.redo());
}
