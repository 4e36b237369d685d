//! Cost of a scene: active parts, inactive parts with reasons, and memory at start.

use std::fmt;

use serde::Serialize;

use super::{Mode, Scene};
use crate::reported;
use touchup_method::haptic::Footprint;

/// Parts by their YAML names, in YAML order, then the features of the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SceneParts {
    /// active parts, with their cost
    pub built: Vec<&'static str>,
    /// parts neither allocated nor run
    pub left_out: Vec<LeftOut>,
}

/// An inactive part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// YAML name
    pub part: &'static str,
    /// reason: the scene, its mode, or the task at hand
    pub reason: &'static str,
}

const OFF: &str = "off in the scene";
const NOT_NAMED: &str = "not named in the scene";
const PUBLISHED: &str = "the published rule has none";
const NOTHING_MOVES: &str = "nothing moves the mesh";
const NO_PATCH: &str = "of the patch, which is left out";
const NOT_COMPILED: &str = "not in this build of touchup";

reported! {
    /// Memory at start, MB of 10⁶ bytes; `scan_bytes`: of the unrefined scan, with the trees over
    /// it. Touches add to it.
    #[derive(Clone, Copy, PartialEq)]
    pub struct Memory, pub fn of(refiner: Footprint, scan_bytes: usize) {
        /// the moving mesh: positions, faces, adjacency, scanned position of each vertex, measured
        /// normal of each face
        pub mesh_mb: f64 = refiner.mesh as f64 / 1e6,
        /// the tree over its faces
        pub tree_mb: f64 = refiner.tree as f64 / 1e6,
        /// the unrefined scan, with a tree of its own for a patch beside the samples
        pub scan_mb: f64 = scan_bytes as f64 / 1e6,
        /// part of the mesh for the patch that it follows; 0 without one
        pub patch_mb: f64 = refiner.patch as f64 / 1e6,
    }
}

/// Parts and memory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneCost {
    /// parts
    #[serde(flatten)]
    pub parts: SceneParts,
    /// memory
    #[serde(flatten)]
    pub memory: Memory,
}

impl Scene {
    /// Active parts of the scene, and the reasons of the inactive ones.
    ///
    /// - `unused`: parts without use for the task at hand, each with the reason.
    /// - `features`: optional features of the program, and whether this build has them.
    pub fn built(&self, unused: &[LeftOut], features: &[(&'static str, bool)]) -> SceneParts {
        let compiled = features
            .iter()
            .map(|&(name, is_there)| (name, unless(is_there, NOT_COMPILED)));
        let mut built = SceneParts {
            built: Vec::new(),
            left_out: Vec::new(),
        };
        for (part, reason) in self.reasons().into_iter().chain(compiled) {
            let of_task = unused
                .iter()
                .find(|left| left.part == part)
                .map(|left| left.reason);
            match reason.or(of_task) {
                Some(reason) => built.left_out.push(LeftOut { part, reason }),
                None => built.built.push(part),
            }
        }
        built
    }

    /// Parts of the scene, each with the reason if it is inactive.
    fn reasons(&self) -> [(&'static str, Option<&'static str>); 18] {
        let not_robust = match &self.refine {
            None => Some(NOTHING_MOVES),
            Some(refine) => unless(refine.mode == Mode::Robust, PUBLISHED),
        };
        let not_either = not_robust.filter(|_| !self.has_patch());
        [
            ("sync", unless(self.sync.is_some(), OFF)),
            ("clock", unless(self.clock.is_some(), OFF)),
            ("markers", unless(self.markers.is_some(), NOT_NAMED)),
            (
                "scan_to_space",
                unless(self.scan_to_space.is_some(), NOT_NAMED),
            ),
            ("changes", unless(!self.changes.is_empty(), NOT_NAMED)),
            (
                "compensation",
                unless(self.compensation.is_some(), NOT_NAMED),
            ),
            (
                "bias_tracking",
                unless(self.bias_tracking.is_some(), NOT_NAMED).or(not_robust),
            ),
            (
                "contact",
                unless(self.contact.is_some(), OFF).or(not_robust),
            ),
            ("tip", unless(self.tip.is_some(), OFF)),
            ("scan", unless(self.scan.is_some(), OFF)),
            ("scan.region", unless(self.region().is_some(), NOT_NAMED)),
            (
                "sliding",
                unless(self.sliding.is_some(), OFF).or(not_either),
            ),
            ("carve", unless(self.carve.is_some(), OFF).or(not_either)),
            ("guard", unless(self.guard.is_some(), OFF).or(not_robust)),
            (
                "patch",
                unless(self.patch.is_some(), OFF).or(unless(self.has_patch(), PUBLISHED)),
            ),
            (
                "uncertainty",
                unless(self.uncertainty.is_some(), OFF).or(unless(self.has_patch(), NO_PATCH)),
            ),
            ("robot", unless(self.robot.is_some(), NOT_NAMED)),
            ("refine", unless(self.refine.is_some(), OFF)),
        ]
    }
}

fn unless(is_there: bool, reason: &'static str) -> Option<&'static str> {
    (!is_there).then_some(reason)
}

/// Groups inactive parts by reason.
impl fmt::Display for SceneParts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |names: &[&str]| {
            if names.is_empty() {
                "nothing".to_owned()
            } else {
                names.join(", ")
            }
        };
        let mut by_reason: Vec<(&str, Vec<&str>)> = Vec::new();
        for &LeftOut { part, reason } in &self.left_out {
            match by_reason.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, parts)) => parts.push(part),
                None => by_reason.push((reason, vec![part])),
            }
        }
        let left_out: Vec<_> = by_reason
            .iter()
            .map(|(reason, parts)| format!("{} ({reason})", parts.join(", ")))
            .collect();
        write!(f, "built: {}; left out: ", list(&self.built))?;
        if left_out.is_empty() {
            f.write_str("nothing")
        } else {
            f.write_str(&left_out.join("; "))
        }
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            mesh_mb,
            tree_mb,
            scan_mb,
            patch_mb,
        } = *self;
        let all = mesh_mb + tree_mb + scan_mb + patch_mb;
        write!(
            f,
            "memory at start: {all:.2} MB: mesh {mesh_mb:.2}, its tree {tree_mb:.2}, unrefined scan {scan_mb:.2}, patch \
             {patch_mb:.2}"
        )
    }
}

impl fmt::Display for SceneCost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{}", self.parts, self.memory)
    }
}
