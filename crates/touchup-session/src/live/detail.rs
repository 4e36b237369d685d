//! A scan finer than the tip, and the simplified one that the haptic update works on in its place.

use touchup_core::haptic::{RefineParams, mean_edge};
use touchup_core::mesh::{MeshError, Simplified, TriMesh};

/// The scan, and what stands for it.
#[derive(Debug)]
pub(super) struct Detail {
    scan: TriMesh,
    simplified: Simplified,
}

impl Detail {
    /// What the haptic update is to work on, and the detail that it leaves out; a scan that is coarse enough is taken as it is.
    ///
    /// - `refine`: the mean edge of its region becomes that of what it works on.
    pub fn of(scan: TriMesh, refine: &mut RefineParams) -> Result<(TriMesh, Option<Self>), MeshError> {
        let Some(edge) = refine.simplified_edge(mean_edge(&scan)) else { return Ok((scan, None)) };
        let simplified = Simplified::new(&scan, edge)?;
        // specks alone: nothing is left of them
        if simplified.mesh.face_count() == 0 {
            return Ok((scan, None));
        }
        let working = simplified.mesh.clone();
        if let Some(region) = &mut refine.region {
            region.mean_edge = mean_edge(&working);
        }
        Ok((working, Some(Self { scan, simplified })))
    }

    /// The scan, moved as what stands for it.
    pub fn moved_as(&self, working: &TriMesh) -> TriMesh {
        self.simplified.carry(&self.scan, working)
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.scan.bytes() + self.simplified.bytes()
    }
}
