//! What a scene costs: the parts that are built of it, those that are left out, and the memory that is taken at start.

use std::fmt;

use serde::Serialize;

use super::{Mode, Scene};
use crate::reported;
use touchup_core::haptic::Footprint;

/// Parts by their names in the YAML, in its order; then what the program was built with, by feature.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Built {
    /// there, and paid for
    pub built: Vec<&'static str>,
    /// not there
    pub left_out: Vec<&'static str>,
}

reported! {
    /// Memory at start, MB of 10⁶ bytes, of what was just built; `scan_bytes`: of the unrefined scan, with the trees over it. What was
    /// touched comes to it.
    #[derive(Clone, Copy, PartialEq)]
    pub struct Memory, pub fn of(refiner: Footprint, scan_bytes: usize) {
        /// the mesh that is moved: positions, faces, adjacency, where each vertex was scanned, the normal measured on each face
        pub mesh_mb: f64 = refiner.mesh as f64 / 1e6,
        /// the tree over its faces
        pub tree_mb: f64 = refiner.tree as f64 / 1e6,
        /// the unrefined scan, with a tree of its own where the patch is made beside the samples
        pub scan_mb: f64 = scan_bytes as f64 / 1e6,
        /// what the mesh keeps of a patch that it follows; 0 where there is none
        pub patch_mb: f64 = refiner.patch as f64 / 1e6,
    }
}

/// Parts and memory.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneCost {
    /// parts
    #[serde(flatten)]
    pub parts: Built,
    /// memory
    #[serde(flatten)]
    pub memory: Memory,
}

impl Scene {
    /// What is built of the scene. The mode of the paper leaves out much that may be named all the same.
    ///
    /// - `unused`: parts that the verb at hand has no use for, by name.
    /// - `features`: those that the program can be built with, and whether it was.
    pub fn built(&self, unused: &[&str], features: &[(&'static str, bool)]) -> Built {
        let is_robust = self.refine.as_ref().is_some_and(|refine| refine.mode == Mode::Robust);
        let has_patch = self.patch.is_some() && self.refine.as_ref().is_none_or(|refine| refine.mode == Mode::Robust);
        let parts = [
            ("sync", self.sync.is_some()),
            ("clock", self.clock.is_some()),
            ("markers", self.markers.is_some()),
            ("scan_to_space", self.scan_to_space.is_some()),
            ("compensation", self.compensation.is_some()),
            ("bias_tracking", self.bias_tracking.is_some() && is_robust),
            ("contact", self.contact.is_some() && is_robust),
            ("tip", self.tip.is_some()),
            ("scan", self.scan.is_some()),
            ("scan.region", self.region().is_some()),
            ("sliding", self.sliding.is_some() && (is_robust || has_patch)),
            ("carve", self.carve.is_some() && (is_robust || has_patch)),
            ("guard", self.guard.is_some() && is_robust),
            ("patch", has_patch),
            ("uncertainty", self.uncertainty.is_some() && has_patch),
            ("robot", self.robot.is_some()),
            ("refine", self.refine.is_some()),
        ];
        let (built, left_out): (Vec<_>, Vec<_>) = parts
            .into_iter()
            .chain(features.iter().copied())
            .partition(|(name, is_built)| *is_built && !unused.contains(name));
        let names = |parts: Vec<(&'static str, bool)>| parts.into_iter().map(|(name, _)| name).collect();
        Built { built: names(built), left_out: names(left_out) }
    }
}

impl fmt::Display for Built {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |names: &[&str]| if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
        write!(f, "built: {}; left out: {}", list(&self.built), list(&self.left_out))
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mesh_mb, tree_mb, scan_mb, patch_mb } = *self;
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
