//! Removal of one touch, at any position in their order, and its restoration.
//!
//! A thread of its own recomputes the evidence from the recording of the session, without the
//! samples of that stroke, while samples go on. Then it replaces the previous evidence, and the
//! mesh follows.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use tracing::warn;

use super::replayed::REPLAYED;
use crate::node::refinement::RefinementWorker;
use crate::node::take_out::{
    BUSY, MOST_ASKED, NO_PATCH, NOTHING_TOUCHED, READ_WAIT, Remade, TakingOut, WantedTouch,
    answer_of, counted_contacts, named, read, recorded_evidence, refused, touch_of, touches_of,
};
use crate::ros::messages::{TakeOutTouchRequest, TakeOutTouchResponse};
use crate::ros::port::Reply;
use touchup_method::reconstruct::{Patcher, StrokeSpan};
use touchup_session::session::{Removal, StrokeChange, StrokeChanges};

/// Reason why a touch stays: samples dropped meanwhile would change the other touches.
fn too_many(dropped: u64) -> String {
    format!(
        "{dropped} samples came while the touches were made again, more than are kept meanwhile, so nothing was changed: pause the samples \
         (~/pause) and call again"
    )
}

impl RefinementWorker {
    /// Answers `~/take_out_touch`: now, or once the mesh shows the result.
    pub(in crate::node) fn take_out_touch(
        &mut self,
        request: &TakeOutTouchRequest,
        reply: Reply<TakeOutTouchResponse>,
    ) {
        if request.preview {
            match self.looking(request) {
                Ok(look) => {
                    let work = move || reply.send(look().unwrap_or_else(refused));
                    if let Err(error) = self.side_work.begin("touch", work) {
                        warn!(%error, "no thread to look for a touch on: the caller gets no answer");
                    }
                }
                Err(message) => reply.send(refused(message)),
            }
            return;
        }
        let (to, made) = channel();
        match self.remaking(request) {
            Ok(remake) => {
                if let Err(error) = self
                    .side_work
                    .begin("take out", move || drop(to.send(remake())))
                {
                    warn!(%error, "no thread to take a touch out on");
                }
                self.taking_out = Some(TakingOut {
                    reply,
                    made,
                    answer: None,
                });
            }
            Err(message) => reply.send(refused(message)),
        }
    }

    /// Whether a removal or restoration is running.
    pub(in crate::node) fn is_taking_out(&self) -> bool {
        self.taking_out.is_some()
    }

