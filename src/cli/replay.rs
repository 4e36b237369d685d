//! `touchup replay`: plays a recording on the topics, in real time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use super::common::progress::WorkProgress;
use super::{CliError, Losses, counted, notify, print_report};
use touchup_io::recording::{LiveMessage, StampSource};
use touchup_method::stylus::MarkerFilter;
use touchup_method::stylus::{Message, SyncParams};
use touchup_node::ros;
use touchup_node::ros::arguments::NodeConfig;
use touchup_node::ros::parameters::CELL_FRAME;
use touchup_node::ros::parameters::ParameterValue;
use touchup_node::ros::playback::{PlayedTime, wrench_frame_id};
use touchup_node::ros::port::SamplePort;
use touchup_session::replay::{RecordedAs, Recording, ReplaySummary, each_message};
use touchup_session::scene::Scene;

/// Wait after discovery of the subscribers, which do not announce their own discovery of this node.
const DISCOVERY: Duration = Duration::from_secs(1);
/// Polling period for subscribers.
const LOOK: Duration = Duration::from_millis(50);
/// Delay before a report of the wait, with its reason.
const REPORT_AFTER: Duration = Duration::from_secs(2);
/// Longest transport time of the last message.
const LINGER: Duration = Duration::from_millis(300);

#[derive(Debug, Args)]
pub(super) struct ReplayArguments {
    /// Recording: MCAP or SQLite of ROS 2 (file or folder), bag of ROS 1, or table (CSV, log of a
    /// UR's RTDE)
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// Speed, in multiples of the recorded one
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Touching tool: selects the topics to play on
    #[arg(long, value_name = "WHO", default_value = "stylus", value_parser = ["stylus", "probe"])]
    source: String,
    #[command(flatten)]
    recorded: RecordedAs,
    /// Scene with the positions of the markers
    #[arg(long, value_name = "YAML")]
    scene: Option<PathBuf>,
    /// Prints the counts of played messages as one JSON object
    #[arg(long)]
    json: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    (0.01..=100.0)
        .contains(&speed)
        .then_some(speed)
        .ok_or_else(|| "it must be 0.01 to 100".to_owned())
}

/// Output of `--json`.
#[derive(Debug, Default, Serialize)]
pub(super) struct PlaybackReport {
    wrenches: u64,
    poses: u64,
    /// Messages refused by the network.
    unsent: u64,
    played_s: f64,
}

/// - `ros`: arguments behind `--ros-args`.
pub(super) fn replay(arguments: &ReplayArguments, ros: &[String]) -> Result<Losses, CliError> {
    let mut config = NodeConfig::named("touchup_replay", ros, |name| std::env::var(name).ok())?;
    let source = ParameterValue::String(arguments.source.clone());
    config
        .parameters
        .set("source", &source)
        .map_err(CliError::usage)?;
    let scene = arguments
        .scene
        .as_deref()
        .map_or_else(|| Ok(Scene::default()), Scene::read)?;
    let recorded = &arguments.recorded;
    let (recording, markers) = recorded.open(&arguments.recording, &scene, StampSource::Header)?;
    let mut port = ros::samples(&config)?;
    wait_for_listeners(&mut *port, &config, &arguments.recording);

    let (played, replayed) = play(
        recording,
        markers,
        arguments.speed,
        &arguments.source,
        &*port,
    )?;
    let listeners = port.listeners();
    sleep(LINGER);

    let mut losses = replayed.losses;
    if played.unsent > 0 {
        losses.push(format!(
            "{} not taken by the network",
            counted(played.unsent, "message", "messages")
        ));
    }
    if listeners.contains(&0) {
        losses.push("a subscriber left before the end".to_owned());
    }
    print_report(arguments.json, &played, || {
        let wrenches = counted(played.wrenches, "wrench", "wrenches");
        let poses = counted(played.poses, "pose", "poses");
        format!("played {wrenches} and {poses} in {:.1} s", played.played_s)
    })?;
    Ok(losses)
}

/// Plays a recording in real time, each stream in stamp order; returns counts and losses.
///
/// - `source`: touching tool, `stylus` or `probe`: its sensor is the frame of the wrenches.
pub(super) fn play(
    recording: Recording,
    markers: Option<MarkerFilter>,
    speed: f64,
    source: &str,
    port: &dyn SamplePort,
) -> Result<(PlaybackReport, ReplaySummary), CliError> {
    let wrench_frame = wrench_frame_id(recording.wrench_frame, source);
    let (mut played, mut pace, began) = (
        PlaybackReport::default(),
        ReplayPace::new(speed),
        Instant::now(),
    );
    let mut publish = |message: Message| {
        pace.wait_for(message.stamp_ns());
        let (count, frame) = match &message {
            Message::Wrench(_) => (&mut played.wrenches, &*wrench_frame),
            Message::Pose(_) => (&mut played.poses, CELL_FRAME),
        };
        *count += 1;
        let frame = frame.to_owned();
        played.unsent += u64::from(!port.publish(LiveMessage { frame, message }));
    };
    let mut order = StampOrder::default();
    let mut progress = WorkProgress::new("replay", recording.message_count());
    let replayed = each_message(recording, markers, &mut || progress.step(), |message| {
        order.push(message, &mut publish)
    })?;
    order.finish(&mut publish);
    played.played_s = began.elapsed().as_secs_f64();
    Ok((played, replayed))
}

