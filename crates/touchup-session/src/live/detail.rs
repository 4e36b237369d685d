//! A scan finer than the tip, and the simplified one that haptic update and live patch work on in
//! its place.

use std::sync::Arc;

use touchup_core::haptic::{RefineParams, Refiner};
use touchup_core::mesh::{Changes, FaceId, FaceTree, MeshError, Simplified, TriMesh, VertexId};
use touchup_core::reconstruct::{PatchDelta, Support};

use super::shown::{Scans, Shown};

/// The scan, and what stands for it.
#[derive(Debug)]
pub(super) struct Detail {
    scan: OriginalScan,
    simplified: Simplified,
    /// once somebody looks
    shown: Option<Shown>,
    rests: u64,
}

/// Where the scan is.
#[derive(Debug)]
enum OriginalScan {
    Own(Box<TriMesh>),
    Shared(Arc<(TriMesh, FaceTree)>),
}

impl Detail {
    /// What the haptic update is to work on, and the detail that it leaves out; a scan that is
    /// coarse enough is taken as it is.
    ///
    /// - `scan`: a copy of `shared`, where that is there.
    /// - `refine`: the mean edge of its region becomes that of what it works on.
    pub fn of(
        scan: TriMesh,
        shared: Option<&Arc<(TriMesh, FaceTree)>>,
        refine: &mut RefineParams,
    ) -> Result<(TriMesh, Option<Self>), MeshError> {
        let Some(edge) = refine.simplified_edge(scan.mean_edge()) else {
            return Ok((scan, None));
        };
        let simplified = Simplified::new(&scan, edge)?;
        // specks alone: nothing is left of them
        if simplified.mesh.face_count() == 0 {
            return Ok((scan, None));
        }
        let working = simplified.mesh.clone();
        if let Some(region) = &mut refine.region {
            region.mean_edge = working.mean_edge();
        }
        let scan = match shared {
            Some(shared) => OriginalScan::Shared(Arc::clone(shared)),
            None => OriginalScan::Own(Box::new(scan)),
        };
        Ok((
            working,
            Some(Self {
                scan,
                simplified,
                shown: None,
                rests: 0,
            }),
        ))
    }

    fn scans(&self) -> Scans<'_> {
        Scans {
            original: self.scan.mesh(),
            simplified: &self.simplified,
        }
    }

    /// The scan, moved as what stands for it.
    pub fn moved_as(&self, working: &TriMesh) -> TriMesh {
        self.simplified.carry(self.scan.mesh(), working)
    }

    /// What the live patch works on, with the tree over its faces.
    pub fn working_scan(&self) -> Arc<(TriMesh, FaceTree)> {
        let mesh = self.simplified.mesh.clone();
        let tree = FaceTree::new(&mesh);
        Arc::new((mesh, tree))
    }

    /// From here on there is a mesh to look at.
    pub fn watch(&mut self) {
        self.shown = Some(Shown::new(self.scans()));
    }

    /// The mesh to look at, as far as it has followed the working mesh; `None` before
    /// [`Self::watch`].
    pub fn shown(&self) -> Option<&TriMesh> {
        self.shown.as_ref().map(Shown::mesh)
    }

    /// Changes of the mesh to look at, as [`TriMesh::take_changes`], after up to `most` of the
    /// working mesh were taken over.
    ///
    /// # Errors
    /// [`MeshError::TooMany`].
    pub fn take_changes(
        &mut self,
        refiner: &mut Refiner,
        most: usize,
        into: &mut Changes,
    ) -> Result<bool, MeshError> {
        let Self {
            scan,
            simplified,
            shown: Some(shown),
            ..
        } = self
        else {
            return Ok(true);
        };
        let has_followed = shown.follow(
            Scans {
                original: scan.mesh(),
                simplified,
            },
            refiner,
            most,
        )?;
        Ok(shown.take_changes(most, into) && has_followed)
    }

    /// The mesh to look at becomes the scan with this patch of all touches so far, as
    /// [`Self::take_changes`] goes on.
    pub fn rest(&mut self, patch: PatchDelta, refiner: &Refiner) {
        if let Some(shown) = &mut self.shown {
            shown.rest(patch, refiner.mesh());
            self.rests += 1;
        }
    }

    /// Whether the mesh to look at is, or becomes, what [`Self::rest`] was last called with.
    pub fn is_resting(&self, refiner: &Refiner) -> bool {
        self.shown
            .as_ref()
            .is_some_and(|shown| shown.rests(refiner.mesh()))
    }

    /// How often [`Self::rest`] was called.
    pub fn rests(&self) -> u64 {
        self.rests
    }

    /// The support of a vertex of the mesh to look at; `None`: it is one of the scan.
    pub fn support(&self, refiner: &Refiner, vertex: VertexId) -> Option<Support> {
        self.shown.as_ref()?.support(refiner, vertex)
    }

    /// A face of the mesh to look at that shows a face of the working mesh.
    pub fn face(&self, working: FaceId) -> Option<FaceId> {
        self.shown.as_ref()?.face(self.scans(), working)
    }

    /// Memory, bytes; of a scan that is shared its owner counts it.
    pub fn bytes(&self) -> usize {
        let own = if let OriginalScan::Own(scan) = &self.scan {
            scan.bytes()
        } else {
            0
        };
        own + self.simplified.bytes()
    }
}

impl OriginalScan {
    fn mesh(&self) -> &TriMesh {
        match self {
            Self::Own(scan) => scan,
            Self::Shared(scan) => &scan.0,
        }
    }
}
