//! The sample thread: frames, pairing, haptic update. It alone has the refiner, and does little
//! else; `publishing.rs` has its output to the other threads.

use std::collections::{BTreeMap, VecDeque};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::{Duration, Instant};

use tracing::warn;

use super::arm::ArmHandle;
use super::channels::{FeatureInput, ViewInput};
use super::error::NodeError;
use super::input::acceptance::Acceptance;
use super::input::doubts::InputDoubts;
use super::input::frame_resolver::{FrameNames, FrameResolver, Refusal};
use super::input::streams::StreamWatch;
use super::session::{NodeEnd, NodeSession};
use super::setup::Setup;
use super::side_work::SideWork;
use super::take_out::TakingOut;
use super::uncertainty::UncertaintyWork;
use crate::ros::convert::frame_transform;
use crate::ros::inbox::Arrivals;
use crate::ros::mesh_feed::Edits;
use crate::ros::messages::TFMessage;
use crate::ros::port::{Arrival, Endpoint, Port};
use crate::ros::stop::StopState;
use touchup_io::recording::LiveMessage;
use touchup_method::stylus::{
    FrameError, FrameTransform, Message, MovingFrame, Sample, WrenchFrame,
};
use touchup_session::live::LiveError;
use touchup_session::refinement::reason_of_refusal;

/// Period of stream checks without messages.
const IDLE: Duration = Duration::from_millis(10);
/// Period of mesh changes to the view.
const EDITS_EVERY: Duration = Duration::from_millis(5);
/// Period of diagnostics.
const DIAGNOSTICS_EVERY: Duration = Duration::from_secs(1);
/// Time without samples after which the streams rest: longer than the time of a renewal, and than
/// usual gaps between poses.
const RESTS_AFTER: Duration = Duration::from_millis(50);
/// Period of warnings about unreadable messages of each topic, with their count.
const UNREADABLE_EVERY: Duration = Duration::from_secs(10);
/// First stamp beyond the seconds of a message, ns: 2038.
const END_OF_TIME_NS: i64 = (1 << 31) * 1_000_000_000;
/// Time without samples after which the mesh settles to the state of a saved file. A hand lifts the
/// stylus for less.
pub(super) const SETTLES_AFTER: Duration = Duration::from_millis(500);
/// Maximum number of messages of a stream that wait for a transform.
const MOST_WAITING: usize = 4096;

/// State of the sample thread.
pub struct RefinementWorker {
    pub(super) setup: Arc<Setup>,
    pub(super) port: Arc<dyn Port>,
    pub(super) view: SyncSender<ViewInput>,
    pub(super) features: SyncSender<FeatureInput>,
    pub(super) spare: Receiver<Box<Edits>>,
    /// handle of the arm, if any
    pub(super) arm: Option<ArmHandle>,
    /// changes refused by a full view, or a list to fill
    pub(super) edits: Option<Box<Edits>>,
    pub(super) resolver: FrameResolver,
    /// frame whose transforms give the pose of the stylus, if any
    pub(super) moving: Option<MovingFrame>,
    pub(super) session: NodeSession,
    /// poses and wrenches waiting for a transform, and their arrival
    waiting: [VecDeque<(LiveMessage, Instant)>; 2],
    pub(super) streams: [StreamWatch; 2],
    pub(super) acceptance: Acceptance,
    pub(super) doubts: InputDoubts,
    /// topics with unreadable messages: time of the last warning, and number since
    unreadable: BTreeMap<&'static str, (Instant, u64)>,
    /// stop state of arm and samples
    pub(super) stops: Arc<StopState>,
    pub(super) fault: Option<String>,
    /// time and reason of the last refusal for unconnected frames
    pub(super) lost_transform: Option<(Instant, String)>,
    pub(super) last_state: String,
    /// start of the state
    pub(super) state_since: Instant,
    /// other participants on the topics
    pub(super) endpoints: BTreeMap<String, Endpoint>,
    /// ending sessions and running saves
    pub(super) side_work: SideWork,
    /// running removal or restoration of a touch
    pub(super) taking_out: Option<TakingOut>,
    /// computation of the uncertainty of vertices, for followers of the mesh
    pub(super) uncertainty: UncertaintyWork,
    pub(super) sampled: Instant,
    /// time of the last sample before the last change of the mesh
    pub(super) moved: Instant,
    edits_sent: Instant,
    pub(super) tip_published: Instant,
    pub(super) mismatch_ns: i64,
    pub(super) mismatch_rate_hz: f64,
    diagnosed: Instant,
}