/// Waits for subscribers, so that the beginning of a recording reaches them.
fn wait_for_listeners(port: &mut dyn SamplePort, config: &NodeConfig, recording: &Path) {
    let began = Instant::now();
    let mut is_reported = false;
    while port.listeners().contains(&0) {
        if !is_reported && began.elapsed() > REPORT_AFTER {
            let topics = config
                .sample_topics()
                .map(|name| config.resolve(name).unwrap_or_else(|_| name.to_owned()));
            let (recording, topics) = (recording.display(), topics.join(" and "));
            notify(&format!(
                "{recording} waits for a node that listens to {topics} (touchup node); Ctrl-C gives up"
            ));
            is_reported = true;
        }
        sleep(LOOK);
    }
    sleep(DISCOVERY);
}

/// Sorts each stream by stamp, the sending order of a sensor and the node's input order, against
/// late arrivals in the recording.
#[derive(Default)]
struct StampOrder {
    /// Poses and wrenches.
    streams: [ReplayStream; 2],
    count: u64,
}

#[derive(Default)]
struct ReplayStream {
    /// Messages by stamp; equal stamps in order of arrival.
    held: BTreeMap<(i64, u64), Message>,
    newest_ns: Option<i64>,
}

impl StampOrder {
    /// Passes on messages that none can overtake any more, after the same wait as `touchup refine`.
    fn push(&mut self, message: Message, mut each: impl FnMut(Message)) {
        let stamp_ns = message.stamp_ns();
        let stream = &mut self.streams[usize::from(matches!(message, Message::Wrench(_)))];
        self.count += 1;
        stream.held.insert((stamp_ns, self.count), message);
        let newest_ns = stream
            .newest_ns
            .map_or(stamp_ns, |newest_ns| newest_ns.max(stamp_ns));
        stream.newest_ns = Some(newest_ns);
        while let Some(first) = stream.held.first_entry()
            && first.key().0 <= newest_ns.saturating_sub(SyncParams::default().reorder_ns)
        {
            each(first.remove());
        }
    }

    /// Passes on the rest.
    fn finish(self, each: impl FnMut(Message)) {
        let [mut poses, wrenches] = self.streams.map(|stream| stream.held);
        poses.extend(wrenches);
        poses.into_values().for_each(each);
    }
}

/// Schedule of the messages by their stamps.
struct ReplayPace {
    speed: f64,
    time: PlayedTime,
    began: Instant,
}

impl ReplayPace {
    fn new(speed: f64) -> Self {
        Self {
            speed,
            time: PlayedTime::default(),
            began: Instant::now(),
        }
    }

    /// Due time of a stamp since the beginning; a stamp that goes back is due at once.
    fn due(&mut self, stamp_ns: i64) -> Duration {
        Duration::from_secs_f64(self.time.at_ns(stamp_ns) as f64 * 1e-9 / self.speed)
    }

    fn wait_for(&mut self, stamp_ns: i64) {
        let due = self.due(stamp_ns);
        sleep(due.saturating_sub(self.began.elapsed()));
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use touchup_method::stylus::{StampedPose, StampedWrench, Wrench};

    #[test]
    fn each_stream_comes_in_the_order_of_its_stamps() {
        let ms = 1_000_000;
        let message = |stamp_ms: i64, is_wrench| match is_wrench {
            true => Message::Wrench(StampedWrench {
                stamp_ns: stamp_ms * ms,
                wrench: Wrench::default(),
            }),
            false => Message::Pose(StampedPose {
                stamp_ns: stamp_ms * ms,
                pose_ot: Isometry3::identity(),
            }),
        };
        let recorded = [
            (0, true),
            (5, false),
            (12, true),
            (9, true),
            (9, true),
            (30, true),
            (2, false),
            (3, true),
            (40, false),
        ];
        let (mut order, mut replayed) = (StampOrder::default(), Vec::new());
        let mut each = |message: Message| {
            replayed.push((
                message.stamp_ns() / ms,
                matches!(message, Message::Wrench(_)),
            ))
        };
        for (stamp_ms, is_wrench) in recorded {
            order.push(message(stamp_ms, is_wrench), &mut each);
        }
        order.finish(&mut each);
        let of = |wanted| {
            replayed
                .iter()
                .filter(move |(_, is_wrench)| *is_wrench == wanted)
                .map(|(stamp_ms, _)| *stamp_ms)
        };
        // 3 is more than 20 ms behind and keeps its place
        assert_eq!(of(true).collect::<Vec<_>>(), [0, 9, 9, 3, 12, 30]);
        assert_eq!(of(false).collect::<Vec<_>>(), [2, 5, 40]);
    }

    #[test]
    fn messages_are_due_by_their_stamps_and_rests_are_shortened() {
        let s = 1_000_000_000;
        let mut pace = ReplayPace::new(2.0);
        let stamps = [
            100 * s,
            101 * s,
            101 * s - 5,
            101 * s,
            103 * s,
            3000 * s,
            3001 * s,
            7 * s,
            9 * s,
            i64::MAX,
        ];
        let due = stamps.map(|stamp| pace.due(stamp).as_secs_f64());
        assert_eq!(due, [0.0, 0.5, 0.5, 0.5, 1.5, 2.5, 3.0, 3.0, 4.0, 5.0]);
    }
}
