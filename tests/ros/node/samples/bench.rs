//! A node with the world around it in process, and the demo plate as the touched part.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use tempfile::TempDir;
use touchup::clock::{Clock, ManualClock};
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::io::recording::{LiveMessage, Topics, write_recording};
use touchup::mesh::TriMesh;
use touchup::node::{INBOX, Node, NodeEnd, PreparedNode};
use touchup::ros::in_process::{OtherParticipants, start};
use touchup::ros::inbox::inbox;
use touchup::ros::messages::{
    Header, MeshPatch, Quaternion, Time, Transform, TransformStamped, Vector3,
};
use touchup::ros::parameters::{ParameterValue, Parameters};
use touchup::ros::port::{Arrival, Call, Publication, Reply};
use touchup::sim::StylusParams;
use touchup::stylus::{Message, StampedPose};

use crate::plate_stream::plate_stream;

/// Scan and recording of the demo plate, or the first share of it.
pub struct Plate {
    pub folder: TempDir,
    pub scan: TriMesh,
    pub messages: Vec<Message>,
}

impl Plate {
    /// The first share: long strokes over its top.
    pub fn touched(share: f64) -> Self {
        Self::of(|count| 0..(count as f64 * share) as usize)
    }

    /// The last share: short strokes in holes and slots.
    pub fn touched_last(share: f64) -> Self {
        Self::of(|count| (count as f64 * (1.0 - share)) as usize..count)
    }

    fn of(share: impl Fn(usize) -> std::ops::Range<usize>) -> Self {
        let (stream, touch) = plate_stream(&StylusParams::default(), 1);
        assert!(
            stream.noise > 0.0 && !stream.samples.is_empty(),
            "a bad scan, and a touch that pairs"
        );
        let mut messages = touch.messages;
        messages.sort_by_key(Message::stamp_ns);
        let messages = messages[share(messages.len())].to_vec();
        let plate = Self {
            folder: tempfile::tempdir().unwrap(),
            scan: stream.scan,
            messages,
        };
        write_mesh(&plate.path("scan.ply"), &plate.scan, MeshUnit::Millimetre).unwrap();
        plate.record("touch.mcap", &plate.messages);
        plate
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn record(&self, name: &str, messages: &[Message]) {
        write_recording(
            &self.path(name),
            &Topics::default(),
            "object",
            "stylus",
            messages.iter().copied(),
        )
        .unwrap();
    }

    /// `touchup refine` of a recording.
    pub fn refined(&self, recording: &str) -> Vec<u8> {
        let (scan, bag, out) = (
            self.path("scan.ply"),
            self.path(recording),
            self.path("refined.ply"),
        );
        refine(&[
            "--scan".as_ref(),
            scan.as_os_str(),
            "--bag".as_ref(),
            bag.as_os_str(),
            "--out".as_ref(),
            out.as_os_str(),
            "--tip-radius-mm=1.5".as_ref(),
        ]);
        std::fs::read(out).unwrap()
    }
}

/// Runs `touchup refine`; a recording that has lost its end is no failure.
pub fn refine(arguments: &[&std::ffi::OsStr]) {
    let done = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .arg("refine")
        .args(arguments)
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&done.stderr);
    assert!(matches!(done.status.code(), Some(0 | 4)), "{output}");
}

fn header(stamp_ns: i64, frame: &str) -> Header {
    let (sec, nanosec) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
    Header {
        stamp: Time {
            sec: sec as i32,
            nanosec: nanosec as u32,
        },
        frame_id: frame.to_owned(),
    }
}

pub fn in_frame(message: &Message, frame: &str) -> LiveMessage {
    LiveMessage {
        frame: frame.to_owned(),
        message: *message,
    }
}

/// A pose as measured from `place` (in O).
pub fn seen_from(message: &Message, place: &Isometry3<f64>, frame: &str) -> LiveMessage {
    let Message::Pose(measured) = message else {
        panic!("no pose")
    };
    let pose_ot = place.inv_mul(&measured.pose_ot);
    let pose = Message::Pose(StampedPose {
        pose_ot,
        ..*measured
    });
    in_frame(&pose, frame)
}

pub fn transform(
    stamp_ns: i64,
    parent: &str,
    child: &str,
    pose: &Isometry3<f64>,
) -> TransformStamped {
    let header = header(stamp_ns, parent);
    let (p, q) = (pose.translation.vector, pose.rotation);
    let (translation, rotation) = (
        Vector3 {
            x: p.x,
            y: p.y,
            z: p.z,
        },
        Quaternion {
            x: q.i,
            y: q.j,
            z: q.k,
            w: q.w,
        },
    );
    TransformStamped {
        header,
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation,
            rotation,
        },
    }
}

/// Time passes in steps of this.
const STEP: Duration = Duration::from_millis(5);
/// Limit of any wait, in time of the clock, which waits for all threads of the node.
const NEVER: Duration = Duration::from_secs(60);

/// A node that runs, and the world around it. Its time stands still but for [`Self::pass`], and
/// during the waits here.
pub struct Bench {
    pub node: Node,
    pub world: OtherParticipants,
    clock: Clock,
    hand: ManualClock,
    published: Vec<Publication>,
}

impl Bench {
    pub fn start(plate: &Plate) -> Self {
        Self::with(plate, &[])
    }