impl RefinementWorker {
    /// Ready for samples; without an arm.
    pub fn new(
        setup: Arc<Setup>,
        port: Arc<dyn Port>,
        session: NodeSession,
        view: SyncSender<ViewInput>,
        features: SyncSender<FeatureInput>,
        spare: Receiver<Box<Edits>>,
        stops: Arc<StopState>,
    ) -> Self {
        let now = setup.clock.now();
        let (object, tool, sensor) = (
            setup.shared.frame.clone(),
            setup.tool.clone(),
            format!("{}_sensor", setup.source),
        );
        Self {
            mismatch_rate_hz: setup.shared.parameters().double("mismatch_rate_hz"),
            side_work: SideWork::on(setup.clock.clone()),
            taking_out: None,
            uncertainty: UncertaintyWork::on(setup.clock.clone()),
            doubts: InputDoubts::on(&setup.clock),
            moving: setup
                .pose_frames
                .as_ref()
                .map(|[frame, base]| MovingFrame::new(frame, base)),
            resolver: FrameResolver::new(
                FrameNames {
                    object,
                    tool,
                    sensor,
                },
                setup.input.scene.placement(),
            ),
            setup,
            port,
            view,
            features,
            spare,
            arm: None,
            edits: None,
            session,
            waiting: Default::default(),
            streams: [StreamWatch::new(now), StreamWatch::new(now)],
            acceptance: Acceptance::default(),
            unreadable: BTreeMap::new(),
            stops,
            fault: None,
            lost_transform: None,
            last_state: String::new(),
            state_since: now,
            endpoints: BTreeMap::new(),
            sampled: now,
            moved: now,
            edits_sent: now,
            tip_published: now,
            mismatch_ns: i64::MIN,
            diagnosed: now,
        }
    }

    /// The same worker with an arm for probing.
    pub fn with_arm(self, arm: Option<ArmHandle>) -> Self {
        Self { arm, ..self }
    }

    /// Runs until a shutdown or the end of all senders; ends the session.
    ///
    /// # Errors
    /// [`NodeError`] if the result was not written.
    pub fn run(mut self, inbox: Arrivals) -> Result<NodeEnd, NodeError> {
        loop {
            let flow = match inbox.recv_timeout(&self.setup.clock, IDLE) {
                Ok(arrival) => self.take(arrival),
                Err(RecvTimeoutError::Timeout) => ControlFlow::Continue(()),
                Err(RecvTimeoutError::Disconnected) => ControlFlow::Break(()),
            };
            if flow.is_break() {
                break;
            }
            self.tick();
        }
        self.know_probed();
        // the arm stops, retracts and ends while the session is written; later calls are refused
        self.arm = None;
        drop(inbox);
        self.give_up_taking_out("the node ends");
        self.end()
    }

