//! Connection of one page: sends content at the page's pace, and answers its calls.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, WebSocket};
use byteorder::LittleEndian;
use futures_util::stream::SplitSink;
use futures_util::{SinkExt, StreamExt};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::admission::access::Role;
use super::board::text_of;
use super::site::Site;
use super::vertex_numbers::{VertexNumber, frame};
use crate::ros::messages::MeshPatch;
use crate::ros::port::Reply;

/// Minimum interval between updates of a page.
const FRAME: Duration = Duration::from_millis(33);
/// Interval of heartbeats to a page, which takes the connection for lost after two intervals.
const SIGN_OF_LIFE: Duration = Duration::from_secs(5);
/// Time-out for a page that accepts or sends nothing; it answers each heartbeat.
const GONE_AFTER: Duration = Duration::from_secs(20);
/// Maximum number of queued answers of a page.
const MOST_ANSWERS: usize = 64;
/// Maximum rate of a page's messages, 1/s; hold-to-run beats come 50 times per second.
const MOST_PER_SECOND: u32 = 200;
/// Maximum number of vertices, or faces, of one message: 1.4 MB.
const OF_A_MESSAGE: usize = 1 << 16;
/// Kind of a binary message: a `MeshPatch`.
const MESH_PATCH: u8 = 1;

/// Message from a page: a service call, or a hold-to-run beat.
#[derive(Debug, Deserialize)]
struct PageMessage {
    /// identifies the answer
    #[serde(default)]
    id: Value,
    /// name of the service
    call: Option<String>,
    #[serde(default)]
    request: Value,
    /// number of beats sent
    beat: Option<u64>,
}

/// Serves a page until it disconnects.
pub(super) async fn serve(socket: WebSocket, site: Arc<Site>, role: Role) {
    let page = site.entrance.pages_so_far.fetch_add(1, Ordering::Relaxed);
    let (to_page, mut from_page) = socket.split();
    let (answers, waiting) = channel(MOST_ANSWERS);
    let sending = send(to_page, Arc::clone(&site), role, waiting);
    let hearing = async {
        let mut rate = Rate::default();
        while let Ok(Some(Ok(message))) = timeout(GONE_AFTER, from_page.next()).await {
            let Message::Text(text) = message else {
                continue;
            };
            if !rate.allows(Instant::now()) {
                tracing::warn!(page, "a page sends too much: it is cut off");
                break;
            }
            hear(&text, &site, role, &answers);
        }
    };
    tokio::select! {
        () = sending => {}
        () = hearing => {}
    }
    // the other pages show the number of pages
    site.board.wake();
}

fn hear(text: &str, site: &Site, role: Role, answers: &Sender<String>) {
    let asked = serde_json::from_str(text).map_err(|error| error.to_string());
    let (id, call, request) = match asked {
        Ok(PageMessage {
            call: None,
            beat: Some(_),
            ..
        }) => {
            if role == Role::Operate {
                site.inbox.stops().beat();
            }
            return;
        }
        Ok(PageMessage {
            id,
            call: Some(call),
            request,
            ..
        }) if !id.is_null() => (id, call, request),
        refused => {
            let why = refused
                .err()
                .unwrap_or_else(|| "it has no id and call, and no beat".to_owned());
            let said = json!({ "id": null, "error": format!("this is no call: {why}") });
            return drop(answers.try_send(said.to_string()));
        }
    };
    let answers = answers.clone();
    let reply = Reply::new(move |answer| {
        let said = match answer {
            Ok(response) => json!({ "id": id, "response": response }),
            Err(why) => json!({ "id": id, "error": why }),
        };
        // a page that does not read its answers loses them
        let _ = answers.try_send(said.to_string());
    });
    site.call(role, &call, request, reply);
}

/// Content that a page has; a changed text replaces its predecessor.
#[derive(Default)]
struct SentContent {
    /// position in the messages of the board
    seen: u64,
    state: String,
    replay: String,
    annotations: String,
    /// vertices marked as outliers
    outliers: Arc<[u32]>,
}

impl SentContent {
    /// Changed texts and new messages of the board.
    fn changes(&mut self, site: &Site, role: Role) -> Vec<Message> {
        let replay = site.replay.as_ref();
        let annotations = site.annotations.of(&site.mesh.session());
        let mut messages = Vec::new();
        for (sent, now) in [
            (&mut self.state, text_of("state", &site.state(role))),
            (
                &mut self.replay,
                replay.and_then(|replay| text_of("replay", &replay.shown())),
            ),
            (&mut self.annotations, text_of("annotations", &annotations)),
        ] {
            let now = now.unwrap_or_default();
            if now != *sent {
                sent.clone_from(&now);
                messages.push(Message::text(now));
            }
        }
        let board = site.board.read(&mut self.seen);
        messages.extend(board.into_iter().map(Message::text));
        messages
    }