    /// Continues a running removal as far as possible; never waits.
    pub(in crate::node) fn go_on_taking_out(&mut self) {
        let Some(taking_out) = &mut self.taking_out else {
            return;
        };
        if taking_out.answer.is_none() {
            let made = match taking_out.made.try_recv() {
                Ok(made) => made,
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    Err("there was no thread for it: call again".to_owned())
                }
            };
            match self.put_in_place(made) {
                Ok(answer) => self
                    .taking_out
                    .iter_mut()
                    .for_each(|taking_out| taking_out.answer = Some(answer.clone())),
                Err(message) => self.give_up_taking_out(&message),
            }
        }
        if let Some(fault) = self.fault.clone() {
            self.give_up_taking_out(&fault);
        } else if !self.session.engine.is_replacing() {
            self.end_taking_out();
        }
    }

    /// Answers with success.
    fn end_taking_out(&mut self) {
        if let Some(TakingOut {
            reply,
            answer: Some(answer),
            ..
        }) = self.taking_out.take()
        {
            reply.send(TakeOutTouchResponse {
                mesh_version: self.session.version,
                ..answer
            });
        }
    }

    /// Answers with failure, unless the evidence is already replaced.
    pub(in crate::node) fn give_up_taking_out(&mut self, why: &str) {
        let Some(TakingOut { reply, answer, .. }) = self.taking_out.take() else {
            return;
        };
        reply.send(match answer {
            Some(answer) => TakeOutTouchResponse {
                mesh_version: self.session.version,
                ..answer
            },
            None => refused(why.to_owned()),
        });
    }

    fn put_in_place(
        &mut self,
        made: Result<Remade, String>,
    ) -> Result<TakeOutTouchResponse, String> {
        let made = made.and_then(|made| self.check_recorded().map(|()| made));
        let (evidence, made) = match made {
            Ok(Remade {
                evidence,
                change,
                answer,
            }) => (Some(evidence), Ok((change, answer))),
            Err(message) => (None, Err(message)),
        };
        let dropped = self.session.engine.end_replay(evidence).map_err(|error| {
            self.fail(&error);
            error.to_string()
        })?;
        let (change, answer) = made?;
        if dropped > 0 {
            let why = too_many(dropped);
            warn!("{why}");
            return Err(why);
        }
        self.note_stroke(change);
        self.session.version += 1;
        Ok(answer)
    }

    /// Records a stroke change.
    pub(in crate::node) fn note_stroke(&mut self, change: StrokeChange) {
        self.session.strokes.push(change);
        let recorder = self.session.keeping.recorder();
        if let Some(Err(error)) = recorder.map(|recorder| recorder.write_stroke(change)) {
            warn!(%error, "after a crash this stroke would be as it was");
        }
    }

    /// Returns a function that finds the touch and describes it.
    fn looking(
        &mut self,
        request: &TakeOutTouchRequest,
    ) -> Result<impl FnOnce() -> Result<TakeOutTouchResponse, String> + Send + use<>, String> {
        if self.side_work.count() >= MOST_ASKED {
            return Err(BUSY.to_owned());
        }
        let (out, wanted) = self.sought(request)?;
        let (copy, setup) = (self.copied_evidence()?, Arc::clone(&self.setup));
        let (version, until_ns) = (
            self.session.version,
            self.session.last_ns.unwrap_or(i64::MIN),
        );
        Ok(move || {
            let patcher = read(setup.clock.recv_timeout(&copy, READ_WAIT))?;
            let (span, touches) = match (out, wanted) {
                (Some(out), _) => (out, Vec::new()),
                (None, wanted) => touch_of(patcher, wanted.as_ref(), until_ns)?,
            };
            let message = counted_contacts(touches.len());
            Ok(TakeOutTouchResponse {
                mesh_version: version,
                ..answer_of(span, &touches, message)
            })
        })
    }

    /// Returns a function that recomputes the evidence with or without the touch.
    fn remaking(
        &mut self,
        request: &TakeOutTouchRequest,
    ) -> Result<impl FnOnce() -> Result<Remade, String> + Send + use<>, String> {
        if self.is_taking_out() || self.side_work.count() >= MOST_ASKED {
            return Err(BUSY.to_owned());
        }
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        self.check_recorded()?;
        let (out, wanted) = self.sought(request)?;
        let until_ns = self.session.last_ns.ok_or(NOTHING_TOUCHED)?;
        let copy = out.is_none().then(|| self.copied_evidence()).transpose()?;
        let replay = self
            .session
            .engine
            .begin_replay()
            .map_err(|error| error.to_string())?
            .ok_or(NO_PATCH)?;
        let recorder = self.session.keeping.recorder().ok_or(REPLAYED)?;
        let (flushed, recording, setup) = (
            recorder.flushed(),
            recorder.recording(),
            Arc::clone(&self.setup),
        );
        let mut changes: StrokeChanges = self.session.strokes.clone();
        Ok(move || {
            let found = copy.map(|copy| {
                let patcher = read(setup.clock.recv_timeout(&copy, READ_WAIT))?;
                touch_of(patcher, wanted.as_ref(), until_ns)
            });
            read(setup.clock.recv_timeout(&flushed, READ_WAIT))?;
            let scene = &setup.input.scene;
            let source = recorded_evidence(&recording, &setup.topics, scene, until_ns);
            let (stroke, touches) = match (found.transpose()?, out) {
                (Some((span, touches)), _) => (span, Some(touches)),
                (None, Some(span)) => (span, None),
                (None, None) => return Err(NOTHING_TOUCHED.to_owned()),
            };
            let removal = Removal {
                after_ns: until_ns,
                stroke,
            };
            let (change, done) = match touches {
                Some(_) => (StrokeChange::TakeOut(removal), "took out"),
                None => (StrokeChange::PutBack(removal), "put back"),
            };
            changes.push(change);
            let evidence = source
                .replayed(&changes, replay)
                .map_err(|error| error.to_string())?;
            let touches = touches.unwrap_or_else(|| touches_of(evidence.patcher(), stroke));
            let message = format!("{done} 1 touch: {}", counted_contacts(touches.len()));
            Ok(Remade {
                evidence,
                change,
                answer: answer_of(stroke, &touches, message),
            })
        })
    }

    /// A copy of the touches, once it is made.
    fn copied_evidence(&mut self) -> Result<Receiver<Patcher>, String> {
        let copy = self
            .session
            .engine
            .copy_patcher()
            .map_err(|error| error.to_string())?;
        copy.ok_or_else(|| NOTHING_TOUCHED.to_owned())
    }

    /// Checks the recording: missing messages would change the other touches.
    fn check_recorded(&self) -> Result<(), String> {
        let unrecorded = self.session.keeping.unrecorded();
        match (unrecorded.messages, unrecorded.reason) {
            (0, _) => Ok(()),
            (count, why) => {
                let why = why.unwrap_or_else(|| "the disk was too slow".to_owned());
                Err(format!(
                    "{count} messages are not in the recording of the session ({why}): without them touches cannot be made again; \
                     begin a new session"
                ))
            }
        }
    }

    /// The stroke to restore, or else the touch to find.
    fn sought(
        &self,
        request: &TakeOutTouchRequest,
    ) -> Result<(Option<StrokeSpan>, Option<WantedTouch>), String> {
        Ok(if request.put_back {
            (Some(self.taken_out(request)?), None)
        } else {
            (None, Some(self.wanted(request)?))
        })
    }

    fn wanted(&self, request: &TakeOutTouchRequest) -> Result<WantedTouch, String> {
        Ok(match named(request)? {
            Some(stamp_ns) => WantedTouch::Named(stamp_ns),
            None => {
                let radius = self.search_radius(request.search_radius)?;
                WantedTouch::Near(self.point_in_object(&request.point)?, radius)
            }
        })
    }

    /// The stroke to restore.
    fn taken_out(&self, request: &TakeOutTouchRequest) -> Result<StrokeSpan, String> {
        let mut taken_out = self.session.strokes.taken_out();
        match named(request)? {
            None => taken_out
                .pop()
                .ok_or_else(|| "no touch is taken out".to_owned()),
            Some(stamp_ns) => {
                let found = taken_out.into_iter().find(|span| span.begins_at(stamp_ns));
                found.ok_or_else(|| "no touch that is taken out has this stamp".to_owned())
            }
        }
    }
}