    pub fn with(plate: &Plate, set: &[(&str, ParameterValue)]) -> Self {
        let mut parameters = Parameters::default();
        let text = |path: PathBuf| ParameterValue::String(path.to_str().unwrap().to_owned());
        parameters
            .set("scan", &text(plate.path("scan.ply")))
            .unwrap();
        parameters
            .set("session_folder", &text(plate.path("sessions")))
            .unwrap();
        parameters
            .set("tip_radius_mm", &ParameterValue::Double(1.5))
            .unwrap();
        for (name, value) in set {
            parameters.set(name, value).unwrap();
        }
        let (clock, hand) = Clock::manual();
        let (inbox, arrivals) = inbox(INBOX, &clock);
        let (port, world) = start(inbox, &clock);
        let node = PreparedNode::on(clock.clone(), parameters)
            .unwrap()
            .start(port, arrivals, None)
            .unwrap();
        Self {
            node,
            world,
            clock,
            hand,
            published: Vec::new(),
        }
    }

    /// All at once, without a loss. Every [`INBOX`] messages some time passes, in which the node
    /// takes them down.
    pub fn feed<'a>(&self, messages: impl IntoIterator<Item = &'a Message>) {
        for (number, message) in (1..).zip(messages) {
            assert!(self.world.arrive_patiently(self.arrival(message)));
            if number % INBOX == 0 {
                self.pass(Duration::from_millis(50));
            }
        }
    }

    /// As they came: between them as much time passes as their stamps say.
    pub fn play<'a>(&self, messages: impl IntoIterator<Item = &'a Message>) {
        self.play_as(messages, |message| vec![self.arrival(message)]);
    }

    /// As [`Self::play`], with other arrivals in place of each message.
    pub fn play_as<'a>(
        &self,
        messages: impl IntoIterator<Item = &'a Message>,
        mut arrivals: impl FnMut(&Message) -> Vec<Arrival>,
    ) {
        let mut due_ns = None;
        for message in messages {
            let due_ns = due_ns.get_or_insert(message.stamp_ns());
            while *due_ns + STEP.as_nanos() as i64 <= message.stamp_ns() {
                self.taken();
                self.hand.advance(STEP);
                *due_ns += STEP.as_nanos() as i64;
            }
            arrivals(message)
                .into_iter()
                .for_each(|arrival| assert!(self.world.arrive_patiently(arrival)));
        }
        self.taken();
    }

    /// As a port delivers it now.
    pub fn arrival(&self, message: &Message) -> Arrival {
        let frame = match message {
            Message::Pose(_) => "object",
            Message::Wrench(_) => "stylus",
        };
        Arrival::Message(in_frame(message, frame), self.now())
    }

    /// Time of the node.
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Returns when the node has taken all arrivals.
    pub fn taken(&self) {
        self.world.call(Call::ArmState).recv().unwrap();
    }

    /// Time passes.
    pub fn pass(&self, time: Duration) {
        let until = self.now() + time;
        while self.now() < until {
            self.hand.advance(STEP.min(until - self.now()));
        }
    }

    /// Time passes until there is something.
    pub fn until<T>(&self, what: &str, mut found: impl FnMut() -> Option<T>) -> T {
        let begun = self.now();
        loop {
            if let Some(found) = found() {
                return found;
            }
            assert!(self.clock.since(begun) < NEVER, "{what} never came");
            self.hand.advance(STEP);
        }
    }

    /// The answer of a service.
    pub fn call<A: Send + 'static>(&self, call: impl FnOnce(Reply<A>) -> Call) -> A {
        self.answer(&self.world.call(call))
    }

    /// The answer to a request.
    pub fn answer<A>(&self, answers: &Receiver<A>) -> A {
        self.until("the answer", || match answers.try_recv() {
            Ok(answer) => Some(answer),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => panic!("there is no answer"),
        })
    }

    /// All publications up to now.
    pub fn published(&mut self) -> &[Publication] {
        self.published.extend(self.world.published());
        &self.published
    }

    /// Waits for a publication that `wanted` accepts.
    pub fn wait_for<T>(&mut self, what: &str, wanted: impl Fn(&Publication) -> Option<T>) -> T {
        let mut published = std::mem::take(&mut self.published);
        let found = self.until(what, || {
            published.extend(self.world.published());
            published.iter().rev().find_map(&wanted)
        });
        self.published = published;
        found
    }

    /// Value of a key of the diagnostics, once all arrivals before are in it.
    pub fn diagnostic(&mut self, key: &str) -> Option<String> {
        self.taken();
        self.world.published();
        // the first may already be under way
        for _ in 0..2 {
            self.published.clear();
            self.wait_for("diagnostics", |published| {
                matches!(published, Publication::Diagnostics(_)).then_some(())
            });
        }
        let Some(Publication::Diagnostics(message)) = self
            .published
            .iter()
            .rev()
            .find(|published| matches!(published, Publication::Diagnostics(_)))
        else {
            panic!("it was there")
        };
        let values = message.status.iter().flat_map(|status| &status.values);
        values
            .filter(|value| value.key == key)
            .map(|value| value.value.clone())
            .next()
    }

    /// Ends the node; returns its end and the publications.
    pub fn end(mut self) -> (NodeEnd, Vec<Publication>) {
        self.world.arrive_patiently(Arrival::Shutdown);
        let Self { node, hand, .. } = self;
        let end = join(node, &hand);
        self.published.extend(self.world.published());
        (end, self.published)
    }
}

/// The end of a node; time passes until its threads have ended.
pub fn join(node: Node, hand: &ManualClock) -> NodeEnd {
    let joins = std::thread::spawn(move || node.join());
    while !joins.is_finished() {
        hand.advance(STEP);
        std::thread::yield_now();
    }
    joins.join().unwrap().unwrap()
}

pub fn read(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap()
}

/// The mesh changes among publications.
pub fn patches(published: &[Publication]) -> Vec<MeshPatch> {
    let of = |publication: &Publication| match publication {
        Publication::MeshPatch(patch) => Some(patch.clone()),
        _ => None,
    };
    published.iter().filter_map(of).collect()
}
