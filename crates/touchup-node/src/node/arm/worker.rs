//! The arm thread: it streams wrench and pose like any probe, and probes on request.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{
    Receiver, Sender, SyncSender, TryRecvError, TrySendError, channel, sync_channel,
};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

use tracing::{info, warn};

use super::answer::{
    planned as planned_result, refused, response_of, result_of, summary_of, touches_of,
};
use super::common::SharedArmState;
use super::pace::PacedArm;
use super::request::RequestSettings;
use super::world::{ArmLink, ArmWorld, GoalWatcher, ask_mesh, is_cancelled};
use crate::node::channels::{ArmMeasurement, FeatureInput};
use crate::node::error::NodeError;
use crate::node::setup::Setup;
use crate::node::side_work::begin;
use crate::ros::convert::{header, point, trigger};
use crate::ros::messages::{
    Header, Path as PathMsg, Pose, PoseStamped, ProbeFeatureResponse, ProbeGoal, ProbeResult,
    ProbeSettings, TriggerResponse,
};
use crate::ros::port::{ArmOrder, Goal, GoalEnd, Port, Publication, SamplePort};
use crate::ros::refusal::not_probed;
use crate::ros::stop::{ArmMotion, StopState};
use touchup_geometry::mesh::TriMesh;
use touchup_io::probed_touches_file::append_probed_touches;
use touchup_io::recording::{append_known_surfaces, known_surfaces_beside};
use touchup_method::reconstruct::KnownSurface;
use touchup_probing::arm::{Arm, StopRequest};
use touchup_probing::execute::{Ending, Flag, FlagResult, Plan, ProbeParams, RobotCell};
use touchup_session::probing_run::ProbingRun;
use touchup_session::scene::simulated_arm;
use touchup_session::session::SessionRecord;
use touchup_sim::{MeshSurface, SimArm};

/// Orders waiting for the thread: it takes one at a time, and refuses others meanwhile.
const QUEUE: usize = 1;
/// Delay before a retry with a silent arm.
const LOST: Duration = Duration::from_millis(200);
/// Maximum wait for the flagged features, and for the complete mesh.
const WAIT: Duration = Duration::from_secs(15);
/// Divisor for following the clock of an arm: each state corrects this share of the deviation;
/// latency varies, drift stays.
const FOLLOW: i64 = 1024;
/// Deviation that means another clock, ns.
const OTHER_CLOCK_NS: i64 = 200_000_000;

/// An order, and the session folder for its touches.
type FolderOrder = (ArmOrder, PathBuf);

/// Kind of arm.
pub enum ArmKind {
    /// A simulated arm, touching the true part.
    Sim(Box<TriMesh>),
    /// A real arm.
    Real(Box<dyn Arm + Send>),
}

/// An arm, and the port for its measurements.
pub struct ArmOfNode {
    /// kind of arm
    pub kind: ArmKind,
    /// publishes on the topics of the probe
    pub samples: Box<dyn SamplePort>,
}

/// Handle of the arm thread. On drop the arm stops, retracts and ends.
#[derive(Debug)]
pub struct ArmHandle {
    inputs: SyncSender<FolderOrder>,
    /// state shared with the thread
    pub common: Arc<SharedArmState>,
    /// known surfaces of probed features, with the folder of their session
    known: Receiver<(PathBuf, KnownSurface)>,
    cell: RobotCell,
}

impl Drop for ArmHandle {
    fn drop(&mut self) {
        self.common.stops.end();
    }
}

impl ArmHandle {
    /// Passes on an order, or answers with the reason against it.
    ///
    /// - `folder`: of the session, for the record of touches.
    pub fn order(&self, order: ArmOrder, folder: &Path, header: Header) {
        if let Err(why) = self.common.stops.heard() {
            return order.refuse(header, ProbeResult::ARM_NOT_READY, &why);
        }
        if !self.common.begin() {
            return order.refuse(header, ProbeResult::BUSY, BUSY);
        }
        let Err(error) = self.inputs.try_send((order, folder.to_owned())) else {
            return;
        };
        self.common.done();
        match error {
            TrySendError::Full((order, _)) => order.refuse(header, ProbeResult::BUSY, BUSY),
            TrySendError::Disconnected((order, _)) => {
                order.refuse(header, ProbeResult::ARM_NOT_READY, HAS_ENDED)
            }
        }
    }

