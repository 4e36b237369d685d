//! A node with an arm, without any network, in the time of the arm.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use tempfile::TempDir;
use touchup::clock::{Clock, ManualClock};
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::io::recording::LiveMessage;
use touchup::node::{ArmKind, ArmOfNode, Node, NodeEnd, PreparedNode};
use touchup::probing::arm::{Arm, ArmError, ArmState, Command};
use touchup::ros::in_process::{OtherParticipants, start};
use touchup::ros::inbox::inbox;
use touchup::ros::messages::{
    FlagFeatureRequest, Header, Point, PointStamped, ProbeFeatureRequest, ProbeFeedback, ProbeGoal,
    ProbeResponse, ProbeResult, ProbeSettings,
};
use touchup::ros::parameters::{ParameterValue, Parameters};
use touchup::ros::port::{
    ArmOrder, Arrival, Call, Feedback, Goal, GoalEnd, Publication, Reply, SamplePort,
};
use touchup::sim::{ArmParams, Plate, SimArm};

use super::samples::bench::join;
use crate::plate_stream::plate_scan;

/// Limit of any wait: a node that needs longer hangs.
pub const HUNG: Duration = Duration::from_secs(120);
/// Samples that wait for the node at most: an arm in lock step is not ahead of it by more.
const FEW: usize = 8;

/// A node with an arm whose states pass the time: as fast as the node keeps up, and no faster.
pub struct Cell {
    pub node: Node,
    pub world: OtherParticipants,
    pub hand: ManualClock,
    published: Vec<Publication>,
    _folder: TempDir,
}

impl Cell {
    /// The plate of the demo, its scan, a simulated arm.
    pub fn start(may_move: bool) -> Self {
        Self::with(may_move, |_| {
            ArmKind::Sim(Box::new(Plate::default().mesh(1e-5).unwrap()))
        })
    }

    pub fn with(may_move: bool, kind: impl FnOnce(&Clock) -> ArmKind) -> Self {
        Self::on(may_move, |clock, world| ArmOfNode {
            kind: kind(clock),
            samples: Box::new(world.clone()),
        })
    }

    pub fn on(may_move: bool, arm: impl FnOnce(&Clock, &OtherParticipants) -> ArmOfNode) -> Self {
        let cell = Self::begin(may_move, arm);
        let begun = Instant::now();
        while !cell.state().0 {
            assert!(begun.elapsed() < HUNG, "{}", cell.state().1);
            std::thread::yield_now();
        }
        cell
    }

    /// As [`Self::on`], for any state of the arm.
    pub fn begin(
        may_move: bool,
        arm: impl FnOnce(&Clock, &OtherParticipants) -> ArmOfNode,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        write_mesh(&path("scan.ply"), &plate_scan(1), MeshUnit::Millimetre).unwrap();
        std::fs::write(
            path("scene.yaml"),
            include_str!("../../../config/probe.yaml"),
        )
        .unwrap();
        let mut parameters = Parameters::default();
        let text =
            |value: &std::path::Path| ParameterValue::String(value.to_str().unwrap().to_owned());
        parameters.set("scene", &text(&path("scene.yaml"))).unwrap();
        parameters
            .set("session_folder", &text(&path("sessions")))
            .unwrap();
        parameters
            .set("source", &ParameterValue::String("probe".to_owned()))
            .unwrap();
        parameters
            .set("allow_motion", &ParameterValue::Bool(may_move))
            .unwrap();
        let (clock, hand) = Clock::lock_step();
        let (inbox, arrivals) = inbox(FEW, &clock);
        let (port, world) = start(inbox, &clock);
        world.set_now_ns(1_000_000_000_000);
        let arm = arm(&clock, &world);
        let node = PreparedNode::on(clock, parameters)
            .unwrap()
            .start(port, arrivals, Some(arm))
            .unwrap();
        Self {
            node,
            world,
            hand,
            published: Vec::new(),
            _folder: folder,
        }
    }

    pub fn state(&self) -> (bool, String) {
        let answer = self.world.call(Call::ArmState).recv().unwrap();
        (answer.success, answer.message)
    }

    /// Of the tip over the object's origin, mm.
    pub fn height(&self) -> f64 {
        let state = self.state().1;
        let numbers: Vec<f64> = state
            .split([' ', '(', ')'])
            .filter_map(|word| word.parse().ok())
            .collect();
        *numbers.last().unwrap()
    }

    pub fn flag(&self, kind: u8, [x, y, z]: [f64; 3]) -> u32 {
        let header = Header {
            frame_id: "object".to_owned(),
            ..Header::default()
        };
        let request = FlagFeatureRequest {
            kind,
            point: PointStamped {
                header,
                point: Point {
                    x: x / 1e3,
                    y: y / 1e3,
                    z: z / 1e3,
                },
            },
            search_radius: 3e-3,
        };
        let answer = self
            .world
            .call(|reply| Call::Flag(request, reply))
            .recv()
            .unwrap();
        assert!(answer.success, "{}", answer.message);
        answer.id
    }

