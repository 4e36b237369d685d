//! Selection of the touch to remove or restore, and the answers.

use std::path::Path;
use std::sync::mpsc::Receiver;
use std::time::Duration;

use nalgebra::Point3;

use crate::ros::clock::time;
use crate::ros::convert::{point, stamp_ns};
use crate::ros::messages::{TakeOutTouchRequest, TakeOutTouchResponse};
use crate::ros::port::Reply;
use touchup_io::recording::Topics;
use touchup_method::reconstruct::{Patcher, StrokeSpan};
use touchup_method::stylus::ProbedPoint;
use touchup_session::live::EvidenceReplay;
use touchup_session::scene::Scene;
use touchup_session::session::{EvidenceSource, StrokeChange};

/// Maximum time of disk and patch until the touches are readable.
pub(super) const READ_WAIT: Duration = Duration::from_secs(30);
/// Maximum number of contacts in an answer, so that it fits into one packet.
const MOST_POINTS: usize = 24;
/// Maximum number of concurrent queries: each has a copy of all touches.
pub(super) const MOST_ASKED: usize = 4;

/// Answer to other calls meanwhile.
pub(super) const BUSY: &str =
    "a touch is being taken out or put back: call again when that is done";
pub(super) const NOTHING_TOUCHED: &str = "nothing is touched yet that could be taken out";
pub(super) const NO_PATCH: &str = "the scene has no patch, so each touch has moved the mesh for good: `~/undo` takes the last ones back";

/// A running removal or restoration of a touch.
pub(super) struct TakingOut {
    pub reply: Reply<TakeOutTouchResponse>,
    pub made: Receiver<Result<Remade, String>>,
    /// the answer, once the evidence is replaced and the mesh follows
    pub answer: Option<TakeOutTouchResponse>,
}

/// The recomputed evidence, and its answer.
pub(super) struct Remade {
    pub evidence: EvidenceReplay,
    pub change: StrokeChange,
    pub answer: TakeOutTouchResponse,
}

/// Requested touch.
pub(super) enum WantedTouch {
    /// touch with this touch-down, ns
    Named(i64),
    /// touch of the contact nearest to a position, up to a distance, m, in O
    Near(Point3<f64>, f64),
}

/// The recorded samples of a session.
pub(super) fn recorded_evidence<'a>(
    recording: &'a Path,
    topics: &'a Topics,
    scene: &Scene,
    until_ns: i64,
) -> EvidenceSource<'a> {
    EvidenceSource {
        recording,
        topics,
        placement: scene.placement(),
        sync: scene.sync_params(),
        until_ns,
    }
}

pub(super) fn refused(message: String) -> TakeOutTouchResponse {
    TakeOutTouchResponse {
        message,
        ..Default::default()
    }
}

pub(super) fn read<T, E>(received: Result<T, E>) -> Result<T, String> {
    received.map_err(|_| "what was touched could not be read in time: call again".to_owned())
}

pub(super) fn counted_contacts(count: usize) -> String {
    format!(
        "{count} {}",
        if count == 1 { "contact" } else { "contacts" }
    )
}

/// The touch-down named by a request, ns.
pub(super) fn named(request: &TakeOutTouchRequest) -> Result<Option<i64>, String> {
    let stamp_ns = stamp_ns(&request.touch).ok_or("the stamp of the touch is no time")?;
    Ok(Some(stamp_ns).filter(|stamp_ns| *stamp_ns != 0))
}

/// The requested stroke, and its contacts.
///
/// - `patcher`: a copy.
/// - `last_ns`: stamp of the last sample; an unfinished stroke ends there.
pub(super) fn touch_of(
    mut patcher: Patcher,
    wanted: Option<&WantedTouch>,
    last_ns: i64,
) -> Result<(StrokeSpan, Vec<ProbedPoint>), String> {
    patcher.flush();
    let span = match wanted.ok_or(NOTHING_TOUCHED)? {
        WantedTouch::Named(stamp_ns) => {
            let mut strokes = (0..).map_while(|number| patcher.stroke(number));
            strokes
                .find(|span| span.begins_at(*stamp_ns))
                .ok_or("no touch has this stamp any more: look for it anew")?
        }
        WantedTouch::Near(place, radius) => {
            let far = |touch: &ProbedPoint| (touch.point - place).norm();
            let within = patcher
                .probed()
                .iter()
                .map(|touch| (far(touch), touch))
                .filter(|(far, _)| far <= radius);
            // of several at equal distance the last one
            let nearest =
                within.min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.stamp_ns.cmp(&a.1.stamp_ns)));
            let why = || format!("nothing was touched within {:.1} mm of there", radius * 1e3);
            let (_, touch) = nearest.ok_or_else(why)?;
            patcher.stroke(touch.stroke).ok_or(NOTHING_TOUCHED)?
        }
    };
    let touches = touches_of(&patcher, span);
    Ok((
        StrokeSpan {
            until_ns: span.until_ns.min(last_ns.saturating_add(1)),
            ..span
        },
        touches,
    ))
}

/// The stored contacts of a stroke, in order of time.
pub(super) fn touches_of(patcher: &Patcher, span: StrokeSpan) -> Vec<ProbedPoint> {
    patcher
        .probed()
        .iter()
        .filter(|touch| span.contains(touch.stamp_ns))
        .copied()
        .collect()
}

pub(super) fn answer_of(
    span: StrokeSpan,
    touches: &[ProbedPoint],
    message: String,
) -> TakeOutTouchResponse {
    let shown = touches.len().min(MOST_POINTS);
    // evenly from the first to the last one
    let at = |i: usize| i * (touches.len() - 1) / (shown - 1).max(1);
    TakeOutTouchResponse {
        success: true,
        message,
        touch: time(span.from_ns),
        until: time(span.until_ns),
        contacts: touches.len() as u32,
        points: (0..shown).map(|i| point(&touches[at(i)].point)).collect(),
        mesh_version: 0,
    }
}
