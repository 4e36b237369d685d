//! Surroundings of a working arm: the mesh, which follows a probing, output files, and stop
//! signals.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3};

use super::files::ProbeFiles;
use super::follower::{Follower, QUEUE, TakeStates};
use super::ready::ProbingSetup;
use crate::cli::common::progress::WorkProgress as Bar;
use crate::cli::common::signals::StopSignals;
use crate::cli::{CliError, not_written, print_result};
use touchup_features::calibrate::StaticPose;
use touchup_geometry::mesh::{FaceHit, FaceTree, TriMesh};
use touchup_io::probed_touches_file::{TouchLine, TouchLog};
use touchup_io::tables::static_poses::{StaticPoseLog, static_pose_line};
use touchup_method::reconstruct::KnownSurface;
use touchup_method::stylus::{Message, Sample, StampedPose, WrenchFrame};
use touchup_probing::arm::{ArmState, Observer, StopRequest};
use touchup_probing::execute::{ProbedTouch, Progress, StaticWorld, World};
use touchup_session::live::{LiveError, Pace};
use touchup_session::refinement::{Refinement, RefinementInput, RefinementOptions};
use touchup_session::scene::RegionCut;
use touchup_session::threads::Threads;

/// Renewal period of the mesh, which the arm reads only before each touch: 200 ms, in ns.
const EVERY_NS: i64 = 200_000_000;

/// Mesh that follows the samples.
struct FollowingMesh {
    refinement: Refinement,
    /// Pose of the base in the frame of the scan.
    pose_ob: Isometry3<f64>,
    pose: Option<StampedPose>,
}

impl FollowingMesh {
    fn new(ready: &ProbingSetup, is_simulated: bool) -> Result<Self, CliError> {
        // a simulated arm behaves independently of the computer's speed; a real one moves on
        // meanwhile
        let pace = Pace {
            is_patient: is_simulated,
            every_ns: EVERY_NS,
            ..Pace::default()
        };
        // the arm keeps clear of all of the scan, and not only of a region of it
        let input = RefinementInput {
            scene: ready.scene.clone(),
            scan: Arc::new((ready.mesh.clone(), FaceTree::new_by(&ready.mesh, &Threads))),
            cut: RegionCut::default(),
        };
        let options = RefinementOptions {
            live: Some(pace),
            ..RefinementOptions::default()
        };
        Ok(Self {
            refinement: Refinement::new(input, WrenchFrame::Sensor, options)?,
            pose_ob: ready.cell.pose_bo.inverse(),
            pose: None,
        })
    }

    /// Takes a message; a wrench comes after the pose of the same state.
    fn take(&mut self, message: &Message) -> Result<(), LiveError> {
        let wrench = match message {
            Message::Pose(pose) => {
                self.pose = Some(*pose);
                return Ok(());
            }
            Message::Wrench(wrench) => wrench,
        };
        let Some(pose) = self.pose.filter(|pose| pose.stamp_ns == wrench.stamp_ns) else {
            return Ok(());
        };
        let sample = Sample {
            stamp_ns: wrench.stamp_ns,
            pose_ot: self.pose_ob * pose.pose_ot,
            wrench: wrench.wrench,
        };
        match self.refinement.push(&sample) {
            Ok(_) | Err(LiveError::Refine(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }
}

/// Files and mesh of a probing: each state of the arm is a sample for both.
struct ProbingRecorder {
    mesh: FollowingMesh,
    files: ProbeFiles,
    failed: Option<CliError>,
}

impl TakeStates for ProbingRecorder {
    fn take_state(&mut self, state: &ArmState) -> bool {
        let taken = self.files.record(state).and_then(|messages| {
            let mut messages = messages.iter().flatten();
            Ok(messages.try_for_each(|message| self.mesh.take(message))?)
        });
        if let Err(error) = taken {
            self.failed.get_or_insert(error);
        }
        self.failed.is_none()
    }
}

/// Surroundings of an arm that probes features. Files and mesh follow its states beside the loop;
/// between motions the arm waits for them.
pub(super) struct LiveWorld<'a> {
    followed: Follower<ProbingRecorder>,
    signals: &'a StopSignals,
    bar: Bar,
}

impl<'a> LiveWorld<'a> {
    /// - `is_resumed`: continues the files of the folder and their mesh.
    pub fn new(
        ready: &ProbingSetup,
        out: &Path,
        [is_simulated, is_resumed]: [bool; 2],
        signals: &'a StopSignals,
    ) -> Result<Self, CliError> {
        let mut mesh = FollowingMesh::new(ready, is_simulated)?;
        let ball_radius = ready.params.pattern.ball_radius;
        let files = match is_resumed {
            // a fault of the mesh shows again at the next state
            true => ProbeFiles::resume(out, ball_radius, &mut |message| _ = mesh.take(message))?,
            false => ProbeFiles::begin(out, ball_radius)?,
        };
        let followed = Follower::new(
            ProbingRecorder {
                mesh,
                files,
                failed: None,
            },
            is_simulated,
        );
        let no_thread = |error| {
            CliError::arm(format_args!(
                "no thread for files and mesh can be had: {error}"
            ))
        };
        Ok(Self {
            followed: followed.map_err(no_thread)?,
            signals,
            bar: Bar::new("probe", None),
        })
    }

    /// Writes the surfaces of a feature, and takes them for known.
    pub fn know(&mut self, surfaces: &[KnownSurface]) -> Result<(), CliError> {
        let ProbingRecorder { mesh, files, .. } = self.followed.get_mut();
        for known in files.know(surfaces)? {
            mesh.refinement.know(known)?;
        }
        Ok(())
    }

    /// Ends the recording; returns the number of written touches.
    pub fn finish(self) -> Result<usize, CliError> {
        let is_behind = self.followed.is_behind();
        let ProbingRecorder { files, failed, .. } = self.followed.into_inner();
        let written = files.finish();
        match failed {
            Some(error) => Err(error),
            None if is_behind => Err(CliError::arm(format_args!(
                "files and mesh were {QUEUE} states behind the arm, so it was stopped: end what else runs on this machine, or \
                 write to a faster disk"
            ))),
            None => written,
        }
    }
}

impl Observer for LiveWorld<'_> {
    fn on_state(&mut self, state: &ArmState) {
        self.bar.step();
        self.followed.on_state(state);
    }

    fn stop_request(&self) -> Option<StopRequest> {
        self.signals
            .request()
            .max(self.followed.has_failed().then_some(StopRequest::Retract))
    }
}

impl World for LiveWorld<'_> {
    fn mesh(&self) -> &TriMesh {
        self.followed.get().mesh.refinement.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        let mesh = &self.followed.get().mesh;
        mesh.refinement.closest_face(place, reach)
    }