    /// Known surfaces of features probed since the last call, with the folder of their session.
    pub fn known(&self) -> impl Iterator<Item = (PathBuf, KnownSurface)> + '_ {
        self.known.try_iter()
    }

    /// `~/arm_state`: answers at once, whatever the arm does.
    pub fn state(&self) -> TriggerResponse {
        self.common.state(&self.cell)
    }
}

/// State of the arm thread.
struct ArmWorker {
    link: ArmLink,
    port: Arc<dyn Port>,
    features: SyncSender<FeatureInput>,
    known: Sender<(PathBuf, KnownSurface)>,
    run: ProbingRun,
    params: ProbeParams,
    inputs: Receiver<FolderOrder>,
    /// the time of ROS at the last state, ns
    ros_ns: i64,
}

/// Starts the arm thread.
///
/// # Errors
/// [`NodeError::NoRobot`] for a scene without a robot, [`NodeError::NoThread`].
pub fn start(
    setup: &Arc<Setup>,
    port: &Arc<dyn Port>,
    arm: ArmOfNode,
    features: SyncSender<FeatureInput>,
    stops: &Arc<StopState>,
) -> Result<(ArmHandle, JoinHandle<()>), NodeError> {
    let (cell, params) = setup.input.scene.probing().ok_or(NodeError::NoRobot)?;
    let (to, inputs) = sync_channel(QUEUE);
    let (to_mesh, known) = channel();
    let common = Arc::new(SharedArmState::new(Arc::clone(stops)));
    stops.look();
    let ends = EndsArm(Arc::clone(stops));
    let handle = ArmHandle {
        inputs: to,
        common: Arc::clone(&common),
        known,
        cell: cell.clone(),
    };
    let ArmOfNode { kind, samples } = arm;
    let link = ArmLink {
        setup: Arc::clone(setup),
        samples,
        common,
        offset_ns: None,
        begun: setup.clock.now(),
    };
    let mut worker = ArmWorker {
        link,
        port: Arc::clone(port),
        features,
        known: to_mesh,
        run: ProbingRun::new(cell),
        params,
        inputs,
        ros_ns: i64::MIN,
    };
    let run = move || {
        let EndsArm(stops) = &ends;
        match kind {
            ArmKind::Real(mut arm) => worker.run(&mut *arm),
            ArmKind::Sim(part) => {
                if let Err(why) = worker.run_simulated(&part) {
                    warn!("{why}");
                    stops.end_arm(&why);
                }
            }
        }
        if stops.is_ending() {
            stops.end_arm("as the node ends");
        }
        worker.refuse_the_rest();
    };
    let thread = begin(&setup.clock, "arm", run)?;
    Ok((handle, thread))
}

/// Reports the end of the arm thread, for any reason.
struct EndsArm(Arc<StopState>);

impl Drop for EndsArm {
    fn drop(&mut self) {
        self.0
            .end_arm("by a fault of touchup: please report it with the session's folder");
    }
}

impl ArmWorker {
    fn run_simulated(&mut self, part: &TriMesh) -> Result<(), String> {
        let surface = MeshSurface::new(part)
            .map_err(|error| format!("the simulated arm has no part to touch: {error}"))?;
        let arm = SimArm::new(
            &surface,
            simulated_arm(&self.run.cell, &self.params),
            &self.run.cell.above(part),
        );
        let arm = arm.map_err(|error| format!("the simulated arm cannot begin: {error}"))?;
        self.run(&mut PacedArm::new(self.link.setup.clock.clone(), arm));
        Ok(())
    }

    /// Streams and executes orders until the node ends.
    fn run(&mut self, arm: &mut dyn Arm) {
        while !self.link.common.stops.is_ending() {
            self.see_next(arm);
            match self.inputs.try_recv() {
                Ok((order, folder)) => self.take(order, &folder, arm),
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return,
            }
        }
    }

    /// Answers all waiting callers.
    fn refuse_the_rest(&self) {
        for (order, _) in self.inputs.try_iter() {
            let why = self
                .link
                .common
                .ready()
                .err()
                .unwrap_or_else(|| HAS_ENDED.to_owned());
            let is_ending = self.link.common.stops.is_ending();
            let code = if is_ending {
                ProbeResult::SHUTDOWN
            } else {
                ProbeResult::ARM_NOT_READY
            };
            order.refuse(self.header(), code, &why);
        }
    }

