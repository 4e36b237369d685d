//! Checks a recording against a scan before any refinement.

use std::cell::RefCell;

use touchup_features::diagnose::{InputFinding, InputMonitor};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::stylus::{ClockOffset, ContactEstimator, ContactEstimatorParams, MarkerFilter};

use crate::replay::{Recording, ReplayError, each_sample};
use crate::scene::Scene;
use crate::threads::Threads;

/// Findings on a recording.
#[derive(Debug)]
pub struct InputCheck {
    /// the surest first; empty if there is none
    pub findings: Vec<InputFinding>,
    /// clock offset that scene and recording show together
    pub clock_offset: Option<ClockOffset>,
    /// losses that a better recording would avoid
    pub losses: Vec<String>,
}

/// Replays a recording with the settings of the scene and checks its samples against the scan.
///
/// - `scan`: m, in O.
/// - `markers`: computes the poses of a recording of markers.
/// - `at_each`: called after each record, to show the progress.
///
/// # Errors
/// Those of [`each_sample`].
pub fn check_input(
    recording: Recording,
    scan: &TriMesh,
    scene: &Scene,
    markers: Option<MarkerFilter>,
    at_each: &mut dyn FnMut(),
) -> Result<InputCheck, ReplayError> {
    let params = scene.input_monitor_params(recording.wrench_frame);
    let contact = ContactEstimatorParams {
        compensator: params.compensator,
        gate: Some(scene.contact.unwrap_or_default()),
        ..ContactEstimatorParams::new(params.tip)
    };
    let mut estimator = ContactEstimator::new(contact)?;
    let monitor = RefCell::new(InputMonitor::new(params)?);
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
