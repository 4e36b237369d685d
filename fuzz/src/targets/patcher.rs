//! Any samples on a closed scan: its patch has finite places, and leaves it closed.

use crate::{BALL, assert_is_somewhere, closed_box, open_edges, sample};
use arbitrary::{Result, Unstructured};
use nalgebra::Point3;
use touchup_geometry::mesh::FaceTree;
use touchup_method::reconstruct::{Patcher, PatcherParams};
use touchup_method::stylus::{ContactEstimator, ContactEstimatorParams};

fn patch(bytes: &mut Unstructured) -> Result<()> {
    let scan = closed_box([4e-3, 3e-3, 2e-3], 3);
    let tree = FaceTree::new(&scan);
    let mut params = PatcherParams::new(BALL.radius, BALL.stiffness, 0.05e-3);
    // coarse: the claim holds at any tolerance, and a run takes milliseconds
    params.tolerance = BALL.radius / 16.0;
    params.free_space = bytes.arbitrary()?;
    if bytes.arbitrary()? {
        params.uncertainty = None;
    }
    let mut patcher = Patcher::new(params).expect("settings in their range");
    let mut contacts =
        ContactEstimator::new(ContactEstimatorParams::new(BALL)).expect("settings in their range");
    let (mut stamp_ns, mut at) = (0, Point3::new(0.0, 0.0, 2e-3 + BALL.radius));
    while !bytes.is_empty() {
        let sample = sample(bytes, &mut stamp_ns, at, 1e-3)?;
        if let Ok(contact) = contacts.observe(&sample) {
            patcher.push(contact);
            at = sample.pose_ot.translation.vector.into();
        }
        if bytes.ratio(1, 64)? {
            let _ = if bytes.arbitrary()? {
                patcher.undo()
            } else {
                patcher.redo()
            };
        }
    }
    patcher.flush();
    let patched = patcher.patched(&scan, &tree).expect("a mesh");
    assert_is_somewhere(&patched.mesh);
    assert_eq!(open_edges(&patched.mesh), 0, "a closed part is open");
    assert!(
        patched
            .columns()
            .iter()
            .all(|(_, column)| column.iter().all(|x| !x.is_nan()))
    );
    Ok(())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = patch(&mut Unstructured::new(data));
}