    /// Takes the next state of a resting arm.
    fn see_next(&mut self, arm: &mut dyn Arm) {
        self.link.common.stops.look();
        let state = match arm.next_state() {
            Ok(state) => state,
            Err(error) => {
                if self.link.common.miss(&error) {
                    warn!(%error, "the arm");
                }
                return self.link.setup.clock.sleep(LOST);
            }
        };
        self.link.common.see(&state);
        let now_ns = self.port.now_ns();
        let off = now_ns - state.stamp_ns;
        let followed = match self.link.offset_ns {
            // a simulated time that has not begun, or stands still, does not reveal the arm's clock
            Some(offset) if now_ns == self.ros_ns => offset,
            Some(offset) if (off - offset).abs() < OTHER_CLOCK_NS => {
                offset + (off - offset) / FOLLOW
            }
            _ => off,
        };
        self.ros_ns = now_ns;
        self.link.offset_ns = Some(followed);
        self.link.publish(&state);
    }

    /// Waits for a result of another thread, while the arm's states go on.
    fn wait<T>(&mut self, arm: &mut dyn Arm, ready: &Receiver<T>) -> Option<T> {
        let deadline = self.link.setup.clock.now() + WAIT;
        loop {
            match ready.try_recv() {
                Err(TryRecvError::Empty)
                    if self.link.setup.clock.now() <= deadline
                        && !self.link.common.stops.is_ending() =>
                {
                    self.see_next(arm);
                }
                made => return made.ok(),
            }
        }
    }

    /// Executes an order. Marks it done before the answer, as the caller may then give the next
    /// one.
    fn take(&mut self, order: ArmOrder, folder: &Path, arm: &mut dyn Arm) {
        self.link.begun = self.link.setup.clock.now();
        match order {
            ArmOrder::Recover(reply) => {
                let recovered = arm.recover().inspect(|()| self.link.common.recovered());
                let recovered = recovered.map_err(|error| error.to_string());
                let recovered = recovered.and_then(|()| self.link.common.stops.recover());
                self.link.common.done();
                reply.send(trigger(
                    recovered.map(|()| "the arm may move again".to_owned()),
                ));
            }
            ArmOrder::All(reply) => {
                let results = self.probe(folder, &[], &ProbeSettings::default(), arm, None);
                self.link.common.done();
                reply.send(TriggerResponse {
                    success: !results.is_empty()
                        && results.iter().all(|one| one.code < ProbeResult::CANCELLED),
                    message: summary_of(&results),
                });
            }
            ArmOrder::Feature(request, reply) => {
                let results = self.probe(folder, &[request.id], &request.settings, arm, None);
                let none = || {
                    self.done(not_probed(
                        request.id,
                        ProbeResult::ARM_NOT_READY,
                        NO_TARGETS,
                    ))
                };
                self.link.common.done();
                reply.send(ProbeFeatureResponse {
                    result: results.into_iter().next().unwrap_or_else(none),
                });
            }
            ArmOrder::Goal(goal, handles) => self.goal(folder, &goal, handles, arm),
        }
    }

    fn goal(&mut self, folder: &Path, goal: &ProbeGoal, handles: Goal, arm: &mut dyn Arm) {
        let Goal {
            accept,
            feedback,
            result,
            is_cancelled,
        } = handles;
        accept.send(true);
        let results = self.probe(
            folder,
            &goal.ids,
            &goal.settings,
            arm,
            Some((&feedback, &is_cancelled)),
        );
        let response = response_of(&results, self.header());
        let was_broken_off = results
            .last()
            .is_some_and(|last| last.code == ProbeResult::CANCELLED);
        let end = match response.code {
            // only for a cancel by the client: a pause ends a goal too
            _ if was_broken_off && is_cancelled.load(Ordering::Acquire) => GoalEnd::Canceled,
            code if code < ProbeResult::CANCELLED => GoalEnd::Succeeded,
            _ => GoalEnd::Aborted,
        };
        self.link.common.done();
        result.send((end, response));
    }

    /// Doubts about the check of the arm, as an addition to an ending; empty: none.
    fn doubts_of_check(&self) -> String {
        let scene = &self.link.setup.input.scene;
        let standing = scene.check_standing(SystemTime::now());
        let doubtful = standing.filter(|standing| !standing.doubts.is_empty());
        doubtful.map_or_else(String::new, |standing| format!("; {standing}"))
    }

    /// Stamps a result and publishes it, for followers and for the caller.
    fn done(&self, result: ProbeResult) -> ProbeResult {
        let result = ProbeResult {
            header: self.header(),
            ..result
        };
        self.port.publish(Publication::ProbeResult(result.clone()));
        result
    }

    fn header(&self) -> Header {
        header(self.port.now_ns(), &self.link.setup.shared.frame)
    }

