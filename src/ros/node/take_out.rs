//! The touch that is to be taken out or put back: which one that is, and what is answered.

use std::sync::mpsc::Receiver;
use std::time::Duration;

use nalgebra::Point3;

use super::convert::{point, stamp_ns};
use crate::live::EvidenceReplay;
use crate::reconstruct::{Patcher, StrokeSpan};
use crate::ros::clock::time;
use crate::ros::messages::{TakeOutTouchRequest, TakeOutTouchResponse};
use crate::ros::port::Reply;
use crate::session::StrokeChange;
use crate::stylus::ProbedPoint;

/// How long disk and patch may take until what was taken is there to be read.
pub(super) const READ_WAIT: Duration = Duration::from_secs(30);
/// Contacts in an answer at most: it is to fit into one packet.
const MOST_POINTS: usize = 24;
/// Questions that are worked at at a time at most: each has a copy of all touches.
pub(super) const MOST_ASKED: usize = 4;

/// What other calls are answered meanwhile.
pub(super) const BUSY: &str =
    "a touch is being taken out or put back: call again when that is done";
pub(super) const NOTHING_TOUCHED: &str = "nothing is touched yet that could be taken out";
pub(super) const NO_PATCH: &str = "the scene has no patch, so each touch has moved the mesh for good: `~/undo` takes the last ones back";

/// A touch that is being taken out or put back.
pub(super) struct TakingOut {
    pub reply: Reply<TakeOutTouchResponse>,
    pub made: Receiver<Result<Remade, String>>,
    /// the answer, once the evidence is in its place and the mesh is to follow
    pub answer: Option<TakeOutTouchResponse>,
}

/// The evidence as it is to be, and what it is to be answered.
pub(super) struct Remade {
    pub evidence: EvidenceReplay,
    pub change: StrokeChange,
    pub answer: TakeOutTouchResponse,
}

/// Which touch is asked for.
pub(super) enum WantedTouch {
    /// that of this touch-down, ns
    Named(i64),
    /// that of the contact nearest to a place, up to a distance, m, in O
    Near(Point3<f64>, f64),
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

/// The touch-down that a request names, ns.
pub(super) fn named(request: &TakeOutTouchRequest) -> Result<Option<i64>, String> {
    let stamp_ns = stamp_ns(&request.touch).ok_or("the stamp of the touch is no time")?;
    Ok(Some(stamp_ns).filter(|stamp_ns| *stamp_ns != 0))
}

/// The stroke that is asked for, and its contacts.
///
/// - `patcher`: a copy.
/// - `last_ns`: stamp of the last sample; of a stroke that still goes on it is what came until
///   then.
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
            // of several as near the last one
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

/// The contacts of a stroke that are kept, in order of time.
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
    // from the first to the last one, evenly
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
