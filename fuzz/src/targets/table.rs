//! The tables with readers: pairs of points, static poses, touches, and the touch lines of an arm.

use crate::file;
use touchup_io::probed_touches_file::read_probed_touches;
use touchup_io::tables::pairs_file::{read_pairs, read_scan_points};
use touchup_io::tables::static_poses::read_static_poses;
use touchup_io::touches_file::{read_touches, write_touches};

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let path = file("table", data);
    for pairs in [read_pairs(&path), read_scan_points(&path)]
        .into_iter()
        .flatten()
    {
        assert!(pairs.pairs.iter().all(|pair| {
            pair.from
                .iter()
                .chain(pair.to.iter())
                .all(|x| x.is_finite())
        }));
    }
    for (rotation, wrench) in read_static_poses(&path).unwrap_or_default() {
        assert!((rotation.norm() - 1.0).abs() < 1e-9 && wrench.force.iter().all(|x| x.is_finite()));
    }
    let _ = read_probed_touches(&path);
    if let Ok(touches) = read_touches(&path) {
        write_touches(&path, &touches).expect("a file that was read can be written");
        assert_eq!(
            read_touches(&path).expect("it was written here").len(),
            touches.len()
        );
    }
}