    pub fn probe(&self, id: u32, settings: ProbeSettings) -> ProbeResult {
        let request = ProbeFeatureRequest { id, settings };
        self.world
            .call(|reply| Call::Arm(ArmOrder::Feature(request, reply)))
            .recv()
            .unwrap()
            .result
    }

    /// Sends a goal, and does something at its third touch, while the arm waits for that; returns
    /// its end.
    ///
    /// - `at_third`: gets the flag that cancels the goal
    pub fn goal(
        &self,
        ids: &[u32],
        at_third: impl FnOnce(&AtomicBool) + Send + 'static,
    ) -> (GoalEnd, ProbeResponse) {
        let (cancel, at_third) = (Arc::new(AtomicBool::new(false)), Mutex::new(Some(at_third)));
        let cancelled = Arc::clone(&cancel);
        self.send_goal(ids, cancelled, move |feedback| {
            if feedback.touch >= 3
                && let Some(at_third) = at_third.lock().unwrap().take()
            {
                at_third(&cancel);
            }
        })
    }

    /// Sends a goal; returns its end.
    ///
    /// - `is_cancelled`: cancels the goal
    pub fn send_goal(
        &self,
        ids: &[u32],
        is_cancelled: Arc<AtomicBool>,
        feedback: impl Fn(ProbeFeedback) + Send + 'static,
    ) -> (GoalEnd, ProbeResponse) {
        let (to, result) = sync_channel(1);
        let goal = Goal {
            accept: Reply::new(|accepted: bool| assert!(accepted)),
            feedback: Feedback(Box::new(feedback)),
            result: Reply::new(move |ended| drop(to.send(ended))),
            is_cancelled,
        };
        let asked = ProbeGoal {
            ids: ids.to_vec(),
            settings: ProbeSettings::default(),
        };
        assert!(
            self.world
                .arrive_patiently(Arrival::Call(Call::Arm(ArmOrder::Goal(asked, goal))))
        );
        result.recv_timeout(HUNG).unwrap()
    }

    pub fn recover(&self) -> (bool, String) {
        let answer = self
            .world
            .call(|reply| Call::Arm(ArmOrder::Recover(reply)))
            .recv()
            .unwrap();
        (answer.success, answer.message)
    }

    pub fn end(mut self) -> (NodeEnd, Vec<Publication>) {
        self.world.arrive_patiently(Arrival::Shutdown);
        let end = join(self.node, &self.hand);
        self.published.extend(self.world.published());
        (end, self.published)
    }
}

/// Samples of an arm; a slow node loses them, as on a network.
pub struct Lossy {
    pub world: OtherParticipants,
    pub clock: Clock,
}

impl SamplePort for Lossy {
    fn publish(&self, message: LiveMessage) -> bool {
        let now = self.clock.now();
        self.world.arrive(Arrival::Message(message, now))
    }

    fn listeners(&mut self) -> [usize; 2] {
        [1, 1]
    }
}

/// A request to the thread of an arm, with the channel of its answer.
enum Asked {
    State(SyncSender<Result<ArmState, ArmError>>),
    Command(Command, SyncSender<Result<(), ArmError>>),
    Zero(SyncSender<Result<(), ArmError>>),
}

/// A simulated arm on a thread of its own, in the time of a clock.
pub struct SimulatedArm {
    asks: SyncSender<Asked>,
    clock: Clock,
}

impl SimulatedArm {
    pub fn new(clock: &Clock) -> Self {
        let (asks, asked) = sync_channel::<Asked>(1);
        std::thread::spawn(move || {
            let (plate, params) = (Plate::default(), ArmParams::default());
            let start = params.pose_bo * Isometry3::translation(30e-3, 25e-3, 52e-3);
            let mut arm = SimArm::new(&plate, params.clone(), &start).unwrap();
            for asked in asked {
                match asked {
                    Asked::State(to) => drop(to.send(arm.next_state())),
                    Asked::Command(command, to) => drop(to.send(arm.command(&command))),
                    Asked::Zero(to) => drop(to.send(arm.zero_sensor())),
                }
            }
        });
        Self {
            asks,
            clock: clock.clone(),
        }
    }

    fn ask<T>(&self, what: impl FnOnce(SyncSender<T>) -> Asked) -> T {
        let (to, answer) = sync_channel(1);
        self.asks.send(what(to)).unwrap();
        answer.recv().unwrap()
    }
}

impl Arm for SimulatedArm {
    fn next_state(&mut self) -> Result<ArmState, ArmError> {
        self.clock.sleep(Duration::from_millis(2));
        self.ask(Asked::State)
    }

    fn command(&mut self, command: &Command) -> Result<(), ArmError> {
        self.ask(|to| Asked::Command(*command, to))
    }

    fn zero_sensor(&mut self) -> Result<(), ArmError> {
        self.ask(Asked::Zero)
    }

    fn recover(&mut self) -> Result<(), ArmError> {
        Ok(())
    }

    fn period(&self) -> f64 {
        2e-3
    }
}
