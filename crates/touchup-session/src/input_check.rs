//! What speaks against a recording on a scan, before anything is made of it.

use std::cell::RefCell;

use touchup_core::diagnose::{InputFinding, InputMonitor};
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::stylus::{ClockOffset, ContactEstimator, ContactEstimatorParams, MarkerFilter};

use crate::replay::{Recording, ReplayError, each_sample};
use crate::scene::Scene;
use crate::threads::Threads;

/// What was found.
#[derive(Debug)]
pub struct InputCheck {
    /// the surest first; empty: nothing speaks against it
    pub findings: Vec<InputFinding>,
    /// what scene and recording say together of the clocks
    pub clock_offset: Option<ClockOffset>,
    /// what a better recording would not lack
    pub losses: Vec<String>,
}

/// Replays a recording as the scene has it, and judges what comes of it on the scan.
///
/// - `scan`: m, in O.
/// - `markers`: makes the poses of a recording that holds markers.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// As [`each_sample`].
pub fn check_input(
    recording: Recording,
    scan: &TriMesh,
    scene: &Scene,
    markers: Option<MarkerFilter>,
    at_each: &mut dyn FnMut(),
) -> Result<InputCheck, ReplayError> {
    let params = scene.input_monitor_params(recording.wrench_frame);
    let monitor = RefCell::new(InputMonitor::new(params)?);
    let contact = ContactEstimatorParams {
        compensator: params.compensator,
        gate: Some(scene.contact.unwrap_or_default()),
        ..ContactEstimatorParams::new(params.tip)
    };
    let mut estimator = ContactEstimator::new(contact)?;
    let replayed = each_sample(
        recording,
        scene.placement(),
        scene.sync_params(),
        markers,
        at_each,
        &mut |message| monitor.borrow_mut().message(message),
        |sample| {
            let mut monitor = monitor.borrow_mut();
            monitor.sample(sample);
            if let Ok(contact) = estimator.observe(sample) {
                monitor.contact(contact);
            }
        },
    )?;
    let monitor = monitor.into_inner();
    let clock_offset = monitor.clock_offset();
    let findings = monitor.findings(scan, &FaceTree::new_by(scan, &Threads));
    Ok(InputCheck {
        findings,
        clock_offset,
        losses: replayed.losses,
    })
}
