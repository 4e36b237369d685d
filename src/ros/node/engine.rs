//! What moves the mesh: the haptic update, with the patch beside it where the scene has one.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use super::{NodeError, Setup};
use crate::live::{Gate, LiveError, LiveRefiner, Pace, TouchDelta};
use crate::mesh::{Changes, FaceTree, TriMesh, VertexId};
use crate::patch::{Patcher, Support};
use crate::refine::{RefineError, Refiner, Update};
use crate::touch::{Sample, WrenchFrame};

/// Room for new faces that is made ahead.
const ROOM: usize = 1 << 18;

/// The scan as it came, and the tree over its faces.
pub type Scan = Arc<(TriMesh, FaceTree)>;

/// One of the two ways.
pub enum Engine {
    /// the haptic update alone
    Alone(Box<Refiner>),
    /// with the patch
    Live(Box<LiveRefiner>),
}

impl Engine {
    /// Nothing touched yet.
    ///
    /// - `axes`: those of the wrenches.
    ///
    /// # Errors
    /// [`NodeError::NothingMoves`], [`NodeError::Refine`], [`NodeError::Live`].
    pub fn new(setup: &Setup, axes: WrenchFrame) -> Result<Self, NodeError> {
        let Setup { scan, scene, cut, .. } = setup;
        let params = cut.refine_params(scene.refine_params(axes).ok_or(NodeError::NothingMoves)?);
        let mut refiner = Refiner::new(scan.0.clone(), params)?;
        refiner.watch();
        let Some(patcher) = scene.patcher_params(axes).map(|params| cut.patcher_params(params)) else {
            refiner.keep_strokes();
            return Ok(Self::Alone(Box::new(refiner)));
        };
        let patcher = Patcher::new(patcher).map_err(RefineError::from)?;
        let mut live =
            LiveRefiner::behind(Gate::open(&setup.clock), Arc::clone(scan), refiner, patcher, Pace::default(), ROOM)?;
        // bounds of the scan, which the first renewal looks up, take some ms on a large one: no sample is to wait for that
        live.catch_up()?;
        Ok(Self::Live(Box::new(live)))
    }

    /// The haptic update, with the mesh as it stands.
    pub fn refiner(&self) -> &Refiner {
        match self {
            Self::Alone(refiner) => refiner,
            Self::Live(live) => live.refiner(),
        }
    }

    /// Takes the next sample.
    ///
    /// # Errors
    /// As [`LiveRefiner::push`].
    pub fn push(&mut self, sample: &Sample) -> Result<Update, LiveError> {
        match self {
            Self::Alone(refiner) => Ok(refiner.push(sample)?),
            Self::Live(live) => live.push(sample),
        }
    }

    /// To be called now and then while no sample comes, as [`LiveRefiner::rest`].
    ///
    /// # Errors
    /// As there.
    pub fn rest(&mut self) -> Result<(), LiveError> {
        match self {
            Self::Alone(_) => Ok(()),
            Self::Live(live) => live.rest(),
        }
    }

    /// Takes the last stroke back, or does it again; returns whether there was one.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn change_strokes(&mut self, is_undo: bool) -> Result<bool, LiveError> {
        match self {
            Self::Alone(refiner) if is_undo => Ok(refiner.undo()),
            Self::Alone(refiner) => Ok(refiner.redo()),
            Self::Live(live) if is_undo => live.undo(),
            Self::Live(live) => live.redo(),
        }
    }

    /// What changed in the mesh since this was last asked; whether that was all.
    pub fn take_changes(&mut self, most: usize, into: &mut Changes) -> bool {
        match self {
            Self::Alone(refiner) => refiner.take_changes(most, into),
            Self::Live(live) => live.take_changes(most, into),
        }
    }

    /// Whether the mesh is one skin, and not in the middle of a change.
    pub fn is_whole(&self) -> bool {
        match self {
            Self::Alone(_) => true,
            Self::Live(live) => live.is_whole(),
        }
    }

    /// What a vertex rests on. Where there is no patch, or it does not know yet, a vertex that is not where the scan has it
    /// rests on a touch, or is guessed from touches.
    pub fn support(&self, scan: &TriMesh, vertex: VertexId) -> Support {
        let refiner = self.refiner();
        let is_moved = || {
            let was = scan.positions().get(vertex.0 as usize);
            was.is_none_or(|was| *was != refiner.mesh().position(vertex))
        };
        match refiner.support(vertex) {
            None if is_moved() => Support::Touched,
            Some(Support::Scan) if is_moved() => Support::Guessed,
            support => support.unwrap_or(Support::Scan),
        }
    }

    /// Touches that were found, or lost, since this was last asked.
    pub fn take_probed(&mut self) -> Option<TouchDelta> {
        match self {
            Self::Alone(_) => None,
            Self::Live(live) => live.take_probed(),
        }
    }

    /// A copy of what the patch knows, when its thread has made it; `None` without a patch, or where nothing was touched.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn copy_patcher(&self) -> Result<Option<Receiver<Patcher>>, LiveError> {
        match self {
            Self::Live(live) if live.refiner().counts().contacts > 0 => live.copy_patcher().map(Some),
            _ => Ok(None),
        }
    }

    /// Renewals that were not done when they were due.
    pub fn late_renewals(&self) -> u64 {
        match self {
            Self::Alone(_) => 0,
            Self::Live(live) => live.counts().late,
        }
    }

    /// Ends the thread of the patch.
    ///
    /// # Errors
    /// [`LiveError::Stopped`].
    pub fn finish(self) -> Result<(Refiner, Option<Patcher>), LiveError> {
        match self {
            Self::Alone(refiner) => Ok((*refiner, None)),
            Self::Live(live) => live.finish().map(|(refiner, patcher)| (refiner, Some(patcher))),
        }
    }
}
