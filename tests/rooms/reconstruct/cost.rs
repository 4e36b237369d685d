//! What settings cost is known before anything is built.

use touchup::reconstruct::{Patcher, PatcherParams};

const RADIUS: f64 = 1.5e-3;

fn refused(radius: f64, pitch: f64) -> Option<String> {
    let params = PatcherParams { pitch, ..PatcherParams::new(radius, None, 0.05e-3) };
    Patcher::new(params).err().map(|error| error.to_string())
}

/// A ball of 2.8 radii of 1.5 mm holds 310 mm³: 39 million nodes 0.02 mm apart, 4 million 0.043 mm apart.
#[test]
fn a_lattice_that_one_contact_would_fill_the_memory_with_is_refused_with_the_figure() {
    for (pitch, nodes) in [(0.02e-3, "3.9e7 nodes"), (0.001e-3, "3.1e11 nodes")] {
        let why = refused(RADIUS, pitch).expect("it is refused");
        for part in ["patch.pitch_mm", nodes, "4.27e-2 or more", "GB"] {
            assert!(why.contains(part), "{part} is not in: {why}");
        }
    }
    for allowed in [0.043e-3, RADIUS / 2.0, RADIUS] {
        assert_eq!(refused(RADIUS, allowed), None, "{allowed}");
    }
}

#[test]
fn a_tip_smaller_than_any_is_refused() {
    for radius in [1e-9, 9e-6, 0.0, f64::NAN] {
        let why = refused(radius, 0.75e-3).expect("it is refused");
        assert!(why.contains("tip.radius_mm") && why.contains("0.01 or more"), "{why}");
    }
    assert_eq!(refused(1e-5, 0.5e-5), None);
}