    /// Probes the requested features, one after the other; returns a result for each feature begun.
    fn probe(
        &mut self,
        folder: &Path,
        ids: &[u32],
        settings: &ProbeSettings,
        arm: &mut dyn Arm,
        watched: Option<GoalWatcher<'_>>,
    ) -> Vec<ProbeResult> {
        let targets = match self.targets(ids, arm) {
            Ok(targets) => targets,
            Err(refusal) => return vec![self.done(*refusal)],
        };
        let count = targets.len();
        let mut results: Vec<ProbeResult> = Vec::new();
        for (number, target) in targets.into_iter().enumerate() {
            let result = match self.wanted(settings, &target) {
                _ if is_cancelled(watched) => refused(
                    &target,
                    ProbeResult::CANCELLED,
                    "cancelled before it was begun".to_owned(),
                ),
                Err((code, why)) => refused(&target, code, why),
                Ok(wanted) => {
                    self.probe_one(folder, &target, &wanted, arm, watched, [number, count])
                }
            };
            // a cancel or a stop ends the series
            let goes_on = result.code < ProbeResult::CANCELLED
                || matches!(
                    result.code,
                    ProbeResult::OUT_OF_LIMITS
                        | ProbeResult::NO_CLEAR_PATH
                        | ProbeResult::BAD_REQUEST
                );
            results.push(self.done(result));
            if !goes_on {
                break;
            }
        }
        results
    }

    /// The flagged features in the requested order, or nearest first.
    fn targets(&mut self, ids: &[u32], arm: &mut dyn Arm) -> Result<Vec<Flag>, Box<ProbeResult>> {
        let (to, targets) = sync_channel(1);
        let asked = self
            .features
            .try_send(FeatureInput::Targets(ids.to_vec(), to));
        let answer = asked.ok().and_then(|()| self.wait(arm, &targets));
        let first = ids.first().copied().unwrap_or(0);
        let mut targets = answer
            .ok_or_else(|| Box::new(not_probed(first, ProbeResult::ARM_NOT_READY, NO_TARGETS)))?;
        if let Some(missing) = ids
            .iter()
            .find(|id| targets.iter().all(|target| target.id != **id))
        {
            let why = format!("there is no feature with the number {missing}: flag it first");
            return Err(Box::new(not_probed(
                *missing,
                ProbeResult::NO_SUCH_FEATURE,
                &why,
            )));
        }
        if ids.is_empty() {
            let tip = self
                .link
                .common
                .last()
                .map(|state| self.run.cell.place(&state.pose_bt))
                .unwrap_or_default();
            let far = |target: &Flag| (target.place - tip).norm();
            targets.sort_by(|a, b| far(a).total_cmp(&far(b)));
        }
        Ok(targets)
    }

    fn wanted(
        &self,
        settings: &ProbeSettings,
        target: &Flag,
    ) -> Result<RequestSettings, (u8, String)> {
        let wanted = RequestSettings::of(settings, &self.params, target.kind)?;
        if !wanted.is_dry_run {
            if !self.link.setup.input.scene.allows_motion() {
                let why = "the arm may not move: look at a dry run first, then set robot.allow_motion: true in the scene";
                return Err((ProbeResult::MOTION_NOT_ALLOWED, why.to_owned()));
            }
            match self.link.common.stops.why(StopRequest::Retract) {
                Some((code @ ProbeResult::MOTION_NOT_ALLOWED, why)) => {
                    let how = "look at a dry run first, then start the node again with -p allow_motion:=true";
                    return Err((code, format!("{why}: {how}")));
                }
                Some((code, why)) => return Err((code, why.to_owned())),
                None => {}
            }
        }
        self.link
            .common
            .ready()
            .map_err(|why| (ProbeResult::ARM_NOT_READY, why))?;
        Ok(wanted)
    }