    /// The marks of outliers, if they were evaluated again.
    fn new_marks(&mut self, site: &Site) -> Option<Vec<u8>> {
        let outliers = Arc::clone(&site.mesh.now().0.outliers);
        let sent = std::mem::replace(&mut self.outliers, outliers);
        let marks = self.outliers.iter().map(|vertex| (*vertex, 1.0));
        (!Arc::ptr_eq(&sent, &self.outliers)).then(|| frame(VertexNumber::Outlier, marks))
    }
}

async fn send(
    mut to_page: SplitSink<WebSocket, Message>,
    site: Arc<Site>,
    role: Role,
    mut answers: Receiver<String>,
) {
    let (mut changes, follower) = (site.board.changes(), site.mesh.follow());
    let mut frames = interval(FRAME);
    frames.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut sent, mut signed) = (SentContent::default(), Instant::now());
    loop {
        let mut messages = Vec::new();
        while let Ok(answer) = answers.try_recv() {
            messages.push(Message::text(answer));
        }
        messages.extend(sent.changes(&site, role));
        let mesh = follower.next_part(OF_A_MESSAGE);
        let has_more = mesh.is_some();
        if let Some(patch) = mesh {
            messages.extend(frame_of(&patch).map(Message::binary));
            if let Some(nominal) = site.nominal.clone() {
                // 1 ms per thousand vertices, which must not delay other pages
                let frame = tokio::task::spawn_blocking(move || nominal.frame(&patch)).await;
                messages.extend(frame.ok().flatten().map(Message::binary));
            }
        }
        // marks follow the vertices
        if !has_more {
            messages.extend(sent.new_marks(&site).map(Message::binary));
        }
        if signed.elapsed() >= SIGN_OF_LIFE {
            signed = Instant::now();
            // the browser answers the ping; the page sees the text
            messages.extend([
                Message::Ping(Default::default()),
                Message::text(sent.state.clone()),
            ]);
        }
        for message in messages {
            // a full system buffer delays this page alone
            if !matches!(timeout(GONE_AFTER, to_page.send(message)).await, Ok(Ok(()))) {
                return;
            }
        }
        if !has_more {
            frames.tick().await;
            wait(&mut changes, &mut answers, &mut to_page).await;
        }
        tokio::task::yield_now().await;
    }
}

/// Waits for a change or an answer, at most 200 ms, the polling period of the state.
async fn wait(
    changes: &mut watch::Receiver<()>,
    answers: &mut Receiver<String>,
    to_page: &mut SplitSink<WebSocket, Message>,
) {
    tokio::select! {
        _ = changes.changed() => {}
        () = tokio::time::sleep(Duration::from_millis(200)) => {}
        Some(answer) = answers.recv() => drop(timeout(GONE_AFTER, to_page.send(Message::text(answer))).await),
    }
}

/// Kind, three zeros, and the message in CDR with its header, as DDS sends it.
fn frame_of(patch: &MeshPatch) -> Option<Vec<u8>> {
    let body = cdr_encoding::to_vec::<_, LittleEndian>(patch).ok()?;
    let mut frame = Vec::with_capacity(8 + body.len());
    frame.extend([MESH_PATCH, 0, 0, 0, 0, 1, 0, 0]);
    frame.extend(body);
    Some(frame)
}

/// Counts the messages of a page in each second.
#[derive(Debug, Default)]
struct Rate {
    began: Option<Instant>,
    count: u32,
}

impl Rate {
    fn allows(&mut self, now: Instant) -> bool {
        if self
            .began
            .is_none_or(|began| now.saturating_duration_since(began) >= Duration::from_secs(1))
        {
            *self = Self {
                began: Some(now),
                count: 0,
            };
        }
        self.count += 1;
        self.count <= MOST_PER_SECOND
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_may_send_so_much_in_each_second_and_no_more() {
        let (mut rate, began) = (Rate::default(), Instant::now());
        let count = |rate: &mut Rate, at| {
            (0..2 * MOST_PER_SECOND).filter(|_| rate.allows(at)).count() as u32
        };
        assert_eq!(count(&mut rate, began), MOST_PER_SECOND);
        assert_eq!(count(&mut rate, began + Duration::from_millis(999)), 0);
        assert_eq!(
            count(&mut rate, began + Duration::from_secs(1)),
            MOST_PER_SECOND
        );
    }

    #[test]
    fn arrays_of_a_mesh_patch_lie_at_multiples_of_their_size_in_a_frame() {
        let patch = MeshPatch {
            vertices: vec![7, 8],
            positions: vec![0.25; 6],
            ..MeshPatch::default()
        };
        let frame = frame_of(&patch).unwrap();
        assert_eq!(frame[..8], [MESH_PATCH, 0, 0, 0, 0, 1, 0, 0]);
        let quarters = (0..frame.len() / 4)
            .filter(|at| frame[4 * at..4 * at + 4] == 0.25f32.to_le_bytes())
            .count();
        assert_eq!(quarters, 6);
    }
}