    fn take(&mut self, arrival: Arrival) -> ControlFlow<()> {
        match arrival {
            Arrival::Message(message, at) => self.message(message, at),
            Arrival::Tf(transforms) => self.transforms(&transforms, false),
            Arrival::TfStatic(transforms) => self.transforms(&transforms, true),
            Arrival::ClickedPoint(clicked) => self.flag_clicked(&clicked),
            // samples carry their time in stamps; the port uses this one
            Arrival::Clock(_) => {}
            Arrival::Refused(stream, reason, at) => {
                self.streams[stream].arrive(self.setup.clock.now(), None, at);
                self.session.counters.refuse(reason);
            }
            Arrival::Unreadable(topic, why) => self.count_unreadable(topic, &why),
            Arrival::Call(call) => self.call(call),
            Arrival::SetParameter(name, value, reply) => {
                reply.send(self.set_parameter(&name, &value))
            }
            Arrival::Matched(endpoint) => self.note_endpoint(endpoint),
            Arrival::Viewers(count) => self.setup.shared.note_viewers(count),
            Arrival::Replay(step, reply) => reply.send(self.replay_step(step)),
            Arrival::Shutdown => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    fn count_unreadable(&mut self, topic: &'static str, why: &str) {
        self.session.counters.refuse("unreadable");
        let now = self.setup.clock.now();
        let (said, count) = self.unreadable.entry(topic).or_insert((now, 0));
        *count += 1;
        if *count == 1 && now == *said || now.saturating_duration_since(*said) >= UNREADABLE_EVERY {
            warn!(topic, count, why, "messages could not be read");
            (*said, *count) = (now, 0);
        }
    }

    fn transforms(&mut self, message: &TFMessage, is_static: bool) {
        let links: Vec<FrameTransform> = message
            .transforms
            .iter()
            .filter_map(frame_transform)
            .collect();
        let frames = &mut self.resolver.frames;
        let refused = match &mut self.moving {
            Some(moving) => moving.push(frames, &links, is_static),
            None => links
                .iter()
                .filter(|link| !frames.insert(link, is_static))
                .count() as u64,
        };
        let refused = refused + (message.transforms.len() - links.len()) as u64;
        (0..refused).for_each(|_| self.session.counters.refuse("bad_transform"));
        while let Some(pose) = self.next_moving_pose() {
            self.message(pose, self.setup.clock.now());
        }
        self.retry_waiting();
    }

    /// The next pose from the transforms.
    fn next_moving_pose(&mut self) -> Option<LiveMessage> {
        let moving = self.moving.as_mut()?;
        let pose = moving.next_pose(&self.resolver.frames);
        (0..moving.take_apart()).for_each(|_| self.session.counters.refuse("transforms_apart"));
        pose.map(|pose| LiveMessage {
            frame: moving.base().to_owned(),
            message: Message::Pose(pose),
        })
    }

    fn message(&mut self, message: LiveMessage, at: Instant) {
        let stream = stream_of(&message.message);
        let stamp_ns = Some(message.message.stamp_ns()).filter(|stamp_ns| *stamp_ns >= 0);
        self.streams[stream].arrive(self.setup.clock.now(), stamp_ns, at);
        if self.stops.is_paused() || self.fault.is_some() {
            self.session.counters.paused += 1;
            return;
        }
        match self.waiting[stream].len() {
            0 => {
                let left = self.place(message, at);
                self.waiting[stream].extend(left.map(|message| (message, at)));
            }
            MOST_WAITING.. => self.session.counters.refuse("transform"),
            // behind waiting messages, to keep the order
            _ => {
                self.waiting[stream].push_back((message, at));
                self.retry_waiting();
            }
        }
    }

    /// Retries messages waiting for a transform; refuses those that have waited too long.
    fn retry_waiting(&mut self) {
        let now = self.setup.clock.now();
        let longest =
            Duration::from_secs_f64(self.setup.shared.parameters().double("stale_ms") / 1e3);
        for stream in 0..2 {
            while let Some((message, at)) = self.waiting[stream].pop_front() {
                let Some(message) = self.place(message, at) else {
                    continue;
                };
                if now.saturating_duration_since(at) <= longest {
                    self.waiting[stream].push_front((message, at));
                    break;
                }
                self.session.counters.refuse("transform");
                self.lost_transform = Some((
                    now,
                    "no transform of a moving frame has come up to the stamps of the messages"
                        .to_owned(),
                ));
            }
        }
    }

    /// Transforms a message and passes it on; returns it if a transform is still missing.
    fn place(&mut self, message: LiveMessage, at: Instant) -> Option<LiveMessage> {
        match self.resolver.recorded(&message) {
            Ok(recorded) => self.pair(recorded, at),
            Err(Refusal::Frame(FrameError::NotYet(..))) => return Some(message),
            Err(refusal) => {
                self.session.counters.refuse(refusal.name());
                if let Refusal::Frame(error) = &refusal {
                    self.lost_transform = Some((self.setup.clock.now(), error.to_string()));
                }
            }
        }
        None
    }

    /// Passes a transformed message to the synchroniser and the recording, and complete samples to
    /// the refiner.
    fn pair(&mut self, message: Message, at: Instant) {
        let stream = stream_of(&message);
        // the first wrench shows object axes: without any push yet, everything starts again
        if self.resolver.axes == Some(WrenchFrame::Object)
            && self.session.axes == WrenchFrame::Sensor
            && let Err(error) = self.session.turn_axes(&self.setup, WrenchFrame::Object)
        {
            self.fault = Some(error.to_string());
        }
        let message = shifted(message, self.session.epoch.shift_ns);
        if !(0..END_OF_TIME_NS).contains(&message.stamp_ns()) {
            self.session.counters.refuse("stamp");
            return;
        }
        let placed = self.resolver.placed(message);
        self.session.input.message(&placed);
        let is_taken = self.session.sync.push(placed);
        if self.session.epoch.note(
            stream,
            message.stamp_ns(),
            is_taken,
            self.session.sync.newest_ns(),
        ) {
            warn!("the clock of both streams was set back: they are taken up where they are now");
            self.resolver.frames.forget_moving();
        }
        if is_taken && let Some(recorder) = self.session.keeping.recorder() {
            let frame = match (stream, self.session.axes) {
                (1, WrenchFrame::Sensor) => self.setup.source,
                _ => self.resolver.recorded_frame(),
            };
            recorder.write(message, frame);
        }
        while let Some(sample) = self.session.sync.next_sample() {
            self.sample(&sample, Some(at));
        }
    }

    /// Moves the mesh and publishes the mismatch, then follows the patch and sends changes to the
    /// others.
    ///
    /// - `at`: arrival of the message that completed the sample, if any.
    pub(super) fn sample(&mut self, sample: &Sample, at: Option<Instant>) {
        self.follow_record(sample.stamp_ns);
        let begun = self.setup.clock.now();
        let answer = self.session.engine.answer(sample);
        let answered = self.setup.clock.now();
        if let Some(at) = at {
            self.session
                .latencies
                .record(answered.saturating_duration_since(at));
        }
        self.sampled = begun;
        match answer {
            Ok(update) => {
                self.session.counters.accepted += 1;
                self.session.last_ns = Some(sample.stamp_ns);
                self.session.input.sample(sample);
                if let Some(contact) = self.session.engine.refiner().contacts().latest() {
                    self.session.input.contact(contact);
                }
                self.publish_mismatch(&update);
                let following = self.setup.clock.now();
                let followed = self.session.engine.follow();
                let work =
                    answered.saturating_duration_since(begun) + self.setup.clock.since(following);
                self.session.pushes.record(work);
                self.note_patch_behind(sample.stamp_ns);
                match followed {
                    Ok(()) => self.note_changes(),
                    Err(error) => self.fail(&error),
                }
            }
            Err(error @ LiveError::Refine(_)) => {
                self.session.counters.refuse(reason_of_refusal(&error));
            }
            Err(error) => self.fail(&error),
        }
    }

    fn note_patch_behind(&mut self, stamp_ns: i64) {
        let Some(until_ns) = self.session.engine.patched_until_ns() else {
            return;
        };
        let behind = Duration::from_nanos(stamp_ns.saturating_sub(until_ns).max(0) as u64);
        self.session.behind.record(behind);
        self.session.behind_lately.record(behind);
    }

    pub(super) fn fail(&mut self, error: &impl std::fmt::Display) {
        warn!(%error, "no samples are taken any more");
        self.fault = Some(error.to_string());
    }

    /// Gives a changed mesh a new version; sends new touches to the features.
    fn note_changes(&mut self) {
        let edits = self.session.engine.edits();
        if std::mem::replace(&mut self.session.edits, edits) != edits {
            self.session.version += 1;
            self.moved = self.sampled;
        }
        if let Some(changes) = self.session.engine.take_probed() {
            self.session.probed.extend(changes);
            self.send_probed();
        }
    }

    /// Does periodic work.
    fn tick(&mut self) {
        let now = self.setup.clock.now();
        if now.saturating_duration_since(self.edits_sent) >= EDITS_EVERY {
            self.edits_sent = now;
            let rested = now.saturating_duration_since(self.sampled);
            if self.fault.is_none() && rested >= RESTS_AFTER {
                // the mesh follows the patch to its latest state, so that the view is not left
                // behind
                let engine = &mut self.session.engine;
                match if rested >= SETTLES_AFTER {
                    engine.settle().map(drop)
                } else {
                    engine.rest()
                } {
                    Ok(()) => self.note_changes(),
                    Err(error) => self.fail(&error),
                }
            }
            self.know_probed();
            self.go_on_taking_out();
            self.send_edits();
            self.go_on_with_uncertainty(now);
            self.send_probed();
            self.retry_waiting();
            if !self.session.keeping.is_replayed() {
                self.watch_streams();
            }
        }
        // in a replay the streams rest whenever the replay does
        if now.saturating_duration_since(self.diagnosed) >= DIAGNOSTICS_EVERY
            && !self.session.keeping.is_replayed()
        {
            self.diagnosed = now;
            self.doubts.look(
                &self.setup,
                &self.session.input,
                self.session.counters.accepted,
            );
            self.publish_diagnostics();
        }
    }

    /// Takes the surfaces of probed features for known, if they are of this session.
    fn know_probed(&mut self) {
        let known: Vec<_> = self.arm.iter().flat_map(ArmHandle::known).collect();
        for (folder, known) in known {
            if folder == self.session.folder.path()
                && let Err(error) = self.session.engine.know(known)
            {
                warn!(%error, "the mesh does not follow a surface of a probed feature");
            }
        }
    }

    /// Switches to another session; returns the previous one.
    pub(super) fn change_session(&mut self, next: NodeSession) -> NodeSession {
        // its wrenches may have other axes
        (self.resolver.axes, self.waiting, self.mismatch_ns) = (None, Default::default(), i64::MIN);
        // changes of the previous session do not apply to this one
        self.doubts.restart();
        self.uncertainty.restart();
        self.give_up_taking_out("a new session has begun");
        self.edits.iter_mut().for_each(|edits| edits.clear());
        std::mem::replace(&mut self.session, next)
    }
}

/// Index of the stream: poses, wrenches.
fn stream_of(message: &Message) -> usize {
    usize::from(matches!(message, Message::Wrench(_)))
}

fn shifted(mut message: Message, shift_ns: i64) -> Message {
    match &mut message {
        Message::Pose(pose) => pose.stamp_ns = pose.stamp_ns.saturating_add(shift_ns),
        Message::Wrench(wrench) => wrench.stamp_ns = wrench.stamp_ns.saturating_add(shift_ns),
    }
    message
}