    fn probe_one(
        &mut self,
        folder: &Path,
        target: &Flag,
        wanted: &RequestSettings,
        arm: &mut dyn Arm,
        watched: Option<GoalWatcher<'_>>,
        counts: [usize; 2],
    ) -> ProbeResult {
        let not_ready = |why: &str| refused(target, ProbeResult::ARM_NOT_READY, why.to_owned());
        let Some(state) = self.link.common.last() else {
            return not_ready("nothing has come from the arm yet");
        };
        let (run, params, flag) = (self.run.clone(), wanted.params.clone(), *target);
        let ready = ask_mesh(&self.link.setup, move |still| {
            let planned = run.plan(&params, &flag, &state, &still);
            (still, planned)
        });
        let Some((still, planned)) = self.wait(arm, &ready) else {
            return not_ready("the mesh was not complete in time: probe again");
        };
        match planned {
            Ok(planned) => {
                self.publish_path(&planned);
                if wanted.is_dry_run {
                    return planned_result(target, &planned);
                }
            }
            // no such pattern or quantity
            Err(error) => {
                let why = format!("nothing is planned: {error}");
                return refused(target, ProbeResult::BAD_REQUEST, why);
            }
        }
        let mut world = ArmWorld::new(&self.link, still, watched, counts);
        let probed = self.run.probe(&wanted.params, target, arm, &mut world);
        self.link.common.stops.enter(ArmMotion::Rests);
        info!(feature = target.id, ending = %probed.ending, touches = probed.touches.len(), "probed");
        if let Ending::Stopped(_) = &probed.ending {
            self.link.common.stop(&probed.ending.to_string());
        }
        self.pass_on(folder, target, &probed);
        self.result(target, &probed)
    }

    fn publish_path(&self, planned: &Plan) {
        let pose = |place| PoseStamped {
            header: header(0, &self.link.setup.shared.frame),
            pose: Pose {
                position: point(place),
                ..Pose::default()
            },
        };
        self.port.publish(Publication::Path(PathMsg {
            header: self.header(),
            poses: planned.path.iter().map(pose).collect(),
        }));
    }

    /// Passes touches and measurement of a feature to the session's folder, the topics and the
    /// features.
    fn pass_on(&self, folder: &Path, target: &Flag, probed: &FlagResult) {
        let ball_radius = self.params.pattern.ball_radius;
        let offset_ns = self.link.offset_ns.unwrap_or(0);
        let path = folder.join(TOUCHES);
        if let Err(error) = append_probed_touches(probed, ball_radius, offset_ns, &path) {
            warn!(%error, "the touches of a feature are on the topic alone");
        }
        let surfaces = &probed.known_surfaces;
        let path = known_surfaces_beside(&folder.join(SessionRecord::RECORDING));
        match append_known_surfaces(&path, surfaces, ball_radius) {
            Ok(surfaces) => surfaces.into_iter().for_each(|known| {
                // without a receiver the node ends
                let _ = self.known.send((folder.to_owned(), known));
            }),
            Err(error) => warn!(%error, "the surfaces of a feature are not known to its mesh"),
        }
        if let Some(measured) = measured(folder, probed) {
            let measured = FeatureInput::Measured(Box::new(measured));
            if self.features.try_send(measured).is_err() {
                warn!(
                    feature = target.id,
                    "what was measured is in the answer, and not among the features"
                );
            }
        }
        let (cell, frame) = (&self.run.cell, &self.link.setup.shared.frame);
        for touch in touches_of(target, probed, ball_radius, cell, offset_ns, frame) {
            self.port.publish(Publication::ProbeTouch(touch));
        }
    }

    fn result(&self, target: &Flag, probed: &FlagResult) -> ProbeResult {
        let mut result = result_of(target, probed);
        if let Ending::Cancelled(request) = probed.ending
            && let Some((code, why)) = self.link.common.stops.why(request)
        {
            result.message = format!("{why}: {}", result.message);
            // the remaining features are refused before they begin
            if code == ProbeResult::SHUTDOWN {
                result.code = code;
            }
        }
        result.message += &self.doubts_of_check();
        result
    }
}

/// The measured feature, unless its probing was broken off.
///
/// - `folder`: of the session.
fn measured(folder: &Path, probed: &FlagResult) -> Option<ArmMeasurement> {
    let is_whole = matches!(
        probed.ending,
        Ending::ToleranceReached
            | Ending::TouchesSpent
            | Ending::CalibrationLimits { .. }
            | Ending::TimeSpent
    );
    let found = probed.found.as_ref().filter(|_| is_whole)?;
    let session = folder.file_name().unwrap_or_default().to_string_lossy();
    Some(ArmMeasurement {
        session: session.into_owned(),
        id: probed.flag,
        feature: found.feature.clone()?,
        // a quantity not known well enough stays requested
        is_done: matches!(probed.ending, Ending::ToleranceReached),
    })
}

/// File of touches, beside the recording of a session.
const TOUCHES: &str = "probed_touches.jsonl";
const BUSY: &str = "the arm works at an order: wait, or cancel that";
const HAS_ENDED: &str = "the arm's thread has ended: start the node again";
const NO_TARGETS: &str = "the features did not answer in time: ask again";