    fn publish(&mut self, progress: &Progress) {
        let uncertainty_um = progress.uncertainty.map(|sigma| sigma * 1e6);
        tracing::debug!(
            feature = progress.flag,
            touch = progress.touch,
            of = progress.budget,
            uncertainty_um,
            "touching"
        );
    }

    fn touched(&mut self, flag: u32, touch: &ProbedTouch) {
        let followed = self.followed.get_mut();
        if let Err(error) = followed.files.touched(flag, touch) {
            followed.failed = Some(error);
        }
    }
}

/// Unrefined scan, while an arm measures on it.
pub(in crate::cli) struct SpotWorld<'a> {
    scan: StaticWorld,
    signals: &'a StopSignals,
    kept: KeptMeasurements<'a>,
    touch_log: Option<TouchLog>,
    segment_log: Option<StaticPoseLog>,
    /// Lines of the measurements, in order, without curves.
    made: Vec<String>,
    /// Radius of the ball, m.
    ball_radius: f64,
    failed: Option<CliError>,
}

/// Kind of an arm's measurements, and the file for their immediate output, if any.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) enum KeptMeasurements<'a> {
    /// A line of JSON for each touch.
    Touches(Option<&'a Path>),
    /// A line of CSV for each static segment.
    Segments(Option<&'a Path>),
}

impl<'a> SpotWorld<'a> {
    /// - `kept`: kind of the measurements, and the file for their immediate output.
    pub fn new(
        ready: &ProbingSetup,
        kept: KeptMeasurements<'a>,
        signals: &'a StopSignals,
    ) -> Result<Self, CliError> {
        let ball_radius = ready.params.pattern.ball_radius;
        let (mut touch_log, mut segment_log) = (None, None);
        match kept {
            KeptMeasurements::Touches(Some(path)) => {
                let log = TouchLog::create(path, ball_radius);
                touch_log = Some(log.map_err(not_written(path))?);
            }
            KeptMeasurements::Segments(Some(path)) => {
                segment_log = Some(StaticPoseLog::create(path).map_err(not_written(path))?);
            }
            KeptMeasurements::Touches(None) | KeptMeasurements::Segments(None) => {}
        }
        Ok(Self {
            scan: ready.static_world()?,
            signals,
            kept,
            touch_log,
            segment_log,
            made: Vec::new(),
            ball_radius,
            failed: None,
        })
    }

    /// Returns the measurement; after an error it prints the lines until then, unless a file has
    /// them.
    pub fn finish<T>(self, measured: Result<T, CliError>) -> Result<T, CliError> {
        let measured = self.failed.map_or(measured, Err);
        let (what, flag, path) = match self.kept {
            KeptMeasurements::Touches(path) => ("touches", "--touches-out", path),
            KeptMeasurements::Segments(path) => ("static segments", "--segments-out", path),
        };
        measured.map_err(|error| match (self.made.len(), path) {
            (0, _) => error,
            (count, Some(path)) => error.with(format_args!(
                "the {what} ({count}) are in {}",
                path.display()
            )),
            (count, None) => match print_result(&self.made.join("\n")) {
                Ok(()) => error.with(format_args!(
                    "the {what} ({count}) are printed; {flag} keeps all of them"
                )),
                Err(lost) => error.with(format_args!(
                    "the {what} ({count}) are lost: {}",
                    lost.message
                )),
            },
        })
    }
}

impl Observer for SpotWorld<'_> {
    fn on_state(&mut self, _: &ArmState) {}

    fn stop_request(&self) -> Option<StopRequest> {
        self.signals
            .request()
            .max(self.failed.as_ref().map(|_| StopRequest::Retract))
    }
}

impl World for SpotWorld<'_> {
    fn mesh(&self) -> &TriMesh {
        self.scan.mesh()
    }

    fn closest_face(&self, place: &Point3<f64>, reach: f64) -> Option<FaceHit> {
        self.scan.closest_face(place, reach)
    }

    fn publish(&mut self, _: &Progress) {}

    fn touched(&mut self, flag: u32, touch: &ProbedTouch) {
        self.made
            .push(TouchLine::of(flag, self.made.len(), touch, self.ball_radius, 0).to_string());
        // no recording with another clock
        if let Some(log) = &mut self.touch_log
            && let Err(error) = log.append(flag, touch, 0)
        {
            self.failed = Some(not_written(log.path())(error));
        }
    }

    fn weighed(&mut self, segment: &StaticPose) {
        self.made
            .push(static_pose_line(&segment.r_wt, &segment.wrench));
        if let Some(log) = &mut self.segment_log
            && let Err(error) = log.append(&segment.r_wt, &segment.wrench)
        {
            self.failed = Some(not_written(log.path())(error));
        }
    }
}
