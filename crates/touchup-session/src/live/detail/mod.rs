//! A scan finer than the tip, and its simplified copy for haptic update and live patch.
//!
//! The shown mesh is the scan: its faces, moved with the simplified ones, and the faces of the patch
//! in place of replaced ones. At rest it is the scan with the patch of all touches.

mod at_rest;
mod followed;
mod groups;

use std::sync::Arc;

use at_rest::AtRest;
use followed::{FollowedScan, Scans};
use touchup_geometry::mesh::{
    Changes, FaceId, FaceTree, MeshError, SimplifiedMesh, TriMesh, VertexId,
};
use touchup_method::haptic::{RefineParams, Refiner};
use touchup_method::reconstruct::{PatchDelta, Support};

/// A fine scan and its simplified copy.
#[derive(Debug)]
pub(super) struct Detail {
    scan: OriginalScan,
    simplified: SimplifiedMesh,
    /// present after [`Self::watch`]
    shown: Option<ShownMesh>,
    rests: u64,
}

/// The shown mesh, and its way to follow the working mesh or to rest.
#[derive(Debug)]
struct ShownMesh {
    followed: FollowedScan,
    at_rest: AtRest,
}

/// Owner of the scan.
#[derive(Debug)]
enum OriginalScan {
    Own(Box<TriMesh>),
    Shared(Arc<(TriMesh, FaceTree)>),
}

impl Detail {
    /// Simplifies a scan for the haptic update; returns the working mesh and the detail that it
    /// leaves out. A coarse scan stays as it is.
    ///
    /// - `scan`: a copy of `shared`, if there is one.
    /// - `refine`: the mean edge of its region becomes the mean edge of the working mesh.
    pub fn of(
        scan: TriMesh,
        shared: Option<&Arc<(TriMesh, FaceTree)>>,
        refine: &mut RefineParams,
    ) -> Result<(TriMesh, Option<Self>), MeshError> {
        let Some(edge) = refine.simplified_edge(scan.mean_edge()) else {
            return Ok((scan, None));
        };
        let simplified = SimplifiedMesh::new(&scan, edge)?;
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

    /// The scan, moved like the working mesh.
    pub fn moved_as(&self, working: &TriMesh) -> TriMesh {
        self.simplified.carry(self.scan.mesh(), working)
    }

    /// The simplified scan for the live patch, with the tree over its faces.
    pub fn working_scan(&self) -> Arc<(TriMesh, FaceTree)> {
        let mesh = self.simplified.mesh.clone();
        let tree = FaceTree::new(&mesh);
        Arc::new((mesh, tree))
    }

    /// Starts the shown mesh.
    pub fn watch(&mut self) {
        self.shown = Some(ShownMesh {
            followed: FollowedScan::new(self.scans()),
            at_rest: AtRest::default(),
        });
    }

    /// The shown mesh, as it has followed the working mesh; `None` before [`Self::watch`].
    pub fn shown(&self) -> Option<&TriMesh> {
        self.shown.as_ref().map(|shown| &shown.followed.mesh)
    }

    /// Changes of the shown mesh, as [`TriMesh::take_changes`], after it takes over up to `most`
    /// changes of each kind from the working mesh, or at rest from the patch of all touches.
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
            shown: Some(ShownMesh { followed, at_rest }),
            ..
        } = self
        else {
            return Ok(true);
        };
        let scans = Scans {
            original: scan.mesh(),
            simplified,
        };
        let has_gone_on = at_rest.go_on(followed, scans, refiner.mesh(), most)?;
        let has_followed = if has_gone_on && !at_rest.is_there() {
            followed.follow(scans, refiner, most)?
                && !at_rest.begin(followed, scans, refiner.mesh())
        } else {
            has_gone_on
        };
        Ok(followed.mesh.take_changes(most, into) && has_followed)
    }

    /// Turns the shown mesh into the scan with this patch of all touches, once it has followed the
    /// working mesh and until that changes, by further calls of [`Self::take_changes`].
    pub fn rest(&mut self, patch: PatchDelta, refiner: &Refiner) {
        if let Some(shown) = &mut self.shown {
            shown.at_rest.want(patch, refiner.mesh());
            self.rests += 1;
        }
    }

    /// Whether the shown mesh is, or becomes, the scan with the patch of the last [`Self::rest`].
    pub fn is_resting(&self, refiner: &Refiner) -> bool {
        self.shown
            .as_ref()
            .is_some_and(|shown| shown.at_rest.is_wanted(refiner.mesh()))
    }

    /// Number of calls of [`Self::rest`].
    pub fn rests(&self) -> u64 {
        self.rests
    }

    /// The support of a vertex of the shown mesh; `None` for a vertex of the scan.
    pub fn support(&self, refiner: &Refiner, vertex: VertexId) -> Option<Support> {
        let ShownMesh { followed, at_rest } = self.shown.as_ref()?;
        at_rest
            .support(vertex)
            .or_else(|| followed.support(refiner, vertex))
    }

    /// A face of the shown mesh that shows a face of the working mesh.
    pub fn face(&self, working: FaceId) -> Option<FaceId> {
        self.shown.as_ref()?.followed.face(self.scans(), working)
    }

    /// Memory, bytes; without a shared scan, which its owner counts.
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
