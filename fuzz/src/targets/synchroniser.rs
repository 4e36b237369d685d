//! Messages of any stamps and numbers, paired and doubted: samples come finite, in order of time,
//! and explain themselves.

use crate::{BALL, closed_box, number, rotation, vector};
use arbitrary::{Result, Unstructured};
use nalgebra::{Isometry3, Translation3};
use touchup_features::diagnose::{InputMonitor, InputMonitorParams};
use touchup_geometry::mesh::FaceTree;
use touchup_method::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, ContactGateParams, Message,
    Placement, StampedPose, StampedWrench, SyncParams, Synchroniser, TipShape, Wrench,
};

const MS: i64 = 1_000_000;

fn stamp(bytes: &mut Unstructured, last: &mut i64) -> Result<i64> {
    Ok(match bytes.arbitrary::<u8>()? {
        0 => bytes.arbitrary()?,
        1 => last.saturating_add(i64::from(bytes.arbitrary::<i32>()?) * MS),
        step => {
            *last = last.saturating_add((i64::from(step) - 16) * MS / 8);
            *last
        }
    })
}

#[expect(clippy::too_many_lines)]
fn pair(bytes: &mut Unstructured) -> Result<()> {
    let params = SyncParams {
        reorder_ns: i64::from(bytes.arbitrary::<u8>()?) * MS,
        largest_gap_ns: i64::from(bytes.arbitrary::<u8>()?) * MS,
        wrench_drift: f64::from(bytes.arbitrary::<i8>()?) * 1e-6,
        capacity: 2 + usize::from(bytes.arbitrary::<u8>()?),
        ..SyncParams::default()
    };
    let mut sync = if bytes.arbitrary()? {
        Synchroniser::new(params)
    } else {
        Synchroniser::in_order(params)
    }
    .expect("settings in their range");
    let monitored = InputMonitorParams {
        stiffness_share: 0.02,
        place_sigma: 2e-6,
        compensator: CompensatorParams::default(),
        tip: BALL,
        shape: TipShape::Ball,
        scan_noise: number(bytes, 1e-3)?.abs().min(1.0),
        placement: Placement::default(),
        gate: Some(ContactGateParams::default()),
        sync: params,
    };
    let mut monitor = InputMonitor::new(monitored).expect("settings in their range");
    let mut contacts =
        ContactEstimator::new(ContactEstimatorParams::new(BALL)).expect("settings in their range");
    let (mut last, mut newest) = (0, None);
    let mut take = |sync: &mut Synchroniser, monitor: &mut InputMonitor| {
        while let Some(sample) = sync.next_sample() {
            assert!(
                newest < Some(sample.stamp_ns),
                "{newest:?}, then {}",
                sample.stamp_ns
            );
            newest = Some(sample.stamp_ns);
            assert!(
                sample
                    .wrench
                    .force
                    .iter()
                    .chain(sample.pose_ot.translation.vector.iter())
                    .all(|x| x.is_finite())
            );
            assert!((sample.pose_ot.rotation.norm() - 1.0).abs() < 1e-6);
            monitor.sample(&sample);
            if let Ok(contact) = contacts.observe(&sample) {
                monitor.contact(contact);
            }
        }
    };
    while !bytes.is_empty() {
        let stamp_ns = stamp(bytes, &mut last)?;
        let message = if bytes.arbitrary()? {
            let pose_ot =
                Isometry3::from_parts(Translation3::from(vector(bytes, 0.05)?), rotation(bytes)?);
            Message::Pose(StampedPose { stamp_ns, pose_ot })
        } else {
            let wrench = Wrench {
                force: vector(bytes, 5.0)?,
                torque: vector(bytes, 0.1)?,
            };
            Message::Wrench(StampedWrench { stamp_ns, wrench })
        };
        monitor.message(&message);
        sync.push(message);
        take(&mut sync, &mut monitor);
    }
    sync.finish();
    take(&mut sync, &mut monitor);
    let scan = closed_box([0.02, 0.015, 0.01], 2);
    let _ = monitor.clock_offset();
    for finding in monitor.findings(&scan, &FaceTree::new(&scan)) {
        assert!(!format!("{finding:?}").is_empty());
    }
    Ok(())
}

/// One input of this target.
///
/// # Panics
/// If the claim of the module does not hold.
pub fn run(data: &[u8]) {
    let _ = pair(&mut Unstructured::new(data));
}
